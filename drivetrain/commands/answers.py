"""The commands that answer a question about a selection: why-not, explain, curve, front, free-ratio."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.chain import StudyOrResult, chosen, load_chosen
from drivetrain.commands.shared import (
    DOES_NOT_FIT,
    FITS,
    FaultCollector,
    lines,
    report_faults,
    report_folder,
    say,
    whole_name,
    whole_names,
    working,
    writable,
)

app = typer.Typer(rich_markup_mode="rich")

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a YAML file.")]


def _out(files: str) -> typer.models.OptionInfo:
    """The option that names the folder."""
    option: typer.models.OptionInfo = typer.Option(
        "--out", metavar="DIR", help=f"Folder for {files}.", show_default=False
    )
    return option


@app.command("why-not")
def _why_not(
    study: StudyFile,
    joint: Annotated[str | None, typer.Option(help="At this joint; without it at every joint.")] = None,
    motor: Annotated[str | None, typer.Option(help="Key or part number of a motor.")] = None,
    gear: Annotated[str | None, typer.Option(help="Key or part number of a gear; none: a direct drive.")] = None,
    out: Annotated[Path | None, _out("why_not.html")] = None,
) -> None:
    """Say why a motor, a gear or a pair was not chosen, what would let it pass, and what it would cost."""
    with report_faults():
        from drivetrain.report.pages.why_not_page import why_not_lines, why_not_report
        from drivetrain.sizing.answers.why_not import why_not
        from drivetrain.study.read import load_study
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            loaded = load_study(study)
        faults.report()
        joint = None if joint is None else whole_name(joint, [task.name for task in loaded.joints])
        with working("searching for what would let it pass"):
            found = why_not(loaded, joint, motor, gear)
            page = why_not_report(found)
        for answer in found.answers:
            first, *rest = why_not_lines(found, answer)
            say(first)
            for line in rest:
                say(f"  {line}")
        written = write_files(out or report_folder(loaded.name), {"why_not.html": page})
        say(f"page: {written['why_not.html']}")
        raise typer.Exit(FITS if found.holds else DOES_NOT_FIT)


@app.command("explain")
def _explain(
    study: StudyOrResult,
    joint: Annotated[list[str] | None, typer.Option(help="Of this joint, or of the supply; may be repeated.")] = None,
    check: Annotated[list[str] | None, typer.Option(help="This check only; may be repeated.")] = None,
) -> None:
    """Say how each check comes about: formula, numbers, instant, limit and its source."""
    with report_faults():
        from drivetrain.report.verdict_lines import explanation
        from drivetrain.sizing.judge.checks import REQUIREMENTS

        faults, checks = FaultCollector(), [row.name for row in REQUIREMENTS]
        with faults:
            check = whole_names("--check", "check", check, checks)
        with faults:
            loaded = load_chosen(study)
            names = [*(task.name for task in loaded.joints), "supply", "arm"]
            joint = whole_names("--joint", "joint of the study", joint, names)
        faults.report()
        found = chosen(loaded)
        lines(explanation(found, tuple(joint or ()), tuple(check or ())))
        raise typer.Exit(FITS if found.feasible else DOES_NOT_FIT)


@app.command("curve")
def _curve(
    study: StudyFile,
    vary: Annotated[str, typer.Option(help="payload, cycle_time, voltage or ambient.")] = "payload",
    low: Annotated[str, typer.Option("--from", help="Smallest value, with its unit.")] = "0 kg",
    high: Annotated[str, typer.Option("--to", help="Largest value, with its unit.")] = "10 kg",
    points: Annotated[int, typer.Option(help="Values at which sets are selected to start with.")] = 17,
    payload: Annotated[str | None, typer.Option(help="Whose mass is varied; without it the heaviest.")] = None,
    out: Annotated[Path | None, _out("curve.html")] = None,
) -> None:
    """Show what the best drives become as payload, cycle time, supply voltage or air temperature change."""
    with report_faults():
        from drivetrain.errors import Fault, InputError
        from drivetrain.report.pages.curve_page import curve_lines, curve_report, curve_sentence
        from drivetrain.sizing.answers.curve import optimum_curve, varied
        from drivetrain.study.read import load_study
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            if points < 2:
                raise InputError(Fault("--points", "must be 2 or more", points))
        with faults:
            what = varied(vary)
            ends = _ends(low, high, what.unit)
        with faults:
            loaded = load_study(study)
        faults.report()
        with working("selecting along the curve") as step:
            found = optimum_curve(loaded, what, ends, points=points, payload=payload, progress=step)
            page = curve_report(found)
        say(curve_sentence(found))
        for line in curve_lines(found):
            say(f"  {line}")
        written = write_files(out or report_folder(loaded.name), {"curve.html": page})
        say(f"page: {written['curve.html']}")
        raise typer.Exit(FITS if found.feasible else DOES_NOT_FIT)


def _ends(low: str, high: str, unit: str) -> tuple[float, float]:
    """Both ends of a range, their faults at once."""
    from drivetrain.errors import Fault, InputError
    from drivetrain.units import quantity

    read: list[float] = []
    faults: list[Fault] = []
    for text, option in ((low, "--from"), (high, "--to")):
        try:
            read.append(quantity(text, unit, option))
        except InputError as error:
            faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return read[0], read[1]


@app.command("front")
def _front(
    study: StudyFile,
    by: Annotated[str, typer.Option(help="Criteria, separated by commas: mass, price, energy, utilisation.")] = (
        "mass,energy"
    ),
    time_limit: Annotated[
        str, typer.Option(metavar="TIME", help="For the search, such as 10s; what is left unproven is reported.")
    ] = "60 s",
    out: Annotated[Path | None, _out("front.html and front.json")] = None,
) -> None:
    """Find every set of drives that no other beats in mass, price, energy a cycle and utilisation at once."""
    with report_faults():
        from drivetrain.report.pages.front_page import front_json, front_lines, front_report, front_sentence
        from drivetrain.sizing.search.front import pareto_front
        from drivetrain.study.parts.selection import read_criterion
        from drivetrain.study.read import load_study
        from drivetrain.units import quantity
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            seconds = quantity(time_limit, "s", "--time-limit", above=0.0)
        names = [name.strip() for name in by.split(",") if name.strip()]
        for name in names:
            with faults:
                read_criterion(name, "--by")
        with faults:
            loaded = load_study(study)
        faults.report()
        with working("searching the front") as step:
            found = pareto_front(loaded, names, time_limit=seconds, progress=step)
            files = {"front.html": front_report(found), "front.json": front_json(found)}
        say(front_sentence(found))
        for line in front_lines(found):
            say(f"  {line}")
        for name, why in found.left_out.items():
            say(f"left out: {name}, {why}")
        written = write_files(out or report_folder(loaded.name), files)
        say(f"page: {written['front.html']}")
        raise typer.Exit(FITS if found.feasible else DOES_NOT_FIT)


@app.command("free-ratio")
def _free_ratio(
    study: StudyFile,
    goal: Annotated[str, typer.Option(help="What the ratios make small: heat, current, energy or mass.")] = "heat",
    out: Annotated[Path | None, _out("free_ratio.html")] = None,
) -> None:
    """Find the best ratio of every joint that the study gives a free_ratio, and the nearest gears of the catalogue."""
    with report_faults():
        from drivetrain.report.pages.ratio_page import free_ratio_lines, free_ratio_report, free_ratio_sentence
        from drivetrain.sizing.answers.free_ratio import free_ratios, goal_of
        from drivetrain.study.read import load_study
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            goal_of(goal)
        with faults:
            loaded = load_study(study)
        faults.report()
        with working("turning the ratios"):
            found = free_ratios(loaded, goal=goal)
            page = free_ratio_report(found)
        say(free_ratio_sentence(found))
        for line in free_ratio_lines(found):
            say(f"  {line}")
        written = write_files(out or report_folder(loaded.name), {"free_ratio.html": page})
        say(f"page: {written['free_ratio.html']}")
        raise typer.Exit(FITS if found.feasible else DOES_NOT_FIT)
