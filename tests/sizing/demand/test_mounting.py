"""Drives mounted in an arm: what the arm already states, and what a study puts in its place."""

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.model import ContainedDrive, DriveMass, Mount


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


def test_every_joint_that_holds_less_than_is_to_be_taken_out_is_named(make):
    """The links weigh 1.0 and 0.5 kg, so neither can give up 2 kg."""
    arm = make.planar_arm([0.4, 0.3], [1.0, 0.5])
    held = ContainedDrive(2.0, Mount("child"))
    joints = tuple(make.task(name, contained=held) for name in ("j1", "j2"))
    study = make.study(make.sines(2), arm, drive_mass=DriveMass.REPLACED, joints=joints)
    with pytest.raises(InputError) as caught:
        evaluate(study)
    places = [fault.place.split(":")[0] for fault in caught.value.faults]
    assert places == ["joints.j1.contained", "joints.j2.contained"]
