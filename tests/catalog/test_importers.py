"""Imports convert columns correctly, refuse rows without stated conventions, and write all tables or none."""

from __future__ import annotations

import csv
import math
import shutil
from pathlib import Path

import pytest

from drivetrain.catalog import importers
from drivetrain.catalog.formats import MGDB, TABLE
from drivetrain.catalog.importers import import_rows
from drivetrain.catalog.linting import lint
from drivetrain.catalog.read import read_catalog
from drivetrain.errors import InputError

DATA = Path(__file__).parent / "data"
BASIS = {"maxon": "dc", "Faulhaber": "dc", "Allied_Motion": "dc"}


def test_mgdb_values_arrive(tmp_path: Path) -> None:
    done = import_rows(MGDB, DATA / "mgdb", tmp_path / "out", basis=BASIS)
    assert (done.motors, done.gears, done.refused) == (5, 7, ())
    catalog = read_catalog(tmp_path / "out")
    re40 = catalog.motors["MM_148877"]
    assert (re40.kind, re40.resistance, re40.torque_constant, re40.mass) == ("brushed", 1.13, 0.0603, 0.48)
    assert re40.no_load_speed == pytest.approx(7590 * math.pi / 30, rel=1e-6)
    assert re40.max_speed == pytest.approx(12000 * math.pi / 30, rel=1e-6)
    assert (re40.peak_torque, re40.coulomb_friction) == (None, None)  # Inf and NaN in the source
    assert (re40.resistance_winding_housing, re40.resistance_housing_ambient) == (1.93, 4.65)
    assert catalog.motors["FH_3268G024BX4"].nominal_current == 2.0
    frameless = catalog.motors["AM_MF0095020_48V"]
    assert (frameless.resistance_winding_ambient, frameless.resistance_winding_housing) == (1.55, None)
    assert frameless.peak_torque == 18.0
    spur = catalog.gears["FH_16_5_R22:1"]
    assert (spur.kind, spur.ratio, spur.inertia, spur.efficiency) == (
        "spur",
        -22.0,
        None,
        0.73,
    )  # direction -1, inertia 0
    assert catalog.gears["MM_110338"].efficiency is None
    assert catalog.gears["MM_110338"].repeated_peak_torque == 0.8


def test_mgdb_patterns_are_expanded_and_unknown_keys_dropped(tmp_path: Path) -> None:
    done = import_rows(MGDB, DATA / "mgdb", tmp_path / "out", basis="dc")
    pairs = read_catalog(tmp_path / "out").pairs
    assert pairs["FH_3268G024BX4"] == {"FH_32ALN_R4:1", "FH_32ALN_R14:1", "FH_42GPT_R72:1"}
    assert pairs["MM_397172"] == {"MM_110337", "MM_110451"}
    assert (done.pairs, done.dropped_pairs) == (8, 1)


def test_brushless_rows_without_a_basis_are_refused_and_listed(tmp_path: Path) -> None:
    done = import_rows(MGDB, DATA / "mgdb", tmp_path / "out", basis={"allied_motion": "peak/phase"})
    assert {fault.problem.split()[1] for fault in done.refused} == {"MM_397172", "MM_350909", "FH_3268G024BX4"}
    assert all("basis" in fault.hint and fault.file for fault in done.refused)
    motors = read_catalog(tmp_path / "out").motors
    assert set(motors) == {"MM_148877", "AM_MF0095020_48V"}  # the current of a brushed motor is dc
    assert motors["AM_MF0095020_48V"].resistance == pytest.approx(0.5)
    assert motors["AM_MF0095020_48V"].torque_constant == pytest.approx(0.14 * math.sqrt(4.0 / 3.0))
    assert done.dropped_pairs == 3 + 1 + 3  # all pairs of the refused motors


def test_a_key_overrules_its_maker(tmp_path: Path) -> None:
    basis = {**BASIS, "MM_397172": "rms/line_line"}
    import_rows(MGDB, DATA / "mgdb", tmp_path / "out", basis=basis)
    motors = read_catalog(tmp_path / "out").motors
    assert motors["MM_397172"].torque_constant == pytest.approx(0.0369 * math.sqrt(2.0 / 3.0))
    assert motors["MM_350909"].torque_constant == 0.0251


@pytest.mark.parametrize("basis", ["ac", "rms", "peak/star", {"maxon": "DC"}])
def test_an_unclear_basis_is_an_error(tmp_path: Path, basis: str | dict[str, str]) -> None:
    with pytest.raises(InputError, match="basis"):
        import_rows(MGDB, DATA / "mgdb", tmp_path / "out", basis=basis)
    assert not (tmp_path / "out").exists()


def test_table_values_arrive(tmp_path: Path) -> None:
    done = import_rows(TABLE, DATA / "si_table", tmp_path / "out", basis={"FAULHABER": "dc", "Allied Motion": "dc"})
    # maxon states that its values are those of the equivalent DC machine
    assert {fault.problem.split()[1] for fault in done.refused} == {
        "kollmorgen_TBM(S)-6051-A", "TM_G40_KV070", "TM_G30_KV290",
    }  # fmt: skip
    with (DATA / "si_table" / "gears.csv").open(encoding="utf-8", newline="") as file:
        source = {row["key"]: row for row in csv.DictReader(file)}
    with (tmp_path / "out" / "gears.csv").open(encoding="utf-8", newline="") as file:
        written = {row["key"]: row for row in csv.DictReader(file)}
    assert list(written) == list(source)
    shg = written["hd_SHG-25-100-2UH"]
    assert shg["kind"] == "strain_wave" and written["nabtesco_RV-20E-81"]["kind"] == "rv"
    for ours, theirs in {
        "repeated_peak_torque [N m]": "tau_int_Nm", "average_torque_limit [N m]": "tau_avg_limit_Nm",
        "momentary_torque [N m]": "tau_momentary_Nm", "stiffness_3 [N m/rad]": "K3_Nm_rad",
        "inertia [kg m^2]": "J_in_kgm2", "max_input_speed [rad/s]": "w_in_max_int_rad_s",
    }.items():  # fmt: skip
        assert shg[ours] == source["hd_SHG-25-100-2UH"][theirs] != ""
    assert written["FH_16_5_R22:1"]["ratio"].startswith("-22")
    with (DATA / "si_table" / "compat.csv").open(encoding="utf-8", newline="") as file:
        listed = [(row[0], gear) for row in list(csv.reader(file))[1:] for gear in row[2].split()]
    assert done.pairs == len(listed) >= 4


def test_faulty_rows_are_kept_for_the_lint_or_left_out(tmp_path: Path) -> None:
    kept = import_rows(TABLE, DATA / "si_table", tmp_path / "kept", basis="dc")
    sifted = import_rows(TABLE, DATA / "si_table", tmp_path / "sifted", basis="dc", keep_faulty=False)
    assert (kept.motors - sifted.motors, kept.gears - sifted.gears) == (5 + 1, 40)  # one correct row lacks R and kt
    assert any("maxon_350909" in fault.place for fault in sifted.refused)
    with pytest.raises(InputError):
        read_catalog(tmp_path / "kept")
    assert len(read_catalog(tmp_path / "sifted").gears) == sifted.gears
    assert not [fault for fault in lint(tmp_path / "sifted") if fault.severity.value == "error"]


def test_existing_tables_are_kept_unless_overwritten(tmp_path: Path) -> None:
    import_rows(MGDB, DATA / "mgdb", tmp_path, basis="dc")
    before = (tmp_path / "motors.csv").read_bytes()
    with pytest.raises(InputError, match="already holds"):
        import_rows(TABLE, DATA / "si_table", tmp_path, basis="dc")
    assert (tmp_path / "motors.csv").read_bytes() == before
    import_rows(TABLE, DATA / "si_table", tmp_path, basis="dc", overwrite=True)
    assert (tmp_path / "motors.csv").read_bytes() != before


def test_a_failure_leaves_no_half_written_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import_rows(MGDB, DATA / "mgdb", tmp_path, basis="dc")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    text, calls = importers.table_text, []

    def fails_at_the_last(records, columns):  # type: ignore[no-untyped-def]
        calls.append(1)
        if len(calls) == 3:
            raise OSError("disk full")
        return text(records, columns)

    monkeypatch.setattr(importers, "table_text", fails_at_the_last)
    with pytest.raises(OSError, match="disk full"):
        import_rows(TABLE, DATA / "si_table", tmp_path, basis="dc", overwrite=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_an_import_of_nothing_is_an_error(tmp_path: Path) -> None:
    for form in (MGDB, TABLE):
        with pytest.raises(InputError, match="none of the files"):
            import_rows(form, tmp_path, tmp_path / "out", basis="dc")
    shutil.copy(DATA / "mgdb" / "Maxon" / "maxon_gearboxes.csv", tmp_path)
    done = import_rows(MGDB, tmp_path, tmp_path / "out")
    assert (done.motors, done.gears, done.pairs) == (0, 3, 0)
    assert len(read_catalog(tmp_path / "out").gears) == 3


def test_an_open_quote_in_a_source_is_a_fault(tmp_path: Path) -> None:
    shutil.copytree(DATA / "si_table", tmp_path / "source")
    with (tmp_path / "source" / "motors.csv").open("a", encoding="utf-8") as file:
        file.write('more,"open\n')
    with pytest.raises(InputError, match="cannot be read as CSV"):
        import_rows(TABLE, tmp_path / "source", tmp_path / "out", basis="dc")
    assert not (tmp_path / "out").exists()
