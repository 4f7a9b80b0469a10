"""Time-optimal motion along a path: closed forms, and toppra with the same path and limits."""

from __future__ import annotations

import numpy as np
import pytest
import toppra
from toppra import algorithm, constraint

from drivetrain.motion.time_optimal import quickest_squares, times


def run(
    place: np.ndarray, first: np.ndarray, second: np.ndarray, speed: np.ndarray, acceleration: np.ndarray
) -> np.ndarray:
    """Squares of the speed along a path under limits of joint speeds and accelerations."""
    p, q = np.hstack([first, -first]), np.hstack([second, -second])
    with np.errstate(divide="ignore"):
        most = np.min((speed / np.abs(first)) ** 2, axis=1)
    return quickest_squares(place, p, q, np.tile(acceleration, (len(place), 2)), most)


def test_a_straight_path_is_full_acceleration_then_full_braking() -> None:
    """T = 2 sqrt(L/a); with a speed limit v below the top, L/v + v/a."""
    place = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 201)))
    one, none = np.ones((201, 1)), np.zeros((201, 1))
    free = run(place, one, none, np.array([1e3]), np.array([4.0]))
    assert times(place, free)[-1] == pytest.approx(2.0 * np.sqrt(1.0 / 4.0), rel=1e-3)
    assert np.sqrt(free.max()) == pytest.approx(2.0, rel=1e-3)
    held = run(place, one, none, np.array([0.8]), np.array([4.0]))
    assert times(place, held)[-1] == pytest.approx(1.0 / 0.8 + 0.8 / 4.0, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_toppra_takes_the_same_time(seed: int) -> None:
    random = np.random.default_rng(seed)
    knots = np.linspace(0.0, 1.0, 6)
    path = toppra.SplineInterpolator(knots, random.uniform(-1.5, 1.5, (6, 4)))
    speed, acceleration = random.uniform(1.0, 3.0, 4), random.uniform(3.0, 9.0, 4)
    place = np.linspace(0.0, 1.0, 801)
    peer = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(np.stack([-speed, speed], axis=1)),
            constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
        ],
        path, gridpoints=place, solver_wrapper="seidel",
    )  # fmt: skip
    _, sd, _ = peer.compute_parameterization(0, 0)
    square = run(place, path(place, 1), path(place, 2), speed, acceleration)
    assert times(place, square)[-1] == pytest.approx(times(place, np.asarray(sd) ** 2)[-1], rel=0.01)
    # Our result satisfies the limits at every grid point.
    sdd = np.diff(square) / (2.0 * np.diff(place))
    joint = path(place[:-1], 1) * sdd[:, None] + path(place[:-1], 2) * square[:-1, None]
    assert (np.abs(joint) <= acceleration * (1.0 + 1e-6)).all()
