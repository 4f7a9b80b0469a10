"""Which column of a table is which quantity of which joint."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.motion.table import Column, Table
from drivetrain.units import to_si

TIME = ("time", "t")


class Kind(NamedTuple):
    """A quantity that a table may hold for each joint."""

    name: str  # what to call it
    prefixes: tuple[str, ...]  # of the columns, before the joint's name; an empty one lets the bare name stand for it
    units: tuple[str, ...]  # SI units it may have
    needed: bool  # whether every joint must have it


class Found(NamedTuple):
    """A column in SI."""

    column: Column  # as in the file
    values: Array  # in SI, (N,)
    unit: str  # the SI unit


class Assigned(NamedTuple):
    """What a table holds."""

    time: Found | None  # [s]
    found: dict[tuple[str, str], Found]  # by kind and joint
    faults: list[Fault]  # units, missing and doubled columns, misspelt names
    notes: list[str]  # columns passed over


def assigned_columns(table: Table, joint_names: tuple[str, ...], kinds: tuple[Kind, ...]) -> Assigned:
    """The columns of a table by kind and joint.

    Columns are named ``<prefix>_<joint>``, or by number in the order of the joints (``q1`` or ``q_1``); capitals do
    not count. A column that is none of these but nearly one of them is a fault, any other is noted and passed over.
    """
    names = spellings(joint_names, kinds)
    faults: list[Fault] = []
    notes: list[str] = []
    time: Found | None = None
    found: dict[tuple[str, str], Found] = {}
    for column in table.columns:
        key = column.name.casefold()
        kind, joint = names.get(key, (None, ""))
        if key in TIME and time is not None:
            faults.append(Fault(f"column {column.header}", "a second time", None, "", table.file))
        elif key in TIME:
            time = _converted(column, ("s",), table.file, faults)
        elif kind is None:
            _unknown(column, [*names, *TIME], table.file, faults, notes)
        elif (kind.name, joint) in found:
            faults.append(Fault(f"column {column.header}", f"a second {kind.name} of {joint}", None, "", table.file))
        else:
            converted = _converted(column, kind.units, table.file, faults)
            if converted is not None:
                found[kind.name, joint] = converted
    present = {names[column.name.casefold()] for column in table.columns if column.name.casefold() in names}
    faults += _missing(table, joint_names, kinds, {(kind.name, joint) for kind, joint in present})
    return Assigned(time, found, faults, notes)


def spellings(joint_names: tuple[str, ...], kinds: tuple[Kind, ...]) -> dict[str, tuple[Kind, str]]:
    """Every name a column may have, in small letters, to kind and joint; names of joints before numbers."""
    names: dict[str, tuple[Kind, str]] = {}
    for kind in kinds:
        for prefix in kind.prefixes:
            for joint in joint_names:
                spelled = [f"{prefix}{sign}{joint}" for sign in "_ ."] if prefix else [joint]
                names |= {name.casefold(): (kind, joint) for name in spelled if name.casefold() not in names}
    for kind in kinds:
        for prefix in filter(None, kind.prefixes):
            for number, joint in enumerate(joint_names, 1):
                for name in (f"{prefix}{number}", f"{prefix}_{number}"):
                    names.setdefault(name, (kind, joint))
            if len(joint_names) == 1:
                names.setdefault(prefix, (kind, joint_names[0]))
    return names


def _converted(column: Column, units: tuple[str, ...], file: str, faults: list[Fault]) -> Found | None:
    """The column in the first of the units that fits; else adds a fault."""
    place = f"column {column.header}"
    if not column.unit:
        example = " or ".join(f"{column.name} [{unit}]" for unit in units)
        faults.append(Fault(place, f"needs a unit in its header, such as {example}", None, "", file))
        return None
    problem: InputError | None = None
    for unit in units:
        try:
            return Found(column, to_si(column.values, column.unit, place, unit=unit, file=file), unit)
        except InputError as error:
            problem = problem or error
    if problem is not None:
        faults.extend(problem.faults)
    return None


def _unknown(column: Column, known: Iterable[str], file: str, faults: list[Fault], notes: list[str]) -> None:
    hint = nearest(column.name.casefold(), known)
    if hint.startswith("did you mean"):
        faults.append(Fault(f"column {column.header}", "is no column known here", column.name, hint, file))
    else:
        notes.append(f"column {column.header} is not used")


def _missing(
    table: Table, joint_names: tuple[str, ...], kinds: tuple[Kind, ...], present: set[tuple[str, str]]
) -> list[Fault]:
    faults = []
    written = [column.name for column in table.columns]
    if not any(name.casefold() in TIME for name in written):
        faults.append(Fault("columns", "there is no column time [s]", None, nearest("time", written), table.file))
    for kind in kinds:
        for joint in joint_names if kind.needed else ():
            if (kind.name, joint) not in present:
                wanted = f"{kind.prefixes[0]}_{joint}"
                problem = f"the {kind.name} of joint {joint} is missing: no column {wanted} [{kind.units[0]}]"
                faults.append(Fault("columns", problem, None, nearest(wanted, written), table.file))
    return faults
