"""One picture of all drives: the motor planes of every joint side by side, for a README or a slide."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from drivetrain.report.charts.chart import BLUE, GREEN, INK, JOINT_COLOURS, MUTED, ORANGE, VERMILLION
from drivetrain.report.charts.motion_data import regions, temperatures, view
from drivetrain.report.charts.plotting import TIME_COLOURS, house_style, png_bytes
from drivetrain.report.quantities import convert, percent, printed_unit, shown_unit
from drivetrain.simulation.recording import Recording
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.verdicts import Verdict

COLOURS = {Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: "#5b6775"}


def overview_png(evaluation: Evaluation) -> bytes:
    """The speed-torque planes of all joints with their clouds, drives and verdicts."""
    tasks = {task.name: task for task in evaluation.study.joints}
    joints = list(evaluation.joints.values())
    columns = min(3, len(joints))
    rows = -(-len(joints) // columns)
    with house_style("overview"):
        figure = Figure(figsize=(3.5 * columns, 2.95 * rows + 0.35))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, joint in zip(grid.flat, joints, strict=False):
            unit = _motor_plane(axes, joint, tasks[joint.name], evaluation.study)
            axes.set_title(f"{joint.name}\n", fontsize=9)
            drive = joint.motor + (f" + {joint.gear}" if joint.gear else "")
            axes.annotate(
                drive, (0, 1), xycoords="axes fraction", xytext=(0, 4), textcoords="offset points", fontsize=6.5
            )
            binding = "" if joint.binding is None else f" {percent(joint.binding.utilisation)}"
            axes.annotate(
                f"{joint.verdict}{binding}", (1, 1), xycoords="axes fraction", xytext=(0, 17),
                textcoords="offset points", ha="right", fontsize=8, weight="bold", color=COLOURS[joint.verdict],
            )  # fmt: skip
            axes.set_xlabel("motor speed [rpm]")
            axes.set_ylabel(f"motor torque [{printed_unit(unit)}]")
        for axes in grid.flat[len(joints) :]:
            axes.set_visible(False)
        marks = [
            grid.flat[0].plot([], [], color=BLUE, linewidth=6, alpha=0.3, label="intermittent")[0],
            grid.flat[0].plot([], [], color=GREEN, linewidth=6, alpha=0.4, label="continuous")[0],
            grid.flat[0].plot([], [], color=BLUE, linestyle="--", label="cold motor")[0],
            grid.flat[0].plot([], [], ".", color="#2c718e", label="the motion, coloured by time")[0],
        ]
        figure.legend(handles=marks, loc="outside upper center", ncols=4)
        return png_bytes(figure)


def _motor_plane(axes: Axes, joint: JointResult, task: JointTask, study: Study) -> str:
    """Regions and samples of one joint; the unit of the torque axis."""
    series, at = joint.series, temperatures(joint, study)
    hot, cold = (regions(joint, task, study, at[name], study.supply.voltage) for name in ("hot", "cold"))
    right, top = view(joint, hot[0])
    unit = shown_unit(top, "N m")
    axes.set_xlim(-float(convert(right, "rad/s", "rpm")), float(convert(right, "rad/s", "rpm")))
    axes.set_ylim(-float(convert(top, "N m", unit)), float(convert(top, "N m", unit)))
    for warm, outline, colour, opacity in zip(hot, cold, (BLUE, GREEN), (0.12, 0.24), strict=True):
        for corners, face, dash in ((warm, (colour, opacity), "-"), (outline, "none", "--")):
            if corners is not None:
                points = np.stack([convert(corners[:, 0], "rad/s", "rpm"), convert(corners[:, 1], "N m", unit)], axis=1)
                axes.add_patch(Polygon(points, facecolor=face, edgecolor=colour, linestyle=dash, linewidth=1.0))
    axes.axhline(0, color=MUTED, linewidth=0.7, zorder=2)
    axes.axvline(0, color=MUTED, linewidth=0.7, zorder=2)
    speed, torque = convert(series.motor_speed, "rad/s", "rpm"), convert(series.motor_torque, "N m", unit)
    axes.scatter(speed, torque, c=series.time, s=6, cmap=TIME_COLOURS, linewidths=0, zorder=4)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    return unit


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
