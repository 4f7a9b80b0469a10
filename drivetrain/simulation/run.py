"""Run a scene: plan it, hand it to an engine, and make a recording of what comes back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.effects.gear.springs import Backlash
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.supply_bus import SupplyBus
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine, Outcome, Progress, RunOptions
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.starting import sinking, start_words
from drivetrain.simulation.passive import limit_events
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.plan import plan as planned
from drivetrain.simulation.recording import Event, Recording, Series, TableSeries, energy_event
from drivetrain.simulation.scene import Scene
from drivetrain.simulation.warnings import warnings
from drivetrain.solvers.solver import Solver, check_positive

DEFAULT_INTERVAL = 0.01  # s
EQUILIBRIUM = "equilibrium"
MOST_ROWS = 1e8
BUS, SINKS, BUS_OFF = "scene.bus_voltage", 0.99, 1e-3  # of the nominal voltage: a source that is too weak; an error
MOST_CHECKED = 1e6  # steps
STRIKES = (Backlash, WallSpring, TipContact)
STRUCK, NOTHING = 0.01, 1e-6  # of a speed or current; [rad/s, m/s or A]
BEYOND = 1e30  # no number of an arm; its square is still one


def simulate(
    scene: Scene | Plan,
    *,
    solver: Engine | Solver | None = None,
    duration: float | None = None,
    interval: float = DEFAULT_INTERVAL,
    resume: Recording | None = None,
    progress: Progress | None = None,
    start: str | Mapping[str, float] = EQUILIBRIUM,
) -> Recording:
    """What happens when a scene runs."""
    if not isinstance(scene, Scene | Plan):
        raise InputError(Fault("scene", "must be a scene or its plan", type(scene).__name__))
    engine = engine_of(solver)
    if not isinstance(resume, Recording | None):
        hint = "load_recording reads one from its file"
        raise InputError(Fault("resume", "must be a recording", type(resume).__name__, hint))
    check_positive("interval", interval, "s")
    given = _given(start, resume)
    ready = scene if isinstance(scene, Plan) else planned(scene)
    if duration is not None:
        check_positive("duration", duration, "s")
        ready = planned(replace(ready.scene, duration=float(duration)))
    if ready.scene.duration > MOST_ROWS * interval:
        problem = f"makes more than {MOST_ROWS:g} rows of {ready.scene.duration:g} s"
        raise InputError(Fault("interval", problem, interval, "record less often"))
    kept = None if resume is None else dict(resume.kept)
    outcome = engine.run(ready, RunOptions(interval, progress, kept, given))
    recording = _recording(ready, engine, outcome, kept or {}, given)
    told = _step_events(ready, engine, recording, given, interval) if resume is None else ()
    return replace(recording, events=(*recording.events, *told)) if told else recording


def engine_of(solver: Engine | Solver | None) -> Engine:
    """The engine that is meant."""
    engine = FixedStep() if solver is None else AdaptiveStep(solver) if isinstance(solver, Solver) else solver
    if not isinstance(engine, Engine):
        raise InputError(Fault("solver", "must be an engine, such as FixedStep(0.001)", solver))
    return engine


def _given(start: object, resume: Recording | None) -> Mapping[str, float]:
    """The states that are given."""
    if isinstance(start, str) and start == EQUILIBRIUM:
        return {}
    if not isinstance(start, Mapping):
        hint = "such as {'elbow.integrated_current': 0.0}"
        raise InputError(Fault("start", f"must be {EQUILIBRIUM!r}, or states by name", start, hint))
    if resume is not None:
        raise InputError(
            Fault("start", "cannot be given to a run that goes on from another", ", ".join(map(str, start)))
        )
    return start


def _recording(
    plan: Plan, engine: Engine, outcome: Outcome, resumed: Mapping[str, Any], given: Mapping[str, float]
) -> Recording:
    about = {"scene": plan.scene.name, "solver": repr(engine), "duration": f"{plan.scene.duration:g} s"}
    if outcome.times is not None:
        return Recording(outcome.times, outcome.series, outcome.counters, outcome.events, outcome.stopped_by, about)
    rows, stopped = _sound(plan, outcome)
    stored, left, passed, largest = plan.layout.energies(rows)
    # Of a run that goes on the audit does, too.
    balance = float(resumed["balance"]) if "balance" in resumed else float(left[0])
    energies = {"stored_energy": Series("J", stored), "energy_error": Series("J", left - balance)}
    series = TableSeries(rows, plan.layout.recorded, energies)
    events = [*outcome.events, *_limits(plan, rows), *warnings(plan, engine, rows)]
    events += energy_event(rows[:, 0], left - balance, passed, largest, engine.tolerance)
    if not resumed:
        first = {name: float(rows[0, column]) for name, (column, _) in plan.layout.recorded.items()}
        about["start"] = start_words(plan, first, given)
        events += sinking(plan, first)
    events.sort(key=lambda event: event.time)
    kept = {**outcome.kept, "balance": np.array(balance)}
    return Recording(rows[:, 0], series, outcome.counters, tuple(events), stopped, about, kept)


def _step_events(
    plan: Plan, engine: Engine, recording: Recording, given: Mapping[str, float], interval: float
) -> tuple[Event, ...]:
    """What a fixed step sees too little of, found at half the step: a bus that sinks, and what strikes.

    A bus that sinks limits every drive behind it, and what these draw then decides when it sinks. What strikes, or
    strikes back, does it when it did before: a step that misses the instant misses all that comes after.
    """
    if not isinstance(engine, FixedStep) or recording.stopped_by is not None:
        return ()
    if plan.scene.duration > MOST_CHECKED * engine.step:
        return ()
    bus = [one.effect for one in plan.instances if isinstance(one.effect, SupplyBus)]
    sinks = any(recording[BUS].min() < SINKS * one.voltage for one in bus)
    if not sinks and not any(isinstance(one.effect, STRIKES) for one in plan.instances):
        return ()
    # Of the bus, which limits at once, every node.
    finer = engine.finer().run(plan, RunOptions(1e-3 * engine.step if sinks else interval, start=given))
    if finer.stopped_by is not None:
        return ()
    told = [*_bus_event(bus[0].voltage, engine, recording, plan, finer.rows)] if sinks else []
    return (*told, *_strike_event(engine, recording, plan, finer.rows))


def _bus_event(nominal: float, engine: FixedStep, recording: Recording, plan: Plan, finer: Array) -> tuple[Event, ...]:
    """What the voltage of a bus that sinks is off by, and the step that it needs."""
    apart = np.abs(_apart(recording, plan, finer, BUS))
    off = float(apart.max()) / nominal / (1.0 - 0.5**2)  # its error falls with the square of the step
    if off <= BUS_OFF:
        return ()
    detail = (
        f"the bus sinks to {recording[BUS].min():.3g} V and its voltage is off by {100.0 * off:.2g} %: "
        f"a step of {0.9 * engine.step * math.sqrt(BUS_OFF / off):.2g} s would hold {100.0 * BUS_OFF:g} %"
    )
    return (Event(float(recording.time[int(np.argmax(apart))]), "bus", detail),)


def _strike_event(engine: FixedStep, recording: Recording, plan: Plan, finer: Array) -> tuple[Event, ...]:
    """The speed or current that half the step changes most, of its largest value; by RMS, as instants may differ."""
    shares = {}
    for name in (f"{joint}.{what}" for joint in plan.scene.joints for what in ("speed", "current")):
        if name in recording.series:
            largest = float(np.abs(recording[name]).max())
            apart = _apart(recording, plan, finer, name)
            shares[name] = math.sqrt(float(np.mean(apart**2))) / largest if largest > NOTHING else 0.0
    worst = max(shares, key=lambda name: shares[name])
    if shares[worst] <= STRUCK:
        return ()
    detail = (
        f"half the step changes {worst} by {100.0 * shares[worst]:.2g} % RMS: what strikes does it within a step of "
        f"{engine.step:g} s; try a shorter one, or AdaptiveStep"
    )
    return (Event(float(recording.time[-1]), "step", detail),)


def _apart(recording: Recording, plan: Plan, finer: Array, name: str) -> Array:
    """What rows of a finer run have beside a recording."""
    later = np.interp(recording.time, finer[:, 0], finer[:, plan.layout.recorded[name][0]])
    return np.asarray(later - recording[name])


def _limits(plan: Plan, rows: Array) -> tuple[Event, ...]:
    """When joints of an arm pass the limits of their positions, to the recording's interval."""
    arm = plan.scene.body
    if not isinstance(arm, Arm):
        return ()
    positions = rows[:, 1 : 1 + arm.n]  # the first states
    if not (positions < arm.lower).any() and not (positions > arm.upper).any():
        return ()
    return limit_events(arm, rows[:, 0], positions)


def _sound(plan: Plan, outcome: Outcome) -> tuple[Array, Event | None]:
    """The rows before the first that holds no number, or one too large to calculate with; and what ended the run."""
    rows, stopped = outcome.rows, outcome.stopped_by
    if -BEYOND < rows.min() and rows.max() < BEYOND:  # false where there is a NaN
        return rows, stopped
    named = plan.layout.recorded
    fine = np.abs(rows[:, [column for column, _ in named.values()]]) < BEYOND
    bad = np.flatnonzero(~fine.all(axis=1))
    if not len(bad):
        return rows, stopped
    if bad[0] == 0:
        name = list(named)[int(np.argmin(fine[0]))]
        raise InputError(Fault(name, f"is beyond {BEYOND:g}, or no number, at the very start"))
    if stopped is None or stopped.name == "diverged":
        # Not what grows with its square, such as a loss, but the state that is furthest away.
        states = list(plan.memory.states)
        size = np.nan_to_num(np.abs(rows[bad[0], 1 : 1 + len(states)]), nan=np.inf)
        name = states[int(np.argmax(size))]
        what = f"{name} grows beyond all bounds"
        stopped = Event(float(rows[bad[0], 0]), "diverged", f"{what}: a loop that is not stable, or too long a step")
    return rows[: int(bad[0])], stopped
