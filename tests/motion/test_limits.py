"""Checks of motions against the joints' limits."""

import math

import numpy as np
import pytest

from drivetrain.motion.checks import limit_notes
from drivetrain.motion.duty_cycle import Step, build_cycle
from drivetrain.motion.point_to_point import waypoint_motion
from drivetrain.motion.profiles import Trapezoid

FREE = np.array([math.inf, math.inf])
MOTION = waypoint_motion(
    "m", ("a", "b"), [[0, 0], [1, -2], [0, 0]], profile=Trapezoid(), durations=[1.0, 1.0], sample_time=0.01
)


def test_inside_and_exactly_at_the_limits():
    assert limit_notes(MOTION, -FREE, FREE, FREE) == ((), ())
    exact = limit_notes(MOTION, np.array([0.0, -2.0]), np.array([1.0, 0.0]), np.array([1.5, 3.0]))
    assert exact == ((), ())


def test_position_beyond_a_limit_is_a_fault_at_the_worst_instant():
    faults, warnings = limit_notes(MOTION, np.array([-1.0, -1.5]), np.array([0.9, 1.0]), FREE, name="pick")
    assert warnings == ()
    assert [(fault.place, fault.value) for fault in faults] == [("pick, joint a", 1.0), ("pick, joint b", -2.0)]
    assert "above the upper limit of 0.9 rad or m at t = 1 s" in faults[0].problem
    assert "below the lower limit of -1.5 rad or m at t = 1 s" in faults[1].problem


def test_a_position_beyond_a_limit_is_shown_in_degrees_with_its_unit():
    third = waypoint_motion("m", ("a",), [[0.0], [math.pi / 3.0], [0.0]], profile=Trapezoid(), durations=[1.0, 1.0])
    (fault,) = limit_notes(third, np.array([0.0]), np.array([0.5]), np.array([9.0]), slides=np.array([False])).faults
    assert "28.6479 deg at" in fault.problem and fault.value == 60.0


def test_a_motion_that_leaves_a_range_on_both_sides_is_one_fault():
    """Positions in a wrong unit do so at every joint."""
    there = waypoint_motion("m", ("a",), [[0.0], [1.0], [-3.0]], profile=Trapezoid(), durations=[1.0, 1.0])
    (fault,) = limit_notes(there, np.array([-0.5]), np.array([0.5]), np.array([9.0])).faults
    assert fault.value == 1.0
    above, below = "goes above the upper limit of 0.5 rad or m at t = 1 s", "below the lower limit of -0.5 rad or m"
    assert fault.problem == f"{above}, and to -3, {below} at t = 2 s"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speed_beyond_a_limit_is_a_warning_for_either_sign(sign):
    points = sign * np.array([[0.0, 0.0], [1.0, -2.0]])
    motion = waypoint_motion("m", ("a", "b"), points, profile=Trapezoid(), durations=[1.0])
    faults, warnings = limit_notes(motion, -FREE, FREE, np.array([1.6, 2.5]))
    assert faults == ()
    assert len(warnings) == 1
    assert "joint b reaches 3 " in warnings[0]


def test_a_cycle_can_be_checked_too():
    cycle = build_cycle([Step(MOTION)])
    faults, _ = limit_notes(cycle, -FREE, np.array([0.5, 1.0]), FREE)
    assert len(faults) == 1
