"""A picture of a recording over time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.report.colours import INK, JOINT_COLOURS, MUTED, VERMILLION
from drivetrain.report.plotting import house_style
from drivetrain.report.quantities import printed_unit
from drivetrain.simulation.recording import Recording

JOINT_PARTS = ("position", "speed", "torque")
MOST_EVENTS = 12  # more lines than these hide the curves


def figure_recording(recording: Recording, *, name: str = "recording") -> Figure:
    """A recording over time: one picture for each kind of quantity, joints by colour, energies together."""
    groups = _groups(recording)
    with house_style(name):
        figure = Figure(figsize=(7.4, 0.5 + 1.55 * len(groups)))
        column = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        told: list[str] = []  # the legend that stands already, of the same colours
        for axes, (title, (unit, curves)) in zip(column, groups.items(), strict=True):
            for i, (label, values) in enumerate(curves.items()):
                axes.plot(recording.time, values, color=JOINT_COLOURS[i % len(JOINT_COLOURS)], label=label)
            axes.set_ylabel(f"{title} [{printed_unit(unit)}]")
            if len(curves) > 1 and list(curves) != told:
                told = list(curves)
                axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.2)
            _events(axes, recording)
        column[-1].set_xlabel("time [s]")
        figure.align_ylabels(list(column))
        if recording.stopped_by is not None:
            column[0].set_title(f"stopped after {recording.stopped_by.time:.6g} s: {recording.stopped_by.name}")
    return figure


def _groups(recording: Recording) -> dict[str, tuple[str, dict[str, np.ndarray]]]:
    """Curves that share a picture, by its title; unit and curves by label."""
    groups: dict[str, tuple[str, dict[str, np.ndarray]]] = {}
    for title, label, unit, values in _named(recording):
        if title in groups and groups[title][0] != unit:
            title = f"{title}, linear" if unit.startswith(("m", "N")) else f"{title}, other"
        if np.any(values):
            groups.setdefault(title, (unit, {}))[1][label] = values
    return groups or {"time": ("s", {"": recording.time})}


def _named(recording: Recording) -> list[tuple[str, str, str, np.ndarray]]:
    """Title, label, unit and values of what is drawn."""
    found = []
    for part in JOINT_PARTS:
        for joint, values in recording.ending(part).items():
            found.append((part, joint, recording.unit(f"{joint}.{part}"), values))
    for series, (unit, values) in recording.series.items():
        if "." not in series:
            label = series.replace("_", " ")
            found.append(("energy" if series in ENERGIES else label, label, unit, values))
    return found


ENERGIES = ("kinetic_energy", "potential_energy", "work")


def _events(axes: Axes, recording: Recording) -> None:
    for event in recording.events[:MOST_EVENTS]:
        axes.axvline(event.time, color=MUTED, linewidth=0.6, linestyle=":")
    if recording.stopped_by is not None:
        axes.axvline(recording.stopped_by.time, color=VERMILLION, linewidth=1.4)
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.set_xlim(recording.time[0], recording.time[-1])
