"""The command that judges many studies that differ in some entries."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.shared import command, inputs, refuse, say, working


@command
def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="The sweep, a YAML file.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder of the results.")] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes on this machine; 0: one point after another. Default: one per core.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A running dask scheduler, such as tcp://host:8786.")
    ] = None,
) -> bool:
    """Select or size at every combination of values, on all cores or a cluster; run it again to resume."""
    _demand_libraries()
    from drivetrain.report.pages.sweep_page import sweep_report
    from drivetrain.study.read import study_from
    from drivetrain.sweep.points import read_sweep
    from drivetrain.sweep.run import run_sweep
    from drivetrain.sweep.shards import read_results
    from drivetrain.whole_files import write_files

    _, sweep = inputs(
        lambda: refuse(workers is not None and workers < 0, "--workers", "must be 0 or more", workers),
        lambda: read_sweep(file),
        out=out,
    )
    folder = out or Path(f"{file.stem}_results")
    say(f"{len(sweep)} points in {sweep.shards} file{'s' * (sweep.shards != 1)}: {' x '.join(sweep.names)}")
    with working("judging points") as step:
        computed = run_sweep(sweep, folder, workers=workers, scheduler=scheduler, progress=step)
    results = read_results(folder)
    fits = int(results["feasible"].sum())
    say(f"files computed: {computed}, found: {sweep.shards - computed}; {fits} of {len(results)} points fit")
    written = write_files(folder, {"sweep.html": sweep_report(study_from(sweep.document), results, sweep.names)})
    say(f"results: {folder / 'shards'} (Parquet)")
    say(f"page: {written['sweep.html']}")
    return fits > 0


def _demand_libraries() -> None:
    """What only sweeps need is an extra."""
    from importlib.util import find_spec

    lacking = [name for name in ("distributed", "pyarrow") if find_spec(name) is None]
    problem = f"needs {' and '.join(lacking)}, which are not installed"
    refuse(lacking, "drivetrain sweep", problem, hint="pip install 'drivetrain[sweep]'")
