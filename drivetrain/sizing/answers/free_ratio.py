"""Gears as free ratios, for early design: the best ratio of each joint in the coupled arm.

A gear's ratio decides its own motor's torque, T/G + J G a, and through the rotor's reaction the torque of the joints
before it; the gear's size, where a family has one, loads them too. The ratios are found by rounds over the joints,
each ratio turned to the least of the goal over the whole arm (Brent's method), until none moves. Beside it stands what
formulas give for each motor alone: G^4 = mean(T^2) / (J^2 mean(a^2)) without loss.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache

import numpy as np
from scipy.optimize import minimize_scalar

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import Gear, average_torque, torque_exponent
from drivetrain.drive.matching import GearFamily, fitted_family, ideal_family, ratio_of_least_rms
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.drive.motor_limits import continuous_current
from drivetrain.errors import Fault, InputError, by_whole_name, nearest, raise_faults
from drivetrain.sizing.answers.ratio import partners, rms_torque, terms_of
from drivetrain.sizing.demand.demand import Workload, workload
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.judge.missing import torque_lacks
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.vary import Setup, Worst, edges, worst_of
from drivetrain.sizing.search.search import select
from drivetrain.study.model import FreeRatio, Study
from drivetrain.study.parts.mounting import drive_mass
from drivetrain.study.parts.verdicts import Verdict, verdict_of

ROUNDS = 12
MOVED = 1e-6  # relative change of a ratio below which it has settled
STEPS = 20  # of a look over the range before the least is refined
NEAR = 12  # gears of the catalogue shown
SWEEP = 41
EDGE = 1e-9
SIZINGS = 12  # a gear that rides on the link it moves is sized again until its own weight is borne
SETTLED = 1e-10
ALLOWED = ("motor speed", "gear maximum input speed", "gear mean input speed", "motor voltage")  # what ends a range


class Goal(StrEnum):
    """What the ratios are to make small, over all joints together.

    HEAT: mean copper loss at ambient temperature [W]. CURRENT: root mean square over the joints of RMS current over the
    motor's continuous current [-]. ENERGY: drawn a cycle, what is fed back credited [J]. MASS: of all drives [kg].
    """

    HEAT = "heat"
    CURRENT = "current"
    ENERGY = "energy"
    MASS = "mass"

    @property
    def unit(self) -> str:
        return {"heat": "W", "current": "1", "energy": "J", "mass": "kg"}[self.value]


@dataclass(frozen=True)
class CatalogueGear:
    """A gear of the catalogue in the place of the continuous one, the other joints at their best ratios."""

    key: str
    ratio: float  # as printed, with its sign
    loss: float  # by how much the goal is above the continuous best, relative; NaN where the sheet says too little
    verdict: Verdict  # of the joint's checks with the gear's own sheet
    binding: str  # the check of highest utilisation
    utilisation: float  # of that check


@dataclass(frozen=True, eq=False)
class FreeJoint:
    """One joint with a free ratio."""

    joint: str
    motor: str
    family: GearFamily
    best: float  # the ratio that is best for the arm
    alone: float  # of least RMS torque of this motor alone by formula, the other joints at theirs, limits not counted
    low: float  # ends of what range, speed and voltage allow at the best
    high: float
    ended_by: str  # what ends the allowed range above; below it is the range itself or the voltage
    gear: Gear  # the continuous gear at the best ratio
    ratios: Array  # of the sweep, rising, (M,)
    goal: Array  # over them, the other joints at their best, (M,)
    rms_torque: Array  # of the motor over them [N m], (M,)
    verdict: Verdict  # of the joint's checks at the best ratio
    binding: str  # the check of highest utilisation there
    utilisation: float  # of that check
    gears: tuple[CatalogueGear, ...]  # of the catalogue, nearest in ratio first


@dataclass(frozen=True, eq=False)
class FreeRatios:
    """The best ratios of an arm.

    Attributes:
        study: The task.
        goal: What they make small.
        value: Of the goal at the best ratios, over all joints [the goal's unit].
        alone: Of the goal when every joint takes the best ratio for its own motor, within its limits.
        joints: Those with a free ratio.
        rounds: Sweeps over the joints until no ratio moved.
        notes: What a reader should know.
    """

    study: Study
    goal: Goal
    value: float
    alone: float
    joints: tuple[FreeJoint, ...]
    rounds: int
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"FreeRatios({self.study.name}: {len(self.joints)} joints, {self.goal} {self.value:.4g})"

    @property
    def feasible(self) -> bool:
        """Whether every joint with a free ratio holds; one whose motor lacks data is not proven to."""
        return all(one.verdict in (Verdict.PASS, Verdict.MARGINAL) for one in self.joints)


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
    lines = {joint: _Line(design, joint, ratios) for joint in sorted(design.families)}
    joints = tuple(_joint(line, ratios[joint]) for joint, line in lines.items())
    alone = {
        joint: ratios[joint] if math.isnan(found.alone) else min(max(found.alone, found.low), found.high)
        for joint, found in zip(lines, joints, strict=True)
    }
    best = design.setup(ratios)
    return FreeRatios(
        study, aim, design.total(best), design.total(design.setup(alone)), joints, rounds, _notes(design, best.drives)
    )


def goal_of(goal: Goal | str) -> Goal:
    known = [one.value for one in Goal]
    if str(goal) not in known:
        raise InputError(Fault("goal", "is none that ratios can be chosen for", str(goal), nearest(str(goal), known)))
    return Goal(str(goal))


@dataclass(frozen=True, eq=False)
class _Design:
    """A task with a motor and either a fixed gear or a family of gears at every joint."""

    work: Workload
    filled_parts: FilledParts
    motors: Mapping[int, str]
    families: Mapping[int, GearFamily]
    fixed: Mapping[int, Drive]
    goal: Goal

    @property
    def study(self) -> Study:
        return self.work.study

    def setup(self, ratios: Mapping[int, float], after: Setup | None = None, joint: int | None = None) -> Setup:
        """The drives for a set of ratios, each sized for the load of those after it, which may be sized already."""
        drives = dict(self.fixed)
        if after is not None and joint is not None:
            drives.update({i: drive for i, drive in after.drives.items() if i > joint})
        for index in range(len(self.study.joints) - 1 if joint is None else joint, -1, -1):
            if index in self.families:
                drives[index] = self._sized(index, ratios[index], drives)
        return Setup(self.work, drives)

    def share(self, setup: Setup, joint: int) -> float:
        """What one joint adds to the goal; the square for CURRENT; NaN where data are missing."""
        drive, ambient = setup.drives[joint], self.study.ambient
        if self.goal is Goal.MASS:
            mass = drive_mass(drive)
            return math.nan if mass is None else mass
        result = setup.joint(joint)
        if not result.torque_known:
            return math.nan
        if self.goal is Goal.ENERGY:
            return float(result.series.electrical_power @ self.work.weights)
        squared = (rms_torque(setup, joint) / float(torque_constant(drive.motor, ambient))) ** 2
        if self.goal is Goal.HEAT:
            return float(winding_resistance(drive.motor, ambient)) * squared
        mounting = self.study.joints[joint].housing_to_ambient
        limit = continuous_current(drive.motor, ambient, housing_to_ambient=mounting).value
        return math.nan if limit is None else squared / limit**2

    def total(self, setup: Setup, known: Mapping[int, float] | None = None) -> float:
        """The goal of all joints, of which the shares of some may be known."""
        count = len(self.study.joints)
        shares = [known[i] if known and i in known else self.share(setup, i) for i in range(count)]
        return math.sqrt(math.fsum(shares) / count) if self.goal is Goal.CURRENT else math.fsum(shares)

    def _sized(self, joint: int, ratio: float, drives: Mapping[int, Drive]) -> Drive:
        """The drive of a ratio, its gear as small as its load allows."""
        task, family, work = self.study.joints[joint], self.families[joint], self.work.at(joint, drives)
        motor = self.filled_parts.motor(self.motors[joint])

        def drive(torque: float) -> Drive:
            return Drive(
                motor, self.filled_parts.filled(family.gear(ratio, torque)), task.friction, task.motor_friction
            )

        found = drive(max(family.smallest, 1.0))
        if not family.laws:
            return found
        before = 0.0
        for _ in range(SIZINGS):
            demand = work.demand(found)
            peak = self.study.safety.peak_torque * float(np.abs(demand.loosening_torque).max())
            exponent = torque_exponent(found.gear)
            mean = average_torque(exponent, demand.load_torque, demand.speed, demand.weights)
            torque = family.size_for(ratio, peak, mean)
            found = drive(torque)
            if not work.own_load or abs(torque - before) <= SETTLED * torque:
                break
            before = torque
        return found


def _design(study: Study, goal: Goal, wanted: Mapping[str, FreeRatio], drives: Mapping[str, Pair]) -> _Design:
    names = [task.name for task in study.joints]
    faults: list[Fault] = []
    wanted = by_whole_name("free", "joint of the study", wanted, names, faults)
    if not wanted:
        hint = "give a joint `free_ratio: {ratio: [30, 160]}`"
        faults.append(Fault("joints", "none of them has a free ratio", hint=hint))
    raise_faults(faults)
    pairs = _pairs(study, wanted, drives)
    filled_parts, motors, families = FilledParts(study), dict[int, str](), dict[int, GearFamily]()
    known: dict[tuple[float, float, str | None], GearFamily] = {}
    for index, task in enumerate(study.joints):
        motors[index] = (wanted[task.name].motor if task.name in wanted else None) or pairs[task.name][0]
        if motors[index] not in study.catalog.motors:
            hint = nearest(motors[index], study.catalog.motors)
            faults.append(Fault(f"joints.{task.name}.free_ratio.motor", "is not in the catalogue", motors[index], hint))
        elif task.name in wanted:
            free = wanted[task.name]
            families[index] = known.setdefault((free.low, free.high, free.series), _family(study, free))
    raise_faults(faults)
    fixed = {i: filled_parts.drive(t, *pairs[t.name]) for i, t in enumerate(study.joints) if i not in families}
    design = _Design(workload(study), filled_parts, motors, families, fixed, goal)
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
        chosen = select(study, advise=False).evaluation.joints
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


def _check_known(design: _Design) -> None:
    """Everything that the goal needs must be on the sheets."""
    setup, faults = design.setup({joint: math.sqrt(f.low * f.high) for joint, f in design.families.items()}), []
    for joint, task in enumerate(design.study.joints):
        if math.isnan(design.share(setup, joint)):
            lacks = torque_lacks(setup.drives[joint]) or "the continuous current"
            lacks = "the mass" if design.goal is Goal.MASS else lacks
            problem = f"the {design.goal} cannot be computed: {lacks} is unknown"
            hint = "complete the row, or state assumptions in the study"
            faults.append(Fault(f"joints.{task.name}", problem, hint=hint))
    raise_faults(faults)


def _settled(design: _Design) -> tuple[dict[int, float], int]:
    """Ratios from which no joint wants to move alone."""
    ratios = {joint: math.sqrt(f.low * f.high) for joint, f in design.families.items()}
    for turn in range(1, ROUNDS + 1):
        moved = 0.0
        for joint in sorted(design.families, reverse=True):
            best = _Line(design, joint, ratios).allowed().best
            moved = max(moved, abs(best / ratios[joint] - 1.0))
            ratios[joint] = best
        if moved <= MOVED:
            return ratios, turn
    return ratios, ROUNDS


@dataclass(frozen=True)
class _Allowed:
    """Where the least of a goal was found, and the range that speed and voltage leave."""

    best: float
    low: float
    high: float
    ended_by: str


class _Line:
    """The goal along the ratio of one joint, everything else kept; the joints after it are not asked again."""

    def __init__(self, design: _Design, joint: int, ratios: Mapping[int, float]) -> None:
        self.design, self.joint, self.ratios = design, joint, dict(ratios)
        self.now = design.setup(ratios)
        self.setup = cache(lambda ratio: design.setup({**self.ratios, joint: ratio}, self.now, joint))
        self._after = {i: design.share(self.now, i) for i in range(joint + 1, len(design.study.joints))}

    def goal(self, ratio: float) -> float:
        value = self.design.total(self.setup(ratio), self._after)
        return math.inf if math.isnan(value) else value

    def limit(self, ratio: float) -> Worst:
        """How near the joint comes to its limits of speed and of voltage; above 1 the ratio is not allowed."""
        return worst_of(check for check in self.setup(ratio).joint(self.joint).checks if check.name in ALLOWED)

    def allowed(self) -> _Allowed:
        """The best ratio in the run of allowed ratios that holds the least goal."""
        family = self.design.families[self.joint]
        steps = [float(ratio) for ratio in np.geomspace(family.low, family.high, STEPS)]
        runs = list(edges(lambda ratio: self.limit(ratio).utilisation <= 1.0, steps, error=EDGE))
        if not runs:
            least = min(steps, key=lambda ratio: self.limit(ratio).utilisation)
            return _Allowed(least, least, least, self.limit(least).check)
        goals = [self.goal(x) if any(a.inside <= x <= b.inside for a, b in runs) else math.inf for x in steps]
        at = int(np.argmin(goals))
        start, end = next((a, b) for a, b in runs if a.inside <= steps[at] <= b.inside)
        low, high = max(start.inside, steps[0]), min(end.inside, steps[-1])
        left, right = max(low, steps[max(at - 1, 0)]), min(high, steps[min(at + 1, STEPS - 1)])
        found = minimize_scalar(
            lambda x: self.goal(math.exp(x)), bounds=(math.log(left), math.log(right)), method="bounded",
            options={"xatol": 1e-8},
        )  # fmt: skip
        best = min([math.exp(float(found.x)), steps[at], left, right], key=self.goal)
        return _Allowed(best, low, high, self.limit(end.outside).check if end.known else "end of the range")


def _joint(line: _Line, ratio: float) -> FreeJoint:
    design, joint, allowed = line.design, line.joint, line.allowed()
    family, sweep = design.families[joint], np.geomspace(design.families[joint].low, design.families[joint].high, SWEEP)
    result, setups = line.now.joint(joint), [line.setup(float(x)) for x in sweep]
    most, ideal = worst_of(result.checks), result.drive.gear.kind == "ideal"  # of which nobody could state a limit
    verdict = verdict_of(check for check in result.checks if not (ideal and check.name.startswith("gear ")))
    alone = ratio_of_least_rms(terms_of(line.now, joint)) if result.torque_known else math.nan
    torque = [rms_torque(setup, joint) if setup.joint(joint).torque_known else math.nan for setup in setups]
    return FreeJoint(
        result.name, design.motors[joint], family, ratio, alone, allowed.low, allowed.high, allowed.ended_by,
        result.drive.gear, sweep, np.array([line.goal(float(x)) for x in sweep]), np.array(torque), verdict, most.check,
        most.utilisation, _gears(line, ratio),
    )  # fmt: skip


def _gears(line: _Line, ratio: float) -> tuple[CatalogueGear, ...]:
    """The catalogue's gears nearest in ratio, each in the place of the continuous one."""
    design, joint, best, found = line.design, line.joint, line.goal(ratio), []
    rows = design.study.catalog.gears
    near = sorted(_partners(design, joint), key=lambda key: (abs(math.log(abs(rows[key].ratio) / ratio)), key))
    for key in near[:NEAR]:
        drive = design.filled_parts.drive(design.study.joints[joint], design.motors[joint], key)
        families = {index: family for index, family in design.families.items() if index != joint}
        fixed = {**design.fixed, joint: drive}
        setup = replace(design, families=families, fixed=fixed).setup(line.ratios)
        checks = setup.joint(joint).checks
        most, loss = worst_of(checks), design.total(setup) / best - 1.0 if best else math.nan
        found.append(CatalogueGear(key, rows[key].ratio, loss, verdict_of(checks), most.check, most.utilisation))
    return tuple(found)


def _partners(design: _Design, joint: int) -> Sequence[str]:
    """Gears that may take the place of the continuous one: of the series; else what goes with the motor."""
    rows, family, motor = design.study.catalog.gears, design.families[joint], design.motors[joint]
    paired = [gear for one, gear in design.study.joints[joint].pairs if one == motor and gear]
    among = paired or (list(rows) if family.laws else [])
    series = [key for key in among if rows[key].series == family.name]
    return series or partners(design.study, design.study.joints[joint], motor)


def _notes(design: _Design, drives: Mapping[int, Drive]) -> tuple[str, ...]:
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
