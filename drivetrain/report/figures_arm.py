"""Pictures of all joints together: power at the supply, temperatures side by side."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.report.colours import BLUE, GREEN, INK, MUTED, ORANGE, VERMILLION
from drivetrain.report.panel import Panel, panel
from drivetrain.report.picture import TICK, Font, Key, Pen, Picture
from drivetrain.report.quantities import convert, printed_unit, scaled, with_unit
from drivetrain.report.scales import padded, text_width
from drivetrain.report.thinning import thinned
from drivetrain.report.words import no_temperature
from drivetrain.sizing.results import Evaluation, JointResult

WIDTH = 662.0  # [points]
BAR = 26.0  # [points] from one joint to the next
LIMIT_PEN = Pen(VERMILLION, 1.0, (4, 2))
AMBIENT_PEN = Pen(MUTED, 1.0, (1, 1.7))
_LIMIT = Key("winding limit", "bar", Pen("none"), VERMILLION)


def supply_power(evaluation: Evaluation, *, name: str = "supply") -> str:
    """Power of all joints together over the cycle: drawn, and given back."""
    if not evaluation.joints:
        return ""
    joints, supply = list(evaluation.joints.values()), evaluation.study.supply
    time = joints[0].series.time
    total = np.sum([joint.series.electrical_power for joint in joints], axis=0)
    near = supply.peak_power if supply.peak_power is not None and supply.peak_power < 4 * total.max() else None
    power, unit = scaled(total, "W", near)
    limit = None if near is None else float(convert(near, "W", unit))
    picture = Picture(name, WIDTH, 214.0)
    ends = padded(np.append(power, [0.0] if limit is None else [0.0, limit]))
    strip = panel(picture, (52.0, WIDTH - 4.0), (20.0, 182.0), (float(time[0]), float(time[-1])), ends)
    strip.grid()
    runs = [part.start + thinned(power[part], 600) for part in evaluation.study.cycle.parts]
    for kept in runs:
        _area(strip, time[kept], np.maximum(power[kept], 0.0), BLUE, 0.25)
    for kept in runs:
        _area(strip, time[kept], np.minimum(power[kept], 0.0), GREEN, 0.35)
    strip.level(0.0, Pen(MUTED, 0.6))
    for kept in runs:
        strip.curve(time[kept], power[kept], Pen(INK, 1.1))
    plain = Pen("none")
    keys = [Key("drawn", "box", plain, BLUE, 0.25), Key("given back", "box", plain, GREEN, 0.35)]
    if limit is not None:
        strip.level(limit, LIMIT_PEN)
        keys.append(Key(f"peak limit {with_unit(near, 'W')}", pen=LIMIT_PEN))
    elif supply.peak_power is not None:
        keys.append(Key(f"peak limit {with_unit(supply.peak_power, 'W')}, far above", ""))
    strip.edges()
    strip.x_axis("time in the cycle [s]")
    strip.y_axis(f"power of all joints [{printed_unit(unit)}]")
    picture.legend(keys, 9.0, across=(52.0, WIDTH))
    return picture.svg("electrical power of all joints together over time")


def _area(strip: Panel, time: Array, power: Array, colour: str, opacity: float) -> None:
    """The area between a curve and zero."""
    xs, ys = np.concatenate([[time[0]], time, [time[-1]]]), np.concatenate([[0.0], power, [0.0]])
    strip.shape(xs, ys, None, colour, opacity)


def temperatures(evaluation: Evaluation, *, name: str = "temperatures") -> str:
    """Winding and housing of every joint in the periodic steady state, against the winding's limit."""
    joints = list(evaluation.joints.values())
    if all(joint.series.winding_temperature is None for joint in joints):
        return ""
    ambient = evaluation.study.ambient
    left = 14.0 + max(text_width(joint.name, TICK.size) for joint in joints)
    low = 26.0 + BAR * len(joints)
    picture = Picture(name, WIDTH, low + 32.0)
    ends = _warmest_and_coldest(joints, ambient)
    rows = panel(picture, (left, WIDTH - 4.0), (22.0, low), ends, (len(joints) - 0.45, -0.55))
    rows.grid(across=False)
    rows.upright(ambient, AMBIENT_PEN)
    for row, joint in enumerate(joints):
        rows.words(rows.x.low, row, joint.name, Font(TICK.size, INK, "end", "middle"), (-6.0, 0.0))
        _thermometer(rows, row, joint, ambient)
    rows.edges()
    rows.x_axis("temperature in the periodic steady state [°C]")
    keys = [
        Key("housing", pen=Pen(BLUE, 5.0)), Key("winding, up to its highest", pen=Pen(ORANGE, 5.0)), _LIMIT,
        Key("ambient", pen=AMBIENT_PEN),
    ]  # fmt: skip
    picture.legend(keys, 9.0, across=(left, WIDTH))
    return picture.svg("winding and housing temperature of every joint against the limit")


def _warmest_and_coldest(joints: list[JointResult], ambient: float) -> tuple[float, float]:
    """Ends of the scale: everything that is drawn, and room for the numbers."""
    shown = [ambient]
    for joint in joints:
        if joint.series.winding_temperature is not None:
            shown.append(float(joint.series.winding_temperature.max()))
            limit = joint.drive.motor.max_winding_temperature
            shown += [] if limit is None else [limit]
    low, high = min(ambient - 5.0, *shown), max(shown)
    return low, high + 0.08 * max(high - low, 1.0)


def _thermometer(rows: Panel, row: int, joint: JointResult, ambient: float) -> None:
    """One joint's bar from ambient to its hottest winding, with the limit as a tick."""
    series, limit = joint.series, joint.drive.motor.max_winding_temperature
    note = Font(7.9, MUTED, level="middle")
    if series.winding_temperature is None:
        rows.words(ambient, row, no_temperature(joint), note, (4.0, 0.0))
        return
    hottest = float(series.winding_temperature.max())
    rows.block((ambient, hottest), (row - 0.21, row + 0.21), ORANGE, 0.85)
    if series.housing_temperature is not None:
        rows.block((ambient, float(series.housing_temperature.max())), (row - 0.1, row + 0.1), BLUE)
    rows.words(hottest, row, f"{hottest:.0f} °C", Font(7.9, INK, level="middle"), (4.0, 0.0))
    if limit is not None:
        rows.mark("bar", limit, row, 14.0, _LIMIT)
