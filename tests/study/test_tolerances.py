"""Tolerances in the study file, and the laws they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from drivetrain.errors import InputError
from drivetrain.study.parts.tolerances import Tolerance, Tolerances


def test_nothing_scatters_by_itself(load: Any) -> None:
    assert load().tolerances == Tolerances() and load().tolerances.given == ()


def test_everything_arrives(load: Any) -> None:
    found = load({"tolerances": {
        "torque_constant": "5 %", "resistance": {"normal": "3 %"}, "friction": {"uniform": 0.3}, "efficiency": 0.04,
        "thermal_resistance": {"normal": "10 %"}, "payload": {"normal": "200 g"}, "ambient": "5 K", "samples": 500,
        "seed": 7,
    }}).tolerances  # fmt: skip
    assert found.torque_constant == Tolerance(0.05)
    assert found.resistance == Tolerance(0.03, normal=True)
    assert found.friction == Tolerance(0.3) and found.efficiency == Tolerance(0.04)
    assert found.payload == Tolerance(0.2, normal=True, absolute=True)
    assert found.ambient == Tolerance(5.0, absolute=True)
    assert (found.samples, found.seed, len(found.given)) == (500, 7, 7)
    assert load({"tolerances": {"payload": "4 %"}}).tolerances.payload == Tolerance(0.04)


@pytest.mark.parametrize(("entry", "words"), [
    ({"torque_const": "5 %"}, "torque_constant"),
    ({"resistance": "5 ohm"}, "pure number"),
    ({"resistance": {"gauss": "5 %"}}, "uniform"),
    ({"resistance": {"normal": "3 %", "uniform": "5 %"}}, "one of"),
    ({"friction": "-5 %"}, "at least"),
    ({"friction": {"normal": "50 %"}}, "at most"),
    ({"ambient": "5 %"}, "unit"),
    ({"payload": "5 mm"}, "kg"),
    ({"samples": 3}, "100"),
])  # fmt: skip
def test_faults(load: Any, entry: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        load({"tolerances": entry})
    assert len(caught.value.faults) == 1
    assert words in str(caught.value), caught.value


@pytest.mark.parametrize(("law", "expected"), [
    (Tolerance(0.1), stats.uniform(-0.1, 0.2)),
    (Tolerance(0.1, normal=True), stats.norm(0.0, 0.1)),
])  # fmt: skip
def test_deviations_follow_the_law(law: Tolerance, expected: Any) -> None:
    shares = np.linspace(0.01, 0.99, 21)
    assert law.deviation(shares) == pytest.approx(expected.ppf(shares), rel=1e-12)
    assert law.edges == (pytest.approx(-law.edges[1]), law.edges[1])
