"""Import of catalogues in other column formats into folders of our format.

An import converts columns and units. It does not check values, which is the task of the lint, but it refuses motors
whose convention of current and winding data is not stated.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from tempfile import TemporaryDirectory

from drivetrain.catalog.findings import Severity
from drivetrain.catalog.formats import Format, Record, translate
from drivetrain.catalog.linting import lint
from drivetrain.catalog.schema import (
    CURRENT_BASES,
    GEARS,
    MOTORS,
    NUMBER,
    PAIRS,
    TABLES,
    WINDING_BASES,
    Column,
)
from drivetrain.catalog.table import csv_lines
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.whole_files import write_files

Basis = str | Mapping[str, str]  # conventions, see ``read_basis``


@dataclass(frozen=True)
class Imported:
    """What an import wrote and what it left out."""

    folder: Path  # folder of the tables
    # rows written
    motors: int
    gears: int
    pairs: int  # motor-gear pairs written
    dropped_pairs: int  # pairs left out because the motor or the gear was not written
    refused: tuple[Fault, ...]  # all rows left out, with file, row and reason


@dataclass(frozen=True)
class _Contents:
    """Rows of a catalogue folder before it is written."""

    motors: tuple[Record, ...]
    gears: tuple[Record, ...]
    pairs: Mapping[str, Sequence[str]]
    pair_source: str
    dropped_pairs: int = 0


def import_rows(
    form: Format,
    folder: str | Path,
    out: str | Path,
    *,
    basis: Basis = "",
    keep_faulty: bool = True,
    overwrite: bool = False,
) -> Imported:
    """Write the catalogue folder ``out`` from the files of another column format.

    ``keep_faulty``: keep rows in which the lint finds an error. Missing files, an unknown basis and tables that exist
    already are errors.
    """
    folder, out = Path(folder), Path(out)
    present = [name for name in (MOTORS, GEARS, PAIRS) if (out / name).exists()]
    if present and not overwrite:
        hint = "choose another folder or overwrite"
        raise InputError(Fault(str(out), "already holds " + ", ".join(present), hint=hint))
    bases = read_basis(basis)
    refused: list[Fault] = []
    contents = _pruned(_read(form, folder, bases, refused))
    if not keep_faulty:
        contents = _pruned(_without_faulty(contents, refused))
    _write_folder(out, contents)
    count = sum(len(gears) for gears in contents.pairs.values())
    return Imported(out, len(contents.motors), len(contents.gears), count, contents.dropped_pairs, tuple(refused))


# ---------------------------------------------------------------- in


def read_basis(basis: Basis) -> dict[str, tuple[str, str]]:
    """Current and winding basis by manufacturer or key in lower case; the empty name applies to all others.

    ``basis`` is a text such as ``dc``, ``rms/line_line`` or ``peak/phase``, or such texts by manufacturer or key.
    """
    given = {"": basis} if isinstance(basis, str) else basis
    bases: dict[str, tuple[str, str]] = {}
    faults: list[Fault] = []
    for name, text in given.items():
        current, _, winding = text.partition("/")
        winding = winding or ("line_line" if current == "dc" else "")
        place = f"basis of {name}" if name else "basis"
        if not text and not name:
            continue
        if current not in CURRENT_BASES:
            faults.append(Fault(place, "must be dc, rms or peak", text, nearest(current, CURRENT_BASES)))
        elif winding not in WINDING_BASES:
            example = f"write {current}/line_line or {current}/phase"
            faults.append(Fault(place, "must say what resistance is measured between", text, example))
        else:
            bases[name.casefold()] = (current, winding)
    raise_faults(faults)
    return bases


def _read(form: Format, folder: Path, bases: Mapping[str, tuple[str, str]], refused: list[Fault]) -> _Contents:
    """The rows of all files of the folder; refused rows are added to ``refused``."""
    files = {name: sorted(folder.rglob(pattern)) for name, pattern in form.files.items()}
    if not any(files.values()):
        wanted = ", ".join(form.files.values())
        raise InputError(Fault(str(folder), "holds none of the files of this format", hint=f"it should hold {wanted}"))
    motors: list[Record] = []
    for path in files[MOTORS]:
        for line, record in _records(path):
            motor = translate(form, MOTORS, record, path.name)
            if _with_basis(motor, record, form, bases):
                motors.append(motor)
            else:
                refused.append(no_basis(path, line, motor))
    gears = [translate(form, GEARS, record, path.name) for path in files[GEARS] for _, record in _records(path)]
    pairs: dict[str, list[str]] = {}
    for path in files[PAIRS]:
        for motor_key, gear_keys in form.read_pairs(csv_lines(path)):
            pairs.setdefault(motor_key, []).extend(gear_keys)
    return _Contents(tuple(motors), tuple(gears), pairs, ", ".join(path.name for path in files[PAIRS]))


def _records(path: Path) -> list[tuple[int, Record]]:
    """Line number and cells by column name of every row below the header."""
    rows = csv_lines(path)
    header = [name.strip() for name in rows[0][1]] if rows else []
    return [(line, {n: c.strip() for n, c in zip(header, cells, strict=False)}) for line, cells in rows[1:]]


def _with_basis(motor: Record, record: Record, form: Format, bases: Mapping[str, tuple[str, str]]) -> bool:
    """Fill in the conventions of current and winding from user or source; False if neither states them."""
    stated = form.stated_basis(record)
    if not basis_of(motor, bases) and stated:
        motor["current_basis"], motor["winding_basis"], motor["basis_evidence"] = "dc", "line_line", stated
    return bool(motor.get("current_basis"))


def basis_of(motor: Record, bases: Mapping[str, tuple[str, str]]) -> bool:
    """Fill in the conventions of current and winding that the user stated; returns whether both are known."""
    for name in (motor.get("key", ""), motor.get("maker", ""), ""):
        if name.casefold() in bases:
            motor["current_basis"], motor["winding_basis"] = bases[name.casefold()]
            motor["basis_evidence"] = "stated by the user on import"
            break
    return bool(motor.get("current_basis") and motor.get("winding_basis"))


def no_basis(path: Path, line: int, motor: Record) -> Fault:
    problem = f"motor {motor['key']} refused: the source does not say what its ampere is"
    name = motor.get("maker") or motor["key"]
    hint = f"state it: --basis dc, rms/line_line, rms/phase, peak/...; or --basis {name}=dc"
    return Fault(f"row {line}", problem, hint=hint, file=str(path))


# ---------------------------------------------------------------- filtering


def _pruned(contents: _Contents) -> _Contents:
    """The contents without pairs of which a part is missing; patterns such as ``FH_32A_R*`` are expanded."""
    motors = {motor["key"] for motor in contents.motors}
    gears = [gear["key"] for gear in contents.gears]
    known = set(gears)
    expanded: dict[str, list[str]] = {}
    kept: dict[str, Sequence[str]] = {}
    dropped = contents.dropped_pairs
    for motor, listed in contents.pairs.items():
        matches: dict[str, None] = {}
        for pattern in listed:
            if "*" in pattern and pattern not in expanded:
                expanded[pattern] = [gear for gear in gears if fnmatchcase(gear, pattern)]
            matches.update(dict.fromkeys(expanded.get(pattern, [pattern])))
        present = [gear for gear in matches if gear in known] if motor in motors else []
        dropped += len(matches) - len(present)
        if present:
            kept[motor] = present
    return replace(contents, pairs=kept, dropped_pairs=dropped)


def _without_faulty(contents: _Contents, refused: list[Fault]) -> _Contents:
    """The contents without rows in which the lint finds an error; these are added to ``refused``."""
    with TemporaryDirectory() as folder:
        _write_folder(Path(folder), contents)
        faults = [fault for fault in lint(folder) if fault.severity is Severity.ERROR]
    bad: dict[str, set[int]] = {MOTORS: set(), GEARS: set()}
    for fault in faults:
        name = Path(fault.file).name
        bad.get(name, set()).add(fault.row)
        refused.append(Fault(f"{name}: {fault.key}, {fault.column}", f"refused: {fault.problem}", fault.printed))
    motors = tuple(row for line, row in enumerate(contents.motors, 2) if line not in bad[MOTORS])
    gears = tuple(row for line, row in enumerate(contents.gears, 2) if line not in bad[GEARS])
    return replace(contents, motors=motors, gears=gears)


# ---------------------------------------------------------------- out


def _write_folder(out: Path, contents: _Contents) -> None:
    """Write all tables, or none if one of them cannot be written."""
    pairs = [
        {"motor_key": motor, "gear_keys": " ".join(gears), "source": contents.pair_source}
        for motor, gears in contents.pairs.items()
    ]
    tables = {MOTORS: contents.motors, GEARS: contents.gears, PAIRS: pairs}
    write_files(out, {name: table_text(records, TABLES[name]) for name, records in tables.items()})


def table_text(records: Iterable[Mapping[str, str]], columns: Sequence[Column]) -> str:
    """CSV text of a table, with the SI unit of each number column in the header."""
    rows = list(records)
    used = [column for column in columns if column.needed or any(row.get(column.name) for row in rows)]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    units = [column.unit if column.content == NUMBER and column.unit != "1" else "" for column in used]
    writer.writerow([one.name + (f" [{unit}]" if unit else "") for one, unit in zip(used, units, strict=True)])
    writer.writerows([[row.get(column.name, "") for column in used] for row in rows])
    return stream.getvalue()
