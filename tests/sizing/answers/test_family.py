"""One set of drives for a family of arms: the search against every set judged in every member."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier
from drivetrain.errors import InputError
from drivetrain.report.verdict_lines import family_lines
from drivetrain.sizing.answers.family import select_family
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, carrying_mass, changed, slowed
from drivetrain.study.model import Payload
from drivetrain.study.parts.selection import SelectionOptions


def family(make, seed):
    """A task of two joints, the same faster and hotter, and a longer arm: three members of six pairs a joint."""
    rng = np.random.default_rng(seed)
    motors = [
        replace(make.motor, key=f"m{i}", mass=0.3 + 0.2 * i, peak_current=6.0 * (i + 1) * rng.uniform(0.7, 1.4),
                nominal_current=4.0 * (i + 1) * rng.uniform(0.5, 1.5)) for i in range(3)
    ]  # fmt: skip
    gears = [
        replace(make.gear, key=f"g{i}", ratio=(60.0, 100.0)[i], mass=rng.uniform(0.3, 0.6),
                repeated_peak_torque=rng.uniform(20.0, 60.0), average_torque_limit=40.0) for i in range(2)
    ]  # fmt: skip
    parts = Catalog({one.key: one for one in motors}, {one.key: one for one in gears})
    cycle = make.sines(2, samples=31, duration=float(rng.uniform(2.0, 3.5)), size=0.55)
    pairs = tuple(itertools.product(parts.motors, parts.gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names)
    arm, longer = (make.planar_arm(lengths, [1.3, 0.9]) for lengths in ([0.55, 0.2], [0.3, 0.55]))
    study = make.study(cycle, arm=arm, joints=tasks, catalog=parts)
    faster = changed(study, TaskChange(time=float(rng.uniform(0.85, 0.95)), ambient=3.0, voltage=0.9))
    return [study, faster, replace(study, arm=longer, cycle=slowed(cycle, 1.1))]


def brute_force(members):
    """The least mass of a set that every member's evaluation lets pass, infinite for none."""
    best = np.inf
    names = [task.name for task in members[0].joints]
    for one in itertools.product(*(task.pairs for task in members[0].joints)):
        drives = dict(zip(names, one, strict=True))
        found = evaluate(members[0], drives)
        if found.objective < best and found.feasible and all(evaluate(m, drives).feasible for m in members[1:]):
            best = found.objective
    return best


@pytest.mark.parametrize("seed", range(8))
def test_is_the_best_of_all_sets_that_fit_all(make, seed):
    members = family(make, seed)
    found, best = select_family(members), brute_force(members)
    assert found.proven
    if np.isinf(best):
        assert not found.drives
        return
    assert found.objective == pytest.approx(best, rel=1e-9)
    assert all(one.feasible for one in found.evaluations)
    assert found.bound == pytest.approx(best, rel=1e-9)


def least_with_common(members, which):
    """The least mean mass of sets with common motors (0) or gears (1), infinite for none."""
    names = [task.name for task in members[0].joints]
    least = []
    for member in members:
        best = {}
        for one in itertools.product(*(task.pairs for task in member.joints)):
            found = evaluate(member, dict(zip(names, one, strict=True)))
            parts = tuple(pair[which] for pair in one)
            if found.feasible:
                best[parts] = min(best.get(parts, np.inf), found.objective)
        least.append(best)
    sums = [sum(best.get(parts, np.inf) for best in least) for parts in least[0]]
    return min(sums, default=np.inf) / len(members)


@pytest.mark.parametrize("seed", range(6))
def test_common_motors_or_gears_are_the_best(make, seed):
    members = family(make, seed)
    whole = select_family(members)
    for which, common in enumerate(("motors", "gears")):
        found, best = select_family(members, common=common), least_with_common(members, which)
        assert found.proven
        if np.isinf(best):
            assert not found.drives and not whole.drives
            continue
        assert found.objective == pytest.approx(best, rel=1e-9) and found.bound == pytest.approx(best, rel=1e-9)
        assert not whole.drives or found.objective <= whole.objective + 1e-9
        assert found.drives == dict(found.evaluations[0].drives)  # of the first member
        assert found.counters["searches"] >= len(members)  # one for each at least
        for joint in found.drives:
            assert len({one.drives[joint][which] for one in found.evaluations}) == 1
        assert all(one.feasible for one in found.evaluations)


def test_members_pay_for_their_own_amplifiers(make):
    """The price of a member counts the amplifier that it needs, so that common drives cost the mean of all members."""
    amplifiers = tuple(
        Amplifier(peak_current=peak, continuous_current=peak, key=f"{peak:.3g} A", price=10.0 * peak)
        for peak in np.geomspace(2.0, 60.0, 12).tolist()
    )
    wanted = SelectionOptions((("price", 1.0),))
    members = [
        replace(one, joints=tuple(replace(task, amplifiers=amplifiers) for task in one.joints), wanted=wanted)
        for one in family(make, 1)
    ]
    names, means = [task.name for task in members[0].joints], []
    for one in itertools.product(*(task.pairs for task in members[0].joints)):
        found = [evaluate(member, dict(zip(names, one, strict=True))) for member in members]
        if all(each.feasible for each in found):
            means.append(np.mean([each.objective for each in found]))
    found = select_family(members)
    costs = [one.objective for one in found.evaluations]
    assert found.proven and np.ptp(costs) > 1.0  # other members need other amplifiers
    assert found.objective == pytest.approx(min(means), rel=1e-12) == np.mean(costs)
    assert found.bound == pytest.approx(min(means), rel=1e-12)
    assert all(one.drives == found.drives for one in found.evaluations)


def test_a_first_answer_comes_however_short_the_time(make):
    """Members that want other motors get those of the one that costs most, where they hold; it is not called proven."""
    quick = SelectionOptions(time_limit=1e-6)
    found = [(select_family(members, common="motors"), select_family(members, common="motors", wanted=quick))
             for members in (family(make, seed) for seed in range(6))]  # fmt: skip
    early = [(best, first) for best, first in found if first.drives]
    assert len(early) > 1 and not all(first.proven for _, first in early)
    assert all(first.objective >= best.objective - 1e-9 for best, first in early)
    assert all(0.0 < first.bound <= best.objective + 1e-9 for best, first in found if best.drives)


def test_some_members_bind_where_the_first_would_not(make):
    """So that the test above is one."""
    found = [(select_family(members), select(members[0])) for members in (family(make, k) for k in range(8))]
    assert sum(bool(one.drives) for one, _ in found) > 1
    assert any(one.drives and one.objective > alone.objective + 1e-9 for one, alone in found)


def test_a_family_of_one_is_a_selection(make):
    study = family(make, 3)[0]
    assert select_family([study]).drives == select(study).drives


def test_words_of_a_family(make):
    """Drives, each member's tightest check, and the proof; the check is the largest of all."""
    members = next(one for one in (family(make, k) for k in range(8)) if select_family(one).drives)
    found, names = select_family(members), ["short", "fast", "long"]
    told = family_lines(found, names)
    assert told[:2] == [f"{joint}: {motor} with {gear}" for joint, (motor, gear) in found.drives.items()]
    for name, one, line in zip(names, found.evaluations, told[2:5], strict=True):
        used = [check.utilisation or 0.0 for joint in one.joints.values() for check in joint.checks]
        assert line.startswith(f"{name}: {one.verdict}")
        assert float(line.split()[-2]) == pytest.approx(100 * max(used), abs=0.5)
    assert "proven" in told[-1] and f"{found.objective:.4g} kg" in told[-1]


def test_another_mass_of_the_heaviest_payload(make):
    study = family(make, 0)[0]
    with pytest.raises(InputError, match="none of any mass"):
        carrying_mass(study, 1.0)
    tools = tuple(Payload(name, mass, np.zeros(3), mass * np.eye(3)) for name, mass in (("light", 1.0), ("heavy", 4.0)))
    light, heavy = carrying_mass(replace(study, payloads=tools), 2.0).payloads
    assert (light.mass, heavy.mass, heavy.inertia[0, 0]) == (1.0, 2.0, 2.0)


def test_what_is_no_family(make):
    study = family(make, 1)[0]
    motor = next(iter(study.catalog.motors))
    heavier = {**study.catalog.motors, motor: replace(study.catalog.motors[motor], mass=9.0)}
    other = replace(study, catalog=replace(study.catalog, motors=heavier), joints=study.joints)
    task = make.study(make.sines(1), joints=(make.task("j1"),))
    for studies, words in (
        ([], "a list of studies"), ([study, task], "must have the joints"), ([study, other], "other motors"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words):
            select_family(studies)
    with pytest.raises(InputError, match="energy differs"):
        select_family([study], wanted=SelectionOptions((("energy", 1.0),)))
