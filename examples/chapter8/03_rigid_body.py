"""One rigid body: inertia by solids, by composition and from a mesh; wrenches from twists; a book let go."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.rigid_body import figure_free_motion

from drivetrain.errors import InputError
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.spatial.free_body import body_wrench, free_motion, kinetic_energy, space_momentum
from drivetrain.spatial.inertia import combined, cuboid, cylinder, ellipsoid
from drivetrain.spatial.mesh_inertia import TriangleMesh, mesh_body
from drivetrain.spatial.poses import adjoint, exp_pose, pose
from drivetrain.spatial.wrenches import lie_bracket


def main(picture: Path) -> None:
    """Print the exercises of section 8.2, and draw a body that tumbles."""
    iron = 7500.0  # kg/m^3, exercise 8.2
    bar, ball = cylinder(iron * np.pi * 8e-5, 0.02, 0.2), ellipsoid(iron * np.pi * 4e-3 / 3, 0.1, 0.1, 0.1)
    bell = combined([bar, ball.seen_from(pose(point=[0, 0, 0.2])), ball.seen_from(pose(point=[0, 0, -0.2]))])
    print(f"exercise 8.2: {bell.mass:.4f} kg, moments {np.round(bell.principal_axes()[0], 6)} kg m^2")

    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5  # of a hollow box, by equation 8.24
    sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    faces = np.array([triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))])
    both, turned = np.vstack([0.2 * corners, 0.18 * corners]), np.vstack([faces, 8 + faces[:, ::-1]])
    hollow = mesh_body(TriangleMesh(both, turned), density=iron)
    off = hollow.inertia - combined([cuboid(60.0, *[0.2] * 3), cuboid(iron * 0.18**3, *[0.18] * 3).negative()]).inertia
    print(f"hollow box as a mesh: {hollow.mass:.3f} kg, off by {np.abs(off).max():.0e} kg m^2")
    try:
        mesh_body(TriangleMesh(both, turned[1:], "box with a hole"), density=iron)
    except InputError as error:
        print(f"refused: {error}")
    twist, rate, x, y, z, way = np.random.default_rng(8).normal(size=(6, 6))
    a_b, move = exp_pose(way), adjoint(exp_pose(way))
    there = move.T @ body_wrench(bell.spatial_inertia(a_b), move @ twist, move @ rate)
    off = there - body_wrench(bell.spatial_inertia(), twist, rate)
    print(f"8.40 and, in another frame, 8.43 agree to {np.abs(off).max():.0e} N m or N")
    around = sum(lie_bracket(a, lie_bracket(b, c)) for a, b, c in ((x, y, z), (z, x, y), (y, z, x)))
    print(f"exercise 8.5: the three double brackets sum to {np.abs(around).max():.0e}")
    book, time = cuboid(1.2, 0.22, 0.15, 0.03), np.linspace(0.0, 8.0, 8001)
    inertia = book.spatial_inertia()
    starts = [[x, y, z, 0, 0, 0] for y in (2, 4, 8, 16) for x, z in ((8, 0), (0, 8))]
    others = [free_motion(inertia, np.eye(4), start, time[::10]) for start in starts]
    flip = free_motion(inertia, np.eye(4), [0.02, 15.0, 0.02, 0.1, 0, 0], time)
    energy, p = kinetic_energy(inertia, flip.twists), space_momentum(inertia, flip)
    turns, drift = np.count_nonzero(np.diff(np.sign(flip.twists[:, 1]))), np.abs(p - p[0]).max() / np.abs(p).max()
    print(f"a book let go spinning about its middle axis turns over {turns} times in {time[-1]:g} s;")
    print(f"steps of 1 ms keep its energy to {np.ptp(energy) / energy[0]:.0e}, its momentum in space to {drift:.0e}")
    with house_style("rigid body"):
        picture.write_bytes(png_bytes(figure_free_motion(book.inertia, flip, others)))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
