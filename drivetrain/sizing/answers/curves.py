"""The best set of drives as payload, cycle time, supply voltage or air change: a curve in pieces, each with its end.

Sets are selected on a grid of values. Between two values with different best sets the breakpoint is where the first
set ceases to hold, or ceases to be the better one of the two; it is found by bisection on the figures of these two
sets, and a selection on each side of it tells whether a third set lies between, until none does.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.answers.curve_results import PROVEN_ROBUST, CurvePiece, CurvePoint, OptimumCurve, Vary, is_proven
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.asked import unknown_terms
from drivetrain.sizing.search.robust import CONFIDENCE, chance_of, robust_select, scatters
from drivetrain.sizing.search.search import select
from drivetrain.sizing.tolerance.bench import Bench, worst_of_set
from drivetrain.sizing.tolerance.scatter_ground import ground
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.study import Study

POINTS = 17
TOLERANCE = 1e-6  # of the span of values
EQUAL = 1e-9  # of an objective: sums in another order
DRAWN = 9  # points of each piece
ARMS = 2048  # drawn of each set selected, where tolerances are stated and no probability is wanted
Progress = Callable[[int, int, str], None]


def optimum_curve(
    study: Study,
    vary: Vary | str,
    span: tuple[float, float],
    *,
    points: int = POINTS,
    payload: str | None = None,
    progress: Progress | None = None,
) -> OptimumCurve:
    """The best set of drives over a range of payloads, cycle times, supply voltages or air temperatures.

    A payload is varied in mass and inertia alike (the same shape of another density); a cycle is slowed uniformly:
    the same path at 1/s of the speed and 1/s^2 of the acceleration.

    Args:
        study: The task.
        vary: What is changed.
        span: Smallest and largest value: mass [kg], length of the cycle [s], [V] or [C].
        points: Values at which sets are selected to start with; a set that is best only between two of them can be
            passed over.
        payload: Name of the payload whose mass is varied; None: the heaviest.
        progress: Called with (done, total, text).

    Returns:
        The pieces with their breakpoints.

    Raises:
        InputError: An unknown quantity or payload, a range that is empty or not possible, or fewer than two points.
    """
    what = varied(vary)
    row = _Row(study, what, _checked(study, what, payload, span, points))
    tell = progress or (lambda done, total, text: None)
    grid = [float(value) for value in np.linspace(*span, points)]
    found: list[CurvePoint] = []
    for done, value in enumerate(grid):
        tell(done, points + 1, f"selecting at {value:.4g}")
        found.append(row.selected(value, found[-1] if found else None))
    tolerance = TOLERANCE * (span[1] - span[0])
    tell(points, points + 1, "locating the breakpoints")
    marks = _Marks([found[0]], [])
    for before, one in itertools.pairwise(found):
        if row.often is None:
            _between(row, marks, one, tolerance)
        elif one.drives != before.drives:  # whether a set holds often enough is too dear to be asked on the way
            marks.breaks.append(0.5 * (before.value + one.value))
            marks.sets.append(one)
    if row.often is not None:
        tolerance = 0.5 * (grid[1] - grid[0])
    return OptimumCurve(
        study, what, row.payload, row.now, tuple(sorted(row.made, key=lambda one: one.value)),
        _pieces(row, marks), tolerance, tuple(_notes(row, grid)),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Row:
    """A task along one of its numbers."""

    study: Study
    vary: Vary
    payload: str
    made: list[CurvePoint] = field(default_factory=list)
    benches: dict[tuple[tuple[str, Pair], ...], Bench] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)

    @property
    def often(self) -> float | None:
        """Probability with which sets must hold; None where none is wanted or nothing scatters."""
        return self.study.wanted.holds if scatters(self.study) else None

    @property
    def now(self) -> float:
        if self.vary is Vary.PAYLOAD:
            return next(one.mass for one in self.study.payloads if one.name == self.payload)
        return {
            Vary.CYCLE_TIME: self.study.cycle.duration,
            Vary.VOLTAGE: self.study.supply.voltage,
            Vary.AMBIENT: self.study.ambient,
        }[self.vary]

    def change(self, value: float) -> TaskChange:
        """Of the task, at a value."""
        if self.vary is Vary.PAYLOAD:
            return TaskChange(payload=value / self.now, payloads=(self.payload,))
        if self.vary is Vary.AMBIENT:
            return TaskChange(ambient=value - self.now)
        if self.vary is Vary.VOLTAGE:
            return TaskChange(voltage=value / self.now)
        return TaskChange(time=value / self.now)

    def selected(self, value: float, before: CurvePoint | None) -> CurvePoint:
        """The best set at a value; of equals the set before, so that a set goes on as long as none is better.

        Sets found elsewhere are held against it too: a search that was stopped may have missed them.
        """
        study = changed(self.study, self.change(value))
        if self.often is not None:
            self.made.append(_robust(study, value))
            return self.made[-1]
        found = select(replace(study, wanted=replace(study.wanted, sets=1)))
        if found.drives and not found.feasible:  # a given drive lacks data, the same at every value
            self.missing[:] = found.advice
        point = CurvePoint(
            value, dict(found.drives) if found.feasible else {}, found.objective, found.evaluation.criteria, found.proof
        )
        known = [dict(key) for key in self.benches]
        for drives in [*known, *([before.drives] if before is not None and before.drives else [])]:
            evaluation = self.evaluated(drives, value)
            least = point.objective if point.drives else math.inf
            slack = EQUAL if before is not None and drives == before.drives else -EQUAL
            if evaluation.feasible and evaluation.objective <= least * (1.0 + slack):
                point = replace(point, drives=drives, objective=evaluation.objective, criteria=evaluation.criteria)
        if point.drives and scatters(study):
            point = replace(point, chance=chance_of(ground(study), point.drives, ARMS))
        self.made.append(point)
        return point

    def evaluated(self, drives: dict[str, Pair], value: float) -> Evaluation:
        """A set at a value."""
        key = tuple(drives.items())
        if key not in self.benches:
            family = next((bench.family for bench in self.benches.values()), None)
            names = (self.payload,) if self.payload else ()
            self.benches[key] = Bench(family or WorkFamily(self.study, names), drives)
        return self.benches[key].evaluation(self.change(value))

    def worth(self, drives: dict[str, Pair], value: float) -> float:
        """Objective of a set at a value; infinite where it does not hold, or there is none."""
        if not drives:
            return math.inf
        found = self.evaluated(drives, value)
        return found.objective if found.feasible else math.inf


def _robust(study: Study, value: float) -> CurvePoint:
    """The best set that holds often enough at a value."""
    found = robust_select(study)
    if found.chosen is None:
        return CurvePoint(value, {}, math.nan, {}, f"no set: {found.proof}" if found.exhausted else found.proof)
    best = found.chosen.drives
    proof = PROVEN_ROBUST if found.proven else found.proof
    return CurvePoint(value, dict(best.drives), best.objective, best.criteria, proof, found.chosen.chance)


@dataclass(frozen=True, eq=False)
class _Marks:
    """The best sets so far by rising value, and the breakpoints between them."""

    sets: list[CurvePoint]
    breaks: list[float]


def _between(row: _Row, marks: _Marks, end: CurvePoint, tolerance: float) -> None:
    """Go on from the last set to the set at a further value, breakpoint by breakpoint."""
    while marks.sets[-1].drives != end.drives:
        start = marks.sets[-1]
        low, high = start.value, end.value
        while high - low > tolerance:
            middle = 0.5 * (low + high)
            if _goes_on(row, start.drives, end.drives, middle):
                low = middle
            else:
                high = middle
        before, after = row.selected(low, start), row.selected(high, end)
        if before.drives != start.drives and low > start.value:
            # A third set is better somewhere before the edge: look for its own edge first.
            _between(row, marks, before, tolerance)
            continue
        marks.breaks.append(0.5 * (low + high))
        marks.sets.append(replace(after, value=high))
        if high >= end.value:
            return


def _goes_on(row: _Row, first: dict[str, Pair], last: dict[str, Pair], value: float) -> bool:
    """Whether the first of two sets is still the better one."""
    if not first:
        return math.isinf(row.worth(last, value))
    own = row.worth(first, value)
    return math.isfinite(own) and own <= row.worth(last, value) * (1.0 + EQUAL)


def _pieces(row: _Row, marks: _Marks) -> tuple[CurvePiece, ...]:
    """The sets with the ranges in which they are the best; neighbours of one set are one piece."""
    last = max(point.value for point in row.made)
    first = min(point.value for point in row.made)
    ends = [first, *marks.breaks, last]
    runs: list[_Run] = []
    for one, low, high in zip(marks.sets, ends, ends[1:], strict=False):
        if runs and runs[-1][2] == one.drives:
            runs[-1] = (runs[-1][0], high, one.drives)
        else:
            runs.append((low, high, one.drives))
    if row.often is None:
        runs = _merged(row, runs, 2.0 * TOLERANCE * (last - first))
    pieces = []
    for index, (low, high, drives) in enumerate(runs):
        lower = "" if index == 0 else _ended_by(row, drives, low, -1)
        upper = "" if index == len(runs) - 1 else _ended_by(row, drives, high, 1)
        pieces.append(CurvePiece(low, high, drives, _drawn(row, drives, low, high), lower, upper))
    return tuple(pieces)


_Run = tuple[float, float, dict[str, Pair]]


def _merged(row: _Row, runs: list[_Run], narrow: float) -> list[_Run]:
    """Runs without those that only rounding or sets of equal worth tell apart."""
    wide = [runs[0]]
    for low, high, drives in runs[1:]:
        if high - low <= narrow or wide[-1][1] - wide[-1][0] <= narrow:
            kept = wide[-1][2] if high - low <= narrow else drives
            wide[-1] = (wide[-1][0], high, kept)
        else:
            wide.append((low, high, drives))
    found = [wide[0]]
    for low, high, drives in wide[1:]:
        before = found[-1]
        if before[2] == drives or _as_good(row, before[2], drives, low, high):
            found[-1] = (before[0], high, before[2])
        elif _as_good(row, drives, before[2], before[0], before[1]):
            found[-1] = (before[0], high, drives)
        else:
            found.append((low, high, drives))
    return found


def _as_good(row: _Row, one: dict[str, Pair], other: dict[str, Pair], low: float, high: float) -> bool:
    """Whether a set holds over the whole range of another and is worth no less there, looked at where it is drawn."""
    if not one or not other:
        return False
    inner = np.linspace(low, high, DRAWN + 2)[1:-1]
    ends = (low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    return all(
        row.worth(one, float(value)) <= row.worth(other, float(value)) * (1.0 + EQUAL) < math.inf
        for value in (inner[DRAWN // 2], *ends, *inner)
    )


def _ended_by(row: _Row, drives: dict[str, Pair], value: float, way: int) -> str:
    """What is over its limit just beyond an end."""
    if not drives:
        return ""
    beyond = value + way * 2.0 * TOLERANCE * max(abs(value), abs(row.now), 1e-9)
    found = row.evaluated(drives, beyond)
    if row.often is not None:
        return "another set is better, or it holds too seldom"
    if found.feasible:
        return "another set is better"
    worst = worst_of_set(found)
    return f"{worst.check} at {worst.place}" if worst.place != "supply" else worst.check


def _drawn(row: _Row, drives: dict[str, Pair], low: float, high: float) -> tuple[CurvePoint, ...]:
    """The set at some values of its piece."""
    if not drives:
        return ()
    found = []
    for value in np.linspace(low, high, DRAWN):
        evaluation = row.evaluated(drives, float(value))
        found.append(CurvePoint(float(value), drives, evaluation.objective, evaluation.criteria, ""))
    return tuple(found)


def _notes(row: _Row, grid: Sequence[float]) -> list[str]:
    unproven = [point for point in row.made if not is_proven(point.proof)]
    notes = [*row.missing, *_told_of_scatter(row, 0.5 * (grid[1] - grid[0]))]
    notes += [f"not proven at {point.value:.4g}: {point.proof}" for point in unproven]
    step = grid[1] - grid[0]
    notes.append(f"a set that is best only within one step of the grid, {step:.3g}, can have been passed over")
    if row.vary is Vary.CYCLE_TIME and row.study.arm is None:
        notes.append("the torques of the load table are kept at every pace")
    return notes


def _told_of_scatter(row: _Row, step: float) -> list[str]:
    """What tolerances mean for the curve, in words."""
    if not scatters(row.study):
        return []
    if row.often is None:
        return [
            "sets are those that hold with nominal numbers; with what probability each holds within the tolerances is "
            f"counted at every selection over at most {ARMS} arms (`selection: holds` asks for sets that hold often "
            "enough)"
        ]
    told = f"every set selected holds with at least {100.0 * row.often:g} % ({100.0 * CONFIDENCE:g} % confidence)"
    return [f"{told}; between two selections a breakpoint is only known to {step:.3g} {row.vary.unit}"]


def varied(vary: Vary | str) -> Vary:
    """What is varied, from its name.

    Raises:
        InputError: Another name.
    """
    known = [one.value for one in Vary]
    if str(vary) not in known:
        raise InputError(Fault("vary", "is nothing that can be varied", str(vary), nearest(str(vary), known)))
    return Vary(str(vary))


def check_curve(study: Study, vary: Vary | str, span: tuple[float, float]) -> None:
    """Refuse a curve that cannot be found, before anything is searched.

    Args:
        span: Smallest and largest value, SI, temperatures in [C].

    Raises:
        InputError: Every fault, as of ``optimum_curve``.
    """
    _checked(study, varied(vary), None, span, POINTS)


def _payload(study: Study, vary: Vary, name: str | None) -> str:
    """The payload that is varied."""
    if vary is not Vary.PAYLOAD:
        return ""
    known = [one.name for one in study.payloads if one.mass > 0.0]
    if study.arm is None or not known:
        problem = "a load table has none" if study.arm is None else "the study carries none of any mass"
        raise InputError(Fault("payload", f"cannot be varied: {problem}"))
    if name is None:
        return max(study.payloads, key=lambda one: one.mass).name
    if name not in known:
        raise InputError(Fault("payload", "is none that the study carries", name, nearest(name, known)))
    return name


def _checked(study: Study, vary: Vary, payload: str | None, span: tuple[float, float], points: int) -> str:
    """The payload that is varied, along a range that can be walked."""
    low, high = span
    faults: list[Fault] = []
    name = ""
    try:
        name = _payload(study, vary, payload)
    except InputError as error:
        faults.extend(error.faults)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        faults.append(Fault("span", "must rise from its first to its last value", span))
    if vary in (Vary.CYCLE_TIME, Vary.VOLTAGE) and not low > 0.0:
        faults.append(Fault("span", f"a {vary.replace('_', ' ')} must be positive", low))
    if vary is Vary.PAYLOAD and low < 0.0:
        faults.append(Fault("span", "a payload must be 0 or more", low))
    faults += unknown_terms(study)
    if points < 2:
        faults.append(Fault("points", "must be two or more", points))
    if faults:
        raise InputError(faults)
    return name
