"""The commands `accuracy` (what each effect changes and costs in time) and `loops` (design of the control loops)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.chain import chosen, load_chosen, load_joints
from drivetrain.commands.shared import (
    Joints,
    StudyOrResult,
    command,
    folder_for,
    inputs,
    lines,
    positive,
    working,
    write_page,
)


@command
def accuracy(
    study: StudyOrResult,
    tolerance: Annotated[
        str | None, typer.Option(metavar="SHARE", help="For effects: auto, such as 1%.", show_default=False)
    ] = None,
    out: Annotated[Path | None, folder_for("accuracy.html and accuracy.json")] = None,
) -> bool:
    """Measure what each physical effect changes and costs for the study's motion, and which can be omitted."""
    from dataclasses import replace

    from drivetrain.accuracy.auto import COARSE, choose_effects
    from drivetrain.accuracy.costs import effects_cost, solver_cost
    from drivetrain.accuracy.decision import basis_of
    from drivetrain.accuracy.inverse_forward import inverse_against_forward
    from drivetrain.accuracy.scenes import full_scene, without
    from drivetrain.report.pages.accuracy_page import AccuracyFound, accuracy_json, accuracy_lines, accuracy_report
    from drivetrain.simulation.engines.fixed_step import FixedStep
    from drivetrain.sizing.results import Verdict

    share, loaded = inputs(lambda: positive(tolerance, "", "--tolerance"), lambda: load_chosen(study), out=out)
    options = loaded.simulation if share is None else replace(loaded.simulation, tolerance=share)
    result = chosen(loaded, runs=True)
    with working("leaving out one effect after the other") as step:
        full = full_scene(result, options)
        basis = basis_of(full, result)
        effects = effects_cost(full, basis, engine=FixedStep(options.step), progress=step)
    with working("choosing effects") as step:
        auto = choose_effects(
            full, basis, tolerance=options.tolerance, tip_tolerance=options.tip_tolerance,
            step=min(options.step, COARSE), progress=step,
        )  # fmt: skip
    with working("comparing solvers") as step:
        solvers = solver_cost(without(full, ()), basis, progress=step)
        currents = inverse_against_forward(result, scene=full, engine=FixedStep(options.step))
    found = AccuracyFound(result, effects, auto, solvers, currents, options.current_bandwidth)
    with working("drawing"):
        files = {"accuracy.html": accuracy_report(found), "accuracy.json": accuracy_json(found)}
    lines(accuracy_lines(found))
    write_page(loaded, out, files)
    return effects.full.verdict is not Verdict.FAIL


@command
def loops(
    study: StudyOrResult,
    joint: Joints = None,
    out: Annotated[Path | None, folder_for("loops.html and loops.json")] = None,
) -> bool:
    """Design each joint's position, speed and current loop: gains, margins, Bode plots, step responses."""
    from drivetrain.report.pages.loops_page import loops_json, loops_report, loops_sentence
    from drivetrain.sizing.answers.loops import study_loops
    from drivetrain.sizing.as_one import judged_as_one

    [(loaded, names)] = inputs(lambda: load_joints(study, joint), out=out)
    result = judged_as_one(chosen(loaded, runs=True))
    with working("designing the loops"):
        found = study_loops(result, joints=names or None)
        files = {"loops.html": loops_report(loaded, found), "loops.json": loops_json(loaded, found)}
    lines(f"{one.joint}: {loops_sentence(one)}" for one in found.joints)
    lines(f"{name}: {why}" for name, why in found.missing.items())
    write_page(loaded, out, files)
    return all(one.stable for one in found.joints) and not found.missing
