"""A Denavit-Hartenberg table as a CSV file: one row a joint, units in the header or in a cell."""

from __future__ import annotations

import csv
from math import inf
from pathlib import Path
from typing import Any

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm
from drivetrain.arm.dh import DHRow, JointKind, arm_from_dh
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.units import quantity, split_header

# Unit and default of each column; "joint" is [rad] or [m] as the row's kind says, "joint/s" its rate.
COLUMNS: dict[str, tuple[str, float]] = {
    "a": ("m", 0.0), "alpha": ("rad", 0.0), "d": ("m", 0.0), "theta": ("rad", 0.0), "mass": ("kg", 0.0),
    "com_x": ("m", 0.0), "com_y": ("m", 0.0), "com_z": ("m", 0.0),
    "ixx": ("kg m^2", 0.0), "iyy": ("kg m^2", 0.0), "izz": ("kg m^2", 0.0),
    "ixy": ("kg m^2", 0.0), "ixz": ("kg m^2", 0.0), "iyz": ("kg m^2", 0.0),
    "lower": ("joint", -inf), "upper": ("joint", inf), "speed_limit": ("joint/s", inf),
}  # fmt: skip
NEEDED = ("a", "alpha", "d", "mass")
TEXTS = ("name", "kind")


def read_dh_table(path: Path, convention: str, *, gravity: Any = None) -> Arm:
    """The arm of a Denavit-Hartenberg table.

    Args:
        path: CSV file; columns ``name``, ``kind`` (revolute or prismatic), ``a [mm]``, ``alpha [deg]``, ``d [mm]``,
            ``theta [deg]``, ``mass [kg]``, ``com_x [mm]`` to ``com_z``, ``ixx [kg m^2]`` to ``iyz``, ``lower [deg]``,
            ``upper [deg]``, ``speed_limit [deg/s]``. A cell may carry its own unit.
        gravity: In the base frame [m/s^2], (3,); None: straight down.

    Raises:
        InputError: Every fault of the file.
    """
    header, lines = _csv(path)
    faults: list[Fault] = _header_faults(header, path)
    rows: list[DHRow] = []
    for number, line in lines:
        cells = {split_header(column)[0]: (text.strip(), column) for column, text in zip(header, line, strict=False)}
        rows.append(_row(cells, f"row {number}", path, faults))
    if not rows:
        faults.append(Fault("the file", "holds no joint", file=str(path)))
    if faults:
        raise InputError(faults)
    position = [split_header(column)[0] for column in header]
    names = [line[position.index("name")].strip() for _, line in lines] if "name" in position else None
    down = STANDARD_GRAVITY if gravity is None else gravity
    return arm_from_dh(rows, convention=convention, gravity=down, joint_names=names, name=path.stem)  # type: ignore[arg-type]


def _csv(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header, and the filled rows with their line numbers."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(Fault("the file", f"cannot be read: {error.__class__.__name__}", file=str(path))) from None
    try:
        parsed = list(csv.reader(text.splitlines()))
    except csv.Error as error:
        raise InputError(Fault("the file", f"cannot be read: {error}", file=str(path))) from None
    lines = [(i, line) for i, line in enumerate(parsed, 1) if line and not line[0].startswith("#")]
    if not lines:
        raise InputError(Fault("the file", "is empty", file=str(path)))
    return [column.strip() for column in lines[0][1]], lines[1:]


def _header_faults(header: list[str], path: Path) -> list[Fault]:
    names = [split_header(column)[0] for column in header]
    known = [*COLUMNS, *TEXTS]
    faults = [
        Fault(f"column {name}", "is not known", hint=nearest(name, known), file=str(path))
        for name in names
        if name not in known
    ]
    missing = [name for name in NEEDED if name not in names]
    return faults + [Fault(f"column {name}", "is missing", file=str(path)) for name in missing]


def _row(cells: dict[str, tuple[str, str]], place: str, path: Path, faults: list[Fault]) -> DHRow:
    kind = cells.get("kind", ("revolute", ""))[0] or "revolute"
    if kind not in list(JointKind):
        faults.append(Fault(f"{place}, column kind", "must be revolute or prismatic", kind, file=str(path)))
    own = {"joint": "m", "joint/s": "m/s"} if kind == "prismatic" else {"joint": "rad", "joint/s": "rad/s"}
    values: dict[str, float] = {}
    for name, (unit, default) in COLUMNS.items():
        values[name] = default
        text, column = cells.get(name, ("", ""))
        if text:
            spelled = f"{text} {split_header(column)[1]}" if _is_bare(text) else text
            try:
                values[name] = quantity(spelled, own.get(unit, unit), f"{place}, column {column}", file=str(path))
            except InputError as error:
                faults.extend(error.faults)
    return _dh_row(values, kind)


def _dh_row(v: dict[str, float], kind: str) -> DHRow:
    inertia = [[v["ixx"], v["ixy"], v["ixz"]], [v["ixy"], v["iyy"], v["iyz"]], [v["ixz"], v["iyz"], v["izz"]]]
    return DHRow(
        v["a"], v["alpha"], v["d"], v["theta"], JointKind(kind) if kind in list(JointKind) else JointKind.REVOLUTE,
        v["mass"], (v["com_x"], v["com_y"], v["com_z"]), inertia, v["lower"], v["upper"], v["speed_limit"],
    )  # fmt: skip


def _is_bare(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
