"""The commands that answer a question: why-not, explain, curve, front, family, ratio, free-ratio, fastest."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.chain import chosen, load_chosen, load_joints
from drivetrain.commands.shared import (
    Joints,
    StudyFile,
    StudyOrResult,
    command,
    folder_for,
    inputs,
    lines,
    positive,
    refuse,
    report_folder,
    say,
    working,
    write_page,
)


@command
def why_not(
    study: StudyFile,
    joint: Annotated[str | None, typer.Option(help="Only at this joint. Default: every joint.")] = None,
    motor: Annotated[str | None, typer.Option(help="Key or part number of a motor.")] = None,
    gear: Annotated[str | None, typer.Option(help="Key or part number of a gear; none: a direct drive.")] = None,
    out: Annotated[Path | None, folder_for("why_not.html")] = None,
) -> bool:
    """Explain why a motor, a gear or a pair was not chosen, what would let it pass, and what it would cost."""
    from drivetrain.report.pages.why_not_page import why_not_lines, why_not_report
    from drivetrain.sizing.answers.why_not import why_not
    from drivetrain.study.read import load_study

    [loaded] = inputs(lambda: load_study(study), out=out)
    with working("searching for what would let it pass"):
        found = why_not(loaded, joint, motor, gear)
        page = why_not_report(found)
    for answer in found.answers:
        first, *rest = why_not_lines(found, answer)
        lines([first, *(f"  {line}" for line in rest)])
    write_page(loaded, out, {"why_not.html": page})
    return found.holds


@command
def explain(
    study: StudyOrResult,
    joint: Annotated[
        list[str] | None, typer.Option(help="Checks of this joint, or of the supply; may be repeated.")
    ] = None,
    check: Annotated[list[str] | None, typer.Option(help="This check only; may be repeated.")] = None,
) -> bool:
    """Explain each check: formula, numbers, instant, limit and its source."""
    from drivetrain.errors import whole_names
    from drivetrain.report.verdict_lines import explanation
    from drivetrain.sizing.judge.checks import REQUIREMENTS

    known = [row.name for row in REQUIREMENTS]
    checks, (loaded, names) = inputs(
        lambda: whole_names("--check", "check", check or (), known),
        lambda: load_joints(study, joint, "supply", "arm"),
    )
    found = chosen(loaded)
    lines(explanation(found, tuple(names), tuple(checks)))
    return found.feasible


@command
def curve(
    study: StudyFile,
    vary: Annotated[
        str, typer.Option(help="Quantity to vary: payload, cycle_time, voltage, ambient or force.")
    ] = "payload",
    low: Annotated[str, typer.Option("--from", help="Smallest value, with its unit.")] = "0 kg",
    high: Annotated[str, typer.Option("--to", help="Largest value, with its unit.")] = "10 kg",
    points: Annotated[int, typer.Option(help="Initial number of values at which sets are selected.")] = 17,
    payload: Annotated[str | None, typer.Option(help="Payload whose mass is varied. Default: the heaviest.")] = None,
    out: Annotated[Path | None, folder_for("curve.html")] = None,
) -> bool:
    """Compute the best drives as a function of payload, force, cycle time, supply voltage or ambient temperature."""
    from drivetrain.report.pages.trade_off_pages import curve_lines, curve_report, curve_sentence
    from drivetrain.sizing.answers.curve import optimum_curve, varied
    from drivetrain.study.read import load_study
    from drivetrain.units import quantity

    def span() -> list[float]:
        unit = varied(vary).unit
        return inputs(lambda: quantity(low, unit, "--from"), lambda: quantity(high, unit, "--to"))

    _, (first, last), loaded = inputs(
        lambda: refuse(points < 2, "--points", "must be 2 or more", points),
        span,
        lambda: load_study(study),
        out=out,
    )
    with working("selecting along the curve") as step:
        found = optimum_curve(loaded, varied(vary), (first, last), points=points, payload=payload, progress=step)
        page = curve_report(found)
    lines([curve_sentence(found), *(f"  {line}" for line in curve_lines(found))])
    write_page(loaded, out, {"curve.html": page})
    return found.feasible


@command
def front(
    study: StudyFile,
    by: Annotated[str, typer.Option(help="Criteria, separated by commas: mass, price, energy, utilisation.")] = (
        "mass,energy"
    ),
    time_limit: Annotated[
        str, typer.Option(metavar="TIME", help="Limit of the search, such as 10s; what is left unproven is reported.")
    ] = "60 s",
    out: Annotated[Path | None, folder_for("front.html and front.json")] = None,
) -> bool:
    """Compute the Pareto front: every set of drives that no other beats in all of the criteria."""
    from drivetrain.report.pages.trade_off_pages import front_json, front_lines, front_report, front_sentence
    from drivetrain.sizing.search.pareto.front import pareto_front
    from drivetrain.study.parts.selection import read_criterion
    from drivetrain.study.read import load_study

    names = [name.strip() for name in by.split(",") if name.strip()]
    seconds, loaded, *_ = inputs(
        lambda: positive(time_limit, "s", "--time-limit"),
        lambda: load_study(study),
        *(partial(read_criterion, name, "--by") for name in names),
        out=out,
    )
    with working("searching the front") as step:
        found = pareto_front(loaded, names, time_limit=seconds, progress=step)
        files = {"front.html": front_report(found), "front.json": front_json(found)}
    lines([front_sentence(found), *(f"  {line}" for line in front_lines(found))])
    lines(f"left out: {name}, {why}" for name, why in found.left_out.items())
    write_page(loaded, out, files)
    return found.feasible


@command
def family(
    studies: Annotated[
        list[Path], typer.Argument(metavar="STUDY...", help="Studies of the members, with the same joints.")
    ],
    payload: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MASS",
            help="A member for each mass: the study with this mass of its heaviest payload; may be repeated.",
        ),
    ] = None,
    common: Annotated[
        str, typer.Option(metavar="PARTS", help="What all members share: drives, motors or gears.")
    ] = "drives",
    time_limit: Annotated[str | None, typer.Option(metavar="TIME", help="Limit of the search, such as 10s.")] = None,
    out: Annotated[Path | None, folder_for("each member's report, result.json and currents.csv")] = None,
) -> bool:
    """Choose common drives, motors or gears for a family of arms that differ in payload, reach or motion."""
    from dataclasses import replace

    from drivetrain.report.outputs import write_outputs
    from drivetrain.report.verdict_lines import family_lines
    from drivetrain.sizing.answers.family import select_family
    from drivetrain.study.change import carrying_mass
    from drivetrain.study.read import load_study

    seconds, masses, *loaded = inputs(
        lambda: positive(time_limit, "s", "--time-limit"),
        lambda: [positive(text, "kg", "--payload") for text in payload or ()],
        *(partial(load_study, path) for path in studies),
        out=out,
    )
    members = inputs(*(partial(carrying_mass, one, mass) for one in loaded for mass in masses)) if masses else loaded
    wanted = members[0].wanted if seconds is None else replace(members[0].wanted, time_limit=seconds)
    with working(f"searching for {common} that fit all"):
        found = select_family(members, wanted=wanted, common=common)
    lines(family_lines(found, [one.name for one in members]))
    folder = out or report_folder(f"{loaded[0].name} family")
    for number, one in enumerate(found.evaluations, 1):
        files = write_outputs(folder / f"{number}_{report_folder(one.study.name).name}", one)
        say(f"report: {files['report.html']}")
    return bool(found.drives) and all(one.feasible for one in found.evaluations)


@command
def ratio(
    study: StudyOrResult,
    joint: Joints = None,
    out: Annotated[Path | None, folder_for("ratio.html and ratio.json")] = None,
) -> bool:
    """Vary each joint's gear ratio: torque, heat, every check, and the range in which all are satisfied."""
    from drivetrain.report.pages.ratio_page import ratio_json, ratio_report, ratio_sentence
    from drivetrain.sizing.answers.ratio import ratio_studies, ratio_study

    [(loaded, names)] = inputs(lambda: load_joints(study, joint), out=out)
    drives = chosen(loaded).drives
    with working("varying the ratios"):
        found = [ratio_study(loaded, name, drives=drives) for name in names]
        found = found or list(ratio_studies(loaded, drives=drives))
        files = {"ratio.html": ratio_report(found), "ratio.json": ratio_json(found)}
    lines(f"{one.joint}: {ratio_sentence(one)}" for one in found)
    resting = [] if names else [task.name for task in loaded.joints if task.name not in {one.joint for one in found}]
    lines(f"{name}: never moves, so no ratio decides anything" for name in resting)
    write_page(loaded, out, files)
    return all(one.feasible for one in found)


@command
def free_ratio(
    study: StudyFile,
    goal: Annotated[str, typer.Option(help="What the ratios minimise: heat, current, energy or mass.")] = "heat",
    out: Annotated[Path | None, folder_for("free_ratio.html")] = None,
) -> bool:
    """Find the best ratio of each joint with a free_ratio, and the nearest gears of the catalogue."""
    from drivetrain.report.pages.ratio_page import free_ratio_lines, free_ratio_report, free_ratio_sentence
    from drivetrain.sizing.answers.free_ratio import free_ratios, goal_of
    from drivetrain.study.read import load_study

    _, loaded = inputs(lambda: goal_of(goal), lambda: load_study(study), out=out)
    with working("turning the ratios"):
        found = free_ratios(loaded, goal=goal)
        page = free_ratio_report(found)
    lines([free_ratio_sentence(found), *(f"  {line}" for line in free_ratio_lines(found))])
    write_page(loaded, out, {"free_ratio.html": page})
    return found.feasible


@command
def fastest(
    study: StudyOrResult,
    out: Annotated[Path | None, folder_for("the report of that cycle, and motion.csv")] = None,
) -> bool:
    """Find the shortest cycle of the drives without changing dwells, and the limit that binds each move."""
    from drivetrain.report.outputs import write_outputs
    from drivetrain.report.verdict_lines import fastest_lines, motion_csv
    from drivetrain.sizing.answers.fastest import fastest
    from drivetrain.whole_files import write_files

    [loaded] = inputs(lambda: load_chosen(study), out=out)
    drives = chosen(loaded).drives
    with working("finding the fastest cycle"):
        found = fastest(loaded, drives)
    lines(fastest_lines(found))
    folder = out or report_folder(f"{loaded.name} fastest")  # beside the report of the study as it is
    files = write_outputs(folder, found.evaluation)
    written = write_files(folder, {"motion.csv": motion_csv(found.study)})
    say(f"motion: {written['motion.csv']}")
    say(f"report: {files['report.html']}")
    return found.feasible
