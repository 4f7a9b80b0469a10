"""The motor's plane of one joint: speed and torque in four quadrants, what the motor may do and what the task asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from drivetrain.arrays import Array
from drivetrain.drive.motor_limits import continuous_current, continuous_region, operating_region
from drivetrain.report.quantities import convert, number, percent, printed_unit, shown_unit
from drivetrain.report.svg import BLUE, GREEN, INK, MUTED, VERMILLION, cloud, house_style, svg_text
from drivetrain.sizing.results import Check, JointResult
from drivetrain.study.study import JointTask, Study

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
    """The motor's regions at ambient, and with the winding as hot as the task makes it.

    Args:
        joint: Its result.
        task: Its part of the study: amplifier and mounting.
        study: Supply and ambient.

    Returns:
        Corners of the regions.
    """
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
    """Motor torque against motor speed in four quadrants, with the gear's side on the second axes.

    Args:
        joint: Its result.
        task: Its part of the study.
        study: What was asked.
        name: Of the figure on the page.

    Returns:
        An SVG element.
    """
    with house_style(name):
        figure = Figure(figsize=(6.2, 5.6))
        axes = figure.subplots()
        unit = draw_motor_plane(axes, joint, motor_regions(joint, task, study))
        _worst_point(axes, joint, unit)
        _rms_point(axes, joint, unit)
        _gear_side(axes, joint.drive.gear.ratio, joint.drive.gear.kind == "ideal", unit)
        points = axes.collections[-1]
        bar = figure.colorbar(points, ax=axes, orientation="horizontal", aspect=60, pad=0.02)
        bar.set_label("time in the cycle [s]")
        bar.outline.set_visible(False)  # type: ignore[operator]
        figure.legend(loc="outside upper center", ncols=2, handlelength=1.8, columnspacing=1.6)
        return svg_text(figure, f"{joint.name}: torque against speed of motor {joint.motor} in four quadrants")


def draw_motor_plane(axes: Axes, joint: JointResult, regions: Regions, *, small: bool = False) -> str:
    """Regions and cloud on given axes.

    Args:
        axes: Where to draw.
        joint: Its result.
        regions: From ``motor_regions``.
        small: Without labels of the cold outlines, for an overview of many joints.

    Returns:
        The unit of the torque axis.
    """
    series = joint.series
    right, top = _view(joint, regions)
    unit = shown_unit(top, "N m")
    axes.set_xlim(-float(convert(right, "rad/s", "rpm")), float(convert(right, "rad/s", "rpm")))
    axes.set_ylim(-float(convert(top, "N m", unit)), float(convert(top, "N m", unit)))
    hot, cold = f"winding at {regions.hot:.0f} °C", f"winding at {regions.cold:.0f} °C"
    _region(axes, regions.intermittent_hot, unit, f"intermittent, {hot}", BLUE, 0.12)
    _region(axes, regions.intermittent_cold, unit, f"intermittent, {cold}", BLUE, None)
    if regions.continuous_hot is not None and regions.continuous_cold is not None:
        _region(axes, regions.continuous_hot, unit, f"continuous, {hot}", GREEN, 0.24)
        _region(axes, regions.continuous_cold, unit, f"continuous, {cold}", GREEN, None)
    axes.axhline(0, color=MUTED, linewidth=0.7, zorder=2)
    axes.axvline(0, color=MUTED, linewidth=0.7, zorder=2)
    cloud(axes, convert(series.motor_speed, "rad/s", "rpm"), convert(series.motor_torque, "N m", unit), series.time)
    if small:
        axes.xaxis.set_major_locator(MaxNLocator(5))
    else:
        axes.set_xlabel("motor speed [rpm]")
        axes.set_ylabel(f"motor torque [{printed_unit(unit)}]")
    return unit


def _view(joint: JointResult, regions: Regions) -> tuple[float, float]:
    """Half width [rad/s] and half height [N m] of the picture: the motion, and the region unless far larger."""
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


def _region(axes: Axes, corners: Array, unit: str, label: str, colour: str, alpha: float | None) -> None:
    """One region: filled when hot, a dashed outline when cold."""
    points = np.column_stack([convert(corners[:, 0], "rad/s", "rpm"), convert(corners[:, 1], "N m", unit)])
    if alpha is None:
        patch = Polygon(points, closed=True, fill=False, edgecolor=colour, linestyle=(0, (4, 2)), linewidth=1.0)
    else:
        patch = Polygon(points, closed=True, facecolor=(colour, alpha), edgecolor=colour, linewidth=1.0)
    patch.set_label(label)
    patch.set_zorder(1.5)
    axes.add_patch(patch)


def worst_instant(joint: JointResult) -> Check | None:
    """The check closest to its limit among those that happen at one instant (temperatures lag behind, so not they).

    Args:
        joint: Its result.

    Returns:
        The check; None when none was judged at an instant.
    """
    judged = [
        check
        for check in joint.checks
        if check.utilisation is not None and check.time is not None and check.unit not in ("C", "degC")
    ]
    return max(judged, key=lambda check: check.utilisation or 0.0, default=None)


def _worst_point(axes: Axes, joint: JointResult, unit: str) -> None:
    """The labelled sample at which a limit is closest."""
    check = worst_instant(joint)
    if check is None or check.time is None:
        return
    i = int(np.argmin(np.abs(joint.series.time - check.time)))
    x = float(convert(joint.series.motor_speed[i], "rad/s", "rpm"))
    y = float(convert(joint.series.motor_torque[i], "N m", unit))
    axes.plot(
        x, y, "o", markersize=8, markerfacecolor="none", markeredgecolor=VERMILLION, markeredgewidth=1.8, zorder=6
    )
    text = (
        f"{check.name}: {percent(check.utilisation)}\n"
        f"t = {number(check.time)} s: {number(y)} {printed_unit(unit)} at {number(x)} rpm"
    )
    across, up = _free_corner(x / axes.get_xlim()[1], y / axes.get_ylim()[1])
    axes.annotate(
        text, (x, y), xytext=(0.015 + 0.97 * across, 0.015 + 0.97 * up), textcoords="axes fraction",
        ha="right" if across else "left", va="top" if up else "bottom", fontsize=7.5, zorder=7, linespacing=1.4,
        bbox={"boxstyle": "round,pad=0.3", "facecolor": "white", "edgecolor": VERMILLION, "linewidth": 0.7},
        arrowprops={"arrowstyle": "-", "color": VERMILLION, "linewidth": 0.8, "shrinkB": 4},
    )  # fmt: skip


def _free_corner(x: float, y: float) -> tuple[int, int]:
    """The corner (0 or 1 across, 0 or 1 up) for the label of a point at shares x, y of the half axes.

    It is the point's own, unless the label would lie on the point: then the other one at the same height.
    """
    across, up = int(x >= 0.0), int(y >= 0.0)
    covered = abs(y) > 0.72 and abs(x) > 0.1
    return (1 - across if covered else across), up


def _rms_point(axes: Axes, joint: JointResult, unit: str) -> None:
    """RMS torque over the cycle at the mean speed, both as magnitudes."""
    series = joint.series
    duration = float(series.time[-1] - series.time[0])
    if duration <= 0.0:
        return
    rms = float(np.sqrt(np.trapezoid(series.motor_torque**2, series.time) / duration))
    mean = float(np.trapezoid(np.abs(series.motor_speed), series.time) / duration)
    x, y = float(convert(mean, "rad/s", "rpm")), float(convert(rms, "N m", unit))
    label = f"RMS {number(y)} {printed_unit(unit)} at mean {number(x)} rpm"
    axes.plot(
        x, y, "D", markersize=7, color=INK, markeredgecolor="white", markeredgewidth=1.2, zorder=6, label=label,
        linestyle="none",
    )  # fmt: skip


def _gear_side(axes: Axes, ratio: float, direct: bool, unit: str) -> None:
    """Second axes: the same torque and speed seen at the gear's output, without losses."""
    if direct:
        return
    largest = float(axes.get_ylim()[1]) * abs(ratio) * float(1.0 / convert(1.0, "N m", unit))
    side = shown_unit(largest, "N m")
    scale = ratio * float(convert(1.0, "N m", side)) / float(convert(1.0, "N m", unit))
    top = axes.secondary_xaxis("top", functions=_times(1.0 / ratio))
    top.set_xlabel("gear output speed [rpm]", color=MUTED)
    right = axes.secondary_yaxis("right", functions=_times(scale))
    right.set_ylabel(f"torque at the gear output, no losses [{printed_unit(side)}]", color=MUTED)
    for spine in (top.spines["top"], right.spines["right"]):
        spine.set_visible(True)
        spine.set_color(MUTED)


def _times(scale: float) -> tuple[Callable[[ArrayLike], Array], Callable[[ArrayLike], Array]]:
    """A scaling and its inverse, as a second axis wants them."""
    return (lambda values: np.asarray(values, dtype=np.float64) * scale), (
        lambda values: np.asarray(values, dtype=np.float64) / scale
    )
