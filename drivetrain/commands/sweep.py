"""The command that judges many studies that differ in some entries."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.shared import DOES_NOT_FIT, FITS, FaultCollector, report_faults, say, working, writable

app = typer.Typer(rich_markup_mode="rich")


@app.command("sweep")
def _sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="What to vary, a YAML file.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder of the results.")] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes on this machine; 0: one point after another.  [default: one a core]")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A running dask scheduler, such as tcp://host:8786.")
    ] = None,
) -> None:
    """Select or size at every combination of values, on all cores or a cluster; run it again to go on."""
    with report_faults():
        _demand_libraries()
        from drivetrain.errors import Fault, InputError
        from drivetrain.report.pages.sweep_page import sweep_report
        from drivetrain.study.read import study_from
        from drivetrain.sweep.points import read_sweep
        from drivetrain.sweep.run import run_sweep
        from drivetrain.sweep.shards import read_results
        from drivetrain.whole_files import write_files

        faults = FaultCollector()
        with faults:
            writable(out)
        with faults:
            if workers is not None and workers < 0:
                raise InputError(Fault("--workers", "must be 0 or more", workers))
        with faults:
            sweep = read_sweep(file)
        faults.report()
        folder = out or Path(f"{file.stem}_results")
        say(f"{len(sweep)} points in {sweep.shards} shards: {' x '.join(sweep.names)}")
        with working("judging points") as step:
            computed = run_sweep(sweep, folder, workers=workers, scheduler=scheduler, progress=step)
        results = read_results(folder)
        fits = int(results["feasible"].sum())
        say(f"{computed} shards computed, {sweep.shards - computed} found done; {fits} of {len(results)} points fit")
        written = write_files(folder, {"sweep.html": sweep_report(study_from(sweep.document), results, sweep.names)})
        say(f"results: {folder / 'shards'} (Parquet)")
        say(f"page: {written['sweep.html']}")
        raise typer.Exit(FITS if fits else DOES_NOT_FIT)


def _demand_libraries() -> None:
    """What only sweeps need is an extra."""
    from importlib.util import find_spec

    from drivetrain.errors import Fault, InputError

    lacking = [name for name in ("distributed", "pyarrow") if find_spec(name) is None]
    if lacking:
        problem = f"needs {' and '.join(lacking)}, which are not installed"
        raise InputError(Fault("drivetrain sweep", problem, hint="pip install 'drivetrain[sweep]'"))
