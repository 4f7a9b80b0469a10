"""Run a scene: plan it, run the plan with an engine, and make a recording of the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.effects.motor.supply_bus import SupplyBus
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine, Outcome, Progress, RunOptions
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.starting import start_description, yielding_joints
from drivetrain.simulation.passive import limit_events
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.plan import plan as planned
from drivetrain.simulation.recording import Event, Recording, Series, TableSeries, energy_event
from drivetrain.simulation.scene import Scene
from drivetrain.simulation.warnings import gas_springs, warnings
from drivetrain.solvers.solver import Solver, check_positive

DEFAULT_INTERVAL = 0.01  # s
EQUILIBRIUM = "equilibrium"
MOST_ROWS = 1e8  # output rows of a run
# Signal of the bus voltage; share of the nominal voltage below which the source is too weak; error of the voltage, over
# the nominal one, above which it is reported.
BUS, WEAK_SUPPLY, BUS_ERROR = "scene.bus_voltage", 0.99, 1e-3
MOST_CHECKED_STEPS = 5e4  # steps of a run up to which the step is checked by a second run (about 0.3 s more)
# For a check of the bus voltage: steps of the fixed-step engine, steps of the adaptive engine, output rows, at most.
MOST_FIXED_STEPS, MOST_ADAPTIVE_STEPS, MOST_COMPARED_ROWS = 4e5, 100_000, 2e4
ALLOWED = 0.01  # relative change with half the step up to which a run counts as converged
LARGEST_VALUE = 1e30  # a larger number counts as diverged; its square is still finite


def simulate(
    scene: Scene | Plan,
    *,
    solver: Engine | Solver | None = None,
    duration: float | None = None,
    interval: float = DEFAULT_INTERVAL,
    resume: Recording | None = None,
    progress: Progress | None = None,
    start: str | Mapping[str, float] = EQUILIBRIUM,
    checked: bool = True,
) -> Recording:
    """Simulate a scene or its plan; the arguments are those of ``accuracy.study_run.simulate``.

    ``checked``: report a fixed step that is too long, by a second run at half the step.
    """
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
    events = _step_events(ready, engine, outcome.rows, recording, given, interval) if checked and resume is None else ()
    return replace(recording, events=(*recording.events, *events)) if events else recording


def engine_of(solver: Engine | Solver | None) -> Engine:
    """The engine for a ``solver`` argument: an engine itself, a solver for the adaptive engine, or None."""
    engine = FixedStep() if solver is None else AdaptiveStep(solver) if isinstance(solver, Solver) else solver
    if not isinstance(engine, Engine):
        raise InputError(Fault("solver", "must be an engine, such as FixedStep(0.001)", solver))
    return engine


def _given(start: object, resume: Recording | None) -> Mapping[str, float]:
    """The given initial states of a ``start`` argument, checked; empty for equilibrium."""
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
    """The recording of an engine's result, with energy balance, warnings and the data to resume."""
    about = {"scene": plan.scene.name, "solver": str(engine), "duration": f"{plan.scene.duration:g} s"}
    if outcome.times is not None:
        return Recording(outcome.times, outcome.series, outcome.counters, outcome.events, outcome.stopped_by, about)
    rows, stopped = _finite_rows(plan, outcome)
    stored, left, passed, largest = plan.layout.energies(rows)
    # The energy balance of a resumed run continues that of the earlier one.
    balance = float(resumed["balance"]) if "balance" in resumed else float(left[0])
    energies = {"stored_energy": Series("J", stored), "energy_error": Series("J", left - balance)}
    series = TableSeries(rows, plan.layout.recorded, energies)
    events = [*outcome.events, *_position_limit_events(plan, rows), *warnings(plan, engine, rows)]
    # What this run itself exchanged and lost: an earlier one has warned of its own error.
    events += energy_event(rows[:, 0], left - left[0], passed, largest, engine.tolerance)
    if not resumed:
        first = {name: float(rows[0, column]) for name, (column, _) in plan.layout.recorded.items()}
        about["start"] = start_description(plan, first, given)
        events += yielding_joints(plan, first)
    events.sort(key=lambda event: event.time)
    kept = {**outcome.kept, "balance": np.array(balance)}
    return Recording(rows[:, 0], series, outcome.counters, tuple(events), stopped, about, kept)


def _step_events(
    plan: Plan, engine: Engine, rows: Array, recording: Recording, given: Mapping[str, float], interval: float
) -> tuple[Event, ...]:
    """Warnings for a fixed step that is too long, found by runs at half the step.

    Two kinds of scenes are sensitive. A bus whose voltage drops limits all drives, and their power decides when it
    drops. And a contact, breakaway or limit cycle that occurs at a slightly different time changes all that follows.
    If half the step changes a decision quantity, the step is halved further to advise one that is short enough.
    """
    if not isinstance(engine, FixedStep) or recording.stopped_by is not None:
        return ()
    if plan.scene.duration > MOST_CHECKED_STEPS * min(engine.step, plan.period):
        return ()
    # Output rows that leave out steps may leave out peaks, and oscillations faster than these differ by aliasing.
    seen = RunOptions(min(interval, plan.scene.duration / MOST_COMPARED_ROWS), start=given)
    here = _recorded(plan, rows if interval <= engine.step else engine.run(plan, seen).rows)
    events = _bus_event(engine, here, plan, given)
    tried, first, advice = engine, "", "try AdaptiveStep"
    while plan.scene.duration <= MOST_CHECKED_STEPS * tried.step:
        finer = tried.finer(plan.period)
        halved = finer.run(plan, seen)
        if halved.stopped_by is not None:
            break
        there = _recorded(plan, halved.rows)
        changed = largest_change(plan.scene.joints, here, there)
        if not changed:
            advice = f"a step of {tried.step:g} s is short enough: half of it changes none by {100.0 * ALLOWED:g} %"
            break
        first, tried, here = first or changed, finer, there
    if not first:
        return events
    detail = (
        f"half the step changes {first}: a step of {engine.step:g} s does not resolve impacts, sticking, oscillations "
        f"or reversals; {advice}"
    )
    return (*events, Event(float(recording.time[-1]), "step", detail))


def _bus_event(engine: FixedStep, recording: Recording, plan: Plan, given: Mapping[str, float]) -> tuple[Event, ...]:
    """A warning if the voltage of an overloaded bus is inaccurate, with a step that is short enough.

    The reference is the adaptive engine. Empty if the bus does not drop, or if its error is small.
    """
    nominal = max((one.effect.voltage for one in plan.instances if isinstance(one.effect, SupplyBus)), default=0.0)
    if not nominal or recording[BUS].min() >= WEAK_SUPPLY * nominal:
        return ()
    interval, column = plan.scene.duration / MOST_COMPARED_ROWS, plan.layout.recorded[BUS][0]
    reference = AdaptiveStep(most_steps=MOST_ADAPTIVE_STEPS).run(plan, RunOptions(interval, start=given))
    if reference.stopped_by is not None:
        return ()

    def error_of(time: Array, volts: Array) -> Array:
        return np.abs(volts - np.interp(time, reference.rows[:, 0], reference.rows[:, column])) / nominal

    errors = error_of(recording.time, recording[BUS])
    worst, step, k = float(errors.max()), engine.step, int(np.argmax(errors))
    if worst <= BUS_ERROR:
        return ()
    advice, left = "try AdaptiveStep", worst
    while left > BUS_ERROR:
        # Limits become active at grid points, so the error is proportional to the step.
        step = float(f"{step * min(0.9 * BUS_ERROR / left, 0.5):.2g}")
        if plan.scene.duration > MOST_FIXED_STEPS * step:
            break
        rows = FixedStep(step).run(plan, RunOptions(interval, start=given)).rows
        left = float(error_of(rows[:, 0], rows[:, column]).max())
    else:
        advice = f"a step of {step:g} s holds {100.0 * BUS_ERROR:g} %"
    detail = f"the bus sinks to {recording[BUS].min():.3g} V and its voltage is off by {100.0 * worst:.2g} %: {advice}"
    return (Event(float(recording.time[k]), "bus", detail),)


def _recorded(plan: Plan, rows: Array) -> Recording:
    """Output rows as a recording, without energies and events."""
    return Recording(rows[:, 0], TableSeries(rows, plan.layout.recorded, {}))


def largest_change(joints: Sequence[str], run: Recording, finer: Recording) -> str:
    """The quantity of a joint that a finer run changes most, with its relative change; empty if below ``ALLOWED``."""
    shares: dict[str, float] = {}
    for joint in joints:
        for what, measures in MEASURES.items():
            name = f"{joint}.{what}"
            if name in run.series:
                here, there = run[name], np.interp(run.time, finer.time, finer[name])
                if _size(what, there) > SMALLEST_SIZES[what]:
                    shares |= {f"{name} {words}": measure(here, there) for words, measure in measures.items()}
    worst = max(shares, key=lambda name: shares[name], default="")
    return f"{worst} by {100.0 * shares[worst]:.2g} %" if worst and shares[worst] > ALLOWED else ""


def _size(what: str, values: Array) -> float:
    """Size of a quantity against which its change counts: the range of positions and temperatures, else the peak."""
    return float(np.ptp(values) if what in ("position", "winding_temperature") else np.abs(values).max())


def _rms(here: Array, there: Array) -> float:
    """Relative difference of the RMS values of two series [-]."""
    return abs(float(np.linalg.norm(here) / np.linalg.norm(there)) - 1.0)


def _peak(here: Array, there: Array) -> float:
    """Relative difference of the largest magnitudes of two series [-]."""
    return abs(float(np.abs(here).max() / np.abs(there).max()) - 1.0)


# Quantities of each joint that are compared, and their measures, as relative differences of two series.
MEASURES: dict[str, dict[str, Callable[[Array, Array], float]]] = {
    "position": {"along the motion": lambda here, there: float(np.abs(there - here).max() / np.ptp(there))},
    "speed": {"(peak)": _peak},
    "current": {"(peak)": _peak, "(RMS)": _rms},
    "mesh_torque": {"(RMS)": _rms},
    "winding_temperature": {"(rise)": lambda here, there: abs(float(np.ptp(here) / np.ptp(there)) - 1.0)},
}
# Sizes below which a quantity is not compared: rounding; rises [K] that no decision depends on; speeds [rad/s or m/s]
# of joints that stand still.
SMALLEST_SIZES = dict.fromkeys(MEASURES, 1e-6) | {"winding_temperature": 0.1, "speed": 1e-4}


def _position_limit_events(plan: Plan, rows: Array) -> tuple[Event, ...]:
    """Events where joints of an arm pass their position limits, with the time resolution of the recording."""
    arm = plan.scene.body
    if not isinstance(arm, Arm):
        return ()
    positions = rows[:, 1 : 1 + arm.n]  # the positions are the first states
    if not (positions < arm.lower).any() and not (positions > arm.upper).any():
        return ()
    return limit_events(arm, rows[:, 0], positions)


def _finite_rows(plan: Plan, outcome: Outcome) -> tuple[Array, Event | None]:
    """The rows before the first with a value that is NaN or above ``LARGEST_VALUE``, and the event that ended the run;
    InputError if that is the first row.
    """
    rows, stopped = outcome.rows, outcome.stopped_by
    if -LARGEST_VALUE < rows.min() and rows.max() < LARGEST_VALUE:  # false where there is a NaN
        return rows, stopped
    named = plan.layout.recorded
    fine = np.abs(rows[:, [column for column, _ in named.values()]]) < LARGEST_VALUE
    bad = np.flatnonzero(~fine.all(axis=1))
    if not len(bad):
        return rows, stopped
    if bad[0] == 0:
        name = list(named)[int(np.argmin(fine[0]))]
        hint = next((event.detail for event in gas_springs(plan, rows[:1])), "")
        raise InputError(Fault(name, f"is beyond {LARGEST_VALUE:g}, or no number, at the very start", hint=hint))
    if stopped is None or stopped.name == "diverged":
        # Name the largest state, not a quantity that grows with its square, such as a loss.
        states = list(plan.memory.states)
        size = np.nan_to_num(np.abs(rows[bad[0], 1 : 1 + len(states)]), nan=np.inf)
        name = states[int(np.argmax(size))]
        what = f"{name} grows beyond all bounds"
        stopped = Event(float(rows[bad[0], 0]), "diverged", f"{what}: a loop that is not stable, or too long a step")
    return rows[: int(bad[0])], stopped
