"""Numbers of a data sheet in the wrong unit or convention: plausible one by one, impossible together."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from hard_case import Figure, hard_case

from drivetrain.catalog.findings import Severity
from drivetrain.catalog.linting import lint
from drivetrain.catalog.motor_rules import check_motor
from drivetrain.catalog.schema import MOTOR_COLUMNS
from drivetrain.catalog.table import read_table
from drivetrain.whole_files import shipped

SHEETS = 50
NEEDED = [
    "no_load_speed [rpm]", "no_load_current [A]", "stall_torque [mNm]", "stall_current [A]", "torque_constant [mNm/A]",
    "speed_constant [rpm/V]", "mechanical_time_constant [ms]", "rotor_inertia [g cm^2]", "inductance [mH]",
]  # fmt: skip
# Column, and what stands there over what should: the header's unit is believed.
MISTAKES = {
    "no-load speed in rad/s under rpm": ("no_load_speed [rpm]", math.pi / 30.0),
    "torque constant in N m/A under mNm/A": ("torque_constant [mNm/A]", 1e-3),
    "torque constant in N cm/A under mNm/A": ("torque_constant [mNm/A]", 0.1),
    "torque constant per rms ampere of a phase": ("torque_constant [mNm/A]", math.sqrt(1.5)),
    "torque constant per peak ampere of a phase": ("torque_constant [mNm/A]", math.sqrt(4.0 / 3.0)),
    "back-emf of a phase for torque constant": ("torque_constant [mNm/A]", 1.0 / math.sqrt(3.0)),
    "resistance of one phase": ("resistance [ohm]", 0.5),
    "resistance in mohm under ohm": ("resistance [ohm]", 1e3),
    "inductance in uH under mH": ("inductance [mH]", 1e3),
    "inertia in kg cm^2 under g cm^2": ("rotor_inertia [g cm^2]", 1e-3),
    "inertia a power of ten off": ("rotor_inertia [g cm^2]", 10.0),
    "stall torque in N m under mNm": ("stall_torque [mNm]", 1e-3),
    "stall current in rms amperes": ("stall_current [A]", 1.0 / math.sqrt(2.0)),
    "no-load current in mA under A": ("no_load_current [A]", 1e3),
}


def sheets() -> pd.DataFrame:
    """Fifty data sheets of the shipped catalogue that print what makes a sheet redundant."""
    whole = pd.read_csv(shipped("catalogs") / "motors.csv")
    full = whole[whole[NEEDED].notna().all(axis=1)]
    return full.sample(SHEETS, random_state=1)


def caught(table: pd.DataFrame) -> tuple[int, int]:
    """Sheets with an error by the lint, and by the ranges of the columns alone."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motors.csv"
        table.to_csv(path, index=False)
        by_lint = {fault.key for fault in lint(folder) if fault.severity is Severity.ERROR}
        by_range = {fault.line for fault in read_table(path, MOTOR_COLUMNS).faults}
        return len(by_lint), len(by_range)


@hard_case(
    "T42",
    "Unit errors in data sheets",
    setup="14 errors in each of 50 rows of the catalogue, and the 50 rows without an error.",
    naive="a permitted range for each column",
)
def test_mistakes() -> list[Figure]:
    clean = sheets()
    alarms, range_alarms = caught(clean)
    found = {}
    for name, (column, factor) in MISTAKES.items():
        wrong = clean.copy()
        wrong[column] = wrong[column] * factor
        found[name] = caught(wrong)
    everywhere, by_range = (sum(counts[way] == SHEETS for counts in found.values()) for way in (0, 1))
    return [
        Figure("errors found in all 50 rows, of 14", float(everywhere), float(by_range), at_least=13.0),
        Figure("false alarms", float(alarms), float(range_alarms), at_most=0.0),
    ]


def test_no_alarm_on_sheets_that_nobody_chose() -> None:
    """Two hundred motors from the laws, printed with three digits, each within 4 per cent as sheets are."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        resistance, constant = 10.0 ** rng.uniform(-1.3, 1.3), 10.0 ** rng.uniform(-2.0, -0.7)
        voltage = 10.0 ** rng.uniform(1.0, 1.7)
        time = 10.0 ** rng.uniform(-2.7, -1.6)
        no_load = voltage / resistance * 10.0 ** rng.uniform(-2.5, -1.5)
        sheet = {
            "nominal_voltage": voltage,
            "resistance": resistance,
            "torque_constant": constant,
            "inductance": resistance * 10.0 ** rng.uniform(-4.5, -3.0),
            "no_load_current": no_load,
            "no_load_speed": (voltage - resistance * no_load) / constant,
            "stall_current": voltage / resistance,
            "stall_torque": constant * voltage / resistance,
            "speed_constant": 1.0 / constant,
            "speed_torque_gradient": resistance / constant**2,
            "rotor_inertia": time * constant**2 / resistance,
            "mechanical_time_constant": time,
        }
        spread = {"no_load_speed", "stall_torque", "stall_current", "mechanical_time_constant"}
        printed = {
            name: float(f"{value * (rng.uniform(0.96, 1.04) if name in spread else 1.0):.3g}")
            for name, value in sheet.items()
        }
        assert check_motor({"kind": "brushed", "current_basis": "dc", "winding_basis": "line_line", **printed}) == []
