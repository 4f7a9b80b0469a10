"""Strips over time for one joint: what it does, and what that costs in current, voltage, power and heat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetrain.arrays import Array
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.report.colours import BLUE, FAINT, GREEN, INK, MUTED, ORANGE, PURPLE, SKY, VERMILLION
from drivetrain.report.panel import Panel, panel
from drivetrain.report.picture import NOTE, Font, Key, Pen, Picture
from drivetrain.report.quantities import convert, percent, printed_unit, scaled, shown_unit, with_unit
from drivetrain.report.scales import padded, text_width
from drivetrain.report.thinning import thinned
from drivetrain.report.words import nearness, no_temperature
from drivetrain.sizing.results import JointResult

FAR = 4.0  # a limit further than this many times the curve is told in words, so that the curve stays readable
SMALLEST_SPAN = 10.0  # kelvin; a steady temperature is not blown up into a drama
WIDTH, ROW, GAP = 454.0, 84.0, 21.0  # [points] of the picture, of a strip, between two
TOP, LEFT, RIGHT, BELOW = 30.0, 52.0, 450.0, 32.0
TITLES_AT = 11.0  # [points from the left]
LIMIT_PEN = Pen(VERMILLION, 0.9, (5, 2))
BINDING_PEN = Pen(INK, 0.8, (1, 1.7))


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


@dataclass(frozen=True)
class Strip:
    """One row of the picture.

    Attributes:
        title: What is drawn.
        unit: Of curves and limits, SI.
        curves: Lines.
        limits: Drawn across where near, told in words where far away.
        span: Smallest height of the scale [unit shown].
        instead: Told where there are no curves.
    """

    title: str
    unit: str
    curves: tuple[Curve, ...]
    limits: tuple[Limit, ...] = ()
    span: float = 0.0
    instead: str = ""


@dataclass(frozen=True)
class ElectricalLimits:
    """What amplifier and supply allow one joint.

    Attributes:
        amplifier_peak: [A]; None when unknown.
        voltage: Largest at the motor's terminals [V].
    """

    amplifier_peak: float | None
    voltage: float


def motion_strips(joint: JointResult, cycle: Cycle, *, prismatic: bool = False, name: str = "motion") -> str:
    """Position, speed, gear torque and the parts of motor torque of one joint over the cycle."""
    series, gear = joint.series, joint.drive.gear
    share = series.motor_torque - series.rotor_torque - series.friction_torque
    limits = (Limit("repeated peak", gear.repeated_peak_torque), Limit("momentary", gear.momentary_torque))
    parts = (
        Curve("load through the gear", share, SKY),
        Curve("own rotor", series.rotor_torque, PURPLE),
        Curve("friction and mesh loss", series.friction_torque, ORANGE),
        Curve("motor torque", series.motor_torque, INK, 1.5),
    )
    strips = (
        Strip("position", "m" if prismatic else "rad", (Curve("position", series.position),)),
        Strip("output speed", "rad/s", (Curve("output speed", series.speed),)),
        Strip("gear torque", "N m", (Curve("gear torque", series.gear_torque),), limits),
        Strip("motor torque", "N m", parts),
    )
    return _drawn(strips, joint, cycle, name, "position, speed, gear torque and motor torque over time")


def electrical_strips(joint: JointResult, cycle: Cycle, *, limits: ElectricalLimits, name: str = "electrical") -> str:
    """Current, voltage, electrical power and temperatures of one joint over the cycle, with their limits."""
    series, motor = joint.series, joint.drive.motor
    currents = (Limit("motor peak", motor.peak_current), Limit("amplifier peak", limits.amplifier_peak))
    power = (
        Curve("electrical", series.electrical_power, VERMILLION),
        Curve("mechanical, at the output", series.gear_torque * series.speed, MUTED, 1.0),
    )
    voltage = (Curve("voltage", series.voltage, GREEN),)
    strips = (
        Strip("current", "A", (Curve("current", series.current),), currents),
        Strip("terminal voltage", "V", voltage, (Limit("available", limits.voltage),)),
        Strip("power", "W", power),
        _temperatures(joint),
    )
    return _drawn(strips, joint, cycle, name, "current, voltage, power and temperature over time")


def _temperatures(joint: JointResult) -> Strip:
    """The strip of winding and housing temperature, or why there is none."""
    series, limit = joint.series, joint.drive.motor.max_winding_temperature
    if series.winding_temperature is None:
        return Strip("temperature", "C", (), instead=no_temperature(joint))
    curves = [Curve("winding", series.winding_temperature, VERMILLION)]
    if series.housing_temperature is not None:
        curves.append(Curve("housing", series.housing_temperature, MUTED))
    told = (Limit("winding limit", limit, both_signs=False),)
    return Strip("temperature", "C", tuple(curves), told, SMALLEST_SPAN)


def _drawn(strips: Sequence[Strip], joint: JointResult, cycle: Cycle, name: str, shown: str) -> str:
    """All strips below each other, the segments of the cycle behind them, the binding instant through them."""
    picture = Picture(name, WIDTH, TOP + len(strips) * (ROW + GAP) - GAP + BELOW)
    for number, strip in enumerate(strips):
        row = _strip(picture, strip, joint, cycle, TOP + number * (ROW + GAP))
        row.x_axis(_clock(cycle) if number == len(strips) - 1 else "", texts=number == len(strips) - 1)
        if number == 0:
            _headings(row, joint, cycle)
    return picture.svg(f"{joint.name}: {shown}")


def _strip(picture: Picture, strip: Strip, joint: JointResult, cycle: Cycle, top: float) -> Panel:
    """One strip: curves, the limits near them as lines, those far away in words."""
    time = joint.series.time
    stacked = np.concatenate([curve.values for curve in strip.curves]) if strip.curves else np.zeros(1)
    largest = float(np.max(np.abs(stacked), initial=0.0))
    near = [limit for limit in strip.limits if limit.value is not None and limit.value <= FAR * largest]
    far = [limit for limit in strip.limits if limit.value is not None and limit not in near]
    values, shown = scaled(stacked, strip.unit, *(limit.value for limit in near))
    levels = _levels(near, strip.unit, shown, bool(values.min() < 0.0))
    ends = _ends(np.append(values, [level for level, _ in levels]), strip.span, bool(far))
    row = panel(picture, (LEFT, RIGHT), (top, top + ROW), (float(time[0]), float(time[-1])), ends)
    row.grid(across=not strip.instead)
    for first, last in _shaded(cycle):
        row.block((first, last), None, FAINT, 0.45)
    if joint.binding is not None and joint.binding.time is not None:
        row.upright(joint.binding.time, BINDING_PEN)
    if ends[0] < 0.0 < ends[1] and not strip.instead:
        row.level(0.0, Pen(MUTED, 0.5))
    for curve in strip.curves:
        converted = convert(curve.values, strip.unit, shown)
        for part in _runs(cycle, len(time)):  # no line from one part of a mix to the next
            kept = part.start + thinned(converted[part])
            row.curve(time[kept], converted[kept], Pen(curve.colour, curve.width))
    _limits(row, strip, levels, far)
    row.edges()
    _titles(row, strip, shown)
    return row


def _levels(near: Sequence[Limit], unit: str, shown: str, negative: bool) -> list[tuple[float, str]]:
    """Where limits are drawn, in the unit shown; the name stands at the positive one."""
    found: list[tuple[float, str]] = []
    for limit in near:
        value = float(convert(limit.value, unit, shown))
        found.append((value, limit.label))
        if limit.both_signs and negative:
            found.append((-value, ""))
    return found


def _ends(values: Array, span: float, told: bool) -> tuple[float, float]:
    """Ends of the scale: room for words at the top where some are told."""
    low, high = padded(values)
    spare = max(0.0, span - (high - low)) / 2
    low, high = low - spare, high + spare
    return low, high + (0.2 * (high - low) if told else 0.0)


def _limits(row: Panel, strip: Strip, levels: Sequence[tuple[float, str]], far: Sequence[Limit]) -> None:
    """Dashed lines with their names at the right end; limits far away in words."""
    name = Font(7.5, VERMILLION, "end", "top")
    for value, label in levels:
        row.level(value, LIMIT_PEN)
        if label:
            row.words(row.x.high, value, label, name, (-2.0, 2.0))
    if far:
        each = [(limit.label, limit.value or 0.0) for limit in far]
        told = [f"{label} {with_unit(value, strip.unit, shown=shown_unit(value, strip.unit))}" for label, value in each]
        text = "far above: " + ", ".join(told)
        row.words(row.x.high, row.y.high, text, Font(7.5, MUTED, "end", "top"), (-2.0, 2.5))


def _titles(row: Panel, strip: Strip, shown: str) -> None:
    """What the strip shows at its left, the names of several curves above it."""
    title = f"{strip.title} [{printed_unit(shown)}]"
    if strip.instead:
        middle = 0.5 * (row.y.low + row.y.high)
        row.words(0.5 * (row.x.low + row.x.high), middle, strip.instead, Font(8.0, MUTED, "middle", "middle"))
        row.words(row.x.low, middle, title, Font(anchor="middle", turned=True), (TITLES_AT - LEFT, 0.0))
        return
    row.y_axis(title, at=TITLES_AT)
    if len(strip.curves) > 1:
        keys = [Key(curve.label, pen=Pen(curve.colour, curve.width)) for curve in strip.curves]
        row.picture.legend(keys, row.y.end - 7.0, across=(LEFT, RIGHT))


def _headings(row: Panel, joint: JointResult, cycle: Cycle) -> None:
    """Above the first strip: the names of the segments where there is room, and what binds at the dotted line."""
    for first, last, text in _segments(cycle):
        room = float(row.x.at(last) - row.x.at(first))
        if text_width(text, 7.5) < room:
            middle = 0.5 * (first + last)
            row.words(middle, row.y.high, text, Font(7.5, MUTED, "middle"), (0.0, -4.0))
    binding = joint.binding
    if binding is not None and binding.time is not None:
        text = f"{nearness(binding)}: {binding.name}"
        half = 0.5 * text_width(text, NOTE.size)
        place = min(max(float(row.x.at(binding.time)), LEFT + half), RIGHT - half)
        row.picture.words(place, TOP - 14.0, text, replace(NOTE, colour=INK, anchor="middle"))


def _runs(cycle: Cycle, samples: int) -> tuple[slice, ...]:
    """Samples that are joined by a line."""
    return (slice(0, samples),) if len(cycle.parts) == 1 else cycle.parts


def _clock(cycle: Cycle) -> str:
    """What the time axis counts."""
    return "time in the cycle [s]" if len(cycle.parts) == 1 else "time, one period of each part after another [s]"


def _segments(cycle: Cycle) -> list[tuple[float, float, str]]:
    """Begin, end [s] and name of every segment, of a mix of every part; none when there is only one."""
    if len(cycle.parts) > 1:
        return [
            (float(cycle.time[part.start]), float(cycle.time[part.stop - 1]), f"{name}, {percent(share)} of the time")
            for part, name, share in zip(cycle.parts, cycle.part_names, cycle.shares, strict=True)
        ]
    starts = [0, *(np.flatnonzero(np.diff(cycle.segment)) + 1).tolist(), len(cycle.time)]
    if len(starts) < 3:
        return []
    ends = [(float(cycle.time[a]), float(cycle.time[min(b, len(cycle.time) - 1)])) for a, b in pairwise(starts)]
    names = [cycle.segment_names[int(cycle.segment[first])] for first in starts[:-1]]
    return [(low, high, name) for (low, high), name in zip(ends, names, strict=True)]


def _shaded(cycle: Cycle) -> list[tuple[float, float]]:
    """Every second segment."""
    return [(first, last) for first, last, _ in _segments(cycle)[1::2]]
