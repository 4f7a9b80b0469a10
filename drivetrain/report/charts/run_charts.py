"""Charts of control loops, of recordings of simulations, and of accuracy over computing time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.loops.loop_design import LoopDesign
from drivetrain.report.charts.chart import BLUE, GREEN, JOINT_COLOURS, ORANGE, SKY, VERMILLION, Chart, Mark, captioned
from drivetrain.report.quantities import convert, number, printed_unit, scaled, with_unit
from drivetrain.simulation.cost_results import (
    AutoChoice,
    Change,
    CurrentsCompared,
    EffectCost,
    EffectCosts,
    SolverCosts,
)
from drivetrain.simulation.recording import Recording
from drivetrain.sizing.answers.loops import JointLoops

TURN = 2.0 * math.pi
ENERGIES = ("kinetic_energy", "potential_energy", "work")
MOST_EVENTS = 12  # more lines than these hide the curves
LOWEST, HIGHEST = -60.0, 60.0  # dB drawn
STORED = ("spring_energy", "magnetic_energy", "kinetic_energy", "potential_energy", "cogging_energy", "bus_energy")
ROUNDING = 1e-6  # smallest half height of the energy audit's chart, over the largest energy
FRICTION = {
    "stick": ("sticks", "ink", "circle"), "breakaway": ("breaks away", ORANGE, "triangle"),
    "reversal": ("reverses", BLUE, "diamond"),
}  # fmt: skip
SHOWN = ("peak current", "RMS current", "RMS torque", "winding temperature", "tip")
COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, "muted")
LEAST = 1e-5  # share below which a change is not drawn
LEAST_HEATING = 1.0  # smallest span of a temperature axis [K]


def bode_charts(joint: str, design: LoopDesign, light: LoopDesign | None = None) -> tuple[Chart, Chart]:
    """Gain and phase of the open speed and position loop; dashed: with the lightest load."""
    resonance = design.resonance if math.isfinite(design.resonance) else 0.0
    top = max(10.0 * design.speed_bandwidth, 3.0 * resonance, 2.0 * design.critical_frequency)
    shown = (design.frequencies > 0.02 * design.position_bandwidth) & (design.frequencies < top)
    at = design.frequencies[shown] / TURN
    gain: list[Mark] = [Mark("rule", y=[0.0], colour="muted")]
    phase: list[Mark] = [Mark("rule", y=[-180.0], colour="muted")]
    rows = (
        ("speed", design.speed_loop, design.speed_phase_margin, design.speed_gain_margin, BLUE),
        ("position", design.position_loop, design.position_phase_margin, design.position_gain_margin, ORANGE),
    )
    for name, loop, lag, factor, colour in rows:
        decibels, turned = _decibels(loop[shown]), _degrees(loop[shown])
        limit = f"{20.0 * math.log10(factor):.1f} dB" if math.isfinite(factor) else "without limit"
        label = f"{name} loop: phase margin {math.degrees(lag):.0f}°, gain margin {limit}"
        crossings = np.flatnonzero(np.diff(np.signbit(decibels)))
        gain.append(Mark("line", at, decibels, label=label, colour=colour))
        phase.append(Mark("line", at, turned, label=f"{name} loop", colour=colour))
        gain.append(Mark("points", at[crossings], np.zeros(len(crossings)), colour=colour, size=7))
        phase.append(Mark("points", at[crossings], turned[crossings], colour=colour, size=7))
    if light is not None:
        own = (light.frequencies / TURN >= at[0]) & (light.frequencies / TURN <= at[-1])
        for name, loop, colour in (("speed", light.speed_loop, BLUE), ("position", light.position_loop, ORANGE)):
            gain.append(Mark("line", light.frequencies[own] / TURN, _decibels(loop[own]), colour=colour, size=0.9,
                             dash=True, label=f"{name} loop, lightest load"))  # fmt: skip
    for value, text in ((design.anti_resonance, "anti-resonance"), (design.resonance, "resonance")):
        if value / TURN < at[-1]:
            label = f"{text} {number(value / TURN)} Hz"
            gain.append(Mark("rule", x=[value / TURN], label=label, colour="muted", dash=True))
            phase.append(Mark("rule", x=[value / TURN], colour="muted", dash=True))
    ends, link = (float(at[0]), float(at[-1])), f"bode-{joint}"
    return (
        Chart(f"open loops of {joint}: gain", "frequency [Hz]", "gain [dB]", gain, ends, (LOWEST, HIGHEST), log_x=True,
              height=280, joined=link, title=joint),
        Chart(f"open loops of {joint}: phase", "frequency [Hz]", "phase [°]", phase, ends, (-270.0, 90.0), log_x=True,
              height=200, joined=link),
    )  # fmt: skip


def step_chart(loops: JointLoops) -> Chart:
    kind: Literal["step", "line"] = "step" if loops.timing.period > 0.0 else "line"
    curves = [(loops.step, "heaviest load", ORANGE, False)]
    if loops.light is not loops.design:
        curves.append((loops.light_step, "lightest load", ORANGE, True))
    if loops.notch_step is not None:
        curves.append((loops.notch_step, "heaviest load, gains with a notch", GREEN, False))
    lowest, highest = (float(end([end(values) for values, *_ in curves])) for end in (np.min, np.max))
    marks = [Mark("rule", y=[1.0], colour="muted")]
    marks += [Mark(kind, loops.time, values, label=text, colour=c, dash=dash) for values, text, c, dash in curves]
    return Chart(f"step responses of {loops.joint}", "time [s]", "angle of the motor over the step [-]", marks,
                 (0.0, float(loops.time[-1])), (max(-1.0, min(-0.05, 1.1 * lowest)), min(3.0, max(1.2, 1.1 * highest))),
                 height=240)  # fmt: skip


def _decibels(response: Array) -> Array:
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(response), 1e-12)))


def _degrees(response: Array) -> Array:
    turned = np.degrees(np.unwrap(np.angle(response)))
    return np.asarray(turned + 360.0 * np.round((-90.0 - turned[0]) / 360.0))


def run_charts(
    recording: Recording, joints: Sequence[str], limits: Mapping[str, Mapping[str, float]]
) -> tuple[tuple[Chart, str], ...]:
    """Charts of a recording with captions; ``limits``: known ``current`` [A] and ``voltage`` [V] by joint."""
    series = {
        what: {joint: recording[f"{joint}.{what}"] for joint in joints if f"{joint}.{what}" in recording.series}
        for what in ("position", "current", "voltage", "winding_temperature")
    }
    errors = {
        joint: values - recording[f"{joint}.command_position"]
        for joint, values in series["position"].items() if f"{joint}.command_position" in recording.series
    }  # fmt: skip
    units = {joint: recording.unit(f"{joint}.position") for joint in series["position"]}
    drawn = []
    for unit in dict.fromkeys(units.values()):
        own = {joint: values for joint, values in series["position"].items() if units[joint] == unit}
        whose = f" of {', '.join(own)}" if len(own) < len(units) else ""
        drawn.append((_lines(recording, own, "position", unit), f"Positions{whose}."))
    for unit in dict.fromkeys(units[joint] for joint in errors):
        own = {joint: values for joint, values in errors.items() if units[joint] == unit}
        small = 1e3 if max(float(np.abs(values).max()) for values in own.values()) > 1e-4 else 1e6
        shown = f"{'m' if small == 1e3 else 'µ'}{unit}"
        away = {joint: small * values for joint, values in own.items()}
        whose = f" of {', '.join(own)}" if len(own) < len(errors) else ""
        drawn.append((_lines(recording, away, "position error", shown), f"Position error{whose}."))
    for what, si in (("current", "A"), ("voltage", "V")):
        if series[what]:
            chart = _lines(recording, series[what], what, si, {j: limits.get(j, {}).get(what) for j in joints})
            drawn.append((chart, _limits_text(what, si, series[what], limits)))
    if recording.kept:
        if series["winding_temperature"]:
            heat = _lines(recording, series["winding_temperature"], "winding", "C")
            drawn.append((replace(heat, y_range=_at_least(LEAST_HEATING, heat)), "Winding temperatures."))
        drawn.append((friction_chart(recording, joints), "Friction: where a joint sticks, breaks away or reverses."))
        caption = "Energy put in (electrical), lost and stored; what is not accounted for."
        drawn += captioned(energy_charts(recording), caption)
    return tuple(drawn)


def _at_least(span: float, chart: Chart) -> tuple[float, ...]:
    """Ends of the vertical axis for curves that change by less than ``span``; empty: those of the curves."""
    values = np.concatenate([mark.y for mark in chart.marks])
    middle = 0.5 * float(values.min() + values.max())
    return (middle - 0.5 * span, middle + 0.5 * span) if np.ptp(values) < span else ()


def _limits_text(what: str, unit: str, curves: Mapping[str, Array], limits: Mapping[str, Mapping[str, float]]) -> str:
    parts = [
        f"{joint} {100.0 * float(np.abs(values).max()) / limits[joint][what]:.0f}\u00a0% of "
        f"{with_unit(limits[joint][what], unit)}"
        for joint, values in curves.items() if limits.get(joint, {}).get(what)
    ]  # fmt: skip
    return f"{what.capitalize()}s" + (f"; at most {', '.join(parts)}." if parts else ".")


def _lines(
    recording: Recording, curves: Mapping[str, Array], what: str, unit: str,
    limits: Mapping[str, float | None] | None = None,
) -> Chart:  # fmt: skip
    """Chart with one line per joint in a common unit, and the limits that are reached."""
    known = unit in ("rad", "m", "A", "V", "C")
    shown = scaled(np.concatenate([np.ravel(values) for values in curves.values()]), unit)[1] if known else unit
    marks = []
    order = list(dict.fromkeys(name.partition(".")[0] for name in recording.series if "." in name))
    for joint, values in curves.items():
        colour = JOINT_COLOURS[order.index(joint) % len(JOINT_COLOURS)]
        own = convert(values, unit, shown) if known else values
        marks.append(Mark("line", recording.time, own, label=joint, colour=colour))
        limit = (limits or {}).get(joint)
        if limit and limit < 1.05 * float(np.abs(values).max()):
            label = f"limit of {joint} {with_unit(limit, unit)}"
            for side in (limit, -limit):
                if side * float(values.max() if side > 0.0 else values.min()) > 0.25 * limit**2:
                    at = [float(convert(side, unit, shown))]
                    marks.append(Mark("rule", y=at, label=label, colour=colour, dash=True))
                    label = ""
    return _over_time(recording, f"{what} over time", f"{what} [{printed_unit(shown)}]", marks)


def _over_time(recording: Recording, label: str, y: str, marks: list[Mark], height: int = 230,
               rows: Sequence[str] = (), y_range: Sequence[float] = ()) -> Chart:  # fmt: skip
    if recording.stopped_by is not None:
        marks = [*marks, Mark("rule", x=[recording.stopped_by.time], label="stopped", colour=VERMILLION)]
    ends = (float(recording.time[0]), float(recording.time[-1]))
    return Chart(label, "time [s]", y, marks, ends, y_range, rows=rows, height=height, joined="run")


def recording_charts(recording: Recording) -> list[Chart]:
    """All series of a recording: one chart per kind of quantity and unit, joints by colour, energies together."""
    groups: dict[tuple[str, str], dict[str, Array]] = {}
    for part in ("position", "speed", "torque"):
        for joint, values in recording.ending(part).items():
            groups.setdefault((part, recording.unit(f"{joint}.{part}")), {})[joint] = values
    for name, (unit, values) in recording.series.items():
        if "." not in name:
            label = name.replace("_", " ")
            groups.setdefault(("energy" if name in ENERGIES else label, unit), {})[label] = values
    charts: list[Chart] = []
    for (title, unit), found in groups.items():
        curves = {label: values for label, values in found.items() if np.any(values)}
        if not curves:
            continue
        marks = [Mark("rule", x=[event.time], colour="muted", size=0.6) for event in recording.events[:MOST_EVENTS]]
        named = any(list(curves) == [one.label for one in chart.marks if one.kind == "line"] for chart in charts)
        marks += [
            Mark("line", recording.time, values, label="" if named or len(curves) == 1 else label,
                 colour=JOINT_COLOURS[i % len(JOINT_COLOURS)])
            for i, (label, values) in enumerate(curves.items())
        ]  # fmt: skip
        charts.append(_over_time(recording, f"{title} over time", f"{title} [{printed_unit(unit)}]", marks, 160))
    if charts and recording.stopped_by is not None:
        stopped = f"stopped after {recording.stopped_by.time:.6g} s: {recording.stopped_by.name}"
        charts[0] = replace(charts[0], title=stopped)
    return charts


def friction_chart(recording: Recording, joints: Sequence[str]) -> Chart:
    """Instants at which friction sticks, breaks away and reverses."""
    marks = []
    for kind, (words, colour, marker) in FRICTION.items():
        at = [
            (event.time, row) for row, joint in enumerate(joints) for event in recording.events
            if event.name == kind and event.detail.split(":")[0].removeprefix("motor of ") == joint
        ]  # fmt: skip
        marks.append(Mark("points", [x for x, _ in at], [y for _, y in at], label=words, colour=colour, size=9,
                          marker=marker))  # fmt: skip
    return _over_time(recording, "events of friction", "", marks, 80 + 26 * len(joints), list(joints))


def energy_charts(recording: Recording) -> tuple[Chart, ...]:
    """Energies over time: supplied, lost and stored, and the part that is not accounted for."""
    sums: dict[str, Array] = {}
    for key, series in recording.series.items():
        kind = key.rpartition(".")[2]
        if "." in key and kind.endswith("_energy") and kind not in STORED:
            sums[kind] = sums.get(kind, np.zeros(len(recording.time))) + series.values
    drawn = {kind: values for kind, values in sums.items() if np.abs(values).max() > 1e-9}
    marks = [
        Mark("line", recording.time, values, label=kind.removesuffix("_energy").replace("_", " "),
             colour=JOINT_COLOURS[i % len(JOINT_COLOURS)])
        for i, (kind, values) in enumerate(drawn.items())
    ]  # fmt: skip
    if "stored_energy" in recording.series:
        stored = recording["stored_energy"]
        marks.append(Mark("line", recording.time, stored - stored[0], label="stored", colour="ink", dash=True))
    charts = [_over_time(recording, "energies over time", "energy [J]", marks, 280)]
    if "energy_error" in recording.series:
        error, passed = recording["energy_error"], max((float(np.abs(v).max()) for v in drawn.values()), default=0.0)
        reach = ROUNDING * passed if np.abs(error).max() < ROUNDING * passed else 0.0
        values, unit = scaled(error, "J", reach)
        side = float(convert(reach, "J", unit))  # rounding errors are not magnified
        audit = [Mark("line", recording.time, values, colour=VERMILLION)]
        charts.append(_over_time(recording, "energy not accounted for", f"not accounted for [{printed_unit(unit)}]",
                                 audit, 180, (), (-side, side) if reach else ()))  # fmt: skip
    return tuple(charts)


def worst(row: EffectCost, tip: float) -> tuple[float, ...]:
    """Largest signed change of each quantity over all joints [-], NaN if unknown; ``tip``: reference of the tip [m]."""
    columns = zip(*(_shares(change, tip) for change in row.changes.values()), strict=True)
    known = ([value for value in column if not math.isnan(value)] for column in columns)
    return tuple(max(column, key=abs, default=math.nan) for column in known)


def _shares(change: Change, tip: float) -> tuple[float, ...]:
    return *change.shares, change.tip / tip if tip > 0.0 else math.nan


def effects_charts(found: EffectCosts) -> tuple[Chart, Chart]:
    rows, tip = [row.label for row in found.rows], found.full.tip_deviation
    changes = np.array([worst(row, tip) for row in found.rows]).reshape(len(rows), len(SHOWN))
    height, marks = 0.8 / len(SHOWN), [Mark("rule", x=[1.0], colour="ink", dash=True, label="1 %")]
    top = 160.0 * max(1.0, float(np.nanmax(np.abs(changes), initial=0.0)))
    for k, (what, colour) in enumerate(zip(SHOWN, COLOURS, strict=True)):
        bars = [(i, 100.0 * abs(share)) for i, share in enumerate(changes[:, k]) if abs(share) > LEAST]
        at = [i - 0.4 + (k + 0.5) * height for i, _ in bars]
        marks.append(Mark("bars", [100.0 * LEAST] * len(at), at, to=[share for _, share in bars], label=what,
                          colour=colour, size=0.9 * height))  # fmt: skip
    times = [row.time for row in found.rows]
    cost = [Mark("bars", [1.0] * len(rows), range(len(rows)), to=times, colour="muted", size=0.5)]
    for row, time in enumerate(times):
        cost.append(Mark("text", [max(time, 1.0)], [row], label=f"×{time:.2f}", colour="ink"))
    tall = 90 + 48 * max(len(rows), 1)
    return (
        Chart("largest change when an effect is left out", "change when left out [%]", "", marks,
              (100.0 * LEAST, top), log_x=True, rows=rows, height=tall),
        Chart("factor in time of every effect", "time with it over time without [-]", "", cost,
              (min([0.9, *times]) - 0.05, 1.15 * max([1.3, *times])), rows=rows, height=60 + 24 * max(len(rows), 1)),
    )  # fmt: skip


def solver_charts(found: SolverCosts) -> tuple[Chart, Chart]:
    floor, charts = max(2.0 * found.settled, 1e-12), []
    works = (
        ("seconds", "processor time of a run [s]"),
        ("work", "right-hand sides; of the fixed step: systems solved"),
    )
    for of, label in works:
        marks = [Mark("rule", y=[floor], colour="muted", dash=True, label="limit of the reference"),
                 Mark("rule", y=[0.01], colour="ink", dash=True, label="1 %")]  # fmt: skip
        for i, family in enumerate(dict.fromkeys(run.family for run in found.runs)):
            runs = [run for run in found.runs if run.family == family and run.error > 2.0 * found.settled]
            if not runs:
                continue
            x, y = [float(getattr(run, of)) for run in runs], [run.error for run in runs]
            tips = [f"{family}, {setting_text(family, run.setting)}" for run in runs]
            colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
            marks += [
                Mark("line", x, y, label=family, colour=colour),
                Mark("points", x, y, colour=colour, size=7, tips=tips),
            ]
        charts.append(Chart(f"error over {label}", label, "largest error of a decision quantity [-]", marks, log_x=True,
                            log_y=True, height=320))  # fmt: skip
    return charts[0], charts[1]


def current_charts(found: CurrentsCompared) -> tuple[Chart, ...]:
    return tuple(
        Chart(f"{joint}: current by sizing and by simulation", "time [s]", "current [A]",
              [Mark("line", road.time, road.forward, label="simulated", colour=SKY, size=3),
               Mark("line", road.time, road.inverse, label="by sizing", colour="ink", size=1)],
              (float(road.time[0]), float(road.time[-1])), height=190, joined="roads", title=joint)
        for joint, road in found.joints.items()
    )  # fmt: skip


def auto_charts(found: AutoChoice) -> tuple[Chart, ...]:
    """Estimated and measured change of each joint; empty if no effect was left out."""
    if found.proof is None:
        return ()
    proof, scale = found.proof, found.tip_tolerance / found.tolerance
    joints, charts = list(proof.measured), []
    for k, what in enumerate(SHOWN):
        marks = []
        for changes, label, colour, size in (
            (proof.estimate, "estimated", "faint", 0.62),
            (proof.measured, "measured", BLUE, 0.3),
        ):
            ends = [100.0 * abs(_shares(changes[joint], scale)[k]) for joint in joints]
            start, rows = [0.0] * len(joints), range(len(joints))
            marks.append(Mark("bars", start, rows, to=ends, label=label, colour=colour, size=size))
        if not any(end > 0.0 for mark in marks for end in mark.to):  # the tip of an arm belongs to no joint
            continue
        marks.append(Mark("rule", x=[100.0 * found.tolerance], colour=VERMILLION, label="tolerance"))
        charts.append(Chart(f"{what}: estimated and measured change", f"change of the {what} [%]", "", marks,
                            (0.0, 125.0 * found.tolerance), rows=joints, height=90 + 24 * len(joints)))  # fmt: skip
    return tuple(charts)


def setting_text(family: str, setting: float) -> str:
    """A solver's step [s] or tolerance as text."""
    fixed = "step" in family or "RK4" in family
    return f"{1e3 * setting:g}\u00a0m{printed_unit('s')}" if fixed else f"{setting:.0e}".replace("e-0", "e−")
