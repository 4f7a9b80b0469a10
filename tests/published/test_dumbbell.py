"""Modern Robotics, exercise 8.2: a cast-iron dumbbell, two balls on a bar."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.spatial.inertia import combined, cylinder, ellipsoid
from drivetrain.spatial.poses import pose

DENSITY = 7500.0  # kg/m^3


def test_mass_and_inertia_of_the_dumbbell() -> None:
    bar = cylinder(DENSITY * np.pi * 0.02**2 * 0.2, 0.02, 0.2)
    ball = ellipsoid(DENSITY * 4 / 3 * np.pi * 0.1**3, 0.1, 0.1, 0.1)
    body = combined([bar, ball.seen_from(pose(point=[0, 0, 0.2])), ball.seen_from(pose(point=[0, 0, -0.2]))])
    assert body.mass == pytest.approx(64.7168, abs=5e-5)
    assert np.diag(body.inertia) == pytest.approx([2.771073, 2.771073, 0.251704], abs=5e-7)
    assert body.com == pytest.approx(np.zeros(3), abs=1e-16)
    assert body.spatial_inertia() == pytest.approx(np.diag([*np.diag(body.inertia), *[body.mass] * 3]), abs=1e-14)
