"""Pictures of a run: limits with their values, and an audit that does not magnify rounding."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.report.figures_simulation import figure_electrics, figure_energy
from drivetrain.simulation.recording import Recording, Series

TIME = np.linspace(0.0, 1.0, 11)


def run(error: float) -> Recording:
    return Recording(TIME, {
        "a.current": Series("A", 8.0 * TIME),
        "a.voltage": Series("V", -6.0 * TIME),
        "a.electrical_energy": Series("J", 50.0 * TIME),
        "energy_error": Series("J", error * TIME),
    })  # fmt: skip


def test_a_limit_is_drawn_with_its_value_or_told_as_a_share():
    current, voltage = figure_electrics(run(0.0), ["a"], {"a": {"current": 10.0, "voltage": 48.0}}).axes
    assert [text.get_text() for text in current.texts] == ["limit 10.0\u00a0A"]
    assert [line.get_ydata()[0] for line in current.lines[1:]] == [10.0]  # the current never goes below zero
    assert [text.get_text() for text in voltage.texts] == ["at most 12 % of the limit"] and len(voltage.lines) == 1


@pytest.mark.parametrize(("error", "top"), [(1e-12, 0.05), (0.2, None)])
def test_rounding_of_the_audit_is_not_magnified(error, top):
    below = figure_energy(run(error)).axes[1]
    unit = below.get_ylabel()
    if top is None:
        assert "[mJ]" in unit and below.get_ylim()[1] == pytest.approx(200.0, rel=0.1)
    else:
        assert "[mJ]" in unit and below.get_ylim() == pytest.approx((-top, top))  # a millionth of 50 J
