"""The commands around a simulation: what accuracy costs in time, and the loops that close it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.chain import StudyOrResult, chosen, load_chosen
from drivetrain.commands.shared import (
    DOES_NOT_FIT,
    FITS,
    FaultCollector,
    report_faults,
    report_folder,
    say,
    whole_names,
    working,
    writable,
)

app = typer.Typer(rich_markup_mode="rich")


@app.command("accuracy")
def _accuracy(
    study: StudyOrResult,
    tolerance: Annotated[
        str | None, typer.Option(metavar="SHARE", help="For effects: auto, such as 1%.", show_default=False)
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for accuracy.html and accuracy.json.", show_default=False),
    ] = None,
) -> None:
    """Show on the study's own motion what every effect changes and costs, and which a tolerance lets one omit."""
    with report_faults():
        from dataclasses import replace

        from drivetrain.accuracy.auto import choose_effects
        from drivetrain.accuracy.costs import effects_cost, solver_cost
        from drivetrain.accuracy.decision import basis_of
        from drivetrain.accuracy.inverse_forward import inverse_against_forward
        from drivetrain.accuracy.scenes import full_scene, without
        from drivetrain.report.pages.accuracy_page import AccuracyFound, accuracy_json, accuracy_lines, accuracy_report
        from drivetrain.simulation.engines.fixed_step import FixedStep
        from drivetrain.sizing.results import Verdict
        from drivetrain.units import quantity
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            share = None if tolerance is None else quantity(tolerance, "", "--tolerance", above=0.0)
        with faults:
            loaded = load_chosen(study)
        faults.report()
        wishes = loaded.simulation if share is None else replace(loaded.simulation, tolerance=share)
        result = chosen(loaded, runs=True)
        with working("leaving out one effect after the other") as step:
            full = full_scene(result, wishes)
            basis = basis_of(full, result)
            effects = effects_cost(full, basis, engine=FixedStep(wishes.step), progress=step)
        with working("choosing effects") as step:
            auto = choose_effects(
                full, basis, tolerance=wishes.tolerance, tip_tolerance=wishes.tip_tolerance, step=wishes.step,
                progress=step,
            )  # fmt: skip
        with working("comparing solvers") as step:
            solvers = solver_cost(without(full, ()), basis, progress=step)
            roads = inverse_against_forward(result, scene=full, engine=FixedStep(wishes.step))
        found = AccuracyFound(result, effects, auto, solvers, roads, wishes.current_bandwidth)
        with working("drawing"):
            files = {"accuracy.html": accuracy_report(found), "accuracy.json": accuracy_json(found)}
        for line in accuracy_lines(found):
            say(line)
        written = write_files(out or report_folder(loaded.name), files)
        say(f"page: {written['accuracy.html']}")
        raise typer.Exit(DOES_NOT_FIT if effects.full.verdict is Verdict.FAIL else FITS)


@app.command("loops")
def _loops(
    study: StudyOrResult,
    joint: Annotated[list[str] | None, typer.Option(help="Of this joint only; may be given several times.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for loops.html and loops.json.", show_default=False),
    ] = None,
) -> None:
    """Lay out each joint's position, speed and current loop: gains for the amplifier, margins, Bode, step response."""
    with report_faults():
        from drivetrain.report.pages.loops_page import loops_json, loops_report, loops_sentence
        from drivetrain.sizing.answers.loops import study_loops
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            loaded = load_chosen(study)
            names = [task.name for task in loaded.joints]
            joint = whole_names("--joint", "joint of the study", joint, names)
        faults.report()
        result = chosen(loaded, runs=True)
        with working("laying out the loops"):
            found = study_loops(result, joints=joint or None)
            files = {"loops.html": loops_report(loaded, found), "loops.json": loops_json(loaded, found)}
        for one in found.joints:
            say(f"{one.joint}: {loops_sentence(one)}")
        for name, why in found.missing.items():
            say(f"{name}: {why}")
        written = write_files(out or report_folder(loaded.name), files)
        say(f"page: {written['loops.html']}")
        raise typer.Exit(FITS if all(one.stable for one in found.joints) and not found.missing else DOES_NOT_FIT)
