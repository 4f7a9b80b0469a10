"""The command that lets things run: a study's arm with its drives, or an arm without any."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetrain.commands.shared import FITS, FaultCollector, report_faults, say, working, writable

if TYPE_CHECKING:
    from drivetrain.arm.arm import Arm
    from drivetrain.arrays import Array
    from drivetrain.errors import Fault
    from drivetrain.simulation.recording import Recording
    from drivetrain.solvers.solver import Solver

app = typer.Typer(rich_markup_mode="rich")

STUDIES = (".yaml", ".yml", ".json")  # what the file of a study or a result ends in


class Method(StrEnum):
    """Solvers that can be asked for by name."""

    ADAPTIVE = "adaptive"
    FIXED = "fixed"
    INVERSE = "inverse"
    RK4 = "rk4"
    SEMI_IMPLICIT = "semi-implicit"
    EULER = "euler"


@app.command("simulate")
def _simulate(
    what: Annotated[
        str, typer.Argument(metavar="STUDY|RESULT|ARM", help="A study, a result.json, a built-in arm, or a URDF file.")
    ],
    duration: Annotated[
        str | None, typer.Option(help="How long.  [default: the study's cycle; of an arm 3 s]", show_default=False)
    ] = None,
    start: Annotated[
        str, typer.Option("--from", help="Of an arm, where it starts: 30 deg for all joints, or [0, 30, 0] deg.")
    ] = "0 rad",
    solver: Annotated[
        Method | None,
        typer.Option(help="Of a study fixed, adaptive or inverse; of an arm adaptive, rk4, semi-implicit or euler."),
    ] = None,
    step: Annotated[str | None, typer.Option(help="Of the methods with a fixed step.", show_default=False)] = None,
    tip: Annotated[str | None, typer.Option(help="Of an arm, name of the link that is the end effector.")] = None,
    effects: Annotated[
        str | None,
        typer.Option(help="Of a study: auto, all, none, or names separated by commas.", show_default=False),
    ] = None,
    tolerance: Annotated[
        str | None, typer.Option(metavar="SHARE", help="For --effects auto, such as 1%.", show_default=False)
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Of a study: go on from this recording.", show_default=False)
    ] = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="Of a study: run once more, finer, and show what that changes.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the recording and its pictures.", show_default=False),
    ] = None,
) -> None:
    """Let a study's arm run its cycle with its drives; or let a passive arm go, without drives, friction or losses."""
    with report_faults():
        if Path(what).suffix.lower() in STUDIES:
            from drivetrain.commands.simulation import Asked, simulate_study

            asked = Asked(
                duration, None if solver is None else solver.value, step, effects, tolerance, resume, out, verify
            )
            whose = "an arm without drives; the study says where it starts"
            misplaced = _not_of(whose, {"--from": start != "0 rad", "--tip": tip})
            raise typer.Exit(simulate_study(Path(what), asked, misplaced))
        from drivetrain.arm.load import load_arm
        from drivetrain.simulation.passive import simulate_passive
        from drivetrain.units import quantity

        faults = FaultCollector()
        faults.faults += _not_of(
            "studies", {"--effects": effects, "--tolerance": tolerance, "--resume": resume, "--verify": verify}
        )
        with faults:
            writable(out)
        with faults:
            width = quantity(step or "1 ms", "s", "--step", above=0.0)
        with faults:
            method = _solver(solver or Method.ADAPTIVE)
        with faults:
            seconds = quantity(duration or "3 s", "s", "--duration", above=0.0)
        with faults:
            loaded = load_arm(what)
            position, rest = _start(loaded, start), [0.0] * loaded.n
        with faults:
            loaded = load_arm(what, tip=tip)
        faults.report()
        with working(f"simulating {loaded.name}"):
            recording = simulate_passive(loaded, position, rest, seconds, solver=method(width))
        _deliver(recording, out or Path(f"{loaded.name}_recording"))
        raise typer.Exit(FITS)


def _not_of(whose: str, given: dict[str, object]) -> list[Fault]:
    """Options that are given and mean nothing here."""
    from drivetrain.errors import Fault

    return [Fault(name, f"is for {whose}") for name, value in given.items() if value]


def _solver(method: Method) -> Callable[[float], Solver]:
    """Makes the solver from its step [s]."""
    from drivetrain.solvers.solver import DormandPrince853, Euler, RungeKutta4, SemiImplicitEuler

    known: dict[Method, Callable[[float], Solver]] = {
        Method.ADAPTIVE: lambda step: DormandPrince853(),
        Method.RK4: RungeKutta4,
        Method.SEMI_IMPLICIT: SemiImplicitEuler,
        Method.EULER: Euler,
    }
    if method not in known:
        from drivetrain.errors import Fault, InputError

        raise InputError(
            Fault("--solver", "is for studies; an arm takes adaptive, rk4, semi-implicit or euler", method.value)
        )
    return known[method]


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
    from drivetrain.report.charts.figures import figure_recording
    from drivetrain.report.charts.plotting import house_style, svg_text
    from drivetrain.whole_files import write_files

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
