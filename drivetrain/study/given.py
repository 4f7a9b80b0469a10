"""Converts Python objects (arms, motions, rows of motors and gears, drives) to entries of a study file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from drivetrain.arm.arm import Arm
from drivetrain.drive.brake import NO_BRAKE
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, InputError
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.motion.read import ACCELERATION, POSITION, ROTATION, SPEED, TORQUE, VELOCITY
from drivetrain.motion.table import TIME, spellings
from drivetrain.study.faults import Ledger, read_form
from drivetrain.study.parts.arm import DRIVE_MASS_HINT, resolve_arm, resolve_closures
from drivetrain.study.parts.candidates import DIRECT_DRIVE
from drivetrain.study.parts.rules import GearRow, MotorRow
from drivetrain.study.parts.sheets import SHIPPED_CATALOG
from drivetrain.study.schema import DEFAULT, SCHEMA_VERSION, StudyForm
from drivetrain.study.written import python_document
from drivetrain.units import split_header

SOURCE = "given in Python"  # source of data sheets that do not state one
_ARM_NUMBERS = ("home", "screws", "masses", "inertias", "tip", "gravity", "joint_points", "lower", "upper",
                "speed_limits")  # fmt: skip
_ARM_NAMES = ("joint_names", "link_names", "name", "notes")
_SHAPES = "must be (t, q) or (t, q, qd, qdd): t of N instants, the others of N rows with one value a joint"


def add_arm(data: dict[str, Any], arm: Any) -> list[str]:
    """Add the entry of the arm and the entries that it requires; returns notes on what was left out or assumed."""
    if arm is None:
        return []
    if not isinstance(arm, str | Path | Arm | Mapping):
        problem = "must be the name of a built-in arm, the path of a file, an Arm, or a mapping as in a study file"
        raise InputError(Fault("arm", problem, type(arm).__name__))
    notes = []
    data["arm"] = str(arm) if isinstance(arm, Path) else arm
    if isinstance(arm, Arm):
        if arm.linkage is not None:
            raise InputError(Fault("arm", "has closed loops: give the open chain, and the loops as closures", arm.name))
        numbers = {name: getattr(arm, name).tolist() for name in _ARM_NUMBERS}
        data["arm"] = {"from_screws": numbers | {name: getattr(arm, name) for name in _ARM_NAMES}}
        if arm.coupling is not None and "coupling" not in data:
            data["coupling"] = [{"joints": arm.joint_names, "matrix": arm.coupling}]
        if any(rotor is not None for rotor in arm.rotors):
            notes.append(f"warning: arm: the rotors of {arm.name} are left out: each drive brings those of its motor")
    if data.get("drive_mass") is None:
        data["drive_mass"] = "added"
        notes.append(f"warning: drive_mass: is not stated, 'added' is assumed; {DRIVE_MASS_HINT}")
    return notes


def add_rows(data: dict[str, Any], part: str, given: Any) -> None:
    """Add the study's own rows of motors, gears or brakes; they are the whole catalogue unless another is named."""
    if given is None:
        return
    if isinstance(given, str | Path):
        given = _csv(given, part)
    if isinstance(given, pd.DataFrame):
        rows = _table_rows(given, part)
    elif isinstance(given, Mapping) and not {"kind", "source"} & set(given):
        rows = {str(key): _row(one) for key, one in given.items()}
    elif isinstance(given, Motor | Gear):
        rows = {given.key: _row(given)}
    elif isinstance(given, Iterable) and all(isinstance(one, Motor | Gear) for one in given):
        rows = {one.key: _row(one) for one in given}
    else:
        problem = "must be data sheets by key, a DataFrame, a CSV file, or objects of Motor or Gear"
        found = "one sheet without a key" if isinstance(given, Mapping) else type(given).__name__
        raise InputError(Fault(part, problem, found, f'such as {part}={{"MY_KEY": {{...}}}}'))
    data[part] = rows


def _csv(path: str | Path, part: str) -> pd.DataFrame:
    try:
        return pd.read_csv(path, comment="#")
    except (OSError, ValueError) as error:  # ValueError includes the parsing errors of pandas
        raise InputError(Fault(part, f"cannot be read: {error}", str(path))) from None


def _row(one: Any) -> Any:
    """A data sheet as the mapping that a study file contains."""
    if isinstance(one, Motor | Gear):
        if isinstance(one, Motor) and one.brake is not NO_BRAKE:
            raise InputError(Fault(f"motors.{one.key}", "must be without a brake: `brakes` and `joints` name those"))
        form = MotorRow if isinstance(one, Motor) else GearRow
        stated = {item.name: getattr(one, item.name) for item in fields(one) if item.name in form.model_fields}
        stated = {name: value for name, value in stated.items() if value not in (None, "")}
        conventions = {"current_basis": "dc", "winding_basis": "line_line"} if isinstance(one, Motor) else {}
        return {**conventions, "source": SOURCE, **stated}
    return {"source": SOURCE, **one} if isinstance(one, Mapping) else one


def _table_rows(table: pd.DataFrame, part: str) -> dict[str, Any]:
    """Rows of a table whose headers may carry units; empty cells are unknown."""
    if "key" not in table.columns:
        table = table.rename_axis("key").reset_index()
    if table["key"].duplicated().any():
        twice = table["key"][table["key"].duplicated()].iloc[0]
        raise InputError(Fault(f"{part}, column key", "is given twice", str(twice)))
    rows: dict[str, Any] = {}
    for cells in table.to_dict("records"):
        row: dict[str, Any] = {}
        for header, value in cells.items():
            name, unit = split_header(str(header))
            if name == "key" or pd.isna(value):
                continue
            row[name] = f"{value!r} {unit}" if unit and isinstance(value, int | float) else value
            row[name] = f"{value} {unit}" if unit and isinstance(value, str) else row[name]
        rows[str(cells["key"])] = {"source": SOURCE, **row}
    return rows


def add_joints(data: dict[str, Any], joints: Mapping[str, Any] | None, drives: Any, *, own: bool) -> None:
    """Add what drives each joint: the drives named, or all pairs as candidates."""
    if joints is not None and not isinstance(joints, Mapping):
        hint = 'such as joints={"default": {...}, "elbow": {...}}'
        raise InputError(Fault("joints", "must be a mapping of joint names", type(joints).__name__, hint))
    entries: dict[str, Any] = {name: dict(one) if isinstance(one, Mapping) else one
                               for name, one in (joints or {}).items()}  # fmt: skip
    if isinstance(drives, list) and all(isinstance(pair, tuple | list) for pair in drives):
        names = [name for name, _ in _joints(data)]
        if names and len(names) != len(drives):
            raise InputError(Fault("drives", f"must be one for each of {', '.join(names)}", len(drives)))
        drives = dict(zip(names, drives, strict=False))
    single = drives is not None and not (isinstance(drives, Mapping) and not {"motor", "gear"} & set(drives))
    for name, one in entries.items():
        if not isinstance(one, dict):
            raise InputError(Fault(f"joints.{name}", "must be a mapping of names to values", type(one).__name__))
    for name, pair in ({DEFAULT: drives} if single else drives or {}).items():
        entries.setdefault(name, {})["drive"] = _pair(data, pair, "drives" if single else f"drives.{name}")
    said = entries.values()
    if drives is None and not any({"drive", "candidates", "free_ratio"} & set(one) for one in said):
        catalogs = data.get("catalogs", SHIPPED_CATALOG)
        shipped = not own and SHIPPED_CATALOG in ([catalogs] if isinstance(catalogs, str) else catalogs)
        entries.setdefault(DEFAULT, {})["candidates"] = {} if shipped else {"pairs": "all"}
    if "motors" in data and "gears" in data:
        data.setdefault("catalogs", [])
    data["joints"] = entries


def _pair(data: dict[str, Any], pair: Any, place: str) -> Any:
    """A drive as a study file states it; ``Motor`` and ``Gear`` objects are added to the study's own rows."""
    if isinstance(pair, Mapping):
        return pair
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        hint = "for all joints, by joint name, or a list of them in the arm's order; gear None is a direct drive"
        raise InputError(Fault(place, "must be (motor key, gear key)", pair, hint))
    if any(isinstance(one, Mapping) for one in pair):
        hint = 'such as motors={"M": {...}}, gears={"G": {...}}, drives=("M", "G")'
        raise InputError(Fault(place, "must be keys: sheets are given by key as motors and gears", hint=hint))
    for part, one in zip(("motors", "gears"), pair, strict=True):
        if isinstance(one, Motor | Gear) and one.key not in data.get(part, {}):
            data[part] = {**data.get(part, {}), one.key: _row(one)}
    motor, gear = (getattr(one, "key", one) for one in pair)
    return {"motor": motor, "gear": DIRECT_DRIVE if gear is None else gear}


def add_motion(data: dict[str, Any], motion: Any) -> None:
    """Add the motions; a list of them becomes the cycle. Those of the entry ``motions`` may be objects too."""
    stated = data.get("motions", {})
    if not isinstance(stated, Mapping):
        raise InputError(Fault("motions", "must be a mapping of motions by name", type(stated).__name__))
    motions = {
        name: one if one is None or isinstance(one, Mapping) else _samples(one, data, f"motions.{name}")
        for name, one in stated.items()
    }
    if motions or motion is not None:
        data["motions"] = motions
    if motion is None:
        return
    if not isinstance(motion, list):
        motions[_free_name(motion, motions)] = _samples(motion, data, "motion")
        return
    cycle = []
    stated = {"payload": list(data.get("payloads", {})), "force": list(data.get("forces", {}))}
    carried = {entry: names[0] for entry, names in stated.items() if len(names) == 1}
    for i, step in enumerate(motion):
        entry = dict(step) if isinstance(step, Mapping) else {"motion": step, **carried}
        run = entry.get("motion")
        if run is not None and not isinstance(run, str):
            entry["motion"] = _free_name(run, motions)
            motions[entry["motion"]] = _samples(run, data, f"motion[{i}]")
        cycle.append(entry)
    data["cycle"] = cycle


def _free_name(motion: Any, taken: Mapping[str, Any]) -> str:
    """The motion's own name, or a numbered one."""
    wanted = motion.name if isinstance(motion, Motion | LoadTable) and motion.name != DEFAULT else "motion"
    return next(name for i in range(1, len(taken) + 3) if (name := wanted if i == 1 else f"{wanted}_{i}") not in taken)


def _samples(motion: Any, data: Mapping[str, Any], place: str) -> dict[str, str]:
    if isinstance(motion, str | Path):
        return {"file": str(motion)}
    if isinstance(motion, pd.DataFrame):
        return {"samples": _framed(motion, data).to_csv(index=False)}
    own = None
    if isinstance(motion, Motion):
        own, motion = motion.joint_names, (motion.time, motion.position, motion.velocity, motion.acceleration)
    if isinstance(motion, LoadTable):
        names = [f"{what}_{joint} [{unit}]" for what, unit in
                 (("torque", "N m"), ("speed", "rad/s"), ("acceleration", "rad/s^2"))
                 for joint in motion.joint_names]  # fmt: skip
        return _table(motion.time, (motion.torque, motion.speed, motion.acceleration), names, place)
    if not isinstance(motion, tuple) or len(motion) not in (2, 3, 4):
        problem = f"{_SHAPES}; or a Motion, a DataFrame or the path of a file"
        raise InputError(Fault(place, problem, type(motion).__name__, "a list is a cycle of such motions"))
    if data.get("arm") is None:
        hint = "name one; or give a LoadTable of torques and speeds, for a single axis without an arm"
        raise InputError(Fault("arm", "is missing: positions over time need one", hint=hint))
    width = np.shape(motion[1])[1] if np.ndim(motion[1]) == 2 else 1
    joints = _joints(data) or [(name, "rad") for name in own or map(str, range(1, width + 1))]
    kinds = list(zip(("q", "qd", "qdd"), ("", "/s", "/s^2"), strict=True))[: len(motion) - 1]
    named = [f"{kind}_{name} [{unit}{rate}]" for kind, rate in kinds for name, unit in joints]
    return _table(motion[0], motion[1:], named, place)


def _joints(data: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and unit of each driven joint of the arm; empty if the arm has faults, which are reported later."""
    names = ("arm", "tip", "gravity", "drive_mass", "external_axes", "closures", "passive")
    stated = {name: data[name] for name in names if name in data}
    document = python_document({"schema_version": SCHEMA_VERSION, **stated})
    form, faults, places = read_form(StudyForm, document)
    ledger = Ledger(document, faults, places)
    arm = None if form.arm is None else resolve_closures(form, resolve_arm(form, ledger), ledger)
    if arm is None or any(one.place.startswith(names) for one in faults):
        return []
    return [(name, "m" if slide else "rad") for name, slide in zip(arm.joint_names, arm.slides, strict=True)]


def _table(time: Any, parts: Iterable[Any], names: list[str], place: str) -> dict[str, str]:
    """Columns as the text of a CSV file, in which numbers keep all their digits."""
    try:
        columns = [np.asarray(time, dtype=np.float64)[:, np.newaxis]]
        for part in parts:
            values = np.asarray(part, dtype=np.float64)
            columns.append(values[:, np.newaxis] if values.ndim == 1 else values)
        table = np.hstack(columns)
    except (TypeError, ValueError, IndexError):
        shapes = ", ".join(str(np.shape(part)) for part in (time, *parts))
        raise InputError(Fault(place, _SHAPES, shapes, _turned(time, parts))) from None
    if table.shape[1] != 1 + len(names):
        shapes = ", ".join(str(np.shape(part)) for part in (time, *parts))
        raise InputError(Fault(place, f"must have a column for each of {', '.join(names)}", shapes))
    lines = [",".join(["time [s]", *names]), *(",".join(map(repr, row)) for row in table.tolist())]
    return {"samples": "\n".join(lines) + "\n"}


def _turned(time: Any, parts: Iterable[Any]) -> str:
    """A hint on arrays whose shapes do not fit together."""
    if np.ndim(time) == 2 and any(np.ndim(part) == 1 for part in parts):
        return "the time comes first"
    if np.ndim(time) == 1 and any(np.shape(part)[1:] == np.shape(time) for part in parts):
        return "one row a joint: give the transpose, such as q.T"
    return ""


def _framed(table: pd.DataFrame, data: Mapping[str, Any]) -> pd.DataFrame:
    """A table with a time column and units in its headers; a header without one is in SI."""
    names = [split_header(str(header))[0].casefold() for header in table.columns]
    if not set(names) & set(TIME):
        if isinstance(table.index, pd.RangeIndex):  # numbers of rows are no instants
            raise InputError(Fault("motion", "has no time: a column time [s], or the instants as index"))
        header = str(table.index.name)
        is_time = split_header(header)[0].casefold() in TIME
        table = table.rename_axis(header if is_time else "time [s]").reset_index()
    joints = dict(_joints(data))
    kinds = (POSITION, VELOCITY, ACCELERATION) if joints else (TORQUE, SPEED, ROTATION)
    known = spellings(tuple(joints) or ("axis",), kinds)
    headers = []
    for header in map(str, table.columns):
        name, unit = split_header(header)
        kind, joint = known.get(name.casefold(), (None, ""))
        if name.casefold() in TIME:
            unit = unit or "s"
        elif kind is not None:
            unit = unit or kind.units[-1 if joints.get(joint) == "m" else 0]
        headers.append(f"{name} [{unit}]" if unit else name)
    return table.set_axis(headers, axis=1)
