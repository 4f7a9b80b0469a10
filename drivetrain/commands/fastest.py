"""The command that finds the fastest cycle of given drives."""

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
    working,
    writable,
)

app = typer.Typer(rich_markup_mode="rich")


@app.command("fastest")
def _fastest(
    study: StudyOrResult,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="Folder for the report of that cycle, and motion.csv.", show_default=False
        ),
    ] = None,
) -> None:
    """Find the fastest cycle that the drives can hold, dwells kept, and which limit binds each move."""
    with report_faults():
        from drivetrain.report.outputs import write_outputs
        from drivetrain.report.verdict_lines import fastest_lines, motion_csv
        from drivetrain.sizing.answers.fastest import fastest
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            loaded = load_chosen(study)
        faults.report()
        drives = chosen(loaded).drives
        with working("finding the fastest cycle"):
            found = fastest(loaded, drives)
        lines(fastest_lines(found))
        folder = out or report_folder(loaded.name)
        files = write_outputs(folder, found.evaluation)
        written = write_files(folder, {"motion.csv": motion_csv(found.study)})
        say(f"motion: {written['motion.csv']}")
        say(f"report: {files['report.html']}")
        raise typer.Exit(FITS if found.feasible else DOES_NOT_FIT)
