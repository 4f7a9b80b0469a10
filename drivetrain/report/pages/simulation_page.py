"""The page of a simulation of a study's arm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivetrain.report.charts.run_charts import FRICTION, run_charts
from drivetrain.report.pages.sheet import Row, Section, SheetTable, sheet
from drivetrain.report.pages.views import CSS, chip
from drivetrain.report.quantities import DASH, number, printed_unit, with_unit
from drivetrain.report.words import check_sentence, common_unit, end_of, required_text
from drivetrain.simulation.cost_results import Decision, JointDecision
from drivetrain.simulation.recording import UNACCOUNTED, Recording
from drivetrain.sizing.results import Evaluation

WARNINGS = (UNACCOUNTED, "verify", "winding", "runaway")  # events: results not reliable, windings too hot
WORK = {
    "solves": "systems of equations solved",
    "instants": "instants in the recording",
    "unsettled": "steps without convergence",
    "rejected": "steps rejected",
    "rates": "evaluations of the right-hand side",
    "jacobians": "Jacobians",
    "event_values": "evaluations of the event functions",
    "mode_changes": "changes of mode (friction, contact, limits)",
}  # counters of a run in words; the others are words already
MOST_EVENTS = 40  # shown in the table; the recording holds them all


@dataclass(frozen=True, eq=False)
class SimulationFound:
    """A run and its decision quantities."""

    evaluation: Evaluation
    recording: Recording
    decision: Decision | None  # None for an inverse run, or one that was stopped
    plan: str  # printed
    effects: str  # that were in, in words
    limits: Mapping[str, Mapping[str, float]]  # current [A] and voltage [V] by joint


def simulation_report(found: SimulationFound) -> str:
    return sheet(found.evaluation.study, "Simulation", [_run(found), _plan(found)])


def simulation_lines(found: SimulationFound) -> list[str]:
    recording, made = found.recording, found.decision
    work = ", ".join(f"{count} {WORK.get(name, name)}" for name, count in recording.counters.items())
    lines = [f"{found.effects}; {recording.about.get('solver', '')}: {work}"]
    if recording.stopped_by is not None:
        lines.append(f"stopped at {recording.stopped_by.time:.6g} s: {recording.stopped_by.detail}")
    lines += [f"warning: at {one.time:.4g} s: {one.detail}" for one in recording.events if one.name in WARNINGS]
    if recording.verified:
        lines.append(f"run once more, finer: {len(recording.verified)} quantities side by side on the page")
    if made is not None:
        for name, joint in made.joints.items():
            lines.append(
                f"  {name}: current {with_unit(joint.peak_current, 'A')}, RMS {with_unit(joint.rms_current, 'A')}, "
                f"winding {with_unit(joint.winding_temperature, 'C')} when the cycle repeats without end, "
                f"position error at most {_error(recording, name, joint)}"
            )
        end = end_of(found.evaluation.study)
        lines.append(f"{end.name}: at most {end.far(made.tip_deviation)} from the command")
        lines.append(f"the study's checks on this run: {made.verdict}{_closest(made)}")
    return lines


def _error(recording: Recording, name: str, joint: JointDecision) -> str:
    """The largest position error of a joint."""
    return f"{number(1e3 * joint.deviation)}\u00a0m{recording.unit(f'{name}.position')}"


def _closest(made: Decision) -> str:
    """The check of the run with the highest utilisation; empty if none could be made."""
    used = [(check.utilisation, name, check) for name, checks in made.checks.items() for check in checks
            if check.utilisation is not None]  # fmt: skip
    if not used:
        return ""
    _, name, check = max(used, key=lambda one: one[0])
    return f"; closest to a limit: {name}: {check_sentence(check)}"


def _run(found: SimulationFound) -> Section:
    recording, joints = found.recording, list(found.evaluation.joints)
    made = found.decision
    word, css = ("", "") if made is None else (str(made.verdict), CSS[made.verdict])
    if recording.stopped_by is not None:
        word, css = "stopped", "fail"
    work = ", ".join(f"{number(float(count))} {WORK.get(name, name)}" for name, count in recording.counters.items())
    lead = [f"{found.effects[0].upper()}{found.effects[1:]}. {recording.about.get('solver', '')}: {work}."]
    if recording.stopped_by is not None:
        lead.append(f"Stopped at {recording.stopped_by.time:.6g} s: {recording.stopped_by.detail}.")
    lead += [f"Warning, at {one.time:.4g} s: {one.detail}." for one in recording.events if one.name in WARNINGS]
    if made is not None:
        end = end_of(found.evaluation.study)
        lead.append(f"The {end.name} is at most {end.far(made.tip_deviation)} from the command.")
    tables = [] if made is None else [_decided(made, recording), _checks(made)]
    if recording.verified:
        compared = tuple(
            (name, number(a, 5), number(b, 5), number(a - b, 2)) for name, (a, b) in recording.verified.items()
        )
        caption = "Once more at half the step or a tenth of the tolerance [A, N m, K, rad, m]"
        tables.append(SheetTable(("decides", "this run", "finer", "difference"), compared, caption, (1, 2, 3)))
    events = [e for e in recording.events if e.name not in FRICTION][:MOST_EVENTS]
    if events:
        rows = tuple((f"{event.time:.4f} s", event.name, event.detail) for event in events)
        tables.append(SheetTable(("time", "event", ""), rows, "Events", (0,)))
    return Section("The run", "run", word, css, tuple(lead), run_charts(recording, joints, found.limits), tuple(tables))


def _decided(made: Decision, recording: Recording) -> SheetTable:
    slides = {name for name in made.joints if recording.unit(f"{name}.position") == "m"}
    rows = tuple(
        (
            name, with_unit(joint.peak_current, "A"), with_unit(joint.rms_current, "A"),
            with_unit(joint.rms_torque, "N" if name in slides else "N m"),
            DASH if math.isnan(joint.winding_temperature) else with_unit(joint.winding_temperature, "C"),
            _error(recording, name, joint),
        )
        for name, joint in made.joints.items()
    )  # fmt: skip
    headings = (
        "joint",
        "peak current",
        "RMS current",
        "RMS gear torque",
        "winding, cycle repeated",
        "largest position error",
    )
    return SheetTable(headings, rows, "Joint by joint", (1, 2, 3, 4, 5))


def _checks(made: Decision) -> SheetTable:
    rows: list[Row] = []
    for name, checks in made.checks.items():
        for check in checks:
            if check.utilisation is not None:
                shown = common_unit(check)
                rows.append((
                    name, check.name, required_text(check, shown, printed_unit(shown)),
                    with_unit(check.available, check.unit, shown=shown),
                    f"{100.0 * check.utilisation:.0f}\u00a0%", chip(check.verdict),
                ))  # fmt: skip
    return SheetTable(("joint", "check", "required", "available", "used", ""), tuple(rows),
                      "The study's checks on what was simulated", (2, 3, 4))  # fmt: skip


def _plan(found: SimulationFound) -> Section:
    """The plan of the run without its signals, which would fill pages."""
    rows, group = [], ""
    for line in found.plan.splitlines()[1:]:
        if line and not line.startswith(" "):
            group = line
        elif line.strip() and group not in ("Signals", "States"):
            first, _, second = line.strip().partition("  ")
            rows.append((group, first, second.strip()))
    return Section("Plan", "plan", lead=(found.plan.splitlines()[0],),
                   tables=(SheetTable(("", "", ""), tuple(rows)),))  # fmt: skip
