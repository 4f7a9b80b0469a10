"""The commands: parse, one call, print. Exit codes: 0 it fits, 1 it does not fit, 2 the input is wrong.

Everything heavy is imported inside the command that needs it, so that ``--help`` is there at once.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetrain.version import __version__

if TYPE_CHECKING:
    from drivetrain.sizing.results import Evaluation, Selection
    from drivetrain.study.study import Study

FITS, DOES_NOT_FIT, BAD_INPUT, STOPPED = 0, 1, 2, 130
MOST_NOTES = 8  # doubts listed on the terminal; the report holds them all

app = typer.Typer(
    name="drivetrain",
    help="Can this motor and gear drive this arm through these motions, and which ones can?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
catalog_app = typer.Typer(
    help="Look after catalogues of motors and gears.", no_args_is_help=True, rich_markup_mode="rich"
)
app.add_typer(catalog_app, name="catalog")

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


class Source(StrEnum):
    """Column formats that can be imported."""

    MGDB = "mgdb"
    TABLE = "table"


def main() -> None:
    """Run the command that the command line names."""
    app()


def _show_version(wanted: bool) -> None:
    """Before any command is looked for."""
    if wanted:
        typer.echo(f"drivetrain {__version__}")
        raise typer.Exit(FITS)


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", is_eager=True, callback=_show_version)
    ] = False,
) -> None:
    """What stands before the command's name."""


@app.command("demo")
def _demo(out: OutFolder = None) -> None:
    """Pick drives for a UR5-class arm from the shipped catalogues, and write the report to ./reports/demo."""
    with _told():
        from drivetrain.shipped import shipped
        from drivetrain.study.load import load_study

        study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
        code = _deliver(_selected(study), out or Path("reports") / "demo", as_json=False)
        _say("next: `drivetrain init my_arm.yaml` writes a study of your own to start from")
        raise typer.Exit(code)


@app.command("init")
def _init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The study to write.")] = Path("study.yaml"),
    arm: Annotated[str, typer.Option(help="A built-in arm, or a URDF file.")] = "ur5-corrected",
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is already there.")] = False,
) -> None:
    """Write a commented study to start from."""
    with _told():
        from drivetrain.errors import Fault, InputError
        from drivetrain.report.outputs import write_files
        from drivetrain.study.template import study_template

        if file.exists() and not force:
            raise InputError(Fault(str(file), "is already there", hint="choose another name, or give --force"))
        write_files(file.parent, {file.name: study_template(arm)})
        _say(f"wrote {file}")
        _say(f"next: edit it, then `drivetrain check {file}` and `drivetrain select {file}`")


@app.command("check")
def _check(
    study: Annotated[Path | None, typer.Argument(metavar="STUDY", help="The study, a YAML file.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of studies, for editors.")] = False,
) -> None:
    """Read a study and everything it names, and list every fault; nothing is calculated."""
    if study is None and not schema:
        raise typer.BadParameter("name a study, or ask for --schema", param_hint="STUDY")
    with _told():
        if schema:
            import json

            from drivetrain.study.schema import json_schema

            typer.echo(json.dumps(json_schema(), indent=2))
        if study is not None:
            from drivetrain.study.load import load_study

            _summarise(load_study(study), errors=schema)


@app.command("size")
def _size(study: StudyFile, out: OutFolder = None, as_json: AsJson = False) -> None:
    """Judge the drives that the study gives: margins, verdicts, report, currents."""
    with _told():
        from drivetrain.sizing.evaluate import evaluate
        from drivetrain.study.load import load_study

        loaded = load_study(study)
        with _working("judging the given drives"):
            result = evaluate(loaded)
        raise typer.Exit(_deliver(result, out or _default_out(loaded), as_json=as_json))


@app.command("select")
def _select(study: StudyFile, out: OutFolder = None, as_json: AsJson = False) -> None:
    """Choose drives for every joint from the catalogues that the study allows."""
    with _told():
        from drivetrain.study.load import load_study

        loaded = load_study(study)
        raise typer.Exit(_deliver(_selected(loaded), out or _default_out(loaded), as_json=as_json))


@app.command("currents")
def _currents(
    study: StudyFile,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The CSV file to write.")] = Path("currents.csv"),
) -> None:
    """Write the current command of every joint over the cycle, for the drives that the study gives."""
    with _told():
        from drivetrain.report.outputs import currents_csv, write_files
        from drivetrain.sizing.evaluate import evaluate
        from drivetrain.study.load import load_study

        loaded = load_study(study)
        with _working("computing currents"):
            result = evaluate(loaded)
        write_files(out.parent, {out.name: currents_csv(result)})
        _say(f"currents: {out}")
        _say(f"verdict on these drives: {result.verdict}")
        raise typer.Exit(FITS if result.feasible else DOES_NOT_FIT)


@catalog_app.command("lint")
def _catalog_lint(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder with motors.csv, gears.csv, compatibility.csv.")
    ],
) -> None:
    """List everything wrong with a catalogue at once; exit code 1 when a row cannot be right."""
    with _told():
        from drivetrain.catalog.findings import Severity
        from drivetrain.catalog.lint import lint
        from drivetrain.report.terminal import console, lint_table

        found = lint(folder)
        errors = sum(one.severity is Severity.ERROR for one in found)
        screen = console()
        if found and screen.is_terminal:
            screen.print(lint_table(found))
        else:
            _lines(str(one) for one in found)  # one line each, to be searched and counted
        _say(f"{folder}: {errors} errors, {len(found) - errors} warnings")
        raise typer.Exit(DOES_NOT_FIT if errors else FITS)


@catalog_app.command("import")
def _catalog_import(
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="Folder with the files to read.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Catalogue folder to write.")],
    form: Annotated[Source, typer.Option("--format", help="Column format of the source.")] = Source.MGDB,
    basis: Annotated[
        list[str] | None,
        typer.Option(
            help="What the source's amperes are: dc, rms/phase, peak/line_line ...; for one maker or key: NAME=BASIS. "
            "May be given several times."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace tables that are already there.")] = False,
    drop_faulty: Annotated[
        bool, typer.Option("--drop-faulty", help="Leave out rows that the lint calls an error.")
    ] = False,
) -> None:
    """Bring a catalogue in another column format into a folder of this one."""
    with _told():
        from drivetrain.catalog.importers import import_mgdb, import_table

        bring = import_mgdb if form is Source.MGDB else import_table
        done = bring(source, out, basis=_basis(basis or []), keep_faulty=not drop_faulty, overwrite=force)
        _listed("left out", [str(fault) for fault in done.refused], most=25)
        _say(f"{out}: {done.motors} motors, {done.gears} gears, {done.pairs} pairs")
        _say(f"next: `drivetrain catalog lint {out}`")


@contextmanager
def _told() -> Iterator[None]:
    """Wrong input ends as a list of faults, Ctrl-C in one line; warnings become notes."""
    from drivetrain.errors import DrivetrainError

    with warnings.catch_warnings():
        warnings.showwarning = lambda message, category, *_: _say(f"note: {message}", errors=True)
        try:
            yield
        except DrivetrainError as error:
            from drivetrain.report.terminal import console, fault_lines

            for line in fault_lines(error):
                console(errors=True).print(line, soft_wrap=True)
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            _say("stopped", errors=True)
            raise typer.Exit(STOPPED) from None


def _say(text: str, *, errors: bool = False) -> None:
    """One line on the terminal, never wrapped."""
    typer.echo(text, err=errors)


def _lines(texts: Iterable[str]) -> None:
    """Lines on standard output."""
    for text in texts:
        _say(text)


def _listed(heading: str, lines: list[str], *, most: int) -> None:
    """A list on standard error, cut when it is long."""
    if lines:
        _say(f"{heading} ({len(lines)}):", errors=True)
    for line in lines[:most]:
        _say(f"  {line}", errors=True)
    if len(lines) > most:
        _say(f"  ... and {len(lines) - most} more", errors=True)


@contextmanager
def _working(text: str) -> Iterator[Callable[[int, int, str], None]]:
    """Says what takes time, and shows how far it is; the first run also compiles."""
    from drivetrain.report.terminal import console, progress

    screen = console(errors=True)
    if _must_compile():
        screen.print("compiling the dynamics once (about half a minute) ...")
    with progress(screen, text) as step:
        yield step


def _must_compile() -> bool:
    """Whether no compiled dynamics lie beside the package yet."""
    beside = Path(__file__).parent / "dynamics" / "__pycache__"
    return "NUMBA_CACHE_DIR" not in os.environ and not any(beside.glob("*.nbi"))


def _selected(study: Study) -> Selection:
    """The search, with its progress."""
    from drivetrain.sizing.search import select as search

    with _working("searching the catalogues") as step:
        return search(study, progress=step)


def _default_out(study: Study) -> Path:
    """``<study name>_report`` in the working directory."""
    return Path(re.sub(r"[^\w.-]+", "_", study.name).strip("_.") + "_report")


def _deliver(result: Evaluation | Selection, out: Path, *, as_json: bool) -> int:
    """Write the files, print the verdict, and give the exit code."""
    from drivetrain.report.outputs import write_outputs
    from drivetrain.report.result_json import result_json
    from drivetrain.report.table import verdict_lines, verdict_table
    from drivetrain.report.terminal import console, progress
    from drivetrain.sizing.results import Evaluation

    with progress(console(errors=True), "drawing the report"):
        files = write_outputs(out, result)
    screen = console(errors=as_json)
    screen.print(verdict_table(result if isinstance(result, Evaluation) else result.evaluation))
    screen.print()
    for line in verdict_lines(result):
        screen.print(line, soft_wrap=True)
    _say(f"report: {files['report.html']}", errors=as_json)
    if as_json:
        sys.stdout.write(result_json(result))
    return FITS if result.feasible else DOES_NOT_FIT


def _summarise(study: Study, *, errors: bool) -> None:
    """What was read, in a few lines."""
    cycle = study.cycle
    _say(
        f"{study.name}: {len(study.joints)} joints, cycle of {cycle.duration:g} s in {len(cycle.time)} samples",
        errors=errors,
    )
    for task in study.joints:
        given = "no drive given" if task.drive is None else " + ".join(key for key in task.drive if key)
        _say(f"  {task.name}: {given}; {len(task.pairs)} pairs may be chosen", errors=errors)
    _listed("doubts", list(study.notes), most=MOST_NOTES)
    _say("the study can be used", errors=errors)


def _basis(given: list[str]) -> str | dict[str, str]:
    """``dc`` for all, or by maker or key as NAME=BASIS."""
    if not given:
        return ""
    named = dict(text.rpartition("=")[::2] for text in given)
    return named.get("", "") if set(named) == {""} else named
