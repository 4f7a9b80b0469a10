"""Accuracy of simulations over computing time: as a page, as JSON, and as lines for the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivetrain.report.charts.chart import captioned
from drivetrain.report.charts.run_charts import (
    SHOWN,
    auto_charts,
    current_charts,
    effects_charts,
    setting_text,
    solver_charts,
    worst,
)
from drivetrain.report.json_text import job_data, json_text, picked
from drivetrain.report.pages.loops_page import bode_section
from drivetrain.report.pages.sheet import Chip, Row, Section, SheetTable, sheet
from drivetrain.report.pages.views import CSS, chip
from drivetrain.report.quantities import DASH, number, with_unit
from drivetrain.report.words import End, end_of
from drivetrain.simulation.cost_results import AutoChoice, Change, CurrentsCompared, EffectCosts, SolverCosts
from drivetrain.sizing.results import Evaluation


@dataclass(frozen=True, eq=False)
class AccuracyFound:
    """All results about the cost of accuracy."""

    evaluation: Evaluation
    effects: EffectCosts
    auto: AutoChoice
    solvers: SolverCosts
    currents: CurrentsCompared
    current_bandwidth: float  # of the current loops [rad/s], for the Bode plots


def accuracy_report(found: AccuracyFound) -> str:
    end = end_of(found.evaluation.study)
    sections = [
        _effects(found.effects, end), _auto(found.auto, end), _solvers(found.solvers), _currents(found.currents),
        bode_section(found.evaluation, found.current_bandwidth),
    ]  # fmt: skip
    return sheet(found.evaluation.study, "What accuracy costs in time", sections)


def _share(value: float) -> str:
    """A signed share in per cent, with two digits."""
    if math.isnan(value):
        return DASH
    if abs(value) < 5e-6:
        return "0"
    return f"{'+' if value > 0.0 else '−'}{_bound(abs(value))}"


def _effects(found: EffectCosts, end: End) -> Section:
    changes, times = effects_charts(found)
    tip = found.full.tip_deviation
    rows: tuple[Row, ...] = tuple(
        (
            row.label, *(_share(value) for value in worst(row, tip)), chip(row.verdict), f"{row.time:.2f}",
            f"{row.work:.2f}",
        )
        for row in found.rows
    )  # fmt: skip
    headings = ("without", *SHOWN[:4], f"{end.name} deviation", "verdict", "time ×", "work ×")
    lead = (
        f"The full scene takes {with_unit(found.seconds, 's')} a run ({found.solver}) and its verdict is "
        f"{found.full.verdict}; its {end.name} is at most {end.far(tip)} from the command. Without any of these "
        f"effects a run takes {100.0 * found.bare:.0f}\u00a0% of that. Each row leaves one effect out, everywhere: the "
        "largest change at any joint, and by how much longer a run takes with it."
    )
    return Section(
        "Effects", "effects", str(found.full.verdict), CSS[found.full.verdict], (lead,),
        ((changes, "Largest change at any joint (logarithmic)."), (times, "The factor in time when kept.")),
        (SheetTable(headings, rows, "", (1, 2, 3, 4, 5, 7, 8)),),
        ("time × and work ×: with the effect over without it; times are medians of runs in turns on this machine",),
    )  # fmt: skip


def _auto(found: AutoChoice, end: End) -> Section:
    proof, caption = found.proof, "Estimated (grey) and measured (blue) change by what was omitted; red: the tolerance."
    if proof is None:
        word, css = "all kept", "pass"
        lead = "No effect may be omitted within this tolerance."
    else:
        word, css = ("proven", "pass") if proof.proven else ("not proven", "fail")
        lead = (
            f"{len(found.dropped)} of {len(found.effects)} effects are omitted. {proof.why[0].upper()}{proof.why[1:]}; "
            f"verdict {proof.chosen.verdict} without them, {proof.full.verdict} with them. A run takes "
            f"{with_unit(proof.seconds_chosen, 's')} instead of {with_unit(proof.seconds_full, 's')}. Steps of "
            f"{with_unit(proof.steps, 's')}, halved once to find the step's own error; energy audit "
            f"{number(proof.audit, 2)} of the energy that passes."
        )
    text = f"Tolerance {100.0 * found.tolerance:g}\u00a0%, of the {end.name} {end.far(found.tip_tolerance)}."
    notes = tuple(f"{one.kind} of {one.joint} came back: the measured change was too large" for one in found.restored)
    tables = (_judged(found, end), *_measured(found, end))
    return Section(
        "effects: auto", "auto", word, css, (text, lead), captioned(auto_charts(found), caption), tables, notes
    )


def _judged(found: AutoChoice, end: End) -> SheetTable:
    rows: tuple[Row, ...] = tuple(
        (
            one.label, one.choice.joint, "kept" if one.kept else Chip("left out", "pass"),
            *(_bound(value) for value in one.estimate.shares), end.far(one.estimate.tip),
            "yes" if one.valid else "no", one.why,
        )
        for one in found.effects
    )  # fmt: skip
    return SheetTable(
        ("effect", "at", "", *SHOWN[:4], end.name, "valid", "derivation"), rows,
        "Estimates: each effect left out alone, the largest change at any joint", (3, 4, 5, 6, 7),
    )  # fmt: skip


def _bound(value: float) -> str:
    if math.isnan(value) or math.isinf(value):
        return number(value)
    return "0" if value < 5e-6 else f"{number(100.0 * value, 2)}\u00a0%"


def _measured(found: AutoChoice, end: End) -> tuple[SheetTable, ...]:
    if found.proof is None:
        return ()
    rows: list[tuple[str, ...]] = []
    for joint, measured in found.proof.measured.items():
        estimated, step = found.proof.estimate[joint], found.proof.numerical[joint]
        for kind, change in (("estimated", estimated), ("measured", measured), ("error of the step", step)):
            show = _share if kind == "measured" else _bound
            rows.append((joint, kind, *(show(v) for v in change.shares), end.far(abs(change.tip))))
    headings = ("joint", "", *SHOWN[:4], end.name)
    return (SheetTable(headings, tuple(rows), "Estimate against measurement", (2, 3, 4, 5, 6)),)


def _solvers(found: SolverCosts) -> Section:
    rows = tuple(
        (
            run.family, setting_text(run.family, run.setting), _error(run.error, found.settled),
            run.where or DASH, with_unit(run.seconds, "s"), number(float(run.work)), run.note,
        )
        for run in found.runs
    )  # fmt: skip
    lead = (
        f"The same scene with every solver, held against the {found.reference}. Two tolerances of that reference agree "
        f"to {number(found.settled, 2)} in every decision quantity: errors below twice that are not shown."
    )
    headings = ("solver", "step or tolerance", "largest error", "in", "time", "work", "")
    return Section("Solvers", "solvers", lead=(lead,), figures=captioned(solver_charts(found), "Work and precision."),
                   tables=(SheetTable(headings, rows, "", (1, 2, 4, 5)),))  # fmt: skip


def _error(error: float, settled: float) -> str:
    if math.isnan(error):
        return DASH
    return f"below {number(2.0 * settled, 2)}" if error <= 2.0 * settled else number(error, 2)


def _currents(found: CurrentsCompared) -> Section:
    rows = tuple(
        (
            joint, with_unit(road.peaks[0], "A"), with_unit(road.peaks[1], "A"), with_unit(road.rms[0], "A"),
            with_unit(road.rms[1], "A"), _bound(road.apart_moving), _bound(road.apart_resting), road.note,
        )
        for joint, road in found.joints.items()
    )  # fmt: skip
    headings = ("joint", "peak, sizing", "peak, simulated", "RMS, sizing", "RMS, simulated", "apart in motion",
                "apart at rest", "why")  # fmt: skip
    lead = "The currents that sizing computes, and those of a simulation with the same effects and nothing else."
    figures = captioned(current_charts(found), "Currents of sizing and of the simulation.")
    return Section("Inverse against forward", "roads", lead=(lead,), figures=figures,
                   tables=(SheetTable(headings, rows, "", (1, 2, 3, 4, 5, 6)),))  # fmt: skip


def accuracy_lines(found: AccuracyFound) -> list[str]:
    effects, auto, tip = found.effects, found.auto, found.effects.full.tip_deviation
    shown = (*SHOWN[:4], end_of(found.evaluation.study).name)
    lines = [f"full scene: {effects.full.verdict}, {with_unit(effects.seconds, 's')} a run"]
    for row in effects.rows:
        shares = ", ".join(f"{what} {_share(v)}" for what, v in zip(shown, worst(row, tip), strict=True))
        lines.append(f"  without {row.label}: {shares}; {row.verdict}; with it ×{row.time:.2f} time")
    if auto.proof is None:
        lines.append(f"auto at {100.0 * auto.tolerance:g} %: every effect is kept")
    else:
        proof = auto.proof
        lines.append(
            f"auto at {100.0 * auto.tolerance:g} %: {len(auto.dropped)} of {len(auto.effects)} effects left out, "
            f"{'proven' if proof.proven else 'not proven'}: {proof.why}; a run at steps of "
            f"{with_unit(proof.steps, 's')} takes {with_unit(proof.seconds_chosen, 's')} instead of "
            f"{with_unit(proof.seconds_full, 's')}"
        )
    good = [run for run in found.solvers.runs if run.error <= 0.01]
    if good:
        best = min(good, key=lambda run: run.seconds)
        lines.append(
            f"cheapest solver within 1 %: {best.family} at {setting_text(best.family, best.setting)}, "
            f"{with_unit(best.seconds, 's')}"
        )
    for joint, road in found.currents.joints.items():
        lines.append(
            f"  {joint}: RMS current {with_unit(road.rms[0], 'A')} by sizing, {with_unit(road.rms[1], 'A')} simulated"
        )
    return lines


def accuracy_json(found: AccuracyFound) -> str:
    effects, auto, solvers = found.effects, found.auto, found.solvers
    proof = found.auto.proof
    data = {
        "effects": {
            "verdict": effects.full.verdict, **picked(effects, "seconds", "solver", "counters"),
            "tip_deviation": effects.full.tip_deviation,
            "joints": {name: vars(joint) for name, joint in effects.full.joints.items()},
            "left_out": [
                {"effect": row.label, **picked(row, "joints", "verdict", "time", "work"),
                 "changes": _changes(row.changes)}
                for row in effects.rows
            ],
        },
        "auto": {
            **picked(auto, "tolerance", "tip_tolerance"),
            "effects": [
                {"effect": one.label, **picked(one.choice, "kind", "joint"), **picked(one, "kept", "valid", "why"),
                 "estimate": vars(one.estimate)}
                for one in auto.effects
            ],
            "proof": None if proof is None else {
                "proven": proof.proven, "why": proof.why, "step": proof.steps, "audit": proof.audit,
                "verdict": proof.chosen.verdict, "verdict_full": proof.full.verdict,
                "seconds": proof.seconds_chosen, "seconds_full": proof.seconds_full,
                **{name: _changes(getattr(proof, name)) for name in ("estimate", "measured", "numerical")},
            },
        },
        "solvers": {
            **picked(solvers, "reference", "settled"), "runs": [vars(run) for run in solvers.runs],
        },
        "inverse_forward": {
            joint: picked(road, "peaks", "rms", "apart_moving", "apart_resting", "note")
            for joint, road in found.currents.joints.items()
        },
    }  # fmt: skip
    return json_text(job_data(found.evaluation.study, "accuracy") | data)


def _changes(changes: Mapping[str, Change]) -> dict[str, dict[str, float]]:
    return {joint: vars(change) for joint, change in changes.items()}
