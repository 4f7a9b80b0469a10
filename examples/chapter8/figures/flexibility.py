"""The tip's deflection over the motion, joint by joint and link by link, and the arm's natural frequencies."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.report.charts.chart import BLUE, GREEN, INK, JOINT_COLOURS, MUTED, ORANGE, VERMILLION
from drivetrain.report.charts.plotting import house_style
from drivetrain.report.quantities import convert, number, printed_unit, shown_unit
from drivetrain.sizing.deflection import TipDeflection, Vibration

SMALL = 0.01  # share of the largest contribution below which one is left out of the picture
MOST_FREQUENCIES = 3


def figure_flexibility(
    deflection: TipDeflection, vibration: Vibration | None = None, *, name: str = "flexibility"
) -> Figure:
    """Strips over time: where the tip is displaced to, what does it, lost motion, and natural frequencies.

    Args:
        vibration: From ``vibration``; None: without that strip.
    """
    plays = bool(deflection.lost_motion.any())
    swings = vibration is not None and vibration.locked.shape[1] > 0
    heights = [1.0, 1.25, *([0.8] if plays else []), *([1.0] if swings else [])]
    with house_style(name):
        figure = Figure(figsize=(7.4, 1.9 * sum(heights) + 0.4))
        rows = list(np.atleast_1d(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)))
        unit = shown_unit(float(deflection.size.max()), "m")
        _displacement(rows[0], deflection, unit)
        _contributions(rows[1], deflection, unit)
        if plays:
            _lost_motion(rows[2], deflection, unit)
        if vibration is not None and swings:
            _frequencies(rows[-1], vibration)
        rows[-1].set_xlabel("time in the cycle [s]")
        rows[-1].set_xlim(float(deflection.time[0]), float(deflection.time[-1]))
    return figure


def _draw(axes: Axes, time: Array, values: Array, unit: str, colour: str, label: str, width: float = 1.2) -> None:
    """One curve, in the unit of the strip."""
    axes.plot(time, convert(values, "m", unit), color=colour, linewidth=width, label=label)


def _legend(axes: Axes) -> None:
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.3)


def _displacement(axes: Axes, deflection: TipDeflection, unit: str) -> None:
    """Along the base's axes, and its size with the instant of the largest."""
    axes.axhline(0.0, color=MUTED, linewidth=0.6, zorder=1)
    for part, colour, label in zip(deflection.displacement.T, (ORANGE, GREEN, BLUE), "xyz", strict=True):
        _draw(axes, deflection.time, part, unit, colour, f"along {label}")
    size = deflection.size
    _draw(axes, deflection.time, size, unit, INK, "size", 1.8)
    most = int(np.argmax(size))
    largest = float(convert(size[most], "m", unit))
    axes.plot(deflection.time[most], largest, "o", color=VERMILLION, markersize=4, zorder=5)
    axes.set_title(
        f"tip deflection, at most {number(largest)} {printed_unit(unit)} at {number(float(deflection.time[most]))} s"
    )
    axes.set_ylabel(f"displacement [{printed_unit(unit)}]")
    _legend(axes)


def _contributions(axes: Axes, deflection: TipDeflection, unit: str) -> None:
    """Joints in full lines, links dashed, what is small left out."""
    kinds = ((deflection.joints, deflection.joint_names, ""), (deflection.links, deflection.link_names, ", bending"))
    largest = max(float(np.linalg.norm(parts, axis=2).max()) for parts, _, _ in kinds)
    for parts, names, what in kinds:
        for i, label in enumerate(names):
            values = np.linalg.norm(parts[:, i], axis=1)
            if float(values.max()) > SMALL * largest:
                colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
                _draw(axes, deflection.time, values, unit, colour, label + what)
                if what:
                    axes.lines[-1].set_linestyle("--")
    _draw(axes, deflection.time, deflection.worst_case, unit, MUTED, "all one way", 1.0)
    axes.set_title("what each joint's spring and each link's bending does to the tip")
    axes.set_ylabel(f"size [{printed_unit(unit)}]")
    axes.set_ylim(bottom=0.0)
    _legend(axes)


def _lost_motion(axes: Axes, deflection: TipDeflection, unit: str) -> None:
    """What backlash leaves undecided, and where the load lays it."""
    laid = np.linalg.norm(deflection.backlash.sum(axis=1), axis=1)
    _draw(axes, deflection.time, deflection.lost_motion, unit, VERMILLION, "furthest apart")
    _draw(axes, deflection.time, laid, unit, BLUE, "from the middle, as loaded")
    axes.set_title("lost motion of the tip from backlash")
    axes.set_ylabel(f"size [{printed_unit(unit)}]")
    axes.set_ylim(bottom=0.0)
    _legend(axes)


def _frequencies(axes: Axes, vibration: Vibration) -> None:
    """The lowest few, motors holding and motors loose."""
    kinds = ((vibration.locked, BLUE, "motors hold still"), (vibration.free, ORANGE, "motors yield"))
    for values, colour, label in kinds:
        for k, column in enumerate(values.T[:MOST_FREQUENCIES]):
            axes.plot(
                vibration.time, column, color=colour, linewidth=1.4 - 0.3 * k,
                label=label if k == 0 else None,
            )  # fmt: skip
    lowest = float(vibration.locked.min())
    axes.set_title(f"lowest natural frequencies; with motors held still never below {number(lowest)} Hz")
    axes.set_ylabel("frequency [Hz]")
    axes.set_ylim(bottom=0.0)
    _legend(axes)
