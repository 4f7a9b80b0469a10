from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.report.quantities import DASH, number, percent, printed_unit, scaled, shown_unit, with_unit


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (12.345, "12.3"), (1234.5, "1\u202f234"),
        (0.034567, "0.0346"), (-5.0, "−5.00"), (0.0, "0"), (2.13e-7, "2.13e−7"),
        (-1.58e10, "−1.58e10"),
        (None, DASH), (math.nan, DASH), (math.inf, "∞"), (999.6, "1\u202f000"),
    ],
)  # fmt: skip
def test_number(value: float | None, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.874, "87\u00a0%"), (0.9999, "100.0\u00a0%"), (1.002, "100.2\u00a0%"), (1.0, "100\u00a0%"), (None, DASH),
        (math.nan, DASH), (math.inf, "∞"), (2e4, ">\u202f10⁶\u00a0%"), (0.0, "0\u00a0%"),
    ],
)  # fmt: skip
def test_percent_shows_a_decimal_only_where_the_verdict_turns(share: float | None, text: str) -> None:
    assert percent(share) == text


def test_speeds_in_rpm_and_small_torques_in_millinewton_metres() -> None:
    values, unit = scaled(np.array([0.0, 2 * math.pi]), "rad/s")
    assert unit == "rpm" and values[1] == pytest.approx(60.0)
    values, unit = scaled(np.array([-0.25, 0.1]), "N m")
    assert unit == "mN m" and values[0] == pytest.approx(-250.0)
    _, unit = scaled(np.array([-0.25, 0.1]), "N m", 3.0)
    assert unit == "N m"


def test_temperatures_and_lives_keep_their_unit() -> None:
    assert shown_unit(3.0, "C") == "C" and printed_unit("C") == "°C"
    assert with_unit(20_000.0, "h") == "20\u202f000\u00a0h"
    assert with_unit(None, "A") == DASH
    assert with_unit(0.0021, "ohm") == "2.10\u00a0mΩ"
