"""The gear plane of one joint: output torque against input speed, with every limit the sheet prints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetrain.drive.gear import Gear
from drivetrain.report.colours import BLUE, INK, MUTED, ORANGE, SKY, VERMILLION
from drivetrain.report.panel import Panel, cloud, panel, time_bar
from drivetrain.report.picture import Font, Pen, Picture
from drivetrain.report.quantities import convert, number, printed_unit, scaled
from drivetrain.report.thinning import spread
from drivetrain.sizing.results import JointResult

WIDTH, HEIGHT = 446.0, 404.0  # [points] of the picture
LEFT, RIGHT, TOP, LOW = 52.0, 440.0, 8.0, 332.0  # [points] of the plane in it
DASHES: dict[str, tuple[float, ...]] = {"-": (), ":": (1.0, 1.7), "--": (4.0, 2.0)}
FAR = 3.0  # limits beyond this many times the motion's largest value are told in words at the edge
Line = tuple[str, float, str, str]  # label, value [SI], colour, dash


def torque_lines(gear: Gear) -> list[Line]:
    """The torque limits a gear's sheet prints, smallest meaning first.

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


def gear_plane(joint: JointResult, *, parts: Sequence[slice] = (), name: str = "gear") -> str:
    """Output torque against input speed over the cycle, and the gear's limits."""
    gear, series = joint.drive.gear, joint.series
    torques, speeds = torque_lines(gear), speed_lines(gear)
    if not torques and not speeds:
        return ""
    torque, unit = scaled(np.abs(series.gear_torque), "N m")
    speed = convert(np.abs(series.motor_speed), "rad/s", "rpm")
    shown_torques = [(n, float(convert(v, "N m", unit)), c, d) for n, v, c, d in torques]
    shown_speeds = [(n, float(convert(v, "rad/s", "rpm")), c, d) for n, v, c, d in speeds]
    top = _edge(float(torque.max(initial=0.0)), [value for _, value, _, _ in shown_torques])
    right = _edge(float(speed.max(initial=0.0)), [value for _, value, _, _ in shown_speeds])
    picture = Picture(name, WIDTH, HEIGHT)
    plane = panel(picture, (LEFT, RIGHT), (TOP, LOW), (0.0, right), (0.0, top))
    plane.grid()
    _regions(plane, _by_name(shown_torques), _by_name(shown_speeds))
    for _, value, colour, dash in shown_torques:
        plane.level(value, Pen(colour, 1.1, DASHES[dash]))
    for _, value, colour, dash in shown_speeds:
        plane.upright(value, Pen(colour, 1.1, DASHES[dash]))
    cloud(plane, speed, torque, series.time, parts=parts)
    outermost = max((value for _, value, _, _ in shown_speeds if value <= right), default=right)
    label_end = outermost if outermost > 0.7 * right else right
    _name_torques(plane, shown_torques, printed_unit(unit), label_end)
    _name_speeds(plane, shown_speeds, label_end)
    plane.edges()
    plane.x_axis("gear input speed, magnitude [rpm]")
    plane.y_axis(f"gear output torque, magnitude [{printed_unit(unit)}]")
    time_bar(picture, (LEFT, RIGHT), LOW + 34.0, series.time)
    return picture.svg(f"{joint.name}: output torque against input speed of gear {joint.gear}")


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


def _regions(plane: Panel, torques: dict[str, float], speeds: dict[str, float]) -> None:
    """Where the gear may stay for ever, and where only the peaks may go."""
    far_right = plane.x.high
    peak = torques.get("repeated peak", torques.get("momentary"))
    lasting = torques.get("average", torques.get("rated"))
    if peak is not None:
        plane.block((0.0, speeds.get("maximum", far_right)), (0.0, peak), SKY, 0.16)
    if lasting is not None:
        plane.block((0.0, speeds.get("mean", speeds.get("rated", far_right))), (0.0, lasting), SKY, 0.30)


def _name_torques(plane: Panel, lines: list[Line], unit: str, label_end: float) -> None:
    """Names of the torque limits, ending at one speed; those beyond the edge at the top."""
    top = plane.y.high
    inside = [line for line in lines if line[1] <= top]
    heights = spread([value for _, value, _, _ in inside], 0.04 * top)
    for (label, value, _, _), height in zip(inside, heights, strict=True):
        plane.words(label_end, height, f"{label} {number(value)} {unit}", Font(7.9, INK, "end"), (-4.0, -2.5))
    beyond = [f"{label} {number(value)} {unit}" for label, value, _, _ in lines if value > top]
    if beyond:
        text = "↑ beyond the picture: " + ", ".join(beyond)
        plane.words(0.0, top, text, Font(7.9, MUTED, level="top"), (5.0, 4.0))


def _name_speeds(plane: Panel, lines: list[Line], label_end: float) -> None:
    """Names of the speed limits along their lines; those beyond the edge below, ending at one speed."""
    right = plane.x.high
    inside = [line for line in lines if line[1] <= right]
    places = spread([value for _, value, _, _ in inside], 0.03 * right)
    for (label, value, _, _), place in zip(inside, places, strict=True):
        text = f"{label} {number(value)} rpm"
        plane.words(place, 0.0, text, Font(7.9, INK, level="top", turned=True), (2.5, -26.0))
    beyond = [f"{label} {number(value)} rpm" for label, value, _, _ in lines if value > right]
    if beyond:
        plane.words(label_end, 0.0, "beyond: " + ", ".join(beyond) + " →", Font(7.9, MUTED, "end"), (-6.0, -8.0))
