"""Bounds and rejections of the search against the judge and against evaluations, over random studies of every kind."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
import random_tasks as TASKS
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.checks import CHECKS
from drivetrain.sizing.judge.evaluate import evaluate_joint
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.results import RejectedPair
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.rejected import Rejected
from drivetrain.study.parts.selection import Wanted
from drivetrain.study.parts.verdicts import Verdict

CLOSE = 1e-9  # relative; the same terms are summed in another order
UNBOUNDED = ("inertia ratio", "holding brake energy")


def some_pairs(rng, offered, joint, count):
    """Some pairs of a joint."""
    return rng.permutation(np.arange(offered.first_pair[joint], offered.first_pair[joint + 1]))[:count]


def bounded(offer, pairs, **options):
    """Utilisations, energies and the line of some pairs, every one looked at."""
    nothing, none = np.zeros(len(offer.bound_data.parameters)), np.zeros(len(pairs), dtype=np.bool_)
    count, *found = offer.bound(pairs, nothing, np.zeros(len(pairs)), none, **options)
    assert count == len(pairs)
    return found


def too_hot(found):
    """Whether a winding is warmer than permitted; bounds on voltages are those of others."""
    return found.cases["figures"]["winding_temperature"] > found.cases["limits"]["winding_temperature"]


@pytest.mark.parametrize("kind", TASKS.KINDS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_no_history_within_an_interval_asks_less_than_its_bound(make, kind, seed):
    offered = build_candidates(TASKS.random_study(make, seed, kind))
    rng, nothing = np.random.default_rng(seed), np.zeros((len(offered.joints), 5))
    for joint, offer in enumerate(offered.joints):
        bare, weight = offer.series.load.torque, offer.series.motion.weight
        size = 10.0 ** rng.uniform(-3, 0.3) * (np.abs(bare).max() + 0.1)
        middle = bare * rng.uniform(0.0, 1.2) + size * rng.standard_normal()
        low = middle - size * rng.random(len(middle)) * rng.choice([0.0, 1.0])
        high = middle + size * rng.random(len(middle)) * rng.choice([0.0, 1.0])
        pairs = some_pairs(rng, offered, joint, 5)
        own = offered.pairs[pairs], offered.parameters[pairs]
        offer.bound_data.full.low[:], offer.bound_data.full.high[:] = low, high
        used, energy, line = bounded(offer, pairs, until=np.inf, with_energy=True)
        for share in (0.0, 1.0, rng.random(len(middle)), np.clip(-low / np.maximum(high - low, 1e-30), 0.0, 1.0)):
            torque = low + share * (high - low)
            load, power = offer.series.load._replace(torque=torque), np.zeros((len(pairs), 2, len(torque)))
            history = replace(offer, series=offer.series._replace(load=load))
            found = history.judge(*own, nothing, until=np.inf, quick=False, power=power)
            made = (found.missing_check < 0) & ~too_hot(found)
            assert (used[made] <= found.utilisation[made] * (1.0 + CLOSE)).all()
            feasible = made & (found.utilisation <= 1.0)
            least = energy + (line * weight) @ (torque - 0.5 * (low + high))
            slack = CLOSE * np.abs(power[:, 0]) @ weight + 1e-12  # J: a locked gear draws nothing but for rounding
            assert (least <= found.cases["figures"]["energy"] + slack)[feasible].all()


def about_joints(study):
    """The same with gears that do not say where their bearing is: its moment is then that about the joint's point."""
    silent = {"bearing_offset": None, "bearing_pitch_diameter": None}
    gears = {key: replace(row, **silent) for key, row in study.catalog.gears.items()}
    return replace(study, catalog=replace(study.catalog, gears=gears))


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_no_choice_loads_a_bearing_less_than_its_bound(make, kind):
    told = 0
    for seed in range(12):
        offered, rng = build_candidates(about_joints(TASKS.random_study(make, seed, kind))), np.random.default_rng(seed)
        joints = range(len(offered.joints))
        open_pairs = [some_pairs(rng, offered, joint, rng.integers(1, 6)) for joint in joints]
        low, high = (np.array([f(offered.parameters[pairs], axis=0) for pairs in open_pairs]) for f in (np.min, np.max))
        for joint, offer in enumerate(offered.joints):
            offer.torque_interval(low, high)
            bound = offer.bound_data.full.least_loads[:3].copy()
            least, most = offer.bound_data.full.low.copy(), offer.bound_data.full.high.copy()
            for _ in range(4):
                chosen = {k: int(rng.choice(open_pairs[k])) for k in joints}
                numbers = offered.parameters_of(chosen)
                offer.torque_interval(numbers, numbers)
                torque, room = offer.bound_data.full.low, CLOSE * np.abs(offer.bound_data.full.low).max()
                np.testing.assert_array_equal(torque, offer.bound_data.full.high)
                assert (least <= torque + room).all() and (torque <= most + room).all()
                figures = offered.judge(joint, np.array([chosen[joint]]), numbers, until=np.inf, quick=False).cases
                found = [figures["figures"][name][0] for name in ("tilting_moment", "axial_load", "radial_load")]
                limits = ("tilting_moment_limit", "axial_load_limit", "radial_load_limit")
                if all(np.isnan(figures["gear"][name][0]) for name in limits):
                    continue  # nothing is asked, so the judge leaves out what the own drive adds
                if np.isfinite(found).all():
                    assert (bound <= np.array(found) * (1.0 + CLOSE)).all()
                    offer.torque_interval(numbers, numbers)
                    exact = offer.bound_data.full.least_loads[:3]  # at the samples where most is asked without drives
                    assert (exact >= bound * (1.0 - CLOSE)).all() and (exact <= np.array(found) * (1.0 + CLOSE)).all()
                    assert (exact >= 0.75 * np.array(found)).all()
                    told += 1
                else:
                    assert np.isnan(bound).all() or np.isnan(found).all()
    assert told > 30 or kind not in ("arm", "dwell")


@pytest.mark.parametrize("kind", ["arm", "sliding", "coupled"])
def test_no_choice_asks_less_of_a_brake_than_its_bound(make, kind):
    told = 0
    for seed in range(12):
        offered, rng = build_candidates(TASKS.random_study(make, seed, kind)), np.random.default_rng(seed)
        joints = range(len(offered.joints))
        open_pairs = [some_pairs(rng, offered, joint, rng.integers(1, 6)) for joint in joints]
        low, high = (np.array([f(offered.parameters[pairs], axis=0) for pairs in open_pairs]) for f in (np.min, np.max))
        for joint, offer in enumerate(offered.joints):
            offer.torque_interval(low, high)
            bound = float(offer.bound_data.full.least_loads[3])
            assert np.isnan(bound) == (not offered.study.joints[joint].brakes)
            for _ in range(4 * (not np.isnan(bound))):
                chosen = {k: int(rng.choice(open_pairs[k])) for k in joints}
                numbers = offered.parameters_of(chosen)
                case = offered.judge(joint, np.array([chosen[joint]]), numbers, until=np.inf, quick=False).cases[0]
                found = case.figures.holding_torque * abs(case.gear.ratio)
                offer.torque_interval(numbers, numbers)
                exact = float(offer.bound_data.full.least_loads[3])
                assert bound <= exact * (1.0 + CLOSE) and 0.75 * found <= exact <= found * (1.0 + CLOSE)
                told += 1
    assert told > 30


@pytest.mark.parametrize("kind", ["arm", "table", "dwell"])
def test_bounds_without_width_rule_out_nearly_as_much_as_the_judge(make, kind):
    rejected = missed = 0
    for seed in range(12):
        offered = build_candidates(TASKS.random_study(make, seed, kind))
        rng = np.random.default_rng(seed)
        chosen = {joint: int(some_pairs(rng, offered, joint, 1)[0]) for joint in range(len(offered.joints))}
        numbers = offered.parameters_of(chosen)
        for joint, offer in enumerate(offered.joints):
            pairs = some_pairs(rng, offered, joint, 20)
            own = offered.pairs[pairs], offered.parameters[pairs]
            found = offer.judge(*own, numbers, until=1.0, quick=False)
            offer.torque_interval(numbers, numbers)
            used, _, _ = bounded(offer, pairs, until=1.0 + CLOSE, with_energy=False)
            told = np.array([CHECKS[at].name not in UNBOUNDED for at in found.binding])
            out = (found.missing_check >= 0) | ((found.utilisation > 1.0) & told)
            rejected += out.sum()
            missed += (out & (used <= 1.0 + CLOSE)).sum()
    assert rejected > 100
    assert missed < 0.06 * rejected  # the ripple of the winding is not bounded


EXACT = ("joint_torque", "motor_torque", "rms_torque", "phase_torque", "axial_load", "cold_torque", "cold_current")
# Middle of the bound over the judge's figure: a bound that is right and of no use would pass every test of the search.
TIGHT = {
    "load_torque": 0.99, "average_load_torque": 0.99, "momentary_torque": 0.97, "stop_motor_torque": 0.95,
    "tilting_moment": 0.97, "radial_load": 0.95, "bearing_static_load": 0.97, "holding_torque": 0.99,
    "winding_temperature": 0.88, "phase_temperature": 0.88, "motor_current": 0.99, "rms_current": 0.99,
    "voltage": 0.98, "energy": 0.95, "required_stiffness": 0.99,
}  # fmt: skip


def test_bounds_without_width_are_figures_of_the_judge(make):
    ratios, peaks = {name: [] for name in TIGHT}, []
    for seed, kind in itertools.product(range(8), TASKS.KINDS):
        study = TASKS.random_study(make, seed, kind)
        stiffness = replace(study.stiffness, first_resonance=3.0) if seed % 2 else study.stiffness
        offered = build_candidates(replace(study, stiffness=stiffness))
        rng = np.random.default_rng(seed)
        chosen = {joint: int(some_pairs(rng, offered, joint, 1)[0]) for joint in range(len(offered.joints))}
        for joint, offer in enumerate(offered.joints):
            for pair in some_pairs(rng, offered, joint, 6):
                numbers, pairs = offered.parameters_of(chosen | {joint: int(pair)}), np.array([pair])
                found = offered.judge(joint, pairs, numbers, until=np.inf, quick=False)
                if found.missing_check[0] >= 0 or not np.isfinite(found.utilisation[0]):
                    continue
                offer.torque_interval(numbers, numbers)
                _, energy, _ = bounded(offer, pairs, until=np.inf, with_energy=True)
                bound, exact = offer.bound_data.cases.case[0].figures.copy(), found.cases[0].figures
                bound.energy = energy[0]
                if exact.energy > 0.0 and found.utilisation[0] <= 1.0:
                    assert energy[0] <= exact.energy * (1.0 + CLOSE), (kind, seed, joint, pair)
                    ratios["energy"].append(bound.energy / exact.energy)
                for name in EXACT:
                    if np.isfinite(exact[name]):
                        assert bound[name] == pytest.approx(exact[name], rel=CLOSE), (kind, seed, joint, pair, name)
                for name in TIGHT.keys() - {"energy"}:
                    if np.isfinite(bound[name]) and np.isfinite(exact[name]):
                        if name == "voltage" and too_hot(found)[0]:
                            continue
                        assert bound[name] <= exact[name] * (1.0 + CLOSE), (kind, seed, joint, pair, name)
                        ratios[name] += [bound[name] / exact[name]] if exact[name] else []
                if np.isfinite(bound.gear_life) and np.isfinite(exact.gear_life):
                    assert bound.gear_life >= exact.gear_life * (1.0 - CLOSE)
                if np.isfinite(bound.permitted_peaks):
                    assert bound.permitted_peaks >= exact.permitted_peaks * (1.0 - CLOSE)
                    peaks.append(bound.permitted_peaks / exact.permitted_peaks)
    assert {name: np.median(found) > TIGHT[name] for name, found in ratios.items()} == dict.fromkeys(TIGHT, True)
    assert len(peaks) > 5 and np.median(peaks) < 1.05  # permitted ones: here the bound is the larger


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_rejections_say_what_an_evaluation_says(make, kind):
    study = replace(TASKS.random_study(make, 11, kind), wanted=Wanted())
    what, rng, expected = build_problem(build_candidates(study), study.wanted), np.random.default_rng(2), []
    offered, filled_parts, work = what.candidates, FilledParts(study), workload(study)
    known = tuple(pairs[np.sort(rng.permutation(len(pairs))[:12])] for pairs in what.eligible)
    what = replace(what, eligible=known, lacking_data=tuple(pairs[:2] for pairs in what.lacking_data))
    chosen = {joint: int(rng.choice(pairs)) for joint, pairs in enumerate(known)}
    drives = {k: filled_parts.drive(study.joints[k], *offered.keys(pair)) for k, pair in chosen.items()}
    stages = {check.name: int(check.stage) for check in CHECKS}
    for joint in reversed(range(what.n)):
        task = study.joints[joint]
        for pair in known[joint].tolist():
            keys, share = offered.keys(pair), what.fixed_cost[pair]
            checks = evaluate_joint(work, drives | {joint: filled_parts.drive(task, *keys)}, joint, keys).checks
            failed = [check for check in checks if check.verdict is Verdict.FAIL]
            first = min((stages[check.name] for check in failed), default=0)
            failed = [check for check in failed if stages[check.name] == first]
            lacking = [check for check in checks if check.essential and check.verdict is Verdict.NOT_CHECKED]
            if failed:
                one = max(failed, key=lambda check: check.utilisation)
                limit = np.nan if one.available is None else one.available  # a runaway fails without one
                numbers = (one.required, limit, one.unit, one.utilisation)
                expected.append((task.name, *keys, one.name, *numbers, share))
            elif lacking:
                one = lacking[0]
                required = np.nan if one.required is None else one.required
                numbers = (required, np.nan, one.unit, np.inf)
                expected.append((task.name, *keys, f"{one.name} (not checked)", *numbers, share))
        expected += [
            (task.name, *offered.keys(int(pair)), "unknown mass", np.nan, np.nan, "kg", np.inf, np.nan)
            for pair in what.lacking_data[joint]
        ]
    table = Rejected(what, chosen)
    assert len(table) == len(expected)
    frame = table.frame()
    for row, wanted in enumerate(expected):
        for found in (
            table[row],
            RejectedPair(*(frame.iloc[row][name] for name in RejectedPair.__dataclass_fields__)),
        ):
            values = [getattr(found, name) for name in RejectedPair.__dataclass_fields__]
            for value, one in zip(values, wanted, strict=True):
                assert value == one if isinstance(one, str) else value == pytest.approx(one, rel=CLOSE, nan_ok=True)
    assert [one.motor for one in table[1:3]] == [one[1] for one in expected[1:3]]


def test_work_given_is_the_one_kept(make):
    study = TASKS.random_study(make, 0, "arm")
    work = workload(study)
    assert build_candidates(study, work).work is work
