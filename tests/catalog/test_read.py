"""Catalogue folders are read as motors, gears and pairs; conventions are converted, never guessed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog, FramelessRule, compatible_pairs, fits, read_catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import InputError

MOTOR_HEADER = (
    "key,maker,kind,frameless,current_basis,winding_basis,resistance [ohm],inductance [mH],torque_constant [Nm/A],"
    "no_load_current [A],nominal_current [A],peak_current [A],edition,source,notes"
)
GEAR_HEADER = "key,kind,ratio,stages,continuous_torque [Nm],repeated_peak_torque [Nm],efficiency [%]"


def folder(path: Path, motors: list[str], gears: list[str], pairs: list[str]) -> Path:
    path.mkdir(exist_ok=True)
    tables = {
        "motors.csv": [MOTOR_HEADER, *motors],
        "gears.csv": [GEAR_HEADER, *gears],
        "compatibility.csv": ["motor_key,gear_keys,source", *pairs],
    }
    for name, lines in tables.items():
        (path / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def small(path: Path) -> Path:
    motors = [
        "M1,maker,brushless,no,dc,line_line,1,0.5,0.05,0.1,2,8,2020,sheet,",
        "M2,maker,brushed,no,dc,line_line,2,,0.1,,,,,,",
    ]
    return folder(path, motors, ["G1,planetary,20,2,5,10,80", "G2,spur,-5,1,1,2,"], ["M1,G1 G2,list"])


def test_a_folder_is_read_in_si(tmp_path: Path) -> None:
    catalog = read_catalog(small(tmp_path / "own"))
    assert list(catalog.motors) == ["M1", "M2"]
    motor = catalog.motors["M1"]
    assert (motor.inductance, motor.frameless, motor.maker) == (5e-4, False, "maker")
    assert motor.source == "own/motors.csv row 2: 2020; sheet"
    assert catalog.gears["G1"].efficiency == pytest.approx(0.8)
    assert catalog.gears["G1"].stages == 2 and isinstance(catalog.gears["G1"].stages, int)
    assert catalog.gears["G2"].ratio == -5.0 and catalog.gears["G2"].efficiency is None
    assert catalog.pairs == {"M1": frozenset({"G1", "G2"})}
    assert any("confirm" in note for note in catalog.notes)


def test_one_machine_printed_in_every_convention_is_one_motor(tmp_path: Path) -> None:
    """Expected values from torque and copper loss of a sinusoidal machine, not from the factors of the converter."""
    phase_resistance, phase_inductance, amplitude, torque = 0.3, 0.4e-3, 4.0, 1.2
    rms = amplitude / math.sqrt(2.0)
    loss = 3.0 * phase_resistance * rms**2
    # The DC equivalent flows through two phases in series, with the same copper loss and torque.
    direct = math.sqrt(loss / (2.0 * phase_resistance))
    printed = {"dc": direct, "rms": rms, "peak": amplitude}
    rows = [
        f"{basis}_{winding},,brushless,yes,{basis},{winding},{r},{inductance * 1e3},{torque / current},{0.1 * current},"
        f"{0.5 * current},{current},,,"
        for basis, current in printed.items()
        for winding, r, inductance in (
            ("phase", phase_resistance, phase_inductance),
            ("line_line", 2.0 * phase_resistance, 2.0 * phase_inductance),
        )
    ]
    motors = read_catalog(folder(tmp_path / "own", rows, [], [])).motors.values()
    assert len(motors) == 6
    for motor in motors:
        assert motor.torque_constant == pytest.approx(torque / direct, rel=1e-12)
        assert motor.resistance == pytest.approx(2.0 * phase_resistance, rel=1e-12)
        assert motor.inductance == pytest.approx(2.0 * phase_inductance, rel=1e-12)
        currents = (motor.no_load_current, motor.nominal_current, motor.peak_current)
        assert currents == pytest.approx((0.1 * direct, 0.5 * direct, direct), rel=1e-12)


@pytest.mark.parametrize(("basis", "winding"), [("", "line_line"), ("dc", ""), ("", ""), ("ac", "line_line")])
def test_a_motor_without_its_convention_is_refused(tmp_path: Path, basis: str, winding: str) -> None:
    row = f"M1,,brushless,no,{basis},{winding},1,,0.05,,,,,,"
    with pytest.raises(InputError) as refused:
        read_catalog(folder(tmp_path / "own", [row], [], []))
    message = str(refused.value)
    assert "row 2" in message and "motors.csv" in message
    assert ("current_basis" in message) == (basis != "dc")
    assert ("winding_basis" in message) == (winding == "")


def test_faults_of_all_files_come_at_once(tmp_path: Path) -> None:
    path = small(tmp_path / "own")
    (path / "motors.csv").write_text(MOTOR_HEADER + "\nM1,,brushless,no,dc,line_line,x,,0.05,,,,,,\n", encoding="utf-8")
    (path / "gears.csv").write_text(GEAR_HEADER + "\nG1,planetari,20,2,5,10,80\n", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_catalog(path)
    files = {Path(fault.file).name for fault in refused.value.faults}
    assert files == {"motors.csv", "gears.csv"}
    assert "planetary" in str(refused.value)


def test_pairs_must_name_rows_that_exist(tmp_path: Path) -> None:
    path = small(tmp_path / "own")
    (path / "compatibility.csv").write_text("motor_key,gear_keys\nM1,G1 G3\nM9,G1\n", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_catalog(path)
    assert [(fault.place, fault.value) for fault in refused.value.faults] == [
        ("row 2, column gear_keys", "G3"),
        ("row 3, column motor_key", "M9"),
    ]
    assert "G1" in refused.value.faults[0].hint


def test_later_folders_add_and_replace(tmp_path: Path) -> None:
    first = small(tmp_path / "first")
    row = "M1,maker,brushless,no,dc,line_line,9,,0.05,,,,,,"
    second = folder(tmp_path / "second", [row], ["G7,planetary,7,1,1,2,90"], ["M1,G7", "M2,G1"])
    catalog = read_catalog(first, second)
    assert catalog.motors["M1"].resistance == 9.0
    assert list(catalog.gears) == ["G1", "G2", "G7"]
    assert catalog.pairs == {"M1": frozenset({"G1", "G2", "G7"}), "M2": frozenset({"G1"})}
    assert any("second/motors.csv replaces" in note and "M1" in note for note in catalog.notes)
    assert read_catalog(second, first).motors["M1"].resistance == 1.0


def test_a_folder_without_tables_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "missing"):
        with pytest.raises(InputError, match=r"motors\.csv"):
            read_catalog(path)


def motor(key: str, diameter: float | None, *, frameless: bool = True) -> Motor:
    return Motor(key, 1.0, 0.1, frameless=frameless, diameter=diameter)


def gear(key: str, pitch: float | None, *, kind: str = "strain_wave", diameter: float | None = None) -> Gear:
    return Gear(key, 100.0, kind=kind, pitch_diameter=pitch, diameter=diameter)


def test_the_rule_for_frameless_motors_at_its_limits() -> None:
    rule = FramelessRule(max_diameter_ratio=1.7, min_diameter_ratio=0.5)
    size_20 = gear("G", 0.0508)
    assert fits(motor("M", 1.7 * 0.0508), size_20, rule)
    assert not fits(motor("M", 1.71 * 0.0508), size_20, rule)
    assert fits(motor("M", 0.5 * 0.0508), size_20, rule)
    assert not fits(motor("M", 0.49 * 0.0508), size_20, rule)
    assert not fits(motor("M", 0.06, frameless=False), size_20, rule)
    assert not fits(motor("M", None), size_20, rule)
    assert not fits(motor("M", 0.06), gear("G", 0.0508, kind="planetary"), rule)
    assert fits(motor("M", 0.06), gear("G", 0.0508, kind="rv"), rule)
    assert fits(motor("M", 0.145), gear("G", None, kind="rv", diameter=0.145), rule)
    assert not fits(motor("M", 0.146), gear("G", None, kind="rv", diameter=0.145), rule)
    assert not fits(motor("M", 0.06), gear("G", None), rule)
    assert not fits(motor("M", 0.06), size_20, FramelessRule(max_diameter_ratio=1.0))
    with pytest.raises(InputError):
        FramelessRule(max_diameter_ratio=0.4)


def test_compatible_pairs_equal_the_plain_double_loop() -> None:
    rng = np.random.default_rng(7)
    motors = {f"M{i}": motor(f"M{i}", float(rng.uniform(0.03, 0.2)), frameless=bool(i % 2)) for i in range(30)}
    kinds = ["strain_wave", "rv", "planetary"]
    gears = {f"G{i}": gear(f"G{i}", float(rng.uniform(0.03, 0.1)), kind=kinds[i % 3]) for i in range(40)}
    published = {key: frozenset(rng.choice(list(gears), 5).tolist()) for key in motors}
    catalog = Catalog(motors, gears, published)
    rule = FramelessRule()
    chosen_motors, chosen_gears = list(motors)[::-2], list(gears)[5:]
    expected = [
        (m, g) for m in chosen_motors for g in chosen_gears if g in published[m] or fits(motors[m], gears[g], rule)
    ]
    assert compatible_pairs(catalog, chosen_motors, chosen_gears, rule) == expected
    assert len(expected) > 50
    assert set(compatible_pairs(catalog)) >= set(expected)
    with pytest.raises(InputError, match="M30"):
        compatible_pairs(catalog, ["M30"])
