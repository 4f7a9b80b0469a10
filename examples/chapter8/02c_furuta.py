"""Exercise 8.4: the rotational inverted pendulum of figure 8.14, its equations in letters and its torque ellipse."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import drivetrain as dt

UP = np.array([0.0, 0.0, 1.0])


def furuta() -> dt.Arm:
    """2 kg at the end of each rod of 1 m, g = 10 m/s^2; at zero rod 1 points along x and rod 2 stands upright.

    Should the book mean it to hang at zero, every sine and cosine of theta 2 changes its sign, and no more.
    """
    home = [np.eye(4), np.eye(4)]
    home[0][:3, 3], home[1][:3, 3] = (1.0, 0.0, 0.0), (1.0, 0.0, 1.0)
    screws = [[0, 0, 1, 0, 0, 0], [1, 0, 0, 0, 0, 0]]  # about the column, and about rod 1
    inertias = [np.diag([0.0, 4.0, 4.0]), np.diag([4.0, 4.0, 0.0])]
    return dt.Arm.from_screws(home, screws, [2.0, 2.0], inertias, home[1], [0.0, 0.0, -10.0], name="Furuta")


def main(picture: Path) -> None:
    arm, q, rest = furuta(), np.array([np.pi / 4, np.pi / 4]), np.zeros(2)
    print(dt.symbolic_dynamics(arm).text())
    print("(a) torques that hold both joints at 45 deg:", np.round(dt.inverse_dynamics(arm, q, rest, rest), 4), "N m")
    mass = dt.mass_matrix(arm, q)
    print("(b) mass matrix there [kg m^2]:", np.round(mass, 4).tolist())

    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    space = figure.add_subplot(1, 2, 1, projection="3d")
    for angles, style in ((rest, "0.7"), (q, "C0")):
        elbow, tip = dt.link_poses(arm, angles)[:, :3, 3]
        points = np.array([-UP, 0 * UP, elbow, tip])
        space.plot(
            *points.T, color=style, marker="o", label=f"{np.degrees(angles[0]):.0f}°, {np.degrees(angles[1]):.0f}°"
        )
    space.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", title="figure 8.14", box_aspect=(1, 1, 1))
    space.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(-1, 0, 1))
    space.legend(loc="upper left")
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ellipse = mass @ np.array([np.cos(turn), np.sin(turn)])
    plane = figure.add_subplot(1, 2, 2)
    plane.plot(np.cos(turn), np.sin(turn), "0.7", label="accelerations of 1 rad/s²")
    plane.plot(*ellipse, "C0", label="the torques that they take [N m]")
    plane.set(xlabel="joint 1", ylabel="joint 2", title="torque ellipse at 45°, 45°", aspect="equal", ylim=(-10, 7))
    plane.legend(fontsize=8, loc="lower left")
    figure.savefig(picture, dpi=150)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
