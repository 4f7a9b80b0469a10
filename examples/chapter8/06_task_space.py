"""Section 8.6: the dynamics of a UR5's tip, and what becomes of it as the wrist runs into its singularity."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.task_space import figure_task_space

import drivetrain as dt
from drivetrain.arm.kinematics import body_jacobian, body_jacobian_rate
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.task_space import Damped, Reduced, task_space_dynamics
from drivetrain.report.charts.plotting import house_style, png_bytes

READY = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
SPEED = np.array([0.3, -0.2, 0.4, 0.1, -0.5, 0.2])  # rad/s


def twice(arm: dt.Arm, q: np.ndarray) -> str:
    """The largest inertia by inverting twice, as many programs do."""
    jacobian = body_jacobian(arm, q)
    try:
        return (
            f"{np.linalg.norm(np.linalg.inv(jacobian @ np.linalg.inv(dt.mass_matrix(arm, q)) @ jacobian.T), 2):17.6e}"
        )
    except np.linalg.LinAlgError:
        return f"{'fails':>17}"


def main(picture: Path) -> None:
    """Print Lambda and eta at a regular posture and near a singular one, and draw the way there."""
    arm = dt.load_arm("ur5-corrected")
    terms = task_space_dynamics(arm, READY, SPEED)
    back = np.linalg.inv(body_jacobian(arm, READY))
    inertia = back.T @ dt.mass_matrix(arm, READY) @ back  # equations 8.90 and 8.91, as they stand
    eta = back.T @ bias_torque(arm, READY, SPEED) - inertia @ body_jacobian_rate(arm, READY, SPEED) @ SPEED
    print("Lambda at the ready posture, tip frame, diagonal [kg m^2, kg]:", np.round(np.diag(terms.inertia), 3))
    print("eta [N m, N]:", np.round(terms.bias + terms.gravity, 3))
    print(f"  against J^-T M J^-1: {np.abs(terms.inertia - inertia).max():.1e}", end="")
    print(f", eta: {np.abs(terms.bias + terms.gravity - eta).max():.1e}, condition {terms.condition:.0f}")

    angles = np.geomspace(1.0, 1e-9, 200)  # the fifth joint at zero puts the fourth and sixth axis in line
    path, speeds = np.tile(READY, (len(angles), 1)), np.tile(SPEED, (len(angles), 1))
    path[:, 4] = angles
    ways = {"damped below 1e-3": Damped(1e-3), "damped below 1e-6": Damped(), "reduced below 1e-3": Reduced(1e-3)}
    answers = {name: task_space_dynamics(arm, path, speeds, near_singular=way) for name, way in ways.items()}
    print("\nwrist angle [rad]   condition   damped below 1e-6: rank   largest inertia   inverting twice")
    for i in range(0, len(angles), 22):
        found = answers["damped below 1e-6"]
        largest = np.linalg.norm(found.inertia[i], 2)
        print(f"{angles[i]:17.1e} {found.condition[i]:11.1e} {found.rank[i]:24} {largest:17.6e} {twice(arm, path[i])}")
    with house_style("task space"):
        picture.write_bytes(png_bytes(figure_task_space(angles, answers, label="wrist angle [rad]", logarithmic=True)))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
