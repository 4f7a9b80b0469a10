"""Inputs and assumptions of a report: task, environment, safety factors, efficiencies, warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.report.quantities import number, percent, with_unit
from drivetrain.report.words import DRIVE_MASS, heat_model, safety_lines
from drivetrain.sizing.judge.evaluate import holding_figures
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import GearAssumption, JointTask, MotorAssumption, ProcessForce, Study

_UNKNOWN = "not stated"


@dataclass(frozen=True)
class Group:
    """Assumptions of one kind: names and values, and sentences."""

    title: str
    lines: tuple[tuple[str, str], ...]
    notes: tuple[str, ...] = ()


def assumption_groups(evaluation: Evaluation, *, briefly: bool = False) -> list[Group]:
    """All inputs and assumptions of a report."""
    study = evaluation.study
    groups = [
        _task(study),
        _surroundings(study),
        Group("Safety factors and reserves", tuple(safety_lines(study))),
        _heat(evaluation),
        _silent_sheets(evaluation),
        _standstill(evaluation, briefly),
        _friction(study),
        Group("Warnings and notes", (), tuple(dict.fromkeys([*study.notes, *study.catalog.notes]))),
    ]
    return [group for group in groups if group.lines or group.notes]


def _task(study: Study) -> Group:
    cycle = study.cycle
    lines = []
    if study.arm is None:
        lines.append(("arm", "none: torques are given as a table"))
    else:
        gravity = ", ".join(f"{value:g}" for value in study.arm.gravity)
        lines.append(("arm", f"{study.arm.name}, {study.arm.n} joints"))
        lines.append(("gravity in the base frame", f"({gravity}) m/s²"))
    for part, share, name in zip(cycle.parts, cycle.shares, cycle.part_names, strict=True):
        length = number(float(cycle.time[part.stop - 1] - cycle.time[part.start]))
        used = "without end" if len(cycle.parts) == 1 else f"for {percent(share)} of the time"
        text = f"{length} s, {part.stop - part.start} samples, repeated {used}"
        lines.append(("cycle" if len(cycle.parts) == 1 else f"part of the mix: {name}", text))
    lines.append(("segments", ", ".join(cycle.segment_names)))
    lines += [("payload", f"{body.name}, {with_unit(body.mass, 'kg')}") for body in study.payloads]
    lines += [("force at the tip", f"{one.name}, {_force_text(one)}") for one in study.forces]
    notes = () if study.drive_mass is None else (DRIVE_MASS[study.drive_mass],)
    return Group("Task", tuple(lines), (*notes, *dict.fromkeys(cycle.notes)))


def _force_text(force: ProcessForce) -> str:
    """A force at the tip in words."""
    parts = [
        f"({', '.join(f'{value:g}' for value in values)}) {unit}"
        for values, unit in ((force.force, "N"), (force.moment, "N m"))
        if any(values)
    ]
    parts = ["over time, from a table"] if force.table is not None else parts
    parts = [f"{' and '.join(parts)} in {force.axes} axes, applied by the {force.applied_by}"] if parts else []
    parts += [f"{force.along_motion:g} N along the motion"] if force.along_motion else []
    return ", ".join(parts)


def _surroundings(study: Study) -> Group:
    supply = study.supply
    lines = [
        ("ambient", f"{study.ambient:g} °C"),
        ("supply", with_unit(supply.voltage, "V")),
        ("supply peak power", _limit(supply.peak_power, "W")),
        ("supply mean power", _limit(supply.mean_power, "W")),
        ("regenerative capacity", _limit(supply.regenerated_power, "W")),
    ]
    lines += [] if supply.capacity is None else [("capacity of the bus", with_unit(supply.capacity, "F"))]
    lines += [] if supply.max_voltage is None else [("bus voltage allowed", with_unit(supply.max_voltage, "V"))]
    if supply.threshold is not None and supply.resistance is not None:
        resistor = f"{with_unit(supply.resistance, 'ohm')} above {with_unit(supply.threshold, 'V')}"
        lines.append(("brake resistor", resistor))
    lines += _amplifiers(study.joints)
    note = "Currents are those of the equivalent DC machine between two terminals, unless a column says otherwise."
    return Group("Surroundings", tuple(lines), (note,))


def _limit(value: float | None, unit: str) -> str:
    """A limit or that there is none."""
    return _UNKNOWN if value is None else with_unit(value, unit)


def _amplifiers(joints: tuple[JointTask, ...]) -> list[tuple[str, str]]:
    groups: dict[object, list[str]] = {}
    for task in joints:
        groups.setdefault(task.amplifier, []).append(task.name)
    lines = []
    for task in joints:
        names = groups.pop(task.amplifier, None)
        if names is None:
            continue
        amplifier = task.amplifier
        where = "all joints" if len(names) == len(joints) else ", ".join(names)
        lines.append((
            f"amplifier, {where}",
            (f"{amplifier.key}: " if amplifier.key else "")
            + f"peak {_limit(amplifier.peak_current, 'A')}, continuous {_limit(amplifier.continuous_current, 'A')}, "
            f"{100 * amplifier.modulation:g} % of the supply voltage reaches the motor",
        ))  # fmt: skip
    return lines


def _heat(evaluation: Evaluation) -> Group:
    motors = [joint.drive.motor for joint in evaluation.joints.values()]
    references = sorted({motor.reference_temperature for motor in motors})
    coefficients = sorted({motor.magnet_coefficient for motor in motors})
    lines = [
        ("temperatures", "periodic steady state of the repeated cycle, resistance following the winding"),
        ("data-sheet temperature", ", ".join(f"{value:g} °C" for value in references)),
        ("copper", "+0.39 %/K of resistance"),
        ("torque constant", ", ".join(f"{100 * value:+g} %/K of magnet temperature" for value in coefficients)),
    ]
    models: dict[str, list[str]] = {}
    for task in evaluation.study.joints:
        if task.name in evaluation.joints:
            motor = evaluation.joints[task.name].drive.motor
            models.setdefault(f"{motor.key}: {heat_model(motor, task.housing_to_ambient)}", []).append(task.name)
    lines += [(f"heat of {', '.join(names)}", model) for model, names in models.items()]
    lines = [line for line in lines if line[1]]
    lines += [(f"gear of {name}", _gear_heat(evaluation.study, joint)) for name, joint in evaluation.joints.items()
              if joint.gear_loss is not None]  # fmt: skip
    frameless = any(motor.frameless for motor in motors)
    note = (
        "Continuous torque of a frameless motor is a property of motor and housing: confirm the thermal resistance to "
        "ambient of the real mounting."
    )
    return Group("Heat", tuple(lines), (note,) if frameless else ())


def _gear_heat(study: Study, joint: JointResult) -> str:
    """Text on the gear's mean loss, the share that warms the motor, and the temperature used for its drag."""
    task = next(task for task in study.joints if task.name == joint.name)
    sentence = f"loses {number(joint.gear_loss or 0.0)} W, {percent(task.gear_heat)} of it into the motor's housing"
    if task.amplifier_heat:
        sentence += f", beside {percent(task.amplifier_heat)} of the amplifier's loss,"
    if joint.housing_temperature is not None:
        sentence += f" of {number(joint.housing_temperature)} °C"
    if not joint.drive.gear.drag_temperature_1:
        return sentence
    taken = float(study.drag_temperature(study.ambient))
    return f"{sentence}; torque, current and power are checked with its drag at {taken:g} °C"


def _silent_sheets(evaluation: Evaluation) -> Group:
    """What is assumed of the drives where their data sheets give no value, with the source of each assumption."""
    study, found = evaluation.study, dict[str, set[str]]()
    for joint in evaluation.joints.values():
        motor, gear = joint.drive.motor, joint.drive.gear
        kind = "frameless" if motor.frameless else motor.kind
        pairs = (
            (f"{gear.kind.replace('_', ' ')} gears", study.gear_assumptions.get(gear.kind), study.catalog.gears, gear),
            (f"{kind} motors", study.motor_assumptions.get(kind), study.catalog.motors, motor),
        )
        for name, assumption, rows, part in pairs:
            if assumption is not None and (text := _assumed(assumption, rows.get(part.key, part), part)):
                found.setdefault(name, set()).add(text)
    lines = tuple((name, text) for name, texts in found.items() for text in sorted(texts))
    return Group("Assumed where the data sheet gives no value", lines)


FILLS = {"no_load_torque_share": "no_load_torque"}
_UNITS = {
    "max_winding_temperature": "°C",
    "winding_time_constant": "s",
    "housing_time_constant": "s",
}


def _assumed(assumption: GearAssumption | MotorAssumption, row: Gear | Motor, part: Gear | Motor) -> str:
    """Values of an assumption that complete a catalogue row, and their source; empty if the row needs none."""
    stated = []
    for field in fields(assumption):
        column, value = FILLS.get(field.name, field.name), getattr(assumption, field.name)
        if column != "source" and getattr(row, column) is None and getattr(part, column) is not None:
            stated.append(f"{field.name.replace('_', ' ')} {value:g} {_UNITS.get(field.name, '')}".strip())
    source = f" ({assumption.source})" if assumption.source else ""
    return ", ".join(stated) + source if stated else ""


def _standstill(evaluation: Evaluation, briefly: bool) -> Group:
    """Remarks that several joints share are shown once here."""
    said: dict[str, list[str]] = {}
    for joint in evaluation.joints.values():
        for remark in joint.remarks:
            said.setdefault(remark, []).append(joint.name)
    count = len(evaluation.joints)
    notes = [remark if len(names) == count else f"{', '.join(names)}: {remark}" for remark, names in said.items()]
    held = {name: _held(figures) for name, figures in ({} if briefly else holding_figures(evaluation)).items()}
    notes += [f"{name} holds a load at rest: {values}" for name, values in held.items() if values]
    return Group("How losses and standstill are counted", (), tuple(notes))


def _held(figures: Mapping[str, tuple[float | None, float | None]]) -> str:
    """RMS current and highest winding temperature for each choice of ``holding``; empty if they do not differ."""
    choices = {f"{_or_unknown(current, 'A')}, {_or_unknown(winding, '°C')}": choice for choice, (current, winding) in
            figures.items()}  # fmt: skip
    words = "; ".join(f"{numbers} with holding: {choice}" for numbers, choice in choices.items())
    return f"RMS current and hottest winding are {words}" if len(choices) > 1 else ""


def _or_unknown(value: float | None, unit: str) -> str:
    return f"unknown {unit}" if value is None else f"{value:.3g} {unit}"


def _friction(study: Study) -> Group:
    lines = []
    for task in study.joints:
        for where, friction in (("at the output", task.friction), ("at the motor shaft", task.motor_friction)):
            if friction is not None and friction != Friction():
                lines.append((f"{task.name}, {where}", _friction_text(friction)))
        for one in task.counterbalances:
            stated = [f"{f.name.replace('_', ' ')} {getattr(one, f.name)}" for f in fields(one)
                      if getattr(one, f.name) != f.default]  # fmt: skip
            lines.append((f"{task.name}, counterbalance (SI)", ", ".join(stated)))
    return Group("Friction and counterbalances stated in the study", tuple(lines))


def _friction_text(friction: Friction) -> str:
    """Coulomb, viscous and breakaway parts; those that are zero left out."""
    parts = []
    if friction.coulomb or friction.coulomb_negative:
        parts.append(f"Coulomb {with_unit(friction.coulomb, 'N m')}")
        if friction.coulomb_negative is not None:
            parts[-1] += f" forwards, {with_unit(friction.coulomb_negative, 'N m')} backwards"
    if friction.viscous or friction.viscous_negative:
        parts.append(f"viscous {number(friction.viscous)} N m s/rad".replace(" ", "\u00a0"))
        if friction.viscous_negative is not None:
            parts[-1] += f" forwards, {number(friction.viscous_negative)} backwards"
    if friction.static is not None:
        parts.append(f"breakaway {with_unit(friction.static, 'N m')}")
    return ", ".join(parts)
