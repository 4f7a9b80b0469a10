"""The motions of a study and the cycle they make."""

from __future__ import annotations

from pathlib import Path

from drivetrain.arm.arm import Arm
from drivetrain.errors import nearest
from drivetrain.motion.duty_cycle import Cycle, Step, build_cycle
from drivetrain.motion.limits import limit_notes
from drivetrain.motion.mix import build_mix, share_faults
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.motion.read import read_load_table, read_motion
from drivetrain.motion.smoothing import Parabolas, SavitzkyGolay, Smoothing
from drivetrain.motion.straight_lines import sampled
from drivetrain.study.document import Place
from drivetrain.study.ledger import Ledger
from drivetrain.study.resolve_waypoints import JointAxes, resolve_waypoints
from drivetrain.study.schema import DEFAULT, CycleForm, MixForm, MotionForm, StudyForm

KINDS: dict[str, frozenset[str]] = {
    "file": frozenset({"smoothing"}),
    "table": frozenset(),
    "waypoints": frozenset({"unit", "profile", "speed", "acceleration", "jerk", "durations", "dwell"}),
}  # what may stand beside each kind of motion

Motions = dict[str, Motion | LoadTable]


def motion_files(form: StudyForm, folder: Path) -> list[Path]:
    """The files the motions are read from."""
    names = [motion.file or motion.table for motion in form.motions.values()]
    return [folder / name for name in names if name is not None]


def resolve_motions(form: StudyForm, arm: Arm | None, ledger: Ledger) -> Motions:
    """Every motion of a study, held against the arm's ranges.

    Args:
        arm: None when the motions are load tables (or the arm could not be read).
    """
    motions: Motions = {}
    default = form.motions.get(DEFAULT, MotionForm())
    stray = sorted(default.model_fields_set - (KINDS["waypoints"] - {"durations"}))
    if stray:
        ledger.fault(("motions", DEFAULT, stray[0]), "is for one motion, not for all of them")
    for name, own in form.motions.items():
        place: Place = ("motions", name)
        kind = "" if name == DEFAULT else _kind(own, ledger, place)
        if not kind or not _belongs(form, kind, ledger, place):
            continue
        motion = _load_table(name, own, ledger) if kind == "table" else _motion(name, own, default, arm, ledger)
        if motion is not None:
            motions[name] = motion
    if not set(form.motions) - {DEFAULT}:
        ledger.fault(("motions",), "must have at least one motion")
    return motions


def resolve_cycle(form: StudyForm, motions: Motions, ledger: Ledger) -> Cycle | None:
    """The repeated task.

    Returns:
        The cycle; None when it cannot be built.
    """
    if form.mix is not None:
        cycle = _mix(form, form.mix, motions, ledger)
    else:
        entries = form.cycle
        if entries is None:
            entries = _only_motion(form, ledger)
        elif not entries:
            ledger.fault(("cycle",), "must have at least one motion")
        cycle = _cycle(form, entries, ("cycle",), motions, ledger)
    run = [entry for part in form.mix for entry in part.cycle] if form.mix is not None else form.cycle
    if run is not None:
        unused = {name for name in form.motions if name != DEFAULT} - {entry.motion for entry in run}
        if unused:
            ledger.note([f"doubt: motions that the cycle does not run: {', '.join(sorted(unused))}"])
    if cycle is not None:
        ledger.note(note for note in cycle.notes if note.startswith("doubt:"))
    return cycle


def _mix(form: StudyForm, parts: list[MixForm], motions: Motions, ledger: Ledger) -> Cycle | None:
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
            ledger.fault(("mix", i, "name"), "stands twice in the mix", name)
    cycles = [_cycle(form, part.cycle, ("mix", i, "cycle"), motions, ledger) for i, part in enumerate(parts)]
    ready = [cycle for cycle in cycles if cycle is not None]
    if not parts or len(ready) < len(parts) or ledger.spoiled(("mix",)):
        return None
    mixed: Cycle | None = None
    with ledger.gather(("mix",)):
        mixed = build_mix(ready, shares, names=names)
    return mixed


def _cycle(form: StudyForm, entries: list[CycleForm], place: Place, motions: Motions, ledger: Ledger) -> Cycle | None:
    """One repeated run of motions; None after a fault."""
    known = len(ledger.faults)
    names = [name for name in form.motions if name != DEFAULT]
    written = ledger.document.data.get("payloads")
    payloads = list(written) if isinstance(written, dict) else []  # those at fault are told elsewhere
    for i, entry in enumerate(entries):
        if entry.motion is not None and entry.motion not in names:
            hint = nearest(entry.motion, names)
            ledger.fault((*place, i, "motion"), "is no motion of this study", entry.motion, hint)
        if entry.payload is not None and entry.payload not in payloads:
            hint = nearest(entry.payload, payloads)
            ledger.fault((*place, i, "payload"), "is no payload of this study", entry.payload, hint)
    ready = all(entry.motion is None or entry.motion in motions for entry in entries)
    if not entries or not ready or len(ledger.faults) > known:
        return None
    cycle: Cycle | None = None
    with ledger.gather(place):
        cycle = build_cycle([_step(entry, motions) for entry in entries], may_stay_open=form.open_cycle)
    return cycle


def _step(entry: CycleForm, motions: Motions) -> Step:
    motion = None if entry.motion is None else motions[entry.motion]
    return Step(motion, entry.dwell, entry.repetitions, entry.payload)


def _only_motion(form: StudyForm, ledger: Ledger) -> list[CycleForm]:
    """The cycle of a study that does not give one."""
    names = [name for name in form.motions if name != DEFAULT]
    if len(names) != 1 or len(form.payloads) > 1:
        choice = "motions" if len(names) > 1 else "payloads"
        if names:
            problem = f"is missing: with several {choice} the study must say in which order they come"
            ledger.fault(("cycle",), problem, hint="such as a list of {motion: pick, payload: part}")
        return []
    return [CycleForm(motion=names[0], payload=next(iter(form.payloads), None))]


def _kind(own: MotionForm, ledger: Ledger, place: Place) -> str:
    """Which kind of motion an entry is; empty after a fault."""
    kinds = [name for name in KINDS if getattr(own, name) is not None]
    if len(kinds) != 1:
        ledger.fault(place, "must have one of: file, table, waypoints", ", ".join(kinds) or None)
        return ""
    stray = sorted(own.model_fields_set - {kinds[0]} - KINDS[kinds[0]])
    for name in stray:
        ledger.fault((*place, name), f"cannot go with {kinds[0]}")
    return "" if stray else kinds[0]


def _belongs(form: StudyForm, kind: str, ledger: Ledger, place: Place) -> bool:
    """Motions of joints need an arm, load tables can have none; says so where it is not so."""
    has_arm = "arm" in ledger.document.data
    if kind == "table" and has_arm:
        ledger.fault((*place, "table"), "is for studies without an arm: the arm decides the torques")
        return False
    if kind != "table" and not has_arm:
        ledger.fault((*place, kind), "needs an arm", hint="or a table of torque and speed: {table: load.csv}")
        return False
    return True


def _load_table(name: str, own: MotionForm, ledger: Ledger) -> LoadTable | None:
    with ledger.gather(("motions", name, "table")):
        return sampled(read_load_table(ledger.document.folder / (own.table or ""), name=name))
    return None


def _motion(name: str, own: MotionForm, default: MotionForm, arm: Arm | None, ledger: Ledger) -> Motion | None:
    """A motion of joints, held against the arm's ranges."""
    if arm is None:
        return None
    slides = tuple(bool(not screw[:3].any()) for screw in arm.screws)
    axes = JointAxes(arm.joint_names, slides)
    place: Place = ("motions", name)
    motion: Motion | None = None
    if own.file is None:
        merged = own.over(default)
        motion = resolve_waypoints(name, merged, axes, ledger, place)
    else:
        units = ["m" if slide else "rad" for slide in slides]
        path = ledger.document.folder / own.file
        with ledger.gather((*place, "file")):
            motion = read_motion(path, axes.names, smoothing=_smoothing(own), position_units=units, name=name)
    if motion is not None:
        _hold_against(motion, arm, ledger, place)
    return motion


def _smoothing(own: MotionForm) -> Smoothing | None:
    """As the resolution of the file asks; none at all; or in a window."""
    if own.smoothing is None:
        return None
    return SavitzkyGolay(own.smoothing) if own.smoothing > 0.0 else Parabolas()


def _hold_against(motion: Motion, arm: Arm, ledger: Ledger, place: Place) -> None:
    """Positions outside the joints' ranges are faults, speeds above theirs doubts."""
    told = limit_notes(motion, arm.lower, arm.upper, arm.speed_limits, name=motion.name)
    for fault in told.faults:
        ledger.faults.append(ledger.document.fault(place, f"{fault.place}: {fault.problem}", fault.value))
    ledger.note(told.doubts)
