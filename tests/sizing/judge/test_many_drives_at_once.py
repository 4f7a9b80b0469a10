"""Many drives at one joint in one call of the judge: each as if it were alone, whatever stands before it.

What a call is asked, all figures, the first failure or a quick look, changes no verdict; and the rules by which a
figure, a limit and an allowance become a verdict, in tables.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from one_axis import SAFETY, constant, random_axis

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.gear import complete
from drivetrain.records import as_numbers, as_record
from drivetrain.sizing.demand.series import UnitLoads, joint_series
from drivetrain.sizing.judge.cases import cases_of
from drivetrain.sizing.judge.checks import CHECKS, GEAR, HEAT, SPEED, TORQUE, table
from drivetrain.sizing.judge.judge import first_lacking, judge_cases, utilisation_of, worst
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.model import Stop

inf, nan = math.inf, math.nan
DRAG = {
    "mesh_efficiency": 0.85, "drag_torque": 0.013, "drag_speed": 40.0, "drag_temperature_1": 0.021,
    "drag_temperature_2": 1.7e-4, "efficiency": None,
}  # fmt: skip
DRIVES = {  # changes of motor and gear, by what becomes of the drive
    "holds": ({}, {}),
    "fails by its gear": ({}, {"repeated_peak_torque": 20.0}),
    "fails by its speed": ({"max_speed": 200.0}, {}),
    "fails by its torque": ({"peak_torque": 0.25}, {}),
    "fails by its heat": ({"max_winding_temperature": 60.0}, {}),
    "has drag": ({}, {**DRAG, "drag_speed_exponent": 0.45}),
    "has drag of another exponent": ({}, {**DRAG, "drag_speed_exponent": 0.7, "ratio": -55.0}),
    "has drag that knows no speed": ({}, {**DRAG, "drag_speed_exponent": 0.0}),
    "hides what its gear loses": ({}, {"efficiency": None}),
    "hides its rotor": ({"rotor_inertia": None}, {}),
    "hides its limit": ({}, {"repeated_peak_torque": None, "continuous_torque": None}),
    "hides its inductance": ({"inductance": None, "max_winding_temperature": None}, {}),
    "has magnets that grow": ({"magnet_coefficient": 0.002}, {}),
    "locks itself": ({}, {"backdriving_efficiency": -0.1}),
    "holds again": ({}, {}),
}  # fmt: skip
BEARING = {
    "bearing_pitch_diameter": 0.11, "bearing_offset": 0.043, "bearing_dynamic_rating": 4e5,
    "bearing_static_rating": 12e5,
}  # fmt: skip
TASK = {"amplifier": Amplifier(peak_current=40.0, continuous_current=20.0, peak_time=1.0)}


PLAIN = {"peak_torque": 3.0, "max_winding_temperature": 200.0}, {
    "ratio": 60.0, "efficiency": 0.9, "stiffness_1": 8e3, "momentary_torque": 400.0, **BEARING,
}  # fmt: skip


def some(op):
    """Every second drive of the table, the one half for stops on a ramp, the other for stops at a current."""
    return list(DRIVES)[op.task.stop.ramp is None :: 2]


def drives_of(op):
    motor, gear = op.drive.motor, op.drive.gear
    return [
        replace(op.drive, motor=replace(motor, **PLAIN[0] | one), gear=replace(gear, **PLAIN[1] | other))
        for one, other in map(DRIVES.get, some(op))
    ]


def judged(op, drives, series, amounts=None, until=inf, quick=False, power=None, rows=CHECKS):
    """Cases, and of each the largest utilisation, its check, the check that lacks something, and all utilisations."""
    cases, count = cases_of(op.study, op.joint, op.demand, drives), len(drives)
    found, used, places = np.zeros(count), np.zeros((count, len(rows))), np.zeros((2, count), dtype=np.int64)
    amounts = np.zeros((count, 0)) if amounts is None else amounts
    power = np.zeros((0, 2, len(op.demand.time))) if power is None else power
    judge_cases(cases, as_numbers(cases), table(rows), series, amounts, until, quick, power, used, found, *places)
    return cases, found, *places, used


def lacking_of(one, used):
    """The first check that keeps a drive from being proven: it matters or its numbers are known, and it is not made."""
    for k, row in enumerate(CHECKS):
        required, limit = one.number(row.required), one.number(row.limit)
        limit = one.number(row.assumed_limit) if math.isnan(limit) and row.assumed_limit else limit
        asked = one.number(row.applies) != 0.0 and not (one.direct and (row.of_gear or row.stage == GEAR))
        if asked and math.isnan(used[k]) and (row.essential or not math.isnan(required + limit)):
            return k
    return -1


@pytest.fixture(params=["ramp", "current"])
def op(make, request):
    """Its motor's friction is known; any stop on a ramp, or at a current."""
    stop = Stop(ramp=0.35) if request.param == "ramp" else Stop(current=30.0)
    return random_axis(make, task={**TASK, "stop": stop}, safety=replace(SAFETY, inertia_ratio=50.0, life=3e4))


def test_each_is_judged_as_if_it_were_alone(op):
    """All figures, utilisations, powers; what is largest and what is lacking follow from these."""
    drives, rng = drives_of(op), np.random.default_rng(3)
    series, begun = joint_series(op.demand), rng.normal(size=(len(drives), 2, len(op.demand.time)))
    power = begun.copy()
    cases, found, binding, lacking, used = judged(op, drives, series, power=power)
    for k, drive in enumerate(drives):
        one = Operation(op.demand, drive, op.study, op.joint)
        alone = np.array([one.judgement.used[row.name] for row in CHECKS])
        np.testing.assert_array_equal(used[k], alone)
        np.testing.assert_array_equal(as_numbers(cases[k : k + 1])[0], one._numbers)
        np.testing.assert_allclose(power[k] - begun[k], one.judgement.power, atol=1e-9)
        assert found[k] == max(np.nanmax(alone), 0.0) and binding[k] == np.nanargmax(alone)
        assert lacking[k] == lacking_of(one, alone)
    summed = begun[:1].copy()
    judged(op, drives[:2], series, power=summed)
    np.testing.assert_allclose(summed[0], begun[0] + (power - begun)[:2].sum(axis=0), rtol=1e-9, atol=1e-9)
    feasible = {name for name, most, lacks in zip(some(op), found, lacking, strict=True) if most <= 1.0 and lacks < 0}
    assert feasible == {name for name in some(op) if name.startswith(("holds", "has"))}


def test_a_quick_look_changes_no_verdict(op):
    drives, series = drives_of(op), joint_series(op.demand)
    _, found, _, lacking, used = judged(op, drives, series)
    feasible = (found <= 1.0) & (lacking < 0)
    for quick in (False, True):
        _, most, binding, lacks, shares = judged(op, drives, series, until=1.0, quick=quick)
        np.testing.assert_array_equal((most <= 1.0) & (lacks < 0), feasible)
        np.testing.assert_array_equal(most[feasible], found[feasible])
        np.testing.assert_array_equal(shares[feasible], used[feasible])
        for k in np.flatnonzero(most > 1.0):
            if quick and binding[k] == -1:  # known before anything is computed
                assert most[k] == inf and lacks[k] >= 0
                continue
            first = min(row.stage for row, share in zip(CHECKS, used[k], strict=True) if share > 1.0)
            assert CHECKS[binding[k]].stage == first
            if not quick:
                least = [share if row.stage <= first else -1.0 for row, share in zip(CHECKS, used[k], strict=True)]
                assert binding[k] == np.nanargmax(least) and most[k] == np.nanmax(least)


def test_a_drive_that_is_far_too_strong(op):
    """Its largest utilisation is as small as it is; where nothing can be checked there is none."""
    rows = tuple(row for row in CHECKS if row.name == "gear maximum input speed")
    strong = replace(op.drive, gear=replace(op.drive.gear, max_input_speed=1e5))
    _, found, binding, lacking, used = judged(op, [strong], joint_series(op.demand), rows=rows)
    assert found[0] == used[0, 0] == pytest.approx(op.figures.input_speed / 1e5) and binding[0] == 0
    rows = tuple(row for row in CHECKS if row.name == "gear ratcheting in a jam")
    _, found, binding, lacking, _ = judged(op, [strong], joint_series(op.demand), rows=rows)
    assert (found[0], binding[0], lacking[0]) == (0.0, -1, -1)


def test_magnets_that_grow_stronger_are_not_judged_cold(make):
    """Of a peak current between what the warm motor asks and what it would ask cold."""
    limits, gear = PLAIN
    op = random_axis(
        make, {**limits, "magnet_coefficient": 0.01}, gear, TASK, safety=replace(SAFETY, inertia_ratio=50.0)
    )
    cold = op.figures.motor_torque / constant(op.drive.motor, op.study.ambient)
    assert op.figures.motor_current < 0.95 * cold
    limit = op.safety.peak_torque * math.sqrt(op.figures.motor_current * cold)
    drive = replace(op.drive, motor=replace(op.drive.motor, peak_current=limit))
    series, name = joint_series(op.demand), "motor peak current"
    for quick in (False, True):
        _, found, _, lacking, _ = judged(op, [drive], series, until=1.0, quick=quick)
        assert found[0] <= 1.0 and lacking[0] < 0
    strange = replace(drive.motor, magnet_coefficient=-0.01)  # the warm motor asks more than the cold one does
    _, found, binding, _, _ = judged(op, [replace(drive, motor=strange)], series, until=1.0, quick=True)
    assert found[0] > 1.0 and CHECKS[binding[0]].name == name


@pytest.mark.parametrize("asked", ["bearing", "brake", "resonance", "stop", "ratio", "ramp"])
def test_loads_of_the_drives_themselves(make, asked):
    """Sums of rows times amounts, for any one of the figures that need them."""
    stop = Stop(current=30.0) if asked == "stop" else Stop(ramp=0.35)
    brakes = {"brakes": ()} if asked != "brake" else {}
    task = {**TASK, **brakes, "stop": stop, "output_bearing": "gear" if asked == "bearing" else "external"}
    wish = {} if asked == "resonance" else {"stiffness": make.study(make.sines(1, samples=3)).stiffness}
    safety = replace(SAFETY, inertia_ratio=50.0 if asked == "ratio" else None)
    op = random_axis(make, task=task, safety=safety, **wish)
    demand, rng, drives = op.demand, np.random.default_rng(5), drives_of(op)[:1] * 3
    samples, states = len(demand.time), len(demand.stop.torque)
    count = 1 if asked == "stop" else 2
    rows = UnitLoads(
        *(rng.normal(size=(count, *shape)) for shape in ((samples,), (6, samples), (samples,), (states,), (samples,)))
    )
    amounts = rng.uniform(0.1, 0.4, (3, count))
    cases, *_, used = judged(op, drives, joint_series(demand, rows), amounts)
    names = {"bearing": ["tilting_moment", "radial_load", "axial_load"], "brake": ["holding_torque"],
             "resonance": ["required_stiffness"], "ratio": ["inertia_ratio"]}  # fmt: skip
    for k, drive in enumerate(drives):
        torque, wrench, inertia, stopped, static = (np.tensordot(amounts[k], row, 1) for row in rows)
        loaded = replace(
            demand, gear_torque=demand.gear_torque + torque, wrench=demand.wrench + wrench.T,
            load_inertia=demand.load_inertia + inertia, static_torque=demand.static_torque + static,
            stop=demand.stop._replace(torque=demand.stop.torque + stopped),
        )  # fmt: skip
        one = Operation(loaded, drive, op.study, op.joint)
        for name in ["motor_torque", "load_torque", "momentary_torque", *names.get(asked, [])]:
            assert cases[k].figures[name] == pytest.approx(one.figures[name], rel=1e-9)
        made = [one.judgement.used[row.name] for row in CHECKS]
        np.testing.assert_allclose(used[k], made, rtol=1e-9)


# How a figure, its limit and an allowance become a verdict. Fields of a row of numbers stand for those of a case.

FIELDS = ("required", "factor", "allowance", "limit", "assumed_limit", "origin", "applies")


def row_of(**numbers):
    values = {"factor": 1.0, "allowance": 0.0, "assumed_limit": nan, "origin": 0.0, "applies": 1.0} | numbers
    return np.array([values[name] for name in FIELDS])


def check_of(**changes):
    plain = {name: k for k, name in enumerate(FIELDS)}
    return SimpleNamespace(
        **plain | {"stage": GEAR, "rise": 0, "geared": 0, "peak": 0, "essential": 0, "figured": 0} | changes
    )


RULES = [  # numbers, changes of the check, utilisation
    ({"required": 3.0, "limit": 4.0}, {}, 0.75),
    ({"required": 3.0, "factor": 1.5, "limit": 4.0}, {}, 1.125),
    ({"required": 3.0, "limit": 0.0}, {}, inf),
    ({"required": 3.0, "limit": -2.0}, {}, inf),
    ({"required": 0.0, "limit": 0.0}, {}, 0.0),
    ({"required": -1.0, "limit": -2.0}, {}, 0.0),
    ({"required": 0.05, "limit": 0.0}, {}, inf),
    ({"required": 3.0, "limit": 0.05}, {}, 60.0),
    ({"required": inf, "limit": 4.0}, {}, inf),
    ({"required": inf, "limit": nan}, {}, inf),
    ({"required": nan, "limit": 4.0}, {}, nan),
    ({"required": 3.0, "limit": nan}, {}, nan),
    ({"required": 3.0, "limit": inf}, {}, 0.0),
    ({"required": 3.0, "limit": nan, "assumed_limit": 5.0}, {}, 0.6),
    ({"required": 5.0, "limit": nan, "assumed_limit": 5.0}, {}, 1.0),
    ({"required": 5.2, "limit": nan, "assumed_limit": 5.0}, {}, nan),
    ({"required": inf, "limit": nan, "assumed_limit": 5.0}, {}, inf),
    ({"required": 5.2, "limit": 5.0, "assumed_limit": 5.0}, {}, 1.04),
    ({"required": 5.2, "limit": 5.0, "assumed_limit": 9.0}, {}, 1.04),
    ({"required": 3.0, "limit": 4.0, "applies": 0.0}, {}, nan),
    ({"required": 3.0, "limit": 4.0, "applies": 0.1}, {}, 0.75),
    ({"required": 3.0, "limit": 4.0}, {"geared": 1}, 0.75),
    ({"required": 80.0, "limit": 120.0, "origin": 30.0}, {"rise": 1}, 5.0 / 9.0),
    ({"required": 40.0, "factor": 2.0, "limit": 120.0, "origin": 30.0}, {"rise": 1}, 5.0 / 9.0),
    ({"required": 80.0, "limit": nan, "assumed_limit": 130.0, "origin": 30.0}, {"rise": 1}, 0.5),
    ({"required": 20.0, "limit": 25.0, "origin": 30.0}, {"rise": 1}, inf),
    ({"required": 20.0, "limit": 30.0, "origin": 30.0}, {"rise": 1}, inf),
    ({"required": 20.0, "limit": 30.05, "origin": 30.0}, {"rise": 1}, -200.0),
    ({"required": nan, "limit": 25.0, "origin": 30.0}, {"rise": 1}, nan),
    ({"required": 20.0, "limit": 25.0, "origin": 30.0}, {}, 0.0),
    # An allowance counts, with the factor, where the check would pass without it.
    ({"required": 3.0, "limit": 4.0, "allowance": 0.9}, {}, 0.75),
    ({"required": 3.0, "limit": 4.0, "allowance": 1.0}, {}, 0.75),
    ({"required": 3.0, "limit": 4.0, "allowance": 1.1}, {}, nan),
    ({"required": 3.0, "limit": 4.0, "allowance": nan}, {}, nan),
    ({"required": 3.0, "limit": 4.0, "allowance": 0.3, "factor": 1.25}, {}, nan),
    ({"required": 3.0, "limit": 4.0, "allowance": 0.1, "factor": 1.25}, {}, 0.9375),
    ({"required": 4.0, "limit": 4.0, "allowance": 0.05}, {}, nan),
    ({"required": 4.4, "limit": 4.0, "allowance": 0.1}, {}, 1.1),
    ({"required": -1.0, "limit": 0.0, "allowance": 0.5}, {}, nan),
    ({"required": -1.0, "limit": 0.05, "allowance": 0.5}, {}, -20.0),
    ({"required": 80.0, "limit": 120.0, "origin": 30.0, "allowance": 39.0}, {"rise": 1}, 5.0 / 9.0),
    ({"required": 80.0, "limit": 120.0, "origin": 30.0, "allowance": 41.0}, {"rise": 1}, nan),
    ({"required": nan, "limit": 4.0, "allowance": 1.1}, {}, nan),
    ({"required": 3.0, "limit": inf, "allowance": 1.1}, {}, 0.0),
]


@pytest.mark.parametrize(("numbers", "changes", "wanted"), RULES)
def test_utilisation(numbers, changes, wanted):
    for direct in (0.0, 1.0):
        found = utilisation_of(SimpleNamespace(direct=direct), row_of(**numbers), check_of(**changes))
        expected = nan if direct and changes.get("geared") else wanted
        assert found == pytest.approx(expected, rel=1e-12, nan_ok=True)


UNMADE = [  # numbers, changes of the check, whether the torque is known: whether it lacks something at first, and then
    ({"required": 3.0, "limit": 4.0}, {}, True, False, False),
    ({"required": 3.0, "limit": 4.0}, {"essential": 1}, True, False, False),
    ({"required": 3.0, "limit": nan}, {}, True, False, False),
    ({"required": 3.0, "limit": nan}, {"essential": 1}, True, True, True),
    ({"required": 3.0, "limit": nan}, {"essential": 1, "stage": HEAT}, True, True, True),
    ({"required": 3.0, "limit": nan, "applies": 0.0}, {"essential": 1}, True, False, False),
    ({"required": 3.0, "limit": nan, "assumed_limit": 4.0}, {"essential": 1}, True, False, False),
    ({"required": 5.0, "limit": nan, "assumed_limit": 4.0}, {}, True, True, True),
    ({"required": 5.0, "limit": nan, "assumed_limit": 4.0}, {"stage": SPEED}, True, True, True),
    ({"required": 5.0, "limit": nan, "assumed_limit": 4.0}, {"stage": TORQUE}, True, False, True),
    ({"required": nan, "limit": 4.0}, {}, True, False, False),
    ({"required": nan, "limit": 4.0}, {"essential": 1}, True, False, True),
    ({"required": nan, "limit": nan}, {"essential": 1, "figured": 1}, True, False, True),
    ({"required": 3.0, "limit": 4.0, "allowance": 2.0}, {}, True, True, True),
    ({"required": 3.0, "limit": 4.0, "allowance": 2.0}, {"stage": HEAT}, True, False, True),
    ({"required": 3.0, "limit": 4.0}, {"essential": 1, "stage": TORQUE}, False, True, False),
    ({"required": 3.0, "limit": 4.0}, {"essential": 1, "stage": HEAT}, False, True, False),
    ({"required": 3.0, "limit": 4.0}, {"essential": 1, "stage": SPEED}, False, False, False),
    ({"required": 3.0, "limit": 4.0}, {"stage": TORQUE}, False, False, False),
]


@pytest.mark.parametrize(("numbers", "changes", "known", "first", "last"), UNMADE)
def test_what_keeps_a_drive_from_being_proven(make, numbers, changes, known, first, last):
    """The second of two checks, after one that holds."""
    case = SimpleNamespace(
        direct=0.0, motor=SimpleNamespace(rotor_inertia=1e-5 if known else nan), gear=as_record(complete(make.gear))
    )
    places = {name: len(FIELDS) + k for k, name in enumerate(FIELDS)}
    checks = check_of(), check_of(**places | changes)
    row = np.concatenate([row_of(required=1.0, limit=2.0), row_of(**numbers)])
    for final, wanted in ((False, first), (True, last)):
        assert first_lacking(case, row, checks, np.bool_(final)) == (1 if wanted else -1)


def test_the_largest_utilisation():
    """Of one stage, with only its peaks where some samples are looked at; one that is not larger is not taken."""
    case, row = SimpleNamespace(direct=0.0), np.concatenate([row_of(required=one, limit=10.0) for one in (3, 9, 5, 3)])
    checks = []
    for k, changes in enumerate(({"peak": 1}, {}, {"stage": SPEED}, {"peak": 1})):
        checks.append(check_of(**{name: k * len(FIELDS) + n for n, name in enumerate(FIELDS)} | changes))
    assert worst(case, row, checks, GEAR, 0.0, -1, False) == (0.9, 1)
    assert worst(case, row, checks, GEAR, 0.0, -1, True) == (0.3, 0)
    assert worst(case, row, checks, SPEED, 0.0, -1, False) == (0.5, 2)
    assert worst(case, row, checks, GEAR, 0.9, 7, False) == (0.9, 7)
    assert worst(case, row, checks, HEAT, 0.2, 7, False) == (0.2, 7)
