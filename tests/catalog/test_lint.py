"""The lint finds contradictions, and reports nothing for correct rows."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

import pytest

from drivetrain.catalog.findings import UNIT_SLIPS, Finding, Severity, slip
from drivetrain.catalog.formats import TABLE
from drivetrain.catalog.gear_rules import FAMILY, check_families, check_gear, exact_ratio
from drivetrain.catalog.importers import import_rows
from drivetrain.catalog.linting import LintFault, lint
from drivetrain.catalog.motor_rules import check_motor
from drivetrain.catalog.table import Cell, Row
from drivetrain.errors import InputError
from drivetrain.whole_files import shipped

DATA = Path(__file__).parent / "data" / "si_table"
FAULTY_MOTORS, FAULTY_GEARS = 5, 40  # the last rows of the excerpts

# maxon RE 40 148867 (24 V), in SI, as printed in the catalogue of 2019.
RE40: dict[str, Cell] = {
    "kind": "brushed", "current_basis": "dc", "winding_basis": "line_line", "nominal_voltage": 24.0,
    "no_load_speed": 793.776, "no_load_current": 0.137, "nominal_speed": 725.7, "nominal_torque": 0.177,
    "nominal_current": 6.0, "stall_torque": 2.42, "stall_current": 80.2, "resistance": 0.299, "inductance": 8.2e-5,
    "torque_constant": 0.0302, "speed_constant": 33.2, "speed_torque_gradient": 328.0,
    "mechanical_time_constant": 0.00466, "rotor_inertia": 1.42e-5, "resistance_winding_housing": 1.93,
    "resistance_housing_ambient": 4.65, "winding_time_constant": 41.5, "housing_time_constant": 809.0,
    "max_winding_temperature": 155.0, "max_speed": 1256.6, "diameter": 0.04, "mass": 0.48,
}  # fmt: skip

SOUND_GEAR: dict[str, Cell] = {
    "kind": "planetary", "stages": 2.0, "ratio": 20.25, "ratio_exact": "81/4", "efficiency": 0.75,
    "continuous_torque": 0.6, "repeated_peak_torque": 0.9, "momentary_torque": 1.5, "max_input_speed": 800.0,
    "average_input_speed_limit": 600.0, "stiffness_1": 100.0, "stiffness_2": 200.0, "stiffness_3": 300.0,
    "torque_1": 0.1, "torque_2": 0.5, "no_load_torque": 0.002,
}  # fmt: skip


@pytest.fixture(scope="module")
def imported(tmp_path_factory: pytest.TempPathFactory) -> list[LintFault]:
    out = tmp_path_factory.mktemp("imported")
    import_rows(TABLE, DATA, out, basis="dc")
    return lint(out)


def keys(name: str) -> list[str]:
    with (DATA / name).open(encoding="utf-8", newline="") as file:
        return [row["key"] for row in csv.DictReader(file)]


def columns_of(faults: list[LintFault], key: str, severity: Severity = Severity.ERROR) -> set[str]:
    return {fault.column.split(" [")[0] for fault in faults if fault.key == key and fault.severity is severity}


def test_the_45_rows_known_to_be_wrong_are_found_for_their_reasons(imported: list[LintFault]) -> None:
    motors, gears = keys("motors.csv")[-FAULTY_MOTORS:], keys("gears.csv")[-FAULTY_GEARS:]
    speed_controlled = {"no_load_speed", "stall_torque", "stall_current"}  # integrated electronics limit all three
    for key in motors[:4]:
        assert columns_of(imported, key) == speed_controlled
    assert columns_of(imported, motors[4]) == {"no_load_speed"}
    more_lasting_than_peak = {"maxon_144410"} | {key for key in gears if "GPX19LN" in key}
    misprinted = {"maxon_GPX19LZKLSL0150CPLW", "maxon_305137"}
    assert len(more_lasting_than_peak) == 12
    for key in gears:
        if key in more_lasting_than_peak:
            assert columns_of(imported, key) == {"continuous_torque"}
        elif key in misprinted:
            assert columns_of(imported, key) == {"ratio_exact"}
        elif key == "maxon_410657":  # the page prints one torque of two
            assert columns_of(imported, key) == {"continuous_torque"}
        else:  # empty pages
            assert columns_of(imported, key) == {"ratio", "continuous_torque"}


def test_sound_rows_are_left_alone(imported: list[LintFault]) -> None:
    bad = {*keys("motors.csv")[-FAULTY_MOTORS:], *keys("gears.csv")[-FAULTY_GEARS:]}
    others = [fault for fault in imported if fault.key not in bad]
    errors = {(fault.key, fault.column) for fault in others if fault.severity is Severity.ERROR}
    # A row without resistance and torque constant cannot be used, even if the rest is correct.
    lacking = "kollmorgen_TBM(S)-6051-A"
    assert errors == {(lacking, "resistance [ohm]"), (lacking, "torque_constant [N m/A]")}
    unusual = {fault.key for fault in others if fault.severity is Severity.WARNING}
    assert unusual == {
        "maxon_ECXZ16M1VF35N1IL1D589B",  # nominal speed above the no-load speed
        "maxon_476927", "beckhoff_NPT045-MF_i5",  # one of the two torques missing
        "maxon_166954",  # continuous input speed above the short-time one
    }  # fmt: skip


def test_a_fault_states_place_printed_and_predicted_value(imported: list[LintFault]) -> None:
    fault = next(f for f in imported if f.key == "maxon_350909" and f.column.startswith("stall_current"))
    line = keys("motors.csv").index("maxon_350909") + 2
    assert (Path(fault.file).name, fault.row) == ("motors.csv", line)
    assert fault.printed == pytest.approx(4.41)
    assert fault.predicted == pytest.approx(24.0 / 0.201, rel=1e-6)
    for part in (f"row {line}", "stall_current [A]", "4.41", "119.4", "V/R"):
        assert part in str(fault)


def test_the_shipped_catalogue_is_clean() -> None:
    assert lint(shipped("catalogs")) == []


def test_the_sound_rows_of_this_file_are_sound() -> None:
    assert check_motor(RE40) == []
    assert check_gear(SOUND_GEAR) == []


@pytest.mark.parametrize("factor", [1.09, 1 / 1.09])
@pytest.mark.parametrize("name", ["no_load_speed", "stall_torque", "stall_current", "mechanical_time_constant"])
def test_nine_percent_pass_and_eleven_do_not(name: str, factor: float) -> None:
    value = RE40[name]
    assert isinstance(value, float)
    assert not [f for f in check_motor({**RE40, name: value * factor}) if f.severity is Severity.ERROR]
    worse = factor**1.5
    assert {f.column for f in check_motor({**RE40, name: value * worse}) if f.severity is Severity.ERROR} == {name}


def test_a_row_per_phase_and_rms_is_checked_in_its_own_convention() -> None:
    """The RE 40's values in the convention of a sinusoidal machine; the predicted value is in rms amperes."""
    rms = {**RE40, "kind": "brushless", "current_basis": "rms", "winding_basis": "phase", "resistance": 0.1495}
    rms |= {"inductance": 4.1e-5, "torque_constant": 0.0302 * math.sqrt(1.5)}
    rms |= {name: RE40[name] / math.sqrt(1.5) for name in ("no_load_current", "nominal_current", "stall_current")}  # type: ignore[operator]
    assert check_motor(rms) == []
    wrong = check_motor({**rms, "stall_current": 80.2})
    assert [f.column for f in wrong] == ["stall_current"]
    assert wrong[0].predicted == pytest.approx(24.0 / 0.299 / math.sqrt(1.5), rel=1e-9)


@pytest.mark.parametrize(
    ("change", "column", "severity"),
    [
        ({"nominal_current": 0.1}, "no_load_current", "error"),
        ({"peak_current": 5.0}, "nominal_current", "error"),
        ({"peak_torque": 0.1}, "nominal_torque", "error"),
        ({"peak_current": 20.0, "peak_torque": 1.0}, "peak_torque", "error"),
        ({"peak_current": 40.0, "peak_torque": 1.0}, "peak_torque", "warning"),
        ({"nominal_speed": 800.0}, "nominal_speed", "warning"),
        ({"nominal_torque": 0.26}, "nominal_torque", "warning"),
        ({"nominal_current": 8.0, "nominal_torque": 0.237}, "nominal_current", "warning"),
        ({"housing_time_constant": 20.0}, "winding_time_constant", "warning"),
        ({"coulomb_friction": 0.003, "viscous_friction": 4e-6}, "no_load_current", "warning"),
        ({"mass": 0.03}, "rotor_inertia", "error"),
        ({"mass": 0.06}, "rotor_inertia", "warning"),
        ({"inductance": 0.299 * 5e-7}, "inductance", "error"),
        ({"max_speed": 12000.0}, "max_speed", "error"),  # rpm as rad/s
        ({"current_basis": "rms"}, "current_basis", "error"),
        ({"winding_basis": "phase"}, "winding_basis", "error"),
    ],
)
def test_each_motor_rule(change: Mapping[str, Cell], column: str, severity: str) -> None:
    assert (column, severity) in {(f.column, f.severity.value) for f in check_motor({**RE40, **change})}


@pytest.mark.parametrize(
    ("change", "column", "severity"),
    [
        ({"continuous_torque": 1.0}, "continuous_torque", "error"),
        ({"average_torque_limit": 0.5}, "continuous_torque", "error"),
        ({"repeated_peak_torque": 2.0}, "repeated_peak_torque", "error"),
        ({"stiffness_1": 250.0}, "stiffness_1", "error"),
        ({"stiffness_3": 150.0}, "stiffness_2", "error"),
        ({"torque_1": 0.6}, "torque_1", "error"),
        ({"no_load_torque": 0.05}, "no_load_torque", "error"),
        ({"ratio": 24.0}, "ratio", "error"),
        ({"ratio": -24.0}, "ratio", "error"),
        ({"ratio": 21.5}, "ratio", "warning"),
        ({"ratio_exact": "81:4"}, "ratio_exact", "error"),
        ({"ratio_exact": "81/0"}, "ratio_exact", "error"),
        ({"backdriving_efficiency": 0.8}, "backdriving_efficiency", "warning"),
        ({"efficiency": 0.3}, "efficiency", "warning"),
        ({"stages": 1.0}, "ratio", "warning"),
        ({"average_input_speed_limit": 900.0}, "average_input_speed_limit", "warning"),
        ({"rated_speed": 900.0}, "rated_speed", "warning"),
        ({"size": 25.0, "pitch_diameter": 0.05}, "pitch_diameter", "warning"),
        ({"continuous_torque": None}, "continuous_torque", "warning"),
        ({"continuous_torque": None, "momentary_torque": None}, "continuous_torque", "error"),
        ({"repeated_peak_torque": None, "momentary_torque": None}, "repeated_peak_torque", "warning"),
    ],
)
def test_each_gear_rule(change: Mapping[str, Cell], column: str, severity: str) -> None:
    assert (column, severity) in {(f.column, f.severity.value) for f in check_gear({**SOUND_GEAR, **change})}


SOUND_STRAIN_WAVE: dict[str, Cell] = {
    "kind": "strain_wave", "stages": 1.0, "ratio": 100.0, "continuous_torque": 31.0, "repeated_peak_torque": 70.0,
    "tilting_moment_limit": 64.0, "axial_load_limit": 1130.0, "radial_load_limit": 757.0,
    "bearing_dynamic_rating": 5290.0, "bearing_static_rating": 7550.0, "bearing_pitch_diameter": 0.0425,
    "mesh_efficiency": 0.9, "drag_torque": 0.0592, "drag_speed": 209.4, "drag_speed_exponent": 0.72,
    "drag_temperature_1": 0.0436, "drag_temperature_2": 0.00037, "seal_drag_torque": 0.0, "starting_torque": 0.0295,
    "back_driving_torque": 3.1, "loss_basis": "FITTED",
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "column", "severity"),
    [
        ({"tilting_moment_limit": 170.0}, "tilting_moment_limit", "error"),  # static limit: 7550 N x 42.5 mm / 2
        ({"axial_load_limit": 18e3}, "axial_load_limit", "error"),
        ({"radial_load_limit": 7600.0}, "radial_load_limit", "error"),
        ({"bearing_static_rating": 75.5e3}, "bearing_static_rating", "warning"),
        ({"bearing_pitch_diameter": None}, "bearing_pitch_diameter", "warning"),
        ({"mesh_efficiency": None}, "mesh_efficiency", "error"),
        ({"drag_torque": None}, "drag_torque", "error"),
        ({"drag_speed": None}, "drag_speed", "error"),
        ({"drag_temperature_1": None}, "drag_temperature_1", "error"),
        ({"efficiency": 0.95}, "mesh_efficiency", "error"),
        ({"drag_temperature_1": -0.0436}, "drag_temperature_1", "warning"),
        ({"drag_temperature_2": 0.002}, "drag_temperature_1", "warning"),  # the drag would increase again above 31 C
        ({"drag_torque": 0.5}, "drag_torque", "error"),
        ({"starting_torque": 0.5}, "starting_torque", "error"),
        ({"back_driving_torque": 0.031}, "back_driving_torque", "warning"),
        ({"loss_basis": None}, "loss_basis", "error"),
    ],
)
def test_each_rule_of_losses_and_bearings(change: Mapping[str, Cell], column: str, severity: str) -> None:
    assert check_gear(SOUND_STRAIN_WAVE) == []
    assert (column, severity) in {(f.column, f.severity.value) for f in check_gear({**SOUND_STRAIN_WAVE, **change})}


# The last value without a finding, written out: row, column varied, border, whether larger values are worse,
# severity of the finding, part of its message, value that it predicts.
KT, RESISTANCE = 0.0302, 0.299
COPPER, THERMAL = 1.0 + 0.0039 * 130.0, 1.93 + 4.65  # R at 155 C over R at 25 C; K/W
LASTING = math.sqrt(130.0 / (RESISTANCE * COPPER * THERMAL))  # A
LUMPED = {
    name: value for name, value in RE40.items()
    if name not in ("resistance_winding_housing", "resistance_housing_ambient")
} | {"resistance_winding_ambient": THERMAL}  # fmt: skip
COOLER = {**LUMPED, "reference_temperature": 20.0}  # its resistance is printed at 20 C
COOL = LASTING * math.sqrt(COPPER / (1.0 + 0.0039 * 135.0))
WHOLE = 0.48 * 0.02**2  # kg m^2, all mass at the outer radius
SINGLE = {
    name: value for name, value in SOUND_GEAR.items() if name not in ("ratio_exact", "efficiency", "no_load_torque")
}
BORDERS = [
    (RE40, "no_load_speed", 1.1 * (24.0 - RESISTANCE * 0.137) / KT, True, "error", "(V - R I0)/kt",
     (24.0 - RESISTANCE * 0.137) / KT),
    ({**RE40, "no_load_current": None}, "no_load_speed", 0.9 * 24.0 / KT, False, "error", "(V - R I0)",
     24.0 / KT),
    (RE40, "speed_constant", 0.9 / KT, False, "error", "1/kt", 1.0 / KT),
    (RE40, "nominal_current", 1.15 * LASTING, True, "warning", "heats", LASTING),
    (LUMPED, "nominal_current", 1.15 * LASTING, True, "warning", "heats", LASTING),
    ({**LUMPED, "resistance_winding_housing": 1.93}, "nominal_current", 1.15 * LASTING, True, "warning", "heats",
     LASTING),
    ({**LUMPED, "resistance_housing_ambient": 4.65}, "nominal_current", 1.15 * LASTING, True, "warning", "heats",
     LASTING),
    (COOLER, "nominal_current", 1.15 * COOL, True, "warning", "heats", COOL),
    (RE40, "nominal_current", 80.2, True, "error", "stall current", None),
    (RE40, "inductance", 1e-6 * RESISTANCE, False, "error", "L/R", None),
    (RE40, "inductance", 2e-2 * RESISTANCE, True, "error", "L/R", None),
    (RE40, "rotor_inertia", 1e-4 * KT**2 / RESISTANCE, False, "error", "R J/kt^2", None),
    (RE40, "rotor_inertia", 0.5 * KT**2 / RESISTANCE, True, "error", "R J/kt^2", None),
    (RE40, "rotor_inertia", WHOLE, True, "error", "whole mass", 0.5 * WHOLE),
    (RE40, "rotor_inertia", 0.5 * WHOLE, True, "warning", "0.5 of mass", None),
    (RE40, "rotor_inertia", 2e-3 * WHOLE, False, "warning", "0.002 of mass", None),
    (RE40, "max_speed", 40.0 / math.sqrt(2.0 * 1.42e-5 / 0.48), True, "error", "rpm given as rad/s", None),
    (SOUND_GEAR, "continuous_torque", 0.9 * (1.0 + 1e-6), True, "error", "repeated peak", None),
    ({**SOUND_GEAR, "ratcheting_torque": 2.0}, "ratcheting_torque", 1.5, False, "error",
     "momentary", None),
    ({**SOUND_GEAR, "buckling_torque": 2.0}, "buckling_torque", 1.5, False, "error", "momentary", None),
    (SOUND_GEAR, "no_load_torque", 0.6 / 20.25, True, "error", "at the input", None),
    ({**SOUND_GEAR, "size": 25.0}, "pitch_diameter", 1.05 * 2.5 * 0.0254, True, "warning", "+5.0 %",
     0.0635),
    ({**SOUND_GEAR, "size": 25.0}, "pitch_diameter", 0.95 * 2.5 * 0.0254, False, "warning", "-5.0 %",
     0.0635),
    (SINGLE, "ratio", 2.0**2, False, "warning", "makes 2 a stage", None),
    (SINGLE, "ratio", 12.0**2, True, "warning", "makes 12 a stage", None),
    ({**SINGLE, "kind": "spur", "stages": 3.0}, "ratio", 1.1**3, False, "warning", "makes 1.1 a stage", None),
    ({**SINGLE, "stages": None}, "ratio", 1.0, False, "warning", "faster than the motor", None),
    (SOUND_GEAR, "efficiency", 0.65**2, False, "warning", "0.65 a stage", None),
    (SOUND_GEAR, "efficiency", 0.99**2, True, "warning", "0.99 a stage", None),
    (SOUND_GEAR, "ratio", 1.1 * 20.25, True, "error", "+10.0 % from the fraction", 20.25),
    (SOUND_GEAR, "ratio", 0.9 * 20.25, False, "error", "-10.0 % from the fraction", 20.25),
    (SOUND_GEAR, "ratio", 1.025 * 20.25, True, "warning", "+2.5 % from the fraction", 20.25),
    ({**SOUND_GEAR, "ratio_exact": "8", "ratio": 8.0}, "ratio", 8.5, True, "warning", "+6.3 %", 8.0),
    (SOUND_STRAIN_WAVE, "back_driving_torque", 1.3 * 1.05 * 100.0 * 0.0295, True, "warning",
     "1.05 times", 1.05 * 100.0 * 0.0295),
    (SOUND_STRAIN_WAVE, "back_driving_torque", 0.7 * 1.05 * 100.0 * 0.0295, False, "warning",
     "1.05 times", 1.05 * 100.0 * 0.0295),
    (SOUND_STRAIN_WAVE, "drag_torque", 0.31, True, "error", "at the input", None),
    (SOUND_STRAIN_WAVE, "starting_torque", 0.31, True, "error", "at the input", None),
    ({**SOUND_STRAIN_WAVE, "efficiency": 0.8}, "mesh_efficiency", 0.8, False, "error", "counts the drag",
     None),
    (SOUND_STRAIN_WAVE, "drag_temperature_1", 2.0 * 0.00037 * 20.0, False, "warning", "thins", None),
    ({**SOUND_STRAIN_WAVE, "drag_temperature_2": -0.00037}, "drag_temperature_1", 2.0 * 0.00037 * 30.0, False,
     "warning", "thins", None),
    (SOUND_STRAIN_WAVE, "bearing_static_rating", 0.3 * 5290.0, False, "warning", "usual", None),
    (SOUND_STRAIN_WAVE, "bearing_static_rating", 5.0 * 5290.0, True, "warning", "usual", None),
    (SOUND_STRAIN_WAVE, "tilting_moment_limit", 7550.0 * 0.5 * 0.0425, True, "error", "by itself",
     7550.0 * 0.5 * 0.0425),
    (SOUND_STRAIN_WAVE, "axial_load_limit", 7550.0 / 0.44, True, "error", "by itself", 7550.0 / 0.44),
    (SOUND_STRAIN_WAVE, "radial_load_limit", 7550.0, True, "error", "by itself", 7550.0),
]  # fmt: skip


@pytest.mark.parametrize(("row", "varied", "border", "upward", "severity", "word", "predicted"), BORDERS)
def test_a_rule_begins_where_it_says(
    row: Mapping[str, Cell], varied: str, border: float, upward: bool, severity: str, word: str,
    predicted: float | None,
) -> None:  # fmt: skip
    """A value on the good side of its border has no such finding, one on the other side has it."""
    check = check_motor if "torque_constant" in row else check_gear

    def found(value: float, sign: float) -> list[Finding]:
        cells = {**row, varied: value}
        turned = {name: sign * cells[name] for name in ("ratio",) if name in cells}  # type: ignore[operator]
        every = check({**cells, **turned})
        return [one for one in every if (one.column, one.severity.value) == (varied, severity) and word in one.problem]

    outward = 1e-7 if upward else -1e-7  # much less than the rounding that the rules allow
    for sign in (1.0, -1.0):  # of the gear's ratio
        assert not found(border * (1.0 - outward), sign)
        [one] = found(border * (1.0 + outward), sign)
        seen = one.predicted if one.predicted is None or varied != "ratio" else sign * one.predicted
        assert seen == (None if predicted is None else pytest.approx(predicted, rel=1e-12))


def test_a_contradiction_names_the_unit_mistake_that_explains_it() -> None:
    [speed] = [f for f in check_motor({**RE40, "no_load_speed": 60 / (2 * math.pi) * 793.776}) if "R I0" in f.problem]
    assert speed.problem.endswith("from (V - R I0)/kt; about a factor 9.549: rpm against rad/s?")
    [torque] = [f for f in check_gear({**SOUND_GEAR, "continuous_torque": 9.0}) if f.column == "continuous_torque"]
    assert torque.problem.endswith(
        "the repeated peak torque; about a factor 10: a power of ten, such as N cm against mN m?"
    )


def test_each_unit_mistake_is_named_within_three_percent() -> None:
    for factor, words in UNIT_SLIPS:
        assert slip(factor * 1.0001) == slip(-1.0 / factor) == f"about a factor {factor:.4g}: {words}?"
        assert slip(factor * 1.0299) and slip(factor * 0.9701)
    assert slip(1000.0 * 1.0301) == slip(1000.0 * 0.9699) == slip(1.07) == slip(4.0) == slip(0.0) == ""


def test_an_inverted_ratio_is_unusual() -> None:
    [found] = check_gear({**SOUND_GEAR, "ratio": 0.05, "ratio_exact": None, "stages": None})
    assert (found.column, found.severity) == ("ratio", Severity.WARNING) and "was 20 meant" in found.problem


def test_sources_without_a_date_are_one_warning(tmp_path: Path) -> None:
    gears = "key,kind,ratio,continuous_torque [Nm],repeated_peak_torque [Nm],source\nA,spur,5,1,2,s\nB,spur,6,1,2,s\n"
    (tmp_path / "gears.csv").write_text(gears, encoding="utf-8")
    assert [(one.row, one.column, "in 1 more row" in one.problem) for one in lint(tmp_path)] == [(2, "edition", True)]


def test_a_negative_ratio_with_its_fraction_is_sound() -> None:
    assert check_gear({**SOUND_GEAR, "ratio": -20.25}) == []
    assert exact_ratio(" 57 / 13 ") == Fraction(57, 13)
    assert exact_ratio("-5/2") is None


def test_an_odd_denominator_is_an_error_only_when_one_digit_makes_it() -> None:
    def row(line: int, text: str) -> Row:
        return Row(line, {"maker": "m", "stages": 3.0, "ratio_exact": text})

    usual = [row(line, "19683/125") for line in range(2, 2 + FAMILY)]
    odd = [row(20, "19683/64"), row(21, "19683/225"), row(22, "19683/124")]
    found = {(r.line, finding.severity.value) for r, finding in check_families([*usual, *odd])}
    # 124 instead of 125 changes the ratio by less than the tolerance of a data sheet.
    assert found == {(20, "warning"), (21, "error")}
    assert check_families([*usual[1:], *odd]) == []  # too few gears to tell the usual denominator
    # Two gears with the same denominator are a family of their own.
    assert check_families([*usual, *odd[:1], row(23, "19683/64")]) == []


def write(folder: Path, **tables: str) -> Path:
    for name, text in tables.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    return folder


def test_texts_units_duplicates_and_missing_sources(tmp_path: Path) -> None:
    header = (
        "key,kind,maker,part_number,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A],source,edition"
    )
    rows = [
        "A,brushed,m,1,dc,line_line,1,10,s,2020",
        "A,brushed,m,1,dc,line_line,2,10,,",
        "B,brushed,m,1,,line_line,1,0,s,",
    ]
    found = lint(write(tmp_path, motors="\n".join([header, *rows]) + "\n"))
    assert [(f.row, f.column, f.severity.value) for f in found] == [
        (3, "key", "error"),
        (3, "source", "error"),
        (4, "current_basis", "error"),
        (4, "torque_constant [mNm/A]", "error"),
        (4, "edition", "warning"),
        (4, "part_number", "warning"),
    ]
    assert found[2].key == "B"


def test_pairs_are_checked_against_the_keys_of_all_folders(tmp_path: Path) -> None:
    gears = "key,kind,ratio,continuous_torque [Nm],repeated_peak_torque [Nm],source,edition\nG,spur,5,1,2,s,e\n"
    own, other = tmp_path / "own", tmp_path / "other"
    own.mkdir()
    other.mkdir()
    write(own, gears=gears, compatibility="motor_key,gear_keys\nM,G H G\n")
    write(other, gears=gears.replace("\nG,", "\nH,"))
    # There is no table of motors, so their keys are not checked.
    assert [(f.column, f.printed) for f in lint(own)] == [("gear_keys", "H"), ("gear_keys", "G")]
    assert [(f.printed, f.severity.value) for f in lint(own, beside=[other])] == [("G", "warning")]


def test_a_folder_without_tables_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"motors\.csv"):
        lint(tmp_path)
    with pytest.raises(InputError, match="no folder"):
        lint(tmp_path / "missing")
