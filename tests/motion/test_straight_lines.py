"""Load tables with few rows: integrals are those of the straight lines between the rows, not of the rows alone."""

import numpy as np
import pytest

from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.motion.motion import PIECES, LoadTable, sampled


def periodic_mean(values, time):
    return np.tensordot(sample_weights(time), values, axes=1) / (time[-1] - time[0])


def table(time, torque, speed):
    given = (torque, speed, np.zeros_like(speed))
    columns = [np.asarray(values, dtype=float).reshape(len(time), -1) for values in given]
    names = tuple("abc"[: columns[0].shape[1]])
    return LoadTable("t", names, np.asarray(time, dtype=float), *columns)


def test_a_speed_that_turns_between_two_corners_has_the_mean_of_its_magnitude():
    found = sampled(table([0.0, 3.0], [2.0, 2.0], [-10.0, 5.0]))
    # two triangles: from 10 to zero in 2 s, up to 5 in 1 s; the rows alone would give 7.5
    assert periodic_mean(np.abs(found.speed[:, 0]), found.time) == pytest.approx((10.0 + 2.5) / 3.0, rel=1e-12)
    assert found.time[found.speed[:, 0] == 0.0].tolist() == [2.0]


def test_every_joint_turns_at_its_own_instant():
    found = sampled(table([0.0, 4.0], [[1.0, 1.0], [1.0, 1.0]], [[-1.0, 3.0], [1.0, -1.0]]))
    assert found.time[found.speed[:, 0] == 0.0].tolist() == [2.0]
    assert found.time[found.speed[:, 1] == 0.0].tolist() == [3.0]


def test_the_square_of_a_ramp_is_a_third():
    found = sampled(table([0.0, 1.0, 1.0, 2.0], [0.0, 6.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]))
    # the trapezoidal rule over PIECES / 2 pieces adds 1 / (2 pieces^2) to the third
    assert periodic_mean(found.torque[:, 0] ** 2, found.time) == pytest.approx(0.5 * (36.0 / 3.0 + 1.0), rel=1e-4)


def test_corners_stay_and_what_is_level_gets_no_samples():
    corners = table([0.0, 1.0, 1.0, 2.0], [3.0, 3.0, -2.0, -2.0], [4.0, 4.0, 4.0, 4.0])
    for name in ("time", "torque", "speed", "acceleration"):
        np.testing.assert_array_equal(getattr(sampled(corners), name), getattr(corners, name))
    ramp = sampled(table([0.0, 1.0, 2.0], [0.0, 1.0, 7.0], [1.0, 1.0, 1.0]))
    assert {0.0, 1.0, 2.0} <= set(ramp.time.tolist())
    assert ramp.torque[ramp.time == 1.0].tolist() == [[1.0]]


def test_a_dense_table_is_left_alone():
    time = np.linspace(0.0, 1.0, PIECES + 1)
    dense = table(time, np.sin(9.0 * time), 2.0 + np.cos(9.0 * time))
    np.testing.assert_allclose(sampled(dense).time, time, rtol=0, atol=0)
