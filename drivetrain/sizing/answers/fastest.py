"""The fastest cycle that given drives can hold: the way kept, every move as quick as their real limits allow.

Each move, from rest to rest, keeps its form and takes another time. First it is made as short as all limits allow that
bind at an instant: torque and speed of the gear, current, voltage over speed, bearings, the supply's peaks. What counts
over the whole cycle, heat before all, may then need more: no move is then quicker than a common share of its time in
the study.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.judge.evaluate import Given, evaluate
from drivetrain.sizing.results import Evaluation
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import Check, Verdict, shared_place

MOST = 50.0  # times slower or faster than the study: beyond, it is another task
STEP = 1.25  # of the factor while an edge is looked for
CLOSE = 1e-3  # of the factor, to the safe side
REPAIRS = 60  # steps of a move that fails beside the others, though it held alone
OVER_THE_CYCLE = {"winding temperature"}  # told with an instant, and yet of the whole cycle


@dataclass(frozen=True)
class MoveTime:
    """One move of the fastest cycle.

    Attributes:
        name: Of the segment that it belongs to.
        start: In the fastest cycle [s].
        before, after: How long it takes in the study and in the fastest cycle [s].
        place: Joint, or ``supply``, whose limit binds it; empty where nothing was found to bind.
        check: Which limit that is.
        time: When, in the fastest cycle [s]; NaN for a limit over the whole cycle.
    """

    name: str
    start: float
    before: float
    after: float
    place: str
    check: str
    time: float


@dataclass(frozen=True, eq=False)
class Fastest:
    """The fastest cycle of a study's drives.

    Attributes:
        study: With that cycle.
        evaluation: Of the drives on it.
        before: Length of the study's own cycle [s].
        moves: In their order.
        share: Of its time in the study, below which what counts over the cycle lets no move go; 0: it does not bind.
    """

    study: Study
    evaluation: Evaluation
    before: float
    moves: tuple[MoveTime, ...]
    share: float

    @property
    def feasible(self) -> bool:
        """Whether there is a pace at which every check holds."""
        return self.evaluation.feasible

    @property
    def duration(self) -> float:
        """Length of the fastest cycle [s]."""
        return self.study.cycle.duration


def fastest(study: Study, drives: Mapping[str, Given] | None = None) -> Fastest:
    """The shortest cycle in which the drives hold every check, dwells and the form of each move kept.

    Args:
        study: Of an arm.
        drives: Keys of (motor, gear) by joint name; None: those the study gives.

    Returns:
        The cycle, its evaluation, and for each move which limit binds it. Where not even a pace 50 times slower holds,
        the evaluation is that of the slowest one tried, and not feasible.

    Raises:
        InputError: No arm, a joint without a drive, or no move from rest to rest.
    """
    cycle = study.cycle
    if study.arm is None:
        hint = "the torques of a load table would change with its pace"
        raise InputError(Fault("arm", "is needed to run a cycle at another pace", hint=hint, file=study.path))
    moves = moves_of(cycle)
    if not moves:
        raise InputError(Fault("cycle", "holds no move from rest to rest", hint="nothing can be made faster"))
    edges = np.array([_alone(study, drives, move) for move in moves])

    def at(pace: Array) -> Evaluation:
        return evaluate(replace(study, cycle=retimed(cycle, moves, pace)), drives)

    edges = _repaired(at, moves, edges)
    share, least = 0.0, float(edges.min())
    if not _holds(at(edges)):
        share = _edge(lambda share: _holds(at(np.maximum(edges, share))), least, quicker=False)
    pace = np.maximum(edges, share)
    evaluation = at(pace)
    lasting = _lasting(at, edges, share)
    times = _move_times(cycle, evaluation, moves, edges, pace, lasting)
    return Fastest(evaluation.study, evaluation, cycle.duration, times, share)


def moves_of(cycle: Cycle) -> list[slice]:
    """The samples of each move, from one rest to the next, both included.

    Args:
        cycle: Any.

    Returns:
        Slices, in their order; none overlaps by more than the sample at rest between two.
    """
    found = []
    quick = np.abs(cycle.velocity).max(axis=1)
    resting = quick <= 1e-9 * max(float(quick.max()), 1e-300)
    pushed = np.abs(cycle.acceleration).max(axis=1)
    calm = pushed <= 1e-9 * max(float(pushed.max()), 1e-300)
    twin = np.concatenate([np.diff(cycle.time) <= 0.0, [True]]) | np.concatenate([[True], np.diff(cycle.time) <= 0.0])
    ends = resting & (calm | twin)  # a turning point under full torque is no end: it has one acceleration
    for part in cycle.parts:
        places = [i for i in range(part.start, part.stop) if ends[i] or i in (part.start, part.stop - 1)]
        for first, last in pairwise(places):
            if not resting[first : last + 1].all() and cycle.time[last] > cycle.time[first]:
                found.append(slice(first, last + 1))
    return found


def retimed(cycle: Cycle, moves: list[slice], factors: Array) -> Cycle:
    """The same way with each move in another time.

    Args:
        cycle: Any.
        moves: Of it.
        factors: Of the time of each, (moves,).

    Returns:
        The cycle, dwells as they were.
    """
    steps, scale = np.diff(cycle.time, prepend=cycle.time[0]), np.ones(len(cycle.time))
    for move, factor in zip(moves, factors, strict=True):
        steps[move.start + 1 : move.stop] *= factor
        scale[move] = factor
    return replace(
        cycle,
        time=cycle.time[0] + np.cumsum(steps),
        velocity=cycle.velocity / scale[:, None],
        acceleration=cycle.acceleration / scale[:, None] ** 2,
    )


def _alone(study: Study, drives: Mapping[str, Given] | None, move: slice) -> float:
    """The share of its time that a move may take as far as instants go."""
    own = _cut(study.cycle, move)
    whole = [slice(0, len(own.time))]

    def holds(factor: float) -> bool:
        result = evaluate(replace(study, cycle=retimed(own, whole, np.array([factor]))), drives)
        return all(check.verdict is not Verdict.FAIL for _, check in _instants(result))

    return _edge(holds, 1.0)


def _repaired(at: Callable[[Array], Evaluation], moves: list[slice], edges: Array) -> Array:
    """The edges beside each other: a rest before or after a move may make it the harder one."""
    pace = edges.copy()
    for _ in range(REPAIRS):
        result = at(pace)
        time = result.study.cycle.time
        failed = [
            check.time for _, check in _instants(result) if check.verdict is Verdict.FAIL and check.time is not None
        ]
        slow = {k for k, move in enumerate(moves) for t in failed if time[move.start] <= t <= time[move.stop - 1]}
        if not slow:
            break
        pace[list(slow)] *= 1.0 + 5.0 * CLOSE
    return pace


def _cut(cycle: Cycle, move: slice) -> Cycle:
    """One move as a cycle of its own; the instants stay where they are."""
    arrays = {
        name: getattr(cycle, name)[move]
        for name in ("time", "position", "velocity", "acceleration", "payload", "segment")
    }
    return replace(cycle, **arrays, parts=(), shares=(1.0,), part_names=("",))


def _edge(holds: Callable[[float], bool], start: float, *, quicker: bool = True) -> float:
    """The smallest factor that holds: from the start towards less where that holds, else towards more.

    Args:
        quicker: Whether less than the start is looked for.
    """
    if holds(start):
        if not quicker:
            return start
        good, bad = start, start / STEP
        while holds(bad):
            good, bad = bad, bad / STEP
            if bad < start / MOST:
                return good
    else:
        bad, good = start, start * STEP
        while not holds(good):
            bad, good = good, good * STEP
            if good > start * MOST:
                return good
    while good - bad > CLOSE * good:
        middle = math.sqrt(good * bad)
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


def _holds(evaluation: Evaluation) -> bool:
    return all(check.verdict is not Verdict.FAIL for _, check in _checks(evaluation))


def _checks(evaluation: Evaluation) -> list[tuple[str, Check]]:
    found = [(name, check) for name, joint in evaluation.joints.items() for check in joint.checks]
    return found + [(shared_place(check), check) for check in evaluation.shared]


def _instants(evaluation: Evaluation) -> list[tuple[str, Check]]:
    """The checks that bind at an instant, whatever happens in the rest of the cycle."""
    return [
        one for one in _checks(evaluation)
        if one[1].time is not None and one[1].name not in OVER_THE_CYCLE and one[1].utilisation is not None
    ]  # fmt: skip


def _lasting(at: Callable[[Array], Evaluation], edges: Array, share: float) -> tuple[str, str]:
    """Place and name of the check over the whole cycle that fails a little below its share."""
    if share == 0.0:
        return "", ""
    result = at(np.maximum(edges, share / (1.0 + 3.0 * CLOSE)))
    failed = [one for one in _checks(result) if one[1].verdict is Verdict.FAIL]
    place, check = max(failed, key=lambda one: one[1].utilisation or 0.0, default=("", None))
    return (place, "" if check is None else check.name)


def _move_times(
    before: Cycle, result: Evaluation, moves: list[slice], edges: Array, pace: Array, lasting: tuple[str, str]
) -> tuple[MoveTime, ...]:
    times, after = [], result.study.cycle
    for move, edge, final in zip(moves, edges, pace, strict=True):
        first, last = move.start, move.stop - 1
        length, start, end = before.time[last] - before.time[first], float(after.time[first]), float(after.time[last])
        name = before.segment_names[before.segment[(first + last) // 2]]
        place, check, at = *lasting, math.nan
        if final <= edge:
            alone = evaluate(replace(result.study, cycle=_cut(after, move)), result.drives)
            place, most = max(_instants(alone), key=lambda one: one[1].utilisation or 0.0, default=("", None))
            check, at = ("", math.nan) if most is None else (most.name, most.time or start)
        times.append(MoveTime(name, start, float(length), end - start, place, check, at))
    return tuple(times)
