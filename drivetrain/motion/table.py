"""CSV tables with units in their headers, read cell by cell so that every fault has its row and column."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.units import split_header
from drivetrain.whole_files import read_text

LARGEST = 1e30  # in any unit, nanoseconds since 1970 too: squares of rates must not overflow
FAULTS_A_COLUMN = 5  # shown before "and so on": a column of text would else list every row


@dataclass(frozen=True, eq=False)
class Column:
    """One column."""

    header: str  # as written
    name: str  # without the unit
    unit: str  # from the brackets; empty when there are none
    values: Array  # in that unit, (N,); NaN where a cell could not be read


@dataclass(frozen=True, eq=False)
class Table:
    """A file read so far as it could be."""

    file: str  # its path
    columns: tuple[Column, ...]  # in their order
    rows: tuple[int, ...]  # line number in the file of every row of values, (N,)
    faults: tuple[Fault, ...]  # cells and headers that could not be read


def read_table(source: str | Path | StringIO) -> Table:
    """The columns of a CSV file.

    The separator is a comma, a semicolon (then numbers may have decimal commas) or a tab; empty lines and lines that
    begin with # are passed over.
    """
    if isinstance(source, StringIO):
        file, text = "", source.getvalue()
    else:
        file, text = str(source), read_text(Path(source))
    lines = _lines(text, file)
    header_line, headers = lines[0]
    faults = [
        Fault(f"row {header_line}", "two columns have this header", header, "", file)
        for header in dict.fromkeys(headers)
        if headers.count(header) > 1
    ]
    cells = []
    rows = []
    for line, row in lines[1:]:
        if len(row) != len(headers):
            faults.append(Fault(f"row {line}", f"must have {len(headers)} cells like the header", len(row), "", file))
            continue
        cells.append(row)
        rows.append(line)
    columns = []
    for index, header in enumerate(headers):
        values = _numbers([row[index] for row in cells], rows, header, file, faults)
        columns.append(Column(header, *split_header(header), values))
    return Table(file, tuple(columns), tuple(rows), tuple(faults))


def _lines(text: str, file: str) -> list[tuple[int, list[str]]]:
    """Line numbers and stripped cells of all lines that hold any."""
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
    """One line by itself: a quote left open ends with it."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(Fault(place, f"cannot be read: {error}", None, "", file)) from None


def _numbers(cells: list[str], rows: list[int], header: str, file: str, faults: list[Fault]) -> Array:
    """The column as floats; adds a fault for every cell that is none, up to a few."""
    try:
        values = np.array(cells, dtype=np.float64)
    except ValueError:
        values = np.array([_number(cell) for cell in cells])
    bad = np.flatnonzero(~(np.abs(values) <= LARGEST))  # NaN too
    values[bad] = math.nan
    for index in bad[:FAULTS_A_COLUMN]:
        place = f"row {rows[index]}, column {header}"
        large = math.isfinite(_number(cells[index]))
        problem = "is too large to calculate with" if large else "must be a finite number"
        faults.append(Fault(place, problem, cells[index], "", file))
    if len(bad) > FAULTS_A_COLUMN:
        faults.append(Fault(f"column {header}", f"{len(bad) - FAULTS_A_COLUMN} more cells like this", None, "", file))
    return values


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan
