"""The fastest cycle: every move at an edge of its own, the whole at that of the cycle; a closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from crank_arm import short_crank, two_links

from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.report.verdict_lines import fastest_lines, motion_csv
from drivetrain.sizing.answers import fastest as answer
from drivetrain.sizing.answers.fastest import (
    FACTOR_TOLERANCE,
    Fastest,
    _rebuilt,
    _repaired,
    _scaled_moves,
    fastest,
    moves_of,
    retimed,
)
from drivetrain.sizing.judge.evaluate import evaluate, given_drives
from drivetrain.sizing.results import Evaluation
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.model import Stop, Study
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study
from drivetrain.study.template import study_template

DRIVES = {name: ("AM_MF0127008_48V", "hd_CSG-32-120-2UH") for name in ("joint_1", "joint_2")}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    file = tmp_path_factory.mktemp("fastest") / "study.yaml"
    file.write_text(study_template("planar-2r"), encoding="utf-8")
    return load_study(file)


@pytest.fixture(scope="module")
def found(study: Study) -> Fastest:
    return fastest(study, DRIVES)


def test_moves_are_what_lies_between_rests_and_dwells_stay(study: Study, found: Fastest) -> None:
    moves = moves_of(study.cycle)
    assert [study.cycle.segment_names[study.cycle.segment[move.start + 1]] for move in moves] == ["there", "back"]
    assert found.duration == pytest.approx(1.0 + sum(move.after for move in found.moves), rel=1e-9)
    way = study.cycle.position
    low, high = way.min(axis=0), way.max(axis=0)
    share = (found.study.cycle.position - low) / (high - low)
    assert share == pytest.approx(np.tile(share[:, :1], (1, 2)), abs=1e-6)  # joints in step, as in the study
    assert share.min() >= -1e-9 and share.max() <= 1.0 + 1e-9


def test_no_joint_goes_faster_than_the_arm_lets_it(study: Study, found: Fastest) -> None:
    assert study.arm is not None
    free = np.abs(found.study.cycle.velocity).max(axis=0)
    limits = np.array([0.6, 10.0]) * free
    slow = replace(study, arm=replace(study.arm, speed_limits=limits), ambient=0.0)  # heat does not bind first
    held = fastest(slow, DRIVES)
    assert held.feasible and held.duration > found.duration
    quickest = float((np.abs(held.study.cycle.velocity).max(axis=0) / free)[0])
    assert 0.54 < quickest <= 0.6 * (1.0 + 1e-9)  # timed within, a step of acceleration takes some of it
    assert ("joint_1", "the arm's speed limit") in {(move.place, move.check) for move in held.moves}


def rates_belong_together(cycle: Cycle, off: float) -> None:
    """Trapezoid sums of the speed are the way, to ``off`` [rad], and those of the acceleration the speed."""
    step = np.diff(cycle.time)[:, None]
    way = np.cumsum(0.5 * step * (cycle.velocity[1:] + cycle.velocity[:-1]), axis=0)
    assert way == pytest.approx(cycle.position[1:] - cycle.position[0], abs=off)
    gained = np.cumsum(0.5 * step * (cycle.acceleration[1:] + cycle.acceleration[:-1]), axis=0)
    assert gained == pytest.approx(cycle.velocity[1:], abs=0.01 * np.abs(cycle.velocity).max())


def test_the_speed_is_that_of_the_position(found: Fastest) -> None:
    """Independently of the factors: the trapezoid sum of the retimed speed is the way."""
    rates_belong_together(found.study.cycle, 2e-4)


def test_it_holds_and_any_move_made_quicker_does_not(study: Study, found: Fastest) -> None:
    assert found.feasible
    moves = moves_of(study.cycle)
    pace = np.array([move.after / move.before for move in found.moves])
    for index in range(len(moves)):
        quicker = pace.copy()
        quicker[index] *= 1.0 - 15.0 * FACTOR_TOLERANCE
        result = evaluate(replace(study, cycle=retimed(study.cycle, moves, quicker)), DRIVES)
        checks = [check for joint in result.joints.values() for check in joint.checks]
        assert any(check.verdict is Verdict.FAIL for check in [*checks, *result.shared])
    together = evaluate(changed(found.study, TaskChange(time=1.0 - 15.0 * FACTOR_TOLERANCE)), DRIVES)
    assert not together.feasible


def test_it_is_no_slower_than_the_best_uniform_pace(study: Study, found: Fastest) -> None:
    """By bisection on a change of the whole cycle, dwells scaled with it, by another function."""
    good, bad = 20.0, 0.01
    while good - bad > 1e-3:
        middle = 0.5 * (good + bad)
        good, bad = (
            (middle, bad) if evaluate(changed(study, TaskChange(time=middle)), DRIVES).feasible else (good, middle)
        )
    uniform = good * sum(move.before for move in found.moves)
    assert sum(move.after for move in found.moves) <= uniform * (1.0 + 8.0 * FACTOR_TOLERANCE)


def test_without_weight_a_torque_limit_gives_the_root_of_its_utilisation(study: Study) -> None:
    """No gravity, no payload, friction-free but for the gear: with one limit far below all others T ~ 1/t^2."""
    assert study.arm is not None
    arm = replace(study.arm, gravity=np.zeros(3))
    gears = study.catalog.gears
    weak = replace(gears["hd_CSG-32-120-2UH"], repeated_peak_torque=20.0)
    catalog = replace(study.catalog, gears={**gears, weak.key: weak})
    light = replace(study, arm=arm, catalog=catalog, safety=replace(study.safety, peak_torque=1.0))
    before = evaluate(light, DRIVES)
    used = {
        name: next(check.utilisation for check in one.checks if check.name == "gear repeated peak torque")
        for name, one in before.joints.items()
    }
    assert all(used.values())
    result = fastest(light, DRIVES)
    assert {move.check for move in result.moves} == {"gear repeated peak torque"}
    kept = _scaled_moves(light, DRIVES, light.cycle, moves_of(light.cycle))
    assert kept.edges.max() == pytest.approx(max(used.values()) ** 0.5, rel=8.0 * FACTOR_TOLERANCE)
    assert max(move.after / move.before for move in result.moves) < kept.edges.max()  # timed within


def test_weight_that_no_pace_can_hold_is_an_answer(study: Study) -> None:
    gears = study.catalog.gears
    weak = replace(gears["hd_CSG-32-120-2UH"], repeated_peak_torque=0.1)
    found = fastest(replace(study, catalog=replace(study.catalog, gears={**gears, weak.key: weak})), DRIVES)
    assert not found.feasible and "no cycle time meets all limits" in next(iter(fastest_lines(found)))


def test_what_has_no_pace_is_a_message(study: Study) -> None:
    with pytest.raises(InputError, match="arm"):
        fastest(replace(study, arm=None), DRIVES)
    still = replace(study.cycle, velocity=0.0 * study.cycle.velocity)
    with pytest.raises(InputError, match="no move"):
        fastest(replace(study, cycle=still), DRIVES)


def test_words_and_motion(found: Fastest, tmp_path: Path) -> None:
    first, *rest = fastest_lines(found)
    assert first.startswith("fastest cycle: ") and all(" at joint_" in line or " at supply" in line for line in rest)
    rows = motion_csv(found.study).splitlines()
    assert rows[0] == "time [s],joint_1 [rad],joint_2 [rad]"
    assert float(rows[-1].split(",")[0]) == pytest.approx(found.duration, rel=1e-8)


def test_heat_over_the_cycle_binds_the_moves_that_instants_do_not(study: Study) -> None:
    """A motor whose nominal current is far below its peak: the RMS decides, and the study's own form is kept."""
    motors = study.catalog.motors
    key = DRIVES["joint_1"][0]
    used = max(
        check.utilisation or 0.0 for joint in evaluate(study, DRIVES).joints.values() for check in joint.checks
        if check.name == "motor RMS current"
    )  # fmt: skip
    weak = replace(motors[key], nominal_current=0.9 * used * (motors[key].nominal_current or 0.0))
    hot = replace(study, catalog=replace(study.catalog, motors={**motors, key: weak}))
    found = fastest(hot, DRIVES)
    assert found.feasible and found.share > 0.0
    lasting = [move for move in found.moves if np.isnan(move.time)]
    assert lasting and {move.check for move in lasting} <= {"motor RMS current", "winding temperature"}
    assert all(move.after / move.before == pytest.approx(found.share, rel=1e-9) for move in lasting)
    assert any("over the whole cycle" in line for line in fastest_lines(found))


def test_a_cold_start_binds_each_move_by_itself(study: Study) -> None:
    """Its voltage is that of an instant: no move waits for the other, and each at the edge fails when made quicker."""
    cold = replace(study, cold_start=-10.0, supply=replace(study.supply, voltage=20.0))
    best = _scaled_moves(cold, DRIVES, cold.cycle, moves_of(cold.cycle))
    assert best.feasible and best.share == 0.0
    for index in range(2):
        quicker = best.pace * np.where(np.arange(2) == index, 1.0 - 15.0 * FACTOR_TOLERANCE, 1.0)
        joints = evaluate(replace(cold, cycle=retimed(cold.cycle, best.moves, quicker)), DRIVES).joints.values()
        failed = {one.name for joint in joints for one in joint.checks if one.verdict is Verdict.FAIL}
        assert "cold start voltage" in failed
    text = "".join(fastest_lines(fastest(cold, DRIVES)))
    assert "limited by cold start voltage" in text and "whole cycle" not in text


def test_a_joint_that_rests_all_the_time_limits_no_speed() -> None:
    """Its speed of zero is no limit of the others, whose moves are timed within."""
    text = study_template("planar-2r").replace("dwell: 0.5 s", "dwell: 6 s").replace("power: 100 W", "power: 1 kW")
    cool = load_study(text)
    held = {name: getattr(cool.cycle, name).copy() for name in ("position", "velocity", "acceleration")}
    held["position"][:, 1] = cool.cycle.position[:, 1].mean()
    held["velocity"][:, 1] = held["acceleration"][:, 1] = 0.0
    still = replace(cool, cycle=replace(cool.cycle, **held))
    uniform = _scaled_moves(still, DRIVES, still.cycle, moves_of(still.cycle))
    assert fastest(still, DRIVES).duration - 12.0 < 0.95 * (uniform.duration - 12.0)


def test_a_linkage_runs_no_faster_than_its_stops_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """So fast that a stop on its ramp would leave the reach of the four-bar is too fast, and no error."""
    study = two_links(closures=short_crank())
    stop = Stop(ramp=0.6, power_off=False)
    share = np.linspace(0.0, 1.0, 21)[:, None]
    rates = (10 * share**3 - 15 * share**4 + 6 * share**5, 30 * share**2 * (1 - share) ** 2,
             60 * share * (1 - share) * (1 - 2 * share))  # fmt: skip
    there, speed, rate = (one * [1.0, 0.3] for one in rates)
    cycle = replace(
        study.cycle, position=np.concatenate([there, there[-2::-1]]), velocity=np.concatenate([speed, -speed[1:]]),
        acceleration=np.concatenate([rate, -rate[1:]]),
    )  # fmt: skip
    tasks = tuple(replace(task, stop=stop, brakes=()) for task in study.joints)
    slow = changed(replace(study, cycle=cycle, joints=tasks), TaskChange(time=4.0))
    with pytest.raises(InputError, match="leads the linkage where it cannot go"):
        evaluate(changed(slow, TaskChange(time=0.25)), ("M", "G"))
    monkeypatch.setattr(answer, "FACTOR_TOLERANCE", 0.05)  # fewer evaluations
    least = answer._min_factor(slow, given_drives(slow, ("M", "G")), moves_of(slow.cycle)[0])
    assert 0.25 < least < 1.0


def test_a_rebuilt_cycle_is_its_rests_with_other_moves_between(make: SimpleNamespace) -> None:
    """Two moves that share a rest, then a dwell, on numbers that fit no motion; row by row."""
    rng = np.random.default_rng(3)
    time = np.array([0.5, 0.9, 1.4, 2.0, 2.3, 2.9, 3.6, 3.8, 4.7, 5.9])
    q, qd, qdd = rng.normal(size=(3, 10, 2))
    old = make.arm_cycle(time, q, qd, qdd, np.arange(10) % 2, ("a", "b"))
    old = replace(old, segment=np.arange(10) // 4, segment_names=("x", "y", "z"))
    moves = [slice(0, 4), slice(3, 8)]
    samples = [np.array([1, 1, 2, 3, 3]), np.array([4, 5, 7])]
    paths: list[Any] = [SimpleNamespace(position=rng.normal(size=(len(one), 2)), sample=one) for one in samples]
    spans = [np.array([0.0, 0.1, 0.3, 0.4, 0.7]), np.array([0.0, 0.2, 0.5])]
    blocks = [(span, *rng.normal(size=(2, len(span), 2))) for span in spans]
    made, found = _rebuilt(old, moves, paths, blocks)
    first, second = ([(path.position[i], block[1][i], block[2][i], int(path.sample[i])) for i in range(len(block[0]))]
                     for path, block in zip(paths, blocks, strict=True))  # fmt: skip
    begin, middle, end = ((q[i], qd[i], np.zeros(2), i) for i in (0, 3, 7))
    rows = [begin, *first, middle, *second, end, *((q[i], qd[i], qdd[i], i) for i in (8, 9))]
    for k, (position, velocity, acceleration, source) in enumerate(rows):
        np.testing.assert_array_equal(made.position[k], position)
        np.testing.assert_array_equal(made.velocity[k], velocity)
        np.testing.assert_array_equal(made.acceleration[k], acceleration)
        assert (made.payload[k], made.segment[k]) == (old.payload[source], old.segment[source])
    instants = [0.5, *(0.5 + spans[0]), 1.2, *(1.2 + spans[1]), 1.7, 1.7 + 0.9, 1.7 + 2.1]
    np.testing.assert_allclose(made.time, instants, rtol=1e-12)
    assert found == [slice(0, 7), slice(6, 11)] and made.parts == (slice(0, 13),)


def test_a_move_that_fails_beside_others_is_slowed_until_it_holds(study: Study) -> None:
    """And no other: from a little less than the smallest factor of each move, one move at a time."""
    moves = moves_of(study.cycle)
    least = _scaled_moves(study, DRIVES, study.cycle, moves).edges

    def at(pace: np.ndarray) -> Evaluation:
        return evaluate(replace(study, cycle=retimed(study.cycle, moves, pace)), DRIVES)

    for index in range(len(moves)):
        start = least.copy()
        start[index] *= 1.0 - 15.0 * FACTOR_TOLERANCE
        found = _repaired(at, moves, start)
        assert np.flatnonzero(found != start).tolist() == [index]
        assert 1.0 - 2.0 * FACTOR_TOLERANCE <= found[index] / least[index] <= 1.0 + 6.0 * FACTOR_TOLERANCE


def test_moves_are_timed_within_where_no_heat_binds(study: Study, tmp_path: Path) -> None:
    """Long rests: instants alone bind. Quicker than any pace of the study's own form, on the same way, and it holds."""
    text = study_template("planar-2r").replace("dwell: 0.5 s", "dwell: 6 s").replace("power: 100 W", "power: 1 kW")
    cool = load_study(text)
    kept = _scaled_moves(cool, DRIVES, cool.cycle, moves_of(cool.cycle))
    quick = fastest(cool, DRIVES)
    assert kept.share == quick.share == 0.0 and quick.feasible
    rests = 12.0
    assert quick.duration - rests < 0.9 * (kept.duration - rests)
    cycle = quick.study.cycle
    rates_belong_together(cycle, 1e-3)
    again = moves_of(cycle)  # rests and moves remain what they were, each with its samples at rest
    assert [cycle.segment_names[cycle.segment[move.start + 1]] for move in again] == ["there", "back"]
    assert cycle.parts == (slice(0, len(cycle.time)),)
    calm = ~(cycle.velocity.any(axis=1) | cycle.acceleration.any(axis=1))
    for edge in (edge for move in again for edge in (move.start, move.stop - 1)):
        assert calm[np.abs(cycle.time - cycle.time[edge]) < 1e-12].any()
    for move in again:  # nor does any joint turn back
        steps = np.diff(cycle.position[move], axis=0)
        assert (steps * np.sign(steps.sum(axis=0)) >= -1e-12).all()
    assert [one.start for one in quick.moves] == pytest.approx([float(cycle.time[move.start]) for move in again])
    lasts = [float(cycle.time[move.stop - 1] - cycle.time[move.start]) for move in again]
    assert [one.after for one in quick.moves] == pytest.approx(lasts)
    assert quick.duration == pytest.approx(rests + sum(lasts), rel=1e-9)
    for move in quick.moves:  # the limit that binds is nearly used up, at an instant of its move
        checks = quick.evaluation.joints[move.place].checks
        [binding] = [one for one in checks if one.name == move.check]
        assert 0.9 < (binding.utilisation or 0.0) <= 1.0
        assert move.start <= move.time <= move.start + move.after
    worst = {move.check for move in quick.moves}
    assert worst <= {"motor voltage", "gear repeated peak torque", "amplifier peak current", "motor peak torque"}
