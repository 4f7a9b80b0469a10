"""The dynamics of the tip along a path: how heavy it is, what its motion asks, and how near a singularity is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array, checked_array
from drivetrain.dynamics.task_space import TaskSpaceDynamics
from drivetrain.report.charts.chart import JOINT_COLOURS, ORANGE
from drivetrain.report.charts.plotting import house_style


def figure_task_space(
    path: Any, answers: Mapping[str, TaskSpaceDynamics], *, label: str, logarithmic: bool = False
) -> Figure:
    """Task inertia, condition number and bias over a path, for one or more ways to treat singularities.

    Args:
        path: What changes along the path, in the unit that ``label`` tells, (N,).

    Raises:
        InputError: The path is no list of finite numbers.
    """
    x = checked_array(path, (None,), "path")
    with house_style("task space"):
        figure = Figure(figsize=(9.4, 3.1))
        inertia, force, condition = figure.subplots(1, 3, sharex=True)
        for i, (title, answer) in enumerate(answers.items()):
            colour, line = JOINT_COLOURS[i % len(JOINT_COLOURS)], ("-", "--", ":", "-.")[i % 4]
            values: Array = np.linalg.eigvalsh(answer.inertia).astype(np.float64)
            inertia.loglog(x, _positive(values[:, -1]), color=colour, linestyle=line, label=title)
            inertia.loglog(x, _positive(values[:, 0]), color=colour, linestyle=line, alpha=0.5)
            whole: Array = np.linalg.norm(answer.bias + answer.gravity, axis=1).astype(np.float64)
            force.loglog(x, _positive(whole), color=colour, linestyle=line)
            condition.loglog(x, answer.condition, color=colour, linestyle=line)
            _shade(condition, x, answer)
        inertia.set_ylabel("largest and smallest task inertia [SI]")
        force.set_ylabel("bias and gravity of the task, size [SI]")
        condition.set_ylabel("condition number [-]")
        condition.set_title("shaded: damped or reduced")
        for axes in (inertia, force, condition):
            axes.set_xlabel(label)
            axes.set_xscale("log" if logarithmic else "linear")
        figure.legend(*inertia.get_legend_handles_labels(), loc="outside lower center", ncols=len(answers))
    return figure


def _positive(values: Array) -> Array:
    """Values for a logarithmic scale: what is zero but for rounding is left out."""
    return np.where(values > 1e-9 * np.abs(values).max(), values, np.nan)


def _shade(axes: Axes, x: Array, answer: TaskSpaceDynamics) -> None:
    flagged = (answer.damping > 0.0) | (answer.rank < answer.rank.max())
    axes.fill_between(x, 0.0, 1.0, where=flagged, transform=axes.get_xaxis_transform(), color=ORANGE, alpha=0.10, lw=0)
