"""The command that writes what to command."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetrain.commands.chain import StudyOrResult, chosen, load_chosen
from drivetrain.commands.shared import DOES_NOT_FIT, FITS, FaultCollector, report_faults, say, writable

if TYPE_CHECKING:
    from drivetrain.sizing.results import Evaluation

app = typer.Typer(rich_markup_mode="rich")


class Scale(StrEnum):
    """In what an amplifier takes its current."""

    CIA402 = "cia402"
    AMPERES = "amperes"
    ANALOGUE = "analogue"
    COUNTS = "counts"


class Basis(StrEnum):
    """What its ampere is."""

    DC = "dc"
    RMS = "rms"
    PEAK = "peak"
    TORQUE = "torque"


@app.command("currents")
def _currents(
    study: StudyOrResult,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FILE", help="The file to write: .csv; with --scale also a C header .h, or a "
                     "ROS 2 JointTrajectory .yaml."),
    ] = Path("currents.csv"),
    rate: Annotated[
        str | None,
        typer.Option(metavar="RATE", help="Of the amplifier's commands, such as 1kHz.  [default: the cycle's samples]",
                     show_default=False),
    ] = None,
    hold: Annotated[
        int, typer.Option(min=0, max=1, help="Between two samples: 1 the straight line, 0 the sample before.")
    ] = 1,
    scale: Annotated[
        Scale | None,
        typer.Option(help="In what the amplifiers take it.  [default: a table with all that makes up each current]",
                     show_default=False),
    ] = None,
    basis: Annotated[
        Basis | None,
        typer.Option(help="What their ampere is; for cia402 what object 0x6075 holds, or torque where 0x6076 counts.",
                     show_default=False),
    ] = None,
    full_scale: Annotated[
        list[str] | None,
        typer.Option(metavar="[JOINT=]VALUE", help="Current of 10 V or 32767 counts, for cia402 rated current or "
                     "torque; of all joints or of one, may be given several times.", show_default=False),
    ] = None,
) -> None:  # fmt: skip
    """Write the current command of every joint over the cycle, for the drives that the study names or selects."""
    with report_faults():
        from drivetrain.errors import Fault
        from drivetrain.export.currents import write_currents
        from drivetrain.export.scales import current_scales
        from drivetrain.report.outputs import currents_csv
        from drivetrain.units import quantity
        from drivetrain.whole_files import write_files

        faults, hertz = FaultCollector(), None
        with faults:
            writable(out, file=True)
        with faults:
            hertz = None if rate is None else quantity(rate, "Hz", "--rate", above=0.0)
        given = {"--basis": basis, "--full-scale": full_scale}
        faults.faults += [Fault(name, "needs --scale") for name, value in given.items() if value and scale is None]
        with faults:
            loaded = load_chosen(study)
        faults.report()
        result = chosen(loaded)
        if scale is None:
            write_files(out.parent, {out.name: currents_csv(result, rate=hertz, hold=hold)})
        else:
            full = _full_scales(full_scale, result, basis)
            scales = current_scales(result, scale.value, basis=None if basis is None else basis.value, full_scale=full)
            write_currents(result, out, scales, rate=hertz, hold=hold)
        say(f"currents: {out}")
        say(f"verdict on these drives: {result.verdict}")
        raise typer.Exit(FITS if result.feasible else DOES_NOT_FIT)


def _full_scales(texts: list[str] | None, result: Evaluation, basis: Basis | None) -> dict[str, float]:
    """By joint name, what is said of all first."""
    from drivetrain.units import quantity

    unit, faults, found = "N m" if basis is Basis.TORQUE else "A", FaultCollector(), dict[str, float]()
    for text in sorted(texts or (), key=lambda text: "=" in text):
        name, _, value = text.rpartition("=")
        with faults:
            number = quantity(value, unit, f"--full-scale {name}".strip(), above=0.0)
            found |= dict.fromkeys([name] if name else result.joints, number)
    faults.report()
    return found
