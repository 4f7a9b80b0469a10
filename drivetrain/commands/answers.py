"""The commands that answer a question about a selection: why-not."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.shared import DOES_NOT_FIT, FITS, report_folder, say, told, working

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
    with told():
        from drivetrain.report.outputs import write_files
        from drivetrain.report.why_not_page import why_not_lines, why_not_report
        from drivetrain.sizing.why_not import why_not
        from drivetrain.study.load import load_study

        loaded = load_study(study)
        with working("looking for what would let it pass"):
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
