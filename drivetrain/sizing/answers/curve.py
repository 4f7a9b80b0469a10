"""Parametric optimum: the best set of drives over payload, force, cycle time, voltage or ambient temperature.

Sets are selected on a grid of values. Between two grid values with different best sets there is a breakpoint where the
first set becomes infeasible or worse than the second. It is found by bisection on the evaluations of these two sets. A
selection on each side of the breakpoint shows whether a third set is better there, and the search is repeated until
none is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drivetrain.drive.drive import Drive
from drivetrain.errors import Fault, InputError, member_of, nearest, raise_faults
from drivetrain.notebook import axes_of, shown
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.judge.missing import of_the_rest
from drivetrain.sizing.judge.objectives import known_objective
from drivetrain.sizing.judge.vary import Number, Setup, Vary, edge, named_drives, task_number, worst_of_set
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.constraints.chance import CONFIDENCE, chance_of, has_tolerances
from drivetrain.sizing.search.preconditions import unknown_terms
from drivetrain.sizing.search.robust import robust_select
from drivetrain.sizing.search.search import better_set, select
from drivetrain.sizing.tables import CRITERION_UNITS, set_table
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.sizing.tolerance.sampling import nominal_of
from drivetrain.study.model import Study
from drivetrain.units import quantity

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

POINTS = 17
TOLERANCE = 1e-6  # accuracy of a breakpoint, relative to the range of values
EQUAL = 1e-9  # relative difference of objectives by rounding
NARROW = 0.1  # share of a grid step; narrower pieces are found by chance and have no practical use, so they are merged
PIECE_POINTS = 9  # evaluated points of each piece
SAMPLES = 2048  # number of samples for each selected set, if tolerances are stated and no probability is required
PROVEN = "optimal"
PROVEN_ROBUST = "optimal among the sets that hold often enough"
Progress = Callable[[int, int, str], None]
Drives = dict[str, Pair]


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """The best set at one value."""

    value: float  # value of the varied quantity
    drives: Drives  # keys of (motor, gear) by joint name; empty if nothing is feasible
    objective: float  # NaN if nothing is feasible
    criteria: dict[str, float]  # mass [kg], price, energy per cycle [J] and largest utilisation
    proof: str  # proof of the search that found it; empty if the set was found at another value and evaluated here
    chance: Chance | None = None  # probability of feasibility within the tolerances; None if not estimated

    @property
    def feasible(self) -> bool:
        """Whether a set was found."""
        return bool(self.drives)


def is_proven(proof: str) -> bool:
    """Whether the proof of a search says that its answer is optimal, or that no set is feasible."""
    return not proof or proof.startswith((PROVEN, "no set"))


@dataclass(frozen=True, eq=False)
class CurvePiece:
    """A range of values in which one set is the best, or none is feasible."""

    low: float
    high: float
    drives: Drives  # empty if nothing is feasible
    points: tuple[CurvePoint, ...]  # evaluations of the set from low to high
    low_ends_by: str  # check and place that fail beyond the end, or that another set is better there;
    high_ends_by: str  # empty at the ends of the range


@dataclass(frozen=True, eq=False)
class OptimumCurve:
    """The best set as a function of one quantity of the task.

    Attributes:
        study: The task with its own value.
        vary: The varied quantity.
        payload: Name of the payload whose mass is varied; empty otherwise.
        now: Its value in the study.
        points: All selections, ordered by value.
        pieces: Pieces ordered by value, without gaps.
        tolerance: Accuracy of the breakpoints [unit of the quantity].
        notes: Remarks: what was not proven, and what may have been missed.
    """

    study: Study
    vary: Vary
    payload: str
    now: float
    points: tuple[CurvePoint, ...]
    pieces: tuple[CurvePiece, ...]
    tolerance: float
    notes: tuple[str, ...]

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return self.vary.unit

    @property
    def table(self) -> pd.DataFrame:
        """All selections as a table, by value: objective, criteria, then motor and gear of each joint."""
        table = set_table(self.points, self.study)
        table.insert(0, f"{self.vary} [{self.unit}]", [point.value for point in self.points])
        return table

    def __repr__(self) -> str:
        ends = f"{self.points[0].value:.4g} to {self.points[-1].value:.4g} {self.unit}" if self.points else "no values"
        return f"OptimumCurve({self.study.name}: {self.vary} {ends}, {len(self.pieces)} pieces)"

    def _repr_html_(self) -> str:
        return shown(repr(self), self.table)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Plot the objective of the best set over the varied quantity.

        Args:
            ax: Where to draw; None: a new figure.

        Returns:
            The axes.
        """
        ax, objective = axes_of(ax), self.study.objective
        x, y = [point.value for point in self.points], [point.objective for point in self.points]
        ax.plot(x, y, marker="o")
        ax.set(xlabel=f"{self.vary} [{self.unit}]", ylabel=CRITERION_UNITS.get(objective, objective))
        return ax

    @property
    def proven(self) -> bool:
        """Whether every selection was proven."""
        return all(is_proven(point.proof) for point in self.points)

    @property
    def feasible(self) -> bool:
        """Whether a set was found at any value."""
        return any(piece.drives for piece in self.pieces)


def optimum_curve(
    study: Study,
    vary: Vary | str,
    span: tuple[float | str, float | str],
    *,
    points: int = POINTS,
    payload: str | None = None,
    progress: Progress | None = None,
) -> OptimumCurve:
    """The best set of drives over a range of payloads, forces, cycle times, supply voltages or ambient temperatures.

    A payload is varied in mass and inertia alike (the same shape of another density); a cycle is slowed uniformly:
    the same path at 1/s of the speed and 1/s^2 of the acceleration. All forces at the tip are varied by one factor.

    Args:
        study: The task.
        vary: The varied quantity.
        span: Smallest and largest value: mass [kg], cycle time [s], [V], [C], or share of the force [%]; or texts such
            as "6 kg".
        points: Size of the grid at which sets are selected; a set that is best only between two grid values can be
            missed.
        payload: Name of the payload whose mass is varied; None: the heaviest.
        progress: Called with (steps done, total, text).

    Returns:
        The pieces with their breakpoints.

    Raises:
        InputError: The quantity or payload is unknown, the range is empty or impossible, or there are fewer than two
        points.
    """
    what = varied(vary)
    if len(span) != 2:
        raise InputError(Fault("span", "must have a smallest and a largest value", span))
    unit = "degC" if what.unit == "C" else what.unit
    low, high = (quantity(end, unit, "span") if isinstance(end, str) else end for end in span)
    search = _CurveSearch(study, what, _checked(study, what, payload, (low, high), points))
    report = progress or (lambda done, total, text: None)
    grid = [float(value) for value in np.linspace(low, high, points)]
    found: list[CurvePoint] = []
    for done, value in enumerate(grid):
        report(done, points + 1, f"selecting at {value:.4g}")
        found.append(search.selected(value, found[-1] if found else None, counted=True))
    tolerance = TOLERANCE * (high - low)
    report(points, points + 1, "locating the breakpoints")
    starts = [(grid[0], found[0])]
    for before, one in itertools.pairwise(found):
        if search.wanted is None:
            _find_breakpoints(search, starts, one, tolerance, NARROW * (grid[1] - grid[0]))
        elif one.drives != before.drives:  # bisection would be too expensive with a probability
            starts.append((0.5 * (before.value + one.value), one))
    step = grid[1] - grid[0]
    pieces, folded = _pieces(search, starts, grid[-1], tolerance, NARROW * step)
    return OptimumCurve(
        study, what, search.payload, search.number.now, tuple(sorted(search.made, key=lambda one: one.value)), pieces,
        tolerance if search.wanted is None else 0.5 * step, tuple(_notes(search, step, folded)),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _CurveSearch:
    """A task with one varied quantity, and the selections and evaluations made so far."""

    study: Study
    vary: Vary
    payload: str
    made: list[CurvePoint] = field(default_factory=list)
    sets: dict[tuple[tuple[str, Pair], ...], dict[int, Drive]] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)

    @cached_property
    def number(self) -> Number:
        family = WorkFamily(self.study, (self.payload,) if self.payload else ())
        return task_number(family, {}, self.vary)

    @cached_property
    def at(self) -> Callable[[float], Setup]:
        """The task at a value; the last one is cached while sets are compared there."""
        return lru_cache(maxsize=1)(self.number.put)

    @property
    def wanted(self) -> float | None:
        """Required probability of feasibility; None if none is required or there are no tolerances."""
        return self.study.wanted.holds if has_tolerances(self.study) else None

    def selected(self, value: float, before: CurvePoint | None, *, counted: bool = False) -> CurvePoint:
        """The best set at a value; ties go to the set of the value before, so that pieces do not break at ties.

        With ``counted`` the probability of feasibility is estimated too, which takes longer than the search.
        """
        study = self.at(value).study
        if self.wanted is not None:
            self.made.append(_robust(study, value))
            return self.made[-1]
        study = replace(study, wanted=replace(study.wanted, sets=1))
        point = self._kept(study, value, before)
        if point is None:
            point = self._searched(study, value, before)
        if counted and point.drives and has_tolerances(study):
            point = replace(point, chance=chance_of(nominal_of(study), point.drives, SAMPLES))
        self.made.append(point)
        return point

    def _kept(self, study: Study, value: float, before: CurvePoint | None) -> CurvePoint | None:
        """The set before, or the best of those better than it; None if it is infeasible or nothing is proven."""
        evaluation = self.evaluated(before.drives, value) if before is not None and before.drives else None
        if before is None or evaluation is None or not evaluation.feasible:
            return None
        better, proven = better_set(study, evaluation.objective)
        if not proven:
            return None
        if better:
            evaluation = self.evaluated(better, value)
        return CurvePoint(value, better or before.drives, evaluation.objective, evaluation.criteria, PROVEN)

    def _searched(self, study: Study, value: float, before: CurvePoint | None) -> CurvePoint:
        """The best set by a full search; if that was stopped, sets of other values are compared with its result."""
        found = select(study, advise=False)
        if found.drives and not found.feasible:  # a given drive lacks data, the same at every value
            self.missing[:] = found.advice
        point = CurvePoint(
            value, dict(found.drives) if found.feasible else {}, found.objective, found.evaluation.criteria, found.proof
        )
        last = {} if before is None else before.drives
        elsewhere = [] if found.proof.startswith("optimal") else [dict(key) for key in self.sets]
        for drives in elsewhere + ([last] if last else []):
            evaluation = self.evaluated(drives, value)
            least = point.objective if point.drives else math.inf
            slack = EQUAL if drives == last else -EQUAL
            if evaluation.feasible and evaluation.objective <= least * (1.0 + slack):
                point = replace(point, drives=drives, objective=evaluation.objective, criteria=evaluation.criteria)
        return point

    def evaluated(self, drives: Drives, value: float) -> Evaluation:
        key = tuple(drives.items())
        if key not in self.sets:
            self.sets[key] = named_drives(self.study, drives)
        found = Setup(self.at(value).work, self.sets[key]).evaluation()
        if not math.isnan(found.objective):
            return found
        return replace(found, objective=known_objective(found.study, found.joints))

    def worth(self, drives: Drives, value: float) -> float:
        """Objective of a set at a value; infinite if it is infeasible or empty."""
        if not drives:
            return math.inf
        found = self.evaluated(drives, value)
        return found.objective if found.feasible else math.inf


def _robust(study: Study, value: float) -> CurvePoint:
    """The best set that is feasible with the required probability at a value."""
    found = robust_select(replace(study, wanted=replace(study.wanted, sets=1)))
    if found.chosen is None:
        return CurvePoint(value, {}, math.nan, {}, found.proof)
    best = found.chosen.drives
    proof = PROVEN_ROBUST if found.proven else found.proof
    return CurvePoint(value, dict(best.drives), best.objective, best.criteria, proof, found.chosen.chance)


def _find_breakpoints(
    search: _CurveSearch, starts: list[tuple[float, CurvePoint]], end: CurvePoint, tolerance: float, narrow: float
) -> None:  # fmt: skip
    """Find the breakpoints between the last known best set and the best set at a larger value, and append them to
    ``starts``: values from which a set is the best, with the set. Below a width ``narrow`` no third set is looked for.
    """
    while starts[-1][1].drives != end.drives:
        start = starts[-1][1]
        low, high = edge(partial(_first_is_better, search, start.drives, end.drives), start.value, end.value,
                         error=0.0, least=tolerance)  # fmt: skip
        if end.value - start.value < narrow and math.isfinite(search.worth(end.drives, high)):
            starts.append((0.5 * (low + high), end))  # a third set between them would have a negligible piece
            return
        before = search.selected(low, start)
        if before.drives != start.drives and low > start.value:
            # A third set is better somewhere before the breakpoint: find its own breakpoint first.
            _find_breakpoints(search, starts, before, tolerance, narrow)
            continue
        after = far = search.selected(high, end)
        if before.objective == after.objective and after.drives != end.drives:
            # Of many tied sets that become infeasible one by one, the last one represents all.
            far = search.selected(0.5 * (high + end.value), after)
            if search.worth(far.drives, high) <= after.objective * (1.0 + EQUAL):
                after = replace(after, drives=far.drives)
        starts.append((0.5 * (low + high), after))
        _find_breakpoints(search, starts, far, tolerance, narrow)
        if high >= end.value:
            return


def _first_is_better(search: _CurveSearch, first: Drives, last: Drives, value: float) -> bool:
    """Whether the first of two sets is still the better one."""
    if not first:
        return math.isinf(search.worth(last, value))
    own = search.worth(first, value)
    return math.isfinite(own) and own <= search.worth(last, value) * (1.0 + EQUAL)


class _Interval(NamedTuple):
    """A range of values with its best set."""

    low: float
    high: float
    drives: Drives


def _pieces(
    search: _CurveSearch, starts: list[tuple[float, CurvePoint]], last: float, tolerance: float, narrow: float
) -> tuple[tuple[CurvePiece, ...], int]:  # fmt: skip
    """The pieces of the curve, and how many narrow ones were merged into a neighbour.

    Pieces that differ by rounding or by ties are merged. A narrow piece is merged if a neighbour's set is
    feasible there.
    """
    ends = [*(start for start, _ in starts[1:]), last]
    intervals = [_Interval(low, high, one.drives) for (low, one), high in zip(starts, ends, strict=True)]
    intervals = _merged(intervals, lambda one, drives: one.drives == drives)
    folded = 0
    if search.wanted is None:
        intervals = _merged(intervals, lambda one, _: one.high - one.low <= 2.0 * tolerance)
        intervals = _merged(intervals, lambda one, drives: one.drives == drives or _as_good(search, drives, one))
        folded = len(intervals)
        intervals = _merged(
            intervals,
            lambda one, drives: one.high - one.low < narrow and _as_good(search, drives, one, at_any_cost=True),
        )
        folded -= len(intervals)
    return tuple(
        CurvePiece(
            low, high, drives, _piece_points(search, drives, low, high),
            _ended_by(search, drives, low, -1) if low > intervals[0].low else "",
            _ended_by(search, drives, high, 1) if high < last else "",
        )
        for low, high, drives in intervals
    ), folded  # fmt: skip


def _merged(intervals: list[_Interval], may_be_replaced_by: Callable[[_Interval, Drives], bool]) -> list[_Interval]:
    """Merge neighbouring intervals if the set of one of them may replace that of the other."""
    found = [intervals[0]]
    for interval in intervals[1:]:
        last = found[-1]
        if may_be_replaced_by(interval, last.drives):
            found[-1] = _Interval(last.low, interval.high, last.drives)
        elif may_be_replaced_by(last, interval.drives):
            found[-1] = _Interval(last.low, interval.high, interval.drives)
        else:
            found.append(interval)
    return found


def _as_good(search: _CurveSearch, drives: Drives, interval: _Interval, *, at_any_cost: bool = False) -> bool:
    """Whether a set is feasible and no worse than the set of an interval, at the evaluated points of the interval."""
    if not drives or not interval.drives:
        return False
    low, high, _ = interval
    inner, ends = np.linspace(low, high, PIECE_POINTS + 2)[1:-1], 1e-9 * (high - low)
    for value in (inner[PIECE_POINTS // 2], low + ends, high - ends, *inner):
        own, other = search.worth(drives, float(value)), search.worth(interval.drives, float(value))
        if math.isinf(own) or not (at_any_cost or own <= other * (1.0 + EQUAL) < math.inf):
            return False
    return True


def _ended_by(search: _CurveSearch, drives: Drives, value: float, direction: int) -> str:
    """The check that fails just outside an end of a piece, or that another set is better there."""
    if not drives:
        return ""
    if search.wanted is not None:
        return "another set is better, or its probability is too low"
    step = 2.0 * TOLERANCE * max(abs(value), abs(search.number.now), 1e-9)
    found = search.evaluated(drives, value + direction * step)
    if found.feasible:
        return "another set is better"
    worst = worst_of_set(found)
    return f"{worst.check} at {worst.place}" if worst.place not in ("supply", "arm") else worst.check


def _piece_points(search: _CurveSearch, drives: Drives, low: float, high: float) -> tuple[CurvePoint, ...]:
    values = [float(value) for value in np.linspace(low, high, PIECE_POINTS)] if drives else []
    found = [(value, search.evaluated(drives, value)) for value in values]
    return tuple(CurvePoint(value, drives, one.objective, one.criteria, "") for value, one in found)


def _notes(search: _CurveSearch, step: float, folded: int) -> list[str]:
    notes = list(search.missing)
    best = next((point for point in search.made if point.drives), None)
    if best is not None:
        notes += of_the_rest(search.evaluated(best.drives, best.value))
    if folded:
        notes.append(
            f"{folded} piece{'s' * (folded > 1)} narrower than {NARROW * step:.3g} {search.vary.unit} folded into a "
            "neighbour, whose set is feasible there too, though not the best"
        )
    if has_tolerances(search.study) and search.wanted is None:
        notes.append(
            "sets are those that meet all limits with nominal values; the probability that each meets them within the "
            f"tolerances is computed at each value of the grid with at most {SAMPLES} sampled arms (`selection: holds` "
            "requires a probability)"
        )
    elif search.wanted is not None:
        notes.append(
            f"every set selected meets all limits with at least {100.0 * search.wanted:g} % ({100.0 * CONFIDENCE:g} % "
            f"confidence); between two selections a breakpoint is only known to {0.5 * step:.3g} {search.vary.unit}"
        )
    notes += [f"not proven at {point.value:.4g}: {point.proof}" for point in search.made if not is_proven(point.proof)]
    notes.append(f"a set that is best only within one step of the grid, {step:.3g}, can have been passed over")
    if search.vary is Vary.CYCLE_TIME and search.study.arm is None:
        notes.append("the torques of the load table are kept at every pace")
    return notes


def varied(vary: Vary | str) -> Vary:
    """The varied quantity by its name; InputError with the nearest name if it is unknown."""
    return member_of(Vary, vary, "vary", "is nothing that can be varied")


def check_curve(study: Study, vary: Vary | str, span: tuple[float, float]) -> None:
    """Raise InputError for a curve that ``optimum_curve`` would refuse."""
    _checked(study, varied(vary), None, span, POINTS)


def _checked(study: Study, vary: Vary, payload: str | None, span: tuple[float, float], points: int) -> str:
    """Name of the varied payload, empty if none is; InputError for an impossible range."""
    (low, high), faults, name = span, [], ""
    if vary is Vary.PAYLOAD:
        masses = {one.name: one.mass for one in study.payloads if one.mass > 0.0}
        name = max(masses, key=lambda one: masses[one], default="") if payload is None else payload
        if study.arm is None or not masses:
            problem = "a load table has none" if study.arm is None else "the study carries none of any mass"
            faults.append(Fault("payload", f"cannot be varied: {problem}"))
        elif not isinstance(name, str) or name not in masses:
            faults.append(Fault("payload", "is none that the study carries", name, nearest(name, masses)))
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        faults.append(Fault("span", "must rise from its first to its last value", span))
    if vary in (Vary.CYCLE_TIME, Vary.VOLTAGE) and not low > 0.0:
        faults.append(Fault("span", f"a {vary.replace('_', ' ')} must be positive", low))
    if vary in (Vary.PAYLOAD, Vary.FORCE) and low < 0.0:
        faults.append(Fault("span", f"a {vary} must be 0 or more", low))
    if vary is Vary.FORCE and study.cycle.tip_wrench is None:
        faults.append(Fault("force", "cannot be varied: no step of the cycle has one"))
    faults += unknown_terms(study)
    if points < 2:
        faults.append(Fault("points", "must be two or more", points))
    raise_faults(faults)
    return name
