"""CSV tables with units in their headers; each fault states its row and column."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, Faults, InputError, close_names, nearest
from drivetrain.units import number_of, split_header, to_si
from drivetrain.whole_files import read_text

LARGEST = 1e30  # in any unit, nanoseconds since 1970 included: squares of rates must not overflow
FAULTS_A_COLUMN = 5  # shown before "... more": a column of text would list every row


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a table, as written."""

    header: str  # as written
    name: str  # without the unit
    unit: str  # from the brackets; empty when there are none
    values: Array  # in that unit, (N,); NaN where a cell could not be read


@dataclass(frozen=True, eq=False)
class Table:
    """The parts of a file that could be read, and the faults of the others."""

    file: str  # its path
    columns: tuple[Column, ...]  # in their order
    rows: tuple[int, ...]  # line number in the file of every row of values, (N,)
    faults: tuple[Fault, ...]  # cells and headers that could not be read


def read_table(source: str | Path | StringIO) -> Table:
    """Read the columns of a CSV file.

    The separator is a comma, a semicolon (then numbers may have decimal commas) or a tab; empty lines and lines that
    begin with # are skipped.
    """
    if isinstance(source, StringIO):
        file, text = "", source.getvalue()
    else:
        file, text = str(source), read_text(Path(source))
    lines = _lines(text, file)
    header_line, headers = lines[0]
    faults = Faults(file)
    for header in dict.fromkeys(headers):
        if headers.count(header) > 1:
            faults.add(f"row {header_line}", "two columns have this header", header)
    cells = [row for _, row in lines[1:] if len(row) == len(headers)]
    rows = [line for line, row in lines[1:] if len(row) == len(headers)]
    wrong = [(line, row) for line, row in lines[1:] if len(row) != len(headers)]
    for line, row in wrong[:FAULTS_A_COLUMN]:
        faults.add(f"row {line}", f"must have {len(headers)} cells like the header", len(row))
    if len(wrong) > FAULTS_A_COLUMN:
        faults.add("rows", f"{len(wrong) - FAULTS_A_COLUMN} more like this")
    columns = []
    for index, header in enumerate(headers):
        if not header and not any(row[index] for row in cells):
            continue  # lines that end with a separator
        values = _numbers([row[index] for row in cells], rows, header, faults)
        columns.append(Column(header, *split_header(header), values))
    return Table(file, tuple(columns), tuple(rows), tuple(faults.found))


def _lines(text: str, file: str) -> list[tuple[int, list[str]]]:
    """Line numbers and stripped cells of all non-empty lines."""
    numbered = list(enumerate(text.splitlines(), 1))
    held = [(number, line) for number, line in numbered if line.strip(" ,;\t") and not line.lstrip().startswith("#")]
    if len(held) < 3:
        raise InputError(Fault("file", "must hold a header and at least two rows of values", len(held), "", file))
    counts = {separator: held[0][1].count(separator) for separator in (";", "\t", ",")}
    separator = max(counts, key=lambda sign: counts[sign])
    decimal_comma = separator == ";"
    lines = []
    for index, (number, line) in enumerate(held):
        stripped = [cell.strip() for cell in _cells(line, separator, f"row {number}", file)]
        lines.append((number, [c.replace(",", ".") for c in stripped] if decimal_comma and index else stripped))
    return lines


def _cells(line: str, separator: str, place: str, file: str) -> list[str]:
    """The cells of one line; parsing line by line ends an unclosed quote with its line."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(Fault(place, f"cannot be read: {error}", None, "", file)) from None


def _numbers(cells: list[str], rows: list[int], header: str, faults: Faults) -> Array:
    """The column as floats, (N,); adds faults for cells that are not finite numbers, up to ``FAULTS_A_COLUMN``."""
    try:
        values = np.array(cells, dtype=np.float64)
    except ValueError:
        values = np.array([number_of(cell) for cell in cells])
    bad = np.flatnonzero(~(np.abs(values) <= LARGEST))  # NaN too
    values[bad] = math.nan
    for index in bad[:FAULTS_A_COLUMN]:
        large = math.isfinite(number_of(cells[index]))
        problem = "is too large to calculate with" if large else "must be a finite number"
        faults.add(f"row {rows[index]}, column {header}", problem, cells[index])
    if len(bad) > FAULTS_A_COLUMN:
        faults.add(f"column {header}", f"{len(bad) - FAULTS_A_COLUMN} more cells like this")
    return values


# Assignment of columns to quantities and joints


TIME = ("time", "t")


class Kind(NamedTuple):
    """A quantity that a table may contain for each joint."""

    name: str  # name of the quantity
    prefixes: tuple[str, ...]  # of column names, before the joint's name; empty: the joint's name alone
    units: tuple[str, ...]  # SI units it may have
    needed: bool  # whether every joint must have it


class Found(NamedTuple):
    """A column converted to SI."""

    column: Column  # as in the file
    values: Array  # in SI, (N,)
    unit: str  # the SI unit


class Assigned(NamedTuple):
    """The columns of a table by quantity and joint."""

    time: Found | None  # [s]
    found: dict[tuple[str, str], Found]  # by kind and joint
    faults: list[Fault]  # units, missing and doubled columns, misspelt names
    notes: list[str]  # columns that are not used


def assigned_columns(table: Table, joint_names: tuple[str, ...], kinds: tuple[Kind, ...]) -> Assigned:
    """Assign the columns of a table to quantities and joints.

    Columns are named ``<prefix>_<joint>``, or by number in the order of the joints (``q1`` or ``q_1``); case is
    ignored. A name that is similar to one of these is a fault; any other column is noted and not used.
    """
    names = spellings(joint_names, kinds)
    faults, notes = Faults(table.file), list[str]()
    time: Found | None = None
    found: dict[tuple[str, str], Found] = {}
    for column in table.columns:
        key = column.name.casefold()
        kind, joint = names.get(key, (None, ""))
        if key in TIME and time is not None:
            faults.add(f"column {column.header}", "a second time")
        elif key in TIME:
            time = _converted(column, ("s",), faults)
        elif kind is None:
            _unknown(column, [*names, *TIME], faults, notes)
        elif (kind.name, joint) in found:
            faults.add(f"column {column.header}", f"a second {kind.name} of {joint}")
        else:
            converted = _converted(column, kind.units, faults)
            if converted is not None:
                found[kind.name, joint] = converted
    _note_missing(table, joint_names, kinds, names, faults)
    return Assigned(time, found, faults.found, notes)


def spellings(joint_names: tuple[str, ...], kinds: tuple[Kind, ...]) -> dict[str, tuple[Kind, str]]:
    """Map of every accepted column name, in lower case, to quantity and joint; joint names take precedence."""
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


def _converted(column: Column, units: tuple[str, ...], faults: Faults) -> Found | None:
    """The column converted to the first of ``units`` that fits; None, with a fault added, if none does."""
    place = f"column {column.header}"
    if not column.unit:
        example = " or ".join(f"{column.name} [{unit}]" for unit in units)
        faults.add(place, f"needs a unit in its header, such as {example}")
        return None
    for unit in units:
        with suppress(InputError):
            return Found(column, to_si(column.values, column.unit, place, unit=unit), unit)
    faults.attempt(to_si, column.values, column.unit, place, unit=units[0])
    return None


def _unknown(column: Column, known: Iterable[str], faults: Faults, notes: list[str]) -> None:
    hint = close_names(column.name.casefold(), known)
    if hint:
        faults.add(f"column {column.header}", "is no column known here", column.name, hint)
    else:
        notes.append(f"column {column.header} is not used")


def _note_missing(
    table: Table, joint_names: tuple[str, ...], kinds: tuple[Kind, ...], names: dict[str, tuple[Kind, str]],
    faults: Faults,
) -> None:  # fmt: skip
    written = [column.name for column in table.columns]
    present = [names[name.casefold()] for name in written if name.casefold() in names]
    if not any(name.casefold() in TIME for name in written):
        faults.add("columns", "there is no column time [s]", None, nearest("time", written))
    for kind in kinds:
        for joint in joint_names if kind.needed else ():
            if (kind, joint) not in present:
                wanted = f"{kind.prefixes[0]}_{joint}"
                problem = f"the {kind.name} of joint {joint} is missing: no column {wanted} [{kind.units[0]}]"
                faults.add("columns", problem, None, nearest(wanted, written))
