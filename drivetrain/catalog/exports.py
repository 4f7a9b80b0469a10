"""Import of a manufacturer's own table: its headings, units and decimal commas; parts in rows or in columns."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from drivetrain.catalog.formats import KINDS, Record
from drivetrain.catalog.importers import Basis, basis_of, no_basis, read_basis, table_text
from drivetrain.catalog.schema import CHOICE, MOTORS, NUMBER, TABLES, Column, by_name
from drivetrain.errors import Fault, Faults, InputError, nearest, raise_faults
from drivetrain.units import to_si
from drivetrain.whole_files import read_text, write_files

NAMES = ("motors", "gears", "brakes", "amplifiers")
NO_UNIT = "says no unit"  # said once a column
SILENT = ("", "-", "–", "—", "n/a", "na", "nan")  # cells without a value
_NUMBER = re.compile(r"([+\-−]?\d[\d.,'’\u00a0\u202f ]*(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+(?![\d.])")  # separated by points, beside decimal commas
_UNIT = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|,\s*([^,]*)|\bin\s+(\S+))\s*:?\s*", re.DOTALL)

# Headings that manufacturers use for our columns, in lower case: those of maxon, FAULHABER and Harmonic Drive on their
# web pages and in their catalogues, in English and German.
HEADINGS: dict[str, tuple[str, ...]] = {
    "key": (
        "key", "part number", "article number", "order number", "part no.", "order no.",
        "bestellnummer", "artikelnummer", "bestell-nr.", "artikel-nr.", "art.-nr.",
    ),
    "series": ("series", "baureihe", "size", "baugrösse", "baugröße"),
    "nominal_voltage": ("nominal voltage", "nennspannung"),
    "no_load_speed": ("no load speed", "no-load speed", "leerlaufdrehzahl"),
    "no_load_current": ("no load current", "no-load current", "leerlaufstrom"),
    "nominal_speed": ("nominal speed", "rated speed", "nenndrehzahl"),
    "nominal_torque": (
        "nominal torque (max. continuous torque)", "nominal torque", "nennmoment (max. dauerdrehmoment)",
        "nennmoment", "rated torque",
    ),
    "nominal_current": (
        "nominal current (max. continuous current)", "nominal current", "nennstrom (max. dauerbelastungsstrom)",
        "nennstrom", "rated current",
    ),
    "stall_torque": ("stall torque", "anhaltemoment"),
    "stall_current": ("stall current", "starting current", "anlaufstrom"),
    "peak_torque": ("peak torque", "maximum torque", "spitzendrehmoment", "maximales drehmoment"),
    "peak_current": ("peak current", "maximum current", "spitzenstrom", "maximalstrom"),
    "max_speed": ("max. speed", "maximum speed", "grenzdrehzahl", "maximale drehzahl"),
    "resistance": (
        "terminal resistance phase to phase", "terminal resistance", "anschlusswiderstand phase-phase",
        "anschlusswiderstand",
    ),
    "inductance": (
        "terminal inductance phase to phase", "terminal inductance", "anschlussinduktivität phase-phase",
        "anschlussinduktivität",
    ),
    "torque_constant": ("torque constant", "drehmomentkonstante"),
    "speed_constant": ("speed constant", "drehzahlkonstante"),
    "speed_torque_gradient": ("speed / torque gradient", "speed/torque gradient", "kennliniensteigung"),
    "mechanical_time_constant": ("mechanical time constant", "mechanische anlaufzeitkonstante"),
    "rotor_inertia": ("rotor inertia", "rotorträgheitsmoment"),
    "resistance_housing_ambient": ("thermal resistance housing-ambient", "thermischer widerstand gehäuse-luft"),
    "resistance_winding_housing": ("thermal resistance winding-housing", "thermischer widerstand wicklung-gehäuse"),
    "winding_time_constant": ("thermal time constant winding", "therm. zeitkonstante der wicklung"),
    "housing_time_constant": ("thermal time constant motor", "therm. zeitkonstante des motors"),
    "max_winding_temperature": ("max. winding temperature", "max. wicklungstemperatur"),
    "stages": ("number of stages", "stufenzahl"),
    "ratio": ("ratio", "reduction", "reduction ratio", "untersetzung"),
    "efficiency": ("max. efficiency", "efficiency", "max. wirkungsgrad", "wirkungsgrad"),
    "inertia": ("mass inertia", "moment of inertia", "massenträgheitsmoment"),
    "continuous_torque": ("max. continuous torque", "max. dauerdrehmoment"),
    "average_torque_limit": ("limit for average torque", "average torque", "grenze für mittleres drehmoment"),
    "repeated_peak_torque": (
        "max. intermittent torque", "limit for repeated peak torque", "repeated peak torque",
        "grenze für wiederholbares spitzendrehmoment",
    ),
    "momentary_torque": (
        "limit for momentary peak torque", "momentary peak torque", "grenze für kollisionsdrehmoment",
    ),
    "max_input_speed": (
        "max. intermittent input speed", "max. input speed", "maximum input speed", "max. eintriebsdrehzahl",
    ),
    "average_input_speed_limit": (
        "max. continuous input speed", "limit for average input speed", "mittlere eintriebsdrehzahl",
    ),
    "backlash": ("average backlash no load", "backlash", "mittleres getriebespiel unbelastet", "spiel"),
    "static_torque": ("holding torque", "static torque", "haltemoment"),
    "continuous_current": ("continuous output current", "continuous current", "dauerstrom"),
    "mass": ("weight", "mass", "gewicht", "masse"),
    "price": ("price", "preis"),
    "diameter": ("diameter", "outer diameter", "durchmesser", "aussendurchmesser", "außendurchmesser"),
    "length": ("length", "länge"),
}  # fmt: skip


class Heading(NamedTuple):
    """A manufacturer's column: its heading, the unit of its numbers if the heading gives none, a factor on them."""

    heading: str
    unit: str = ""
    times: float = 1.0


@dataclass(frozen=True)
class ExportMap:
    """Assignment of the headings of a manufacturer's table to our columns."""

    table: str = "motors"  # ``motors``, ``gears``, ``brakes`` or ``amplifiers``
    # by name of our column: the heading, or a mapping with ``heading``, ``unit`` and ``times`` (a factor)
    columns: Mapping[str, Any] = field(default_factory=dict)
    fixed: Mapping[str, Any] = field(default_factory=dict)  # by name of our column: text that is the same in all rows
    decimal: str = "."  # ``.`` or ``,``
    transposed: bool = False  # whether each part is a column, with one row per quantity

    def __post_init__(self) -> None:
        if self.table not in NAMES:
            hint = nearest(str(self.table), NAMES)
            raise InputError(Fault("table", "must be a table of a catalogue", self.table, hint))
        known, faults = by_name(TABLES[f"{self.table}.csv"]), []
        for part in ("columns", "fixed"):
            entries = getattr(self, part)
            if not isinstance(entries, Mapping):
                raise InputError(Fault(part, "must be a mapping", entries))
            for name in entries:
                if name not in known:
                    faults.append(Fault(f"{part}.{name}", "is no column", name, nearest(str(name), known)))
        headings = {name: _heading(entry) for name, entry in self.columns.items()}
        problem = "must be a heading, or have heading, and may have unit, a text, and times, a number"
        wrong = [name for name, one in headings.items() if one is None]
        faults += [Fault(f"columns.{name}", problem, self.columns[name]) for name in wrong]
        if self.decimal not in (".", ","):
            faults.append(Fault("decimal", "must be . or ,", self.decimal))
        if not isinstance(self.transposed, bool):
            faults.append(Fault("transposed", "must be true or false", self.transposed))
        raise_faults(faults)
        object.__setattr__(self, "columns", headings)


def _heading(entry: Any) -> Heading | None:
    """The heading that an entry of a map describes; None if the entry is invalid."""
    if isinstance(entry, str | int | float) and not isinstance(entry, bool):
        return Heading(str(entry))
    if not isinstance(entry, Mapping) or "heading" not in entry or set(entry) - set(Heading._fields):
        return None
    found = Heading(**entry)._replace(heading=str(entry["heading"]))
    number = isinstance(found.times, int | float) and not isinstance(found.times, bool) and math.isfinite(found.times)
    return found if number and isinstance(found.unit, str) else None


@dataclass(frozen=True)
class Imported:
    """Result of an import: the file, the number of rows written, the rows left out, and unused headings."""

    file: Path
    rows: int
    refused: tuple[Fault, ...]
    unused: tuple[str, ...]


def read_map(path: Path) -> ExportMap:
    try:
        data = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        raise InputError(Fault("map", f"cannot be read as YAML: {error}", file=str(path))) from None
    known = tuple(ExportMap.__dataclass_fields__)
    if not isinstance(data, dict):
        raise InputError(Fault("map", "must be a mapping", hint=", ".join(known), file=str(path)))
    raise_faults(Fault(str(name), "is unknown", hint=nearest(str(name), known)) for name in data if name not in known)
    return ExportMap(**data)


def import_export(
    path: str | Path, out: str | Path, given: ExportMap, *, basis: Basis = "", overwrite: bool = False
) -> Imported:
    """Write a manufacturer's table, a CSV file, as a table of the catalogue folder ``out``.

    Without ``given.columns`` its headings are recognised by the words that manufacturers use. A table that exists
    already, missing headings and faulty cells are errors; all of them are listed.
    """
    path, name = Path(path), f"{given.table}.csv"
    target = Path(out) / name
    if target.exists() and not overwrite:
        raise InputError(Fault(str(out), f"already holds {name}", hint="choose another folder or overwrite"))
    grid = _grid(path, given.decimal)
    if not given.columns and _has_decimal_commas(grid):
        given, grid = replace(given, decimal=","), _grid(path, ",")
    first_column = [cell for row in grid for cell in row[:1]]
    sideways = not given.columns and _known(first_column) > max(map(_known, grid), default=0)
    if given.transposed or sideways:
        given, grid = replace(given, transposed=True), [list(column) for column in zip_longest(*grid, fillvalue="")]
    places, columns = _places(given, grid, path), by_name(TABLES[name])
    top = max((row for row, _, _ in places.values()), default=0)
    first = next((row for row in range(top + 1, len(grid)) if any(cell.strip() for cell in grid[row])), len(grid))
    if first < len(grid) and _are_units(grid[first], places, columns):
        places = {key: (row, at, _with_unit(text, grid[first], at)) for key, (row, at, text) in places.items()}
        first += 1
    bases, faults, refused, records = read_basis(basis), Faults(str(path)), list[Fault](), list[Record]()
    for line, cells in enumerate(grid[first:], first + 1):
        if not any(cells[at].strip() for _, at, _ in places.values() if at < len(cells)):
            continue
        record = {column: str(text) for column, text in given.fixed.items()}
        for column, (_, at, heading) in places.items():
            text = cells[at] if at < len(cells) else ""
            text = faults.attempt(_cell, text, columns[column], given, heading, line) or ""
            record |= {column: text} if text else {}
        record.setdefault("key", record.get("part_number", ""))
        record["key"] = "_".join(record["key"].split())
        record.setdefault("source", path.name)
        if name == MOTORS and not basis_of(record, bases):
            refused.append(no_basis(path, line, record))
        else:
            records.append(record)
    if not records and not refused and not faults.found:
        faults.add("the file", "holds no part below its headings")
    told = dict[Any, Fault]()
    for one in faults.found:
        told.setdefault((one.problem, one.hint) if one.problem == NO_UNIT else one.place, one)
    raise_faults(told.values())
    if records:
        write_files(out, {name: table_text(records, TABLES[name])})
    taken = {at for _, at, _ in places.values()}
    unused = tuple(text for at, text in enumerate(grid[top]) if text.strip() and at not in taken)
    return Imported(target, len(records), tuple(refused), unused)


def _grid(path: Path, decimal: str) -> list[list[str]]:
    """The cells of a workbook, or of a file with separators comma, semicolon or tab, in UTF-8 or an older encoding."""
    text = read_text(path, older=True, decimal=decimal)
    lines = text.splitlines()
    counts = {mark: sum(line.count(mark) for line in lines) for mark in ("\t", ";", ",")}
    mark = next((one for one in ("\t", ";") if counts[one] >= max(1, len(lines) // 2)), ",")
    return list(csv.reader(io.StringIO(text), delimiter=mark))


def _are_units(cells: Sequence[str], places: Mapping[str, tuple[int, int, str]], columns: Mapping[str, Column]) -> bool:
    """Whether the row below the headings gives their units: it has text, but no number, in columns of numbers."""
    numbers = [at for name, (_, at, _) in places.items() if columns[name].content == NUMBER]
    found = [cells[at].strip() for at in numbers if at < len(cells)]
    return any(one.casefold() not in SILENT for one in found) and not any(map(_NUMBER.fullmatch, found))


def _with_unit(heading: str, units: Sequence[str], at: int) -> str:
    """A heading with the unit that stands below it."""
    unit = units[at].strip().strip("[]()") if at < len(units) else ""
    return f"{heading} [{unit}]" if unit else heading


def _has_decimal_commas(grid: Sequence[Sequence[str]]) -> bool:
    """Whether a number has a comma that does not separate thousands, and none has a point that does not."""
    cells = [cell.strip() for row in grid for cell in row]
    commas, points = (
        any(re.match(rf"[+-]?\d+{mark}\d", cell) and not re.match(thousands, cell) for cell in cells)
        for mark, thousands in ((",", r"[+-]?\d{1,3}(,\d{3})+\b"), (r"\.", _THOUSANDS))
    )
    return commas and not points


def _plain(heading: str) -> str:
    return " ".join(heading.casefold().split()).rstrip(": ")


def _spelled(heading: str) -> tuple[str, ...]:
    match = _UNIT.fullmatch(heading)
    return (_plain(heading),) if match is None else (_plain(heading), _plain(match[1]))


def _known(headings: Any) -> int:
    """Number of headings that are known names of our columns."""
    every = {word for words in HEADINGS.values() for word in words} | {*HEADINGS}
    return sum(bool(every & {*_spelled(one)}) for one in headings)


def _places(given: ExportMap, grid: Sequence[Sequence[str]], path: Path) -> dict[str, tuple[int, int, str]]:
    """Row, position and text of the heading of each of our columns, by column name."""
    words: dict[str, tuple[str, ...]] = {name: (_plain(entry.heading),) for name, entry in given.columns.items()}
    if not words:
        words = {name: (*HEADINGS.get(name, ()), name) for name in by_name(TABLES[f"{given.table}.csv"])}
    best: dict[str, tuple[int, int, str]] = {}
    for row, cells in enumerate(grid):
        spelled = [(at, cell, _spelled(cell)) for at, cell in enumerate(cells) if cell.strip()]
        found: dict[str, tuple[int, int, str]] = {}
        for name, wanted in words.items():
            hits = [(at, cell) for word in wanted for at, cell, one in spelled if word in one]
            if hits and name not in given.fixed:
                found[name] = (row, *hits[0])
        best = found if len(found) > len(best) else best
    seen = max(([cell for cell in row if cell.strip()] for row in grid), key=len, default=[])
    missing = [name for name in given.columns if name not in best]
    if missing or not best:
        faults = [Fault(f"columns.{name}", "no such heading", words[name][0], nearest(words[name][0], seen), str(path))
                  for name in missing]  # fmt: skip
        hint = "say which heading is which column: a map with `columns`; headings: " + ", ".join(seen[:8])
        raise InputError(faults or [Fault("the file", "has no heading that is known", hint=hint, file=str(path))])
    if "key" not in best and "part_number" not in best and "key" not in given.fixed:
        hint = "in a map: columns: {key: HEADING}, or for a single part fixed: {key: NAME}"
        raise InputError(Fault("columns.key", "is missing: no heading names the parts", hint=hint, file=str(path)))
    return best


def _cell(text: str, column: Column, given: ExportMap, heading: str, line: int) -> str:
    """A cell converted to our table: a number in the column's SI unit, or a word that the column accepts."""
    text = " ".join(text.split())
    if text.casefold() in SILENT:
        return ""
    if column.content == CHOICE:
        return KINDS.get(text, text)
    if column.content != NUMBER:
        return text
    stated: Heading = given.columns.get(column.name, Heading(heading))
    match = _NUMBER.fullmatch(text)
    number = None if match is None else _number(match[1], given.decimal)
    place = f"{'column' if given.transposed else 'row'} {line}, {heading}"
    if match is None or number is None:
        other = next((sign for sign in ".," if sign in text and sign != given.decimal), "")
        raise InputError(Fault(place, "must be a number", text, f"decimal: {other!r} in the map" if other else ""))
    own, ends = match[2].strip(), _UNIT.fullmatch(heading)
    units = [stated.unit, own, *(ends.groups()[1:] if ends else ())]
    if column.name == "ratio":
        units = [one for one in units if one and one.replace(" ", "") != ":1"]
    unit = next((one for one in units if one), "")
    if column.unit not in ("", "1") and not unit:
        hint = f"columns: {{{column.name}: {{heading: {heading}, unit: {column.unit}}}}}"
        raise InputError(Fault(place, NO_UNIT, text, hint))
    value = number * stated.times
    if column.unit:
        try:
            value = float(to_si(value, unit, place if own else heading, unit=column.unit))
        except InputError as error:
            entry = f"{{heading: {ends[1] if ends else heading}, unit: {column.unit}, times: 1}}"
            told = f"in a map, times being a factor: columns: {{{column.name}: {entry}}}"
            faults = [replace(one, hint=f"{one.hint}; {told}" if one.hint else told) for one in error.faults]
            raise InputError(faults) from None
    return f"{value:.12g}"


def _number(text: str, decimal: str) -> float | None:
    """The number in a text with thousands separators and the given decimal sign; None if it is not a number."""
    text = re.sub(r"['’\u00a0\u202f ]", "", text).replace("−", "-")
    if decimal == ",":
        if "." in text and not _THOUSANDS.match(text):
            return None  # 9.5 is not 95
        text = text.replace(".", "").replace(",", ".")
    elif re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?", text) and text.count(",") + text.count(".") > 1:
        text = text.replace(",", "")
    try:
        return float(text)
    except ValueError:
        return None
