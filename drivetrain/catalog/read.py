"""Catalogue folders: motors, gears and which of them fit each other; brakes, amplifiers and prices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

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
MOST_HINTS = 10
MOST_NAMED = 12  # keys in a note


@dataclass(frozen=True, eq=False)
class Catalog:
    """The rows of one or more catalogue folders, in SI.

    Attributes:
        motors, gears: By key, in file order.
        pairs: Published combinations: gear keys by motor key.
        notes: Warnings and where the rows are from, for the report.
        brakes, amplifiers: By key, in file order.
        prices: In file order; a part may have several, or stand in no other table.
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
    """Which frameless motor fits which gear, where no published pairs exist.

    A frameless motor is built around its gear, so only room decides: the stator must stay inside the outline of the
    gear. Housed strain-wave units are about 1.5 to 2 times as wide as the pitch circle of their teeth, which is size/10
    inch. Where only the gear's outer diameter is known, the motor may be as wide as that.

    Attributes:
        max_diameter_ratio: Motor outer diameter over gear pitch diameter, at most.
        min_diameter_ratio: The same, at least: a much smaller motor cannot use the gear and only lengthens the search.
        kinds: Gear kinds built around a frameless motor.
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
    """Motors, gears, published pairs, brakes, amplifiers and prices of one or more folders.

    All in SI and in the DC-equivalent convention; prices in their own currency.

    Args:
        folders: Each with ``motors.csv``, ``gears.csv``, ``compatibility.csv``, ``brakes.csv``, ``amplifiers.csv`` and
            ``prices.csv``, or some of them; a row of a later folder replaces the row of the same key in an earlier
            one, prices add up. Or an Excel workbook with sheets of these names. None: the shipped catalogue.

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
    """The tables of all folders by file name, and the faults of their texts and cells."""
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
    """The sheets of all tables by key; adds to faults and notes."""
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
    """The rows of a table as sheets; adds to faults."""
    sheets = []
    for row in table.rows if not table.faults else ():
        try:
            sheets.append(_sheet(row, kind, _name(table)))
        except InputError as error:
            faults += [table.at(row, fault.place, fault.problem, fault.value, fault.hint) for fault in error.faults]
    return sheets


def _sheet(row: Row, kind: Any, file: str) -> Any:
    """One row as a Motor, a Gear or what else there is a table of."""
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
    """Gear keys by motor key; keys that no table has are faults, unless the tables are faulty themselves."""
    pairs: dict[str, frozenset[str]] = {}
    complete = not faults
    for table in tables:
        for row in table.rows:
            motor, listed = row.text("motor_key"), row.text("gear_keys").split()
            pairs[motor] = pairs.get(motor, frozenset()).union(listed)
            if complete:
                faults += _strangers(table, row, "motor_key", [motor], motors, len(faults))
                faults += _strangers(table, row, "gear_keys", listed, gears, len(faults))
    return pairs


def _strangers(
    table: Table, row: Row, column: str, keys: Iterable[str], known: Collection[str], so_far: int
) -> list[Fault]:
    """Keys that no table has; the search for the nearest known name is dear, so only the first faults get one."""
    unknown = [key for key in keys if key not in known]
    what = f"no {column.split('_')[0]} has this key"
    hints = [nearest(key, known) if so_far + i < MOST_HINTS else "" for i, key in enumerate(unknown)]
    return [table.at(row, column, what, key, hint) for key, hint in zip(unknown, hints, strict=True)]


# ---------------------------------------------------------------- pairing


def fits(motor: Motor, gear: Gear, rule: FramelessRule) -> bool:
    """Whether the geometric rule lets a frameless motor drive a gear."""
    if not motor.frameless or motor.diameter is None or gear.kind not in rule.kinds:
        return False
    if gear.pitch_diameter is not None:
        ratio = motor.diameter / gear.pitch_diameter
        return rule.min_diameter_ratio <= ratio <= rule.max_diameter_ratio
    return gear.diameter is not None and motor.diameter <= gear.diameter


def compatible_pairs(
    catalog: Catalog,
    motors: Iterable[str] | None = None,
    gears: Collection[str] | None = None,
    rule: FramelessRule = FramelessRule(),
) -> list[tuple[str, str]]:
    """The motor-gear pairs that may be built: published ones, and frameless motors by the geometric rule."""
    motor_keys = list(catalog.motors) if motors is None else list(motors)
    gear_keys = list(catalog.gears) if gears is None else list(gears)
    _refuse_strangers("motor", motor_keys, catalog.motors)
    _refuse_strangers("gear", gear_keys, catalog.gears)
    order = {key: index for index, key in enumerate(gear_keys)}
    around = _Around(catalog, gear_keys, rule)
    pairs: list[tuple[str, str]] = []
    for key in motor_keys:
        chosen = {order[gear] for gear in catalog.pairs.get(key, ()) if gear in order}
        chosen.update(around.fitting(catalog.motors[key]))
        pairs += [(key, gear_keys[index]) for index in sorted(chosen)]
    return pairs


class _Around:
    """The gears that frameless motors may be built around; ``fits`` for all of them at once."""

    def __init__(self, catalog: Catalog, gear_keys: Sequence[str], rule: FramelessRule) -> None:
        self._rule = rule
        self._index = [i for i, key in enumerate(gear_keys) if catalog.gears[key].kind in rule.kinds]
        gears = [catalog.gears[gear_keys[i]] for i in self._index]
        self._pitch = np.array([gear.pitch_diameter for gear in gears], dtype=np.float64)  # None is NaN: it never fits
        self._diameter = np.array([gear.diameter for gear in gears], dtype=np.float64)

    def fitting(self, motor: Motor) -> list[int]:
        """Places in the list of keys of the gears that the rule lets a motor drive."""
        if not motor.frameless or motor.diameter is None or not self._index:
            return []
        ratio, rule = motor.diameter / self._pitch, self._rule
        by_pitch = (rule.min_diameter_ratio <= ratio) & (ratio <= rule.max_diameter_ratio)
        held = np.where(np.isnan(self._pitch), motor.diameter <= self._diameter, by_pitch)
        return [self._index[i] for i in np.flatnonzero(held)]


def _refuse_strangers(what: str, keys: Iterable[str], known: Collection[str]) -> None:
    """Raises for keys that the catalogue does not have."""
    raise_faults(
        Fault(f"{what} key", "is not in the catalogue", key, nearest(key, known)) for key in keys if key not in known
    )
