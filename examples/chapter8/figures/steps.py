"""What methods of integration cost and what they err."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from drivetrain.report.charts.chart import JOINT_COLOURS
from drivetrain.report.charts.plotting import house_style
from drivetrain.simulation.passive import StepResult


def figure_step_study(studies: Mapping[str, Sequence[StepResult]], *, unit: str = "rad", name: str = "steps") -> Figure:
    """What methods cost and what they err: position and energy over work, and the energy error over time."""
    with house_style(name):
        figure = Figure(figsize=(9.6, 3.2))
        left, middle, right = figure.subplots(1, 3)
        for i, (title, results) in enumerate(studies.items()):
            colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
            work = [result.recording.counters["rates"] for result in results]
            left.loglog(work, [result.error[-1] for result in results], "o-", color=colour, markersize=3.5, label=title)
            energy = [result.energy_error[-1] for result in results]
            middle.loglog(work, energy, "o-", color=colour, markersize=3.5)
            for result in results[:1]:
                time, values = result.recording.time[1:], result.energy_error[1:]
                right.semilogy(time, np.where(values > 0.0, values, np.nan), color=colour)
        left.set_ylabel(f"largest error of a position [{unit}]")
        middle.set_ylabel("largest energy gained or lost [J]")
        right.set_ylabel("energy gained or lost by then [J]")
        right.set_xlabel("time [s]")
        right.set_title("coarsest setting of each")
        for axes in (left, middle):
            axes.set_xlabel("evaluations of the right-hand side")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(studies))
    return figure
