"""Pictures of all joints together: power at the supply, temperatures side by side."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.report.quantities import convert, printed_unit, scaled, with_unit
from drivetrain.report.svg import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    VERMILLION,
    house_style,
    svg_text,
    thinned,
)
from drivetrain.report.words import no_temperature
from drivetrain.sizing.results import Evaluation, JointResult


def supply_power(evaluation: Evaluation, *, name: str = "supply") -> str:
    """Power of all joints together over the cycle: drawn, and given back.

    Args:
        evaluation: What was found.
        name: Of the figure on the page.

    Returns:
        An SVG element.
    """
    joints, supply = list(evaluation.joints.values()), evaluation.study.supply
    time = joints[0].series.time
    total = np.sum([joint.series.electrical_power for joint in joints], axis=0)
    with house_style(name):
        figure = Figure(figsize=(9.2, 3.0))
        axes = figure.subplots()
        near = supply.peak_power if supply.peak_power is not None and supply.peak_power < 4 * total.max() else None
        power, unit = scaled(total, "W", near)
        kept = thinned(power)
        axes.fill_between(time[kept], np.maximum(power[kept], 0), 0, color=BLUE, alpha=0.25, linewidth=0, label="drawn")
        axes.fill_between(
            time[kept], np.minimum(power[kept], 0), 0, color=GREEN, alpha=0.35, linewidth=0, label="given back"
        )
        axes.plot(time[kept], power[kept], color=INK, linewidth=1.1)
        axes.axhline(0, color=MUTED, linewidth=0.6)
        if near is not None:
            limit = float(convert(near, "W", unit))
            axes.axhline(
                limit, color=VERMILLION, linestyle="--", linewidth=1, label=f"peak limit {with_unit(near, 'W')}"
            )
        elif supply.peak_power is not None:
            axes.plot([], [], " ", label=f"peak limit {with_unit(supply.peak_power, 'W')}, far above")
        axes.margins(x=0)
        axes.set_xlabel("time in the cycle [s]")
        axes.set_ylabel(f"power of all joints [{printed_unit(unit)}]")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=4)
        return svg_text(figure, "electrical power of all joints together over time")


def temperatures(evaluation: Evaluation, *, name: str = "temperatures") -> str:
    """Winding and housing of every joint in the periodic steady state, against the winding's limit.

    Args:
        evaluation: What was found.
        name: Of the figure on the page.

    Returns:
        An SVG element, empty when no temperature could be computed.
    """
    joints = list(evaluation.joints.values())
    if all(joint.series.winding_temperature is None for joint in joints):
        return ""
    ambient = evaluation.study.ambient
    with house_style(name):
        figure = Figure(figsize=(9.2, 0.95 + 0.36 * len(joints)))
        axes = figure.subplots()
        for row, joint in enumerate(joints):
            _thermometer(axes, row, joint, ambient)
        axes.axvline(ambient, color=MUTED, linewidth=1, linestyle=":")
        axes.set_ylim(len(joints) - 0.4, -0.6)
        axes.set_yticks(range(len(joints)), [joint.name for joint in joints])
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="y", visible=False)
        low, high = axes.get_xlim()
        axes.set_xlim(min(low, ambient - 5), high + 0.04 * (high - low))
        axes.set_xlabel("temperature in the periodic steady state [°C]")
        marks = [
            axes.plot([], [], color=BLUE, linewidth=6, label="housing")[0],
            axes.plot([], [], color=ORANGE, linewidth=6, label="winding, up to its highest")[0],
            axes.plot([], [], "|", color=VERMILLION, markersize=11, markeredgewidth=2, label="winding limit")[0],
            axes.plot([], [], color=MUTED, linestyle=":", label="ambient")[0],
        ]
        figure.legend(handles=marks, loc="outside upper center", ncols=4)
        return svg_text(figure, "winding and housing temperature of every joint against the limit")


def _thermometer(axes: Axes, row: int, joint: JointResult, ambient: float) -> None:
    """One joint's bar from ambient to its hottest winding, with the limit as a tick."""
    series, limit = joint.series, joint.drive.motor.max_winding_temperature
    if series.winding_temperature is None:
        axes.annotate(
            no_temperature(joint),
            (ambient, row),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
            color=MUTED,
        )
        return
    hottest = float(series.winding_temperature.max())
    axes.barh(row, hottest - ambient, left=ambient, height=0.42, color=ORANGE, alpha=0.85, linewidth=0)
    if series.housing_temperature is not None:
        housing = float(series.housing_temperature.max())
        axes.barh(row, housing - ambient, left=ambient, height=0.2, color=BLUE, linewidth=0)
    axes.annotate(
        f"{hottest:.0f} °C", (hottest, row), xytext=(4, 0), textcoords="offset points", va="center", fontsize=7.5
    )
    if limit is not None:
        axes.plot(limit, row, "|", color=VERMILLION, markersize=13, markeredgewidth=2)
