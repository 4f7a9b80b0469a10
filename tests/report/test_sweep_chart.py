"""The picture of a sweep: its lines, its axis, and where nothing fits."""

from __future__ import annotations

import pandas as pd

from drivetrain.report.charts.answer_charts import sweep_chart

NAMES = ("supply.voltage", "scale.payload")


def results() -> pd.DataFrame:
    """Two voltages, three payloads; at 24 V the heaviest is too heavy, at 12 V the two heaviest."""
    rows = [
        (voltage, payload, mass, mass is not None)
        for voltage, masses in (("12 V", (5.0, None, None)), ("24 V", (4.0, 6.0, None)))
        for payload, mass in zip(("0.5", "1", "1.5"), masses, strict=True)
    ]
    return pd.DataFrame(rows, columns=[*NAMES, "objective", "feasible"])


def test_crosses_tell_whose_they_are_and_no_point_is_cut_off():
    chart = sweep_chart(results(), NAMES, "mass of all drives [kg]")
    assert chart is not None and chart.x == "payload over the study's [-]" and chart.y == "mass of all drives [kg]"
    lines = [mark for mark in chart.marks if mark.kind == "line"]
    crosses = [mark for mark in chart.marks if mark.marker == "x"]
    assert [line.label for line in lines] == ["voltage 12 V", "voltage 24 V"]
    assert [line.colour for line in lines] == [cross.colour for cross in crosses]
    assert [list(cross.x) for cross in crosses] == [[1.0, 1.5], [1.5]]
    assert crosses[0].y[0] != crosses[1].y[0]  # none hides another
    assert chart.y_range[0] == 0.0 and chart.y_range[1] > 6.0


def test_what_is_varied_by_a_factor_is_told_as_a_factor():
    names = ("scale.time", "ambient")
    rows = [(time, air, 1.0, True) for time in ("0.9", "1.2") for air in ("20 °C", "30 °C", "40 °C")]
    chart = sweep_chart(pd.DataFrame(rows, columns=[*names, "objective", "feasible"]), names, "mass")
    assert chart is not None and chart.x == "ambient [°C]"
    assert [mark.label for mark in chart.marks if mark.kind == "line"] == ["time × 0.9", "time × 1.2"]
