"""Worse data never make a verdict better: over random studies, each made worse in one way."""

from __future__ import annotations

import math
import os
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import random_tasks as TASKS

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.brake import LEAST_ENERGY
from drivetrain.drive.motor_limits import NOMINAL_SHARE, thermal_limit_current
from drivetrain.records import as_numbers, as_record
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.checks import CHECKS, table
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.judge import judge_cases
from drivetrain.sizing.judge.parts import parts_of
from drivetrain.sizing.judge.vary import named_drives
from drivetrain.study.parts.verdicts import Verdict

STUDIES, PAIRS = 300, 8
FIRST = int(os.environ.get("DRIVETRAIN_FIRST", "0"))  # seed of the first: another draws others
SETS = int(os.environ.get("DRIVETRAIN_SETS", "2"))  # whole sets of each change: 28 make 500, which take minutes
GOOD = (Verdict.PASS, Verdict.MARGINAL)

PATHS = ("resistance_winding_housing", "resistance_housing_ambient", "resistance_winding_ambient")
MOTOR_LIMITS = (
    "nominal_current",
    "nominal_torque",
    "peak_current",
    "peak_torque",
    "max_speed",
    "max_winding_temperature",
)
GEAR_LIMITS = (
    "average_torque_limit", "repeated_peak_torque", "momentary_torque", "max_input_speed", "average_input_speed_limit",
    "rated_life", "tilting_moment_limit", "axial_load_limit", "radial_load_limit", "bearing_dynamic_rating",
    "bearing_static_rating", "momentary_waves", "ratcheting_torque", "buckling_torque", "max_temperature",
)  # fmt: skip
# Without them a sheet says less, and no other number of it stands in.
ALONE = (
    "max_speed rotor_inertia inductance coulomb_friction viscous_friction no_load_current no_load_speed "
    "winding_time_constant",
    "momentary_torque max_input_speed average_input_speed_limit rated_speed rated_life tilting_moment_limit "
    "axial_load_limit radial_load_limit efficiency bearing_dynamic_rating bearing_static_rating bearing_offset "
    "bearing_pitch_diameter mesh_efficiency drag_speed drag_torque seal_drag_torque starting_torque ratcheting_torque "
    "buckling_torque stiffness_1 torque_1 max_temperature",
)  # fmt: skip
# A hot or resistive winding asks for less voltage where it brakes, weak magnets wherever it turns: that is physics.
# So only what changes no temperature, no winding and no torque is held against it.
# A motor brakes and pushes less with a smaller current: a stop and a jam ask less of the gear then.
STOPS = ("gear momentary peak torque", "gear momentary peaks", "gear torque in a jam", "gear ratcheting in a jam",
         "gear buckling in a jam", "arm stop at full current")  # fmt: skip
POWER_OFF = "arm power failure"  # a weaker brake asks less of the gear
HEAT, VOLTS = "winding temperature", "motor voltage"


# Limits that no sheet need print, and for which nothing stands in: docs/not_checked.md names them.
UNJUDGED = (
    "output bearing static load", "gear temperature", "gear ratcheting in a jam", "gear buckling in a jam",
    "gear momentary peaks",
)  # fmt: skip


def times(row, names, factor):
    return replace(row, **{name: getattr(row, name) * factor for name in names if getattr(row, name) is not None})


def with_parts(study, motor=lambda row: row, gear=lambda row: row):
    """The study with every sheet changed."""
    rows = study.catalog
    motors = {key: motor(row) for key, row in rows.motors.items()}
    return replace(study, catalog=Catalog(motors, {key: gear(row) for key, row in rows.gears.items()}))


def with_tasks(study, change):
    return replace(study, joints=tuple(change(task) for task in study.joints))


def hotter_paths(study, rng):
    """Where a mounting is stated the printed current holds for what the sheet says: a worse sheet allows more of it."""
    plain = with_tasks(study, lambda task: replace(task, housing_to_ambient=None))
    return plain, with_parts(plain, lambda row: times(row, PATHS, 1.5))


def hotter_mounting(study, rng):
    worse = rng.uniform(1.1, 30.0)

    def mounted(task):
        stated = task.housing_to_ambient
        return replace(task, housing_to_ambient=None if stated is None else worse * stated)

    return study, with_tasks(study, mounted)


def a_mounting_worse_than_all(study, rng):
    """Stated where none was; a sheet that tells the way of the heat as far as the housing alone gets a datum more."""

    def told(row):
        half = row.resistance_housing_ambient is None and row.resistance_winding_ambient is None
        return replace(row, resistance_housing_ambient=4.0) if half else row

    plain = with_parts(with_tasks(study, lambda task: replace(task, housing_to_ambient=None)), told)
    return plain, with_tasks(study, lambda task: replace(task, housing_to_ambient=100.0))


def more_ohms(study, rng):
    return study, with_parts(study, lambda row: times(row, ("resistance",), 2.0))


def hotter_air(study, rng):
    return study, replace(study, ambient=study.ambient + 30.0)


def a_gear_in_the_motors_housing(study, rng):
    plain = with_tasks(study, lambda task: replace(task, gear_heat=0.0))
    return plain, with_tasks(plain, lambda task: replace(task, gear_heat=1.0))


def lower_limits(study, rng):
    motor, gear = [str(rng.choice(names)) for names in (MOTOR_LIMITS, GEAR_LIMITS)]
    return study, with_parts(study, lambda row: times(row, [motor], 0.7), lambda row: times(row, [gear], 0.7))


def weaker_amplifier(study, rng):
    def less(task):
        own = task.amplifier
        peak, lasting = own.peak_current, own.continuous_current
        return replace(task, amplifier=Amplifier(peak and 0.4 * peak, lasting and 0.4 * lasting))

    return study, with_tasks(study, less)


def lower_supply(study, rng):
    return study, replace(study, supply=replace(study.supply, voltage=0.4 * study.supply.voltage))


FACTORS = ("peak_torque", "rms", "speed", "voltage", "bearing_static_safety", "bearing_load_factor", "brake")


def weaker_brakes(study, rng):
    names, factor = ("static_torque", "energy_per_stop"), float(rng.choice([0.1, 0.6]))
    return study, with_parts(study, lambda row: replace(row, brake=times(row.brake, names, factor)))


def higher_factors(study, rng):
    asked = study.safety
    name = str(rng.choice(FACTORS))
    return study, replace(study, safety=replace(asked, **{name: 1.6 * getattr(asked, name)}))


def a_datum_less(study, rng):
    motor, gear = (str(rng.choice(names.split())) for names in ALONE)
    if rng.random() < 0.5:

        def silent(row):  # one path with a time constant warms as a whole with it, without as a winding in its housing
            whole = motor == "winding_time_constant" and row.resistance_winding_housing is None
            return row if whole else replace(row, **{motor: None})

        return study, with_parts(study, silent)
    halves = ("mesh_efficiency", "drag_torque")  # without the half that a sheet tells its efficiency stands in

    def less(row):
        half = gear in halves and None in [getattr(row, name) for name in halves]
        return row if half else replace(row, **{gear: None})

    return study, with_parts(study, gear=less)


def a_motor_that_tells_less(study, rng):
    """Nothing of its own friction, nothing of its inductance, or neither."""
    friction = ("coulomb_friction", "viscous_friction", "no_load_current", "no_load_speed")
    gone = [friction, ("inductance",), (*friction, "inductance")][rng.integers(3)]
    return study, with_parts(study, lambda row: replace(row, **dict.fromkeys(gone)))


def a_motor_of_unknown_warmth(study, rng):
    """Without the way of its heat, the winding's limit or the printed current, less than copper alone allows."""
    gone = [PATHS, ("max_winding_temperature",), ("nominal_current",)][rng.integers(3)]

    def sound(row):
        most = float(thermal_limit_current(as_record(row), 25.0, np.nan))
        if math.isnan(most):
            return row
        printed = np.clip(row.nominal_current or most, NOMINAL_SHARE * most, 0.99 * most)
        return replace(row, nominal_current=float(printed), nominal_torque=None)

    plain = with_parts(study, sound)
    return plain, with_parts(plain, lambda row: replace(row, **dict.fromkeys(gone)))


def a_brake_datum_less(study, rng):
    name = str(rng.choice(["static_torque", "energy_per_stop", "mass"]))

    def sound(row):  # no brake is printed that takes less than what stands in
        own = row.brake
        energy = own.energy_per_stop and max(own.energy_per_stop, 1.02 * LEAST_ENERGY * own.static_torque)
        return replace(row, brake=replace(own, energy_per_stop=energy))

    plain = with_parts(study, sound)

    def less(row):
        mass = row.mass
        if name == "mass" and None not in (mass, row.brake.mass):
            mass -= row.brake.mass
        return replace(row, mass=mass, brake=replace(row.brake, **{name: None}))

    return plain, with_parts(plain, less)


def a_longer_life(study, rng):
    asked = study.safety.life
    plain = replace(study, safety=replace(study.safety, life=asked or 1e6))
    return plain, replace(study, safety=replace(study.safety, life=30.0 * (asked or 1e6)))


def a_start_from_the_cold(study, rng):
    """Beside the task: it may add checks, and change none of the others."""
    return study, replace(study, cold_start=-10.0)


def a_colder_start(study, rng):
    """Of gears that drag a lot, and of magnets that do not grow stronger in the cold, which would ask for less."""
    plain = with_parts(
        study, lambda row: replace(row, magnet_coefficient=0.0), lambda row: times(row, ("drag_torque",), 10.0)
    )
    return replace(plain, cold_start=15.0), replace(plain, cold_start=-10.0)


def holding_by_the_most(study, rng):
    return study, replace(study, holding="most")


WORSE = (
    hotter_paths, hotter_mounting, a_mounting_worse_than_all, more_ohms, hotter_air, a_gear_in_the_motors_housing,
    lower_limits, weaker_amplifier, lower_supply, higher_factors, a_datum_less, a_motor_that_tells_less,
    a_motor_of_unknown_warmth, weaker_brakes, a_brake_datum_less, a_longer_life, a_start_from_the_cold, a_colder_start,
    holding_by_the_most,
)  # fmt: skip


def random_task(make, seed):
    """A study of any kind."""
    study = TASKS.random_study(make, seed, TASKS.KINDS[seed % len(TASKS.KINDS)])
    # Magnets that grow stronger as they warm, which no catalogue may hold, ask less current when they are hot.
    return with_parts(study, lambda row: replace(row, magnet_coefficient=min(row.magnet_coefficient, 0.0)))


def eased(change, name):
    """Where physics asks less of a worse drive, and checks that the change itself asks for."""
    if name == VOLTS:
        return change not in (lower_supply, weaker_amplifier, higher_factors, a_datum_less, a_motor_that_tells_less)
    asked_anew = {a_gear_in_the_motors_housing: "gear temperature", a_start_from_the_cold: "cold start"}
    if change in asked_anew and name.startswith(asked_anew[change]):
        return True
    if change is a_colder_start and name == "cold start voltage":  # of which a colder winding's resistance asks less
        return True
    if change is a_brake_datum_less and name == "output bearing static load":  # of a mass that is not known
        return True
    if change is a_motor_of_unknown_warmth and name == "gear temperature":  # what untold friction adds is unknown
        return True
    return (change is weaker_amplifier and name in STOPS) or (change is weaker_brakes and name == POWER_OFF)


def used_of(parts, work, joint, drives, pick):
    """Utilisations of some pairs at a joint beside the drives of others, (K, checks), NaN where nothing is checked; and
    what keeps each from being proven, -1 where nothing does, (K,)."""
    others = {k: drive for k, drive in drives.items() if k != joint}
    demand, own = TASKS.own_work(work, joint, others)
    cases = TASKS.pair_cases(parts, joint, demand, pick)
    used, power = np.zeros((len(pick), len(CHECKS))), np.zeros((len(pick), 2, len(demand.time)))
    found, whole = np.zeros(len(pick)), np.zeros((2, len(pick)), dtype=np.int64)
    judge_cases(
        cases, as_numbers(cases), table(), own, TASKS.own_amounts(own, parts.amounts[joint][pick]), np.inf, False,
        power, used, found, *whole,
    )  # fmt: skip
    return used, whole[1]


def test_worse_data_never_make_a_verdict_of_a_drive_better(make):
    """Of many pairs: what fails or is not proven does not hold once a number is worse or gone; nor does any check."""
    changed, names = Counter(), np.array([row.name for row in CHECKS])
    runaways = verdicts = 0
    for seed in range(FIRST, FIRST + STUDIES):
        change, rng = WORSE[seed % len(WORSE)], np.random.default_rng((seed, 7))
        before, after = change(random_task(make, seed), rng)
        work, parts = workload(before), [parts_of(study) for study in (before, after)]
        drives = named_drives(before, {one.name: one.pairs[rng.integers(len(one.pairs))] for one in before.joints})
        free = np.array([eased(change, name) for name in names])
        spared = free | np.isin(names, UNJUDGED)
        for joint, task in enumerate(before.joints):
            pick = rng.choice(len(task.pairs), PAIRS, replace=False)
            # No change touches what arm and payload ask.
            (was, lacked), (now, lacks) = (
                used_of(one, replace(work, study=one.study), joint, drives, pick) for one in parts
            )
            endless = np.isinf(now[:, names == HEAT])  # thermal runaway: nothing else is told of a warm motor
            runaways += int(endless.sum())
            burnt = (was[:, names == HEAT] > 1.0) & (names == VOLTS)  # what a winding asks that is too hot
            better = ~(was <= 1.0) & (now <= 1.0) & ~endless & ~free & ~burnt
            assert not better.any(), (seed, change.__name__, names[better.any(axis=0)])
            failed, fails = ((one[:, ~spared] > 1.0).any(axis=1) for one in (was, now))
            proven = (lacks < 0) & ~fails
            assert not (failed & proven).any(), (seed, change.__name__, names[(was > 1.0).any(axis=0)])
            unproven = (lacked >= 0) & ~failed & proven & ~spared[np.maximum(lacked, 0)]
            assert not unproven.any(), (seed, change.__name__, names[lacked[unproven]])
            changed[change] += int(((was <= 1.0) & ~(now <= 1.0)).sum())
            verdicts += int((~failed & (lacked < 0) & ~proven).sum())
    assert all(
        changed[change] > 5 for change in WORSE if change is not a_start_from_the_cold
    )  # which adds checks alone
    assert runaways > 50 and verdicts > 50


def _checks(evaluation):
    return [*evaluation.shared, *(check for joint in evaluation.joints.values() for check in joint.checks)]


@pytest.fixture(scope="module")
def whole_sets(make):
    """Some studies, drives for each, and what they are before anything is worse."""
    found = []
    for seed in range(FIRST, FIRST + SETS):
        study, rng = random_task(make, 7 * seed + 1), np.random.default_rng((seed, 9))
        drives = {task.name: task.pairs[rng.integers(len(task.pairs))] for task in study.joints}
        found.append((study, drives, evaluate(study, drives)))
    return found


@pytest.mark.parametrize("change", WORSE, ids=lambda change: change.__name__)
def test_worse_data_never_make_a_verdict_better(whole_sets, change):
    """Not of one check of a whole set, those of the arm and of its stops among them."""
    for seed, (study, drives, plain) in enumerate(whole_sets):
        before, after = change(study, np.random.default_rng((seed, 8)))
        was, now = plain if before is study else evaluate(before, drives), evaluate(after, drives)
        asked_less = any(eased(change, one.name) for one in _checks(was) if one.verdict not in GOOD)
        assert was.feasible or asked_less or not now.feasible, (seed, was.verdict)
        told = [(joint.checks, now.joints[name].checks) for name, joint in was.joints.items()]
        endless = any(check.name == HEAT and check.required == np.inf for check in _checks(now))
        for checks, others in [*told, (was.shared, now.shared)]:
            later = {check.name: check for check in others}
            if HEAT in later and later[HEAT].required == np.inf:
                assert later[HEAT].verdict is Verdict.FAIL and "thermal runaway" in later[HEAT].remark
                continue
            for check in checks:
                if endless and check.name.startswith("supply"):
                    continue
                if check.verdict in (Verdict.FAIL, Verdict.NOT_CHECKED) and not eased(change, check.name):
                    assert later[check.name].verdict not in GOOD, (seed, check, later[check.name])
