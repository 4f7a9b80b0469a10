"""How massy the tip feels: figure 8.4 for the book's 2R arm, and the same question put to a UR5 with its rotors."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.mass_matrix import PLANE_XY, figure_tip_mass

import drivetrain as dt
from drivetrain.dynamics.book.ellipsoids import effective_mass, tip_acceleration_ellipsoid, tip_force_ellipsoid
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm
from drivetrain.report.charts.plotting import house_style, png_bytes


def main(picture: Path) -> None:
    """Print effective masses, and draw them for the 2R arm."""
    arm = planar_2r_arm(Planar2R())
    postures = np.radians([[0.0, 90.0], [0.0, 150.0]])
    forces = tip_force_ellipsoid(arm, postures, axes=PLANE_XY)
    moved = tip_acceleration_ellipsoid(arm, postures, axes=PLANE_XY)
    for row, posture in enumerate(postures):
        print(f"theta = (0, {np.degrees(posture[1]):.0f} deg)")
        print("  Lambda    =", np.round(forces.matrix[row], 3).tolist(), "kg")
        print("  Lambda^-1 =", np.round(moved.matrix[row], 3).tolist(), "1/kg")
        print("  a force of 1 N along x accelerates the tip by", np.round(moved.matrix[row][:, 0], 3).tolist(), "m/s^2")
    x, y = (effective_mass(arm, postures[0], way) for way in PLANE_XY)
    print(f"pushed at (0, 90 deg) the tip weighs {x:.3g} kg along x (mass 2 alone), {y:.3g} kg along y (both masses)")

    bare = dt.load_arm("ur5")
    # Rotor inertias are not published; these are of motors that an arm of this size has.
    geared = dt.with_rotors(bare, [dt.Rotor(100.0, 1e-4)] * 3 + [dt.Rotor(100.0, 2e-5)] * 3)
    q = np.radians([0.0, -60.0, 80.0, -110.0, -90.0, 0.0])
    for name, robot in (("without rotors", bare), ("with rotors at ratio 100", geared)):
        masses = [float(effective_mass(robot, q, way)) for way in np.eye(3)]
        print(f"UR5 {name}: its tip feels like {masses[0]:.1f}, {masses[1]:.1f}, {masses[2]:.1f} kg along x, y, z")
    with house_style("tip mass"):
        picture.write_bytes(png_bytes(figure_tip_mass(arm, postures)))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
