"""Units at the border: spellings of data sheets against factors written out by hand from the definitions."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import drivetrain
from drivetrain.errors import InputError
from drivetrain.units import (
    NAMES,
    READABLE,
    factor,
    from_si,
    quantities,
    quantity,
    readable_unit,
    split_header,
    to_si,
)

# The definitions: inch and pound (international yard and pound agreement, 1959), standard gravity (CGPM 1901).
INCH, POUND, GRAVITY = 0.0254, 0.45359237, 9.80665
OUNCE_FORCE = POUND * GRAVITY / 16.0
RPM = 2.0 * math.pi / 60.0
CLOSE = 1e-12  # a few roundings of double precision

SHEETS = [
    ("10 Nm", "N m", 10.0),
    ("10 N m", "N m", 10.0),
    ("10 N·m", "N m", 10.0),
    ("10 N.m", "N m", 10.0),
    ("20 Ncm", "N m", 0.2),
    ("92.5 gcm²", "kg m^2", 92.5e-7),
    ("92.5 g cm^2", "kg m^2", 92.5e-7),
    ("1.85 kgcm2", "kg m^2", 1.85e-4),
    ("3 kg·m²", "kg m^2", 3.0),
    ("6000 min⁻¹", "rad/s", 6000 * RPM),
    ("6000 min^-1", "rad/s", 6000 * RPM),
    ("6000 min-1", "rad/s", 6000 * RPM),
    ("6000 1/min", "rad/s", 6000 * RPM),
    ("6000 /min", "rad/s", 6000 * RPM),
    ("6000 r/min", "rad/s", 6000 * RPM),
    ("6000 rev/min", "rad/s", 6000 * RPM),
    ("6 kRPM", "rad/s", 6000 * RPM),
    ("90 deg/s", "rad/s", math.pi / 2.0),
    ("90 °/s", "rad/s", math.pi / 2.0),
    ("3.42 V/krpm", "V s/rad", 3.42 / (1000 * RPM)),
    ("3.42 V/1000 rpm", "V s/rad", 3.42 / (1000 * RPM)),
    ("3.42 V/(1000 min⁻¹)", "V s/rad", 3.42 / (1000 * RPM)),
    ("300 rpm/V", "rad/(s V)", 300 * RPM),
    ("300 min⁻¹/V", "rad/(s V)", 300 * RPM),
    ("4.4 rpm/mNm", "rad/(s N m)", 4400 * RPM),
    ("32 mNm/A", "N m/A", 0.032),
    ("32 mVs/rad", "V s/rad", 0.032),
    ("32 mNm/A", "V s/rad", 0.032),
    ("4.63 oz-in/A", "N m/A", 4.63 * OUNCE_FORCE * INCH),
    ("4.63 oz·in", "N m", 4.63 * OUNCE_FORCE * INCH),
    ("7 lb-in", "N m", 7 * POUND * GRAVITY * INCH),
    ("7 in-lb", "N m", 7 * POUND * GRAVITY * INCH),
    ("7 lbf ft", "N m", 7 * POUND * GRAVITY * 12 * INCH),
    ("0.01 oz-in-s2", "kg m^2", 0.01 * OUNCE_FORCE * INCH),
    ("0.01 oz-in-s²", "kg m^2", 0.01 * OUNCE_FORCE * INCH),
    ("3 lb-in²", "kg m^2", 3 * POUND * INCH**2),
    ("5 lb", "kg", 5 * POUND),
    ("8 oz", "kg", 0.5 * POUND),
    ("0.2 t", "kg", 200.0),
    ("1 hp", "W", 550 * 12 * INCH * POUND * GRAVITY),
    ("2 days", "s", 172800.0),
    ("30 arcsec", "rad", math.pi / 180 / 120),
    ("1.5 Ah", "s A", 5400.0),
    ("2 kJ/K", "J/K", 2000.0),
    ("20 µF", "F", 20e-6),
    ("1 ‰", "1", 1e-3),
    ("35 kgf cm", "N m", 35 * GRAVITY * 0.01),
    ("3 Nm/arcmin", "N m/rad", 3 * 60 * 180 / math.pi),
    ("3 arcmin", "rad", 3 * math.pi / 180 / 60),
    ("0.002 Nms/rad", "N m s/rad", 0.002),
    ("0.002 Nms", "N m s/rad", 0.002),
    ("1 mNm/krpm", "N m s/rad", 1e-3 / (1000 * RPM)),
    ("5 mm/rev", "m/rad", 0.005 / (2 * math.pi)),
    ("25 °C", "degC", 25.0),
    ("25 degC", "degC", 25.0),
    ("298.15 K", "degC", 25.0),
    ("77 °F", "degC", 25.0),
    ("1.7 K/W", "K/W", 1.7),
    ("1.7 °C/W", "K/W", 1.7),
    ("0.39 %/K", "1/K", 0.0039),
    ("10 %", "1", 0.1),
    ("0.7", "", 0.7),
    ("10000 h", "s", 3.6e7),
    ("250 µH", "H", 250e-6),
    ("12 mΩ", "ohm", 0.012),
    ("48 VDC", "V", 48.0),
    ("1.5 kW", "W", 1500.0),
    ("−5 °C", "degC", -5.0),
    ("500 rad/s²", "rad/s^2", 500.0),
]


@pytest.mark.parametrize(("text", "unit", "expected"), SHEETS)
def test_spellings_of_data_sheets(text, unit, expected):
    assert quantity(text, unit, "here") == pytest.approx(expected, rel=CLOSE)


WRONG = [
    (48, "V", "needs a unit, such as 48 V"),
    ("48", "V", "needs a unit, such as 48 V"),
    ("48 A", "V", "must be a voltage in a unit such as V, but 'A' is a current"),
    ("3 Nm", "N m/rad", "the angle is missing"),
    ("100 Hz", "rad/s", "rpm, rad/s or deg/s"),
    ("100 1/s", "rad/s", "rpm, rad/s or deg/s"),
    ("0.01 V/Hz", "V s/rad", "back-emf constant"),
    ("5 °C", "K", "difference of temperatures"),
    ("3 rad", "1", "angle too many"),
    ("8.8 V/krpm", "N m/A", "1 V/krpm is 9.549 mN m/A"),
    ("10 Arms", "A", "convention"),
    ("10 A_pk", "A", "convention"),
    ("1,5 V", "V", "decimal comma"),
    ("6 000 rpm", "rad/s", "cannot read '000'"),
    ("3 rad/s N m", "rad/s", "two ways"),
    ("3 Nn", "N m", "did you mean"),
    ("3 kg cm", "N m", "another kind"),
    ("3 V/", "V", "cannot read"),
    ("3 (V", "V", "brackets"),
    ("", "V", "must be a number with a unit"),
    ("nan V", "V", "must be a number with a unit"),
    ("1e999 V", "V", "must be a number with a unit"),
    (None, "V", "must be a number with a unit"),
    (True, "V", "must be a number with a unit"),
    ([48], "V", "must be a number with a unit"),
]


@pytest.mark.parametrize(("text", "unit", "said"), WRONG)
def test_what_is_wrong_is_said_with_its_place(text, unit, said):
    with pytest.raises(InputError) as caught:
        quantity(text, unit, "supply.voltage")
    (fault,) = caught.value.faults
    assert said in str(fault)
    assert fault.place == "supply.voltage"


@pytest.mark.parametrize(
    ("text", "bounds", "said"),
    [
        ("-1 kg", {"minimum": 0.0}, "at least 0 kg"),
        ("0 kg", {"above": 0.0}, "above 0 kg"),
        ("2 t", {"maximum": 1000.0}, "at most 1000 kg"),
    ],
)
def test_range(text, bounds, said):
    with pytest.raises(InputError, match=said):
        quantity(text, "kg", "payload.mass", **bounds)
    assert quantity("3 kg", "kg", "payload.mass", minimum=3.0, maximum=3.0, above=2.9) == 3.0


@given(value=st.floats(-1e9, 1e9), index=st.integers(0, 10**6))
def test_every_readable_unit_goes_out_and_comes_back(value, index):
    pairs = [(unit, text) for unit, texts in READABLE.items() for text in texts]
    unit, text = pairs[index % len(pairs)]
    written = f"{float(from_si(value, unit, text))!r} {text}"
    # from_si and quantity round once each
    assert quantity(written, unit, "here") == pytest.approx(value, rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("unit", [unit for unit in NAMES if unit != "K"])
def test_every_named_unit_is_si_and_names_itself(unit):
    assert factor(unit) == pytest.approx(1.0, rel=1e-15)
    with pytest.raises(InputError, match=NAMES[unit]):
        quantity("1 Pa", unit, "here")


def test_vectors():
    assert quantities("[0, 0, 60] mm", "m", "offset", 3) == pytest.approx([0.0, 0.0, 0.06])
    assert quantities(["0 mm", "1 in", "6 cm"], "m", "offset", 3) == pytest.approx([0.0, 0.0254, 0.06])
    assert quantities("[1, -2.5e-1]", "", "weights") == pytest.approx([1.0, -0.25])
    with pytest.raises(InputError) as caught:
        quantities(["1", "2 V", "3 m"], "m", "offset", 3)
    assert [fault.place for fault in caught.value.faults] == ["offset[0]", "offset[1]"]
    for wrong in ("[0, 0] mm", "3 mm", 3.0, {"x": 1}):
        with pytest.raises(InputError, match=r"must be 3 values with a unit, such as \[0, 0, 0\] m"):
            quantities(wrong, "m", "offset", 3)


def test_headers():
    assert split_header("Kt [mNm/A]") == ("Kt", "mNm/A")
    assert split_header(" source ") == ("source", "")
    assert split_header("efficiency [-]") == ("efficiency", "-")
    assert factor("mNm/A") == pytest.approx(1e-3, rel=CLOSE)
    assert factor("-") == factor("") == 1.0
    with pytest.raises(InputError, match="unknown unit"):
        factor("mNm/Ampre")


def test_columns_keep_missing_values_and_celsius():
    assert to_si([1.0, np.nan], "krpm", "n") == pytest.approx([1000 * RPM, np.nan], nan_ok=True)
    assert to_si([25.0, 125.0], "C", "T") == pytest.approx([25.0, 125.0])
    assert to_si([77.0], "°F", "T") == pytest.approx([25.0])
    assert to_si([298.15], "K", "T", unit="degC") == pytest.approx([25.0])
    assert to_si([10.0], "K", "rise") == pytest.approx([10.0])
    assert to_si([[90.0, 80.0]], "%", "eta", unit="1").shape == (1, 2)
    with pytest.raises(InputError, match=r"motors.csv: column n0 \[Hz\]: must be a rotation speed"):
        to_si([1.0], "Hz", "column n0 [Hz]", unit="rad/s", file="motors.csv")


def test_readable_units():
    assert readable_unit(0.0125, "N m") == "mN m"
    assert readable_unit(1.2e-5, "kg m^2") == "g cm^2"
    assert readable_unit(0.0, "A") == "A"
    assert readable_unit(3.0, "cd/m") == "cd/m"


def test_pint_waits_until_a_unit_is_read():
    lines = [
        "import sys, drivetrain.units as u",
        "before = 'pint' in sys.modules",
        "u.factor('V')",
        "sys.exit(before or 'pint' not in sys.modules)",
    ]
    checkout = Path(drivetrain.__file__).parent.parent
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, cwd=checkout)


def test_kilograms_do_not_spoil_what_comes_after():
    assert quantity("3 kilograms", "kg", "here") == quantity("3 kg", "kg", "here") == 3.0
    assert quantity("2 kN", "N", "here") == 2000.0


@pytest.mark.parametrize("text", ["km^99999", "mm^99999", "min^" + "9" * 150])
def test_powers_beyond_all_numbers(text):
    with pytest.raises(InputError, match="cannot read"):
        factor(text)
