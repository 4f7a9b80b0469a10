"""Modern Robotics, figures 8.2 to 8.4: the numbers printed for the 2R arm of unit masses and lengths."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.dynamics.book.ellipsoids import (
    acceleration_ellipsoid,
    effective_mass,
    tip_acceleration_ellipsoid,
    tip_force_ellipsoid,
    torque_ellipsoid,
)
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm

ARM = planar_2r_arm(Planar2R())
XY = np.eye(3)[:2]
RIGHT, FOLDED = np.radians([[0.0, 90.0], [0.0, 150.0]])
# What stands in figures 8.3 and 8.4, to the digits printed there.
PRINTED = {
    "M right": (torque_ellipsoid, RIGHT, [[3, 1], [1, 1]]),
    "M^-1 right": (acceleration_ellipsoid, RIGHT, [[0.5, -0.5], [-0.5, 1.5]]),
    "M folded": (torque_ellipsoid, FOLDED, [[1.27, 0.13], [0.13, 1]]),
    "M^-1 folded": (acceleration_ellipsoid, FOLDED, [[0.8, -0.11], [-0.11, 1.01]]),
    "Lambda right": (tip_force_ellipsoid, RIGHT, [[1, 0], [0, 2]]),
    "Lambda^-1 right": (tip_acceleration_ellipsoid, RIGHT, [[1, 0], [0, 0.5]]),
    "Lambda folded": (tip_force_ellipsoid, FOLDED, [[4, -1.73], [-1.73, 2]]),
    "Lambda^-1 folded": (tip_acceleration_ellipsoid, FOLDED, [[0.4, 0.35], [0.35, 0.8]]),
}


@pytest.mark.parametrize("name", PRINTED)
def test_printed_matrices(name: str) -> None:
    function, posture, printed = PRINTED[name]
    options = {"axes": XY} if name.startswith("Lambda") else {}
    np.testing.assert_array_equal(np.round(function(ARM, posture, **options).matrix, 2), np.array(printed))


def test_exact_values_behind_them() -> None:
    root = np.sqrt(3.0)
    np.testing.assert_allclose(
        torque_ellipsoid(ARM, FOLDED).matrix, [[3 - root, 1 - root / 2], [1 - root / 2, 1]], rtol=1e-14
    )
    np.testing.assert_allclose(tip_force_ellipsoid(ARM, FOLDED, axes=XY).matrix, [[4, -root], [-root, 2]], rtol=1e-13)
    np.testing.assert_allclose(tip_force_ellipsoid(ARM, FOLDED, axes=XY).semi_axes, [5.0, 1.0], rtol=1e-13)
    np.testing.assert_allclose(torque_ellipsoid(ARM, RIGHT).semi_axes, [2 + np.sqrt(2), 2 - np.sqrt(2)], rtol=1e-14)


def test_caption_of_figure_8_4() -> None:
    """Along y a force feels both masses, along x mass 2 alone; (1, 0) N gives (0.4, 0.35) m/s^2 when folded."""
    assert effective_mass(ARM, RIGHT, [0, 1, 0]) == pytest.approx(2.0, rel=1e-14)
    assert effective_mass(ARM, RIGHT, [1, 0, 0]) == pytest.approx(1.0, rel=1e-14)
    moved = tip_acceleration_ellipsoid(ARM, FOLDED, axes=XY).matrix @ [1.0, 0.0]
    np.testing.assert_array_equal(np.round(moved, 2), [0.4, 0.35])
