"""The command that identifies an arm from a recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.shared import command, inputs, lines, refuse, say, working


@command
def identify(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a YAML file with an arm.")],
    recording: Annotated[
        Path,
        typer.Argument(metavar="RECORDING", help="Positions and torques or currents: .csv, .npz, .parquet, .mat, or a "
                       "ROS bag."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for study, arm, tables and report.")] = Path(
        "identified"
    ),
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=MEANING", help="Meaning of a column, such as \"phi=q \\[deg]\"; may "
                     "be repeated.", show_default=False),
    ] = None,
    load_friction: Annotated[
        bool, typer.Option("--load-friction", help="Also identify friction proportional to the load.")
    ] = False,
) -> None:  # fmt: skip
    """Identify bodies and friction of the arm from a recording, and write the study with them."""
    from drivetrain.identification.fit import identify
    from drivetrain.identification.outputs import write_identification
    from drivetrain.motion.recording import read_recording
    from drivetrain.study.read import load_study

    loaded, *_ = inputs(
        lambda: load_study(study),
        *(partial(refuse, "=" not in pair, "--column", "must be NAME=MEANING", pair) for pair in column or ()),
        out=out,
    )
    refuse(loaded.arm is None, "study", "has no arm to identify", str(study))
    names = dict(pair.split("=", 1) for pair in column or ())
    measured = read_recording(recording, loaded.arm.joint_names, columns=names)
    with working("identifying"):
        found = identify(loaded, measured, load_friction=load_friction)
        files = write_identification(found, out)
    say("RMS torque on data held out [N m or N]: measured, error of the study's model, error of the identified one")
    for joint, row in found.errors.iterrows():
        say(f"  {joint}: {row['measured']:.4g}, {row['given']:.4g}, {row['identified']:.4g}")
    lines(f"note: {note}" for note in found.notes)
    say(f"written: {', '.join(str(path) for path in files.values())}")
