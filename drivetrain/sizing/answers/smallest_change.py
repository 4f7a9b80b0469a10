"""The smallest change of one number with which a drive that falls would pass, found and then proven.

A change is searched outwards from no change, in steps, until the drive passes; between the last step that fails and
the first that passes the edge is bisected. Both sides of it are then evaluated in full.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.matching import scaled_gear
from drivetrain.sizing.answers.ratio_results import NearGear
from drivetrain.sizing.answers.why_not_results import SmallestChange
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.old_judge import judge
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.bench import Bench, Worst, with_ratio, worst_of
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.verdicts import Verdict, worst

MOST = 10.0  # times slower, times the voltage, times the ratio or a tenth of it: beyond, it is another task
STEPS, RATIO_STEPS = 32, 64
EDGE = 1e-7  # relative error of the edge
AT_THE_OUTPUT = {
    "gear repeated peak torque", "gear momentary peak torque", "gear average torque", "output bearing tilting moment",
    "output bearing axial load", "output bearing radial load",
}  # fmt: skip
SLOWEST = 1e4  # times the cycle's length: nothing but weight and friction is left


Steps = Sequence[float] | Array


class Edge(NamedTuple):
    """Where a drive begins to pass.

    Attributes:
        passes: Factor at which it does.
        falls: Factor just short of it, at which it does not.
    """

    passes: float
    falls: float


@dataclass(frozen=True, eq=False)
class _Search:
    """One kind of change at one joint: factors on a number, from 1 outwards."""

    what: str
    unit: str
    before: float
    steps: Steps
    at: Callable[[float], Worst]
    evaluated: Callable[[float], Evaluation]
    joint: str


def first_passing(at: Callable[[float], Worst], steps: Steps) -> Edge | None:
    """The edge nearest to the first step beyond which something passes.

    Returns:
        Both sides of the edge, within EDGE of each other; None when no step passes.
    """
    before = steps[0]
    for step in steps[1:]:
        if at(step).utilisation <= 1.0:
            passes, falls = step, before
            while abs(passes - falls) > EDGE * max(abs(passes), abs(falls)):
                middle = 0.5 * (passes + falls)
                passes, falls = (middle, falls) if at(middle).utilisation <= 1.0 else (passes, middle)
            return Edge(passes, falls)
        before = step
    return None


def smallest_changes(bench: Bench, joint: int, partners: Sequence[str] = ()) -> tuple[SmallestChange, ...]:
    """The smallest change of ratio, of payload, of cycle time and of supply voltage that lets a joint's drive pass."""
    return (
        _ratio(bench, joint, partners), _payload(bench, joint), _time(bench, joint), _voltage(bench, joint)
    )  # fmt: skip


def _payload(bench: Bench, joint: int) -> SmallestChange:
    study, kind = bench.study, ("payload", "kg")
    heaviest = max((one.mass for one in study.payloads), default=0.0)
    if study.arm is None:
        return SmallestChange(*kind, 0.0, reason="a load table gives the torques: it has no payload")
    if heaviest == 0.0:
        return SmallestChange(*kind, 0.0, reason="nothing is carried")
    search = _of_task(bench, joint, kind, heaviest, np.linspace(1.0, 0.0, STEPS), lambda f: TaskChange(payload=f))
    return _answer(search, "without any payload", "")


def _time(bench: Bench, joint: int) -> SmallestChange:
    kind, length = ("cycle time", "s"), bench.study.cycle.duration
    search = _of_task(bench, joint, kind, length, np.geomspace(1.0, MOST, STEPS), lambda f: TaskChange(time=f))
    still = search.at(SLOWEST)
    held = ""
    if still.utilisation > 1.0 and bench.study.arm is not None:
        held = f"; all but standing still, {still.check} asks {_percent(still)}"
    return _answer(search, f"in {MOST:g} times the time", held)


def _voltage(bench: Bench, joint: int) -> SmallestChange:
    kind, volts = ("supply voltage", "V"), bench.study.supply.voltage
    search = _of_task(bench, joint, kind, volts, np.geomspace(1.0, MOST, STEPS), lambda f: TaskChange(voltage=f))
    return _answer(search, f"with {MOST:g} times the voltage", "")


def _of_task(
    bench: Bench, joint: int, kind: tuple[str, str], before: float, steps: Steps,
    change: Callable[[float], TaskChange],
) -> _Search:  # fmt: skip
    return _Search(
        *kind, before, steps,
        lambda factor: bench.joint_worst(joint, change(factor)),
        lambda factor: evaluate(changed(bench.study, change(factor)), bench.keys),
        bench.study.joints[joint].name,
    )  # fmt: skip


def _ratio(bench: Bench, joint: int, partners: Sequence[str]) -> SmallestChange:
    name, drive = bench.study.joints[joint].name, bench.mounted[joint]
    own = abs(drive.gear.ratio)
    motor, key = bench.keys[name]
    if not key:
        return SmallestChange("gear ratio", "", own, reason="a direct drive has no ratio to change")

    def at(factor: float) -> Worst:
        return bench.joint_worst(joint, drive=replace(drive, gear=scaled_gear(drive.gear, own * factor)))

    def evaluated(factor: float) -> Evaluation:
        study, turned = with_ratio(bench.study, key, own * factor)
        return evaluate(study, {**bench.keys, name: (motor, turned)})

    up, down = (np.geomspace(1.0, end, RATIO_STEPS) for end in (MOST, 1.0 / MOST))
    found = [edge for edge in (first_passing(at, steps) for steps in (up, down)) if edge is not None]
    search = _Search("gear ratio", "", own, [*down[:0:-1], *up], at, evaluated, name)
    gear = _nearest_gear(bench, joint, partners)
    if found:
        edge = min(found, key=lambda one: abs(math.log(one.passes)))
        return replace(_proven(search, edge), gear=gear)
    _, there = min((at(factor).utilisation, factor) for factor in search.steps)
    stays = at(there)
    reason = (
        f"no ratio from a tenth to ten times as large lets it pass: at the best, {own * there:.4g}, "
        f"{stays.check} asks {_percent(stays)} of what there is"
    )
    if stays.check in AT_THE_OUTPUT:
        reason = f"{stays.check} is asked of the gear's output, whatever the ratio: {_percent(stays)} of what there is"
    return SmallestChange(
        "gear ratio", "", own, check=stays.check, utilisation=stays.utilisation, reason=reason, gear=gear
    )


def _nearest_gear(bench: Bench, joint: int, partners: Sequence[str]) -> NearGear | None:
    """The gear nearest in ratio that passes with its own sheet; of equals, one of the same series and size first."""
    study, task, own = bench.study, bench.study.joints[joint], bench.mounted[joint].gear
    motor = bench.keys[task.name][0]
    rows = study.catalog.gears

    def far(key: str) -> tuple[float, bool, str]:
        row = rows[key]
        other = (row.maker, row.series, row.size) != (own.maker, own.series, own.size)
        return abs(math.log(abs(row.ratio / own.ratio))), other, key

    for key in sorted((key for key in partners if key in rows and key != own.key), key=far):
        op = bench.run(joint, drive=bench.shelf.drive(task, motor, key))
        checks = judge(op, stop_at_fail=True)
        if op.missing or any(check.verdict is Verdict.FAIL for check in checks):
            continue
        binding = max(checks, key=lambda one: one.utilisation or 0.0)
        verdict = worst(check.verdict for check in checks)
        return NearGear(key, rows[key].ratio, binding.utilisation or 0.0, binding.name, verdict, True)
    return None


def _answer(search: _Search, furthest: str, held: str) -> SmallestChange:
    """The edge, evaluated; or what is still over its limit at the furthest change."""
    edge = first_passing(search.at, search.steps)
    if edge is not None:
        return _proven(search, edge)
    left, now = search.at(search.steps[-1]), search.at(search.steps[0])
    words = f"even {furthest}, {left.check} asks {_percent(left)} of what there is"
    if left.check == now.check and math.isclose(left.utilisation, now.utilisation, rel_tol=1e-9):
        words = f"{left.check} does not depend on it: {_percent(left)} of what there is"
    return SmallestChange(
        search.what, search.unit, search.before, check=left.check, utilisation=left.utilisation, reason=words + held
    )


def _proven(search: _Search, edge: Edge) -> SmallestChange:
    """Both sides of an edge evaluated in full; each is moved away from it while rounding lets it say otherwise."""
    width = EDGE * max(abs(edge.passes), abs(edge.falls))
    way = math.copysign(width, edge.passes - edge.falls)
    passes, falls = edge
    good, bad = search.evaluated(passes), search.evaluated(falls)
    for _ in range(8):
        if _falls(good, search.joint):
            passes += way
            good = search.evaluated(passes)
        if not _falls(bad, search.joint):
            falls -= way
            bad = search.evaluated(falls)
    most = worst_of(bad.joints[search.joint].checks)
    return SmallestChange(
        search.what, search.unit, search.before, float(search.before * passes), float(search.before * falls),
        most.check, most.utilisation, good.feasible,
    )  # fmt: skip


def _falls(evaluation: Evaluation, joint: str) -> bool:
    return evaluation.joints[joint].verdict is Verdict.FAIL


def _percent(found: Worst) -> str:
    return f"{100.0 * found.utilisation:.4g} %" if math.isfinite(found.utilisation) else "without bound"
