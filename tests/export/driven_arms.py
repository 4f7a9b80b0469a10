"""Evaluations for tests of exports: the UR5 example and coupled motors, with losses that all formats represent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetrain.arm.coupling import differential, placed, with_coupling
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.drive import Drive
from drivetrain.drive.friction import FRICTIONLESS, Friction
from drivetrain.drive.gear import Gear
from drivetrain.sizing.judge.evaluate import evaluate_drives
from drivetrain.sizing.results import Evaluation
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

VISCOUS = Friction(viscous=0.4)


def ur5(make, *, thermal: bool = True) -> Evaluation:
    """The example's arm and motion without payload, with drives whose losses every format represents."""
    study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    cycle = replace(study.cycle, payload=np.full_like(study.cycle.payload, -1))
    tasks = tuple(replace(task, amplifier=Amplifier(), friction=VISCOUS) for task in study.joints)
    study = replace(study, cycle=cycle, joints=tasks, supply=Supply(200.0))
    return evaluate_drives(study, {task.name: lossless_drive(make, thermal=thermal) for task in study.joints})


def coupled(make) -> Evaluation:
    """Three joints, the last two driven by a differential."""
    names = ("j2", "j3")
    arm = with_coupling(make.planar_arm([0.4, 0.3, 0.3], [1.5, 1.0, 0.6]), placed(differential(), (1, 2), 3))
    tasks = tuple(
        make.task(f"j{i}", friction=VISCOUS, coupled=names if i > 1 else (), amplifier=Amplifier()) for i in (1, 2, 3)
    )
    study = make.study(make.sines(3, samples=2001), arm=arm, joints=tasks, supply=Supply(200.0))
    return evaluate_drives(study, {f"j{i}": lossless_drive(make) for i in (1, 2, 3)})


def lossless_drive(make, *, thermal: bool = True) -> Drive:
    motor = replace(
        make.motor, no_load_current=None, no_load_speed=None, peak_current=None, max_speed=None, torque_constant=0.2
    )
    motor = motor if thermal else replace(motor, winding_time_constant=None)
    gear = Gear("g", 80.0, kind="planetary", efficiency=1.0, inertia=1e-6, mass=0.3)
    return Drive(motor, gear, VISCOUS, FRICTIONLESS)
