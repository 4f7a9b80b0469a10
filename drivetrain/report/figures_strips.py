"""Strips over time for one joint: what it does, and what that costs in current, voltage, power and heat."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.report.quantities import convert, printed_unit, scaled, shown_unit, with_unit
from drivetrain.report.svg import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    house_style,
    svg_text,
    thinned,
)
from drivetrain.report.words import nearness, no_temperature
from drivetrain.sizing.results import JointResult

FAR = 4.0  # a limit further than this many times the curve is told in words, so that the curve stays readable
SMALLEST_SPAN = 10.0  # kelvin; a steady temperature is not blown up into a drama


@dataclass(frozen=True)
class Curve:
    """One line on a strip.

    Attributes:
        label: In the legend.
        values: [unit of the strip], (N,).
        colour: Of the line.
        width: Of the line, points.
    """

    label: str
    values: Array
    colour: str = BLUE
    width: float = 1.3


@dataclass(frozen=True)
class Limit:
    """A limit drawn across a strip.

    Attributes:
        label: What limits.
        value: [unit of the strip]; None: unknown, not drawn.
        both_signs: Drawn at minus the value as well.
    """

    label: str
    value: float | None
    both_signs: bool = True


def motion_strips(joint: JointResult, cycle: Cycle, *, prismatic: bool = False, name: str = "motion") -> str:
    """Position, speed, gear torque and the parts of motor torque of one joint over the cycle.

    Args:
        joint: Its result.
        cycle: For the names of the segments.
        prismatic: Position is in metres.
        name: Of the figure on the page.

    Returns:
        An SVG element.
    """
    series, gear = joint.series, joint.drive.gear
    share = series.motor_torque - series.rotor_torque - series.friction_torque
    with house_style(name):
        figure, rows = _rows(4)
        _strip(rows[0], series.time, "position", "m" if prismatic else "rad", (Curve("position", series.position),))
        _strip(rows[1], series.time, "output speed", "rad/s", (Curve("output speed", series.speed),))
        limits = (
            Limit("repeated peak", gear.repeated_peak_torque),
            Limit("momentary", gear.momentary_torque),
        )
        _strip(rows[2], series.time, "gear torque", "N m", (Curve("gear torque", series.gear_torque),), limits)
        parts = (
            Curve("load through the gear", share, SKY),
            Curve("own rotor", series.rotor_torque, PURPLE),
            Curve("friction and mesh loss", series.friction_torque, ORANGE),
            Curve("motor torque", series.motor_torque, INK, 1.5),
        )
        _strip(rows[3], series.time, "motor torque", "N m", parts)
        _finish(figure, rows, cycle, joint)
        return svg_text(figure, f"{joint.name}: position, speed, gear torque and motor torque over time")


def electrical_strips(joint: JointResult, cycle: Cycle, *, limits: ElectricalLimits, name: str = "electrical") -> str:
    """Current, voltage, electrical power and temperatures of one joint over the cycle, with their limits.

    Args:
        joint: Its result.
        cycle: For the names of the segments.
        limits: Of amplifier and supply.
        name: Of the figure on the page.

    Returns:
        An SVG element.
    """
    series, motor = joint.series, joint.drive.motor
    with house_style(name):
        figure, rows = _rows(4)
        currents = (Limit("motor peak", motor.peak_current), Limit("amplifier peak", limits.amplifier_peak))
        _strip(rows[0], series.time, "current", "A", (Curve("current", series.current),), currents)
        voltage = (Limit("available", limits.voltage),)
        _strip(rows[1], series.time, "terminal voltage", "V", (Curve("voltage", series.voltage, GREEN),), voltage)
        power = (
            Curve("electrical", series.electrical_power, VERMILLION),
            Curve("mechanical, at the output", series.gear_torque * series.speed, MUTED, 1.0),
        )
        _strip(rows[2], series.time, "power", "W", power)
        _temperatures(rows[3], joint)
        _finish(figure, rows, cycle, joint)
        return svg_text(figure, f"{joint.name}: current, voltage, power and temperature over time")


@dataclass(frozen=True)
class ElectricalLimits:
    """What amplifier and supply allow one joint.

    Attributes:
        amplifier_peak: [A]; None when unknown.
        voltage: Largest at the motor's terminals [V].
    """

    amplifier_peak: float | None
    voltage: float


def _rows(count: int) -> tuple[Figure, list[Axes]]:
    """A tall figure of strips that share the time axis."""
    figure = Figure(figsize=(6.3, 1.5 * count + 0.35))
    rows = figure.subplots(count, 1, sharex=True)
    return figure, list(rows)


def _temperatures(axes: Axes, joint: JointResult) -> None:
    """The strip of winding and housing temperature, or why there is none."""
    series, limit = joint.series, joint.drive.motor.max_winding_temperature
    if series.winding_temperature is None:
        axes.set_ylabel("temperature [°C]")
        axes.set_yticks([])
        axes.text(0.5, 0.5, no_temperature(joint), transform=axes.transAxes, ha="center", va="center", color=MUTED)
        return
    curves = [Curve("winding", series.winding_temperature, VERMILLION)]
    if series.housing_temperature is not None:
        curves.append(Curve("housing", series.housing_temperature, MUTED))
    _strip(axes, series.time, "temperature", "C", tuple(curves), (Limit("winding limit", limit, both_signs=False),))
    low, high = axes.get_ylim()
    spare = max(0.0, SMALLEST_SPAN - (high - low)) / 2
    axes.set_ylim(low - spare, high + spare)


def _strip(
    axes: Axes, time: Array, title: str, unit: str, curves: tuple[Curve, ...], limits: tuple[Limit, ...] = ()
) -> None:
    """One strip: curves, the limits near them as lines, those far away in words."""
    stacked = np.concatenate([curve.values for curve in curves])
    largest = float(np.max(np.abs(stacked), initial=0.0))
    near = [limit for limit in limits if limit.value is not None and limit.value <= FAR * largest]
    _, shown = scaled(stacked, unit, *(limit.value for limit in near))
    for curve in curves:
        values = convert(curve.values, unit, shown)
        kept = thinned(values)
        axes.plot(time[kept], values[kept], color=curve.colour, linewidth=curve.width, label=curve.label)
    for limit in near:
        _draw_limit(axes, limit, float(convert(limit.value, unit, shown)))
    axes.set_ylabel(f"{title} [{printed_unit(shown)}]")
    low, high = axes.get_ylim()
    if low < 0 < high:
        axes.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
    far = [limit for limit in limits if limit.value is not None and limit not in near]
    notes = [f"{limit.label} {with_unit(limit.value, unit, shown=shown_unit(limit.value, unit))}" for limit in far]
    if notes:
        text = "far above: " + ", ".join(notes)
        axes.set_ylim(low, high + 0.2 * (high - low))
        axes.text(0.995, 0.97, text, transform=axes.transAxes, ha="right", va="top", fontsize=7, color=MUTED)
    if len(curves) > 1:
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 0.98), ncols=len(curves), handlelength=1.4, borderpad=0.1)


def _draw_limit(axes: Axes, limit: Limit, value: float) -> None:
    """A dashed line at the limit, labelled at its right end."""
    for level in (value, -value) if limit.both_signs and axes.get_ylim()[0] < 0 else (value,):
        axes.axhline(level, color=VERMILLION, linewidth=0.9, linestyle=(0, (5, 2)))
    axes.annotate(
        limit.label, (1.0, value), xycoords=("axes fraction", "data"), xytext=(-2, -2),
        textcoords="offset points", ha="right", va="top", fontsize=7, color=VERMILLION,
    )  # fmt: skip


def _finish(figure: Figure, rows: list[Axes], cycle: Cycle, joint: JointResult) -> None:
    """Segments behind the strips, the binding instant through them, the time axis below."""
    for axes in rows:
        axes.margins(x=0.0)
    _segments(rows, cycle)
    binding = joint.binding
    if binding is not None and binding.time is not None:
        for axes in rows:
            axes.axvline(binding.time, color=INK, linewidth=0.8, linestyle=":", zorder=1)
        rows[0].annotate(
            f"{nearness(binding)}: {binding.name}", (binding.time, 1.0), xycoords=("data", "axes fraction"),
            xytext=(0, 14), textcoords="offset points", ha=_side(binding.time, cycle), fontsize=7, color=INK,
        )  # fmt: skip
    rows[-1].set_xlabel("time in the cycle [s]")
    figure.align_ylabels(rows)


def _side(time: float, cycle: Cycle) -> str:
    """How a label at an instant is aligned so that it stays inside the picture."""
    share = (time - cycle.time[0]) / max(cycle.duration, 1e-12)
    return "left" if share < 0.25 else "right" if share > 0.75 else "center"


def _segments(rows: list[Axes], cycle: Cycle) -> None:
    """Every second segment shaded; its name above the first strip where there is room."""
    starts = [0, *(np.flatnonzero(np.diff(cycle.segment)) + 1).tolist(), len(cycle.time)]
    if len(starts) < 3:
        return
    for i, (first, after) in enumerate(pairwise(starts)):
        low, high = float(cycle.time[first]), float(cycle.time[min(after, len(cycle.time) - 1)])
        for axes in rows if i % 2 else ():
            axes.axvspan(low, high, color=FAINT, alpha=0.45, linewidth=0, zorder=0)
        text = cycle.segment_names[int(cycle.segment[first])]
        room = (high - low) / cycle.duration * 85  # about 85 characters fit across
        if len(text) < room:
            rows[0].annotate(
                text, ((low + high) / 2, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3),
                textcoords="offset points", ha="center", fontsize=7, color=MUTED,
            )  # fmt: skip
