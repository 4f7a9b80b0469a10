"""Run a scene: plan it, hand it to an engine, and make a recording of what comes back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.effects.effect import Role
from drivetrain.effects.signals import KINETIC_ENERGY, POTENTIAL_ENERGY
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.adaptive_engine import AdaptiveStep
from drivetrain.simulation.engine import Engine, Outcome, Progress, Wish, column_names
from drivetrain.simulation.fixed_step import FixedStep
from drivetrain.simulation.passive import limit_events
from drivetrain.simulation.plan import Plan
from drivetrain.simulation.plan import plan as planned
from drivetrain.simulation.recording import Event, Recording, Series
from drivetrain.simulation.scene import Scene
from drivetrain.simulation.study_scene import scene_of
from drivetrain.solvers.solver import Solver, check_positive
from drivetrain.study.study import Study

DEFAULT_INTERVAL = 0.01  # s
MOST_ROWS = 1e8
BEYOND = 1e30  # no number of an arm; its square is still one


def simulate(
    scene: Scene | Plan | Study,
    *,
    drives: Mapping[str, Drive] | None = None,
    solver: Engine | Solver | None = None,
    duration: float | None = None,
    interval: float = DEFAULT_INTERVAL,
    resume: Recording | None = None,
    progress: Progress | None = None,
) -> Recording:
    """What happens when a scene runs.

    Args:
        scene: The scene, or its plan; or a study, of which ``scene_of`` makes one.
        drives: Of a study, by joint name; an evaluation's ``joints[name].drive`` have their unknowns filled.
        solver: The engine; None: fixed implicit steps of a millisecond. A solver that runs compiled, such as
            Rodas4(rtol=1e-6), stands for the adaptive engine with it.
        duration: Replaces that of the scene [s].
        interval: Between two recorded instants [s].
        resume: A recording of the same scene that ended earlier or was stopped: go on from its end.
        progress: Told the share done after every few thousand steps; False from it stops the run.

    Returns:
        ``<joint>.position`` and all other states and signals, energies of all powers, ``stored_energy`` and
        ``energy_error`` where they can be told; counters, events, and what it takes to go on.

    Raises:
        InputError: A scene that contradicts itself, or an earlier recording of another.
    """
    if isinstance(scene, Study):
        scene = scene_of(scene, drives or {})
    if not isinstance(scene, Scene | Plan):
        raise InputError(Fault("scene", "must be a scene or its plan", type(scene).__name__))
    engine = FixedStep() if solver is None else AdaptiveStep(solver) if isinstance(solver, Solver) else solver
    if not isinstance(engine, Engine):
        raise InputError(Fault("solver", "must be an engine, such as FixedStep(0.001)", solver))
    if not isinstance(resume, Recording | None):
        hint = "load_recording reads one from its file"
        raise InputError(Fault("resume", "must be a recording", type(resume).__name__, hint))
    check_positive("interval", interval, "s")
    ready = scene if isinstance(scene, Plan) else planned(scene)
    if duration is not None:
        check_positive("duration", duration, "s")
        ready = planned(replace(ready.scene, duration=float(duration)))
    if ready.scene.duration > MOST_ROWS * interval:
        problem = f"makes more than {MOST_ROWS:g} rows of {ready.scene.duration:g} s"
        raise InputError(Fault("interval", problem, interval, "record less often"))
    kept = None if resume is None else dict(resume.kept)
    outcome = engine.run(ready, Wish(interval, progress, kept))
    return _recording(ready, engine, outcome)


def _recording(plan: Plan, engine: Engine, outcome: Outcome) -> Recording:
    about = {"scene": plan.scene.name, "solver": repr(engine), "duration": f"{plan.scene.duration:g} s"}
    if outcome.times is not None:
        return Recording(outcome.times, outcome.series, outcome.counters, outcome.events, outcome.stopped_by, about)
    series: dict[str, Series] = {}
    named = [(index, name, unit) for index, (name, unit) in enumerate(column_names(plan)) if _wanted(plan, name)]
    rows, stopped = _sound(outcome, named, list(plan.memory.states))
    for index, name, unit in named:
        series.setdefault(name, Series(unit, rows[:, 1 + index]))
    series |= _audit(plan, series)
    events = sorted((*outcome.events, *_limits(plan, rows[:, 0], series)), key=lambda event: event.time)
    return Recording(rows[:, 0], series, outcome.counters, tuple(events), stopped, about, outcome.kept)


def _limits(plan: Plan, times: Array, series: Mapping[str, Series]) -> tuple[Event, ...]:
    """When joints of an arm pass the limits of their positions, to the recording's interval."""
    arm = plan.scene.body
    if not isinstance(arm, Arm):
        return ()
    return limit_events(arm, times, np.column_stack([series[f"{name}.position"].values for name in arm.joint_names]))


def _sound(outcome: Outcome, named: list[tuple[int, str, str]], states: list[str]) -> tuple[Array, Event | None]:
    """The rows before the first that holds no number, or one too large to calculate with; and what ended the run."""
    rows, stopped = outcome.rows, outcome.stopped_by
    fine = np.abs(rows[:, [1 + index for index, _, _ in named]]) < BEYOND
    bad = np.flatnonzero(~fine.all(axis=1))
    if not len(bad):
        return rows, stopped
    if bad[0] == 0:
        name = named[int(np.argmin(fine[0]))][1]
        raise InputError(Fault(name, f"is beyond {BEYOND:g}, or no number, at the very start"))
    if stopped is None or stopped.name == "diverged":
        # Not what grows with its square, such as a loss, but the state that is furthest away.
        size = np.nan_to_num(np.abs(rows[bad[0], 1 : 1 + len(states)]), nan=np.inf)
        name = states[int(np.argmax(size))]
        what = f"{name} grows beyond all bounds"
        stopped = Event(float(rows[bad[0], 0]), "diverged", f"{what}: a loop that is not stable, or too long a step")
    return rows[: int(bad[0])], stopped


def _wanted(plan: Plan, name: str) -> bool:
    """Names worth recording: no sums that nobody adds to, no constants that nobody gives."""
    silent = name in plan.signals.adders and not plan.signals.adders[name]
    silent = silent or (name in plan.signals.defaults and name not in plan.signals.givers)
    return bool(name) and not silent and name != "scene.mass_matrix"


def _audit(plan: Plan, series: dict[str, Series]) -> dict[str, Series]:
    """Energy that is there and should not be."""
    count = len(next(iter(series.values())).values) if series else 0
    put_in = np.zeros(count)
    for name, role in plan.signals.powers.items():
        energy = series.get(f"{name.removesuffix('_power')}_energy")
        if energy is not None:
            put_in = put_in + (energy.values if role is Role.SOURCE else -energy.values)
    stored = _stored(plan, series)
    error = stored - stored[:1] - put_in + put_in[:1]
    return {"stored_energy": Series("J", stored), "energy_error": Series("J", error)}


def _stored(plan: Plan, series: dict[str, Series]) -> Array:
    """Kinetic, potential and whatever effects store [J]."""
    total = series[KINETIC_ENERGY.name].values + series[POTENTIAL_ENERGY.name].values
    for name in plan.signals.stores:
        total = total + series[name].values
    return total
