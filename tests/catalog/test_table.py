"""The table reader: units, line numbers, and all faults together."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest

from drivetrain.catalog.price import Price
from drivetrain.catalog.schema import (
    AMPLIFIERS,
    BRAKES,
    GEAR_COLUMNS,
    MOTOR_COLUMNS,
    NUMBER,
    PAIR_COLUMNS,
    PRICES,
    TABLES,
    Column,
    by_name,
)
from drivetrain.catalog.table import Table, read_table
from drivetrain.drive.amplifier import AmplifierSheet
from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import InputError
from drivetrain.units import to_si

NEEDED = "key,kind,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A]"


def table(tmp_path: Path, text: str, columns: tuple[Column, ...] = MOTOR_COLUMNS) -> Table:
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    return read_table(path, columns)


def only_row(tmp_path: Path, header: str, cells: str) -> Table:
    return table(tmp_path, f"{NEEDED},{header}\nA,brushless,dc,line_line,1,10,{cells}\n")


BY_STUDY = {  # fields that no data sheet gives and a study provides
    "winding_share", "holding", "brake", "load_friction", "staged", "stage_driving", "stage_driven", "stage_inertia",
    "stage_mass", "stage_sprung", "stage_torque", "stage_speed", "stage_words", "friction_allowance",
    "inductance_allowance",
}  # fmt: skip


@pytest.mark.parametrize(
    ("columns", "sheet"),
    [
        (MOTOR_COLUMNS, Motor), (GEAR_COLUMNS, Gear), (TABLES[BRAKES], Brake), (TABLES[AMPLIFIERS], AmplifierSheet),
        (TABLES[PRICES], Price),
    ],
)  # fmt: skip
def test_every_field_of_a_sheet_has_a_column_and_the_reverse(columns: tuple[Column, ...], sheet: type) -> None:
    fields = {field.name for field in dataclasses.fields(sheet)}
    names = {column.name for column in columns if not column.lint_only}
    assert fields - BY_STUDY <= names
    assert names - fields <= {"edition", "current_basis", "winding_basis"}


@pytest.mark.parametrize("name", TABLES)
def test_columns_are_unique_and_their_units_exist(name: str) -> None:
    columns = TABLES[name]
    assert len(by_name(columns)) == len(columns)
    for column in columns:
        assert column.meaning.endswith(".")
        if column.content == NUMBER:
            assert -math.inf < column.low < column.high < math.inf
            to_si(1.0, column.unit, unit=column.unit)  # raises for an unknown unit


@pytest.mark.parametrize(
    ("header", "cell", "value"),
    [
        ("no_load_speed [rpm]", "6000", 6000 * 2 * math.pi / 60),
        ("no_load_speed [1/min]", "6000", 6000 * 2 * math.pi / 60),
        ("rotor_inertia [gcm2]", "142", 1.42e-5),
        ("rotor_inertia [kg cm^2]", "0.142", 1.42e-5),
        ("nominal_torque [mNm]", "177", 0.177),
        ("nominal_torque [oz-in]", "25", 25 * 0.028349523125 * 9.80665 * 0.0254),
        ("inductance [mH]", "0.082", 82e-6),
        ("no_load_current [mA]", "137", 0.137),
        ("speed_torque_gradient [rpm/mNm]", "3.04", 3.04 * 2 * math.pi / 60 * 1000),
        ("speed_constant [rpm/V]", "317", 317 * 2 * math.pi / 60),
        ("mechanical_time_constant [ms]", "4.5", 4.5e-3),
        ("max_winding_temperature [degC]", "155", 155.0),
        ("max_winding_temperature [K]", "428.15", 155.0),
        ("mass [g]", "480", 0.48),
        ("diameter [mm]", "40", 0.04),
        ("resistance_winding_housing [K/W]", "1.93", 1.93),
        ("price", "120.5", 120.5),
        ("price [EUR]", "120.5", 120.5),
    ],
)
def test_the_unit_of_the_header_is_converted(tmp_path: Path, header: str, cell: str, value: float) -> None:
    read = only_row(tmp_path, header, cell)
    assert read.faults == ()
    name = header.split(" [")[0]
    assert read.rows[0].number(name) == pytest.approx(value, rel=1e-12)
    assert read.rows[0].number("torque_constant") == pytest.approx(0.01, rel=1e-12)
    if name != "price":
        assert read.as_printed(name, value) == pytest.approx(float(cell), rel=1e-12)


@pytest.mark.parametrize(
    ("header", "cell", "problem"),
    [
        ("nominal_torque [A]", "1", "must be a torque"),
        ("nominal_torque", "1", "needs a unit in its header"),
        ("nominal_torque [mNq]", "1", "unit"),
        ("no_load_speed [Hz]", "100", "rotation speed"),
        ("mass [g]", "twelve", "must be a number"),
        ("mass [g]", "1_000", "must be a number"),
        ("mass [g]", "nan", "must be a number"),
        ("mass [g]", "inf", "must be a number"),
        ("mass [g]", "480 g", "must be a number"),
        ("price", "EUR 480", "must be a number"),
        ("mass [g]", '"0,48"', "must be a number"),
        ("mass [g]", "0", "cannot be 0"),
        ("mass [g]", "-480", "must lie between"),
        ("rotor_inertia [kg m^2]", "142", "must lie between"),
        ("frameless", "maybe", "must be one of yes, no"),
        ("weight [g]", "480", "unknown column"),
    ],
)
def test_a_bad_cell_or_header_is_a_fault_with_its_place(tmp_path: Path, header: str, cell: str, problem: str) -> None:
    read = only_row(tmp_path, header, cell)
    assert len(read.faults) == 1
    fault = read.faults[0]
    assert problem in fault.problem
    assert fault.header == header
    assert fault.line in (1, 2)
    message = str(read.fault(fault))
    assert ("write the number alone" in message) is (cell in ("480 g", "1_000", "EUR 480"))
    assert f"row {fault.line}" in message and header in message and "table.csv" in message


def test_rows_are_counted_as_an_editor_counts_lines(tmp_path: Path) -> None:
    rows = [
        "A,brushless,dc,line_line,1,10,fine",
        "",
        'B,brushless,dc,line_line,1,10,"two',
        'lines"',
        "C,x,dc,line_line,1,10,",
    ]
    read = table(tmp_path, "\n".join([f"{NEEDED},notes", *rows]) + "\n")
    assert [row.line for row in read.rows] == [2, 4, 6]
    assert [(fault.line, fault.header) for fault in read.faults] == [(6, "kind")]


def test_all_faults_come_at_once(tmp_path: Path) -> None:
    rows = ["A,brushless,dc,line_line,-1,x,0,1", "A,brushles,,line_line,1,10,5,1", "B C,brushed,dc,,1,,5,1,9"]
    text = "\n".join([f"{NEEDED},mass [g],masss [g]", *rows]) + "\n"
    found = {(fault.line, fault.header) for fault in table(tmp_path, text).faults}
    assert found == {
        (1, "masss [g]"), (2, "resistance [ohm]"), (2, "torque_constant [mNm/A]"), (2, "mass [g]"), (3, "key"),
        (3, "kind"), (3, "current_basis"), (4, "key"), (4, "winding_basis"), (4, "torque_constant [mNm/A]"), (4, ""),
    }  # fmt: skip


def test_hints_name_the_nearest_column_and_why_a_convention_is_needed(tmp_path: Path) -> None:
    read = table(tmp_path, "key,kind,winding_basis,resistance [ohm],torque_const [mNm/A]\nA,brushed,line_line,1,10\n")
    by_header = {fault.header: fault for fault in read.faults}
    assert "torque_constant" in by_header["torque_const [mNm/A]"].hint
    assert "missing" in by_header["torque_constant"].problem
    assert "not guessed" in by_header["current_basis"].hint
    semicolons = table(tmp_path, "motor_key;gear_keys\nA;B\n", PAIR_COLUMNS)
    assert "commas" in semicolons.faults[0].hint


def test_a_ratio_may_be_negative_but_not_zero_and_stages_are_whole(tmp_path: Path) -> None:
    read = table(tmp_path, "key,kind,ratio,stages\nA,spur,-22,3\nB,spur,0,2\nC,spur,5,2.5\n", GEAR_COLUMNS)
    assert read.rows[0].number("ratio") == -22.0
    assert [(fault.line, fault.header) for fault in read.faults] == [(3, "ratio"), (4, "stages")]


def test_an_empty_file_and_one_that_is_not_text(tmp_path: Path) -> None:
    [fault] = table(tmp_path, "\n\n").faults
    assert "header row" in fault.problem and fault.line == 1
    (tmp_path / "table.csv").write_bytes(b"key\xff\xfe,kind\n")
    with pytest.raises(InputError, match="UTF-8"):
        read_table(tmp_path / "table.csv", MOTOR_COLUMNS)
    with pytest.raises(InputError):
        read_table(tmp_path / "missing.csv", MOTOR_COLUMNS)


def test_an_open_quote_does_not_swallow_the_rows_after_it(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text('key,notes\na,"open\nb,\nc,\n', encoding="utf-8")
    with pytest.raises(InputError, match="row 2: cannot be read as CSV"):
        read_table(path, MOTOR_COLUMNS)
