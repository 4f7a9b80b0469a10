"""The gear ratio of one joint: swept with every check, its feasible window, and what formulas say of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from drivetrain.arm.coupling import shaft_motion
from drivetrain.drive.drive import Drive, drive_inertia
from drivetrain.drive.gear import mesh_loss_coefficient
from drivetrain.drive.matching import (
    LoadMatch,
    inertia_matching_ratio,
    load_match,
    rated_ranges,
    ratio_of_least_peak,
    ratio_of_least_rms,
    scaled_gear,
    torque_terms,
)
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.answers.ratio_results import (
    ClosedForms,
    NearGear,
    RatioLimits,
    RatioPoint,
    RatioStudy,
    RatioWindow,
)
from drivetrain.sizing.demand.demand import JointWork, workload
from drivetrain.sizing.judge.evaluate import Pair, given_drives
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.old_judge import is_direct, judge
from drivetrain.sizing.judge.operation import Operation, operation
from drivetrain.sizing.search.search import select
from drivetrain.study.study import JointTask, Study
from drivetrain.study.verdicts import lacking, verdict_of

GRID = 81  # ratios of the sweep
SPAN = 8.0  # times below and above the ratios of interest
SMALLEST, LARGEST = 0.05, 2.0e4  # where a window that nothing ends is let go on no further
CHANGE = 1e-9  # share by which a utilisation must change over the sweep to depend on the ratio
EDGE = 1e-7  # relative error of a window's end
NEAR_GEARS = 8


@dataclass(frozen=True, eq=False)
class _Bench:
    """One joint with its motor, and a gear whose ratio can be turned."""

    study: Study
    joint: int
    work: JointWork
    mounted: Mapping[int, Drive]

    @property
    def drive(self) -> Drive:
        """The template."""
        return self.mounted[self.joint]

    def at(self, ratio: float) -> Operation:
        """The template with this ratio at its work."""
        return self.run(replace(self.drive, gear=scaled_gear(self.drive.gear, ratio)))

    def run(self, drive: Drive) -> Operation:
        return operation(self.study, self.joint, self.work.demand(drive), drive)

    @cached_property
    def template(self) -> Operation:
        return self.run(self.drive)


def ratio_study(
    study: Study,
    joint: str,
    *,
    drives: Mapping[str, Pair] | None = None,
    motor: str | None = None,
    gear: str | None = None,
    ratios: Sequence[float] | None = None,
) -> RatioStudy:
    """What the ratio of one joint's gear decides: torque, speed, heat, every check, and the window in which all hold.

    The gear is a template: its ratio is varied continuously, everything else on its sheet is kept (see
    ``scaled_gear``). The drives of the other joints stay as they are. The joint's own ratio changes what it asks of
    the joints before it, through its rotor's reaction; those are not judged here, ``reaction`` tells how much it is.

    Args:
        study: The task.
        joint: Name of the joint.
        drives: Keys of (motor, gear) by joint name; a joint that is not named keeps the drive the study gives it.
        motor, gear: Keys for this joint, in place of those; gear "" is an ideal gear without limits, taken also where
            only a motor is known.
        ratios: To sweep, positive; None: chosen around the ratio of least RMS torque and the template's.

    Returns:
        The sweep, its windows and marks.

    Raises:
        InputError: Unknown joints, motors or gears, a joint without a drive, or ratios that are not positive.
    """
    bench, keys = _bench(study, joint, drives or {}, motor, gear)
    probed = _probe(bench)
    # Where torque cannot be judged nothing ends a window, and there is no sense in looking further.
    points = _sweep(probed, _grid(bench, ratios), fixed=ratios is not None or bool(bench.template.missing))
    windows = _windows(probed, points)
    best = min(points, key=_strain(points))
    return RatioStudy(
        study=study,
        joint=joint,
        motor=keys[0],
        gear=keys[1],
        drive=bench.drive,
        points=points,
        windows=windows,
        best=best,
        limits=_limits(bench.at(best.ratio)),
        closed_forms=_closed_forms(bench.at(best.ratio)),
        gears=_near_gears(bench, keys, best.ratio, windows),
        reaction=_reaction(bench, windows),
        notes=_notes(bench),
        lacking=lacking(judge(bench.template)),
    )


def ratio_studies(study: Study, *, drives: Mapping[str, Pair] | None = None) -> tuple[RatioStudy, ...]:
    """The ratio of every joint that moves, one at a time.

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
    """The drives that the study gives, or those that are selected for it.

    Returns:
        Keys of (motor, gear) by joint name; when nothing fits, of the nearest set.
    """
    given = {task.name: task.drive for task in study.joints if task.drive is not None}
    if len(given) == len(study.joints):
        return given
    selection = select(study)
    return {name: (joint.motor, joint.gear) for name, joint in selection.evaluation.joints.items()}


def _bench(
    study: Study, joint: str, drives: Mapping[str, Pair], motor: str | None, gear: str | None
) -> tuple[_Bench, Pair]:
    names = [task.name for task in study.joints]
    if joint not in names:
        raise InputError(Fault("joint", "is no joint of the study", joint, nearest(joint, names)))
    index = names.index(joint)
    own = drives.get(joint, study.joints[index].drive) or ("", "")
    wanted = (own[0] if motor is None else motor, own[1] if gear is None else gear)
    keys = given_drives(study, {**drives, joint: wanted} if any(wanted) else drives)
    shelf = Shelf(study)
    mounted = {i: shelf.drive(task, *keys[task.name]) for i, task in enumerate(study.joints)}
    work = workload(study).at(index, mounted)
    return _Bench(study, index, work, mounted), keys[joint]


def _probe(bench: _Bench) -> Callable[[float], RatioPoint]:
    """Every check at a ratio, each ratio once."""
    known: dict[float, RatioPoint] = {}

    def at(ratio: float) -> RatioPoint:
        if ratio not in known:
            known[ratio] = _point(bench.at(ratio))
        return known[ratio]

    return at


def _point(op: Operation) -> RatioPoint:
    # Far from any ratio that fits, the heat may leave the range of numbers: that is a runaway like any other.
    with np.errstate(over="ignore", invalid="ignore"):
        checks = judge(op)
    return RatioPoint(
        ratio=abs(op.drive.gear.ratio),
        rms_torque=math.sqrt(op.demand.mean(op.motor_torque**2)),
        peak_torque=float(np.abs(op.peak_torque).max()),
        motor_speed=float(np.abs(op.motor_speed).max()),
        winding_temperature=float(op.figures.winding_temperature),
        utilisations={check.name: math.nan if check.utilisation is None else check.utilisation for check in checks},
    )


def _grid(bench: _Bench, ratios: Sequence[float] | None) -> list[float]:
    if ratios is not None:
        wrong = [Fault(f"ratios[{i}]", "must be positive and finite", r) for i, r in enumerate(ratios)
                 if not 0.0 < r < math.inf]  # fmt: skip
        if wrong or not len(ratios):
            raise InputError(wrong or Fault("ratios", "must not be empty"))
        return sorted(float(ratio) for ratio in ratios)
    centres = [abs(bench.drive.gear.ratio), _closed_forms(bench.template).least_rms]
    known = [ratio for ratio in centres if SMALLEST < ratio < LARGEST] or [abs(bench.drive.gear.ratio)]
    low, high = max(min(known) / SPAN, SMALLEST), min(max(known) * SPAN, LARGEST)
    return [float(ratio) for ratio in np.geomspace(low, high, GRID)]


def _sweep(at: Callable[[float], RatioPoint], grid: list[float], *, fixed: bool) -> tuple[RatioPoint, ...]:
    """The grid, wider where its ends still fit, with the least utilisation between its ratios put in."""
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
        points.append(at(_least(lambda x: strain(at(math.exp(x))), low, high)))
    return tuple(sorted(points, key=lambda point: point.ratio))


def _strain(points: Sequence[RatioPoint]) -> Callable[[RatioPoint], float]:
    """The highest utilisation of those checks that the ratio changes: torque at the gear's output is none of them."""
    changing = []
    for name in points[0].utilisations:
        used = np.array([point.utilisations[name] for point in points])
        if not np.isnan(used).all() and float(np.nanmax(used) - np.nanmin(used)) > CHANGE * float(np.nanmax(used)):
            changing.append(name)
    if not changing:
        return lambda point: point.utilisation
    return lambda point: max(math.inf if math.isnan(u) else u for u in (point.utilisations[n] for n in changing))


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    """The ratio of the smallest value between two logarithms, by golden section."""
    share = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > 1e-4:
        left, right = high - share * (high - low), low + share * (high - low)
        low, high = (low, right) if function(left) <= function(right) else (left, high)
    return math.exp(0.5 * (low + high))


def _windows(at: Callable[[float], RatioPoint], points: tuple[RatioPoint, ...]) -> tuple[RatioWindow, ...]:
    """Runs of ratios that fit, their ends found by bisection."""
    edges: list[tuple[float, str]] = []
    if points[0].fits:
        edges.append((0.0, ""))
    edges += [_edge(at, a, b) for a, b in pairwise(points) if a.fits != b.fits]
    if points[-1].fits:
        edges.append((math.inf, ""))
    starts, ends = edges[0::2], edges[1::2]
    return tuple(RatioWindow(a[0], b[0], a[1], b[1]) for a, b in zip(starts, ends, strict=True))


def _edge(at: Callable[[float], RatioPoint], first: RatioPoint, second: RatioPoint) -> tuple[float, str]:
    """The last ratio that fits between one that does and one that does not, and what fails beyond it."""
    good, bad = (first, second) if first.fits else (second, first)
    while abs(good.ratio - bad.ratio) > EDGE * good.ratio:
        middle = at(math.sqrt(good.ratio * bad.ratio))
        good, bad = (middle, bad) if middle.fits else (good, middle)
    return good.ratio, bad.binding


def _limits(op: Operation) -> RatioLimits:
    checks = {check.name: check for check in judge(op)}
    safety = op.safety

    def available(name: str, factor: float) -> float | None:
        check = checks.get(name)
        return None if check is None or check.available is None else check.available / factor

    speeds = [available(name, safety.speed) for name in ("motor speed", "gear maximum input speed")]
    known = [speed for speed in speeds if speed is not None]
    return RatioLimits(
        _rated_torque(op),
        available("motor peak torque", safety.peak_torque),
        min(known) if known else None,
        available("winding temperature", 1.0),
    )


def _rated_torque(op: Operation) -> float | None:
    """Continuous torque of the warm motor, the safety factor taken out; None where a sheet does not say enough."""
    lasting = op.continuous_current.value
    return None if lasting is None or op.missing else lasting * op.constant / op.safety.rms


def _closed_forms(op: Operation) -> ClosedForms:
    demand, drive = op.demand, op.drive
    if op.missing:
        return ClosedForms(None, math.nan, math.nan, None, None)
    terms = torque_terms(
        drive, demand.gear_torque, demand.speed, demand.acceleration, demand.carrier_acceleration, demand.weights
    )
    inertia, rated = drive_inertia(drive), _rated_torque(op)
    matching = None
    if demand.load_inertia is not None and inertia > 0.0 and demand.mean(demand.load_inertia) > 0.0:
        matching = inertia_matching_ratio(demand.mean(demand.load_inertia), inertia)
    match: LoadMatch | None = None
    if rated is not None and inertia > 0.0:
        efficiency = 1.0 / (1.0 + mesh_loss_coefficient(drive.gear))
        load = demand.load_torque
        match = load_match(rated, inertia, load, demand.acceleration, demand.weights, efficiency=efficiency)
    return ClosedForms(
        matching,
        ratio_of_least_rms(terms),
        ratio_of_least_peak(terms),
        None if rated is None else rated_ranges(terms, rated),
        match,
    )


def _near_gears(bench: _Bench, keys: Pair, best: float, windows: tuple[RatioWindow, ...]) -> tuple[NearGear, ...]:
    """The catalogue's gears for this motor whose ratios are nearest to the best one, each with its own sheet."""
    study, task = bench.study, bench.study.joints[bench.joint]
    gears = study.catalog.gears
    allowed = [key for key in _allowed(study, task, keys) if key in gears]
    order = sorted(allowed, key=lambda key: (abs(math.log(abs(gears[key].ratio) / best)), key))
    shelf, found = Shelf(study), []
    for key in order[:NEAR_GEARS]:
        checks = judge(bench.run(shelf.drive(task, keys[0], key)))
        judged = [check for check in checks if check.utilisation is not None]
        binding = max(judged, key=lambda check: check.utilisation or 0.0, default=None)
        ratio = gears[key].ratio
        found.append(NearGear(
            key, ratio, math.inf if binding is None else binding.utilisation or 0.0,
            "" if binding is None else binding.name, verdict_of(checks),
            any(window.low <= abs(ratio) <= window.high for window in windows),
        ))  # fmt: skip
    return tuple(found)


def _allowed(study: Study, task: JointTask, keys: Pair) -> list[str]:
    """Gears that may sit behind the motor: the study's pairs, else published ones, else those of the same kind."""
    motor, gear = keys
    paired = [other for one, other in task.pairs if one == motor and other]
    published = sorted(study.catalog.pairs.get(motor, ()))
    if paired or published or not gear:
        return paired or published
    kind = study.catalog.gears[gear].kind
    return [key for key, row in study.catalog.gears.items() if row.kind == kind]


def _reaction(bench: _Bench, windows: tuple[RatioWindow, ...]) -> dict[str, float]:
    """How much the joints before feel of the window's width."""
    closed = [window for window in windows if 0.0 < window.low < window.high < math.inf]
    if not closed or bench.study.arm is None:
        return {}
    ends = (closed[0].low, closed[-1].high)
    found = {}
    for before in range(bench.joint):
        torques = []
        for ratio in ends:
            turned = replace(bench.drive, gear=scaled_gear(bench.drive.gear, ratio))
            drives = {**bench.mounted, bench.joint: turned}
            torques.append(bench.work.work.at(before, drives).demand(drives[before]).gear_torque)
        peak = float(np.abs(torques[0]).max())
        change = float(np.abs(torques[1] - torques[0]).max())
        found[bench.study.joints[before].name] = change / peak if peak > 0.0 else math.inf
    return found


def _notes(bench: _Bench) -> tuple[str, ...]:
    op = bench.template
    notes = [f"not judged at any ratio: {check.name}" for check in lacking(judge(op))]
    if is_direct(op):
        notes.append("an ideal gear: no limits, no loss, no inertia of its own")
    if bench.joint > 0 and bench.study.arm is not None:
        notes.append("the joints before feel this joint's rotor; they are not judged here")
    return (*notes, *bench.drive.assumptions)
