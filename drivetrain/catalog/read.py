"""Reading catalogue folders: motors, gears and their compatible pairs; brakes, amplifiers and prices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arrays import Array, Mask
from drivetrain.catalog.price import Price
from drivetrain.catalog.schema import AMPLIFIERS, BRAKES, GEARS, MOTORS, PAIRS, PRICES, TABLES
from drivetrain.catalog.table import Row, Table, dc_equivalent, read_table, tables_in
from drivetrain.drive.amplifier import AmplifierSheet
from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.units import Factor, Names
from drivetrain.whole_files import is_there, shipped

CONFIRM = "Catalogue rows are for sizing studies: confirm each against the maker's current data sheet."
MOST_HINTS = 10  # faults with a suggestion; the search for similar names is slow
MOST_NAMED = 12  # largest number of keys in a note


@dataclass(frozen=True, eq=False)
class Catalog:
    """The rows of one or more catalogue folders, in SI.

    Attributes:
        motors, gears: By key, in file order.
        pairs: Published combinations: gear keys by motor key.
        notes: Warnings and the origin of the rows, for the report.
        brakes, amplifiers: By key, in file order.
        prices: In file order; a part may have several prices, and need not be in another table.
    """

    motors: dict[str, Motor] = field(default_factory=dict)
    gears: dict[str, Gear] = field(default_factory=dict)
    pairs: dict[str, frozenset[str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    brakes: dict[str, Brake] = field(default_factory=dict)
    amplifiers: dict[str, AmplifierSheet] = field(default_factory=dict)
    prices: tuple[Price, ...] = ()

    def __repr__(self) -> str:
        parts = ("motors", "gears", "brakes", "amplifiers")
        return f"Catalog({', '.join(f'{len(getattr(self, part))} {part}' for part in parts)})"


@dataclass(frozen=True)
class FramelessRule:
    """Geometric rule for pairs of frameless motors and gears without published compatibility.

    A frameless motor is integrated with its gear, so compatibility is a question of space: the stator must fit within
    the outline of the gear. The outer diameter of housed strain-wave units is about 1.5 to 2 times the pitch diameter
    of their teeth, which is size/10 inch. If only the gear's outer diameter is known, the motor must not exceed it.

    Attributes:
        max_diameter_ratio: Largest ratio of motor outer diameter to gear pitch diameter.
        min_diameter_ratio: Smallest such ratio: a much smaller motor cannot use the gear and only lengthens the search.
        kinds: Kinds of gears that are combined with frameless motors.
    """

    max_diameter_ratio: Factor = 1.7
    min_diameter_ratio: Factor = 0.5
    kinds: Names = ("strain_wave", "rv")

    def __post_init__(self) -> None:
        if not 0.0 <= self.min_diameter_ratio <= self.max_diameter_ratio:
            problem = "must be 0 or more, and the smallest at most the largest"
            raise InputError(Fault("frameless rule", problem, (self.min_diameter_ratio, self.max_diameter_ratio)))


# ---------------------------------------------------------------- reading


def read_catalog(*folders: str | Path) -> Catalog:
    """Read motors, gears, published pairs, brakes, amplifiers and prices of one or more folders.

    Values are in SI and in the DC-equivalent convention; prices are in their own currency.

    Args:
        folders: Each with ``motors.csv``, ``gears.csv``, ``compatibility.csv``, ``brakes.csv``, ``amplifiers.csv`` and
            ``prices.csv``, or some of them, or an Excel workbook with sheets of these names. A row replaces the row of
            the same key in an earlier folder; prices of all folders are kept. None: the shipped catalogue.

    Returns:
        The rows, with notes on what was replaced.

    Raises:
        InputError: Every fault in any of the files, with file, row and column.
    """
    tables, faults = _read_tables([Path(folder) for folder in folders] or [shipped("catalogs")])
    notes: list[str] = []
    kinds = ((MOTORS, Motor), (GEARS, Gear), (BRAKES, Brake), (AMPLIFIERS, AmplifierSheet))
    motors, gears, brakes, amplifiers = (_merge(tables[name], kind, faults, notes) for name, kind in kinds)
    pairs = _read_pairs(tables[PAIRS], motors, gears, faults)
    prices = [price for table in tables[PRICES] for price in _sheets(table, Price, faults)]
    raise_faults(faults)
    return Catalog(motors, gears, pairs, (*notes, CONFIRM), brakes, amplifiers, tuple(prices))


def _read_tables(folders: Iterable[Path]) -> tuple[dict[str, list[Table]], list[Fault]]:
    """The tables of all folders by file name, and the faults of their headers and cells."""
    tables: dict[str, list[Table]] = {name: [] for name in TABLES}
    faults: list[Fault] = []
    for folder in folders:
        present = tables_in(folder)
        if not present:
            problem = "holds no catalogue table" if is_there(folder, Path.exists) else "is no folder"
            faults.append(Fault(str(folder), problem, hint="it should hold " + ", ".join(TABLES)))
        for name in present:
            tables[name].append(read_table(folder / name, TABLES[name]))
    faults += [fault for group in tables.values() for table in group for fault in map(table.fault, table.faults)]
    return tables, faults


def _merge(tables: Iterable[Table], kind: Any, faults: list[Fault], notes: list[str]) -> dict[str, Any]:
    """The parts of all tables by key; adds to ``faults`` and ``notes``."""
    merged: dict[str, Any] = {}
    for table in tables:
        sheets = {sheet.key: sheet for sheet in _sheets(table, kind, faults)}
        replaced = [key for key in sheets if key in merged]
        merged |= sheets
        makers = Counter(row.text("maker") or "no maker stated" for row in table.rows)
        listed = ", ".join(f"{maker} {count}" for maker, count in makers.items())
        notes.append(f"{_name(table)}: {len(table.rows)} rows ({listed}).")
        if replaced:
            more = f" and {len(replaced) - MOST_NAMED} more" if len(replaced) > MOST_NAMED else ""
            notes.append(f"{_name(table)} replaces rows of earlier folders: {', '.join(replaced[:MOST_NAMED])}{more}.")
    return merged


def _name(table: Table) -> str:
    return f"{table.path.parent.name}/{table.path.name}"


def _sheets(table: Table, kind: Any, faults: list[Fault]) -> list[Any]:
    """The rows of a table as parts; adds to ``faults``."""
    sheets = []
    for row in table.rows if not table.faults else ():
        try:
            sheets.append(_sheet(row, kind, _name(table)))
        except InputError as error:
            faults += [table.at(row, fault.place, fault.problem, fault.value, fault.hint) for fault in error.faults]
    return sheets


def _sheet(row: Row, kind: Any, file: str) -> Any:
    """One row as an object of type ``kind``, such as ``Motor`` or ``Gear``."""
    known, cells = {item.name for item in fields(kind)}, dc_equivalent(row.cells)
    values: dict[str, Any] = {name: cell for name, cell in cells.items() if name in known and cell is not None}
    if "frameless" in values:
        values["frameless"] = values["frameless"] == "yes"
    if "stages" in values:
        values["stages"] = int(values["stages"])
    origin = "; ".join(filter(None, (row.text("edition"), row.text("source"), row.text("notes"))))
    values["source"] = f"{file} row {row.line}" + (f": {origin}" if origin else "")
    return kind(**values)


def _read_pairs(
    tables: Iterable[Table], motors: Mapping[str, Motor], gears: Mapping[str, Gear], faults: list[Fault]
) -> dict[str, frozenset[str]]:
    """Gear keys by motor key; unknown keys are faults, unless the tables of the parts are faulty themselves."""
    pairs: dict[str, frozenset[str]] = {}
    complete = not faults
    for table in tables:
        for row in table.rows:
            motor, listed = row.text("motor_key"), row.text("gear_keys").split()
            pairs[motor] = pairs.get(motor, frozenset()).union(listed)
            if complete:
                faults += _unknown_keys(table, row, "motor_key", [motor], motors, len(faults))
                faults += _unknown_keys(table, row, "gear_keys", listed, gears, len(faults))
    return pairs


def _unknown_keys(
    table: Table, row: Row, column: str, keys: Iterable[str], known: Collection[str], so_far: int
) -> list[Fault]:
    """Faults of keys that no table has, the first ``MOST_HINTS`` with the nearest known key.

    ``so_far`` is the number of such faults before these.
    """
    unknown = [key for key in keys if key not in known]
    what = f"no {column.split('_')[0]} has this key"
    hints = [nearest(key, known) if so_far + i < MOST_HINTS else "" for i, key in enumerate(unknown)]
    return [table.at(row, column, what, key, hint) for key, hint in zip(unknown, hints, strict=True)]


# ---------------------------------------------------------------- pairing


def fits(motor: Motor, gear: Gear, rule: FramelessRule) -> bool:
    """Whether a frameless motor fits a gear by the geometric rule."""
    return motor.frameless and gear.kind in rule.kinds and bool(_inside(motor, *_diameters([gear]), rule).all())


def _diameters(gears: Sequence[Gear]) -> tuple[Array, Array]:
    """Pitch and outer diameters of gears [m], (N,) each; NaN where unknown."""
    pitch = np.array([gear.pitch_diameter for gear in gears], dtype=np.float64)
    return pitch, np.array([gear.diameter for gear in gears], dtype=np.float64)


def _inside(motor: Motor, pitch: Array, diameter: Array, rule: FramelessRule) -> Mask:
    """Into which gears a motor fits by its diameter, (N,); NaN, for an unknown diameter, satisfies no rule."""
    own = np.nan if motor.diameter is None else motor.diameter
    ratio = own / pitch
    by_pitch = (rule.min_diameter_ratio <= ratio) & (ratio <= rule.max_diameter_ratio)
    return np.where(np.isnan(pitch), own <= diameter, by_pitch)


def compatible_pairs(
    catalog: Catalog,
    motors: Iterable[str] | None = None,
    gears: Collection[str] | None = None,
    rule: FramelessRule = FramelessRule(),
) -> list[tuple[str, str]]:
    """The possible motor-gear pairs: published pairs, and pairs of frameless motors by the geometric rule.

    Motors or gears of None are all of them; keys that the catalogue does not have are faults.
    """
    motor_keys = list(catalog.motors) if motors is None else list(motors)
    gear_keys = list(catalog.gears) if gears is None else list(gears)
    tables = (("motor", motor_keys, catalog.motors), ("gear", gear_keys, catalog.gears))
    raise_faults(
        Fault(f"{what} key", "is not in the catalogue", key, nearest(key, known))
        for what, keys, known in tables
        for key in keys
        if key not in known
    )
    order = {key: index for index, key in enumerate(gear_keys)}
    around = [index for index, key in enumerate(gear_keys) if catalog.gears[key].kind in rule.kinds]
    pitch, diameter = _diameters([catalog.gears[gear_keys[index]] for index in around])
    pairs: list[tuple[str, str]] = []
    for key in motor_keys:
        chosen = {order[gear] for gear in catalog.pairs.get(key, ()) if gear in order}
        if catalog.motors[key].frameless:
            chosen.update(around[i] for i in np.flatnonzero(_inside(catalog.motors[key], pitch, diameter, rule)))
        pairs += [(key, gear_keys[index]) for index in sorted(chosen)]
    return pairs
