"""Gears as free ratios, for early design: the best ratio of each joint in the coupled arm.

A gear's ratio decides its own motor's torque, T/G + J G a, and through the rotor's reaction the torque of the joints
before it; the gear's size, where a family has one, loads them too. The ratios are found by rounds over the joints,
each ratio turned to the least of the goal over the whole arm (Brent's method), until none moves. Beside it stands what
formulas give for each motor alone: G^4 = mean(T^2) / (J^2 mean(a^2)) without loss.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from drivetrain.drive.drive import Drive
from drivetrain.drive.gear_family import GearFamily, fitted_family, ideal_family
from drivetrain.drive.matching import ratio_of_least_rms, torque_terms
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.answers.free_design import FreeDesign, finite
from drivetrain.sizing.answers.free_ratio_results import CatalogueGear, FreeJoint, FreeRatios, Goal
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.old_judge import judge
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.search.search import select
from drivetrain.sizing.tolerance.bench import worst_of
from drivetrain.study.study import FreeRatio, Study
from drivetrain.study.verdicts import verdict_of

ROUNDS = 12
MOVED = 1e-6  # relative change of a ratio below which it has settled
STEPS = 20  # of a look over the range before the least is refined
NEAR = 12  # gears of the catalogue told
SWEEP = 41
EDGE = 1e-9


def free_ratios(
    study: Study,
    *,
    goal: Goal | str = Goal.HEAT,
    free: Mapping[str, FreeRatio] | None = None,
    drives: Mapping[str, Pair] | None = None,
) -> FreeRatios:
    """The best ratios of gears that may have any ratio in a range, the arm coupled.

    Args:
        study: The task.
        goal: What the ratios make small over all joints together.
        free: By joint name, the range of ratios and the family; None: as the study's joints say.
        drives: Keys of (motor, gear) by joint name: motors of the free joints, drives of the others; what is not named
            is as the study gives it, and else selected.

    Returns:
        The ratios, what limits them, and the nearest gears of the catalogue.

    Raises:
        InputError: No joint with a free ratio, unknown joints, series or motors, or data without which the goal
            cannot be computed.
    """
    aim = goal_of(goal)
    wanted = free if free is not None else {t.name: t.free_ratio for t in study.joints if t.free_ratio is not None}
    design = _design(study, aim, wanted, drives or {})
    ratios, rounds = _settled(design)
    alone = {joint: _bounded(design, joint, ratios, _alone(design, joint, ratios)) for joint in design.families}
    best, own = design.mounted(ratios), design.mounted(alone)
    return FreeRatios(
        study, aim, _value(design, best), _value(design, own),
        tuple(_joint(design, joint, ratios, best) for joint in sorted(design.families)), rounds, _notes(design, best),
    )  # fmt: skip


@dataclass(frozen=True)
class _Allowed:
    """Where the least of a goal was found, and the range that speed and voltage leave."""

    best: float
    low: float
    high: float
    ended_by: str


def goal_of(goal: Goal | str) -> Goal:
    """A goal by its name.

    Raises:
        InputError: There is none of that name.
    """
    known = [one.value for one in Goal]
    if str(goal) not in known:
        raise InputError(Fault("goal", "is none that ratios can be chosen for", str(goal), nearest(str(goal), known)))
    return Goal(str(goal))


def _design(study: Study, goal: Goal, wanted: Mapping[str, FreeRatio], drives: Mapping[str, Pair]) -> FreeDesign:
    """Motors, families and the drives of the other joints."""
    names = [task.name for task in study.joints]
    strangers = [name for name in wanted if name not in names]
    faults = [Fault("free", "is no joint of the study", name, nearest(name, names)) for name in strangers]
    if not wanted:
        hint = "give a joint `free_ratio: {ratio: [30, 160]}`"
        faults.append(Fault("joints", "none of them has a free ratio", hint=hint))
    if faults:
        raise InputError(faults)
    pairs = _pairs(study, wanted, drives)
    shelf, motors, families = Shelf(study), dict[int, str](), dict[int, GearFamily]()
    known: dict[tuple[float, float, str | None], GearFamily] = {}
    for index, task in enumerate(study.joints):
        motors[index] = (wanted[task.name].motor if task.name in wanted else None) or pairs[task.name][0]
        if motors[index] not in study.catalog.motors:
            hint = nearest(motors[index], study.catalog.motors)
            faults.append(Fault(f"joints.{task.name}.free_ratio.motor", "is not in the catalogue", motors[index], hint))
        elif task.name in wanted:
            free = wanted[task.name]
            families[index] = known.setdefault((free.low, free.high, free.series), _family(study, free))
    if faults:
        raise InputError(faults)
    fixed = {i: shelf.drive(t, *pairs[t.name]) for i, t in enumerate(study.joints) if i not in families}
    design = FreeDesign(workload(study), shelf, motors, families, fixed, goal)
    _check_known(design)
    return design


def _pairs(study: Study, wanted: Mapping[str, FreeRatio], drives: Mapping[str, Pair]) -> dict[str, Pair]:
    """A drive for every joint that needs one: named, given, or selected."""
    pairs: dict[str, Pair] = {}
    for task in study.joints:
        pair = drives.get(task.name, task.drive)
        if pair is not None:
            pairs[task.name] = (pair[0], pair[1] or "")
    named = {name for name, free in wanted.items() if free.motor}
    open_joints = [task.name for task in study.joints if task.name not in pairs and task.name not in named]
    if open_joints:
        chosen = select(study).evaluation.joints
        pairs.update({name: (chosen[name].motor, chosen[name].gear) for name in open_joints if name in chosen})
        lacking = [name for name in open_joints if name not in pairs]
        if lacking:
            hint = "name one: free_ratio: {ratio: [30, 160], motor: KEY}"
            raise InputError([Fault(f"joints.{name}", "has no motor", hint=hint) for name in lacking])
    return pairs


def _family(study: Study, free: FreeRatio) -> GearFamily:
    if free.series is None:
        return ideal_family(free.low, free.high)
    rows = [row for row in study.catalog.gears.values() if row.series == free.series]
    if not rows:
        known = {row.series for row in study.catalog.gears.values() if row.series}
        hint = nearest(free.series, known)
        raise InputError(Fault("series", "no gear of the catalogue has this series", free.series, hint))
    return fitted_family(free.series, rows, free.low, free.high)


def _check_known(design: FreeDesign) -> None:
    """Everything that the goal needs must be on the sheets."""
    drives = design.mounted({joint: math.sqrt(f.low * f.high) for joint, f in design.families.items()})
    faults = []
    for joint, task in enumerate(design.study.joints):
        if math.isnan(design.share(joint, drives)):
            op = design.at(joint, drives)
            lacks = op.missing or ("the mass" if design.goal is Goal.MASS else "the continuous current")
            problem = f"the {design.goal} cannot be computed: {lacks} is unknown"
            hint = "complete the row, or state assumptions in the study"
            faults.append(Fault(f"joints.{task.name}", problem, hint=hint))
    if faults:
        raise InputError(faults)


def _value(design: FreeDesign, drives: Mapping[int, Drive]) -> float:
    return design.total({joint: design.share(joint, drives) for joint in range(len(design.study.joints))})


def _settled(design: FreeDesign) -> tuple[dict[int, float], int]:
    """Ratios from which no joint wants to move alone."""
    ratios = {joint: math.sqrt(f.low * f.high) for joint, f in design.families.items()}
    order = sorted(design.families, reverse=True)
    for turn in range(1, ROUNDS + 1):
        moved = 0.0
        for joint in order:
            new = _allowed(design, joint, ratios).best
            moved = max(moved, abs(new / ratios[joint] - 1.0))
            ratios[joint] = new
        if moved <= MOVED:
            return ratios, turn
    return ratios, ROUNDS


class _Line:
    """The goal along the ratio of one joint, everything else kept; the joints after it are not asked again."""

    def __init__(self, design: FreeDesign, joint: int, ratios: Mapping[int, float]) -> None:
        self.design, self.joint, self.ratios = design, joint, ratios
        count = len(design.study.joints)
        mounted = design.mounted(ratios)
        self.after = {index: mounted[index] for index in range(joint + 1, count)}
        self._fixed = {index: design.share(index, mounted) for index in self.after}
        self._drives: dict[float, dict[int, Drive]] = {}

    def drives(self, ratio: float) -> dict[int, Drive]:
        if ratio not in self._drives:
            self._drives[ratio] = self.design.mounted({**self.ratios, self.joint: ratio}, self.after, self.joint)
        return self._drives[ratio]

    def goal(self, ratio: float) -> float:
        drives = self.drives(ratio)
        shares = {index: self.design.share(index, drives) for index in range(self.joint + 1)}
        return finite(self.design.total(self._fixed | shares))

    def over(self, ratio: float) -> float:
        """Utilisation of speed and voltage; above 1 the ratio is not allowed."""
        return self.design.limit(self.joint, self.drives(ratio)).utilisation


def _allowed(design: FreeDesign, joint: int, ratios: Mapping[int, float]) -> _Allowed:
    """The best ratio of a joint in the run of allowed ratios that holds the least goal."""
    line, family = _Line(design, joint, ratios), design.families[joint]
    steps = [float(x) for x in np.geomspace(family.low, family.high, STEPS)]
    fits = [line.over(x) <= 1.0 for x in steps]
    if not any(fits):
        least = min(steps, key=line.over)
        return _Allowed(least, least, least, design.limit(joint, line.drives(least)).check)
    # Where the run of allowed ratios has its least.
    goals = [line.goal(x) if fit else math.inf for x, fit in zip(steps, fits, strict=True)]
    best = int(np.argmin(goals))
    first, last = best, best
    while first > 0 and fits[first - 1]:
        first -= 1
    while last < STEPS - 1 and fits[last + 1]:
        last += 1
    low = steps[0] if first == 0 else _edge(line, steps[first], steps[first - 1])
    high = steps[-1] if last == STEPS - 1 else _edge(line, steps[last], steps[last + 1])
    beyond = design.limit(joint, line.drives(high * (1.0 + 1e-6))).check if last < STEPS - 1 else "end of the range"
    left = low if best == first else steps[best - 1]
    right = high if best == last else steps[best + 1]
    found = minimize_scalar(
        lambda x: line.goal(math.exp(x)), bounds=(math.log(left), math.log(right)), method="bounded",
        options={"xatol": 1e-8},
    )  # fmt: skip
    inner = math.exp(float(found.x))
    ends = [end for end, at in ((low, first), (high, last)) if at == best]
    return _Allowed(min([inner, steps[best], *ends], key=line.goal), low, high, beyond)


def _edge(line: _Line, good: float, bad: float) -> float:
    """The last allowed ratio between one that is and one that is not."""
    while abs(good - bad) > EDGE * good:
        middle = math.sqrt(good * bad)
        good, bad = (middle, bad) if line.over(middle) <= 1.0 else (good, middle)
    return good


def _alone(design: FreeDesign, joint: int, ratios: Mapping[int, float]) -> float:
    """By formula, of the joint's own motor."""
    op = design.at(joint, design.mounted(ratios))
    demand = op.demand
    if op.missing:
        return math.nan
    terms = torque_terms(
        op.drive, demand.gear_torque, demand.speed, demand.acceleration, demand.carrier_acceleration, demand.weights
    )
    return ratio_of_least_rms(terms)


def _bounded(design: FreeDesign, joint: int, ratios: Mapping[int, float], ratio: float) -> float:
    """A ratio moved into what range, speed and voltage allow."""
    if math.isnan(ratio):
        return ratios[joint]
    allowed = _allowed(design, joint, ratios)
    return min(max(ratio, allowed.low), allowed.high)


def _joint(design: FreeDesign, joint: int, ratios: Mapping[int, float], drives: Mapping[int, Drive]) -> FreeJoint:
    study, family = design.study, design.families[joint]
    allowed, line = _allowed(design, joint, ratios), _Line(design, joint, ratios)
    sweep = np.geomspace(family.low, family.high, SWEEP)
    at = [design.at(joint, line.drives(float(x))) for x in sweep]
    checks = judge(design.at(joint, drives))
    most = worst_of(checks)
    wish = drives[joint].gear.kind == "ideal"  # of which nobody states a limit, nor could
    verdict = verdict_of(check for check in checks if not (wish and check.name.startswith("gear ")))
    return FreeJoint(
        study.joints[joint].name, design.motors[joint], family, ratios[joint], _alone(design, joint, ratios),
        allowed.low, allowed.high, allowed.ended_by, drives[joint].gear, sweep,
        np.array([line.goal(float(x)) for x in sweep]), np.array([_rms(op) for op in at]),
        verdict, most.check, most.utilisation, _gears(design, joint, line, ratios),
    )  # fmt: skip


def _rms(op: Operation) -> float:
    return math.nan if op.missing else math.sqrt(op.demand.mean(op.motor_torque**2))


def _gears(design: FreeDesign, joint: int, line: _Line, ratios: Mapping[int, float]) -> tuple[CatalogueGear, ...]:
    """The catalogue's gears nearest in ratio, each in the place of the continuous one."""
    study, best = design.study, line.goal(ratios[joint])
    rows = study.catalog.gears
    near = sorted(
        _partners(design, joint), key=lambda key: (abs(math.log(abs(rows[key].ratio) / ratios[joint])), key)
    )  # fmt: skip
    found = []
    for key in near[:NEAR]:
        drive = design.shelf.drive(study.joints[joint], design.motors[joint], key)
        fixed = {**design.fixed, joint: drive}
        families = {index: family for index, family in design.families.items() if index != joint}
        placed = FreeDesign(design.work, design.shelf, design.motors, families, fixed, design.goal)
        drives = placed.mounted({k: v for k, v in ratios.items() if k != joint})
        checks = judge(placed.at(joint, drives))
        most = worst_of(checks)
        loss = _value(placed, drives) / best - 1.0 if best else math.nan
        found.append(CatalogueGear(key, rows[key].ratio, loss, verdict_of(checks), most.check, most.utilisation))
    return tuple(found)


def _partners(design: FreeDesign, joint: int) -> Sequence[str]:
    """Gears that may take the place of the continuous one: of the series; else what goes with the motor."""
    study, task, motor = design.study, design.study.joints[joint], design.motors[joint]
    family = design.families[joint]
    paired = [gear for one, gear in task.pairs if one == motor and gear]
    series = [key for key in paired if study.catalog.gears[key].series == family.name]
    if family.laws and not paired:
        series = [key for key, row in study.catalog.gears.items() if row.series == family.name]
    return series or paired or sorted(study.catalog.pairs.get(motor, ()))


def _notes(design: FreeDesign, drives: Mapping[int, Drive]) -> tuple[str, ...]:
    notes = []
    for family in dict.fromkeys(design.families.values()):
        notes.append(f"{family.name}: {family.source}")
        notes += [
            f"{family.name}: {column.replace('_', ' ')} = {law.scale:.4g} T^{law.torque:.3g} G^{law.ratio:.3g} [SI], "
            f"to {100.0 * law.error:.2g} % (standard deviation of {law.rows} rows)"
            for column, law in family.laws.items()
        ]
    if any(family.laws for family in design.families.values()):
        notes.append("in these laws T is the repeated peak torque in N m, G the ratio; the rest in SI units")
        notes.append(
            "a continuous gear is as small as its peak and average torque allow, so its torque is used up, and never "
            "smaller than the smallest row"
        )
    for joint, family in design.families.items():
        torque = drives[joint].gear.repeated_peak_torque
        if family.laws and torque is not None and torque > family.largest:
            name = design.study.joints[joint].name
            notes.append(f"{name}: a gear for {torque:.4g} N m is larger than any row ({family.largest:.4g} N m)")
    return tuple(notes)
