"""Finds the missing data because of which a set of drives cannot be proven feasible, and where to fill it in."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.brake import Brake
from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import Gear, unknown_loss
from drivetrain.drive.motor import Motor, has_friction_data, whole_mass
from drivetrain.drive.motor_limits import continuous_current, short_time_torque
from drivetrain.drive.thermal.thermal_network import thermal_network
from drivetrain.errors import Fault
from drivetrain.records import as_record, known
from drivetrain.sizing.judge.checks import CHECKS, SUPPLY_CHECKS
from drivetrain.sizing.judge.objectives import amplifier_price
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study, pair_name
from drivetrain.study.parts.mounting import drive_mass, mass_counts
from drivetrain.study.parts.verdicts import lacking

HOLDING = "holding brake torque"
REPEATED, PEAK, RMS = "gear repeated peak torque", "motor peak torque", "motor RMS current"
SHORT_TIME = ("peak_torque", "peak_current", "stall_torque", "nominal_voltage")
BEARING = {
    row.name: row.limit.removeprefix("gear.") for row in CHECKS if row.applies == "setting.bearing" and row.essential
}
LIMITS = {
    row.name: row.limit.replace("setting.overload_limit", "amplifier.peak_time").replace("motor.brake.", "brake.")
    for row in CHECKS if row.assumed_limit
}  # fmt: skip
LIVES = {
    "gear life L10": ("rated_life", "continuous_torque", "rated_speed"),
    "output bearing life L10": ("bearing_dynamic_rating", "bearing_pitch_diameter", "bearing_offset"),
}
SPRINGS = {"arm first resonance": "stiffness_1", "arm tip deviation": "stiffness_1", "arm lost motion": "backlash"}
SUPPLY = {check.name for check in SUPPLY_CHECKS}
SILENT = {
    "friction": ("no_load_current and no_load_speed", "(where it is known) motor_friction of the joint in the study"),
    "temperature": ("max_winding_temperature with thermal resistances",),
}
CONTINUOUS = ("nominal_current", "nominal_torque", "max_winding_temperature with thermal resistances")
HEATED = (RMS, "winding temperature", "phase temperature at rest")
WEAKENED = {
    row.name for row in CHECKS if row.allowance in ("allowance.current", "allowance.overload")
}  # checks that weaker magnets of a warm motor affect
# needed in addition to the thermal resistances
CONTINUOUS_OVER_TIME = ("winding_time_constant", "max_winding_temperature")
_ROW = re.compile(r"\S+\.csv row \d+")


@dataclass(frozen=True)
class Gap:
    """A value that a data sheet lacks and a check needs.

    Attributes:
        joint: Joint of the drive.
        part: ``motor``, ``gear`` or ``brake``.
        key: Key of its catalogue row.
        row: File and line, or the place in the study.
        columns: Columns of which any one fills the gap.
        checks: Names of the checks that cannot be made without it.
    """

    joint: str
    part: str
    key: str
    row: str
    columns: tuple[str, ...]
    checks: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.place} has no {self._lacks}"

    @property
    def _lacks(self) -> str:
        return f"{' or '.join(self.columns)}, so {' and '.join(self.checks)} cannot be decided"

    @property
    def place(self) -> str:
        """Joint, part and row as text."""
        return f"{self.joint}: {' '.join(filter(None, (self.part, self.key)))} ({self.row})"


def gap_lines(found: Iterable[Gap]) -> tuple[str, ...]:
    """Gaps as text; gaps with the same columns are listed together."""
    alike: dict[tuple[tuple[str, ...], tuple[str, ...]], list[Gap]] = {}
    for gap in found:
        alike.setdefault((gap.columns, gap.checks), []).append(gap)
    return tuple(f"{each[0]}." if len(each) == 1 else _of_several(each) for each in alike.values())


def _of_several(alike: list[Gap]) -> str:
    """Gaps with the same columns as text: what is missing first, then where."""
    first = alike[0]
    places = [f"{one.joint} ({one.row if one.key in one.row else f'{one.key}, {one.row}'})" for one in alike]
    return f"No {first._lacks}: {first.part}s of {', '.join(places)}."


def gaps(evaluation: Evaluation) -> tuple[Gap, ...]:
    """Missing data because of which it cannot be decided whether a set of drives fits.

    Args:
        evaluation: Evaluation of the set.

    Returns:
        Every gap, in the order of the joints; empty if every essential check was made.
    """
    study = evaluation.study
    found: list[Gap] = []
    tasks = {task.name: task for task in study.joints}
    shared = lacking(evaluation.shared)
    supply = tuple(check.name for check in shared if check.name in SUPPLY)
    unweighed = massless(study, evaluation.joints) if shared else ()
    for name, joint in evaluation.joints.items():
        found += _of_checks(study, tasks[name], joint)
        for column in dict.fromkeys(SPRINGS[check.name] for check in shared if check.name in SPRINGS):
            if lacking_joints({name: joint.drive}, column):
                names = tuple(check.name for check in shared if SPRINGS.get(check.name) == column)
                found.append(_gap(study, joint, joint.drive.gear, (column,), names))
        if supply and joint.power_allowance[0] > 0.0:
            silent = "temperature" if has_friction_data(joint.drive.motor) else "friction"
            found.append(_gap(study, joint, joint.drive.motor, SILENT[silent], supply))
        if name in unweighed:
            bear = "what the joints before must bear"
            found += [_gap(study, joint, part, ("mass",), (bear,)) for part in lacking_parts(joint.drive, "mass")]
    return tuple(found)


def lacking_joints(drives: Mapping[str, Drive], field: str) -> tuple[str, ...]:
    """Joints whose gear lacks a number; direct drives are left out."""
    return tuple(name for name, one in drives.items() if not one.gear.direct and getattr(one.gear, field) is None)


def torque_lacks(drive: Drive) -> str:
    """Missing data sheet values that the motor torque depends on, as text; empty if there are none."""
    geared = drive.gear.kind != "ideal"
    missing = ["the motor's rotor inertia"] if drive.motor.rotor_inertia is None else []
    missing += [f"the gear's {_loss_columns(drive.gear)[0]}"] if geared and not _loss_known(drive.gear) else []
    if geared and drive.gear.inertia is None:
        missing.append("the gear's input inertia (or its mass, for an estimate)")
    return " and ".join(missing)


def unknown_torques(results: Mapping[str, JointResult]) -> list[Fault]:
    """Joints whose current cannot be computed for lack of data."""
    return [
        Fault(
            f"joints.{name}",
            f"lacks {torque_lacks(one.drive)}, on which its torque rests",
            pair_name(one.motor, one.gear),
        )
        for name, one in results.items()
        if not one.torque_known
    ]


def _loss_known(gear: Gear) -> bool:
    """Whether the gear's efficiency, or its mesh efficiency and drag, are given."""
    return bool(known(unknown_loss(as_record(gear))))


def _loss_columns(gear: Gear) -> tuple[str, ...]:
    """Columns that specify the loss; if some of mesh and drag are given, the missing ones."""
    if gear.mesh_efficiency is None and gear.drag_torque is None:
        return "efficiency", f"assumptions.gears.{gear.kind}.efficiency in the study"
    names = ("mesh_efficiency", "drag_torque", "drag_speed_exponent", "drag_temperature_1", "drag_temperature_2")
    missing = [name for name in names if getattr(gear, name) is None]
    return (" and ".join(missing or ["drag_speed"]),)


def missing_words(evaluation: Evaluation) -> tuple[str, ...]:
    """Missing data of a set, as text."""
    found = gap_lines(gaps(evaluation))
    hint = "No change of the task makes up for missing data: complete the catalogue rows, or state assumptions."
    return (*found, hint) if found else ()


def massless(study: Study, results: Mapping[str, JointResult]) -> tuple[str, ...]:
    """Joints whose drives load the arm and have an unknown mass."""
    joints = {task.name: joint for joint, task in enumerate(study.joints)}
    unknown = [name for name, result in results.items() if drive_mass(result.drive) is None]
    return tuple(name for name in unknown if mass_counts(study, joints[name]))


def row_of(study: Study, part: Motor | Gear | Brake | Amplifier) -> str:
    """Where a data sheet is stored: file and row, or entry of the study."""
    if not part.key:
        return f"{Path(study.path).name}: {_kind(part)}" if study.path else "of the study"
    row = _ROW.match(part.source)
    if row is not None:
        return row.group()
    place = f"{_kind(part)}s.{part.key}"
    return f"{Path(study.path).name}: {place}" if study.path else place


def _of_checks(study: Study, task: JointTask, joint: JointResult) -> Iterator[Gap]:
    """Gaps behind the essential checks of one joint."""
    lacks = tuple(check.name for check in joint.lacking)
    motor, gear = joint.drive.motor, joint.drive.gear
    if REPEATED in lacks:
        yield _gap(study, joint, gear, ("repeated_peak_torque", "continuous_torque"), (REPEATED,))
    bearing = tuple(name for name in lacks if name in BEARING)
    if bearing:
        limits = ", ".join(BEARING[name] for name in bearing if getattr(gear, BEARING[name]) is None)
        beside = "(where the joint has a bearing of its own) output_bearing: external in the study"
        yield _gap(study, joint, gear, (limits or "bearing_offset", beside), bearing)
    if HOLDING in lacks:
        yield _gap(study, joint, motor.brake, ("static_torque",), (HOLDING,))
    parts: dict[str, Motor | Gear | Brake | Amplifier] = {
        "motor": motor, "gear": gear, "brake": motor.brake, "amplifier": joint.amplifier,
    }  # fmt: skip
    for name in (one for one in lacks if one in LIVES):
        columns = tuple(column for column in LIVES[name] if getattr(gear, column) is None)
        yield _gap(study, joint, gear, (" and ".join(columns), "(if none is asked for) no safety.life"), (name,))
    unprinted = []
    for name in (one for one in lacks if one in LIMITS):
        part, _, column = LIMITS[name].partition(".")
        if getattr(parts[part], column) is None:
            unprinted.append(name)
            yield _gap(study, joint, parts[part], (column,), (name,))
    named = (REPEATED, HOLDING, "gear stiffness", *BEARING, *LIVES, *unprinted)
    others = tuple(name for name in lacks if name not in named)
    if not others:
        return
    doubtful = tuple(one.name for one in joint.lacking if one.name in others and one.required and one.available)
    if doubtful and not has_friction_data(motor) and not motor.frameless and task.motor_friction is None:
        yield _gap(study, joint, motor, SILENT["friction"], doubtful)
    if motor.inductance is None and (volts := tuple(name for name in doubtful if name.endswith("voltage"))):
        yield _gap(study, joint, motor, ("inductance",), volts)
    unheated = thermal_network(motor, study.ambient, housing_to_ambient=task.housing_to_ambient) is None
    if hot := tuple(name for name in doubtful if name in HEATED or (unheated and name in WEAKENED)):
        over_time = tuple(name for name in CONTINUOUS_OVER_TIME if getattr(motor, name) is None)
        if gone := SILENT["temperature"] if unheated else over_time:
            yield _gap(study, joint, motor, (" and ".join(gone),), hot)
        if RMS in hot and motor.nominal_current is None and motor.nominal_torque is None:
            yield _gap(study, joint, motor, ("nominal_current",), (RMS,))
    if motor.rotor_inertia is None:
        yield _gap(study, joint, motor, ("rotor_inertia",), others)
    if gear.kind != "ideal" and not _loss_known(gear):
        yield _gap(study, joint, gear, _loss_columns(gear), others)
    if gear.kind != "ideal" and gear.inertia is None:
        yield _gap(study, joint, gear, ("inertia",), others)
    if not known(short_time_torque(as_record(motor))):
        yield _gap(study, joint, motor, SHORT_TIME, (PEAK,))
    if continuous_current(motor, study.ambient, housing_to_ambient=task.housing_to_ambient).value is None:
        yield _gap(study, joint, motor, CONTINUOUS, (RMS,))


def lacking_parts(drive: Drive, column: str) -> tuple[Motor | Gear | Brake, ...]:
    """The parts of a drive whose data sheets lack a number."""
    free, brake = drive.gear.key == "" if column == "price" else drive.gear.kind == "ideal", drive.motor.brake
    own = brake if brake.key and getattr(brake, column) is None else drive.motor
    parts: tuple[Motor | Gear | Brake, ...] = (own,) if free else (own, drive.gear)
    return tuple(part for part in parts if getattr(part, column) is None)


def cells_to_fill(
    study: Study, pairs: Iterable[tuple[str, str]], column: str, amplifiers: Iterable[Amplifier] = ()
) -> str:
    """Number of catalogue rows that lack a value, as text with an example."""
    motors, gears = (list(dict.fromkeys(keys)) for keys in zip(*pairs, strict=True))
    rows: list[tuple[str, list[Motor | Gear | Amplifier]]] = [
        ("motors", [study.catalog.motors[key] for key in motors]),
        ("gears", [study.catalog.gears[key] for key in gears if key]),
        ("amplifiers", list(amplifiers)),
    ]
    counts = []
    for kind, parts in rows:
        bare = [part for part in parts if _lacks(part, column) and not (column == "mass" and _ideal(part))]
        if bare:
            first = f"{bare[0].key} ({row_of(study, bare[0])})"
            counts.append(f"{len(bare)} of {len(parts)} {kind} have none, such as {first}")
    return f"fill the column {column}: {', '.join(counts)}"


def _lacks(part: Motor | Gear | Amplifier, column: str) -> bool:
    """Whether a part (a motor together with its brake) lacks a number."""
    weighed = column == "mass" and isinstance(part, Motor)
    return (whole_mass(part) if weighed else getattr(part, column)) is None  # type: ignore[arg-type]


def uncounted(evaluation: Evaluation) -> tuple[str, ...]:
    """Terms of the objective that are unknown, and why."""
    study, joints = evaluation.study, evaluation.joints.values()
    found = []
    for term, weight in study.wanted.weights:
        if weight == 0.0 or not math.isnan(evaluation.criteria.get(term, 0.0)):
            continue
        if term == "energy":
            unknown = [joint.name for joint in joints if not joint.torque_known]
            fix = "the motor's torque cannot be computed"
        else:
            unpriced = [one for one in joints if term == "price" and amplifier_price(one.amplifier) is None]
            unknown = [one.name for one in joints if lacking_parts(one.drive, term) or one in unpriced]
            pairs, amplifiers = [(one.motor, one.gear) for one in joints], [one.amplifier for one in unpriced]
            fix = cells_to_fill(study, pairs, term, amplifiers) if unknown else ""
        if unknown:
            found.append(f"{term} of {', '.join(unknown)} not known ({fix})")
    return tuple(found)


def of_the_rest(evaluation: Evaluation) -> tuple[str, ...]:
    """Notes on an objective that leaves given drives out (``objectives.known_objective``)."""
    return tuple(f"{text}; the objective is that of the rest" for text in uncounted(evaluation))


def _gap(
    study: Study, joint: JointResult, part: Motor | Gear | Brake | Amplifier, columns: tuple[str, ...],
    checks: tuple[str, ...],
) -> Gap:  # fmt: skip
    return Gap(joint.name, _kind(part), part.key, row_of(study, part), columns, checks)


def _ideal(part: Motor | Gear | Amplifier) -> bool:
    """Whether a part is an ideal gear, whose mass is 0 unless stated."""
    return isinstance(part, Gear) and part.kind == "ideal"


def _kind(part: Motor | Gear | Brake | Amplifier) -> str:
    return type(part).__name__.lower()
