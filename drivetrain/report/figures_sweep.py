"""The results of a sweep as one picture: the objective over what varies, one line for each choice of the rest."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.report.colours import JOINT_COLOURS, MUTED
from drivetrain.report.svg import house_style, svg_text

MOST_LINES = 10  # a picture with more is a thicket: the rest is told
SCALE = "scale."  # before what is varied by a factor
_NUMBER = re.compile(r"\s*([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)\s*(.*)$")


def figure_sweep(results: pd.DataFrame, names: Sequence[str], label: str, *, name: str = "sweep") -> Figure:
    """The objective at every point; where nothing fits, a cross at the foot."""
    along = along_axis(results, names)
    numbers, unit = _numbers(results[along])
    others = [one for one in names if one != along]
    lines = results.groupby(others, sort=False) if others else [((), results)]
    with house_style(name):
        figure = Figure(figsize=(7.6, 4.4))
        axes = figure.subplots()
        for count, (key, rows) in enumerate(lines):
            if count < MOST_LINES:
                _line(axes, rows, numbers.loc[rows.index], _title(others, key), JOINT_COLOURS[count % 8], count)
        scaled = along.startswith(SCALE)
        axes.set_xlabel(f"{_short(along)} over the study's [-]" if scaled else f"{_short(along)} [{unit or '-'}]")
        axes.set_ylabel(label)
        axes.set_ylim(0.0, 1.06 * float(results.loc[results["feasible"], "objective"].max()))
        if not results["feasible"].all():
            axes.plot([], [], "x", color=MUTED, label="none fits, in its line's colour")
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
        figure.set_layout_engine("constrained")
    return figure


def sweep_svg(results: pd.DataFrame, names: Sequence[str], label: str) -> str:
    """The same for a page."""
    if not along_axis(results, names) or not results["feasible"].any():
        return ""
    figure = figure_sweep(results, names, label)
    with house_style("sweep"):
        return svg_text(figure, f"{label} of every point of the sweep")


def along_axis(results: pd.DataFrame, names: Sequence[str]) -> str:
    """What lies along the axis of the picture."""
    fitting = {one: results[one].nunique() for one in names if not _numbers(results[one])[0].isna().any()}
    return max(fitting, key=lambda one: fitting[one], default="")


def _line(
    axes: Axes, rows: pd.DataFrame, along: pd.Series[float], title: str, colour: str, place: int
) -> None:  # fmt: skip
    """One choice of the rest: a line through what fits, crosses at the foot where nothing does."""
    order = along.sort_values().index
    fits = rows.loc[order, "feasible"].to_numpy()
    axes.plot(along[order], np.where(fits, rows.loc[order, "objective"], np.nan), "o-", color=colour, label=title)
    failed = along[order][~fits]
    height = np.full(len(failed), 0.03 + 0.03 * place)  # crosses of several lines stand above one another
    axes.plot(failed, height, "x", color=colour, transform=axes.get_xaxis_transform())


def _title(names: Sequence[str], key: object) -> str:
    values = key if isinstance(key, tuple) else (key,)
    told = zip(names, values, strict=True)
    return ", ".join(f"{_short(one)} {'× ' if one.startswith(SCALE) else ''}{value}" for one, value in told)


def _short(name: str) -> str:
    return name.removeprefix(SCALE).split(".")[-1].replace("_", " ")


def _numbers(texts: pd.Series[str]) -> tuple[pd.Series[float], str]:
    """Values as numbers of one unit; NaN everywhere when they are not."""
    found = [_NUMBER.match(text) for text in texts]
    units = {match[2].strip() for match in found if match}
    if len(units) != 1 or not all(found):
        return pd.Series(np.nan, index=texts.index), ""
    return pd.Series([float(match[1]) for match in found if match], index=texts.index), units.pop()
