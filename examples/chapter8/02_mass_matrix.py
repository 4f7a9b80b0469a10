"""The mass matrix as an ellipsoid: figure 8.3, torques that give the 2R arm accelerations of unit size."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.mass_matrix import figure_mass_ellipsoids

from drivetrain.dynamics.book.ellipsoids import acceleration_ellipsoid, torque_ellipsoid
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm
from drivetrain.report.charts.plotting import house_style, png_bytes


def main(picture: Path) -> None:
    """Print the ellipsoids at the book's two postures, and draw them."""
    arm = planar_2r_arm(Planar2R())
    postures = np.radians([[0.0, 90.0], [0.0, 150.0]])
    torques, accelerations = torque_ellipsoid(arm, postures), acceleration_ellipsoid(arm, postures)
    for row, posture in enumerate(postures):
        print(f"theta = (0, {np.degrees(posture[1]):.0f} deg)")
        print("  M      =", np.round(torques.matrix[row], 3).tolist(), "kg m^2")
        print("  M^-1   =", np.round(accelerations.matrix[row], 3).tolist(), "1/(kg m^2)")
        heavy, light = torques.semi_axes[row]
        angles = np.degrees(np.arctan2(*torques.directions[row][::-1])) % 180.0
        print(f"  needs {heavy:.3f} N m a rad/s^2 along {angles[0]:.1f} deg, {light:.3f} along {angles[1]:.1f} deg")
    with house_style("mass ellipsoids"):
        picture.write_bytes(png_bytes(figure_mass_ellipsoids(arm, postures)))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
