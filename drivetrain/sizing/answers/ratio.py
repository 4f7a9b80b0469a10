"""Gear ratio study of one joint: a sweep with every check, the feasible window, and closed-form optimal ratios."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from numbers import Real

import numpy as np
from scipy.optimize import minimize_scalar

from drivetrain.arm.coupling import shaft_motion
from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, unstaged_inertia
from drivetrain.drive.gear import mesh_loss_coefficient, stage_load
from drivetrain.drive.matching import (
    LoadMatch,
    RatioRange,
    TorqueTerms,
    inertia_matching_ratio,
    load_match,
    rated_ranges,
    ratio_of_least_peak,
    ratio_of_least_rms,
    torque_terms,
)
from drivetrain.drive.motor import bare_key
from drivetrain.errors import Fault, InputError, whole_names
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import Pair, given_drives
from drivetrain.sizing.judge.vary import NOT_CHECKED, Number, Setup, edges, named_drives, ratio_number
from drivetrain.sizing.results import JointResult
from drivetrain.sizing.search.search import select
from drivetrain.study.model import JointTask, Study, pair_name
from drivetrain.study.parts.candidates import gears_at
from drivetrain.study.parts.verdicts import Check, Verdict, undecided

GRID = 81  # ratios of the sweep
SPAN = 8.0  # factor by which the sweep extends below and above the ratios of interest
SMALLEST, LARGEST = 0.05, 2.0e4  # limits of the sweep
CHANGE = 1e-9  # share by which a utilisation must change over the sweep to depend on the ratio
NEAR_GEARS = 8


@dataclass(frozen=True, eq=False)
class RatioPoint:
    """Results of one motor with one ratio."""

    ratio: float  # magnitude
    rms_torque: float  # RMS torque of the motor over the cycle [N m]
    peak_torque: float  # peak torque of the motor, starting from rest included [N m]
    motor_speed: float  # largest [rad/s]
    winding_temperature: float  # largest in the repeated cycle [C]; infinite: thermal runaway, NaN: not computed
    # by name of the check; NaN where it could not be made, infinite where missing data leave it undecided
    utilisations: Mapping[str, float]
    undecided: tuple[str, ...] = ()  # names of the checks that missing data leave undecided

    @property
    def binding(self) -> str:
        """The check of highest utilisation; empty if none was made."""
        judged = {name: used for name, used in self.utilisations.items() if not math.isnan(used)}
        return max(judged, key=lambda name: judged[name], default="")

    @property
    def binding_words(self) -> str:
        """The check of highest utilisation, followed by "(not checked)" if it is undecided."""
        return self.binding + (NOT_CHECKED if self.binding in self.undecided else "")

    @property
    def utilisation(self) -> float:
        """The highest utilisation of all checks; infinite if none was made."""
        return self.utilisations[self.binding] if self.binding else math.inf

    @property
    def fits(self) -> bool:
        """Whether no utilisation exceeds 1."""
        return self.utilisation <= 1.0


@dataclass(frozen=True)
class RatioWindow:
    """Ratios at which every check is satisfied, and the checks that fail outside its two ends.

    "(not checked)" follows the name of a check that missing data leave undecided there. An end is infinite (or 0), and
    its check empty, if the window reaches the limits of the sweep.
    """

    low: float
    high: float
    low_binding: str
    high_binding: str


@dataclass(frozen=True)
class NearGear:
    """A gear of the catalogue evaluated with the same task and motor."""

    key: str
    ratio: float  # ratio of the data sheet, with its sign
    utilisation: float  # the highest of all checks; infinite if none was made
    binding: str  # the check it belongs to
    verdict: Verdict
    inside: bool  # whether its ratio lies in a window of the template gear; its own limits may differ


@dataclass(frozen=True)
class RatioLimits:
    """Limits of motor and gear divided by their safety factors; None if unknown."""

    continuous_torque: float | None  # continuous torque of the warm motor [N m]
    peak_torque: float | None  # short-time torque of the motor [N m]
    motor_speed: float | None  # smaller limit of motor and gear input [rad/s]
    winding_temperature: float | None  # [C]


@dataclass(frozen=True, eq=False)
class ClosedForms:
    """Ratios by closed-form solutions for the same motion."""

    matching: float | None  # sqrt(mean load inertia over rotor inertia); None without an arm
    least_rms: float  # ratio of the smallest RMS motor torque, without Stribeck friction; NaN where data are missing
    least_peak: float  # ratio of the smallest peak motor torque, without starting from rest; NaN where data are missing
    rated: tuple[RatioRange, ...] | None  # ratios with an RMS torque within the continuous one; None if that is unknown
    load_match: LoadMatch | None  # the same with one efficiency for the whole motion; None if unknown


@dataclass(frozen=True, eq=False)
class RatioStudy:
    """Sweep of the ratio of one joint's gear, with all other data of motor and gear unchanged."""

    study: Study
    joint: str
    motor: str
    gear: str  # key of the gear whose ratio is varied; "" for an ideal gear
    drive: Drive  # motor and template gear, with assumptions filled in
    points: tuple[RatioPoint, ...]  # by rising ratio
    windows: tuple[RatioWindow, ...]  # lowest first
    best: RatioPoint  # smallest maximum utilisation of the checks that depend on the ratio
    limits: RatioLimits
    closed_forms: ClosedForms
    gears: tuple[NearGear, ...]  # nearest to ``best`` first
    reaction: Mapping[str, float]  # change of each earlier joint's torque across the window, relative to its peak
    notes: tuple[str, ...]
    lacking: tuple[Check, ...] = ()  # essential checks that could not be made; if any, no ratio is proven feasible

    def __repr__(self) -> str:
        windows = ", ".join(f"{one.low:.4g} to {one.high:.4g}" for one in self.windows) or "no ratio"
        return f"RatioStudy({self.joint}: {pair_name(self.motor, self.gear or 'an ideal gear')}, fits at {windows})"

    @property
    def feasible(self) -> bool:
        """Whether some ratio is proven to be feasible."""
        return bool(self.windows) and not self.lacking

    @property
    def ratios(self) -> Array:
        """Ratios of the points, rising, (M,)."""
        return np.array([point.ratio for point in self.points])

    def series(self, field: str) -> Array:
        """One field of the points, such as ``rms_torque``, (M,)."""
        return np.array([getattr(point, field) for point in self.points], dtype=np.float64)

    def utilisation_of(self, check: str) -> Array:
        """Utilisation of one check over the ratios, (M,); NaN where it could not be made."""
        return np.array([point.utilisations.get(check, math.nan) for point in self.points])


def ratio_study(
    study: Study,
    joint: str,
    *,
    drives: Mapping[str, Pair] | None = None,
    motor: str | None = None,
    gear: str | None = None,
    ratios: Sequence[float] | None = None,
) -> RatioStudy:
    """Sweep the ratio of one joint's gear: torque, speed, heat, every check, and the feasible window.

    The gear is a template: its ratio is varied continuously, everything else on its data sheet is kept (see
    ``scaled_gear``). The drives of the other joints stay as they are. The joint's own ratio changes what it asks of
    the joints before it, through its rotor's reaction; those are not checked here, ``reaction`` says how much it is.

    Args:
        study: The task.
        joint: Name of the joint, or a part that no other name has.
        drives: Keys of (motor, gear) by joint name; a joint that is not named keeps the drive of the study.
        motor, gear: Keys for this joint that replace those of ``drives``; gear "" is an ideal gear without limits,
            which is also used if only a motor is known.
        ratios: Ratios of the sweep, positive; None: chosen around the ratio of smallest RMS torque and that of the
            gear.

    Returns:
        The sweep, its windows and marks.

    Raises:
        InputError: Joints, motors or gears are unknown, a joint has no drive, or a ratio is not positive.
    """
    names = study.joint_names
    [joint] = whole_names("joint", "joint of the study", [joint], names)
    index, own = names.index(joint), (drives or {}).get(joint, study.joints[names.index(joint)].drive) or ("", "")
    wanted = (own[0] if motor is None else motor, own[1] if gear is None else gear)
    keys = given_drives(study, {**(drives or {}), joint: wanted} if any(wanted) else drives or {})
    setup = Setup(workload(study), named_drives(study, keys))
    number, template = ratio_number(setup, index), setup.joint(index)

    @cache
    def at(ratio: float) -> RatioPoint:
        return _point(number.put(ratio), index)

    # Where the torque is unknown no check ends a window, so the grid is not extended.
    points = _sweep(at, _grid(setup, index, ratios), fixed=ratios is not None or not template.torque_known)
    runs = edges(lambda ratio: at(ratio).fits, [point.ratio for point in points])
    windows = tuple(
        RatioWindow(
            low.inside, high.inside, *(at(end.outside).binding_words if end.known else "" for end in (low, high))
        )
        for low, high in runs
    )
    best = min(points, key=_strain(points))
    there = number.put(best.ratio)
    return RatioStudy(
        study, joint, *keys[joint], setup.drives[index], points, windows, best, _limits(there, index),
        _closed_forms(there, index), _catalogue_gears(setup, index, keys[joint], best.ratio, windows),
        _reaction(number, index, windows), _notes(setup, index), _never_made(template),
    )  # fmt: skip


def ratio_studies(study: Study, *, drives: Mapping[str, Pair] | None = None) -> tuple[RatioStudy, ...]:
    """Ratio studies of every joint that moves, one at a time.

    Args:
        study: The task.
        drives: Keys of (motor, gear) by joint name; None: those the study gives, and where it gives none those that
            ``select`` chooses, or the nearest when nothing fits.

    Returns:
        One study a joint, in the arm's order.

    Raises:
        InputError: As ``ratio_study``.
    """
    keys = chosen_drives(study) if drives is None else drives
    speeds = study.cycle.velocity if study.arm is None else shaft_motion(study.arm, study.cycle.velocity)
    moving = [task.name for i, task in enumerate(study.joints) if speeds[:, i].any()]
    return tuple(ratio_study(study, name, drives=keys) for name in moving)


def chosen_drives(study: Study) -> dict[str, Pair]:
    """Keys of the drives that the study gives, else of the selected ones, or of the nearest if nothing is feasible."""
    return study.given_drives if study.gives_all_drives else select(study, advise=False).evaluation.drives


def _point(setup: Setup, joint: int) -> RatioPoint:
    with np.errstate(over="ignore", invalid="ignore"):  # far from feasible ratios the heat overflows
        result = setup.joint(joint)
    series, checks = result.series, {check.name: check for check in result.checks}
    peak, heat = checks["motor peak torque"].required, checks["winding temperature"].required
    if heat is None:
        heat = math.nan if series.winding_temperature is None else float(series.winding_temperature.max())
    return RatioPoint(
        ratio=abs(result.drive.gear.ratio),
        rms_torque=rms_torque(setup, joint),
        peak_torque=float(np.abs(series.motor_torque).max()) if peak is None else peak / setup.study.safety.peak_torque,
        motor_speed=float(np.abs(series.motor_speed).max()),
        winding_temperature=heat,
        utilisations={name: _utilisation(check) for name, check in checks.items()},
        undecided=tuple(name for name, check in checks.items() if undecided(check)),
    )


def _utilisation(check: Check) -> float:
    if undecided(check):
        return math.inf
    return math.nan if check.utilisation is None else check.utilisation


def rms_torque(setup: Setup, joint: int) -> float:
    """RMS torque of a joint's motor over the cycle [N m]."""
    weights = setup.work.weights if setup.work.weights.any() else None
    return math.sqrt(np.average(setup.joint(joint).series.motor_torque ** 2, weights=weights))


def terms_of(setup: Setup, joint: int) -> TorqueTerms:
    """Coefficients of a joint's motor torque as a function of its gear ratio."""
    demand = setup.demand(joint)
    motion = (demand.speed, demand.acceleration, demand.carrier_acceleration)
    return torque_terms(setup.drives[joint], demand.gear_torque, *motion, demand.weights)


def _grid(setup: Setup, joint: int, ratios: Sequence[float] | None) -> list[float]:
    if ratios is not None:
        wrong = [Fault(f"ratios[{i}]", "must be a number, positive and finite", r) for i, r in enumerate(ratios)
                 if not (isinstance(r, Real) and 0.0 < r < math.inf)]  # fmt: skip
        if wrong or not len(ratios):
            raise InputError(wrong or Fault("ratios", "must not be empty"))
        return sorted(float(ratio) for ratio in ratios)
    own = abs(setup.drives[joint].gear.ratio)
    known = [ratio for ratio in (own, _closed_forms(setup, joint).least_rms) if SMALLEST < ratio < LARGEST] or [own]
    low, high = max(min(known) / SPAN, SMALLEST), min(max(known) * SPAN, LARGEST)
    return [float(ratio) for ratio in np.geomspace(low, high, GRID)]


def _sweep(at: Callable[[float], RatioPoint], grid: list[float], *, fixed: bool) -> tuple[RatioPoint, ...]:
    """The points of a grid, extended while its ends are feasible, and the ratio of smallest utilisation (Brent)."""
    points = [at(ratio) for ratio in grid]
    step = grid[-1] / grid[-2] if len(grid) > 1 else 2.0
    while not fixed and points[-1].fits and points[-1].ratio < LARGEST:
        points.append(at(points[-1].ratio * step))
    while not fixed and points[0].fits and points[0].ratio > SMALLEST:
        points.insert(0, at(points[0].ratio / step))
    strain = _strain(points)
    best = int(np.argmin([strain(point) for point in points]))
    if 0 < best < len(points) - 1:
        low, high = math.log(points[best - 1].ratio), math.log(points[best + 1].ratio)
        found = minimize_scalar(
            lambda x: strain(at(math.exp(x))), bounds=(low, high), method="bounded", options={"xatol": 1e-4}
        )
        points.append(at(math.exp(float(found.x))))
    return tuple(sorted(points, key=lambda point: point.ratio))


def _strain(points: Sequence[RatioPoint]) -> Callable[[RatioPoint], float]:
    """Maximum utilisation of the checks that depend on the ratio, as a function of a point."""
    changing = []
    for name in points[0].utilisations:
        used = np.array([point.utilisations[name] for point in points])
        if not np.isnan(used).all() and float(np.nanmin(used)) < (1.0 - CHANGE) * float(np.nanmax(used)):
            changing.append(name)
    if not changing:
        return lambda point: point.utilisation
    return lambda point: max(math.inf if math.isnan(u) else u for u in (point.utilisations[n] for n in changing))


def _limits(setup: Setup, joint: int) -> RatioLimits:
    checks, safety = {check.name: check for check in setup.joint(joint).checks}, setup.study.safety

    def available(name: str, factor: float = 1.0) -> float | None:
        check = checks.get(name)
        return None if check is None or check.available is None else check.available / factor

    speeds = [available(name, safety.speed) for name in ("motor speed", "gear maximum input speed")]
    return RatioLimits(
        _rated_torque(setup, joint),
        available("motor peak torque", safety.peak_torque),
        min((speed for speed in speeds if speed is not None), default=None),
        available("winding temperature"),
    )


def _rated_torque(setup: Setup, joint: int) -> float | None:
    """Continuous torque of the warm motor: the RMS torque at which its RMS current is at the limit [N m]."""
    result = setup.joint(joint)
    used = next(check.utilisation for check in result.checks if check.name == "motor RMS current")
    return rms_torque(setup, joint) / used if used else None


def _closed_forms(setup: Setup, joint: int) -> ClosedForms:
    demand, drive, rated = setup.demand(joint), setup.drives[joint], _rated_torque(setup, joint)
    if not setup.joint(joint).torque_known:
        return ClosedForms(None, math.nan, math.nan, None, None)
    terms, matching, match = terms_of(setup, joint), None, None
    inertia, stages = unstaged_inertia(drive), float(stage_load(drive.gear))
    if demand.load_inertia is not None and inertia > 0.0 and demand.mean(demand.load_inertia) > 0.0:
        matching = inertia_matching_ratio(demand.mean(demand.load_inertia) + stages, inertia)
    if rated is not None and inertia > 0.0:
        efficiency = 1.0 / (1.0 + mesh_loss_coefficient(drive.gear))
        load = demand.load_torque + stages * demand.acceleration
        match = load_match(rated, inertia, load, demand.acceleration, demand.weights, efficiency=efficiency)
    return ClosedForms(
        matching, ratio_of_least_rms(terms), ratio_of_least_peak(terms),
        None if rated is None else rated_ranges(terms, rated), match,
    )  # fmt: skip


def _catalogue_gears(
    setup: Setup, joint: int, keys: Pair, best: float, windows: tuple[RatioWindow, ...]
) -> tuple[NearGear, ...]:
    """The catalogue gears nearest in ratio to the best; if none is known for the motor, those of the same kind."""
    (motor, gear), gears = keys, setup.study.catalog.gears
    allowed = [key for key in partners(setup.study, setup.study.joints[joint], motor) if key in gears]
    if gear and not allowed:
        known = gears_at(setup.study.joints[joint], setup.study.catalog)
        allowed = [key for key in known if gears[key].kind == gears[gear].kind]
    return tuple(
        replace(one, inside=any(window.low <= abs(one.ratio) <= window.high for window in windows))
        for one, _ in islice(near_gears(setup, joint, motor, allowed, best), NEAR_GEARS)
    )


def near_gears(
    setup: Setup, joint: int, motor: str, keys: Sequence[str], ratio: float,
    *, last: Callable[[str], bool] = lambda key: False,
) -> Iterator[tuple[NearGear, JointResult]]:  # fmt: skip
    """Evaluate gears with a motor, nearest to a ratio first; of ties, those for which ``last`` is true come last."""
    rows = setup.study.catalog.gears
    for key in sorted(keys, key=lambda key: (abs(math.log(abs(rows[key].ratio) / ratio)), last(key), key)):
        result = setup.with_keys(joint, motor, key).joint(joint)
        used, name = (
            (math.inf, "") if result.binding is None else (result.binding.utilisation or 0.0, result.binding.name)
        )
        yield NearGear(key, rows[key].ratio, used, name, result.verdict, False), result


def partners(study: Study, task: JointTask, motor: str) -> list[str]:
    """Keys of the gears that are compatible with a motor: from the study's pairs, else from published pairs."""
    bare = bare_key(study.catalog.motors[motor])  # published pairs name parts without brakes and stages
    published = (task.staged.get(gear, gear) for gear in study.catalog.pairs.get(bare, ()))
    return [gear for one, gear in task.pairs if one == motor and gear] or sorted(published)


def _reaction(number: Number, joint: int, windows: tuple[RatioWindow, ...]) -> dict[str, float]:
    """Change of each earlier joint's torque across the window, relative to its peak."""
    closed = [window for window in windows if 0.0 < window.low < window.high < math.inf]
    if not closed:
        return {}
    low, high = number.put(closed[0].low), number.put(closed[-1].high)
    found = {}
    for before in range(joint if low.study.arm is not None else 0):
        torque = low.demand(before).gear_torque
        peak = float(np.abs(torque).max())
        change = float(np.abs(high.demand(before).gear_torque - torque).max())
        found[low.study.joints[before].name] = change / peak if peak > 0.0 else math.inf
    return found


def _never_made(result: JointResult) -> tuple[Check, ...]:
    """The essential checks that cannot be made at any ratio."""
    return tuple(check for check in result.lacking if not undecided(check))


def _notes(setup: Setup, joint: int) -> tuple[str, ...]:
    result = setup.joint(joint)
    notes = [f"not checked at any ratio: {check.name}" for check in _never_made(result)]
    if not result.gear:
        notes.append("an ideal gear: no limits, no loss, no inertia of its own")
    if joint > 0 and setup.study.arm is not None:
        notes.append("this joint's rotor also loads the joints before it; they are not checked here")
    return (*notes, *result.drive.assumptions)
