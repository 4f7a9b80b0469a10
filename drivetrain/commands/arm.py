"""The commands around an arm without drives: simulate."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetrain.commands.shared import FITS, say, told, working

if TYPE_CHECKING:
    from drivetrain.arm.arm import Arm
    from drivetrain.arrays import Array
    from drivetrain.simulation.recording import Recording
    from drivetrain.solvers.solver import Solver

app = typer.Typer(rich_markup_mode="rich")


class Method(StrEnum):
    """Solvers that can be asked for by name."""

    ADAPTIVE = "adaptive"
    RK4 = "rk4"
    SEMI_IMPLICIT = "semi-implicit"
    EULER = "euler"


@app.command("simulate")
def _simulate(
    arm: Annotated[str, typer.Argument(metavar="ARM", help="A built-in arm, or a URDF file.")],
    duration: Annotated[str, typer.Option(help="How long.")] = "3 s",
    start: Annotated[
        str, typer.Option("--from", help="Where it starts: 30 deg for all joints, or [0, 30, 0] deg.")
    ] = "0 rad",
    solver: Annotated[Method, typer.Option(help="The method.")] = Method.ADAPTIVE,
    step: Annotated[str, typer.Option(help="Of the methods with a fixed step.")] = "1 ms",
    tip: Annotated[str | None, typer.Option(help="Name of the link that is the end effector.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for recording.npz and recording.svg.", show_default=False),
    ] = None,
) -> None:
    """Let a passive arm go: its motion under gravity, without drives, friction or losses."""
    with told():
        from drivetrain.arm.load import load_arm
        from drivetrain.simulation.passive import simulate_passive
        from drivetrain.units import quantity

        loaded = load_arm(arm, tip=tip)
        method, seconds = _solver(solver, step), quantity(duration, "s", "--duration", above=0.0)
        position, rest = _start(loaded, start), [0.0] * loaded.n
        with working(f"simulating {loaded.name}"):
            recording = simulate_passive(loaded, position, rest, seconds, solver=method)
        _deliver(recording, out or Path(f"{loaded.name}_recording"))
        raise typer.Exit(FITS)


def _solver(method: Method, step: str) -> Solver:
    from drivetrain.solvers.adaptive import DormandPrince853
    from drivetrain.solvers.explicit import Euler, RungeKutta4, SemiImplicitEuler
    from drivetrain.units import quantity

    if method is Method.ADAPTIVE:
        return DormandPrince853()
    fixed: dict[Method, Callable[[float], Solver]] = {
        Method.RK4: RungeKutta4,
        Method.SEMI_IMPLICIT: SemiImplicitEuler,
        Method.EULER: Euler,
    }
    return fixed[method](quantity(step, "s", "--step", above=0.0))


def _start(arm: Arm, text: str) -> Array:
    """Positions of all joints: radians or degrees, metres where a joint slides and only one unit is given."""
    import numpy as np

    from drivetrain.units import quantities, quantity

    unit = "rad" if arm.screws[:, :3].any(axis=1).all() else "m"
    if text.lstrip().startswith("["):
        return quantities(text, unit, "--from", arm.n)
    return np.full(arm.n, quantity(text, unit, "--from"))


def _deliver(recording: Recording, folder: Path) -> None:
    """Write the recording and its picture, and say what is in them."""
    from drivetrain.report.figures_recording import figure_recording
    from drivetrain.report.outputs import write_files
    from drivetrain.report.svg import house_style, svg_text

    with house_style("recording"):
        picture = svg_text(figure_recording(recording), "the recording over time")
    write_files(folder, {"recording.svg": picture})
    where = recording.save(folder / "recording.npz")
    for event in recording.events:
        say(f"{event.time:.3f} s: {event.detail}")
    error = recording["energy_error"]
    say(f"energy error at the end: {error[-1]:.3g} J; " + ", ".join(f"{k} {v}" for k, v in recording.counters.items()))
    if recording.stopped_by:
        say(f"stopped early: {recording.stopped_by}", errors=True)
    say(f"recording: {where} (numpy.load, or drivetrain.simulation.recording.load_recording)")
    say(f"picture: {folder / 'recording.svg'}")
