"""The commands around a study: demo, init, check, size, select."""

from __future__ import annotations

import sys
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetrain.commands.chain import chosen, load_chosen, write_chosen
from drivetrain.commands.shared import (
    StudyFile,
    StudyOrResult,
    command,
    folder_for,
    inputs,
    listed,
    positive,
    refuse,
    report_folder,
    say,
    working,
    writable,
    write_page,
)

if TYPE_CHECKING:
    from drivetrain.report.pages.sheet import Extra
    from drivetrain.sizing.answers.spread import Spread
    from drivetrain.sizing.results import Evaluation, Selection
    from drivetrain.study.model import Study

OutFolder = Annotated[
    Path | None,
    folder_for("report.html, result.json and currents.csv", ends=" Default: <study name>_report."),
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print result.json to standard output, the table to standard error.")
]

AsPdf = Annotated[bool, typer.Option("--pdf", help="Also write summary.pdf, a one-page summary for decision makers.")]


class Objective(StrEnum):
    """What a selection may minimise."""

    MASS = "mass"
    PRICE = "price"
    ENERGY = "energy"


@command
def demo(out: OutFolder = None) -> bool:
    """Select drives for a UR5-class arm from the shipped catalogues, and write the report to ./reports/demo."""
    from drivetrain.study.read import load_study
    from drivetrain.whole_files import shipped

    writable(out)
    study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    result = _selected(study)
    _deliver(result, out or Path("reports") / "demo", as_json=False)
    say("next: `drivetrain init my_arm.yaml` writes a study of your own to start from")
    return result.feasible


@command
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The study to write.")] = Path("study.yaml"),
    arm: Annotated[str, typer.Option(help="A built-in arm, or a URDF, xacro, MJCF or SDF file.")] = "ur5-corrected",
    tip: Annotated[
        str | None,
        typer.Option(
            metavar="LINK", help="The link that carries the payload. Default: the end of the arm.", show_default=False
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is already there.")] = False,
) -> None:
    """Write a commented study to start from."""
    from drivetrain.study.template import study_template
    from drivetrain.whole_files import write_files

    def target() -> None:
        writable(file, file=True)
        refuse(file.exists() and not force, str(file), "is already there", hint="choose another name, or give --force")

    name = file.stem.replace("_", " ").strip()  # so two studies in one folder have a report each
    name = f"{name[:1].upper()}{name[1:]}" or "My arm"
    _, text = inputs(target, lambda: study_template(arm, file.parent, name, tip=tip))
    write_files(file.parent, {file.name: text})
    say(f"wrote {file}")
    say(f"next: edit it, then `drivetrain check {file}` and `drivetrain select {file}`")


@command
def check(
    study: Annotated[Path | None, typer.Argument(metavar="STUDY", help="The study, a YAML file.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of studies, for editors.")] = False,
) -> bool:
    """Read a study and all its files, and list every error and warning, without calculating anything."""
    if study is None and not schema:
        raise typer.BadParameter("name a study, or give --schema", param_hint="STUDY")
    if schema:
        import json

        from drivetrain.study.schema import json_schema

        typer.echo(json.dumps(json_schema(), indent=2))
    if study is not None:
        from drivetrain.study.read import load_study

        return _summarise(load_study(study), errors=schema)
    return True


@command
def size(study: StudyOrResult, out: OutFolder = None, pdf: AsPdf = False, as_json: AsJson = False) -> bool:
    """Evaluate the drives that the study names or selects: margins, verdicts, report, currents."""
    [loaded] = inputs(lambda: load_chosen(study), out=out)
    evaluation = chosen(loaded)
    _deliver(evaluation, out or report_folder(loaded.name), pdf=pdf, as_json=as_json)
    return evaluation.feasible


@command
def report(study: StudyOrResult, out: Annotated[Path | None, folder_for("report.html")] = None) -> bool:
    """Write the report alone, for the drives that the study names or selects."""
    from drivetrain.report.pages.report_page import html_report

    [loaded] = inputs(lambda: load_chosen(study), out=out)
    result = chosen(loaded)
    write_page(loaded, out, {"report.html": html_report(result, spread=_spread(result))})
    return result.feasible


@command
def select(
    study: StudyFile,
    sets: Annotated[int | None, typer.Option(min=1, help="Number of best sets to report.")] = None,
    time_limit: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Limit of the search, such as 10s; what is left unproven is reported."),
    ] = None,
    objective: Annotated[
        Objective | None, typer.Option(help="Objective to minimise, overriding that of the study.")
    ] = None,
    front: Annotated[
        str | None, typer.Option(metavar="CRITERIA", help="Also compute the Pareto front, for example mass,energy.")
    ] = None,
    curve: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="Also compute the best drives over payload, cycle_time, voltage, ambient or force; may be repeated. "
            "With a range: 'payload: 0 kg..8 kg'.",
        ),
    ] = None,
    curve_from: Annotated[str | None, typer.Option(metavar="VALUE", help="Start of the curve, with its unit.")] = None,
    curve_to: Annotated[str | None, typer.Option(metavar="VALUE", help="End of the curve, with its unit.")] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Also write the study with its drives named, for size, currents, simulate, ..."
        ),
    ] = None,
    out: OutFolder = None,
    pdf: AsPdf = False,
    as_json: AsJson = False,
) -> bool:
    """Choose drives for every joint from the catalogues that the study allows."""
    from drivetrain.study.read import load_study

    _, seconds, beside, loaded = inputs(
        lambda: writable(write, file=True, option="--write"),
        lambda: positive(time_limit, "s", "--time-limit"),
        lambda: options_beside(front, curve, curve_from, curve_to),
        lambda: load_study(study),
        out=out,
    )
    weights = None if objective is None else ((objective.value, 1.0),)
    given = {"sets": sets, "time_limit": seconds, "weights": weights}
    wanted = replace(loaded.wanted, **{name: value for name, value in given.items() if value is not None})
    loaded = replace(loaded, wanted=wanted, trade_offs=replace(loaded.trade_offs, **beside))
    if loaded.trade_offs:
        from drivetrain.sizing.answers.trade_offs import check_trade_offs

        check_trade_offs(loaded)
    found = _selected(loaded)
    _deliver(found, out or report_folder(loaded.name), pdf=pdf, as_json=as_json)
    if write is not None:
        write_chosen(found, write)
    return found.feasible


def _selected(study: Study) -> Selection:
    from drivetrain.sizing.search.search import select as search

    with working("searching the catalogues") as step:
        return search(study, progress=step)


def _deliver(result: Evaluation | Selection, out: Path, *, pdf: bool = False, as_json: bool) -> None:
    from drivetrain.report.outputs import result_json, write_outputs
    from drivetrain.report.pages.spread_section import spread_lines
    from drivetrain.report.terminal import console, progress
    from drivetrain.report.verdict_lines import verdict_lines, verdict_table
    from drivetrain.sizing.results import Evaluation

    found = _spread(result)
    extra, beside = lines_beside(result)
    with progress(console(errors=True), "drawing the report"):
        files = write_outputs(out, result, spread=found, extra=extra)
    if pdf:
        from drivetrain.report.summary import summary_pdf
        from drivetrain.whole_files import write_whole

        write_whole(out / "summary.pdf", summary_pdf(result))
    screen = console(errors=as_json)
    screen.print(verdict_table(result if isinstance(result, Evaluation) else result.evaluation))
    screen.print()
    for line in verdict_lines(result):
        screen.print(line, soft_wrap=True)
    for words in [] if found is None else spread_lines(found):
        screen.print(words, soft_wrap=True, highlight=False)
    for text in beside:
        screen.print(text, soft_wrap=True, highlight=False)
    say(f"report: {files['report.html']}", errors=as_json)
    if pdf:
        say(f"summary: {out / 'summary.pdf'}", errors=as_json)
    if as_json:
        sys.stdout.write(result_json(result, spread=found, extra=extra, folder=out))


def _spread(result: Evaluation | Selection) -> Spread | None:
    """Effects of the study's tolerances; None if it states none."""
    from drivetrain.sizing.answers.spread import spread

    if not result.study.tolerances.given:
        return None
    with working("drawing arms within the tolerances (compiled the first time, about 7 s)"):
        return spread(result)


def _summarise(study: Study, *, errors: bool) -> bool:
    """Say what was read; whether every joint has a drive or a candidate."""
    from drivetrain.report.pages.views import passed_over
    from drivetrain.study.model import pair_name

    cycle = study.cycle
    joints = f"{len(study.joints)} joint{'s' * (len(study.joints) > 1)}"
    samples = f"cycle of {cycle.duration:g} s in {len(cycle.time)} samples"
    say(f"{study.name}: {joints}, {samples}", errors=errors)
    for task in study.joints:
        text = f"no drive given; {len(task.pairs)} pairs may be chosen"
        if task.drive is not None:
            text = f"{pair_name(*task.drive)} given"
        say(f"  {task.name}: {text}", errors=errors)
    for names, counts in passed_over(study.joints):
        for line in (f"candidates of {names}:", *(f"  {count}" for count in counts)):
            say(f"  {line}", errors=errors)
    for severity, found in _catalog_findings(study).items():
        listed(f"{severity}s in the catalogues", found)
    listed("warnings and notes", sorted(study.notes, key=lambda note: not note.startswith("warning:")))
    barred = ", ".join(task.name for task in study.joints if task.drive is None and not task.pairs)
    fit = f"the study can be read, but nothing can be chosen for {barred}" if barred else "the study can be used"
    say(fit, errors=errors)
    return not barred


def _catalog_findings(study: Study) -> dict[str, list[str]]:
    """Findings of the lint in the study's catalogues, except the shipped one, by severity."""
    from drivetrain.catalog.findings import Severity
    from drivetrain.catalog.linting import lint
    from drivetrain.study.parts.sheets import SHIPPED_CATALOG

    if study.document is None:
        return {}
    named = study.document.data.get("catalogs", [])
    folders = [named] if isinstance(named, str) else named
    found = [one for name in folders if name != SHIPPED_CATALOG for one in lint(study.document.folder / name)]
    return {str(severity): [str(one) for one in found if one.severity is severity] for severity in Severity}


def options_beside(front: str | None, curves: list[str] | None, low: str | None, high: str | None) -> dict[str, Any]:
    """The front and the curves that the command line asks for instead of what a study says, as fields of its own."""
    from drivetrain.study.parts.selection import read_criterion, read_curve, read_span

    names = [name.strip() for name in (front or "").split(",") if name.strip()]
    texts = curves or []

    def ends() -> Any:
        """Of the one curve that has none of its own."""
        if low is None and high is None:
            return None
        hint = "with several curves write the ends into each: --curve 'payload: 0 kg..8 kg'"
        problem = "are the ends of one --curve without ends of its own"
        bare = len(texts) == 1 and ":" not in texts[0]
        refuse(not bare, "--curve-from, --curve-to", problem, hint=hint)
        missing = "--curve-to" if high is None else "--curve-from"
        refuse(low is None or high is None, missing, "is missing: a curve has two ends")
        return read_span(read_curve(texts[0], "--curve").vary, (str(low), str(high)), ("--curve-from", "--curve-to"))

    def several() -> Any:
        """The curves, each asked for once."""
        found = inputs(*(partial(read_curve, text, "--curve") for text in texts))
        asked = [one.vary for one in found]
        twice = sorted({one for one in asked if asked.count(one) > 1})
        inputs(*(partial(refuse, True, "--curve", "is given twice", name) for name in twice))
        return found

    _, found, span, *_ = inputs(
        lambda: refuse(front is not None and not names, "--front", "names no criterion", front, "such as mass,energy"),
        several,
        ends,
        *(partial(read_criterion, name, "--front") for name in names),
    )
    if span is not None:
        found = [replace(found[0], span=span)]
    asked: dict[str, Any] = {} if front is None else {"front": tuple(dict.fromkeys(names))}
    return asked | ({"curves": tuple(found)} if found else {})


def lines_beside(result: Evaluation | Selection) -> tuple[Extra | None, list[str]]:
    """Front and curves where a selection was asked for them: parts of the report, and lines for the terminal."""
    from drivetrain.sizing.results import Selection

    asked = result.study.trade_offs
    if not asked or not isinstance(result, Selection):
        return None, []
    from drivetrain.report.pages.trade_off_pages import trade_off_extra, trade_off_lines
    from drivetrain.sizing.answers.trade_offs import trade_offs

    parts = [f"the front over {' and '.join(asked.front)}"] if asked.front else []
    parts += [f"the best drives over the {curve.vary.replace('_', ' ')}" for curve in asked.curves]
    with working("; ".join(parts)) as step:
        found = trade_offs(result.study, progress=step)
    return trade_off_extra(found, result), trade_off_lines(found)
