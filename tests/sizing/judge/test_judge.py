"""The judge against the public laws of the drive, its quick verdicts against all figures, and a check that is added."""

from __future__ import annotations

import math
import sys
from dataclasses import make_dataclass, replace

import numpy as np
import pytest
import random_tasks as TASKS
from power_balance import power_balance
from scipy.optimize import brentq

from drivetrain.drive.drive import Drive, loss_speed, motor_torque
from drivetrain.drive.gear import mesh
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.drive.thermal.heat import Mix, mixed_temperature
from drivetrain.records import as_numbers, as_record
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge import checks
from drivetrain.sizing.judge.checks import CHECKS, GEAR, Requirement, table
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.judge import judge_cases
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.judge.parts import parts_of
from drivetrain.study.parts.verdicts import Verdict

CLOSE = 1e-9  # relative; both sum the same terms in another order


def some_operations(study, seed, count=3):
    """Drives drawn from a study's candidates, at work."""
    rng, work, parts = np.random.default_rng(seed), workload(study), parts_of(study)
    for _ in range(count):
        rows = [pairs[int(rng.integers(len(pairs)))] for pairs in parts.pairs]
        drives = {
            j: Drive(parts.motors[motor], parts.gears[gear], study.joints[j].friction, study.joints[j].motor_friction)
            for j, (motor, gear) in enumerate(rows)
        }
        for joint, drive in drives.items():
            yield Operation(work.at(joint, drives).demand(drive), drive, study, joint)


def gear_heat(op, balance, torque):
    """The gear's loss as it warms the housing [W]: its mean, as warm as it makes itself with a cold winding.

    Of a mix that of all parts together, where a sheet knows one node that of each part.
    """
    cycle, everything = op.demand.cycle, slice(0, len(op.demand.time))
    if op.network.resistance_winding_housing > 0.0:
        return np.full(
            len(torque), settled_loss(op, balance, torque, everything, zip(cycle.parts, cycle.shares, strict=True))
        )
    return np.concatenate([
        np.full(part.stop - part.start, settled_loss(op, balance, torque, part, [(part, 1.0)])) for part in cycle.parts
    ])  # fmt: skip


def settled_loss(op, balance, torque, samples, shares):
    demand, wheel, here = op.demand, mesh(op.drive.gear), op.number("setting.gear_temperature")
    coil = op.drive.motor.brake.power or 0.0
    weights = demand.weights[samples] if demand.weights.sum() > 0.0 else np.ones(len(torque[samples]))

    def mean(values):
        return weights @ values[samples] / weights.sum()

    drag, meshed, rubbed = mean(balance.drag), mean(balance.mesh), mean(balance.motor_friction)
    seal = mean(wheel.seal * np.abs(op.motor_speed) * (loss_speed_of(demand) != 0.0))
    if wheel.cooling <= 0.0 or drag == seal or op.task.gear_heat == 0.0:
        return meshed + drag

    def factor(temperature):
        above = min(max(temperature, -10.0), 40.0) - 20.0
        return math.exp(-wheel.cooling * above + wheel.bend * above**2)

    def lost(temperature):
        return meshed + seal + (drag - seal) * factor(temperature) / factor(here)

    squares = 0.0
    for part, share in shares:
        a, b, step = torque[part][:-1], torque[part][1:], np.diff(demand.time[part])
        squares += share * (step @ (a * a + a * b + b * b) / 3.0 / step.sum() if len(a) else torque[part][0] ** 2)
    copper = squares * winding_resistance(op.drive.motor, -10.0) / torque_constant(op.drive.motor, -10.0) ** 2
    path, air = op.network.resistance_housing_ambient, op.study.ambient
    return lost(
        brentq(
            lambda at: air + path * (copper + rubbed + coil + op.task.gear_heat * lost(at)) - at,
            air - 1.0,
            1e7,
            xtol=1e-9,
        )
    )


def loss_speed_of(demand):
    return loss_speed(demand.speed, demand.acceleration, demand.at_rest, parts=demand.cycle.parts)


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_the_judge_says_what_the_public_laws_say(make, kind):
    """Array by array from the drive's own functions, without the judge's loops."""
    for op in some_operations(TASKS.random_study(make, 4, kind), 4):
        if op.missing:
            continue
        demand, cycle, warmth = op.demand, op.demand.cycle, op.number("setting.gear_temperature")
        torque = motor_torque(
            op.drive, demand.gear_torque, demand.speed, demand.acceleration, demand.carrier_acceleration,
            standstill=demand.at_rest, parts=cycle.parts, gear_temperature=warmth,
        )  # fmt: skip
        scale = np.abs(torque.total).max()
        np.testing.assert_allclose(op.motor_torque, torque.total, rtol=CLOSE, atol=CLOSE * scale)
        peak = np.abs(torque.starting if demand.moves else torque.total).max()
        assert op.figures.motor_torque == pytest.approx(peak, rel=CLOSE)
        winding, magnets = op.winding_temperature, float(op.figures.magnet_temperature)
        balance = power_balance(
            op.drive, demand.gear_torque, demand.speed, torque, winding, magnets, gear_temperature=warmth
        )
        coil = op.drive.motor.brake.power or 0.0
        electrical = balance.electrical + coil
        np.testing.assert_allclose(op.power, electrical, rtol=CLOSE, atol=CLOSE * np.abs(op.power).max())
        if op.network is None:
            continue
        loss = balance.motor_friction + coil
        loss += op.task.gear_heat * gear_heat(op, balance, torque.total)
        heat = mixed_temperature(
            op.network, op.drive.motor, demand.time, torque.total, Mix(cycle.parts, cycle.shares), housing_loss=loss
        )
        assert heat.runaway == op.runaway
        assert op.figures.winding_temperature == pytest.approx(heat.peak_winding, rel=1e-7)
        if not heat.runaway:
            rms = np.sqrt(demand.mean((torque.total / torque_constant(op.drive.motor, heat.magnet_temperature)) ** 2))
            phase = 1.0 if demand.moves else np.sqrt(2.0)  # held for ever, one may carry the amplitude
            assert op.figures.rms_current == pytest.approx(phase * rms, rel=1e-7)


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_quick_verdicts_are_those_of_all_figures(make, kind):
    """A look at some samples or at the cold motor rejects nothing that fits, and stages stop at their first failure."""
    seen = set()
    for seed in range(30):
        if seed > 2 and len(seen) == 2:
            break
        study = TASKS.random_study(make, seed, kind)
        work, parts = workload(study), parts_of(study)
        for joint in range(len(study.joints)):
            demand, own = TASKS.own_work(work, joint, {})
            cases, amounts = TASKS.pair_cases(parts, joint, demand), TASKS.own_amounts(own, parts.amounts[joint])
            count, power = len(cases), np.zeros((0, 2, len(demand.time)))
            answers = []
            for until, quick in ((np.inf, False), (1.0, False), (1.0, True)):
                found, binding, lacking = np.zeros(count), *np.zeros((2, count), dtype=np.int64)
                used = np.zeros((count, len(CHECKS)))
                judge_cases(
                    cases, as_numbers(cases), table(), own, amounts, until, quick, power, used, found, binding, lacking
                )
                answers.append((found, binding, lacking, used))
            whole, staged, quick = answers
            feasible = (whole[0] <= 1.0) & (whole[2] < 0)
            assert (((staged[0] <= 1.0) & (staged[2] < 0)) == feasible).all()
            assert (((quick[0] <= 1.0) & (quick[2] < 0)) == feasible).all()
            np.testing.assert_array_equal(staged[0][feasible], whole[0][feasible])
            for row in np.flatnonzero(whole[0] > 1.0):
                first = min(one.stage for one, share in zip(CHECKS, whole[3][row], strict=True) if share > 1.0)
                shares = [u if one.stage <= first else 0.0 for one, u in zip(CHECKS, whole[3][row], strict=True)]
                assert staged[1][row] == int(np.nanargmax(shares))
            seen |= set(feasible.tolist())
    assert seen == {True, False}


def test_a_check_is_one_row(make, monkeypatch):
    """A field of the gear, a row of the table: verdicts, filters and words have it."""
    row = Requirement(
        "gear largest load", "N m", "figures.load_torque", "gear.size", GEAR, "largest load", "safety.peak_torque",
        peak=True, instant="loosening_torque",
    )  # fmt: skip
    monkeypatch.setattr(checks, "CHECKS", (*CHECKS, row))
    for module in ("operation", "verdicts"):
        monkeypatch.setattr(sys.modules[f"drivetrain.sizing.judge.{module}"], "CHECKS", checks.CHECKS)
    study = make.study(make.sines(1), arm=make.planar_arm([0.4], [1.0]))
    told = next(iter(evaluate(study).joints.values())).checks[-1]
    assert told.name == "gear largest load" and told.verdict is Verdict.NOT_CHECKED
    assert told.remark == "largest load is not in the catalogue row"
    weak = replace(study, catalog=replace(study.catalog, gears={"g1": replace(make.gear, size=1e-3)}))
    found = evaluate(weak)
    told = next(iter(found.joints.values())).checks[-1]
    assert told.verdict is Verdict.FAIL and not found.feasible
    assert told.utilisation == pytest.approx(told.required / 1e-3)
    assert told.source == "largest load of gear g1"
    work, parts = workload(weak), parts_of(weak)
    demand, own = TASKS.own_work(work, 0, {})
    cases, none = TASKS.pair_cases(parts, 0, demand), np.zeros((0, 2, len(demand.time)))
    answer, whole = np.zeros(1), np.zeros((2, 1), dtype=np.int64)
    given = TASKS.own_amounts(own, parts.amounts[0])
    judge_cases(cases, as_numbers(cases), table(), own, given, 1.0, True, none, np.zeros((0, 0)), answer, *whole)
    assert answer[0] > 1.0 and whole[0, 0] == len(CHECKS)


def test_records_have_every_number_of_a_description():
    described = make_dataclass("Described", [("a", float), ("b", float | None), ("c", str)], frozen=True)
    record = as_record(described(1.5, None, "text"))
    assert record.dtype.names == ("a", "b")
    assert record.a == 1.5 and np.isnan(record.b)
