"""The motions of a study, and the cycle or the mix of cycles that they make."""

from __future__ import annotations

import math
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any, Literal

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import moving_base
from drivetrain.arm.tool_moves import Move, ToolLimits, tool_motion
from drivetrain.arrays import Array
from drivetrain.errors import InputError
from drivetrain.motion.base import AXES, Swing, harmonic_instants, harmonic_motion, with_base_samples
from drivetrain.motion.checks import PLAUSIBLE_ANGLE, limit_notes
from drivetrain.motion.duty_cycle import GAP_ALLOWED, Cycle, Step, build_cycle, build_mix, share_faults
from drivetrain.motion.motion import LoadTable, Motion, sampled
from drivetrain.motion.point_to_point import MotionLimits, waypoint_motion
from drivetrain.motion.profiles import PROFILES
from drivetrain.motion.read import read_load_table, read_motion
from drivetrain.motion.smoothing import Parabolas, SavitzkyGolay, Smoothing
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation, rotation_from_rpy, unit
from drivetrain.spatial.tool_path import rotations
from drivetrain.study.document import Place
from drivetrain.study.faults import Ledger
from drivetrain.study.form import made, over
from drivetrain.study.model import ProcessForce
from drivetrain.study.parts.forces import force_of_step
from drivetrain.study.schema import DEFAULT, CycleForm, MixForm, MotionForm, MoveForm, PoseForm, StudyForm
from drivetrain.units import quantity

KINDS: dict[str, frozenset[str]] = {
    "file": frozenset({"smoothing"}),
    "table": frozenset(),
    "samples": frozenset({"smoothing"}),
    "waypoints": frozenset({"unit", "profile", "speed", "acceleration", "jerk", "durations", "dwell"}),
    "moves": frozenset({"start", "tool", "unit", "profile", "speed", "acceleration", "jerk"}),
}  # entries allowed with each kind of motion

Motions = dict[str, Motion | LoadTable]
Forces = dict[str, ProcessForce]

LIMITS = {
    "speed": ("rad/s", "m/s"),
    "acceleration": ("rad/s^2", "m/s^2"),
    "jerk": ("rad/s^3", "m/s^3"),
}  # units for a revolute and for a prismatic joint
MOVES: tuple[Literal["joints", "to", "line", "circle"], ...] = ("joints", "to", "line", "circle")
LONGEST_MOVE = 3600.0  # [s]; a longer move is taken for an error of units, as moves are sampled every few milliseconds


def resolve_motions(form: StudyForm, arm: Arm | None, ledger: Ledger) -> Motions:
    """All motions of a study, checked against the arm's joint ranges; without an arm, load tables."""
    motions: Motions = {}
    default = form.motions.get(DEFAULT, MotionForm())
    stray = sorted(default.model_fields_set - ((KINDS["waypoints"] | KINDS["moves"]) - {"durations", "start"}))
    if stray:
        ledger.fault(("motions", DEFAULT, stray[0]), "is for one motion, not for all of them")
    for name, own in form.motions.items():
        place: Place = ("motions", name)
        kind = "" if name == DEFAULT else _kind(own, ledger, place)
        if not kind or not _belongs(kind, ledger, place):
            continue
        loads = kind == "table" or "arm" not in ledger.document.data
        motion = _load_table(name, own, ledger) if loads else _motion(name, own, default, arm, ledger, place)
        if motion is not None:
            motions[name] = motion
    if not set(form.motions) - {DEFAULT}:
        ledger.fault(("motions",), "must have at least one motion")
    return motions


def resolve_cycle(form: StudyForm, arm: Arm | None, motions: Motions, forces: Forces, ledger: Ledger) -> Cycle | None:
    """The repeated task; None when it cannot be built."""
    if form.mix is not None:
        cycle = _mix(form, form.mix, arm, motions, forces, ledger)
    else:
        entries = form.cycle
        if entries is None:
            entries = _only_motion(form, ledger)
        elif not entries:
            ledger.fault(("cycle",), "must have at least one motion")
        cycle = _cycle(form, entries, ("cycle",), arm, motions, forces, ledger)
    run = [entry for part in form.mix for entry in part.cycle] if form.mix is not None else form.cycle
    if run is not None:
        unused = {name for name in form.motions if name != DEFAULT} - {entry.motion for entry in run}
        if unused:
            ledger.note([f"warning: motions that the cycle does not run: {', '.join(sorted(unused))}"])
    if cycle is not None:
        ledger.note(note for note in cycle.notes if note.startswith("warning:"))
    return cycle


def resolve_base(
    form: StudyForm, arm: Arm | None, cycle: Cycle | None, ledger: Ledger
) -> tuple[Motion | None, Cycle | None]:
    """The motion of the base at the samples of the cycle, and the cycle with as many samples as that needs."""
    stated = form.base
    if stated is None:
        return None, cycle
    known = len(ledger.faults)
    if form.arm is None:
        ledger.fault(("base",), "applies only to an arm: load tables already hold what each gear must give")
    for name in ("closures", "mix"):
        if getattr(form, name):
            ledger.fault(("base",), f"cannot be combined with {name}")
    swings: dict[str, Swing] = {axis: made(one) for axis in AXES if (one := getattr(stated, axis))}
    motion: Motion | None = None
    if stated.motion is not None and arm is not None and _kind(stated.motion, ledger, ("base", "motion")):
        motion = _motion("base", stated.motion, MotionForm(), moving_base(arm), ledger, ("base", "motion"))
    if arm is None or cycle is None or len(ledger.faults) > known:
        return None, cycle
    if motion is None:
        motion = harmonic_motion(swings, harmonic_instants(swings, cycle.duration))
    else:
        length = float(motion.time[-1] - motion.time[0])
        if abs(length - cycle.duration) > GAP_ALLOWED * cycle.duration:
            ledger.fault(("base", "motion"), f"lasts {length:.6g} s, but the cycle {cycle.duration:.6g} s", length)
            return None, cycle
        motion = replace(motion, time=(motion.time - motion.time[0]) * (cycle.duration / length))
    if not form.open_cycle:
        _check_return(motion, swings, cycle.duration, ledger)
    cycle, motion = with_base_samples(cycle, motion)
    text = ", ".join(f"{axis} by {one.amplitude:.4g} {'m' if axis in 'xyz' else 'rad'} in {one.period:g} s"
                     for axis, one in swings.items())  # fmt: skip
    ledger.note([f"The base of the arm moves as given{f': {text}' if text else ''}; the drives are judged against the "
                 "phase in which it then meets the cycle."])  # fmt: skip
    return harmonic_motion(swings, cycle.time) if swings else motion, cycle


def _check_return(motion: Motion, swings: dict[str, Swing], duration: float, ledger: Ledger) -> None:
    """Report a base whose state at the end of the cycle differs from the start, apart from its place on the ground."""
    gaps = np.abs([motion.position[-1] - motion.position[0], motion.velocity[-1] - motion.velocity[0]])
    gaps[0, :3] = 0.0
    for at in np.flatnonzero(gaps.max(axis=0) > GAP_ALLOWED):
        axis, hint = AXES[at], "or open_cycle: true, for a task done once"
        if axis in swings:
            rest = f"the cycle lasts {duration:.6g} s, the period is {swings[axis].period:g} s"
            hint = f"repetitions or dwells in the cycle, until it lasts whole periods; {rest}"
        problem = f"{axis} ends the cycle otherwise than it begins it, by {gaps[:, at].max():.4g} [m or rad, or per s]"
        ledger.fault(("base",), problem, hint=hint)


def _mix(
    form: StudyForm, parts: list[MixForm], arm: Arm | None, motions: Motions, forces: Forces, ledger: Ledger
) -> Cycle | None:
    """Several cycles with their shares of use; None after a fault."""
    if form.cycle is not None:
        ledger.fault(("mix",), "cannot stand beside cycle", hint="make the cycle one part of the mix")
    if not parts:
        ledger.fault(("mix",), "must have at least one part")
    shares = [part.share for part in parts]
    for fault in share_faults(shares):
        ledger.fault(("mix", len(parts) - 1, "share"), fault.problem, fault.value, fault.hint)
    names = [part.name or f"part {i + 1}" for i, part in enumerate(parts)]
    for i, name in enumerate(names):
        if name in names[:i]:
            ledger.fault(("mix", i, "name"), "is given twice in the mix", name)
    cycles = [
        _cycle(form, part.cycle, ("mix", i, "cycle"), arm, motions, forces, ledger) for i, part in enumerate(parts)
    ]
    ready = [cycle for cycle in cycles if cycle is not None]
    if not parts or len(ready) < len(parts) or ledger.spoiled(("mix",)):
        return None
    return ledger.attempt(("mix",), build_mix, ready, shares, names=names)


def _cycle(
    form: StudyForm, entries: list[CycleForm], place: Place, arm: Arm | None, motions: Motions, forces: Forces,
    ledger: Ledger,
) -> Cycle | None:  # fmt: skip
    """One cycle from its list of steps; None after a fault."""
    known = len(ledger.faults)
    names = [name for name in form.motions if name != DEFAULT]
    # Payloads and forces with faults are reported elsewhere.
    stated = (ledger.document.data.get(section) for section in ("payloads", "forces"))
    payloads, pressing = (list(names) if isinstance(names, dict) else [] for names in stated)
    for i, entry in enumerate(entries):
        if entry.motion is not None:
            ledger.known((*place, i, "motion"), "is no motion of this study", entry.motion, names)
        if entry.payload is not None:
            ledger.known((*place, i, "payload"), "is no payload of this study", entry.payload, payloads)
        if entry.force is not None:
            ledger.known((*place, i, "force"), "is no force of this study", entry.force, pressing)
    ready = all(entry.motion is None or entry.motion in motions for entry in entries)
    ready = ready and all(entry.force is None or entry.force in forces for entry in entries)
    if not entries or not ready or len(ledger.faults) > known:
        return None
    with ledger.gather(place):
        steps: list[Step] = [
            one.made(motion=motions.get(one.motion or ""), force=force_of_step(arm, forces.get(one.force or "")))
            for one in entries
        ]
        return build_cycle(steps, may_stay_open=form.open_cycle, slides=None if arm is None else arm.slides)
    return None


def _only_motion(form: StudyForm, ledger: Ledger) -> list[CycleForm]:
    """The cycle of a study that states none: its only motion."""
    names = [name for name in form.motions if name != DEFAULT]
    if len(names) != 1 or len(form.payloads) > 1 or len(form.forces) > 1:
        choice = "motions" if len(names) > 1 else "payloads" if len(form.payloads) > 1 else "forces"
        if names:
            beside = "force: push" if choice == "forces" else "payload: part"
            problem = f"is missing: with several {choice} the study must say in which order they come"
            ledger.fault(("cycle",), problem, hint=f"such as a list of {{motion: pick, {beside}}}")
        return []
    return [CycleForm(motion=names[0], payload=next(iter(form.payloads), None), force=next(iter(form.forces), None))]


def _kind(own: MotionForm, ledger: Ledger, place: Place) -> str:
    """The kind of a motion (an entry of ``KINDS``); empty after a fault."""
    kinds = [name for name in KINDS if getattr(own, name) is not None]
    if len(kinds) != 1:
        ledger.fault(place, f"must have one of: {', '.join(KINDS)}", ", ".join(kinds) or None)
        return ""
    stray = sorted(own.model_fields_set - {kinds[0]} - KINDS[kinds[0]])
    for name in stray:
        ledger.fault((*place, name), f"cannot be combined with {kinds[0]}")
    return "" if stray else kinds[0]


def _belongs(kind: str, ledger: Ledger, place: Place) -> bool:
    """Whether a kind of motion fits the study, else a fault: joint motions need an arm, load tables exclude one."""
    has_arm = "arm" in ledger.document.data
    if kind == "table" and has_arm:
        ledger.fault((*place, "table"), "is for studies without an arm: the arm decides the torques")
        return False
    if kind not in ("table", "samples") and not has_arm:
        ledger.fault((*place, kind), "needs an arm", hint="or a table of torque and speed: {table: load.csv}")
        return False
    return True


def _load_table(name: str, own: MotionForm, ledger: Ledger) -> LoadTable | None:
    source, kind = _source(own, ledger)
    with ledger.gather(("motions", name, kind)):
        return sampled(read_load_table(source, name=name))
    return None


def _source(own: MotionForm, ledger: Ledger) -> tuple[Path | StringIO, str]:
    """The file or text that samples are read from, and the name of its entry."""
    if own.samples is not None:
        return StringIO(own.samples), "samples"
    return ledger.document.folder / (own.file or own.table or ""), "file" if own.file else "table"


def _motion(
    name: str, own: MotionForm, default: MotionForm, arm: Arm | None, ledger: Ledger, place: Place
) -> Motion | None:
    """A motion of joints, checked against the arm's joint ranges."""
    if arm is None:
        return None
    if own.waypoints is not None:
        motion = resolve_waypoints(name, over(own, default), arm, ledger, place)
    elif own.moves is not None:
        motion = _moves(name, over(own, default), arm, ledger, place)
    else:
        units = ["m" if slides else "rad" for slides in arm.slides]
        source, kind = _source(own, ledger)
        motion = ledger.attempt(
            (*place, kind), read_motion, source, arm.joint_names,
            smoothing=_smoothing(own), position_units=units, name=name,
        )  # fmt: skip
    if motion is not None:
        _hold_against(motion, arm, ledger, place)
    return motion


def _smoothing(own: MotionForm) -> Smoothing | None:
    """Smoothing by the window that the entry states: None by the resolution of the file, 0 s none."""
    if own.smoothing is None:
        return None
    return SavitzkyGolay(own.smoothing) if own.smoothing > 0.0 else Parabolas()


def _hold_against(motion: Motion, arm: Arm, ledger: Ledger, place: Place) -> None:
    """Report positions outside the joint ranges as faults, and speeds above the joints' limits as warnings."""
    found = limit_notes(motion, arm.lower, arm.upper, arm.speed_limits, name=motion.name, slides=arm.slides)
    for fault in found.faults:
        believed = PLAUSIBLE_ANGLE * (math.degrees(1.0) if "[deg]" in fault.problem else 1.0)
        slip = isinstance(fault.value, float) and abs(fault.value) > believed
        hint = "check the unit: degrees given as rad, mm as m?" if slip else ""
        ledger.faults.append(ledger.document.fault(place, f"{fault.place}: {fault.problem}", fault.value, hint))
    ledger.note(found.warnings)


def resolve_waypoints(name: str, form: MotionForm, arm: Arm, ledger: Ledger, place: Place) -> Motion | None:
    """The motion through the waypoints; None after a fault."""
    known = len(ledger.faults)
    rows = [_row(row, form, arm, ledger, (*place, "waypoints", i)) for i, row in enumerate(form.waypoints or [])]
    points = np.array([row for row in rows if row is not None]).reshape(-1, arm.n)
    limits = _limits(form, arm, ledger, place)
    dwell = _dwell(form.dwell, len(rows), ledger, (*place, "dwell"))
    durations = form.durations
    _check_profile(form, ledger, place)
    if len(rows) < 2:
        ledger.fault((*place, "waypoints"), "must be at least two rows")
    if durations is not None and len(durations) != len(rows) - 1:
        problem = f"must be {len(rows) - 1} times, one for each move between the {len(rows)} waypoints"
        ledger.fault((*place, "durations"), problem, len(durations))
    if len(ledger.faults) > known or form.profile is None:
        return None
    if _takes_too_long(points, limits, durations):
        problem = f"has a move of more than {LONGEST_MOVE:g} s: too long to be sampled"
        ledger.fault(place, problem, hint="check its units")
        return None
    return ledger.attempt(
        place, waypoint_motion, name, arm.joint_names, points, profile=PROFILES[form.profile], durations=durations,
        limits=MotionLimits(**limits) if limits else None, dwell=dwell,
    )  # fmt: skip


def _check_profile(form: MotionForm, ledger: Ledger, place: Place) -> None:
    """Add a fault for a motion without a profile; if that of all motions is wrong, its fault is enough."""
    if form.profile is None and not ledger.spoiled(("motions", DEFAULT, "profile")):
        ledger.fault((*place, "profile"), f"is missing: {', '.join(PROFILES)}")


def _moves(name: str, form: MotionForm, arm: Arm, ledger: Ledger, place: Place) -> Motion | None:
    """The motion through moves of joints and tool; None after a fault."""
    known = len(ledger.faults)
    limits = _limits(form, arm, ledger, place)
    start = None if form.start is None else _row(form.start, form, arm, ledger, (*place, "start"))
    if form.start is None:
        ledger.fault((*place, "start"), "is missing: joint positions before the first move, which choose the posture")
    _check_profile(form, ledger, place)
    if not form.moves:
        ledger.fault((*place, "moves"), "must have at least one move")
    tool = form.tool
    if tool is not None and tool.at is not None:
        arm = replace(arm, tip=arm.tip @ _pose(tool.at))
    moves = [_move(one, form, arm, ledger, (*place, "moves", i)) for i, one in enumerate(form.moves or [])]
    if len(ledger.faults) > known or start is None or form.profile is None:
        return None
    own = {} if tool is None else {what: getattr(tool, what) for what in tool.model_fields_set - {"at"}}
    return ledger.attempt(
        place, tool_motion, name, arm, start, [move for move in moves if move is not None],
        profile=PROFILES[form.profile], limits=MotionLimits(**limits), tool=ToolLimits(**own),
    )  # fmt: skip


def _move(form: MoveForm, motion: MotionForm, arm: Arm, ledger: Ledger, place: Place) -> Move | None:
    kind = next(kind for kind in MOVES if getattr(form, kind) is not None)
    target: Any = getattr(form, kind)
    if kind == "joints":
        target = _row(target, motion, arm, ledger, (*place, "joints"))
        if target is None:
            return None
    else:
        still = target.rpy is target.quaternion is target.axis_angle is None
        target = np.array(target.position) if still else _pose(target)
    move: Move = form.made(kind=kind, target=target)
    return move


def _pose(form: PoseForm) -> Array:
    """The pose that a form states, (4, 4); without a rotation, that of the base frame."""
    rotation = np.eye(3)
    if form.rpy is not None:
        rotation = rotation_from_rpy(form.rpy)
    elif form.quaternion is not None:
        rotation = rotations(np.array(form.quaternion)[None] / math.hypot(*form.quaternion))[0]
    elif form.axis_angle is not None:
        rotation = exp_rotation(form.axis_angle.angle * unit(form.axis_angle.axis))
    return pose(rotation, form.position)


def _row(row: Any, form: MotionForm, arm: Arm, ledger: Ledger, place: Place) -> list[float] | None:
    """One waypoint with one value per joint, in SI; bare numbers have the unit of the entry."""
    n = arm.n
    if not isinstance(row, list) or len(row) != n:
        found = f"{len(row)} values" if isinstance(row, list) else row
        ledger.fault(place, f"must be a list of {n} values, one for each of {', '.join(arm.joint_names)}", found)
        return None
    units = form.unit or ()
    if len(units) not in (0, 1, n):
        ledger.fault((*place[:2], "unit"), f"must be one unit, or {n}: one a joint", len(units))
        return None
    values = []
    for i, (value, slides) in enumerate(zip(row, arm.slides, strict=True)):
        unit = units[i % len(units)] if units else ""
        values.append(_value(value, unit, "m" if slides else "rad", ledger, (*place, i)))
    return None if any(value is None for value in values) else [float(value) for value in values if value is not None]


def _value(value: Any, unit: str, wanted: str, ledger: Ledger, place: Place) -> float | None:
    """A quantity in SI; a bare number has the unit of the entry."""
    bare = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        return quantity(f"{value} {unit}" if bare and unit else value, wanted, "")
    except InputError as error:
        fault = error.faults[0]
        hint = fault.hint or ("or give the motion a unit: deg" if bare and not unit and "/" not in wanted else "")
        ledger.fault(place, fault.problem, value, hint)
        return None


def _limits(form: MotionForm, arm: Arm, ledger: Ledger, place: Place) -> dict[str, Array]:
    """The limits of each joint that a motion states, (n,) each; those with faults are left out."""
    found = {what: _limit(getattr(form, what), what, arm, ledger, (*place, what)) for what in LIMITS}
    return {what: limit for what, limit in found.items() if limit is not None}


def _limit(value: Any, what: str, arm: Arm, ledger: Ledger, place: Place) -> Array | None:
    """A limit of each joint, (n,); None if it is not stated, or after a fault."""
    if value is None:
        return None
    n = arm.n
    listed = value if isinstance(value, list) else [value] * n
    if len(listed) != n:
        ledger.fault(place, f"must be one limit for all joints, or {n}: one a joint", f"{len(listed)} limits")
        return None
    limits = []
    for i, (entry, slides) in enumerate(zip(listed, arm.slides, strict=True)):
        inner = (*place, i) if isinstance(value, list) else place
        limits.append(_value(entry, "", LIMITS[what][int(slides)], ledger, inner))
    return None if any(limit is None for limit in limits) else np.array(limits, dtype=np.float64)


def _takes_too_long(points: Array, limits: dict[str, Array], durations: list[float] | None) -> bool:
    """Whether a move lasts longer than ``LONGEST_MOVE``, by its duration or by its limits."""
    moves = np.abs(np.diff(points, axis=0))
    times = [0.0, *(durations or [])]
    for order, what in enumerate(LIMITS, 1):
        limit = limits.get(what)
        if limit is not None and (limit > 0.0).all():
            times.append(float(np.max(moves / limit, initial=0.0) ** (1.0 / order)))
    return max(times) > LONGEST_MOVE


def _dwell(value: Any, count: int, ledger: Ledger, place: Place) -> Array:
    """The dwell at each waypoint [s]; a single value applies to all but the first."""
    if value is None:
        return np.zeros(count)
    listed = value if isinstance(value, list) else [0.0, *[value] * (count - 1)]
    if len(listed) != count:
        ledger.fault(place, f"must be one time, or {count}: one a waypoint", f"{len(listed)} times")
        return np.zeros(count)
    rests = [0.0 if entry == 0 else _value(entry, "", "s", ledger, place) or 0.0 for entry in listed]
    return np.array(rests, dtype=np.float64)
