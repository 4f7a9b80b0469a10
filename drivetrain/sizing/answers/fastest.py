"""The fastest cycle of given drives along the same path, with every move as fast as their limits allow.

First each move, from rest to rest, is scaled uniformly in time. Its duration is the smallest that satisfies all limits
at an instant (torque and speed of the gear, current, voltage, bearings, peaks of the supply, speed limits of the arm),
found by bisection. If limits over the whole cycle, such as heat, are then exceeded, all moves are given at least a
common share of their duration in the study. If they are not, the moves are also retimed along the path: time-optimal
path parameterisation with limits of gear torque, motor torque and speed. The faster result counts, and all checks are
made on it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from drivetrain.arrays import Array, Indices
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.motion.time_optimal import quickest_squares, times
from drivetrain.sizing.judge.evaluate import Given, evaluate, given_drives
from drivetrain.sizing.judge.vary import edge
from drivetrain.sizing.results import Evaluation, Selection, every_drive, placed_checks
from drivetrain.study.model import Study, refuse_moving_base
from drivetrain.study.parts.verdicts import Check, fails

MAX_FACTOR = 50.0  # largest factor of slowing down or speeding up
BRACKET_STEP = 1.25  # factor between steps while an edge is bracketed
FACTOR_TOLERANCE = 1e-3  # relative accuracy of the factor, on the safe side
PATH_INTERVALS = 160  # intervals of a retimed move
MIN_SPACING = 1.0 / 400.0  # smallest distance between two points of its spline, relative to the length of the path
MAX_REPAIRS = 60  # steps in which moves that fail together, though each is feasible alone, are slowed down
SPEED_LIMIT = "the arm's speed limit"
OVER_THE_CYCLE = {"winding temperature"}  # reported with an instant, although it depends on the whole cycle
# Reported without an instant, although a single one decides.
WITHOUT_A_TIME = {"cold start torque", "cold start current", "cold start voltage", "current to stop"}


@dataclass(frozen=True)
class MoveTime:
    """One move of the fastest cycle.

    Attributes:
        name: Name of its segment.
        start: Start of the move in the fastest cycle [s].
        before, after: Duration in the study and in the fastest cycle [s].
        place: Joint, or ``supply``, with the binding limit; empty if none was found.
        check: The binding limit.
        time: Instant of the limit in the fastest cycle [s]; NaN for a limit over the whole cycle, those of a cold
            start, and the current to stop.
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
        study: The study with the fastest cycle.
        evaluation: Evaluation of the drives with this cycle.
        before: Duration of the study's own cycle [s].
        moves: The moves in order.
        share: Smallest share of the duration of a move that limits over the whole cycle allow; 0 if they do not bind.
    """

    study: Study
    evaluation: Evaluation
    before: float
    moves: tuple[MoveTime, ...]
    share: float

    def __repr__(self) -> str:
        verdict = self.evaluation.verdict
        return f"Fastest({self.study.name}: {self.duration:.4g} s instead of {self.before:.4g} s, {verdict})"

    @property
    def feasible(self) -> bool:
        """Whether there is a cycle time at which every check is satisfied."""
        return self.evaluation.feasible

    @property
    def duration(self) -> float:
        """Duration of the fastest cycle [s]."""
        return self.study.cycle.duration


def fastest(study: Study | Evaluation | Selection, drives: Mapping[str, Given] | Given | None = None) -> Fastest:
    """The shortest cycle in which the drives satisfy every check, with the same dwells and the same path of each move.

    The speed limits of the arm's file apply. If no check over the whole cycle binds, moves are also retimed along their
    paths, which makes accelerations discontinuous.

    Args:
        study: Study of an arm; or an evaluation or a selection, whose drives are used.
        drives: As for ``evaluate``; None: the drives of the study.

    Returns:
        The cycle, its evaluation, and the binding limit of each move. If not even a cycle 50 times slower is feasible,
        the evaluation is that of the slowest one tried.

    Raises:
        InputError: No arm, a base that moves, a joint without a drive, or no move from rest to rest.
    """
    if not isinstance(study, Study):
        evaluation = every_drive(study) if isinstance(study, Selection) else study
        study, drives = evaluation.study, drives or evaluation.drives
    cycle = study.cycle
    if study.arm is None:
        hint = "the torques of a load table would change with its pace"
        raise InputError(Fault("arm", "is needed to run a cycle at another pace", hint=hint, file=study.path))
    refuse_moving_base(study, "another pace of the cycle")
    moves = moves_of(cycle)
    if not moves:
        raise InputError(Fault("cycle", "holds no move from rest to rest", hint="nothing can be made faster"))
    drives = given_drives(study, drives or {})
    evaluate(study, drives)  # the faults of the study itself
    best = _scaled_moves(study, drives, cycle, moves)
    if best.feasible and best.share == 0.0:
        with suppress(InputError):  # of a trial, whose stops on their ramp lead a linkage where it cannot go
            again = _scaled_moves(study, drives, *_retimed_along_paths(study, drives, best, cycle, moves))
            best = again if again.feasible and again.duration < best.duration else best
    return Fastest(best.evaluation.study, best.evaluation, cycle.duration, _move_times(cycle, moves, best), best.share)


@dataclass(frozen=True, eq=False)
class _ScaledCycle:
    """A cycle with a factor on the duration of each move."""

    cycle: Cycle  # before scaling
    moves: list[slice]
    edges: Array  # smallest factor of each move by the limits at an instant, (moves,)
    share: float  # as ``Fastest.share``
    pace: Array  # factor on the duration of each move, (moves,)
    evaluation: Evaluation  # evaluation of the drives with these factors
    over_cycle: tuple[str, str]  # place and name of the binding check over the whole cycle

    @property
    def feasible(self) -> bool:
        return self.evaluation.feasible

    @property
    def duration(self) -> float:
        return self.evaluation.study.cycle.duration


def _scaled_moves(study: Study, drives: Mapping[str, Given] | None, cycle: Cycle, moves: list[slice]) -> _ScaledCycle:
    """Scale each move of a cycle uniformly to the smallest duration that the checks allow."""
    study = replace(study, cycle=cycle)
    edges = np.array([_min_factor(study, drives, move) for move in moves])

    def at(pace: Array) -> Evaluation:
        return evaluate(replace(study, cycle=retimed(cycle, moves, pace)), drives)

    edges = _repaired(at, moves, edges)
    share, least = 0.0, float(edges.min())
    if not _satisfied(at(edges)):
        share = _smallest_factor(lambda share: _satisfied(at(np.maximum(edges, share))), least, quicker=False)
    pace = np.maximum(edges, share)
    return _ScaledCycle(cycle, moves, edges, share, pace, at(pace), _over_cycle(at, edges, share))


class _MovePath(NamedTuple):
    """The path of a move over its path parameter from 0 to 1."""

    place: Array  # path parameter, (N,)
    position: Array  # positions of the joints [rad or m], (N, n)
    first: Array  # first derivative of the position, (N, n)
    second: Array  # second derivative, (N, n)
    sample: Indices  # sample of the cycle at or after each place, (N,)
    tip_wrench: Array | None  # as ``Cycle.tip_wrench``, (N, 6)


def _retimed_along_paths(
    study: Study, drives: Mapping[str, Given] | None, best: _ScaledCycle, cycle: Cycle, moves: list[slice]
) -> tuple[Cycle, list[slice]]:
    """Time-optimal parameterisation of a cycle's moves with constant limits of torque and speed; and the moves.

    The limits of gear torque, motor torque and speed of each joint are the values of the best cycle so far divided by
    their utilisations. ``evaluate`` decides in the end.
    """
    paths = [_move_path(cycle, move) for move in moves]
    after = best.evaluation.study.cycle
    rates = [1.0 / (after.time[move.stop - 1] - after.time[move.start]) for move in best.moves]

    def torques(speeds: bool, pushed: str) -> list[Array]:
        """Torques at gears, at motors without friction and of friction, and motor speeds, (4, N, n) a move."""
        blocks = []
        for path, rate in zip(paths, rates, strict=True):
            acceleration = rate**2 * getattr(path, pushed) if pushed else np.zeros_like(path.first)
            blocks.append((path.place / rate, rate * speeds * path.first, acceleration))
        trial, places = _rebuilt(cycle, moves, paths, blocks)
        series = [joint.series for joint in evaluate(replace(study, cycle=trial), drives).joints.values()]
        found = [
            [one.gear_torque, one.motor_torque - one.friction_torque, one.friction_torque, one.motor_speed]
            for one in series
        ]
        inside = [slice(place.start + 1, place.stop - 1) for place in places]
        return [np.transpose(np.array(found), (1, 2, 0))[:, place] for place in inside]

    still, pushed, running = torques(False, ""), torques(False, "first"), torques(True, "second")
    torque, speed, (by_torque, by_turn) = _allowed(best)
    blocks = []
    for path, rate, held, more, quick in zip(paths, rates, still, pushed, running, strict=True):
        turn = by_turn * quick[3] / rate
        # Three rows per joint: torque at the gear, at the motor, and share of the available voltage.
        parts = (more - held) / rate**2, (quick - held) / rate**2, held
        p, q, need = (np.hstack([part[0], part[1], by_torque * part[1]]) for part in parts)
        friction = quick[2]
        need[:, len(speed) :] += np.hstack([friction, by_torque * friction])
        limits = np.concatenate([*torque, np.ones_like(speed)])
        limits = np.maximum(limits, 1.001 * np.abs(need).max(axis=0))
        v = np.hstack([np.zeros_like(turn), np.zeros_like(turn), turn])
        with np.errstate(divide="ignore"):
            squares = np.min((speed / np.abs(path.first)) ** 2, axis=1)
        square = quickest_squares(
            path.place, np.hstack([p, -p]), np.hstack([q, -q]), np.hstack([limits - need, limits + need]),
            np.minimum(squares, (MAX_FACTOR * rate) ** 2), np.hstack([v, -v]),
        )  # fmt: skip
        push = 0.5 * np.diff(square) / np.diff(path.place)
        push = np.concatenate([push[:1], 0.5 * (push[1:] + push[:-1]), push[-1:]])[:, None]
        x = square[:, None]
        blocks.append((times(path.place, square), np.sqrt(x) * path.first, path.second * x + path.first * push))
    return _rebuilt(cycle, moves, paths, blocks)


def _allowed(best: _ScaledCycle) -> tuple[Array, Array, Array]:
    """Limits of gear and motor torque [N m], (2, n), limits of joint speed, (n,), and use of the voltage, (2, n).

    The last is the share of the available voltage per unit of motor torque and of motor speed [1/(N m), s/rad].
    """
    after = best.evaluation.study.cycle
    torque, speed = np.full((2, len(after.joint_names)), np.inf), np.abs(after.velocity).max(axis=0)
    volts = np.zeros_like(torque)
    for i, joint in enumerate(best.evaluation.joints.values()):
        used = {"gear": 1e-9, "motor": 1e-9, "speed": 1e-9, "voltage": 1e-9}
        for check in joint.checks:
            if _of_an_instant(check) and check.utilisation is not None:
                kind = next((word for word in ("speed", "voltage", "gear") if word in check.name), "motor")
                used[kind] = max(used[kind], check.utilisation)
        series = joint.series
        torque[0, i] = np.abs(series.gear_torque).max() / used["gear"]
        torque[1, i] = np.abs(series.motor_torque).max() / used["motor"]
        speed[i] = speed[i] / used["speed"] if speed[i] > 0.0 else np.inf  # a joint that rests limits no speed
        drawn, largest = np.stack([series.motor_torque, series.motor_speed], axis=1), np.abs(series.voltage).max()
        if largest > 0.0:  # not at a joint without motion and load
            share, *_ = np.linalg.lstsq(drawn, series.voltage, rcond=None)
            volts[:, i] = share * used["voltage"] / largest
    return torque, np.minimum(speed, _speed_limits(best.evaluation.study)), volts


def _move_path(cycle: Cycle, move: slice) -> _MovePath:
    """A cubic spline through the positions of a move over its chord length."""
    positions = cycle.position[move]
    chords = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    places = np.concatenate([[0.0], np.cumsum(chords)]) / chords.sum()
    kept = [0]
    for i, place in enumerate(places):
        if place - places[kept[-1]] > MIN_SPACING and 1.0 - place > MIN_SPACING:
            kept.append(i)
    kept.append(len(places) - 1)
    spline = CubicSpline(places[kept], positions[kept])
    grid = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, PATH_INTERVALS + 1)))  # finer at both ends
    sample = move.start + np.clip(np.searchsorted(places, grid), 1, len(places) - 1)
    wrench = None
    if cycle.tip_wrench is not None:
        # at rest at either end, several samples may differ in force: those beside the path count
        begin, end = np.searchsorted(places, 0.0, side="right") - 1, np.searchsorted(places, places[-1])
        columns = cycle.tip_wrench[move][[begin, *kept[1:-1], end]].T
        wrench = np.column_stack([np.interp(grid, places[kept], column) for column in columns])
    return _MovePath(grid, spline(grid), spline(grid, 1), spline(grid, 2), sample, wrench)


def _rebuilt(
    cycle: Cycle, moves: list[slice], paths: list[_MovePath], blocks: list[tuple[Array, Array, Array]]
) -> tuple[Cycle, list[slice]]:
    """A cycle with the samples of its moves replaced by times from 0, speeds and accelerations; and its moves.

    The rests at both ends of a move remain as samples without acceleration.
    """
    old = np.arange(len(cycle.time))
    steps, accelerations = np.diff(cycle.time, prepend=cycle.time[0]), cycle.acceleration.copy()
    rows: list[tuple[Any, ...]] = []
    found, index, done, count = [], np.zeros(len(old), dtype=np.int64), 0, 0

    def take(positions: Array, *columns: Any) -> None:
        nonlocal count
        rows.append((positions, *columns))
        count += len(positions)

    def keep(first: int, last: int) -> None:
        span = old[first:last]
        index[span] = count + np.arange(len(span))
        take(cycle.position[span], cycle.velocity[span], accelerations[span], steps[span], span)

    for move, path, (time, velocity, acceleration) in zip(moves, paths, blocks, strict=True):
        accelerations[[move.start, move.stop - 1]] = 0.0
        keep(done, move.start + 1)
        begin = int(index[move.start])
        take(path.position, velocity, acceleration, np.diff(time, prepend=time[0]), path.sample)
        steps[move.stop - 1] = 0.0
        keep(move.stop - 1, move.stop)
        done = move.stop
        found.append(slice(begin, count))
    keep(done, len(old))
    position, velocity, acceleration, step, source = (np.concatenate(column) for column in zip(*rows, strict=True))
    parts = tuple(slice(int(index[part.start]), int(index[part.stop - 1]) + 1) for part in cycle.parts)
    rebuilt = replace(
        cycle.at(source), time=cycle.time[0] + np.cumsum(step), position=position, velocity=velocity,
        acceleration=acceleration, parts=parts, shares=cycle.shares, part_names=cycle.part_names,
    )  # fmt: skip
    if rebuilt.tip_wrench is not None:  # a copy
        for place, path in zip(found, paths, strict=True):
            rebuilt.tip_wrench[place.start + 1 : place.stop - 1] = path.tip_wrench
    return rebuilt, found


def moves_of(cycle: Cycle) -> list[slice]:
    """The samples of each move, from one rest to the next, both included, in order.

    Two moves share at most the sample at rest between them.
    """
    found = []
    quick = np.abs(cycle.velocity).max(axis=1)
    resting = quick <= 1e-9 * max(float(quick.max()), 1e-300)
    pushed = np.abs(cycle.acceleration).max(axis=1)
    calm = pushed <= 1e-9 * max(float(pushed.max()), 1e-300)
    twin = np.concatenate([np.diff(cycle.time) <= 0.0, [True]]) | np.concatenate([[True], np.diff(cycle.time) <= 0.0])
    ends = resting & (calm | twin)  # a turning point under acceleration is not the end of a move
    for part in cycle.parts:
        places = [i for i in range(part.start, part.stop) if ends[i] or i in (part.start, part.stop - 1)]
        for first, last in pairwise(places):
            if not resting[first : last + 1].all() and cycle.time[last] > cycle.time[first]:
                found.append(slice(first, last + 1))
    return found


def retimed(cycle: Cycle, moves: list[slice], factors: Array) -> Cycle:
    """The cycle with the duration of each move multiplied by a factor and dwells unchanged; factors: (moves,)."""
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


def _min_factor(study: Study, drives: Mapping[str, Given] | None, move: slice) -> float:
    """Smallest factor on the duration of a move by the limits at an instant and the arm's speed limits."""
    own = study.cycle.at(move)
    whole = [slice(0, len(own.time))]

    def holds(factor: float) -> bool:
        try:
            result = evaluate(replace(study, cycle=retimed(own, whole, np.array([factor]))), drives)
        except InputError:  # so fast that a stop on its ramp would lead a linkage where it cannot go
            return False
        return not any(fails(check) for _, check in _instants(result))

    return max(_smallest_factor(holds, 1.0), float(_speed_share(study, own.velocity).max()))


def _speed_share(study: Study, velocity: Array) -> Array:
    """Largest speed of each joint relative to the arm's limit, (n,)."""
    return np.abs(velocity).max(axis=0) / _speed_limits(study)


def _speed_limits(study: Study) -> Array:
    """Speed limits of the arm [rad/s or m/s], (n,)."""
    assert study.arm is not None
    return study.arm.speed_limits


def _repaired(at: Callable[[Array], Evaluation], moves: list[slice], edges: Array) -> Array:
    """Factors with which the moves are feasible together: a neighbouring dwell may make a move more demanding."""
    pace = edges.copy()
    for _ in range(MAX_REPAIRS):
        result = at(pace)
        time = result.study.cycle.time
        failed = [check.time for _, check in _instants(result) if fails(check) and check.time is not None]
        slow = {k for k, move in enumerate(moves) for t in failed if time[move.start] <= t <= time[move.stop - 1]}
        if not slow:
            break
        pace[list(slow)] *= 1.0 + 5.0 * FACTOR_TOLERANCE
    return pace


def _smallest_factor(holds: Callable[[float], bool], start: float, *, quicker: bool = True) -> float:
    """The smallest feasible factor, bracketed from a start and found by bisection.

    If the start is feasible, smaller factors are tried only with ``quicker``.
    """
    if holds(start):
        if not quicker:
            return start
        good, bad = start, start / BRACKET_STEP
        while holds(bad):
            good, bad = bad, bad / BRACKET_STEP
            if bad < start / MAX_FACTOR:
                return good
    else:
        bad, good = start, start * BRACKET_STEP
        while not holds(good):
            bad, good = good, good * BRACKET_STEP
            if good > start * MAX_FACTOR:
                return good
    return edge(holds, good, bad, error=FACTOR_TOLERANCE, geometric=True).inside


def _satisfied(evaluation: Evaluation) -> bool:
    return not any(fails(check) for _, check in placed_checks(evaluation))


def _instants(evaluation: Evaluation) -> list[tuple[str, Check]]:
    """The checks that depend on an instant alone, with their places."""
    return [
        one for one in placed_checks(evaluation)
        if _of_an_instant(one[1]) and (one[1].utilisation is not None or fails(one[1]))
    ]  # fmt: skip


def _of_an_instant(check: Check) -> bool:
    return check.name in WITHOUT_A_TIME or (check.time is not None and check.name not in OVER_THE_CYCLE)


def _over_cycle(at: Callable[[Array], Evaluation], edges: Array, share: float) -> tuple[str, str]:
    """Place and name of the check that fails just below the share that limits over the whole cycle allow."""
    if share == 0.0:
        return "", ""
    result = at(np.maximum(edges, share / (1.0 + 3.0 * FACTOR_TOLERANCE)))
    failed = [one for one in placed_checks(result) if fails(one[1])]
    place, check = max(failed, key=lambda one: one[1].utilisation or 0.0, default=("", None))
    return (place, "" if check is None else check.name)


def _move_times(before: Cycle, moves: list[slice], best: _ScaledCycle) -> tuple[MoveTime, ...]:
    found, result, after = [], best.evaluation, best.evaluation.study.cycle
    for own, move, least, final in zip(moves, best.moves, best.edges, best.pace, strict=True):
        length = float(before.time[own.stop - 1] - before.time[own.start])
        start, end = float(after.time[move.start]), float(after.time[move.stop - 1])
        name = before.segment_names[before.segment[(own.start + own.stop - 1) // 2]]
        place, check, at = *best.over_cycle, math.nan
        if final <= least:
            alone = evaluate(replace(result.study, cycle=after.at(move)), result.drives)
            place, binding = max(_instants(alone), key=lambda one: one[1].utilisation or 0.0, default=("", None))
            check = "" if binding is None else binding.name
            at = math.nan if binding is None or binding.time is None else binding.time
            speed = _speed_share(result.study, after.velocity[move])
            if binding is None or speed.max() > (binding.utilisation or 0.0):
                joint = int(speed.argmax())
                fast = move.start + int(np.abs(after.velocity[move, joint]).argmax())
                place, check, at = after.joint_names[joint], SPEED_LIMIT, float(after.time[fast])
        found.append(MoveTime(name, start, length, end - start, place, check, at))
    return tuple(found)
