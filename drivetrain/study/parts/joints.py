"""The joints of a study: drives or candidates, mounting, friction and amplifier of each joint of the arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import coupled_groups
from drivetrain.catalog.read import Catalog, FramelessRule, fits
from drivetrain.drive.amplifier import Amplifier, best_of, limits_of, to_dc
from drivetrain.drive.brake import Brake
from drivetrain.drive.counterbalance import Counterbalance, out_of_stroke, span_length
from drivetrain.drive.friction import FRICTIONLESS, Friction
from drivetrain.drive.gear import NO_GEAR, Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.stages import Chain, Stage, chained, with_stages
from drivetrain.errors import nearest
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.document import Place
from drivetrain.study.faults import Ledger
from drivetrain.study.form import Form, given, made, over
from drivetrain.study.model import ContainedDrive, DriveMass, FreeRatio, JointTask, Mount, Stop
from drivetrain.study.parts.candidates import Pair, candidate_pairs, known_pair, with_brakes
from drivetrain.study.parts.rules import CandidatesForm
from drivetrain.study.schema import DEFAULT, AmplifierForm, FreeRatioForm, JointForm, StudyForm

Found = tuple[tuple[tuple[str, str], ...], tuple[str, ...]]  # pairs, and texts on what was excluded
_AMPLIFIER_NEEDS = ("continuous_current", "peak_current", "min_voltage", "max_voltage")  # data for `amplifier: true`
_BRAKE_NEEDS = ("static_torque", "inertia", "power")  # data without which the checks of its drive cannot be made
_CONTAINED = "write contained: {mass: 0 kg} where the links hold no drive"


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What is needed to resolve a joint of the study."""

    form: StudyForm  # the study file
    arm: Arm | None  # the arm, if the study has one
    catalog: Catalog  # the rows
    ledger: Ledger  # takes faults and notes
    # rules that were applied before, with the remaining pairs
    found: list[tuple[CandidatesForm, Found]] = field(default_factory=list)
    brakes: set[str] = field(default_factory=set)  # keys of the brakes with which motors have been combined
    braked: dict[str, Motor] = field(default_factory=dict)  # motors combined with brakes, by key
    chains: dict[Chain, dict[str, str]] = field(default_factory=dict)  # keys of gears with stages, by gear key
    staged: dict[str, Gear] = field(default_factory=dict)  # gears combined with stages, by key


def resolve_joints(around: Surroundings, names: Sequence[str]) -> tuple[JointTask, ...]:
    """The tasks of all joints, without those that have faults in their entry."""
    forms, ledger = around.form.joints, around.ledger
    for name in forms:
        if names and name not in (*names, DEFAULT):
            ledger.fault(("joints", name), "is no joint", hint=nearest(name, [*names, DEFAULT]))
    tasks = []
    for index, name in enumerate(names):
        form = merged_joint(forms.get(name), forms.get(DEFAULT))
        place: Place = ("joints", name if name in forms else DEFAULT)
        if form is None:
            hint = "or give a joints.default for all of them"
            ledger.fault(("joints", name), "is missing: say what may drive this joint", hint=hint)
            continue
        tasks.append(_task(around, name, index, form, place))
    return tuple(tasks)


def merged_joint(own: JointForm | None, default: JointForm | None) -> JointForm | None:
    """The entry of a joint merged over the default one; None if there is neither.

    If the joint states a drive, the default's candidates are ignored; if it states candidates, the default's drive is.
    """
    if own is None or default is None:
        return own if default is None else default
    merged = over(own, default)
    if given(own, "drive") and not given(own, "candidates"):
        return merged.model_copy(update={"candidates": None})
    if given(own, "candidates") and not given(own, "drive"):
        return merged.model_copy(update={"drive": None})
    return merged


def _amplifiers(around: Surroundings, form: JointForm, place: Place) -> tuple[Amplifier, ...]:
    """The amplifier whose limits are stated, or rows of the catalogue by rising price, mass and continuous current."""
    stated, rows, ledger = form.amplifier, around.catalog.amplifiers, around.ledger
    place = (*place, "amplifier")
    if isinstance(stated, AmplifierForm) or stated is False:
        own, study = stated or AmplifierForm(), around.form.amplifier
        limits = _limits(study, study.current_basis, ledger, ("amplifier",))
        return (Amplifier(**limits | _limits(own, own.current_basis or study.current_basis, ledger, place)),)
    spoiled = ledger.spoiled(("catalogs",))
    for key in stated if isinstance(stated, tuple) and not spoiled else ():
        ledger.known(place, "no amplifier has this key", key, rows)
    whole = [row for row in rows.values() if None not in (getattr(row, name) for name in _AMPLIFIER_NEEDS)]
    found = [rows[key] for key in stated if key in rows] if isinstance(stated, tuple) else whole
    if not found and stated is True and not spoiled:
        ledger.fault(place, f"no amplifier of the catalogue has {', '.join(_AMPLIFIER_NEEDS)}")
    if len(found) > 1 and around.form.selection.holds is not None:
        ledger.fault(place, "must be a single one if selection.holds is given", [row.key for row in found])
    order = ("price", "mass", "continuous_current")
    found.sort(key=lambda row: [math.inf if (value := getattr(row, name)) is None else value for name in order])
    return tuple(map(limits_of, found)) or (Amplifier(),)


def _limits(form: AmplifierForm, basis: str | None, ledger: Ledger, place: Place) -> dict[str, Any]:
    """The limits that an entry states, with currents as DC equivalents [A]."""
    plain = (
        "modulation", "standby_power", "on_resistance", "peak_time", "thermal_time_constant", "min_voltage",
        "max_voltage",
    )  # fmt: skip
    found: dict[str, Any] = {name: value for name in plain if (value := getattr(form, name)) is not None}
    if basis is not None:
        found["current_basis"] = str(basis)
    for name in ("peak_current", "continuous_current"):
        current = getattr(form, name)
        if current is not None and basis is None:
            problem = "needs current_basis beside it: dc, rms or peak; they differ by up to 41 %, so it is not guessed"
            ledger.fault((*place, name), problem)
        elif current is not None and basis is not None:
            found[name] = to_dc(current, basis)
    return found


def resolve_stop(around: Surroundings, form: JointForm, place: Place) -> Stop:
    """The stop of a joint: its own values over those of the study; the current is converted to its DC equivalent."""
    own, study = form.stop, around.form.stop
    both = study if own is None else over(own, study) if isinstance(study, Form) else own
    stop: Stop = made(both)
    if stop.current is None:
        return stop
    stated = [one for one in (form.amplifier, around.form.amplifier) if isinstance(one, AmplifierForm)]
    basis = next((one.current_basis for one in stated if one.current_basis is not None), None)
    if basis is None:
        problem = "needs amplifier.current_basis: dc, rms or peak; they differ by up to 41 %, so it is not guessed"
        where = (*place, "stop") if own is not None and given(own, "current") else ("stop",)
        hint = "beside amplifiers of the catalogue: amplifier: {current_basis: rms} at the top of the study"
        around.ledger.fault((*where, "current"), problem, hint=hint)
        return stop
    return replace(stop, current=to_dc(stop.current, basis))


def _task(around: Surroundings, name: str, index: int, form: JointForm, place: Place) -> JointTask:
    ledger = around.ledger
    drive = _drive(around, name, form, place)
    pairs: tuple[tuple[str, str], ...] = ()
    passed_over: tuple[str, ...] = ()
    if form.candidates is not None:
        pairs, passed_over = _candidates(around, form.candidates, (*place, "candidates"))
    elif form.drive is None and (form.free_ratio is None or form.free_ratio.motor is None):
        hint = "drive: {motor: ..., gear: ...}, or candidates: {} for all parts of the catalogues"
        ledger.fault(place, "has neither a drive nor candidates", hint=hint)
    friction: Friction | None = ledger.attempt((*place, "friction"), made, form.friction)
    motor_friction: Friction | None = ledger.attempt((*place, "motor_friction"), made, form.motor_friction)
    amplifiers = _amplifiers(around, form, place)
    stop = resolve_stop(around, form, place)
    if around.arm is not None:
        _unmarched_faults(around, index, form, place, stop)
        if form.load_inertia is not None:
            problem = "is for studies without an arm: an arm's inertia is computed from its links"
            ledger.fault((*place, "load_inertia"), problem)
    _check_second_motor(around, form, place)
    brakes, brake_note = _brakes(around, form, (*place, "brake"))
    if brakes:
        given = () if drive is None else _with_brakes(around, (drive,), brakes)
        left_open = len(given) > 1  # one motor and gear, and the choice of its brake
        pairs = given if left_open else _with_brakes(around, pairs, brakes)
        drive, passed_over = None if left_open or not given else given[0], (*passed_over, *brake_note)
    stages: list[Stage | None] = [ledger.attempt((*place, "stages", k), made, one) for k, one in enumerate(form.stages)]
    chain = ledger.attempt((*place, "stages"), chained, stages) if stages and None not in stages else None
    staged = {} if chain is None else _with_stages(around, name, chain)
    if staged:
        pairs = tuple((motor, staged[gear]) for motor, gear in pairs)
        drive = None if drive is None else (drive[0], staged[drive[1]])
    if motor_friction is not None and motor_friction.load_share:
        problem = "applies only to the friction of the joint: the gear has efficiencies"
        ledger.fault((*place, "motor_friction", "load_share"), problem)
    return JointTask(
        name=name,
        drive=drive,
        pairs=pairs,
        passed_over=passed_over,
        mount=_mount(around, index, form.mount, (*place, "mount")),
        contained=_contained(around, index, form, place),
        friction=friction or FRICTIONLESS,
        motor_friction=motor_friction,
        amplifier=amplifiers[0] if len(amplifiers) == 1 else best_of(amplifiers),
        amplifiers=amplifiers if len(amplifiers) > 1 else (),
        travel_per_turn=_travel(around, index, form, place, chain),
        housing_to_ambient=form.housing_to_ambient,
        output_bearing=form.output_bearing if chain is None and form.motors == 1 else "external",
        stop=stop,
        gear_heat=around.form.gear_heat if form.gear_heat is None else form.gear_heat,
        amplifier_heat=form.amplifier_heat,
        staged=staged,
        coupled=() if around.arm is None else tuple(around.arm.joint_names[i] for i in _group(around.arm, index)),
        rules=form.candidates,
        free_ratio=resolve_free_ratio(form.free_ratio, around.catalog, ledger, (*place, "free_ratio")),
        load_inertia=form.load_inertia,
        brakes=brakes,
        counterbalances=_counterbalances(around, index, form, place),
        preload=None if form.motors == 1 else form.preload or 0.0,
    )


def _unmarched_faults(around: Surroundings, index: int, form: JointForm, place: Place, stop: Stop) -> None:
    """Report what a joint lacks that closed loops, a moving base or two motors on an axis require."""
    arm, ledger = around.arm, around.ledger
    assert arm is not None
    loops, moves = None if arm.linkage is None else arm.linkage.loops, around.form.base is not None
    on_gear = form.output_bearing == "gear" and not arm.slides[index]
    if loops is not None and loops.inside(loops.driven[index]) and on_gear:
        problem = f"must be external at {arm.joint_names[index]}: how pins and bearings share the loads in a loop is "
        problem += "not determined, so a gear's bearing cannot be checked there"
        ledger.fault((*place, "output_bearing"), problem)
    if moves and form.mount.carrier == "base":
        problem = "must be parent or child with a base that moves: drives mounted on such a base are not computed"
        ledger.fault((*place, "mount", "carrier"), problem, form.mount.carrier, "parent")
    if not moves and all(one.motors == 1 for one in around.form.joints.values()):
        return
    named = "a base that moves" if moves else "two motors on one axis"
    if form.brake and stop.power_off:
        problem = f"must be false with {named}: the fall of such an arm until the brakes engage is not computed"
        ledger.fault((*place, "stop", "power_off"), problem)
    if stop.ramp is None:
        problem = f"is missing: with {named} a stop is checked along a ramp, not at the limit of a current"
        ledger.fault((*place, "stop", "ramp"), problem, hint="stop: {ramp: 0.3 s}")


def _check_second_motor(around: Surroundings, form: JointForm, place: Place) -> None:
    """Report entries of a joint that are not allowed with two motors on its axis."""
    arm, ledger = around.arm, around.ledger
    if form.motors == 1:
        if form.preload is not None:
            ledger.fault((*place, "preload"), "requires two motors on the axis", hint="add motors: 2")
        return
    beside = {
        "closures": around.form.closures,
        "a base that moves": around.form.base,
        "coupled joints": arm is not None and arm.coupling is not None,
        "a free_ratio": form.free_ratio,
    }
    for what in (name for name, there in beside.items() if there):
        ledger.fault((*place, "motors"), f"must be 1 with {what}: two on one axis are not computed there", form.motors)
    if form.mount.carrier == "child":
        ledger.fault((*place, "mount", "carrier"), "must be parent or base for two motors on one axis", "child")


def _brakes(around: Surroundings, form: JointForm, place: Place) -> tuple[tuple[Brake, ...], tuple[str, ...]]:
    """The brakes that may hold a joint, and texts on how many of the catalogue were excluded."""
    rows, ledger = around.catalog.brakes, around.ledger
    found: list[Brake] = []
    keys = form.brake if isinstance(form.brake, tuple) else tuple(rows) if form.brake else ()
    chosen = form.brake is True
    for key in keys:
        brake = rows.get(key)
        if brake is None:
            if not ledger.spoiled(("catalogs",)) and not ledger.spoiled(("brakes",)):
                ledger.fault(place, "no brake has this key", key, nearest(key, rows))
            continue
        lacks = [name for name in _BRAKE_NEEDS if getattr(brake, name) is None]
        if brake.torque_side == "motor" and not lacks:
            found.append(brake)
        elif not chosen and lacks:
            ledger.fault(place, f"this brake's row lacks {', '.join(lacks)}", key, "give it a row under `brakes`")
        elif not chosen:
            ledger.fault(place, "acts at the output: only brakes at the motor's shaft are checked", key)
    if chosen and not found and not ledger.spoiled(("catalogs",)):
        problem = f"no brake of the catalogue acts at the motor and has {', '.join(_BRAKE_NEEDS)}"
        ledger.fault(place, problem, hint="give it a row under `brakes`, or add `shipped` to `catalogs`")
    text = (
        f"brakes: {len(found)} of {len(keys)} considered, the others lack {', '.join(_BRAKE_NEEDS).replace('_', ' ')}"
    )
    return tuple(found), (text,) if chosen else ()


def _counterbalances(around: Surroundings, index: int, form: JointForm, place: Place) -> tuple[Counterbalance, ...]:
    place, ledger = (*place, "counterbalances"), around.ledger
    if form.counterbalances and around.arm is not None and around.arm.slides[index]:
        ledger.fault(place, "apply only to a revolute joint")
    found = [ledger.attempt((*place, k), made, entry) for k, entry in enumerate(form.counterbalances)]
    return tuple(one for one in found if one is not None)


def _with_stages(around: Surroundings, name: str, chain: Chain) -> dict[str, str]:
    """Keys of all gears combined with the stages of a joint, by gear key; they are unique for each chain of stages."""
    if chain not in around.chains:
        keys = around.chains[chain] = {}
        for gear, own in {"": NO_GEAR, **around.catalog.gears}.items():
            row = with_stages(own, chain)
            if row.key in around.staged:
                row = replace(row, key=f"{row.key}@{name}")
            around.staged[row.key], keys[gear] = row, row.key
    return around.chains[chain]


def check_gas_springs(joints: Sequence[JointTask], cycle: Cycle | None, ledger: Ledger) -> None:
    """Report gas springs whose length in the cycle leaves their range from compressed to extended."""
    if cycle is None:
        return
    for i, task in enumerate(joints):
        for k, one in enumerate(task.counterbalances):
            if out_of_stroke(one, cycle.position[:, i]).any():
                length = span_length(one, cycle.position[:, i])
                low, high = float(length.min()), float(length.max())
                problem = f"goes from {one.extended_length - one.stroke:.4g} to {one.extended_length:.4g} m"
                value, place = f"{low:.4g} to {high:.4g} m in the cycle", ("joints", task.name, "counterbalances", k)
                ledger.fault(place, problem, value, "another extended_length, stroke or levers")


def _with_brakes(around: Surroundings, pairs: Sequence[Pair], brakes: Sequence[Brake]) -> tuple[Pair, ...]:
    """All combinations of the pairs with the brakes; every other motor may be tried with them too."""
    new = [brake for brake in brakes if brake.key not in around.brakes]
    around.braked.update(with_brakes(around.catalog, [(motor, "") for motor in around.catalog.motors], new)[1])
    around.brakes.update(brake.key for brake in new)
    return with_brakes(around.catalog, pairs, brakes)[0]


def _candidates(around: Surroundings, form: CandidatesForm, place: Place) -> Found:
    """The pairs that may be chosen; joints with the same rules share one list."""
    for rules, found in around.found:
        if rules == form:
            return found
    before = len(around.ledger.faults)
    found = around.ledger.attempt(place, candidate_pairs, form, around.catalog, around.ledger, place) or ((), ())
    if len(around.ledger.faults) == before:
        around.found.append((form, found))
    return found


def _drive(around: Surroundings, name: str, form: JointForm, place: Place) -> tuple[str, str] | None:
    """The keys of a given drive; an unpublished pair is allowed with a note."""
    if form.drive is None:
        return None
    pair = known_pair(form.drive, around.catalog, around.ledger, (*place, "drive"))
    if pair is None or not pair[1]:
        return pair
    motor, gear = pair
    published = gear in around.catalog.pairs.get(motor, ())
    own = motor in around.form.motors or gear in around.form.gears
    inside = fits(around.catalog.motors[motor], around.catalog.gears[gear], FramelessRule())
    if not (published or own or inside):
        around.ledger.note([f"{name}: {motor} with {gear} is not published as fitting; check flange, shaft and size."])
    return pair


def _mount(around: Surroundings, index: int, form: Mount, place: Place) -> Mount:
    """Where a drive is mounted; ``group`` becomes the link before the first joint of its group."""
    if form.carrier != "group":
        return Mount(form.carrier, form.offset)
    group = () if around.arm is None else _group(around.arm, index)
    if around.arm is not None and not group:
        ledger, hint = around.ledger, "parent: the link before the joint"
        ledger.fault((*place, "carrier"), "applies only to a joint that `coupling` names", form.carrier, hint)
    return Mount("parent", form.offset, group[0] if group else None)


def _group(arm: Arm, index: int) -> tuple[int, ...]:
    """Indices of the joints that are coupled with a joint, itself included; empty if its motor drives it alone."""
    return next((group for group in coupled_groups(arm) if index in group), ())


def _contained(around: Surroundings, index: int, form: JointForm, place: Place) -> ContainedDrive | None:
    """The drive that the links contain; required with ``drive_mass: replaced``, a fault otherwise."""
    replaced = around.form.drive_mass == DriveMass.REPLACED
    if form.contained is None:
        if replaced:
            problem = "is missing: drive_mass replaced must know what the links hold at this joint"
            around.ledger.fault((*place, "contained"), problem, hint=_CONTAINED)
        return None
    if not replaced and around.form.drive_mass is not None:
        problem = f"applies only to drive_mass: replaced, but the study says {around.form.drive_mass}"
        around.ledger.fault((*place, "contained"), problem)
    mount = _mount(around, index, form.contained.mount, (*place, "contained", "mount"))
    contained: ContainedDrive = form.contained.made(mount=mount)
    return contained


def _travel(around: Surroundings, index: int, form: JointForm, place: Place, chain: Chain | None) -> float | None:
    """Travel per radian of the gear's output [m/rad]: required at a prismatic joint, a fault at any other."""
    slides = around.arm is not None and around.arm.slides[index]
    travel, own = form.travel_per_turn, None if chain is None else chain.travel
    if own is not None and (travel is not None or not slides):
        sliding = "say what the joint travels: travel_per_turn is then not needed"
        turning = "contain a sliding one, but the joint turns"
        around.ledger.fault((*place, "stages"), sliding if slides else turning)
    travel = own or travel
    if around.arm is not None and slides and not travel and not around.ledger.spoiled((*place, "stages")):
        problem = "must not be 0" if travel == 0.0 else "is missing"
        joint = around.arm.joint_names[index]
        hint = f"joint {joint} is prismatic: such as 10 mm/rev, or a screw, belt or rack under `stages`"
        around.ledger.fault((*place, "travel_per_turn"), problem, hint=hint)
    stated = given(around.form.joints[str(place[1])], "travel_per_turn")  # the default is for those joints that slide
    if stated and not slides and place[1] != DEFAULT:
        around.ledger.fault((*place, "travel_per_turn"), "applies only to a prismatic joint of an arm")
    return travel if slides else None


def resolve_free_ratio(form: FreeRatioForm | None, catalog: Catalog, ledger: Ledger, place: Place) -> FreeRatio | None:
    """The free ratio of a joint; None if the study states none, or after a fault."""
    if form is None:
        return None
    low, high = form.ratio
    if low is None or high is None or not 0.0 < low < high:
        ledger.fault((*place, "ratio"), "needs a smaller and a larger positive ratio, such as [30, 160]")
        return None
    if form.series is not None and not ledger.spoiled(("catalogs",)):
        series = {row.series for row in catalog.gears.values() if row.series}
        ledger.known((*place, "series"), "no gear of the catalogue has this series", form.series, series)
    if form.motor is not None and not ledger.spoiled(("catalogs",)):
        ledger.known((*place, "motor"), "no motor has this key", form.motor, catalog.motors)
    free: FreeRatio = form.made(low=low, high=high)
    return free
