"""The commands `currents` (current commands for amplifiers) and `export` (the arm with its drives for other tools)."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetrain.commands.chain import chosen, load_chosen
from drivetrain.commands.shared import StudyOrResult, command, inputs, lines, positive, refuse, writable

if TYPE_CHECKING:
    from drivetrain.sizing.results import Evaluation


class Scale(StrEnum):
    """Unit in which an amplifier expects its current command."""

    CIA402 = "cia402"
    AMPERES = "amperes"
    ANALOGUE = "analogue"
    COUNTS = "counts"


class Basis(StrEnum):
    """Basis of an amplifier's currents."""

    DC = "dc"
    RMS = "rms"
    PEAK = "peak"
    TORQUE = "torque"


class Format(StrEnum):
    """Export formats."""

    MJCF = "mjcf"
    URDF = "urdf"
    SDF = "sdf"
    ROS2 = "ros2"
    PHYSX = "physx"
    DRAKE = "drake"
    C = "c"
    FMU = "fmu"


DRIVES_ALONE = (Format.ROS2, Format.PHYSX, Format.FMU)


@command
def currents(
    study: StudyOrResult,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FILE", help="The file to write: .csv; with --scale also a C header .h, or a "
                     "ROS 2 JointTrajectory .yaml."),
    ] = Path("currents.csv"),
    rate: Annotated[
        str | None,
        typer.Option(metavar="RATE", help="Rate of commands, such as 1kHz. Default: the cycle's samples.",
                     show_default=False),
    ] = None,
    hold: Annotated[
        int, typer.Option(min=0, max=1, help="Between two samples: 1 linear, 0 hold the sample before.")
    ] = 1,
    scale: Annotated[
        Scale | None,
        typer.Option(help="Units of the amplifiers. Default: a table with the terms of each current.",
                     show_default=False),
    ] = None,
    basis: Annotated[
        Basis | None,
        typer.Option(help="Basis of their currents; for cia402 that of object 0x6075, or torque where 0x6076 counts.",
                     show_default=False),
    ] = None,
    full_scale: Annotated[
        list[str] | None,
        typer.Option(metavar="[JOINT=]VALUE", help="Current of 10 V or 32767 counts, for cia402 rated current or "
                     "torque; of all joints or of one; may be repeated.", show_default=False),
    ] = None,
) -> bool:  # fmt: skip
    """Compute the current to command of every joint over the cycle, for the drives that the study names or selects."""
    from drivetrain.export.currents import current_scales, write_currents
    from drivetrain.report.outputs import currents_csv
    from drivetrain.whole_files import write_files

    plain = scale is None and out.suffix.lower() != ".csv"
    _, hertz, *_, loaded = inputs(
        lambda: writable(out, file=True),
        lambda: positive(rate, "Hz", "--rate"),
        lambda: refuse(plain, "--out", "must end in .csv without --scale", out.name),
        lambda: refuse(basis and scale is None, "--basis", "needs --scale"),
        lambda: refuse(full_scale and scale is None, "--full-scale", "needs --scale"),
        lambda: load_chosen(study),
    )
    result = chosen(loaded)
    if scale is None:
        write_files(out.parent, {out.name: currents_csv(result, rate=hertz, hold=hold)})
    else:
        full = _full_scales(full_scale or [], result, "N m" if basis is Basis.TORQUE else "A")
        scales = current_scales(result, scale.value, basis=None if basis is None else basis.value, full_scale=full)
        write_currents(result, out, scales, rate=hertz, hold=hold)
    lines([f"currents: {out}", f"verdict on these drives: {result.verdict}"])
    return result.feasible


def _full_scales(texts: list[str], result: Evaluation, unit: str) -> dict[str, float]:
    pairs = [text.rpartition("=")[::2] for text in sorted(texts, key=lambda text: "=" in text)]
    names = [name for name, _ in pairs]
    values = inputs(*(partial(positive, value, unit, f"--full-scale {name}".strip()) for name, value in pairs))
    found: dict[str, float] = {}
    for name, value in zip(names, values, strict=True):
        found |= dict.fromkeys([name] if name else result.joints, value)
    return found


@command
def export(
    study: StudyOrResult,
    to: Annotated[
        Format,
        typer.Option(
            "--to",
            help="mjcf: MuJoCo. urdf: ROS, pinocchio. sdf: Gazebo, Drake. ros2: joint limits, ros2_control "
            "tags. physx: envelopes for Isaac Sim. drake: URDF for Drake. c: dt.Commander in C99. fmu: one drive.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The file to write.")],
    payload: Annotated[
        str | None, typer.Option(metavar="NAME", help="Payload at the tip, one of the study's.", show_default=False)
    ] = None,
    rate: Annotated[str, typer.Option(metavar="RATE", help="For --to c: how often it will be called.")] = "1 kHz",
    joint: Annotated[
        str | None, typer.Option(metavar="NAME", help="For --to fmu: the joint of the drive.", show_default=False)
    ] = None,
    springs: Annotated[
        bool, typer.Option("--springs", help="For --to fmu: the gear's spring and backlash, if its row gives them.")
    ] = False,
) -> bool:
    """Export the arm with its drives for another tool, and list what its format cannot represent."""
    from drivetrain.control.c_code import write_c
    from drivetrain.control.commander import Commander
    from drivetrain.export.fmu import write_fmu
    from drivetrain.export.limits import write_drive_urdf, write_physx, write_ros2
    from drivetrain.export.losses import lost, refuse_unsupported
    from drivetrain.export.mjcf import write_mjcf
    from drivetrain.export.sdf import write_sdf

    bare = payload is not None and to in DRIVES_ALONE
    _, hertz, *_, loaded = inputs(
        lambda: writable(out, file=True),
        lambda: positive(rate, "Hz", "--rate"),
        lambda: refuse(bare, "--payload", f"means nothing to {to.value}, which holds drives alone"),
        lambda: refuse(joint is not None and to is not Format.FMU, "--joint", f"means nothing to {to.value}"),
        lambda: refuse(springs and to is not Format.FMU, "--springs", f"means nothing to {to.value}"),
        lambda: refuse(joint is None and to is Format.FMU, "--joint", "is needed: an FMU holds the drive of one joint"),
        lambda: load_chosen(study),
    )
    if loaded.arm is not None:  # checked before drives are selected
        refuse_unsupported(loaded.arm, to.value)
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
    elif to is Format.FMU:
        notes = write_fmu(result, out, joint=joint or "", springs=springs)
    else:
        notes = tuple(dict.fromkeys((*write_drive_urdf(result, out, payload=payload), *lost(to.value))))
    names = [one.name for one in result.study.payloads]
    if payload is None and names and to not in DRIVES_ALONE:
        notes = (*notes, f"the tip carries nothing: --payload takes {' or '.join(names)}")
    written = out.with_suffix(".c") if to is Format.C else out
    lines([*notes, f"{to.value}: {written}", f"verdict on these drives: {result.verdict}"])
    return result.feasible
