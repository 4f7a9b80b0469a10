"""The Pareto front: two criteria across, a third as colour, and the sets step by step."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.report.colours import BLUE, INK, MUTED, VERMILLION
from drivetrain.report.quantities import printed_unit
from drivetrain.report.svg import TIME_COLOURS, house_style
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.front import Front

AXES = {
    "mass": "mass of all drives [kg]", "price": "price of all drives", "energy": "energy a cycle [J]",
    "utilisation": "highest utilisation [%]",
}  # fmt: skip
MOST_NAMED = 12
MANY = 400  # sets: then dots are small
NEAR_LIMIT = 90.0  # %: where it is reached the limit is drawn


def figure_front(found: Front, *, chosen: DriveSet | None = None, name: str = "front") -> Figure:
    """The sets of the front over its first two criteria, coloured by another figure.

    Args:
        chosen: A set to be marked, such as the one selected; None: none.
    """
    with house_style(name):
        if len(found.names) > 2:
            return _matrix(found, chosen)
        figure = Figure(figsize=(7.6, 4.4))
        axes = figure.subplots()
        x, y = ("energy" if found.names[0] == "mass" else "mass", found.names[0])
        if len(found.names) == 2:
            x, y = found.names
        dots = _panel(axes, found, x, y, chosen, alone=True)
        _labels(axes, x, y)
        _bar(figure, dots, found, shrink=0.85, pad=0.02, ax=axes)
    return figure


def _matrix(found: Front, chosen: DriveSet | None) -> Figure:
    """A panel for every two criteria: those of a column share what is across, those of a row what is up."""
    names = found.names
    count = len(names) - 1
    figure = Figure(figsize=(7.6, 2.35 * count + 0.4))
    panels = figure.subplots(count, count, squeeze=False, sharex="col", sharey="row")
    dots = None
    for i, j in itertools.product(range(count), repeat=2):
        axes = panels[i, j]
        if j > i:
            axes.set_visible(False)
            continue
        dots = _panel(axes, found, names[j], names[i + 1], chosen, alone=False)
        _labels(axes, names[j] if i == count - 1 else "", names[i + 1] if j == 0 else "")
        axes.tick_params(labelbottom=i == count - 1, labelleft=j == 0)
    figure.align_ylabels(list(panels[:, 0]))
    if dots is not None:
        free = panels[0, count - 1].get_subplotspec()
        place = figure.add_subplot(free)
        place.set_axis_off()
        _bar(figure, dots, found, cax=place.inset_axes((0.05, 0.6, 0.9, 0.08)), orientation="horizontal")
    return figure


def knee(found: Front) -> int | None:
    """The set nearest to the best of every criterion at once, each scaled to its span over the front.

    Returns:
        Its place among the points; None where there are fewer than three sets or a single criterion.
    """
    if len(found.points) < 3 or len(found.names) < 2:
        return None
    values = np.stack([_values(found.points, name) for name in found.names], axis=1)
    span = np.maximum(np.ptp(values, axis=0), 1e-12)
    return int(np.argmin((((values - values.min(axis=0)) / span) ** 2).sum(axis=1)))


def _labels(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(AXES.get(x, ""))
    axes.set_ylabel(AXES.get(y, ""))


def _bar(figure: Figure, dots: PathCollection, found: Front, **how: Any) -> None:
    """What the colours mean."""
    if len(found.points):
        bar = figure.colorbar(dots, **how)
        bar.set_label(AXES[_shade(found)])
        bar.outline.set_visible(False)  # type: ignore[operator]


def _shade(found: Front) -> str:
    """What the colour tells: the reserve, unless it is across already; then what is left."""
    if found.names == ("mass", "utilisation") or found.names == ("price", "utilisation"):
        return "energy"
    return "utilisation"


def _values(points: Sequence[DriveSet], name: str) -> Array:
    scale = 100.0 if name == "utilisation" else 1.0
    return np.array([scale * point.criteria[name] for point in points])


def _panel(axes: Axes, found: Front, x: str, y: str, chosen: DriveSet | None, *, alone: bool) -> PathCollection:
    """One view of the front."""
    across, up, shades = (_values(found.points, name) for name in (x, y, _shade(found)))
    if alone and len(across):
        order = np.argsort(across, kind="stable")
        axes.step(across[order], up[order], where="post", color=MUTED, linewidth=0.8, zorder=2)
    dots = axes.scatter(
        across, up, c=shades, cmap=TIME_COLOURS, s=22 if alone else (9 if len(across) < MANY else 4), linewidths=0,
        zorder=4,
    )  # fmt: skip
    if "utilisation" in (x, y) and len(shades) and shades.max() > NEAR_LIMIT:
        line = axes.axvline if x == "utilisation" else axes.axhline
        line(100.0, color=VERMILLION, linewidth=0.9, linestyle=(0, (5, 2)), zorder=2)
    if alone and 0 < len(across) <= MOST_NAMED:
        for index, (a, b) in enumerate(zip(across, up, strict=True), 1):
            axes.annotate(str(index), (a, b), xytext=(5, 4), textcoords="offset points", fontsize=7, color=BLUE)
    bend = knee(found)
    if bend is not None:
        point = float(across[bend]), float(up[bend])
        axes.plot(*point, "o", markersize=10 if alone else 8, markerfacecolor="none", markeredgecolor=INK, zorder=5)
        if alone:
            axes.annotate("knee", point, xytext=(8, 8), textcoords="offset points", fontsize=7.5)
    if chosen is not None:
        point = float(_values([chosen], x)[0]), float(_values([chosen], y)[0])
        axes.plot(*point, "*", color=INK, markersize=11, markeredgecolor="white", zorder=6)
        if alone:
            axes.annotate("chosen", point, xytext=(7, 5), textcoords="offset points", fontsize=7.5)
    return dots


def unit_of(name: str) -> str:
    """The unit of a criterion, as it is printed."""
    return printed_unit({"mass": "kg", "energy": "J", "utilisation": "%", "price": ""}[name])
