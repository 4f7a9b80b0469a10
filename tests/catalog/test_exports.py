"""Manufacturers' tables: rows of the shipped catalogue in the style of manufacturers, read back; and their faults."""

from __future__ import annotations

import math
import re
from typing import Any

import openpyxl
import pytest

from drivetrain.catalog.exports import ExportMap, import_export, read_map
from drivetrain.catalog.read import read_catalog
from drivetrain.errors import InputError
from drivetrain.units import from_si
from drivetrain.whole_files import shipped

# As on maxon's pages and in its exports: one column per part, a unit in every cell.
PAGE = (
    ("Nominal voltage", "nominal_voltage", "V", "V"), ("No load speed", "no_load_speed", "rad/s", "rpm"),
    ("No load current", "no_load_current", "A", "mA"), ("Nominal speed", "nominal_speed", "rad/s", "rpm"),
    ("Nominal torque (max. continuous torque)", "nominal_torque", "N m", "mNm"),
    ("Nominal current (max. continuous current)", "nominal_current", "A", "A"),
    ("Stall torque", "stall_torque", "N m", "mNm"), ("Stall current", "stall_current", "A", "A"),
    ("Terminal resistance phase to phase", "resistance", "ohm", "Ω"),
    ("Terminal inductance phase to phase", "inductance", "H", "mH"),
    ("Torque constant", "torque_constant", "N m/A", "mNm/A"), ("Rotor inertia", "rotor_inertia", "kg m^2", "gcm²"),
    ("Thermal resistance housing-ambient", "resistance_housing_ambient", "K/W", "K/W"),
    ("Thermal resistance winding-housing", "resistance_winding_housing", "K/W", "K/W"),
    ("Thermal time constant winding", "winding_time_constant", "s", "s"),
    ("Thermal time constant motor", "housing_time_constant", "s", "s"), ("Weight", "mass", "kg", "g"),
)  # fmt: skip


@pytest.fixture(scope="module")
def motors():
    rows = read_catalog(shipped("catalogs")).motors.values()
    whole = [row for row in rows if row.maker == "maxon" and all(getattr(row, name) for _, name, _, _ in PAGE)]
    return whole[:3]


def printed(row, name, si, unit, mark="."):
    return f"{float(from_si(getattr(row, name), si, unit)):.9g}".replace(".", mark)


def check(path, motors):
    found = read_catalog(path).motors
    for row in motors:
        for _, name, _, _ in PAGE:
            assert getattr(found[row.key], name) == pytest.approx(getattr(row, name), rel=1e-8), name


def test_decimal_commas_are_found_without_a_map(tmp_path):
    """Unless a comma may separate thousands, or some number has a decimal point; one may separate thousands, too."""
    head = "Bestell-Nr.;Nennspannung [V];Nennstrom [A];Anschlusswiderstand [Ohm];Drehmomentkonstante [mNm/A];"
    row = "X{};24;{};0{}9;30;120;300\n"
    units = "Rotorträgheitsmoment [gcm²];Gewicht [g]\n"
    for out, numbers, mass in (("a", ("2,5", ","), "300"), ("b", ("2.5", "."), "300"), ("t", ("2,5", ","), "1.300")):
        text = head + units + row.format(1, *numbers).replace(";300", f";{mass}")
        (tmp_path / "maker.csv").write_text(text, encoding="utf-8")
        import_export(tmp_path / "maker.csv", tmp_path / out, ExportMap("motors", {}, {"kind": "brushed"}), basis="dc")
        (motor,) = read_catalog(tmp_path / out).motors.values()
        expected = (2.5, 0.9, 1.3 if out == "t" else 0.3)
        assert (motor.nominal_current, motor.resistance, motor.mass) == pytest.approx(expected)
    (tmp_path / "maker.csv").write_text(head + units + row.format(1, "2,5", "."), encoding="utf-8")
    with pytest.raises(InputError, match="must be a number"):
        import_export(tmp_path / "maker.csv", tmp_path / "c", ExportMap("motors", {}, {"kind": "brushed"}), basis="dc")


def test_numbers_of_a_workbook_have_no_decimal_sign(tmp_path):
    """A workbook with some numbers typed as text with commas: the others stay what they are, 9.5 and not 95."""
    book = openpyxl.Workbook()
    for row in (
        ["Typ", "kt [mNm/A]", "R [mOhm]", "J [gcm²]", "n max [U/min]", "m [kg]"],
        ["A", 9.5, 350, "1.250,5", 5000, "2,25"],
        ["B", 12.125, 0.31, 80.5, 4500.0, 1.5],
    ):
        book.active.append(row)
    book.save(tmp_path / "maker.xlsx")
    names = {"key": "Typ", "torque_constant": "kt [mNm/A]", "resistance": "R [mOhm]", "rotor_inertia": "J [gcm²]",
             "max_speed": "n max [U/min]", "mass": "m [kg]"}  # fmt: skip
    given = ExportMap("motors", names, {"kind": "brushed"}, decimal=",")
    import_export(tmp_path / "maker.xlsx", tmp_path / "out", given, basis="dc")
    first, second = read_catalog(tmp_path / "out").motors.values()
    assert (first.torque_constant, first.resistance, first.rotor_inertia, first.mass) == pytest.approx(
        (9.5e-3, 0.35, 1250.5e-7, 2.25)
    )
    assert (second.torque_constant, second.resistance, second.rotor_inertia, second.mass) == pytest.approx(
        (12.125e-3, 0.31e-3, 80.5e-7, 1.5)
    )
    assert (first.max_speed, second.max_speed) == pytest.approx((5000 * math.pi / 30, 4500 * math.pi / 30))


def test_a_decimal_point_beside_decimal_commas_is_a_fault(tmp_path):
    """Points separate thousands there, in groups of three digits; a unit that is unknown says how a map states it."""
    path, names = tmp_path / "maker.csv", {"key": "Typ", "mass": "m", "ratio": "i", "inertia": "J"}
    given = ExportMap("gears", names, {"kind": "spur"}, decimal=",")
    path.write_text("Typ;m;i;J\nA;1.300 g;9.5;3 gcm²\nB;0.031 kg;1,5;3 gcm³\n", "utf-8")
    with pytest.raises(InputError) as error:
        import_export(path, tmp_path / "out", given)
    assert [(fault.place, fault.value) for fault in error.value.faults] == [
        ("row 2, i", "9.5"), ("row 3, m", "0.031 kg"), ("row 3, J", "gcm³"),
    ]  # fmt: skip
    assert "decimal: '.' in the map" in error.value.faults[0].hint
    assert "columns: {inertia: {heading: J, unit: kg m^2, times: 1}}" in error.value.faults[2].hint


def test_a_page_of_a_maker(tmp_path, motors):
    """Headings in the first column, one column per part, a unit in each cell; recognised without a map."""
    lines = [["Values at nominal voltage"], ["Part number", *(row.key for row in motors)]]
    lines += [
        [heading, *(f"{printed(row, name, si, unit)} {unit}" for row in motors)] for heading, name, si, unit in PAGE
    ]
    lines += [["Ambient temperature", *["-30...+100 °C"] * len(motors)]]
    path = tmp_path / "page.csv"
    path.write_text("\n".join("\t".join(line) for line in lines), encoding="utf-8")
    given = ExportMap("motors", fixed={"kind": "brushless", "maker": "maxon"})
    done = import_export(path, tmp_path / "out", given, basis="dc")
    assert (done.rows, done.refused) == (len(motors), ())
    assert "Ambient temperature" in done.unused
    check(tmp_path / "out", motors)


def test_a_german_table_with_a_map(tmp_path, motors):
    """Semicolons, decimal commas, units in the headings, an older encoding, a line before the headings."""
    headings = [f"{name.replace('_', ' ').title()} Wert [{unit.replace('Ω', 'Ohm')}]" for _, name, _, unit in PAGE]
    rows = [[row.key, *(printed(row, name, si, unit, ",") for _, name, si, unit in PAGE)] for row in motors]
    text = "\n".join(";".join(cells) for cells in [["Stand: März"], ["Bestell-Nr.", *headings, "Bemerkung"], *rows])
    (tmp_path / "tabelle.csv").write_bytes(text.encode("cp1252"))
    columns = "\n".join(f"  {name}: '{head}'" for head, (_, name, _, _) in zip(headings, PAGE, strict=True))
    (tmp_path / "map.yaml").write_text(
        "table: motors\ndecimal: ','\nfixed: {kind: brushless, current_basis: dc, winding_basis: line_line}\n"
        f"columns:\n  key: Bestell-Nr.\n{columns}\n", encoding="utf-8"
    )  # fmt: skip
    done = import_export(tmp_path / "tabelle.csv", tmp_path / "out", read_map(tmp_path / "map.yaml"))
    assert done.rows == len(motors) and done.unused == ("Bemerkung",)
    check(tmp_path / "out", motors)


def test_a_list_of_one_part_without_a_name(tmp_path):
    """Headings and values of one part, as copied from a page; the key is given by the map."""
    path = tmp_path / "one.csv"
    path.write_text(
        "Terminal resistance phase to phase,6.42 Ω\nTorque constant,30.5 mNm/A\nRotor inertia,150 gcm²\n", "utf-8"
    )
    done = import_export(path, tmp_path / "out", ExportMap(fixed={"key": "339276", "kind": "brushless"}), basis="dc")
    row = read_catalog(done.file.parent).motors["339276"]
    assert (row.resistance, row.torque_constant, row.rotor_inertia) == pytest.approx((6.42, 0.0305, 1.5e-5))


def test_gears_with_a_factor_in_the_heading(tmp_path):
    """A rating table of strain-wave gears: stiffness in 10^4 N m/rad, speeds in min-1, ratios as 100 : 1."""
    path = tmp_path / "gears.csv"
    path.write_text(
        "Size;Ratio;Limit for repeated peak torque [Nm];Limit for average torque [Nm];"
        "Limit for momentary peak torque [Nm];K1 [x10^4 Nm/rad];Max. input speed [min-1];Weight (kg);Key\n"
        "17;100 : 1;70;51;143;1,0;7.300;0,68;A 17\n20;120:1;113;64;191;1,6;6500;-;A 20\n",
        "utf-8",
    )
    names = {
        "key": "Key", "ratio": "Ratio", "repeated_peak_torque": "Limit for repeated peak torque [Nm]",
        "average_torque_limit": "Limit for average torque [Nm]",
        "momentary_torque": "Limit for momentary peak torque [Nm]",
        "max_input_speed": "Max. input speed [min-1]", "mass": "Weight (kg)",
        "stiffness_1": {"heading": "K1 [x10^4 Nm/rad]", "unit": "N m/rad", "times": 1e4},
    }  # fmt: skip
    given = ExportMap("gears", names, {"kind": "strain_wave"}, decimal=",")
    done = import_export(path, tmp_path / "out", given)
    (tmp_path / "out" / "motors.csv").write_text(
        "key,kind,current_basis,winding_basis,resistance [ohm],torque_constant [N m/A]\n"
    )
    gears = read_catalog(tmp_path / "out").gears
    assert done.rows == 2 and done.unused == ("Size",)
    first, second = gears["A_17"], gears["A_20"]
    assert (first.ratio, first.stiffness_1, first.mass, second.mass) == (100.0, 1e4, 0.68, None)
    assert first.max_input_speed == pytest.approx(7300 * math.pi / 30) and second.stiffness_1 == pytest.approx(1.6e4)


def test_every_fault_at_once(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text(
        "Part number,Torque constant,Terminal resistance [Nm],Weight\nA,much,1,0.3 kg\nB,30 mNm/A,2,0.3\n", "utf-8"
    )
    with pytest.raises(InputError) as error:
        import_export(path, tmp_path / "out", ExportMap(), basis="dc")
    message = str(error.value)
    assert re.search("row 2, Torque constant.*must be a number", message)
    assert "row 3, Weight" in message and "no unit" in message
    assert re.search(r"m.csv: Terminal resistance \[Nm\]: .*Nm", message) and not (tmp_path / "out").exists()
    with pytest.raises(InputError, match="no such heading"):
        import_export(path, tmp_path / "out", ExportMap(columns={"key": "Part nr"}))
    with pytest.raises(InputError, match="no column"):
        ExportMap("gears", {"torque_constant": "kt"})
    (tmp_path / "map.yaml").write_text("tables: motors\n", "utf-8")
    with pytest.raises(InputError, match="table"):
        read_map(tmp_path / "map.yaml")
    path.write_text("Part number,Torque constant,Terminal resistance\nA,30 mNm/A,1 Ohm\n", "utf-8")
    done = import_export(path, tmp_path / "out", ExportMap())
    assert done.rows == 0 and "ampere" in done.refused[0].problem and not done.file.exists()


def test_units_in_a_row_of_their_own(tmp_path):
    """As in many workbooks: a title, an empty row, headings, units below them; faults count the sheet's rows."""
    rows = [
        "Price list,,,,,", "", "Type,Torque const.,R,J,Nominal current,Mass", ",mNm/A,mOhm,gcm²,A,g",
        "A,60,350,80,5.6,550", "B,72,180,280,9.5,1100",
    ]  # fmt: skip
    columns = dict(zip(("key", "torque_constant", "resistance", "rotor_inertia", "nominal_current", "mass"),
                       rows[2].split(","), strict=True))  # fmt: skip
    path, given = tmp_path / "m.csv", ExportMap(columns=columns, fixed={"kind": "brushless"})
    path.write_text("\n".join(rows), "utf-8")
    import_export(path, tmp_path / "out", given, basis="dc")
    first, second = read_catalog(tmp_path / "out").motors.values()
    assert (first.torque_constant, first.resistance, first.mass) == pytest.approx((0.06, 0.35, 0.55))
    assert (second.torque_constant, second.nominal_current) == pytest.approx((0.072, 9.5))
    path.write_text("\n".join(rows).replace(",gcm²,A,g", ",gcm²,,g").replace("1100", "heavy"), "utf-8")
    with pytest.raises(InputError) as error:
        import_export(path, tmp_path / "new", given, basis="dc")
    units, mass = error.value.faults
    assert (units.place, mass.place) == ("row 5, Nominal current", "row 6, Mass [g]")  # the missing unit once


@pytest.mark.parametrize(
    ("given", "place"),
    [
        ({"columns": {"mass": {"heading": "W", "times": "twice"}}}, "columns.mass"),
        ({"columns": {"mass": {"heading": "W", "times": float("nan")}}}, "columns.mass"),
        ({"columns": {"mass": ["W"]}}, "columns.mass"),
        ({"columns": ["W"]}, "columns"),
        ({"table": None}, "table"),
        ({"transposed": "no"}, "transposed"),
    ],
)
def test_an_invalid_map_is_refused_with_its_place(given: dict[str, Any], place: str) -> None:
    with pytest.raises(InputError) as error:
        ExportMap(**given)
    assert [fault.place for fault in error.value.faults] == [place]
