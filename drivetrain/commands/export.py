"""The command that writes an arm with its drives for other tools."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.chain import StudyOrResult, chosen, load_chosen
from drivetrain.commands.shared import DOES_NOT_FIT, FITS, FaultCollector, report_faults, say, writable

app = typer.Typer(rich_markup_mode="rich")


class Format(StrEnum):
    """Of other tools."""

    MJCF = "mjcf"
    URDF = "urdf"
    SDF = "sdf"
    ROS2 = "ros2"
    PHYSX = "physx"
    DRAKE = "drake"
    C = "c"


@app.command("export")
def _export(
    study: StudyOrResult,
    to: Annotated[Format, typer.Option("--to", help="The tool's format.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The file to write.")],
    payload: Annotated[
        str | None, typer.Option(metavar="NAME", help="That the tip carries, one of the study's.", show_default=False)
    ] = None,
    rate: Annotated[str, typer.Option(metavar="RATE", help="Of --to c, how often it will be called.")] = "1 kHz",
) -> None:
    """Write the arm with the drives that the study names or selects for another tool, and say what its format loses."""
    with report_faults():
        from drivetrain.control.c_code import write_c
        from drivetrain.control.commander import Commander
        from drivetrain.errors import Fault
        from drivetrain.export.limits import write_drive_urdf, write_physx, write_ros2
        from drivetrain.export.losses import lost
        from drivetrain.export.mjcf import write_mjcf
        from drivetrain.export.sdf import write_sdf
        from drivetrain.units import quantity

        faults, hertz = FaultCollector(), 0.0
        with faults:
            writable(out, file=True)
        with faults:
            hertz = quantity(rate, "Hz", "--rate", above=0.0)
        if payload is not None and to in (Format.ROS2, Format.PHYSX):
            faults.faults.append(Fault("--payload", f"means nothing to {to.value}, which holds drives alone"))
        with faults:
            loaded = load_chosen(study)
        faults.report()
        result = chosen(loaded)
        notes: tuple[str, ...]
        if to is Format.MJCF:
            notes = write_mjcf(result, out, payload=payload)
        elif to is Format.SDF:
            notes = write_sdf(result, out, payload=payload)
        elif to is Format.ROS2:
            notes = write_ros2(result, out)
        elif to is Format.PHYSX:
            notes = write_physx(result, out)
        elif to is Format.C:
            write_c(Commander(result, rate=hertz, payload=payload), out)
            notes = lost("c")
        else:
            notes = write_drive_urdf(result, out, payload=payload)
        for note in notes:
            say(note)
        say(f"{to.value}: {out}")
        say(f"verdict on these drives: {result.verdict}")
        raise typer.Exit(FITS if result.feasible else DOES_NOT_FIT)
