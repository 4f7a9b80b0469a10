"""Pictures of a run: where the joints went, what flowed, how warm it became, what friction did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.report.colours import BLUE, FAINT, INK, JOINT_COLOURS, MUTED, ORANGE, VERMILLION
from drivetrain.report.quantities import convert, printed_unit, scaled, with_unit
from drivetrain.report.svg import house_style
from drivetrain.simulation.recording import Recording

STORED = ("spring_energy", "magnetic_energy", "kinetic_energy", "potential_energy", "cogging_energy", "bus_energy")
ROUNDING = 1e-6  # of the largest energy: an audit below it is drawn on this scale
FRICTION = ("stick", "breakaway", "reversal")


def figure_positions(recording: Recording, joints: Sequence[str], *, name: str = "positions") -> Figure:
    """Positions and their errors."""
    with house_style(name):
        figure = Figure(figsize=(9.2, 4.6))
        above, below = figure.subplots(2, 1, sharex=True)
        _lines(above, recording, {joint: recording[f"{joint}.position"] for joint in joints}, "position", "rad")
        errors = {
            joint: recording[f"{joint}.position"] - recording[f"{joint}.command_position"]
            for joint in joints
            if f"{joint}.command_position" in recording.series
        }
        if errors:
            largest = max(float(np.abs(values).max()) for values in errors.values())
            scale, unit = (1e3, "mrad") if largest > 1e-4 else (1e6, "µrad")
            for i, (_, values) in enumerate(errors.items()):
                below.plot(recording.time, scale * values, color=JOINT_COLOURS[i % len(JOINT_COLOURS)])
            below.set_ylabel(f"from the command [{unit}]")
        _finish(figure, (above, below), recording)
    return figure


def figure_electrics(
    recording: Recording, joints: Sequence[str], limits: Mapping[str, Mapping[str, float]], *, name: str = "electrics"
) -> Figure:
    """Current and voltage of every joint, with their limits.

    Args:
        limits: ``current`` [A] and ``voltage`` [V] by joint; those that are known.
    """
    shown = [joint for joint in joints if f"{joint}.current" in recording.series]
    with house_style(name):
        figure = Figure(figsize=(9.2, 0.8 + 1.3 * max(1, len(shown))))
        rows = figure.subplots(max(1, len(shown)), 2, sharex=True, squeeze=False)
        for row, joint in zip(rows, shown, strict=False):
            for axes, what, unit, colour in zip(row, ("current", "voltage"), ("A", "V"), (BLUE, ORANGE), strict=True):
                key = f"{joint}.{what}"
                if key not in recording.series:
                    continue
                limit = limits.get(joint, {}).get(what)
                values, shown_unit = scaled(recording[key], unit)
                axes.plot(recording.time, values, color=colour, linewidth=1.0)
                axes.set_ylabel(f"{what} [{printed_unit(shown_unit)}]")
                _limit(axes, recording[key], values, limit, unit)
            row[0].set_title(joint)
        for axes in rows[-1]:
            axes.set_xlabel("time [s]")
            axes.set_xlim(float(recording.time[0]), float(recording.time[-1]))
    return figure


def _limit(axes: Axes, own: Array, shown: Array, limit: float | None, unit: str) -> None:
    """A limit with its value where the curve comes near it; how far off it is where it does not."""
    if limit is None:
        return
    at = int(np.argmax(np.abs(own)))
    largest = abs(float(own[at]))
    if largest == 0.0:
        return
    drawn = limit * abs(float(shown[at])) / largest
    said, colour = f"at most {100.0 * largest / limit:.0f} % of the limit", MUTED
    if limit < 1.6 * largest:
        for side in (drawn, -drawn):
            if (side > 0.0 and float(own.max()) > 0.5 * limit) or (side < 0.0 and float(own.min()) < -0.5 * limit):
                axes.axhline(side, color=VERMILLION, linewidth=1.0)
        said, colour = f"limit {with_unit(limit, unit)}", VERMILLION
    axes.annotate(
        said, (1.0, 1.0), (-2, 2), ha="right", va="bottom", xycoords="axes fraction", textcoords="offset points",
        fontsize=7, color=colour,
    )  # fmt: skip


def figure_heat_and_friction(recording: Recording, joints: Sequence[str], *, name: str = "heat") -> Figure:
    """Winding temperatures, and where friction holds."""
    warm = {j: recording[f"{j}.winding_temperature"] for j in joints if f"{j}.winding_temperature" in recording.series}
    told = [event for event in recording.events if event.name in FRICTION]
    with house_style(name):
        rows = bool(warm) + 1
        figure = Figure(figsize=(9.2, 0.7 + 1.9 * rows))
        column = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        if warm:
            _lines(column[0], recording, warm, "winding", "C")
        for i, joint in enumerate(joints):
            colours = {"stick": INK, "breakaway": ORANGE, "reversal": BLUE}
            for kind, colour in colours.items():
                at = [
                    e.time for e in told if e.name == kind and e.detail.split(":")[0].removeprefix("motor of ") == joint
                ]
                column[-1].plot(at, [i] * len(at), "|", color=colour, markersize=9, label=kind if i == 0 else None)
        column[-1].set_yticks(range(len(joints)), [joint for joint in joints])
        column[-1].set_ylim(len(joints) - 0.4, -0.6)
        column[-1].set_title("friction: where it begins to hold (dark), lets go (orange), turns round (blue)")
        _finish(figure, list(column), recording)
    return figure


def figure_energy(recording: Recording, *, name: str = "energy") -> Figure:
    """Where the energy went, and how much of it is not accounted for."""
    sums: dict[str, Array] = {}
    for key, series in recording.series.items():
        kind = key.rpartition(".")[2]
        if "." in key and kind.endswith("_energy") and kind not in STORED:
            sums[kind] = sums.get(kind, np.zeros(len(recording.time))) + series.values
    with house_style(name):
        figure = Figure(figsize=(9.2, 3.9))
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        drawn = {kind: values for kind, values in sums.items() if np.abs(values).max() > 1e-9}
        for i, (kind, values) in enumerate(drawn.items()):
            label = kind.removesuffix("_energy").replace("_", " ")
            above.plot(recording.time, values, color=JOINT_COLOURS[i % len(JOINT_COLOURS)], label=label)
        if "stored_energy" in recording.series:
            stored = recording["stored_energy"]
            above.plot(recording.time, stored - stored[0], color=INK, linewidth=0.9, linestyle="--", label="stored")
        above.set_ylabel("energy [J]")
        above.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.2)
        if "energy_error" in recording.series:
            error, passed = recording["energy_error"], max((np.abs(one).max() for one in drawn.values()), default=0.0)
            reach = ROUNDING * passed if np.abs(error).max() < ROUNDING * passed else 0.0
            values, unit = scaled(error, "J", reach)
            below.plot(recording.time, values, color=VERMILLION)
            if reach:
                side = float(convert(reach, "J", unit))  # rounding magnified tells nothing
                below.set_ylim(-side, side)
            below.set_ylabel(f"not accounted\nfor [{printed_unit(unit)}]")
        _finish(figure, (above, below), recording)
    return figure


def _lines(axes: Axes, recording: Recording, curves: Mapping[str, Array], what: str, unit: str) -> None:
    """One line a joint, in a unit that people say."""
    largest = np.concatenate([np.ravel(values) for values in curves.values()])
    _, shown = scaled(largest, unit)
    for i, (joint, values) in enumerate(curves.items()):
        own, _ = (values, unit) if unit == "C" else scaled(values, unit)
        axes.plot(recording.time, own, color=JOINT_COLOURS[i % len(JOINT_COLOURS)], label=joint)
    axes.set_ylabel(f"{what} [{printed_unit(shown)}]")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.2)


def _finish(figure: Figure, column: Sequence[Axes], recording: Recording) -> None:
    for axes in column:
        axes.grid(True, color=FAINT)
        if recording.stopped_by is not None:
            axes.axvline(recording.stopped_by.time, color=VERMILLION, linewidth=1.4)
    column[-1].set_xlabel("time [s]")
    column[-1].set_xlim(float(recording.time[0]), float(recording.time[-1]))
    figure.align_ylabels(list(column))
