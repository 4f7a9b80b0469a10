"""The gear plane of one joint: output torque against input speed, with every limit the sheet prints."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.drive.gear import Gear
from drivetrain.report.quantities import convert, number, printed_unit, scaled
from drivetrain.report.svg import BLUE, INK, MUTED, ORANGE, SKY, VERMILLION, cloud, house_style, spread, svg_text
from drivetrain.sizing.results import JointResult

FAR = 3.0  # limits beyond this many times the motion's largest value are told in words at the edge
Line = tuple[str, float, str, str]  # label, value [SI], colour, dash


def torque_lines(gear: Gear) -> list[Line]:
    """The torque limits a gear's sheet prints, smallest meaning first.

    Args:
        gear: Its sheet.

    Returns:
        (label, value [N m], colour, dash) of every limit that is known.
    """
    lines = (
        ("rated", gear.continuous_torque, MUTED, ":"),
        ("average", gear.average_torque_limit, BLUE, "-"),
        ("repeated peak", gear.repeated_peak_torque, ORANGE, "-"),
        ("momentary", gear.momentary_torque, VERMILLION, "--"),
    )
    return _merged([(label, value, colour, dash) for label, value, colour, dash in lines if value is not None])


def speed_lines(gear: Gear) -> list[Line]:
    """The input-speed limits a gear's sheet prints.

    Args:
        gear: Its sheet.

    Returns:
        (label, value [rad/s], colour, dash) of every limit that is known.
    """
    lines = (
        ("rated", gear.rated_speed, MUTED, ":"),
        ("mean", gear.average_input_speed_limit, BLUE, "-"),
        ("maximum", gear.max_input_speed, VERMILLION, "--"),
    )
    return _merged([(label, value, colour, dash) for label, value, colour, dash in lines if value is not None])


def _merged(lines: list[Line]) -> list[Line]:
    """Limits of one value in one line, which carries all their names."""
    found: dict[float, Line] = {}
    for label, value, colour, dash in lines:
        before = f"{found[value][0]}, " if value in found else ""
        found[value] = (before + label, value, colour, dash)
    return list(found.values())


def gear_plane(joint: JointResult, *, name: str = "gear") -> str:
    """Output torque against input speed over the cycle, and the gear's limits.

    Args:
        joint: Its result; of a direct drive nothing can be drawn.
        name: Of the figure on the page.

    Returns:
        An SVG element, empty when the gear prints no limit.
    """
    gear, series = joint.drive.gear, joint.series
    torques, speeds = torque_lines(gear), speed_lines(gear)
    if not torques and not speeds:
        return ""
    with house_style(name):
        figure = Figure(figsize=(6.2, 5.4))
        axes = figure.subplots()
        torque, torque_unit = scaled(np.abs(series.gear_torque), "N m")
        speed = convert(np.abs(series.motor_speed), "rad/s", "rpm")
        shown_torques = [(n, float(convert(v, "N m", torque_unit)), c, d) for n, v, c, d in torques]
        shown_speeds = [(n, float(convert(v, "rad/s", "rpm")), c, d) for n, v, c, d in speeds]
        top = _edge(float(torque.max(initial=0.0)), [value for _, value, _, _ in shown_torques])
        right = _edge(float(speed.max(initial=0.0)), [value for _, value, _, _ in shown_speeds])
        axes.set_xlim(0.0, right)
        axes.set_ylim(0.0, top)
        _regions(axes, _by_name(shown_torques), _by_name(shown_speeds))
        outermost = max((value for _, value, _, _ in shown_speeds if value <= right), default=right)
        label_end = outermost if outermost > 0.7 * right else right
        _torque_limits(axes, shown_torques, printed_unit(torque_unit), label_end)
        _speed_limits(axes, shown_speeds, right)
        points = cloud(axes, speed, torque, series.time)
        bar = figure.colorbar(points, ax=axes, orientation="horizontal", aspect=60, pad=0.02)  # type: ignore[arg-type]
        bar.set_label("time in the cycle [s]")
        bar.outline.set_visible(False)  # type: ignore[operator]
        axes.set_xlabel("gear input speed, magnitude [rpm]")
        axes.set_ylabel(f"gear output torque, magnitude [{printed_unit(torque_unit)}]")
        return svg_text(figure, f"{joint.name}: output torque against input speed of gear {joint.gear}")


def _edge(largest: float, limits: list[float]) -> float:
    """How far the axis goes: past the motion, and past every limit that is not far away."""
    if largest <= 0.0:
        return 1.12 * max(limits, default=1.0)
    near = [limit for limit in limits if limit <= FAR * largest]
    shown = max([largest, *near, min(limits, default=0.0) if not near else 0.0])
    return 1.12 * shown


def _by_name(lines: list[Line]) -> dict[str, float]:
    """Values by the single names behind the labels."""
    return {name: value for label, value, _, _ in lines for name in label.split(", ")}


def _regions(axes: Axes, torques: dict[str, float], speeds: dict[str, float]) -> None:
    """Where the gear may stay for ever, and where only the peaks may go."""
    far_right, far_up = axes.get_xlim()[1], axes.get_ylim()[1]
    peak = torques.get("repeated peak", torques.get("momentary"))
    lasting = torques.get("average", torques.get("rated"))
    if peak is not None:
        right = min(speeds.get("maximum", far_right), far_right)
        axes.fill_between([0.0, right], 0.0, min(peak, far_up), color=SKY, alpha=0.16, linewidth=0)
    if lasting is not None:
        right = min(speeds.get("mean", speeds.get("rated", far_right)), far_right)
        axes.fill_between([0.0, right], 0.0, min(lasting, far_up), color=SKY, alpha=0.30, linewidth=0)


def _torque_limits(axes: Axes, lines: list[Line], unit: str, label_end: float) -> None:
    """Limits as horizontal lines with labels that end at one speed; those beyond the edge named there."""
    top = axes.get_ylim()[1]
    inside = [line for line in lines if line[1] <= top]
    heights = spread([value for _, value, _, _ in inside], 0.045 * top)
    for (label, value, colour, dash), height in zip(inside, heights, strict=True):
        axes.axhline(value, color=colour, linestyle=dash, linewidth=1.1)
        axes.annotate(
            f"{label} {number(value)} {unit}", (label_end, height), xytext=(-4, 2),
            textcoords="offset points", ha="right", va="bottom", fontsize=7.5, color=INK,
        )  # fmt: skip
    beyond = [f"{label} {number(value)} {unit}" for label, value, _, _ in lines if value > top]
    if beyond:
        text = "↑ beyond the picture: " + ", ".join(beyond)
        axes.text(0.01, 0.985, text, transform=axes.transAxes, va="top", fontsize=7.5, color=MUTED)


def _speed_limits(axes: Axes, lines: list[Line], right: float) -> None:
    """Limits as vertical lines labelled along them; those beyond the edge named there."""
    inside = [line for line in lines if line[1] <= right]
    places = spread([value for _, value, _, _ in inside], 0.035 * right)
    for (label, value, colour, dash), place in zip(inside, places, strict=True):
        axes.axvline(value, color=colour, linestyle=dash, linewidth=1.1)
        axes.annotate(
            f"{label} {number(value)} rpm", (place, 0.09), xycoords=("data", "axes fraction"), xytext=(3, 0),
            textcoords="offset points", rotation=90, ha="left", va="bottom", fontsize=7.5, color=INK,
        )  # fmt: skip
    beyond = [f"{label} {number(value)} rpm" for label, value, _, _ in lines if value > right]
    if beyond:
        text = "beyond: " + ", ".join(beyond) + " →"
        axes.text(0.985, 0.03, text, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.5, color=MUTED)
