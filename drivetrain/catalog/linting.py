"""The lint of a catalogue folder: all faults of texts, units, ranges, duplicates, sources and physics."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from drivetrain.catalog.findings import Finding, Relation, Severity, conflicts, error, in_order, numbers, warning
from drivetrain.catalog.gear_rules import check_families, check_gear
from drivetrain.catalog.motor_rules import check_motor
from drivetrain.catalog.schema import AMPLIFIERS, BRAKES, GEARS, MOTORS, PAIRS, PRICES, TABLES
from drivetrain.catalog.table import Cell, Row, Table, read_table, tables_in
from drivetrain.errors import Fault, InputError

# Consistency rules for the values of one brake, one amplifier or one price


UNDATED = "not dated"  # beginning of the date of a price whose source gives no date
COIL = Relation("power", "voltage times current", lambda v: v["voltage"] * v["current"])


def check_brake(cells: Mapping[str, Cell]) -> list[Finding]:
    """All inconsistencies in the row of one brake."""
    values = numbers(cells)
    stops = in_order(values, (error, "energy_per_stop", "energy_per_hour", ""))
    return [*conflicts(values, [COIL]), *stops]


def check_amplifier(cells: Mapping[str, Cell]) -> list[Finding]:
    values = numbers(cells)
    orders = ((error, "continuous_current", "peak_current", ""), (error, "min_voltage", "max_voltage", ""))
    found = list(in_order(values, *orders))
    if "peak_time" in values and "thermal_time_constant" in values:
        problem = "is given together with a thermal time constant: two models of the same overload"
        found.append(warning("peak_time", problem))
    if not cells.get("basis_evidence"):
        found.append(warning("basis_evidence", "is empty: say how the kind of ampere is known"))
    return found


def check_price(cells: Mapping[str, Cell]) -> list[Finding]:
    found = list(in_order(numbers(cells), (error, "price", "price_to", "")))
    if not re.fullmatch("[A-Z]{3}", str(cells.get("currency") or "")):
        found.append(error("currency", "must be three letters such as EUR or USD"))
    if not re.match(rf"(?:19|20)\d\d\b|{UNDATED}", str(cells.get("date") or "")):
        found.append(warning("date", f"must begin with the year, as 2026-06, or with {UNDATED}"))
    return found


# All rules together


Rules = Callable[[Mapping[str, Cell]], list[Finding]]
RULES: dict[str, Rules] = {
    MOTORS: check_motor, GEARS: check_gear, BRAKES: check_brake, AMPLIFIERS: check_amplifier, PRICES: check_price,
}  # fmt: skip
PARTS = (MOTORS, GEARS, BRAKES, AMPLIFIERS)  # tables whose keys a price may refer to


@dataclass(frozen=True)
class LintFault:
    """One fault of a catalogue."""

    file: str  # path of the table
    row: int  # as an editor counts; 1 is the header
    column: str  # header of the column as written; empty if the whole row is meant
    key: str  # key of the part; empty for a fault of the header row
    severity: Severity  # ERROR: cannot be right; WARNING: unusual
    problem: str  # message
    printed: object = None  # value in the file, in the header's unit
    # the value that the rest of the row implies, in the header's unit; None if it implies no single value
    predicted: float | None = None
    hint: str = ""  # the fix

    def __str__(self) -> str:
        place = f"{self.file}: row {self.row}" + (f", column {self.column}" if self.column else "")
        who = f" ({self.key})" if self.key else ""
        values = "" if self.printed is None else f", printed {_short(self.printed)}"
        values += "" if self.predicted is None else f", predicted {_short(self.predicted)}"
        return f"{place}{who}: {self.severity}: {self.problem}{values}" + (f"; {self.hint}" if self.hint else "")


def lint(folder: str | Path, *, beside: Iterable[str | Path] = ()) -> list[LintFault]:
    """Find all faults of a catalogue folder.

    Args:
        folder: Folder with motors.csv, gears.csv or other catalogue tables.
        beside: Further folders to whose keys its rows may refer.

    Returns:
        Errors and warnings with file, row, column and value; empty if there are none.

    Raises:
        InputError: The folder contains none of the tables, or one of them is not text.
    """
    tables = _tables(Path(folder))
    if not tables:
        problem = "holds no catalogue table" if Path(folder).exists() else "is no folder"
        raise InputError(Fault(str(folder), problem, hint="it should hold " + ", ".join(TABLES)))
    faults = [fault for table in tables.values() for fault in _table_faults(table)]
    for name, rules in RULES.items():
        if name in tables:
            faults += _row_faults(tables[name], rules)
    if GEARS in tables:
        families = check_families(tables[GEARS].rows)
        faults += [_as_fault(tables[GEARS], row, finding) for row, finding in families]
    groups = [tables, *(_tables(Path(other)) for other in beside)]
    if PAIRS in tables:
        faults += _pair_faults(tables[PAIRS], groups)
    if PRICES in tables:
        faults += _price_faults(tables[PRICES], groups)
    order = {str(table.path): index for index, table in enumerate(tables.values())}
    return sorted(faults, key=lambda fault: (order[fault.file], fault.row))


def _tables(folder: Path) -> dict[str, Table]:
    return {name: read_table(folder / name, TABLES[name]) for name in tables_in(folder)}


def _table_faults(table: Table) -> Iterator[LintFault]:
    keys = {row.line: row.text("key") or row.text("motor_key") for row in table.rows}
    for fault in table.faults:
        yield LintFault(
            str(table.path), fault.line, fault.header, keys.get(fault.line, ""), Severity.ERROR, fault.problem,
            fault.value, hint=fault.hint,
        )  # fmt: skip


def _row_faults(table: Table, rules: Rules) -> list[LintFault]:
    """Faults of the rows of one table: physics, missing source, and duplicates."""
    faults: list[LintFault] = []
    for row in table.rows:
        faults += [_as_fault(table, row, finding) for finding in rules(row.cells)]
    findings = [*_provenance(table.rows), *_duplicates(table.rows)]
    return faults + [_as_fault(table, row, finding) for row, finding in findings]


def _provenance(rows: Sequence[Row]) -> Iterator[tuple[Row, Finding]]:
    """Rows without a source, and one warning for all rows whose source has no date."""
    undated = []
    for row in rows:
        if not row.text("source"):
            yield row, error("source", "is empty: say where the numbers were read")
        elif not (row.text("edition") or row.text("date")):
            undated.append(row)
    if undated:
        others = len(undated) - 1
        more = f" here and in {others} more row{'s' * (others > 1)}" if others else ""
        problem = f"is empty{more}: data sheets change by up to 10 % from one edition to the next"
        yield undated[0], warning("edition", problem)


def _duplicates(rows: Sequence[Row]) -> Iterator[tuple[Row, Finding]]:
    """Rows with the manufacturer, part number, ratio and resistance of an earlier row but another key."""
    first: dict[tuple[object, ...], str] = {}
    for row in rows:
        part = row.text("part_number")
        mark = (row.text("maker"), part, row.number("ratio"), row.number("resistance"))
        earlier = first.setdefault(mark, row.text("key"))
        if part and earlier != row.text("key"):
            yield row, warning("part_number", f"the same part has a row with the key {earlier}")


def _as_fault(table: Table, row: Row, finding: Finding, part: str | None = None) -> LintFault:
    """A finding with its place in the file and its values in the file's units; ``part``: of a cell with several."""
    cell, predicted = row.cells.get(finding.column), finding.predicted
    printed: object = cell if part is None else part
    if isinstance(printed, float):
        printed = table.as_printed(finding.column, printed)
    if predicted is not None:
        predicted = table.as_printed(finding.column, predicted)
    header, key = table.headers.get(finding.column, finding.column), row.text("key") or row.text("motor_key")
    return LintFault(str(table.path), row.line, header, key, finding.severity, finding.problem, printed, predicted)


def _pair_faults(table: Table, groups: Sequence[Mapping[str, Table]]) -> Iterator[LintFault]:
    """Pairs with unknown or repeated keys; keys are not checked if no folder has the table of motors or gears."""
    motors, gears = _keys(groups, MOTORS), _keys(groups, GEARS)
    for row in table.rows:
        motor, listed = row.text("motor_key"), row.text("gear_keys").split()
        if motors is not None and motor not in motors:
            yield _as_fault(table, row, error("motor_key", "no motor has this key"))
        for key in listed:
            if gears is not None and key not in gears:
                yield _as_fault(table, row, error("gear_keys", "no gear has this key"), key)
        for key in sorted(key for key, times in Counter(listed).items() if times > 1):
            yield _as_fault(table, row, warning("gear_keys", "is given twice in this row"), key)


def _price_faults(table: Table, groups: Sequence[Mapping[str, Table]]) -> Iterator[LintFault]:
    """Prices with a key that no table of parts has."""
    known = {key for name in PARTS for key in _keys(groups, name) or ()}
    for row in table.rows:
        key = row.text("part_key")
        if key and known and key not in known:
            yield _as_fault(table, row, error("part_key", "no part has this key"))


def _keys(groups: Iterable[Mapping[str, Table]], name: str) -> Collection[str] | None:
    """The keys of one table in all folders; None if no folder has the table."""
    found = [group[name] for group in groups if name in group]
    return {row.text("key") for table in found for row in table.rows} if found else None


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else repr(value)
