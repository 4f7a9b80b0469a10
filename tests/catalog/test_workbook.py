"""Catalogues and motions in Excel workbooks give the same as the same tables in CSV files."""

from __future__ import annotations

import csv
import io
import sys

import numpy as np
import openpyxl
import pytest

import drivetrain as dt
from drivetrain.errors import InputError

MOTORS = """key,kind,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A],mass [g],frameless,source
small,brushless,dc,line_line,1.2,50,200,no,sheet
large,brushless,rms,phase,0.4,90,900,yes,"sheet, page 2"
"""
GEARS = """key,kind,ratio,mass [g],efficiency [%],stages,source
p20,planetary,20,150,80,2,sheet
p60,planetary,60,250,75,3,sheet
"""
PAIRS = """motor_key,gear_keys,source
small,p20 p60,sheet
"""
TABLES = {"motors": MOTORS, "gears": GEARS, "compatibility": PAIRS}


def cell(text):
    """A cell as Excel stores typed text: a number, a boolean, a text, or None."""
    if text in ("yes", "no"):
        return text == "yes"
    try:
        return float(text) if "." in text else int(text)
    except ValueError:
        return text or None


def workbook(path, tables):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, text in tables.items():
        sheet = book.create_sheet(name)
        for row in csv.reader(io.StringIO(text)):
            sheet.append([cell(one) for one in row])
    book.save(path)
    return path


@pytest.fixture
def folder(tmp_path):
    for name, text in TABLES.items():
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
    return tmp_path


def test_catalogue_is_that_of_the_tables(folder):
    found, wanted = dt.read_catalog(workbook(folder / "parts.xlsx", TABLES)), dt.read_catalog(folder)
    for table in ("motors", "gears"):
        rows, others = getattr(found, table), getattr(wanted, table)
        assert list(rows) == list(others)
        for key, row in others.items():
            stated = {name: value for name, value in vars(row).items() if name != "source"}
            assert stated.items() <= vars(rows[key]).items()
    assert found.pairs == wanted.pairs


def test_case_and_spaces_of_a_sheet_name_are_ignored(folder):
    """A sheet named ``Motors `` was ignored without a message."""
    named = {
        "Motors ": TABLES["motors"],
        "GEARS": TABLES["gears"],
        **{k: v for k, v in TABLES.items() if k not in ("motors", "gears")},
    }
    found, wanted = dt.read_catalog(workbook(folder / "parts.xlsx", named)), dt.read_catalog(folder)
    assert (list(found.motors), list(found.gears)) == (list(wanted.motors), list(wanted.gears))


def test_lint_reads_it_too(folder):
    found = dt.catalog.lint(workbook(folder / "parts.xlsx", TABLES))
    assert [(one.row, one.column, one.problem) for one in found] == [
        (one.row, one.column, one.problem) for one in dt.catalog.lint(folder)
    ]


def test_faults_name_sheet_row_and_column(folder):
    broken = {**TABLES, "gears": GEARS.replace(",60,", ",fast,")}
    with pytest.raises(InputError, match=r"parts.xlsx/gears.csv.*row 3, column ratio|row 3, column ratio.*parts.xlsx"):
        dt.read_catalog(workbook(folder / "parts.xlsx", broken))


def test_workbooks_that_are_no_catalogue(folder):
    with pytest.raises(InputError, match="holds no catalogue table"):
        dt.read_catalog(workbook(folder / "other.xlsx", {"stock": MOTORS}))
    (folder / "torn.xlsx").write_bytes(b"PK\x03\x04 torn")
    with pytest.raises(InputError, match="cannot be read as a workbook"):
        dt.read_catalog(folder / "torn.xlsx")
    with pytest.raises(InputError, match="is no folder"):
        dt.read_catalog(folder / "absent.xlsx")


def test_without_the_reader_it_says_what_to_install(folder, monkeypatch):
    path = workbook(folder / "parts.xlsx", TABLES)
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(InputError, match=r"drivetrain\[excel\]"):
        dt.read_catalog(path)


def test_a_study_of_workbooks(folder):
    """A study with catalogue and motion in workbooks; its digest changes with either."""
    workbook(folder / "parts.xlsx", TABLES)
    t = np.linspace(0.0, 1.0, 101)
    rows = "\n".join(f"{a!r},{b!r},{0.5 * b!r}" for a, b in zip(t.tolist(), np.sin(np.pi * t) ** 4, strict=True))
    text = f"time [s],q_joint_1 [rad],q_joint_2 [rad]\n{rows}\n".replace("np.float64(", "").replace(")", "")
    workbook(folder / "motion.xlsx", {"run": text})
    (folder / "motion.csv").write_text(text, encoding="utf-8")
    study = """
arm: planar-2r
schema_version: 1
drive_mass: included
motions: {run: {file: motion.xlsx}}
supply: {voltage: 24 V}
catalogs: parts.xlsx
joints: {default: {drive: {motor: small, gear: p20}}}
"""
    (folder / "a.yaml").write_text(study, encoding="utf-8")
    (folder / "b.yaml").write_text(study.replace("parts.xlsx", ".").replace(".xlsx", ".csv"), encoding="utf-8")
    one, other = (dt.load_study(folder / name) for name in ("a.yaml", "b.yaml"))
    np.testing.assert_allclose(one.cycle.position, other.cycle.position, rtol=1e-13)  # Excel keeps 16 digits
    used = [dt.evaluate(study).checks["utilisation"].to_numpy(float) for study in (one, other)]
    np.testing.assert_allclose(*used, rtol=1e-9)
    workbook(folder / "parts.xlsx", {**TABLES, "gears": GEARS.replace(",80,", ",81,")})
    assert dt.load_study(folder / "a.yaml").digest != one.digest
