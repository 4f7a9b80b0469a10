"""One catalogue table read from CSV: cells in SI, and all faults of the file with row and column."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivetrain.catalog.schema import CHOICE, NUMBER, TABLES, Column, by_name
from drivetrain.drive.amplifier import line_to_line, to_dc, torque_constant_to_dc
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.units import from_si, number_of, split_header, to_si
from drivetrain.whole_files import is_there, is_workbook, read_text, sheet_names

Cell = float | str | None
NEVER_ZERO = ("ratio",)  # columns whose range includes negative numbers, so that it does not exclude zero
WHOLE = ("stages",)


@dataclass(frozen=True)
class Row:
    """One row of a table."""

    line: int  # line number in the file; the header is line 1
    cells: Mapping[str, Cell]  # value by column name, numbers in SI; None if empty or faulty

    def number(self, name: str) -> float | None:
        value = self.cells.get(name)
        return value if isinstance(value, float) else None

    def text(self, name: str) -> str:
        value = self.cells.get(name)
        return value if isinstance(value, str) else ""


@dataclass(frozen=True)
class CellFault:
    """One fault of a table with its place."""

    line: int  # line number in the file
    header: str  # header of the column as written; empty if the whole row is meant
    problem: str  # message: what is wrong and what is allowed
    value: object = None  # the faulty value
    hint: str = ""  # the fix


@dataclass(frozen=True)
class Table:
    """Contents of one CSV file."""

    path: Path  # the file
    columns: Sequence[Column]  # that it may have
    headers: Mapping[str, str]  # each known column's header as written, by column name
    units: Mapping[str, str]  # each number column's unit as written, by column name
    rows: tuple[Row, ...]  # in file order
    faults: tuple[CellFault, ...]  # all faults of the file

    def fault(self, found: CellFault) -> Fault:
        """A fault of this table, for an error message."""
        place = f"row {found.line}" + (f", column {found.header}" if found.header else "")
        return Fault(place, found.problem, found.value, found.hint, str(self.path))

    def at(self, row: Row, name: str, problem: str, value: object = None, hint: str = "") -> Fault:
        """A fault at one cell of this table."""
        return self.fault(CellFault(row.line, self.headers.get(name, name), problem, value, hint))

    def as_printed(self, name: str, value: float) -> float:
        unit = by_name(self.columns)[name].unit
        return float(from_si(value, unit, self.units.get(name, ""))) if unit else value


@dataclass(frozen=True)
class _Header:
    """One header cell that names a known column."""

    position: int
    text: str
    unit: str
    column: Column


def tables_in(folder: Path) -> list[str]:
    """Names of the catalogue tables in a folder, or of the sheets in a workbook."""
    if is_workbook(folder) and is_there(folder):
        sheets = sheet_names(folder)
        return [name for name in TABLES if Path(name).stem in sheets]
    return [name for name in TABLES if is_there(folder / name)]


def read_table(path: Path, columns: Sequence[Column]) -> Table:
    """Read a CSV file; faults are collected in the table instead of raised."""
    lines = csv_lines(path)
    if not lines:
        hint = "columns: " + ", ".join(column.name for column in columns)
        missing = CellFault(1, "", "must be a header row with the column names", hint=hint)
        return Table(path, columns, {}, {}, (), (missing,))
    headers, faults = _read_headers(lines[0][1], columns)
    body = lines[1:]
    faults += _width_faults(len(lines[0][1]), body)
    parsed: dict[str, list[Cell]] = {}
    for header in headers:
        texts = [cells[header.position].strip() if header.position < len(cells) else "" for _, cells in body]
        parsed[header.column.name] = _read_column(header, [line for line, _ in body], texts, faults)
    rows = tuple(Row(line, {name: parsed[name][i] for name in parsed}) for i, (line, _) in enumerate(body))
    faults += _key_faults(rows)
    names = {header.column.name: header.text for header in headers}
    units = {header.column.name: header.unit for header in headers if header.column.content == NUMBER}
    return Table(path, columns, names, units, rows, tuple(sorted(faults, key=lambda fault: fault.line)))


def csv_lines(path: Path) -> list[tuple[int, list[str]]]:
    """The non-empty records of a CSV file, each with the number of the line on which it starts."""
    # strict: otherwise an unclosed quote would include the rest of the file without an error
    reader = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    records: list[tuple[int, list[str]]] = []
    start = 1
    try:
        for cells in reader:
            records.append((start, cells))
            start = reader.line_num + 1
    except csv.Error as error:
        raise InputError(Fault(f"row {start}", f"cannot be read as CSV: {error}", file=str(path))) from None
    return [record for record in records if any(cell.strip() for cell in record[1])]


def _read_headers(cells: Sequence[str], columns: Sequence[Column]) -> tuple[list[_Header], list[CellFault]]:
    """The header cells that name known columns, and the faults of the header row."""
    known = by_name(columns)
    found: dict[str, _Header] = {}
    faults: list[CellFault] = []
    for position, cell in enumerate(cells):
        name, unit = split_header(cell)
        text = cell.strip() or f"number {position + 1}"
        if name not in known:
            hint = "separate the cells with commas" if ";" in cell else _meant(name, unit, known)
            faults.append(CellFault(1, text, "unknown column", hint=hint))
        elif name in found:
            faults.append(CellFault(1, text, "the same column stands twice"))
        else:
            found[name] = _Header(position, text, unit, known[name])
    for name, column in known.items():
        if column.needed and name not in found:
            faults.append(CellFault(1, name, "this column is missing", hint=_wanted(column)))
    return list(found.values()), faults


def _meant(name: str, unit: str, known: Mapping[str, Column]) -> str:
    """Suggestion for an unknown heading: similar names, or else columns that accept its unit."""
    hint = nearest(name, known)
    alike = [one.name for one in known.values() if unit and one.content == NUMBER and _takes(one, unit)]
    return hint if hint.startswith("did") or not alike else f"columns that take {unit}: {', '.join(alike)}"


def _takes(column: Column, unit: str) -> bool:
    try:
        to_si(1.0, unit, unit=column.unit)
    except InputError:
        return False
    return bool(column.unit)


def _wanted(column: Column) -> str:
    """Description of what a missing column must contain."""
    return column.why_needed or " or ".join(column.choices) or column.meaning


def _width_faults(width: int, body: Iterable[tuple[int, list[str]]]) -> list[CellFault]:
    return [
        CellFault(line, "", f"has {len(cells)} cells, the header has {width}")
        for line, cells in body
        if any(cell.strip() for cell in cells[width:])
    ]


def _read_column(header: _Header, lines: Sequence[int], texts: Sequence[str], faults: list[CellFault]) -> list[Cell]:
    """The cells of one column; adds to ``faults``."""
    values: Sequence[Cell]
    problems: Iterator[tuple[int, str, str]]
    column = header.column
    if column.content == NUMBER:
        values, problems = _read_numbers(header, texts, faults)
    else:
        values, problems = texts, _choice_problems(column, texts)
    cells: list[Cell] = [value if text else None for value, text in zip(values, texts, strict=True)]
    for index, problem, hint in problems:
        cells[index] = None
        faults.append(CellFault(lines[index], header.text, problem, texts[index], hint))
    if column.needed:
        empty = [line for line, text in zip(lines, texts, strict=True) if not text]
        faults += [CellFault(line, header.text, "is empty but needed", hint=_wanted(column)) for line in empty]
    return cells


def _choice_problems(column: Column, texts: Sequence[str]) -> Iterator[tuple[int, str, str]]:
    """Index, problem and hint of cells with a word that is not allowed."""
    if column.content != CHOICE:
        return
    for index, text in enumerate(texts):
        if text and text not in column.choices:
            yield index, "must be one of " + ", ".join(column.choices), nearest(text, column.choices)


def _read_numbers(
    header: _Header, texts: Sequence[str], faults: list[CellFault]
) -> tuple[Sequence[Cell], Iterator[tuple[int, str, str]]]:
    """SI values (NaN if unreadable) and the problems of single cells; an unsuitable unit is a fault of the header."""
    raw = np.array([math.nan if "_" in text else number_of(text) for text in texts], dtype=np.float64)
    values = raw
    if header.column.unit:
        if not header.unit and header.column.unit != "1":
            problem = f"needs a unit in its header, such as {header.column.name} [{header.column.unit}]"
            faults.append(CellFault(1, header.text, problem))
            return [None] * len(texts), iter(())
        try:
            values = to_si(raw, header.unit, unit=header.column.unit)
        except InputError as error:
            faults += [CellFault(1, header.text, fault.problem, hint=fault.hint) for fault in error.faults]
            return [None] * len(texts), iter(())
    return [float(value) for value in values], _number_problems(header, texts, raw, values)


def _number_problems(
    header: _Header, texts: Sequence[str], raw: np.ndarray, values: np.ndarray
) -> Iterator[tuple[int, str, str]]:
    """Index, problem and hint of cells that are not a number, or not a plausible one."""
    column = header.column
    bounds = np.array([column.low, column.high])
    low, high = from_si(bounds, column.unit, header.unit) if column.unit else bounds
    for index, text in enumerate(texts):
        if not text:
            continue
        if not math.isfinite(raw[index]):
            yield index, "must be a number", _number_hint(text)
        elif values[index] == 0.0 and column.low > 0.0:
            yield index, "cannot be 0", "leave the cell empty when it is unknown"
        elif not column.low <= values[index] <= column.high:
            problem = f"must lie between {low:.4g} and {high:.4g} {header.unit}"
            yield index, problem.rstrip(), "check the header's unit"
        elif column.name in NEVER_ZERO and values[index] == 0.0:
            yield index, "cannot be 0", ""
        elif column.name in WHOLE and values[index] != round(values[index]):
            yield index, "must be a whole number", ""


def _number_hint(text: str) -> str:
    if "," in text:
        return "write a decimal point and no thousands separator"
    if text.lower() in ("nan", "inf", "-inf", "-", "n/a", "na", "none", "?"):
        return "leave the cell empty when it is unknown"
    if ":" in text:
        return "write 10:1 as 10"
    digits = any(letter.isdigit() for letter in text)
    return "write the number alone; a unit belongs in the header, not in the cell" if digits else ""


def _key_faults(rows: Iterable[Row]) -> list[CellFault]:
    """Faults of keys that an earlier row has, or that contain spaces, which separate keys in a list of pairs."""
    first: dict[str, int] = {}
    faults: list[CellFault] = []
    for row in rows:
        key = row.text("key")
        if key and first.setdefault(key, row.line) != row.line:
            faults.append(CellFault(row.line, "key", f"the same key stands in row {first[key]}", key))
        if len(key.split()) > 1:
            faults.append(CellFault(row.line, "key", "must not hold spaces", key, "write _ instead"))
    return faults


# Conversion from the convention of a data sheet to the equivalent DC machine between two terminals


CURRENTS = ("no_load_current", "nominal_current", "stall_current", "peak_current", "continuous_current")
PHASE_VALUES = ("resistance", "inductance")


def dc_equivalent(cells: Mapping[str, Cell]) -> dict[str, Cell]:
    """Cells with currents, torque constant, resistance and inductance converted to the DC equivalent."""
    converted = dict(cells)
    basis = cells.get("current_basis")
    for name in CURRENTS:
        value = cells.get(name)
        if isinstance(basis, str) and isinstance(value, float):
            converted[name] = to_dc(value, basis)
    constant = cells.get("torque_constant")
    if isinstance(basis, str) and isinstance(constant, float):
        converted["torque_constant"] = torque_constant_to_dc(constant, basis)
    for name in PHASE_VALUES:
        value = cells.get(name)
        if cells.get("winding_basis") == "phase" and isinstance(value, float):
            converted[name] = line_to_line(value)
    return converted
