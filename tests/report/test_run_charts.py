"""Pictures of a run: limits with their values, and an audit that does not magnify rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.report.charts.run_charts import energy_charts, run_charts
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
    told = dict((chart.y, (chart, caption)) for chart, caption in run_charts(
        run(0.0), ["a"], {"a": {"current": 8.0, "voltage": 48.0}}
    ))  # fmt: skip
    current, caption = told["current [A]"]
    (rule,) = (mark for mark in current.marks if mark.kind == "rule")  # the current never goes below zero
    assert rule.y == [8.0] and rule.label == "limit of a 8.00\u00a0A" and "100\u00a0% of 8.00\u00a0A" in caption
    voltage, caption = told["voltage [V]"]
    assert not any(mark.kind == "rule" for mark in voltage.marks) and "a 12\u00a0% of 48.0\u00a0V" in caption
    line = next(mark for mark in voltage.marks if mark.kind == "line")
    assert line.y == pytest.approx(-6.0 * TIME)


@pytest.mark.parametrize(("error", "top"), [(1e-12, 0.05), (0.2, None)])
def test_rounding_of_the_audit_is_not_magnified(error, top):
    below = energy_charts(run(error))[1]
    assert "[mJ]" in below.y
    if top is None:
        assert below.y_range == () and below.marks[0].y[-1] == pytest.approx(200.0)
    else:
        assert below.y_range == pytest.approx((-top, top))  # a millionth of 50 J


def test_a_slide_beside_a_turning_joint_has_its_own_unit():
    recording = Recording(TIME, {
        "lift.position": Series("m", 0.1 * TIME), "swing.position": Series("rad", np.radians(20.0) * TIME),
        "lift.command_position": Series("m", 0.1 * TIME - 2e-3), "swing.command_position": Series("rad", 0.0 * TIME),
    })  # fmt: skip
    told = {chart.y: (chart.marks[0], caption) for chart, caption in run_charts(recording, ["lift", "swing"], {})}
    ends = {label: mark.y[-1] for label, (mark, _) in told.items()}
    assert ends["position [mm]"] == pytest.approx(100.0) and ends["position [°]"] == pytest.approx(20.0)
    assert ends["position error [mm]"] == pytest.approx(2.0) and "position error [mrad]" in ends
    assert told["position [mm]"][1] == "Positions of lift." and len({mark.colour for mark, _ in told.values()}) == 2


@pytest.mark.parametrize(("rise", "ends"), [(0.02, (79.51, 80.51)), (5.0, ())])
def test_a_steady_temperature_is_not_magnified(rise, ends):
    whole = run(0.0)
    series = {**whole.series, "a.winding_temperature": Series("C", 80.0 + rise * TIME)}
    warm = replace(whole, series=series, kept={"state": TIME})
    chart = next(chart for chart, _ in run_charts(warm, ["a"], {}) if chart.y == "winding [°C]")
    assert chart.y_range == pytest.approx(ends)
