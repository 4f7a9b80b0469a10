"""Simulation of a study: choice of drives, effects and engine, for Python and for the command."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.accuracy.auto import COARSE, choose_effects
from drivetrain.accuracy.costs import interval_of
from drivetrain.accuracy.decision import Basis, basis_of
from drivetrain.accuracy.scenes import full_scene, wanted_scene, without
from drivetrain.accuracy.verify import refuse_resumed, scaled, verified
from drivetrain.drive.drive import Drive
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import GAP_ALLOWED
from drivetrain.simulation import run
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine, Progress
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.scene import Scene
from drivetrain.simulation.study_scene import refuse_unsimulated
from drivetrain.sizing.as_one import judged_to_run
from drivetrain.sizing.judge.evaluate import Given, evaluate, evaluate_drives
from drivetrain.sizing.results import Evaluation, Selection, every_drive
from drivetrain.sizing.search.search import select
from drivetrain.solvers.solver import Rodas5P, Solver, check_positive
from drivetrain.study.model import Study
from drivetrain.study.parts.mounting import motor_pairs
from drivetrain.study.parts.simulation import KNOWN_EFFECTS, Simulation

FIRST_SHARE = 0.25  # of a verified run: it is repeated with more rows, and with twice as many steps


@dataclass(frozen=True, eq=False)
class StudyScene:
    """The scene of a study with the effects that its ``simulation`` section selects."""

    full: Scene  # with every effect for which data sheets and study have values, without feed-forward
    scene: Scene  # with the selected effects, ready to run
    words: str  # a description of the selection


def simulate(
    scene: Scene | Plan | Study | Evaluation | Selection,
    *,
    drives: Mapping[str, Drive] | Mapping[str, Given] | None = None,
    solver: Engine | Solver | None = None,
    duration: float | None = None,
    interval: float | None = None,
    resume: Recording | None = None,
    progress: Progress | None = None,
    verify: bool = False,
    start: str | Mapping[str, float] = run.EQUILIBRIUM,
) -> Recording:
    """Simulate a scene, or the drives of a study on its cycle.

    Args:
        scene: A scene or its plan. Or a study, which is simulated with its own drives, or else with those that
            ``select`` chooses, with the effects and the engine of its ``simulation`` section. Or the result of
            ``evaluate`` or ``select``.
        drives: For a study, the drives by joint name: ``Drive`` objects, or keys of (motor, gear).
        solver: The engine; None: that of the study, or fixed implicit steps of 1 ms. A solver that runs compiled, such
            as Rodas5P(rtol=1e-6), selects the adaptive engine with this solver.
        duration: Duration of the run, instead of that of the scene [s]; a study's cycle is repeated within it, if it is
            closed.
        interval: Time between two output rows [s]; None: 10 ms for a scene; 1 ms for a study, longer for a long cycle.
        resume: A recording of the same scene that ended earlier or was stopped; the run continues from its end.
        progress: Called with the finished share after every few thousand steps; returning False stops the run.
        verify: Repeat the run at half the step or a tenth of the tolerance: ``verified`` of the recording contains
            both values of all decision quantities, and an event reports a change of more than 1 %.
        start: ``equilibrium``: springs, currents, integrators and loops hold the load, so that nothing moves that is
            not commanded to; ``about["start"]`` describes it. Or given initial states, by name [their own units]; the
            others are in equilibrium.

    Returns:
        ``<joint>.position`` and all other states and signals, energies of all powers, ``stored_energy`` and
        ``energy_error`` where they can be computed; counters, events, and the data to resume the run.

    Raises:
        InputError: A contradictory scene, a study for which no drives fit or that cannot be simulated, or a recording
            of another scene to resume.
    """
    if not isinstance(scene, Study | Evaluation | Selection):  # ``run.simulate`` reports anything that is no scene
        if drives is not None:
            raise InputError(Fault("drives", "go with a study", hint="a scene holds its drives as effects"))
        usual = run.DEFAULT_INTERVAL if interval is None else interval
        ready, basis, engine = scene, None, run.engine_of(solver)
    else:
        evaluation = judged_to_run(_evaluation(scene, drives))
        settings = evaluation.study.simulation
        if duration is not None:
            check_positive("duration", duration, "s")
            settings = repeated_within(evaluation.study, settings, duration)
        built = study_scene(evaluation, settings)
        ready, basis = built.scene, basis_of(built.full, evaluation)
        usual = interval_of(built.scene.duration if duration is None else duration) if interval is None else interval
        engine = engine_of(settings) if solver is None else run.engine_of(solver)
    return run_scene(
        ready, engine, basis, duration=duration, interval=usual, resume=resume, progress=progress, verify=verify,
        start=start,
    )  # fmt: skip


def run_scene(
    scene: Scene | Plan,
    engine: Engine,
    basis: Basis | None,
    *,
    interval: float,
    duration: float | None = None,
    resume: Recording | None = None,
    progress: Progress | None = None,
    verify: bool = False,
    start: str | Mapping[str, float] = run.EQUILIBRIUM,
) -> Recording:
    """The recording of a scene, with ``verify`` of a finer run too; options as of ``simulate``.

    ``basis``: what the decision quantities are computed from; None: the scene itself.
    """
    refuse_resumed(verify, resume)
    if verify:
        engine.finer()  # refuses an engine that has none before it runs
    if not (progress is None or callable(progress)):
        raise InputError(Fault("progress", "must be a function of the finished share", progress))
    recording = run.simulate(
        scene, solver=engine, duration=duration, interval=interval, resume=resume, start=start,
        progress=scaled(progress, 0.0, FIRST_SHARE if verify else 1.0),
    )  # fmt: skip
    if not verify:
        return recording
    same = scene.scene if isinstance(scene, Plan) else scene
    if duration is not None:
        same = replace(same, duration=float(duration))
    return verified(
        recording, same, engine, basis or basis_of(same), interval=interval, start=start,
        progress=scaled(progress, FIRST_SHARE, 1.0 - FIRST_SHARE),
    )  # fmt: skip


def study_scene(
    evaluation: Evaluation, settings: Simulation, *, progress: Callable[[int, int, str], None] | None = None
) -> StudyScene:
    """The scene of evaluated drives on the study's cycle, with the effects that ``settings`` selects."""
    full, pairs = full_scene(evaluation, settings), _pairs_text(evaluation)
    if settings.effects == ("auto",):
        found = choose_effects(
            full, basis_of(full, evaluation), tolerance=settings.tolerance, tip_tolerance=settings.tip_tolerance,
            step=min(settings.step, COARSE), progress=progress,
        )  # fmt: skip
        gone = ", ".join(f"{one.label} of {one.choice.joint}" for one in found.dropped) or "nothing"
        proof = "" if found.proof is None else f" ({'proven' if found.proof.proven else 'not proven'})"
        return StudyScene(
            full, found.scene, f"effects: auto within {100.0 * settings.tolerance:g} % left out {gone}{proof}{pairs}"
        )
    if settings.effects == ("all",):
        return StudyScene(full, without(full, ()), f"all effects that the data sheets have values for{pairs}")
    left = [name for name in KNOWN_EFFECTS if name not in settings.effects]
    return StudyScene(full, wanted_scene(full, settings.effects, settings.add), f"without {', '.join(left)}{pairs}")


def repeated_within(study: Study, settings: Simulation, duration: float) -> Simulation:
    """The settings with as many repetitions of the cycle as fill a duration [s], at least as many as stated.

    An open cycle is run as often as stated.
    """
    cycle = study.cycle
    if study.arm is not None and np.abs(cycle.position[-1] - cycle.position[0]).max() > GAP_ALLOWED:
        return settings
    return replace(settings, repetitions=max(settings.repetitions, math.ceil(duration / cycle.duration - 1e-9)))


def _pairs_text(evaluation: Evaluation) -> str:
    """A description of the axes with two separate motors."""
    study, pairs = evaluation.study, motor_pairs(evaluation.study)
    push = {task.name: task.preload for task in study.joints}
    return "".join(
        f"; {first} and {second} push against each other with {abs(push[first] or 0.0):.4g} N m"
        if push[first] else f"; {first} and {second} are two motors on one axis"
        for first, second in pairs
    )  # fmt: skip


def engine_of(settings: Simulation) -> Engine:
    """The engine that a study's ``simulation`` section states."""
    if settings.solver == "adaptive":
        return AdaptiveStep(Rodas5P(rtol=settings.precision))
    return Inverse() if settings.solver == "inverse" else FixedStep(settings.step)


def _evaluation(
    what: Study | Evaluation | Selection, drives: Mapping[str, Drive] | Mapping[str, Given] | None
) -> Evaluation:
    """The evaluation to be simulated: that of the given drives, of the study's own drives, or of those selected."""
    if not isinstance(what, Study):
        if drives is not None:
            hint = "an evaluation and a selection have their drives"
            raise InputError(Fault("drives", "go with a study", hint=hint))
        return every_drive(what) if isinstance(what, Selection) else what
    refuse_unsimulated(what)
    if drives is not None:
        own = {name: drive for name, drive in drives.items() if isinstance(drive, Drive)}
        if own and len(own) == len(drives):
            return evaluate_drives(what, own)
        if own:
            raise InputError(Fault("drives", "must be drives, or keys of (motor, gear), not both", sorted(own)))
        return evaluate(what, {name: keys for name, keys in drives.items() if not isinstance(keys, Drive)})
    if what.gives_all_drives:
        return evaluate(what)
    chosen = select(what)
    if not chosen.drives:
        hint = "select says why; evaluate(study, drives) takes drives that do not fit"
        raise InputError(Fault("joints", "no set of drives fits", hint=hint, file=what.path))
    return every_drive(chosen)
