"""The motor's plane of one joint: speed and torque in four quadrants, what the motor may do and what the task asks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.motor_limits import continuous_current, continuous_region, operating_region
from drivetrain.motion.duty_cycle import Cycle, sample_weights
from drivetrain.report.colours import BLUE, GREEN, INK, MUTED, VERMILLION
from drivetrain.report.panel import X_SPACING, Y_SPACING, Panel, cloud, panel, time_bar
from drivetrain.report.picture import LABEL, TICK, Font, Key, Pen, Picture, legend_height, tenths
from drivetrain.report.quantities import convert, number, percent, printed_unit, shown_unit
from drivetrain.report.scales import Scale, text_width, tick_texts
from drivetrain.sizing.results import JointResult
from drivetrain.study.model import JointTask, Study
from drivetrain.study.verdicts import Check

WIDTH, HEIGHT = 446.0, 404.0  # [points] of the picture
LEFT, RIGHT, LOW = 52.0, 388.0, 332.0  # [points] of the plane in it
COLD = (4.0, 2.0)  # dashes of an outline
FAR = 4.0  # the view ends at this many times the motion's largest value; the region may go on beyond


@dataclass(frozen=True, eq=False)
class Regions:
    """What the motor may do, as corners (speed [rad/s], torque [N m]), each (M, 2).

    Attributes:
        cold, hot: Temperatures of the winding [C].
        intermittent_cold, intermittent_hot: Open for a short time.
        continuous_cold, continuous_hot: Open for ever; None when the sheet does not say enough.
    """

    cold: float
    hot: float
    intermittent_cold: Array
    intermittent_hot: Array
    continuous_cold: Array | None
    continuous_hot: Array | None


def motor_regions(joint: JointResult, task: JointTask, study: Study) -> Regions:
    """The motor's regions at ambient, and with the winding as hot as the task makes it."""
    motor, supply, cold = joint.drive.motor, study.supply.voltage, study.ambient
    winding, housing = joint.series.winding_temperature, joint.series.housing_temperature
    hot = float(winding.max()) if winding is not None else motor.max_winding_temperature
    hot = cold if hot is None else hot
    magnet = float(housing.mean()) if housing is not None else hot
    lasting = continuous_current(motor, study.ambient, housing_to_ambient=task.housing_to_ambient).value

    def forever(temperature: float, magnets: float) -> Array | None:
        if lasting is None:
            return None
        return continuous_region(motor, task.amplifier, supply, lasting, temperature, magnets)

    return Regions(
        cold,
        hot,
        operating_region(motor, task.amplifier, supply, cold, cold),
        operating_region(motor, task.amplifier, supply, hot, magnet),
        forever(cold, cold),
        forever(hot, magnet),
    )


def motor_plane(joint: JointResult, task: JointTask, study: Study, *, name: str = "motor") -> str:
    """Motor torque against motor speed in four quadrants, with the gear's side on the second axes."""
    series, regions, picture = joint.series, motor_regions(joint, task, study), Picture(name, WIDTH, HEIGHT)
    half_width, half_height = view(joint, regions)
    unit = shown_unit(half_height, "N m")
    right, top = float(convert(half_width, "rad/s", "rpm")), float(convert(half_height, "N m", unit))
    rms = _rms_point(joint, study.cycle, unit)
    keys = _keys(regions, rms)
    high = 6.0 + legend_height(keys, WIDTH, 2) + (4.0 if joint.drive.gear.kind == "ideal" else 36.0)
    plane = panel(picture, (LEFT, RIGHT), (high, LOW), (-right, right), (-top, top))
    plane.grid()
    for corners, colour, opacity in outlines(regions):
        speed, torque = convert(corners[:, 0], "rad/s", "rpm"), convert(corners[:, 1], "N m", unit)
        cold = opacity is None
        plane.shape(speed, torque, Pen(colour, 1.0, COLD if cold else ()), "none" if cold else colour, opacity or 1.0)
    plane.level(0.0, Pen(MUTED, 0.7))
    plane.upright(0.0, Pen(MUTED, 0.7))
    speed, torque = convert(series.motor_speed, "rad/s", "rpm"), convert(series.motor_torque, "N m", unit)
    cloud(plane, speed, torque, series.time, parts=study.cycle.parts)
    plane.edges()
    plane.x_axis("motor speed [rpm]")
    plane.y_axis(f"motor torque [{printed_unit(unit)}]")
    _gear_side(plane, joint.drive.gear.ratio, joint.drive.gear.kind == "ideal", unit)
    _worst_point(plane, joint, unit)
    if rms is not None:
        plane.mark("diamond", rms[0], rms[1], 9.0, Key("", pen=Pen("#fff", 1.2), fill=INK))
    picture.legend(keys, 8.0, across=(LEFT, WIDTH), columns=2)
    time_bar(picture, (LEFT, RIGHT), LOW + 34.0, series.time)
    return picture.svg(f"{joint.name}: torque against speed of motor {joint.motor} in four quadrants")


def outlines(regions: Regions) -> list[tuple[Array, str, float | None]]:
    """The regions in the order in which they are drawn.

    Returns:
        Corners (speed [rad/s], torque [N m]), colour, and opacity of the fill: None for a dashed outline.
    """
    found: list[tuple[Array, str, float | None]] = [
        (regions.intermittent_hot, BLUE, 0.12),
        (regions.intermittent_cold, BLUE, None),
    ]
    if regions.continuous_hot is not None and regions.continuous_cold is not None:
        found += [(regions.continuous_hot, GREEN, 0.24), (regions.continuous_cold, GREEN, None)]
    return found


def _keys(regions: Regions, rms: tuple[float, float, str] | None) -> list[Key]:
    """The legend: each region hot and cold, side by side."""
    keys = []
    for number_, (_, colour, opacity) in enumerate(outlines(regions)):
        kind = "intermittent" if number_ < 2 else "continuous"
        warm = regions.cold if opacity is None else regions.hot
        pen = Pen(colour, 1.0, COLD if opacity is None else ())
        text = f"{kind}, winding at {warm:.0f} °C"
        keys.append(Key(text, "box", pen, "" if opacity is None else colour, opacity or 1.0))
    if rms is not None:
        keys.append(Key(rms[2], "diamond", Pen("none"), INK))
    return keys


def view(joint: JointResult, regions: Regions) -> tuple[float, float]:
    """Half width and half height of the picture: the motion, and the region unless far larger.

    Returns:
        [rad/s] and [N m].
    """
    series, corners = joint.series, regions.intermittent_hot
    speed, torque = float(np.abs(series.motor_speed).max()), float(np.abs(series.motor_torque).max())
    reach = _speed_without_torque(corners)
    height = float(np.abs(corners[:, 1]).max())
    right = max(1.15 * speed, min(1.12 * reach, FAR * speed if speed else np.inf))
    top = max(1.2 * torque, min(1.12 * height, FAR * torque if torque else np.inf))
    return right, top


def _speed_without_torque(corners: Array) -> float:
    """Where the region's edge crosses zero torque [rad/s]; the braking corners lie far beyond and tell little."""
    (x0, y0), (x1, y1) = corners[:-1].T, corners[1:].T
    crossing = (y0 * y1 <= 0) & (y0 != y1)
    at = x0[crossing] - y0[crossing] * (x1[crossing] - x0[crossing]) / (y1[crossing] - y0[crossing])
    return float(np.abs(at).max(initial=0.0)) or float(np.abs(corners[:, 0]).max())


def worst_instant(joint: JointResult) -> Check | None:
    """The check closest to its limit among those that happen at one instant (temperatures lag behind, so not they).

    Returns:
        The check; None when none was judged at an instant.
    """
    judged = [
        check
        for check in joint.checks
        if check.utilisation is not None and check.time is not None and check.unit not in ("C", "degC")
    ]
    return max(judged, key=lambda check: check.utilisation or 0.0, default=None)


def _worst_point(plane: Panel, joint: JointResult, unit: str) -> None:
    """The labelled sample at which a limit is closest."""
    check = worst_instant(joint)
    if check is None or check.time is None:
        return
    i = int(np.argmin(np.abs(joint.series.time - check.time)))
    x = float(convert(joint.series.motor_speed[i], "rad/s", "rpm"))
    y = float(convert(joint.series.motor_torque[i], "N m", unit))
    factor = "" if check.factor == 1.0 else f", with the factor {check.factor:g}"
    lines = (
        f"{check.name}: {percent(check.utilisation)}{factor}",
        f"t = {number(check.time)} s: {number(y)} {printed_unit(unit)} at {number(x)} rpm",
    )
    across, up = _free_corner(x / plane.x.high, y / plane.y.high)
    width, height = max(text_width(line, 7.9) for line in lines) + 8.0, 25.0
    left = plane.x.end - 5.0 - width if across else plane.x.start + 5.0
    top = plane.y.end + 5.0 if up else plane.y.start - 5.0 - height
    at_x, at_y = float(plane.x.at(x)), float(plane.y.at(y))
    picture, pen = plane.picture, Pen(VERMILLION, 0.7)
    near_x, near_y = min(max(at_x, left), left + width), top + (height if up else 0.0)
    reach = max(float(np.hypot(at_x - near_x, at_y - near_y)), 1e-9)
    stop = max(0.0, 1.0 - 4.5 / reach)  # at the ring, not in it
    plane.picture.path(_line(near_x, near_y, near_x + stop * (at_x - near_x), near_y + stop * (at_y - near_y)), pen)
    plane.mark("ring", x, y, 8.5, Key("", pen=Pen(VERMILLION, 1.8)))
    picture.path(_frame(left, top, width, height), pen, fill="#fff")
    for row, line in enumerate(lines):
        picture.words(left + 4.0, top + 8.0 + 10.0 * row, line, Font(7.9, INK, level="middle"))


def _line(x0: float, y0: float, x1: float, y1: float) -> str:
    return f"M{tenths(x0)} {tenths(y0)}L{tenths(x1)} {tenths(y1)}"


def _frame(left: float, top: float, width: float, height: float) -> str:
    return f"M{tenths(left)} {tenths(top)}h{tenths(width)}v{tenths(height)}h{tenths(-width)}z"


def _free_corner(x: float, y: float) -> tuple[int, int]:
    """The corner (0 or 1 across, 0 or 1 up) for the label of a point at shares x, y of the half axes.

    It is the point's own, unless the label would lie on the point: then the other one at the same height.
    """
    across, up = int(x >= 0.0), int(y >= 0.0)
    covered = abs(y) > 0.72 and abs(x) > 0.1
    return (1 - across if covered else across), up


def _rms_point(joint: JointResult, cycle: Cycle, unit: str) -> tuple[float, float, str] | None:
    """Mean speed [rpm] and RMS torque over the cycle, both as magnitudes, and what to call them."""
    series = joint.series
    weights = sample_weights(series.time) if len(cycle.parts) == 1 else cycle.weights
    duration = float(weights.sum())
    if duration <= 0.0:
        return None
    rms = float(np.sqrt(weights @ series.motor_torque**2 / duration))
    mean = float(weights @ np.abs(series.motor_speed) / duration)
    x, y = float(convert(mean, "rad/s", "rpm")), float(convert(rms, "N m", unit))
    return x, y, f"RMS {number(y)} {printed_unit(unit)} at mean {number(x)} rpm"


def _gear_side(plane: Panel, ratio: float, direct: bool, unit: str) -> None:
    """Second axes: the same torque and speed seen at the gear's output, without losses."""
    if direct:
        return
    largest = plane.y.high * abs(ratio) * float(1.0 / convert(1.0, "N m", unit))
    side = shown_unit(largest, "N m")
    factor = ratio * float(convert(1.0, "N m", side)) / float(convert(1.0, "N m", unit))
    speeds = replace(plane.x, low=plane.x.low / ratio, high=plane.x.high / ratio)
    torques = replace(plane.y, low=plane.y.low * factor, high=plane.y.high * factor)
    picture, top, right = plane.picture, plane.y.end, plane.x.end
    pen, small = Pen(MUTED, 0.7), replace(TICK, anchor="middle")
    picture.path(f"M{tenths(plane.x.start)} {tenths(top)}H{tenths(right)}V{tenths(plane.y.start)}", pen)
    for _, text, at in _ticks(speeds, X_SPACING):
        picture.path(f"M{tenths(at)} {tenths(top)}v-30", pen)
        picture.words(at, top - 5.5, text, small)
    for _, text, at in _ticks(torques, Y_SPACING):
        picture.path(f"M{tenths(right)} {tenths(at)}h30", pen)
        picture.words(right + 5.0, at, text, replace(TICK, level="middle"))
    grey = replace(LABEL, colour=MUTED)
    picture.words(0.5 * (LEFT + RIGHT), top - 18.0, "gear output speed [rpm]", grey)
    label = f"torque at the gear output, no losses [{printed_unit(side)}]"
    picture.words(WIDTH - 8.0, 0.5 * (top + plane.y.start), label, replace(grey, turned=True))


def _ticks(scale: Scale, spacing: float) -> list[tuple[float, str, float]]:
    """Value, text and place of every tick; the scale may run backwards (a gear that turns the other way)."""
    rising = scale if scale.low <= scale.high else Scale(scale.high, scale.low, scale.end, scale.start)
    values = rising.ticks(spacing)
    places = [float(place) for place in rising.at(np.array(values))]
    return list(zip(values, tick_texts(values), places, strict=True))
