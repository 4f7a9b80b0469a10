"""Candidates of every joint: mass against the worst utilisation, and which check felled them."""

from __future__ import annotations

from collections import Counter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from drivetrain.report.svg import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MOST_VECTOR_POINTS,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    house_style,
    svg_text,
)
from drivetrain.sizing.results import Fallen, Selection

CHECK_COLOURS = (VERMILLION, BLUE, ORANGE, PURPLE, SKY, "#7f6a3f")
LARGEST_DRAWN = 10.0  # times the limit; candidates beyond stand at the upper edge


def candidates(selection: Selection, *, name: str = "candidates") -> str:
    """One small picture a joint: every candidate that fell, by its share of the objective and its worst utilisation.

    Args:
        selection: What was found.
        name: Of the figure on the page.

    Returns:
        An SVG element, empty when there was nothing to choose.
    """
    by_joint: dict[str, list[Fallen]] = {joint: [] for joint in selection.evaluation.joints}
    for fallen in selection.fallen:
        by_joint.setdefault(fallen.joint, []).append(fallen)
    joints = [joint for joint in by_joint if by_joint[joint] or selection.alternatives.get(joint)]
    if not joints:
        return ""
    colours = _colours(selection)
    columns = min(3, len(joints))
    rows = -(-len(joints) // columns)
    with house_style(name):
        figure = Figure(figsize=(9.2, 2.55 * rows + 0.5))
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for i, axes in enumerate(grid.flat):
            if i >= len(joints):
                axes.set_visible(False)
                continue
            _joint(axes, joints[i], by_joint[joints[i]], selection, colours)
        largest = max([one.utilisation for one in selection.fallen], default=1.0)
        grid.flat[0].set_ylim(18, 100 * min(max(2.0, 1.3 * largest), 1.15 * LARGEST_DRAWN))
        for axes in grid[:, 0]:
            axes.set_ylabel("worst utilisation [%]")
        for i in range(len(joints)):
            if i + columns >= len(joints):
                grid.flat[i].set_xlabel(objective_label(selection.study.objective))
        _legend(figure, grid.flat[0], colours, "chosen" if selection.feasible else "nearest")
        return svg_text(figure, "candidates by their share of the objective and their worst utilisation")


def objective_label(objective: str) -> str:
    """The axis of an objective.

    Args:
        objective: ``mass`` or ``price``.

    Returns:
        With its unit.
    """
    return "mass of motor and gear [kg]" if objective == "mass" else f"{objective} [as in the catalogue]"


def _colours(selection: Selection) -> dict[str, str]:
    """A colour for each of the checks that felled most; the rest share grey."""
    counts = Counter(fallen.check for fallen in selection.fallen)
    common = sorted(counts, key=lambda check: (-counts[check], check))[: len(CHECK_COLOURS)]
    return dict(zip(common, CHECK_COLOURS, strict=False))


def _joint(axes: Axes, joint: str, fallen: list[Fallen], selection: Selection, colours: dict[str, str]) -> None:
    """The candidates of one joint."""
    known = [one for one in fallen if np.isfinite(one.objective)]
    for check in sorted({one.check for one in known}, key=lambda check: (check in colours, check)):
        group = [one for one in known if one.check == check]
        share = np.minimum([one.utilisation for one in group], LARGEST_DRAWN)
        many = len(known) > MOST_VECTOR_POINTS // 4
        axes.scatter(
            [one.objective for one in group], 100 * share, s=7, linewidths=0, alpha=0.7,
            color=colours.get(check, "#9aa5b1"), rasterized=many, zorder=3,
        )  # fmt: skip
    result = selection.evaluation.joints.get(joint)
    axes.set_yscale("log")
    axes.axhspan(1, 100, color=GREEN, alpha=0.07, linewidth=0)
    axes.axhline(100.0, color=VERMILLION, linewidth=1)
    for _, _, objective in selection.alternatives.get(joint, ()):
        axes.plot(objective, 80.0, "v", color="white", markeredgecolor=GREEN, markersize=5, zorder=4)
    mass = _share(selection, joint)
    if (
        result is not None
        and result.binding is not None
        and result.binding.utilisation is not None
        and mass is not None
    ):
        share = min(max(result.binding.utilisation, 0.21), LARGEST_DRAWN)
        axes.plot(mass, 100 * share, "*", color=INK, markersize=11, markeredgecolor="white", zorder=5)
    if known and max(one.objective for one in known) > 3.0 * min(one.objective for one in known) > 0.0:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter("")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.0f}")
    axes.yaxis.set_minor_formatter("")
    axes.set_title(f"{joint}: {len(fallen)} fell")
    axes.grid(which="minor", color=FAINT, linewidth=0.3)


def _share(selection: Selection, joint: str) -> float | None:
    """The chosen drive's own mass or price, where known."""
    result = selection.evaluation.joints.get(joint)
    if result is None:
        return None
    field = "price" if selection.study.objective == "price" else "mass"
    values = [getattr(part, field) for part in (result.drive.motor, result.drive.gear)]
    known = [value for value in values if value is not None]
    return float(sum(known)) if known else None


def _legend(figure: Figure, axes: Axes, colours: dict[str, str], star: str) -> None:
    """What the colours and marks mean."""
    marks = [axes.plot([], [], "*", color=INK, markersize=9, label=star)[0]]
    marks.append(axes.plot([], [], "v", color="white", markeredgecolor=GREEN, markersize=5, label="also passes")[0])
    for check, colour in colours.items():
        marks.append(axes.plot([], [], "o", color=colour, markersize=4, label=check)[0])
    if colours:
        marks.append(axes.plot([], [], "o", color="#9aa5b1", markersize=4, label="other checks")[0])
    figure.legend(handles=marks, loc="outside upper center", ncols=5, handletextpad=0.2)
