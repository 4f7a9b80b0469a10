"""The picture of a sweep: its lines, its axis, and where nothing fits."""

from __future__ import annotations

import pandas as pd

from drivetrain.report.figures_sweep import figure_sweep

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
    (axes,) = figure_sweep(results(), NAMES, "mass of all drives [kg]").axes
    assert axes.get_xlabel() == "payload over the study's [-]" and axes.get_ylabel() == "mass of all drives [kg]"
    told = [text.get_text() for text in axes.get_legend().get_texts()]
    assert told == ["voltage 12 V", "voltage 24 V", "none fits, in its line's colour"]
    lines = {line.get_color(): line for line in axes.lines if line.get_linestyle() == "-"}
    crosses = {line.get_color(): line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())}
    assert len(lines) == 2 and set(lines) == set(crosses)
    where = {axes.lines[0].get_color(): [1.0, 1.5]}
    assert [list(one.get_xdata()) for colour, one in crosses.items() if colour in where] == [[1.0, 1.5]]
    heights = {tuple(one.get_ydata()) for one in crosses.values()}
    assert len({height[0] for height in heights}) == 2  # none hides another
    assert axes.get_ylim()[0] == 0.0 and axes.get_ylim()[1] > 6.0


def test_what_is_varied_by_a_factor_is_told_as_a_factor():
    names = ("scale.time", "ambient")
    rows = [(time, air, 1.0, True) for time in ("0.9", "1.2") for air in ("20 °C", "30 °C", "40 °C")]
    (axes,) = figure_sweep(pd.DataFrame(rows, columns=[*names, "objective", "feasible"]), names, "mass").axes
    assert axes.get_xlabel() == "ambient [°C]"
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["time × 0.9", "time × 1.2"]
