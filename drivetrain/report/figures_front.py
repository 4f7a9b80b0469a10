"""The Pareto front: two criteria across, a third as colour, and the sets step by step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.report.colours import BLUE, INK, MUTED, VERMILLION
from drivetrain.report.quantities import printed_unit
from drivetrain.report.svg import TIME_COLOURS, house_style
from drivetrain.sizing.front import Front
from drivetrain.sizing.results import DriveSet

AXES = {
    "mass": "mass of all drives [kg]", "price": "price of all drives", "energy": "energy a cycle [J]",
    "utilisation": "highest utilisation [%]",
}  # fmt: skip
MOST_NAMED = 12


def figure_front(found: Front, *, chosen: DriveSet | None = None, name: str = "front") -> Figure:
    """The sets of the front over its first two criteria, coloured by another figure.

    Args:
        found: From ``pareto_front``.
        chosen: A set to be marked, such as the one selected; None: none.
        name: Of the figure.

    Returns:
        The figure; with three criteria or more a panel for every two of them.
    """
    pairs = _pairs(found.names)
    with house_style(name):
        figure = Figure(figsize=(7.6, 4.4 if len(pairs) == 1 else 3.6 * ((len(pairs) + 1) // 2)))
        rows, columns = (1, 1) if len(pairs) == 1 else ((len(pairs) + 1) // 2, 2)
        panels = list(figure.subplots(rows, columns, squeeze=False).ravel())
        shade = _shade(found)
        values = _values(found.points, shade)
        limits = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
        dots: PathCollection | None = None
        for axes, (x, y) in zip(panels, pairs, strict=False):
            dots = _panel(axes, found, x, y, values, limits, len(pairs) == 1)
            if chosen is not None:
                point = _values([chosen], x)[0], _values([chosen], y)[0]
                axes.plot(*point, "*", color=INK, markersize=11, markeredgecolor="white", zorder=6)
                axes.annotate("chosen", point, xytext=(7, 5), textcoords="offset points", fontsize=7.5)
        for axes in panels[len(pairs) :]:
            axes.set_visible(False)
        if dots is not None and len(found.points):
            bar = figure.colorbar(dots, ax=panels[: len(pairs)], shrink=0.85, pad=0.02)
            bar.set_label(AXES[shade])
            bar.outline.set_visible(False)  # type: ignore[operator]
    return figure


def _pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Every two criteria; one alone goes over the mass."""
    if len(names) == 1:
        return [("energy" if names[0] == "mass" else "mass", names[0])]
    return [(x, y) for i, x in enumerate(names) for y in names[i + 1 :]]


def _shade(found: Front) -> str:
    """What the colour tells: the reserve, unless it is across already; then what is left."""
    if found.names == ("mass", "utilisation") or found.names == ("price", "utilisation"):
        return "energy"
    return "utilisation"


def _values(points: Sequence[DriveSet], name: str) -> Array:
    scale = 100.0 if name == "utilisation" else 1.0
    return np.array([scale * point.criteria[name] for point in points])


def _panel(
    axes: Axes, found: Front, x: str, y: str, shades: Array, limits: tuple[float, float], alone: bool
) -> PathCollection:
    """One view of the front."""
    across, up = _values(found.points, x), _values(found.points, y)
    if alone and len(across):
        order = np.argsort(across, kind="stable")
        axes.step(across[order], up[order], where="post", color=MUTED, linewidth=0.8, zorder=2)
    dots = axes.scatter(
        across, up, c=shades, cmap=TIME_COLOURS, vmin=limits[0], vmax=limits[1], s=22 if alone else 10, linewidths=0,
        zorder=4,
    )  # fmt: skip
    axes.set_xlabel(AXES[x])
    axes.set_ylabel(AXES[y])
    if "utilisation" in (x, y):
        line = axes.axvline if x == "utilisation" else axes.axhline
        line(100.0, color=VERMILLION, linewidth=0.9, linestyle=(0, (5, 2)), zorder=2)
    if alone and 0 < len(across) <= MOST_NAMED:
        for index, (a, b) in enumerate(zip(across, up, strict=True), 1):
            axes.annotate(str(index), (a, b), xytext=(5, 4), textcoords="offset points", fontsize=7, color=BLUE)
    return dots


def unit_of(name: str) -> str:
    """The unit of a criterion, as it is printed.

    Args:
        name: Of the criterion.

    Returns:
        Such as ``kg``; empty for a price.
    """
    return printed_unit({"mass": "kg", "energy": "J", "utilisation": "%", "price": ""}[name])
