"""What ``drivetrain simulate`` does with a study."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetrain.commands.chain import chosen, load_chosen
from drivetrain.commands.shared import DOES_NOT_FIT, FITS, FaultCollector, report_folder, say, working, writable

if TYPE_CHECKING:
    from drivetrain.errors import Fault
    from drivetrain.report.pages.simulation_page import SimulationFound
    from drivetrain.simulation.recording import Recording
    from drivetrain.simulation.scene import Scene
    from drivetrain.sizing.results import Evaluation
    from drivetrain.study.parts.simulation import Simulation


@dataclass(frozen=True)
class Asked:
    """What the command line says beside the study; None: what the study says.

    Attributes:
        duration, solver, step, effects, tolerance: As texts.
        resume: Recording to go on from.
        out: Folder for the files.
        verify: Whether to run once more, finer.
    """

    duration: str | None = None
    solver: str | None = None
    step: str | None = None
    effects: str | None = None
    tolerance: str | None = None
    resume: Path | None = None
    out: Path | None = None
    verify: bool = False


def simulate_study(path: Path, asked: Asked, misplaced: Iterable[Fault] = ()) -> int:
    """Run a study's cycle with its drives, and write what happens.

    Args:
        path: The study.
        asked: What the command line says.
        misplaced: Options that mean nothing to a study, told with all other faults.

    Returns:
        The exit code: 0 when every check holds on what was simulated, 1 when one fails or the run was stopped.

    Raises:
        InputError: A faulty study, command line, or recording to go on from.
    """
    from drivetrain.accuracy.costs import interval_of
    from drivetrain.accuracy.decision import basis_of, decision
    from drivetrain.accuracy.study_run import engine_of, study_scene
    from drivetrain.accuracy.verify import verified, whole_run
    from drivetrain.report.pages.simulation_page import SimulationFound, simulation_lines, simulation_report
    from drivetrain.simulation.planning.plan import plan
    from drivetrain.sizing.results import Verdict
    from drivetrain.study.parts.simulation import Simulation
    from drivetrain.whole_files import write_files

    faults, said, earlier = FaultCollector(), Simulation(), None
    faults.faults += misplaced
    with faults:
        writable(asked.out)
    with faults:
        seconds = _duration(asked)
    with faults:
        earlier = _earlier(asked)
    with faults:
        loaded = load_chosen(path)
        said = loaded.simulation
    with faults:
        wishes = _wishes(said, asked)
    with faults:
        whole_run(asked.verify, earlier)
    faults.report()
    result = chosen(loaded, runs=True)
    with working("choosing effects") as step:
        built = study_scene(result, wishes, progress=step)
    ready = plan(built.scene if seconds is None else replace(built.scene, duration=seconds))
    say(str(ready))
    recording = _run(ready.scene, wishes, earlier)
    basis = basis_of(built.full, result)
    if asked.verify:
        with working("once more, finer") as step:
            recording = verified(
                recording, ready.scene, engine_of(wishes), basis, interval=interval_of(ready.scene.duration),
                progress=lambda share: step(round(100.0 * share), 100, "once more, finer"),
            )  # fmt: skip
    inverse = wishes.solver == "inverse"
    whole = not inverse and recording.stopped_by is None
    decided = decision(recording, built.scene, basis) if whole else None
    found = SimulationFound(
        result, recording, decided, str(ready), built.words, _limits(result), wishes.current_bandwidth
    )  # fmt: skip
    folder = asked.out or report_folder(loaded.name)
    with working("drawing"):
        page = simulation_report(found)
    written = write_files(folder, {"simulation.html": page})
    say("")
    for line in simulation_lines(found):
        say(line)
    _save(recording, folder)
    say(f"page: {written['simulation.html']}")
    return _code(found, Verdict.FAIL)


def _code(found: SimulationFound, fail: object) -> int:
    if found.recording.stopped_by is not None:
        return DOES_NOT_FIT
    return DOES_NOT_FIT if found.decision is not None and found.decision.verdict is fail else FITS


def _wishes(study: Simulation, asked: Asked) -> Simulation:
    """The study's wishes, with those of the command line over them."""
    from drivetrain.errors import Fault, InputError, nearest
    from drivetrain.study.parts.simulation import KNOWN_EFFECTS
    from drivetrain.units import quantity

    faults, told = [], study
    if asked.effects is not None:
        names = tuple(name.strip() for name in asked.effects.split(",") if name.strip())
        words = ("auto", "all", "none")
        for name in names:
            if name not in KNOWN_EFFECTS and not (name in words and len(names) == 1):
                hint = nearest(name, [*KNOWN_EFFECTS, *words]) or ", ".join(KNOWN_EFFECTS)
                faults.append(Fault("--effects", "is no effect of a study", name, hint))
        told = replace(told, effects=() if names == ("none",) else names)
    if asked.solver is not None:
        if asked.solver not in ("fixed", "adaptive", "inverse"):
            faults.append(Fault("--solver", "is for arms; a study takes fixed, adaptive or inverse", asked.solver))
        told = replace(told, solver=asked.solver)  # type: ignore[arg-type]
    for name, text, unit in (("step", asked.step, "s"), ("tolerance", asked.tolerance, "")):
        if text is not None:
            try:
                told = replace(told, **{name: quantity(text, unit, f"--{name}", above=0.0)})  # type: ignore[arg-type]
            except InputError as error:
                faults += error.faults
    if faults:
        raise InputError(faults)
    return told


def _duration(asked: Asked) -> float | None:
    from drivetrain.units import quantity

    return None if asked.duration is None else quantity(asked.duration, "s", "--duration", above=0.0)


def _earlier(asked: Asked) -> Recording | None:
    from drivetrain.simulation.recording import load_recording

    return None if asked.resume is None else load_recording(asked.resume)


def _run(scene: Scene, wishes: Simulation, earlier: Recording | None) -> Recording:
    from drivetrain.accuracy.costs import interval_of
    from drivetrain.accuracy.study_run import engine_of
    from drivetrain.simulation.run import simulate

    with working("simulating") as step:
        return simulate(
            scene, solver=engine_of(wishes), interval=interval_of(scene.duration), resume=earlier,
            progress=lambda share: step(round(100.0 * share), 100, "simulating"),
        )  # fmt: skip


def _limits(result: Evaluation) -> dict[str, dict[str, float]]:
    """Of the amplifier's current, and of the voltage that it can give."""
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
    """The recording in both forms, as far as the libraries are there."""
    from importlib.util import find_spec

    where = recording.save(folder / "recording.npz")
    say(f"recording: {where} (drivetrain.simulation.recording.load_recording; --resume goes on from it)")
    if find_spec("pyarrow") is not None:
        say(f"table: {recording.save(folder / 'recording.parquet')} (pandas.read_parquet)")
