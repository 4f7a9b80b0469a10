"""The command `simulate`: runs a study's arm with its drives, or a bare arm without drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetrain.commands.chain import chosen, load_chosen
from drivetrain.commands.shared import (
    command,
    folder_for,
    inputs,
    lines,
    positive,
    refuse,
    report_folder,
    say,
    working,
    write_page,
)

if TYPE_CHECKING:
    from drivetrain.arm.arm import Arm
    from drivetrain.arrays import Array
    from drivetrain.simulation.planning.plan import Plan
    from drivetrain.simulation.recording import Recording
    from drivetrain.sizing.results import Evaluation
    from drivetrain.solvers.solver import Solver
    from drivetrain.study.model import Study

STUDIES = (".yaml", ".yml", ".json")  # suffixes of study files and results


class Method(StrEnum):
    """Solvers that can be requested by name."""

    ADAPTIVE = "adaptive"
    FIXED = "fixed"
    INVERSE = "inverse"
    RK4 = "rk4"
    SEMI_IMPLICIT = "semi-implicit"
    EULER = "euler"


@command
def simulate(
    what: Annotated[
        str, typer.Argument(metavar="STUDY|RESULT|ARM", help="A study, a result.json, a built-in arm, or a URDF file.")
    ],
    duration: Annotated[
        str | None,
        typer.Option(
            help="Simulated time; the cycle of a study repeats. Default: one cycle; for an arm 3 s.", show_default=False
        ),
    ] = None,
    begin: Annotated[
        str, typer.Option("--from", help="For an arm, its initial position: 30 deg for all joints, or [0, 30, 0] deg.")
    ] = "0 rad",
    start: Annotated[
        str | None,
        typer.Option(
            metavar="equilibrium|STATES",
            show_default=False,
            help="For a study: equilibrium, or values of states: elbow.current=0 A,elbow.speed=0.1 rad/s.",
        ),
    ] = None,
    solver: Annotated[
        Method | None,
        typer.Option(
            help="For a study: fixed, adaptive or inverse; for an arm: adaptive, rk4, semi-implicit or euler."
        ),
    ] = None,
    step: Annotated[str | None, typer.Option(help="Step of the methods with a fixed step.", show_default=False)] = None,
    tip: Annotated[str | None, typer.Option(help="For an arm: name of the link that is the end effector.")] = None,
    effects: Annotated[
        str | None,
        typer.Option(help="For a study: auto, all, none, or names separated by commas.", show_default=False),
    ] = None,
    tolerance: Annotated[
        str | None, typer.Option(metavar="SHARE", help="For --effects auto, such as 1%.", show_default=False)
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(metavar="FILE", help="For a study: continue from this recording.", show_default=False)
    ] = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="For a study: repeat the run with finer steps and show what changes.")
    ] = False,
    out: Annotated[Path | None, folder_for("the recording and its pictures")] = None,
) -> bool:
    """Simulate the cycle of a study with its drives; or the free fall of an arm without drives, friction or losses."""
    if Path(what).suffix.lower() in STUDIES:
        for_arms = {"--from": begin != "0 rad", "--tip": tip}
        misplaced = _not_of("an arm without drives; the study says where it starts", for_arms)
        changes = {"effects": effects, "solver": solver and solver.value, "step": step, "tolerance": tolerance}
        return _run_study(Path(what), misplaced, changes, duration, resume, out, start, verify=verify)
    for_studies = {
        "--effects": effects, "--tolerance": tolerance, "--resume": resume, "--verify": verify, "--start": start,
    }  # fmt: skip
    _run_arm(what, _not_of("studies", for_studies), (duration, begin, step, tip), solver or Method.ADAPTIVE, out)
    return True


def _not_of(whose: str, given: Mapping[str, object]) -> list[Callable[[], None]]:
    """Checks that raise InputError for given options that do not apply here."""
    return [partial(refuse, True, name, f"is for {whose}") for name, value in given.items() if value]


def _run_arm(
    what: str, misplaced: list[Callable[[], None]], request: tuple[str | None, str, str | None, str | None],
    method: Method, out: Path | None,
) -> None:  # fmt: skip
    from drivetrain.arm.files.load import load_arm
    from drivetrain.simulation.passive import simulate_passive

    duration, start, step, tip = request
    width, solver, seconds, begin, loaded, *_ = inputs(
        lambda: positive(step or "1 ms", "s", "--step"),
        lambda: _solver(method),
        lambda: positive(duration or "3 s", "s", "--duration"),
        lambda: _start(load_arm(what), start),
        lambda: load_arm(what, tip=tip),
        *misplaced,
        out=out,
    )
    with working(f"simulating {loaded.name}"):
        recording = simulate_passive(loaded, begin, [0.0] * loaded.n, seconds, solver=solver(width))
    _deliver(recording, out or Path(f"{loaded.name}_recording"))


def _solver(method: Method) -> Callable[[float], Solver]:
    """A function that makes the solver from its step [s]."""
    from drivetrain.solvers.solver import DormandPrince853, Euler, RungeKutta4, SemiImplicitEuler

    known: dict[Method, Callable[[float], Solver]] = {
        Method.ADAPTIVE: lambda step: DormandPrince853(),
        Method.RK4: RungeKutta4,
        Method.SEMI_IMPLICIT: SemiImplicitEuler,
        Method.EULER: Euler,
    }
    problem = "is for studies; an arm takes adaptive, rk4, semi-implicit or euler"
    refuse(method not in known, "--solver", problem, method.value)
    return known[method]


def _start(arm: Arm, text: str) -> Array:
    """Positions of all joints from text in rad or deg; with a single unit, prismatic joints are in metres."""
    import numpy as np

    from drivetrain.units import quantities, quantity

    unit = "m" if any(arm.slides) else "rad"
    if text.lstrip().startswith("["):
        return quantities(text, unit, "--from", arm.n)
    return np.full(arm.n, quantity(text, unit, "--from"))


def _deliver(recording: Recording, folder: Path) -> None:
    from drivetrain.report.charts.plotting import figure_of, house_style, svg_text
    from drivetrain.report.charts.run_charts import recording_charts
    from drivetrain.whole_files import write_files

    with house_style("recording"):
        picture = svg_text(figure_of(recording_charts(recording)), "the recording over time")
    write_files(folder, {"recording.svg": picture})
    where = recording.save(folder / "recording.npz")
    for event in recording.events:
        say(f"{event.time:.3f} s: {event.detail}")
    error = recording["energy_error"]
    say(f"energy error at the end: {error[-1]:.3g} J; " + ", ".join(f"{k} {v}" for k, v in recording.counters.items()))
    if recording.stopped_by:
        say(f"stopped early: {recording.stopped_by}", errors=True)
    say(f"recording: {where} (numpy.load, or drivetrain.load_recording)")
    say(f"picture: {folder / 'recording.svg'}")


def _run_study(
    path: Path, misplaced: list[Callable[[], None]], changes: Mapping[str, str | None],
    duration: str | None, resume: Path | None, out: Path | None, start: str | None, *, verify: bool,
) -> bool:  # fmt: skip
    """Simulate a study's cycle with its drives and write the results; returns whether all checks are satisfied."""
    from drivetrain.accuracy.costs import interval_of
    from drivetrain.accuracy.decision import basis_of, decision
    from drivetrain.accuracy.study_run import engine_of, repeated_within, run_scene, study_scene
    from drivetrain.accuracy.verify import refuse_resumed
    from drivetrain.report.pages.simulation_page import SimulationFound, simulation_lines, simulation_report
    from drivetrain.simulation.planning.plan import plan
    from drivetrain.simulation.recording import load_recording
    from drivetrain.simulation.study_scene import refuse_unsimulated
    from drivetrain.sizing.results import Verdict

    def load() -> Study:
        loaded = load_chosen(path)
        refuse_unsimulated(loaded)
        return loaded

    def recorded() -> Recording | None:
        earlier = None if resume is None else load_recording(resume)
        refuse_resumed(verify, earlier)
        return earlier

    seconds, earlier, loaded, stated, *_ = inputs(
        lambda: positive(duration, "s", "--duration"),
        recorded,
        load,
        lambda: _options(changes),
        lambda: refuse(start is not None and resume is not None, "--start", "goes with a run from its start"),
        *misplaced,
        out=out,
    )
    result, options = chosen(loaded, runs=True), replace(loaded.simulation, **stated)
    if seconds is not None:
        options = repeated_within(loaded, options, seconds)
    with working("choosing effects") as step:
        built = study_scene(result, options, progress=step)
    ready = plan(built.scene if seconds is None else replace(built.scene, duration=seconds))
    say(next(iter(str(ready).splitlines())))
    given = _given(start, ready)
    interval, basis = interval_of(ready.scene.duration), basis_of(built.full, result)
    with _share("simulating") as share:
        recording = run_scene(
            ready, engine_of(options), basis, interval=interval, resume=earlier, progress=share, verify=verify,
            start=given,
        )  # fmt: skip
    whole = options.solver != "inverse" and recording.stopped_by is None
    decided = decision(recording, built.scene, basis) if whole else None
    found = SimulationFound(result, recording, decided, str(ready), built.words, _limits(result))
    with working("drawing"):
        page = simulation_report(found)
    lines(simulation_lines(found))
    write_page(loaded, out, {"simulation.html": page})
    _save(recording, out or report_folder(loaded.name))
    return recording.stopped_by is None and (decided is None or decided.verdict is not Verdict.FAIL)


def _given(text: str | None, scene: Plan) -> str | dict[str, float]:
    from drivetrain.errors import Faults, nearest
    from drivetrain.simulation.run import EQUILIBRIUM
    from drivetrain.units import quantity

    if text is None or text.strip() == EQUILIBRIUM:
        return EQUILIBRIUM
    given: dict[str, float] = {}
    faults, known = Faults(), list(scene.memory.states)
    for part in text.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        if name not in known:
            hint = nearest(name, known) or f"{EQUILIBRIUM}, or NAME=VALUE of {', '.join(known)}"
            faults.add("--start", "is no state of the scene", name, hint)
            continue
        unit = scene.layout.recorded[name][1]
        found = faults.attempt(quantity, value, "degC" if unit == "C" else unit, f"--start {name}")
        given |= {} if found is None else {name: found}
    faults.raise_any()
    return given


@contextmanager
def _share(text: str) -> Iterator[Callable[[float], None]]:
    """Context that shows the progress of a run as the simulated share of its time."""
    with working(text) as step:
        yield lambda share: step(round(100.0 * share), 100, text)


def _options(given: Mapping[str, str | None]) -> dict[str, Any]:
    """The simulation options that the command line states, as fields of a study's own."""
    from drivetrain.errors import Faults
    from drivetrain.study.parts.simulation import read_effects

    faults = Faults()
    changes: dict[str, Any] = {}
    if (effects := given["effects"]) is not None:
        names = [name.strip() for name in effects.split(",") if name.strip()]
        changes["effects"] = faults.attempt(read_effects, names[0] if len(names) == 1 else names, "--effects")
    if (solver := given["solver"]) is not None:
        if solver not in ("fixed", "adaptive", "inverse"):
            faults.add("--solver", "is for arms; a study takes fixed, adaptive or inverse", solver)
        changes["solver"] = solver
    for name, unit in (("step", "s"), ("tolerance", "")):
        if (text := given[name]) is not None:
            changes[name] = faults.attempt(positive, text, unit, f"--{name}")
    faults.raise_any()
    return changes


def _limits(result: Evaluation) -> dict[str, dict[str, float]]:
    """Limits of the amplifier's current [A] and of its output voltage [V], by joint."""
    from drivetrain.drive.amplifier import available_voltage

    study = result.study
    found = {
        task.name: {
            "current": task.amplifier.peak_current or math.inf,
            "voltage": available_voltage(task.amplifier, study.supply.voltage),
        }
        for task in study.joints
    }
    return {name: {k: v for k, v in own.items() if math.isfinite(v)} for name, own in found.items()}


def _save(recording: Recording, folder: Path) -> None:
    """Save the recording as .npz, and as .parquet if the library for it is installed."""
    from importlib.util import find_spec

    where = recording.save(folder / "recording.npz")
    say(f"recording: {where} (drivetrain.load_recording; --resume continues from it)")
    if find_spec("pyarrow") is not None:
        say(f"table: {recording.save(folder / 'recording.parquet')} (pandas.read_parquet)")
