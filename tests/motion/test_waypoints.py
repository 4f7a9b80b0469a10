"""Motions through waypoints: ends, rests, limits of all joints, and faults."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetrain.errors import InputError
from drivetrain.motion.point_to_point import MotionLimits, waypoint_motion
from drivetrain.motion.profiles import Quintic, SCurve, Trapezoid

PROFILES = [Trapezoid(), Quintic(), SCurve()]
POINTS = [[0.0, 0.0], [1.0, -2.0], [1.0, -2.0], [0.3, 0.5]]


@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_points_are_reached_at_rest_at_their_times(profile):
    motion = waypoint_motion(
        "m", ("a", "b"), POINTS, profile=profile, durations=[1.0, 0.5, 2.0], dwell=[0.1, 0.0, 0.0, 0.4]
    )
    assert motion.time[0] == 0.0
    assert motion.time[-1] == pytest.approx(0.1 + 1.0 + 0.5 + 2.0 + 0.4)
    for time, point in ((0.0, 0), (0.1, 0), (1.1, 1), (1.6, 2), (3.6, 3), (4.0, 3)):
        at = np.flatnonzero(np.abs(motion.time - time) < 1e-12)
        assert len(at) >= 1
        assert (motion.position[at] == POINTS[point]).all()
        assert (motion.velocity[at] == 0.0).all()
    assert np.diff(motion.time).max() <= 0.5  # only rests have longer time steps than the sample time


@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_position_is_the_integral_of_speed_and_speed_that_of_acceleration(profile):
    motion = waypoint_motion("m", ("a", "b"), POINTS, profile=profile, durations=[1.0, 0.5, 2.0], sample_time=1e-3)
    half = 0.5 * np.diff(motion.time)[:, None]
    for rate, value in ((motion.acceleration, motion.velocity), (motion.velocity, motion.position)):
        integral = np.cumsum(half * (rate[1:] + rate[:-1]), axis=0)
        assert integral == pytest.approx(value[1:] - value[0], abs=2e-5)  # dt^2/12 times the change of slope


def test_steps_of_acceleration_have_two_samples_and_smooth_profiles_none():
    counts = [
        np.count_nonzero(np.diff(waypoint_motion("m", ("a", "b"), POINTS, profile=p, durations=[1, 0, 1]).time) == 0.0)
        for p in PROFILES
    ]
    # Two consecutive moves: two steps within each, one between them, none at the start and the end.
    assert counts == [5, 0, 0]


@settings(max_examples=60)
@given(
    index=st.integers(0, 2),
    points=st.lists(st.lists(st.floats(-10, 10), min_size=2, max_size=2), min_size=2, max_size=4),
    speed=st.floats(0.1, 10),
    acceleration=st.floats(0.1, 100),
)
def test_every_joint_keeps_its_limits(index, points, speed, acceleration):
    if np.ptp(np.array(points), axis=0).max() < 1e-6:
        return
    jerk = math.inf if index == 0 else 50.0
    limits = MotionLimits([speed, 2 * speed], acceleration, jerk)
    motion = waypoint_motion("m", ("a", "b"), points, profile=PROFILES[index], limits=limits, sample_time=0.1)
    room = 1.0 + 1e-9  # rounding
    assert (np.abs(motion.velocity).max(axis=0) <= np.array([speed, 2 * speed]) * room).all()
    assert np.abs(motion.acceleration).max() <= acceleration * room
    assert (motion.position[0], motion.position[-1]) == (pytest.approx(points[0]), pytest.approx(points[-1]))
    assert np.isfinite(motion.acceleration).all()
    assert (np.diff(motion.time) >= 0.0).all()


def test_the_slowest_joint_sets_the_pace():
    motion = waypoint_motion("m", ("a", "b"), [[0, 0], [1, 4]], profile=Trapezoid(), limits=MotionLimits(2.0, 8.0))
    assert motion.time[-1] == pytest.approx(4.0 / 2.0 + 2.0 / 8.0)
    assert np.abs(motion.velocity).max(axis=0) == pytest.approx([0.5, 2.0])


def test_a_duration_longer_than_needed_slows_the_fastest_law():
    limits = MotionLimits(2.0, 8.0)
    motion = waypoint_motion("m", ("a",), [[0], [4]], profile=Trapezoid(), limits=limits, durations=[4.5])
    assert motion.time[-1] == pytest.approx(4.5)
    assert np.abs(motion.velocity).max() == pytest.approx(2.0 * 2.25 / 4.5)
    assert np.abs(motion.acceleration).max() == pytest.approx(8.0 * (2.25 / 4.5) ** 2)


def faults_of(**options):
    with pytest.raises(InputError) as caught:
        waypoint_motion("m", ("a", "b"), POINTS, profile=options.pop("profile", Trapezoid()), **options)
    return [str(fault) for fault in caught.value.faults]


def test_a_move_in_zero_time_is_an_error():
    faults = faults_of(durations=[0.0, 0.0, 0.0])
    assert len(faults) == 2  # the move of zero length may take no time
    assert all("zero time" in fault for fault in faults)


def test_a_too_short_duration_reports_the_minimum():
    faults = faults_of(durations=[0.1, 0.1, 9.0], limits=MotionLimits(1.0, 1.0))
    assert len(faults) == 1
    assert "at least 3 s" in faults[0]
    exactly = waypoint_motion(
        "m", ("a", "b"), POINTS, profile=Trapezoid(), durations=[3.0, 0.0, 9.0], limits=MotionLimits(1.0, 1.0)
    )
    assert exactly.time[-1] == pytest.approx(12.0)


@pytest.mark.parametrize(
    ("options", "count", "problem"),
    [
        ({}, 2, "needs a duration, or limits"),
        ({"limits": MotionLimits(1.0)}, 2, "acceleration limit or a duration"),
        ({"limits": MotionLimits(0.0, [1.0, -1.0])}, 2, "above zero"),
        ({"durations": [1.0, -1.0, 1.0], "dwell": [0, 0, -1.0, 0]}, 2, "negative"),
        ({"durations": [1.0, 1.0, 1.0], "sample_time": 0.0}, 1, "sample time"),
        ({"durations": [1.0, 1.0]}, 1, "shape"),
        ({"durations": [1.0, 1.0, math.nan]}, 1, "finite"),
    ],
)
def test_every_fault_is_reported(options, count, problem):
    faults = faults_of(**options)
    assert len(faults) == count
    assert all(problem in fault for fault in faults)


def test_no_motion_at_all():
    with pytest.raises(InputError, match="takes no time"):
        waypoint_motion("m", ("a",), [[1.0], [1.0]], profile=Quintic(), limits=MotionLimits(1.0))
    with pytest.raises(InputError, match="at least one point"):
        waypoint_motion("m", ("a",), np.empty((0, 1)), profile=Quintic())


def test_a_dwell_at_one_point_is_a_motion():
    motion = waypoint_motion("hold", ("a",), [[1.0]], profile=Quintic(), dwell=[2.0])
    assert motion.time.tolist() == [0.0, 2.0]
    assert motion.position.tolist() == [[1.0], [1.0]]
    assert not motion.acceleration.any()
