"""The commands around a study: demo, init, check, size, select."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetrain.commands.chain import StudyOrResult, chosen, load_chosen, write_chosen
from drivetrain.commands.shared import (
    DOES_NOT_FIT,
    FITS,
    FaultCollector,
    listed,
    report_faults,
    report_folder,
    say,
    whole_names,
    working,
    writable,
)

if TYPE_CHECKING:
    from drivetrain.report.pages.sheet import Extra
    from drivetrain.sizing.answers.spread import Spread
    from drivetrain.sizing.results import Evaluation, Selection
    from drivetrain.study.model import Study

app = typer.Typer(rich_markup_mode="rich")

MOST_NOTES = 8  # warnings and notes listed on the terminal; the report holds them all

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a YAML file (see `drivetrain init`).")]
OutFolder = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder for report.html, result.json and currents.csv.  [default: <study name>_report]",
        show_default=False,
    ),
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print result.json to standard output, the table to standard error.")
]


class Objective(StrEnum):
    """What a selection may minimise."""

    MASS = "mass"
    PRICE = "price"
    ENERGY = "energy"


@app.command("demo")
def _demo(out: OutFolder = None) -> None:
    """Pick drives for a UR5-class arm from the shipped catalogues, and write the report to ./reports/demo."""
    with report_faults():
        from drivetrain.shipped import shipped
        from drivetrain.study.read import load_study

        writable(out)
        study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
        code = _deliver(_selected(study), out or Path("reports") / "demo", as_json=False)
        say("next: `drivetrain init my_arm.yaml` writes a study of your own to start from")
        raise typer.Exit(code)


@app.command("init")
def _init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The study to write.")] = Path("study.yaml"),
    arm: Annotated[str, typer.Option(help="A built-in arm, or a URDF file.")] = "ur5-corrected",
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is already there.")] = False,
) -> None:
    """Write a commented study to start from."""
    with report_faults():
        from drivetrain.errors import Fault, InputError
        from drivetrain.study.template import study_template
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(file, file=True)
            if file.exists() and not force:
                raise InputError(Fault(str(file), "is already there", hint="choose another name, or give --force"))
        with faults:
            text = study_template(arm, file.parent)
        faults.report()
        write_files(file.parent, {file.name: text})
        say(f"wrote {file}")
        say(f"next: edit it, then `drivetrain check {file}` and `drivetrain select {file}`")


@app.command("check")
def _check(
    study: Annotated[Path | None, typer.Argument(metavar="STUDY", help="The study, a YAML file.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of studies, for editors.")] = False,
) -> None:
    """Read a study and everything it names, and list every error and warning; nothing is calculated."""
    if study is None and not schema:
        raise typer.BadParameter("name a study, or give --schema", param_hint="STUDY")
    with report_faults():
        if schema:
            import json

            from drivetrain.study.schema import json_schema

            typer.echo(json.dumps(json_schema(), indent=2))
        if study is not None:
            from drivetrain.study.read import load_study

            _summarise(load_study(study), errors=schema)


@app.command("size")
def _size(study: StudyOrResult, out: OutFolder = None, as_json: AsJson = False) -> None:
    """Check the drives that the study names, or else selects: margins, verdicts, report, currents."""
    with report_faults():
        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            loaded = load_chosen(study)
        faults.report()
        raise typer.Exit(_deliver(chosen(loaded), out or report_folder(loaded.name), as_json=as_json))


@app.command("select")
def _select(
    study: StudyFile,
    sets: Annotated[int | None, typer.Option(min=1, help="How many of the best sets are wanted.")] = None,
    time_limit: Annotated[
        str | None, typer.Option(metavar="TIME", help="For the search, such as 10s; what is left unproven is reported.")
    ] = None,
    objective: Annotated[Objective | None, typer.Option(help="What is minimised, whatever the study says.")] = None,
    front: Annotated[
        str | None, typer.Option(metavar="CRITERIA", help="Also the Pareto front, such as of mass,energy.")
    ] = None,
    curve: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="Also the best drives over payload, cycle_time, voltage or ambient; may be repeated. "
            "With ends: 'payload: 0 kg..8 kg'.",
        ),
    ] = None,
    curve_from: Annotated[str | None, typer.Option(metavar="VALUE", help="Start of the curve, with its unit.")] = None,
    curve_to: Annotated[str | None, typer.Option(metavar="VALUE", help="Its end, with its unit.")] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Also write the study with its drives named, for size, currents, simulate, ..."
        ),
    ] = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Choose drives for every joint from the catalogues that the study allows."""
    with report_faults():
        from dataclasses import replace

        from drivetrain.commands.trade_offs import options_beside
        from drivetrain.study.read import load_study

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            writable(write, file=True, option="--write")
        with faults:
            seconds = _seconds(time_limit)
        with faults:
            beside = options_beside(front, curve, curve_from, curve_to)
        with faults:
            loaded = load_study(study)
        faults.report()
        wanted = loaded.wanted
        wanted = wanted if sets is None else replace(wanted, sets=sets)
        wanted = wanted if seconds is None else replace(wanted, time_limit=seconds)
        wanted = wanted if objective is None else replace(wanted, weights=((objective.value, 1.0),))
        loaded = replace(loaded, wanted=wanted, trade_offs=replace(loaded.trade_offs, **beside))
        if loaded.trade_offs:
            from drivetrain.sizing.answers.trade_offs import check_trade_offs

            check_trade_offs(loaded)
        found = _selected(loaded)
        code = _deliver(found, out or report_folder(loaded.name), as_json=as_json)
        if write is not None:
            write_chosen(found, write)
        raise typer.Exit(code)


@app.command("ratio")
def _ratio(
    study: StudyOrResult,
    joint: Annotated[list[str] | None, typer.Option(help="Of this joint only; may be given several times.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for ratio.html and ratio.json.", show_default=False),
    ] = None,
) -> None:
    """Vary each joint's gear ratio: torque, heat, every check, and the window in which all hold."""
    with report_faults():
        from drivetrain.report.pages.ratio_page import ratio_json, ratio_report, ratio_sentence
        from drivetrain.sizing.answers.ratio import ratio_studies, ratio_study
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            loaded = load_chosen(study)
            names = [task.name for task in loaded.joints]
            joint = whole_names("--joint", "joint of the study", joint, names)
        faults.report()
        drives = chosen(loaded).drives
        with working("varying the ratios"):
            found = [ratio_study(loaded, name, drives=drives) for name in joint or ()]
            found = found or list(ratio_studies(loaded, drives=drives))
            page = ratio_report(found)
        folder = out or report_folder(loaded.name)
        written = write_files(folder, {"ratio.html": page, "ratio.json": ratio_json(found)})
        for one in found:
            say(f"{one.joint}: {ratio_sentence(one)}")
        for name in () if joint else (name for name in names if name not in {one.joint for one in found}):
            say(f"{name}: never moves, so no ratio decides anything")
        say(f"page: {written['ratio.html']}")
        raise typer.Exit(FITS if all(one.feasible for one in found) else DOES_NOT_FIT)


def _seconds(text: str | None) -> float | None:
    """A time on the command line."""
    from drivetrain.units import quantity

    return None if text is None else quantity(text, "s", "--time-limit", above=0.0)


def _selected(study: Study) -> Selection:
    """The search, with its progress."""
    from drivetrain.sizing.search.search import select as search

    with working("searching the catalogues") as step:
        return search(study, progress=step)


def _deliver(result: Evaluation | Selection, out: Path, *, as_json: bool) -> int:
    """Write the files, print the verdict, and give the exit code."""
    from drivetrain.report.outputs import write_outputs
    from drivetrain.report.pages.spread_section import spread_lines
    from drivetrain.report.result_json import result_json
    from drivetrain.report.terminal import console, progress
    from drivetrain.report.verdict_lines import verdict_lines, verdict_table
    from drivetrain.sizing.results import Evaluation

    result, found = _spread(result)
    extra, told_beside = _beside(result)
    with progress(console(errors=True), "drawing the report"):
        files = write_outputs(out, result, spread=found, extra=extra)
    screen = console(errors=as_json)
    screen.print(verdict_table(result if isinstance(result, Evaluation) else result.evaluation))
    screen.print()
    for line in verdict_lines(result):
        screen.print(line, soft_wrap=True)
    for words in [] if found is None else spread_lines(found):
        screen.print(words, soft_wrap=True, highlight=False)
    for text in told_beside:
        screen.print(text, soft_wrap=True, highlight=False)
    say(f"report: {files['report.html']}", errors=as_json)
    if as_json:
        sys.stdout.write(result_json(result, spread=found, extra=extra, folder=out))
    return FITS if result.feasible else DOES_NOT_FIT


def _beside(result: Evaluation | Selection) -> tuple[Extra | None, list[str]]:
    """Front and curves where a selection was asked for them: parts of the report, and lines for the terminal."""
    from drivetrain.commands.trade_offs import beside
    from drivetrain.sizing.results import Selection

    found = beside(result) if isinstance(result, Selection) else None
    if found is None or not isinstance(result, Selection):
        return None, []
    from drivetrain.report.pages.curve_page import trade_off_extra, trade_off_lines

    return trade_off_extra(found, result), trade_off_lines(found)


def _spread(result: Evaluation | Selection) -> tuple[Evaluation | Selection, Spread | None]:
    """What the scatter of the numbers means, and the set that stands it where a probability is wanted."""
    from drivetrain.sizing.answers.spread import robustly, spread
    from drivetrain.sizing.results import Evaluation

    if not result.study.tolerances.given:
        return result, None
    with working("drawing arms within the tolerances (compiled the first time, about 7 s)"):
        if isinstance(result, Evaluation):
            return result, spread(result)
        chosen, choice = robustly(result)
        return chosen, spread(chosen.evaluation, choice)


def _summarise(study: Study, *, errors: bool) -> None:
    """What was read, in a few lines."""
    from drivetrain.report.pages.views import passed_over

    cycle = study.cycle
    say(
        f"{study.name}: {len(study.joints)} joints, cycle of {cycle.duration:g} s in {len(cycle.time)} samples",
        errors=errors,
    )
    for task in study.joints:
        given = "no drive given" if task.drive is None else " + ".join(key for key in task.drive if key)
        say(f"  {task.name}: {given}; {len(task.pairs)} pairs may be chosen", errors=errors)
    for names, counts in passed_over(study.joints):
        for line in (f"candidates of {names}:", *(f"  {count}" for count in counts)):
            say(f"  {line}", errors=errors)
    warnings_first = sorted(study.notes, key=lambda note: not note.startswith("warning:"))
    listed("warnings and notes", warnings_first, most=MOST_NOTES)
    say("the study can be used", errors=errors)
