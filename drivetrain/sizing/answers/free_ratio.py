"""Gears as free ratios, for early design: the best ratio of each joint in the coupled arm.

The gear ratio G of a joint determines its own motor's torque, T/G + J G a, and through the rotor's reaction the torque
of the joints before it. The gear's size, where it is taken from a gear series, loads them as well. The ratios that
minimise a goal of the whole arm are found by coordinate descent (``ratio_descent``). For comparison the result contains
the closed-form ratio for each motor alone: G^4 = mean(T^2) / (J^2 mean(a^2)) without losses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import Gear
from drivetrain.drive.matching import GearFamily, fitted_family, ideal_family, ratio_of_least_rms
from drivetrain.errors import Fault, InputError, by_joint, member_of, nearest, raise_faults
from drivetrain.sizing.answers.ratio import partners, rms_torque, terms_of
from drivetrain.sizing.answers.ratio_descent import ArmDesign, Goal, LineSearch, checks_with_limits, coordinate_descent
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import Pair, given_drives
from drivetrain.sizing.judge.missing import torque_lacks
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.vary import worst_of
from drivetrain.sizing.search.search import select
from drivetrain.study.model import FreeRatio, Study
from drivetrain.study.parts.candidates import braked_key, gears_at
from drivetrain.study.parts.verdicts import Verdict, verdict_of

SHOWN_GEARS = 12  # gears of the catalogue that are compared with the continuous gear
SWEEP_POINTS = 41


@dataclass(frozen=True)
class CatalogueGear:
    """A gear of the catalogue in the place of the continuous gear, the other joints at their best ratios."""

    key: str
    ratio: float  # ratio of the data sheet, with its sign
    excess: float  # relative excess of the goal over that of the continuous gear; NaN where the data sheet lacks values
    verdict: Verdict  # verdict of the joint's checks with the data sheet of the gear
    binding: str  # the check of highest utilisation
    utilisation: float  # utilisation of that check


@dataclass(frozen=True, eq=False)
class FreeJoint:
    """One joint with a free ratio."""

    joint: str
    motor: str
    family: GearFamily
    best: float  # ratio that minimises the goal of the arm
    least_rms: float  # ratio of the smallest RMS torque of this motor alone, in closed form, without limits
    low: float  # lower end of the range in which the limits of speed and voltage are met
    high: float  # its upper end
    ended_by: str  # the check that limits this range above, or the stated range
    gear: Gear  # the continuous gear at the best ratio
    ratios: Array  # ratios of a sweep, rising, (M,)
    goal: Array  # goal of the arm at these ratios, the other joints at their best ratios, (M,)
    rms_torque: Array  # RMS torque of the motor at these ratios [N m], (M,)
    verdict: Verdict  # verdict of the joint's checks at the best ratio
    binding: str  # the check of highest utilisation at the best ratio
    utilisation: float  # utilisation of that check
    gears: tuple[CatalogueGear, ...]  # nearest in ratio first


@dataclass(frozen=True, eq=False)
class FreeRatios:
    """The best ratios of an arm.

    Attributes:
        study: The task.
        goal: The quantity that is minimised.
        value: The goal at the best ratios, over all joints [the goal's unit].
        value_at_least_rms: The goal if every joint has the ratio ``least_rms`` of its own motor, within its limits.
        joints: Results of the joints with a free ratio.
        rounds: Number of rounds of the coordinate descent until no ratio changed.
        notes: Remarks: where the gear families come from, and which gears are larger than any in the catalogue.
    """

    study: Study
    goal: Goal
    value: float
    value_at_least_rms: float
    joints: tuple[FreeJoint, ...]
    rounds: int
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"FreeRatios({self.study.name}: {len(self.joints)} joints, {self.goal} {self.value:.4g})"

    @property
    def feasible(self) -> bool:
        """Whether every joint with a free ratio satisfies its checks; False if a motor lacks data."""
        return all(one.verdict in (Verdict.PASS, Verdict.MARGINAL) for one in self.joints)


def free_ratios(
    study: Study,
    *,
    goal: Goal | str = Goal.HEAT,
    free: Mapping[str, FreeRatio] | None = None,
    drives: Mapping[str, Pair] | None = None,
) -> FreeRatios:
    """The gear ratios within a range for each joint that minimise a goal of the whole coupled arm.

    Args:
        study: The task.
        goal: The quantity to minimise over all joints together.
        free: Range of ratios and gear family by joint name; None: those that the study states.
        drives: Keys of (motor, gear) by joint name: motors of the free joints, drives of the others. Joints that are
            not named keep the drive of the study, or else a selected one.

    Returns:
        The ratios, what limits them, and the nearest gears of the catalogue.

    Raises:
        InputError: There is no joint with a free ratio; joints, series or motors are unknown; or data are missing
        without which the goal cannot be computed.
    """
    wanted = free if free is not None else {t.name: t.free_ratio for t in study.joints if t.free_ratio is not None}
    design = _design(study, goal_of(goal), wanted, drives or {})
    ratios, rounds = coordinate_descent(design)
    searches = {joint: LineSearch(design, joint, ratios) for joint in sorted(design.families)}
    joints = tuple(_joint(search, ratios[joint]) for joint, search in searches.items())
    least_rms = {
        joint: ratios[joint] if math.isnan(one.least_rms) else min(max(one.least_rms, one.low), one.high)
        for joint, one in zip(searches, joints, strict=True)
    }
    best = design.setup(ratios)
    return FreeRatios(
        study, design.goal, design.objective(best), design.objective(design.setup(least_rms)), joints, rounds,
        _notes(design, best.drives),
    )  # fmt: skip


def goal_of(goal: Goal | str) -> Goal:
    return member_of(Goal, goal, "goal", "is none that ratios can be chosen for")


def _design(study: Study, goal: Goal, wanted: Mapping[str, FreeRatio], drives: Mapping[str, Pair]) -> ArmDesign:
    names = study.joint_names
    faults: list[Fault] = []
    wanted = by_joint("free", wanted, names, faults)
    if not wanted:
        hint = "give a joint `free_ratio: {ratio: [30, 160]}`"
        faults.append(Fault("joints", "none of them has a free ratio", hint=hint))
    for task in study.joints:
        for beside, there in (("stages", task.staged), ("two motors", task.sharing)):
            if there and task.name in wanted:
                faults.append(Fault(f"joints.{task.name}.free_ratio", f"is not computed with {beside}"))
    for name, free in wanted.items():
        if not isinstance(free, FreeRatio):
            faults.append(Fault(f"free.{name}", "must be a FreeRatio", type(free).__name__))
    raise_faults(faults)
    pairs = _pairs(study, wanted, drives)
    filled_parts, motors, families = FilledParts(study), dict[int, str](), dict[int, GearFamily]()
    known: dict[tuple[float, float, str | None], GearFamily] = {}
    for index, task in enumerate(study.joints):
        named = (wanted[task.name].motor if task.name in wanted else None) or pairs[task.name][0]
        motors[index] = braked_key(task, study.catalog, named)
        if motors[index] not in study.catalog.motors:
            hint = nearest(motors[index], study.catalog.motors)
            faults.append(Fault(f"joints.{task.name}.free_ratio.motor", "is not in the catalogue", motors[index], hint))
        elif task.name in wanted:
            free = wanted[task.name]
            families[index] = known.setdefault((free.low, free.high, free.series), _family(study, free))
    raise_faults(faults)
    fixed = {i: filled_parts.drive(t, *pairs[t.name]) for i, t in enumerate(study.joints) if i not in families}
    design = ArmDesign(workload(study), filled_parts, motors, families, fixed, goal)
    _check_known(design)
    return design


def _pairs(study: Study, wanted: Mapping[str, FreeRatio], drives: Mapping[str, Pair]) -> dict[str, Pair]:
    """A drive for every joint that needs one: the named one, the given one, or a selected one."""
    pairs = given_drives(study, drives, every=False)
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
    rows = [row for row in study.catalog.gears.values() if row.series == free.series and not row.staged]
    if not rows:
        known = {row.series for row in study.catalog.gears.values() if row.series}
        hint = nearest(free.series, known)
        raise InputError(Fault("series", "no gear of the catalogue has this series", free.series, hint))
    return fitted_family(free.series, rows, free.low, free.high)


def _check_known(design: ArmDesign) -> None:
    """Raise InputError if the goal cannot be computed from the data sheets."""
    setup, faults = design.setup(design.middle_ratios()), []
    for joint, task in enumerate(design.study.joints):
        if math.isnan(design.contribution(setup, joint)):
            lacks = torque_lacks(setup.drives[joint]) or "the continuous current"
            lacks = "the mass" if design.goal is Goal.MASS else lacks
            problem = f"the {design.goal} cannot be computed: {lacks} is unknown"
            hint = "complete the row, or state assumptions in the study"
            faults.append(Fault(f"joints.{task.name}", problem, hint=hint))
    raise_faults(faults)


def _joint(search: LineSearch, ratio: float) -> FreeJoint:
    """The result of one joint at its best ratio."""
    design, joint, allowed = search.design, search.joint, search.minimum()
    family = design.families[joint]
    sweep = np.geomspace(family.low, family.high, SWEEP_POINTS)
    result, setups = search.current.joint(joint), [search.setup(float(x)) for x in sweep]
    checks = checks_with_limits(result)
    binding, verdict = worst_of(checks), verdict_of(checks)
    least_rms = ratio_of_least_rms(terms_of(search.current, joint)) if result.torque_known else math.nan
    torque = [rms_torque(setup, joint) if setup.joint(joint).torque_known else math.nan for setup in setups]
    return FreeJoint(
        result.name, design.motors[joint], family, ratio, least_rms, allowed.low, allowed.high, allowed.ended_by,
        result.drive.gear, sweep, np.array([search.objective(float(x)) for x in sweep]), np.array(torque), verdict,
        binding.check, binding.utilisation, _catalogue_gears(search, ratio),
    )  # fmt: skip


def _catalogue_gears(search: LineSearch, ratio: float) -> tuple[CatalogueGear, ...]:
    """The catalogue's gears nearest in ratio, each in the place of the continuous gear."""
    design, joint, best, found = search.design, search.joint, search.objective(ratio), []
    rows = design.study.catalog.gears
    nearest_keys = sorted(_partners(design, joint), key=lambda key: (abs(math.log(abs(rows[key].ratio) / ratio)), key))
    for key in nearest_keys[:SHOWN_GEARS]:
        drive = design.filled_parts.drive(design.study.joints[joint], design.motors[joint], key)
        families = {index: family for index, family in design.families.items() if index != joint}
        fixed = {**design.fixed, joint: drive}
        setup = replace(design, families=families, fixed=fixed).setup(search.ratios)
        checks = setup.joint(joint).checks
        binding, excess = worst_of(checks), design.objective(setup) / best - 1.0 if best else math.nan
        verdict = verdict_of(checks)
        found.append(CatalogueGear(key, rows[key].ratio, excess, verdict, binding.check, binding.utilisation))
    return tuple(found)


def _partners(design: ArmDesign, joint: int) -> Sequence[str]:
    """Gears that may replace the continuous gear: those of its series, else those compatible with the motor."""
    rows, family, motor = design.study.catalog.gears, design.families[joint], design.motors[joint]
    paired = [gear for one, gear in design.study.joints[joint].pairs if one == motor and gear]
    among = paired or (gears_at(design.study.joints[joint], design.study.catalog) if family.laws else [])
    series = [key for key in among if rows[key].series == family.name]
    return series or partners(design.study, design.study.joints[joint], motor)


def _notes(design: ArmDesign, drives: Mapping[int, Drive]) -> tuple[str, ...]:
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
