"""What is assumed where sheets are silent: stated, never silently zero, never over what is printed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.parts import INPUT_INERTIA_SHARE, FilledParts
from drivetrain.study.model import GearAssumption
from drivetrain.study.parts.mounting import drive_body, drive_mass


def filled_parts(make, motor=None, gear=None, **changes):
    study = make.study(make.table_cycle([0, 1], [1, 1], [1, 1], [0, 0]), **changes)
    catalog = replace(study.catalog, motors={"m1": motor or make.motor}, gears={"g1": gear or make.gear})
    return FilledParts(replace(study, catalog=catalog)), study.joints[0]


def test_printed_numbers_stay(make):
    assumption = {"planetary": GearAssumption(0.5, 0.4, 0.1, "a guess")}
    rows, task = filled_parts(make, gear=replace(make.gear, backdriving_efficiency=0.7, no_load_torque=0.01),
                       gear_assumptions=assumption)  # fmt: skip
    drive = rows.drive(task, "m1", "g1")
    assert (drive.gear.efficiency, drive.gear.backdriving_efficiency, drive.gear.no_load_torque) == (0.8, 0.7, 0.01)
    assert drive.assumptions == ()


def test_unknown_numbers_are_filled_and_told(make):
    assumption = {"planetary": GearAssumption(0.5, 0.4, 0.1, "a guess")}
    silent = replace(make.gear, efficiency=None, inertia=None)
    rows, task = filled_parts(make, gear=silent, gear_assumptions=assumption)
    drive = rows.drive(task, "m1", "g1")
    assert (drive.gear.efficiency, drive.gear.backdriving_efficiency) == (0.5, 0.4)
    assert drive.gear.no_load_torque == pytest.approx(0.1 * 20.0 / 50.0)
    assert len(drive.assumptions) == 4
    assert sum("a guess" in words for words in drive.assumptions) == 3


def test_input_inertia_is_a_share_of_a_cylinder(make):
    wide = replace(make.gear, inertia=None, diameter=0.06)
    rows, task = filled_parts(make, gear=wide)
    expected = INPUT_INERTIA_SHARE["planetary"] * 0.5 * 0.4 * 0.03**2
    assert rows.drive(task, "m1", "g1").gear.inertia == pytest.approx(expected)
    # Without a size, that of a cylinder of 5200 kg/m^3 as long as wide: its mass comes back.
    rows, task = filled_parts(make, gear=replace(wide, diameter=None))
    inertia = rows.drive(task, "m1", "g1").gear.inertia
    diameter = np.sqrt(inertia / INPUT_INERTIA_SHARE["planetary"] * 8 / 0.4)
    assert 5200 * np.pi / 4 * diameter**3 == pytest.approx(0.4)


def test_unknown_mass_means_unknown_inertia_and_no_check(make):
    study = make.study(make.table_cycle([0, 1], [1, 1], [1, 1], [0, 0]))
    weightless = replace(make.gear, inertia=None, mass=None)
    study = replace(study, catalog=replace(study.catalog, gears={"g1": weightless}))
    check = next(c for c in evaluate(study).joints["j1"].checks if c.name == "motor peak torque")
    assert check.utilisation is None
    assert "input inertia" in check.remark


def test_body_of_a_drive(make):
    motor = replace(make.motor, mass=2.0, diameter=0.08, length=0.1)
    rows, task = filled_parts(make, motor=motor)
    direct = rows.drive(task, "m1", "")
    mass, across, along = drive_body(direct)
    assert drive_mass(direct) == mass == 2.0
    assert across == pytest.approx(2.0 * (3 * 0.04**2 + 0.1**2) / 12)
    assert along == pytest.approx(2.0 * 0.04**2 / 2 - motor.rotor_inertia)
    sizeless = rows.drive(task, "m1", "g1")
    assert drive_mass(sizeless) == pytest.approx(2.4)
    assert drive_body(sizeless)[1] > across
