"""Drives mounted in an arm: what the arm already states, and what a study puts in its place."""

from dataclasses import replace

import numpy as np

from drivetrain.arm.rotors import Rotor
from drivetrain.arm.with_rotors import with_rotors
from drivetrain.sizing.evaluate import evaluate


def test_rotors_that_the_arm_states_do_not_count_beside_the_drives(make):
    """A file of a finished robot tells its rotors; the drives that are judged bring their own."""
    arm = make.planar_arm([0.4, 0.3], [1.0, 0.5])
    tall = [Rotor(-80.0, 3e-4), Rotor(60.0, 5e-4, carrier=-1)]
    bare, geared = (evaluate(make.study(make.sines(2), one)) for one in (arm, with_rotors(arm, tall)))
    for name, joint in bare.joints.items():
        other = geared.joints[name]
        for series in ("gear_torque", "motor_torque", "load_inertia", "bearing_load"):
            np.testing.assert_array_equal(getattr(other.series, series), getattr(joint.series, series))
        assert [replace(check, source="") for check in other.checks] == [
            replace(check, source="") for check in joint.checks
        ]
