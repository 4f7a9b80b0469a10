"""E2: integration with an adaptive step, where contact modes change at located events: the engine for accuracy.

Effects, mechanics and friction are those of the fixed implicit step, which converges to this engine for short steps. No
step crosses a breakpoint or a sampling time, and on each side the laws are evaluated only at times of that side.

Every coordinate has a contact mode: stick, or slip in one direction. The modes are fixed within a step, so that the
rates are smooth. A mode changes at an event that the solver locates: a slipping coordinate comes to rest, or the
friction of a stuck one reaches its bound. The handler then forces the transition that belongs to this event, and only
the modes of the other coordinates follow from complementarity: at rest, complementarity alone would return the old mode
again and again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numba import carray

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.core import jacobian
from drivetrain.simulation.core.equations import (
    fill_row,
    outputs_at,
    pass_payloads,
    put_states,
    rates,
    right_side,
    solve_at,
    take_samples,
)
from drivetrain.simulation.core.jacobian import sparsity_pattern
from drivetrain.simulation.core.records import (
    AT,
    MODE_CHANGE,
    SECTIONS,
    Run,
    call_equations,
    call_law,
    coordinates_of,
    count_of,
    engine_of,
    guards_of,
    log_changes,
    memory_of,
    numbers_of,
    pairs_of,
    part,
    parts_of,
    states_of,
    words_of,
)
from drivetrain.simulation.engines.engine import Engine, Outcome, RunOptions
from drivetrain.simulation.engines.fixed_step import mode_event, resumed, unsolved_event
from drivetrain.simulation.engines.starting import initial_memory
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event
from drivetrain.solvers import records as at
from drivetrain.solvers.compiled_problem import CompiledProblem, Events, Hooks
from drivetrain.solvers.integrate_compiled import Checkpoint, CompiledSolution, integrate_compiled
from drivetrain.solvers.solver import Adaptive, Rodas4, Rodas5P, Solver

REST_SPEED = 1e-5  # below this speed a coordinate whose speed changes its sign is at rest [rad/s or m/s]
SIMULTANEOUS = 1e-9  # distance from its bound, over its friction, up to which a coordinate slips together with another
# Acceleration beyond its bound up to which a mesh sticks; larger than ``friction.MESH_REST_MARGIN``, so that a mesh
# that has come to rest does not slip at once.
MESH_MARGIN = 3e-8  # [rad/s^2 or m/s^2]
BREAKAWAY_SPEED = 1e-300  # initial speed that marks the direction in which a coordinate starts to slip [rad/s]


@part
def _solve_at_state(run: Run, t: float, x: Any) -> None:
    """Solve the equations of motion at time t [s] and state x."""
    put_states(run, x)
    solve_at(run, t)


def _event_values(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """The event functions: the margin of each coordinate's contact mode, then the value of each guard.

    Positive while the mode is consistent; negative beyond the event.
    """
    coordinates, guards, memory = coordinates_of(run), guards_of(run), memory_of(run)
    guarded = len(guards) > 0
    for i in range(len(coordinates)):
        guarded = guarded or coordinates[i].dry.mode == 0 or coordinates[i].surface != 0.0
    if guarded:
        _solve_at_state(run, t, x)
    if len(guards):
        outputs_at(run, t)
    for k in range(len(guards)):
        result[len(coordinates) + k] = memory[guards[k].value]
    for i in range(len(coordinates)):
        one = coordinates[i]
        if not one.dry.active:
            result[i] = 1.0
        elif one.dry.mode == 0:
            # A mesh without load has a bound of zero: without this margin a rounding error would make it slip.
            result[i] = one.margin + (MESH_MARGIN * pairs_of(run)[i, i].matrix if one.dry.driven != 0.0 else 0.0)
            if one.margin < 0.0:
                # Direction of breakaway, noted here since the force at the located event itself may be zero.
                one.breakaway_direction = 1 if one.friction >= 0.0 else -1
        else:
            result[i] = one.dry.mode * (x[len(coordinates) + i] - one.surface)


@part
def _copy_back_states(run: Run, x: Any) -> None:
    """Copy the states of effects, which their laws may have changed, back to the solver's state."""
    states, memory = states_of(run), memory_of(run)
    for k in range(2 * len(coordinates_of(run)), engine_of(run).moving):
        x[k] = memory[states[k].value]


def _handler(t: Any, x: Any, fired: Any, numbers: Any, run: Any) -> None:
    """The event handler: force the transitions of the fired events, then solve for the modes of the others at rest."""
    coordinates = coordinates_of(run)
    c, some_slip = len(coordinates), False
    _solve_at_state(run, t, x)
    for i in range(c):
        some_slip = some_slip or (fired[i] != 0.0 and coordinates[i].dry.mode == 0)
    for i in range(c):
        one = coordinates[i]
        one.before = one.dry.mode
        # Coordinates that reach their bounds at the same time start to slip together.
        joins = some_slip and one.dry.mode == 0 and one.margin <= SIMULTANEOUS * abs(one.friction)
        if (fired[i] == 0.0 and not joins) or not one.dry.active:
            continue
        if one.dry.mode == 0:
            if fired[i] == 0.0:
                one.breakaway_direction = 1 if one.friction >= 0.0 else -1
            x[c + i] = one.surface + one.breakaway_direction * max(BREAKAWAY_SPEED, 4e-16 * abs(one.surface))
        elif abs(x[c + i] - one.surface) <= REST_SPEED:
            x[c + i] = one.surface
            one.dry.mode = 0  # at rest it sticks, unless that needs more friction than its bound
    guards = guards_of(run)
    if len(guards):
        outputs_at(run, t)
    for k in range(len(guards)):
        if fired[c + k] != 0.0:
            call_law(run, guards[k], t, 0.0)
            _copy_back_states(run, x)
    engine_of(run).modes_fixed = 0
    _solve_at_state(run, t, x)
    engine_of(run).modes_fixed = 1
    call_equations(run, engine_of(run).uniqueness_law, t, 1.0)
    log = carray(run[AT.log], count_of(run, AT.log), MODE_CHANGE)
    engine_of(run).logged = log_changes(run, t, log, engine_of(run).logged)


def _account(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Add the powers at this quadrature point to the energies; ``result[0]`` is the weight of the point [s]."""
    h = result[0]
    memory, powers, energies = memory_of(run), words_of(run, AT.powers), numbers_of(run, AT.energies)
    _solve_at_state(run, t, x)
    # With h = 0 effects output the powers at this time; with h > 0 they would output means over a fixed step.
    outputs_at(run, t)
    for k in range(len(powers)):
        energies[k] += h * memory[powers[k]]


def _output_row(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Fill one output row at time t [s] and state x."""
    _solve_at_state(run, t, x)
    outputs_at(run, t)
    fill_row(run, t, result)


def _segment_start(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """At the beginning of a segment: change the payload and take the samples that are due at this time."""
    put_states(run, x)
    pass_payloads(run, t)
    take_samples(run, t, 0.0, 1e-6)
    _copy_back_states(run, x)


MOST_EVENTS = 20_000  # mode changes stored; more are only counted
CHUNK = 20_000  # steps between two calls of the progress callback
REFERENCE_RTOL = 1e-6  # relative tolerance to which the absolute tolerances declared by states refer
# Names of the events that end a run, by the return code of the solver's loop.
STOPPED_BY = {
    at.TOO_MANY_STEPS: "budget", at.JUMP: "jump", at.ZENO: "chattering", at.DIVERGES: "diverged",
    at.NOT_FINITE: "diverged",
}  # fmt: skip


@dataclass(frozen=True)
class AdaptiveStep(Engine):
    """The engine for accuracy: adaptive steps, with events located where contact modes change.

    Attributes:
        solver: Rodas5P or Rodas4, or, for comparison, another solver that runs compiled. Where Rodas5P or Rodas4 has no
            absolute tolerances, those that the states declare are used, scaled with its relative tolerance.
        most_steps: Number of steps after which a run stops and reports how far it has come; a resumed run may take as
            many again.
    """

    solver: Solver = field(default_factory=Rodas5P)
    most_steps: int = 20_000_000

    def __post_init__(self) -> None:
        if not isinstance(self.solver, Solver):
            hint = "such as Rodas5P(rtol=1e-6)"
            raise InputError(Fault("AdaptiveStep.solver", "must be a solver", type(self.solver).__name__, hint))
        if not isinstance(self.most_steps, int) or self.most_steps < 1:
            raise InputError(Fault("AdaptiveStep.most_steps", "must be a whole number, at least 1", self.most_steps))

    @property
    def tolerance(self) -> float:
        return float(getattr(self.solver, "rtol", 0.0))

    def finer(self, period: float = math.inf) -> AdaptiveStep:
        if not isinstance(self.solver, Adaptive):
            raise InputError(Fault("verify", "needs a solver with a tolerance", type(self.solver).__name__))
        atol = self.solver.atol
        finer = tuple(0.1 * one for one in atol) if isinstance(atol, tuple) else atol if atol is None else 0.1 * atol
        return replace(self, solver=replace(self.solver, rtol=0.1 * self.solver.rtol, atol=finer))

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Compute the motion of a plan with adaptive steps, in chunks with reports of the progress."""
        kept, moving, first = options.resume, plan.memory.moving, 0.0
        if kept is None:
            numbers = initial_memory(plan, options.start)
        else:
            sizes = {"run": at.RUN.itemsize // 8, "states": moving * (at.STATE.itemsize // 8)}
            sizes["events"] = len(_event_names(plan)) * (at.EVENT.itemsize // 8)
            numbers = resumed(kept, plan, {**sizes, "jacobian": moving * (moving + 1)})
            first = float(kept["run"].view(at.RUN)["clock"]["time"][0])
        start = numbers[plan.memory.view(numbers, "states")["value"][:moving]]
        # The problem refers to this memory by addresses, so it must stay alive.
        numbers = _with_engine_sections(plan, numbers, sparsity_pattern(plan)[:moving, :moving])
        problem, solver = _problem(plan, numbers), _with_state_tolerances(self.solver, plan)
        times, breaks = _output_times(plan, options, first), _break_times(plan, self.tolerance).tolist()
        resume, most_steps, stopped = None, self.most_steps, None
        if kept is not None:
            resume = _checkpoint(kept, problem, len(times))
            most_steps += int(resume.run["count"]["steps"][0])
        while True:
            done = integrate_compiled(
                problem, solver, start, times,
                breakpoints=breaks, most_steps=most_steps, pause_after=CHUNK, resume=resume,
            )  # fmt: skip
            if done.code != at.PAUSED:
                break
            resume = done.checkpoint
            if options.progress is not None and options.progress(done.stopped_at / plan.scene.duration) is False:
                stopped = Event(done.stopped_at, "stopped", "by the progress callback; it can be resumed")
                break
        if stopped is None and done.stopped:
            stopped = _stop_event(done, plan, numbers)
        return _outcome(done, plan, numbers, stopped, 0 if first == 0.0 else 1)


def _with_engine_sections(plan: Plan, numbers: Array, sparsity: Any) -> Array:
    """A run's memory with further sections at its end: the log of mode changes and the memory of the Jacobian."""
    sizes = plan.memory.atol[: plan.memory.moving] / REFERENCE_RTOL
    sections = {"log": np.zeros(MOST_EVENTS, MODE_CHANGE), **jacobian.memory_sections(sizes, plan.body.c, sparsity)}
    engine, listed = plan.memory.view(numbers, "engine")[0], plan.memory.view(numbers, "sections")
    first = len(numbers)
    for name, values in sections.items():
        listed[SECTIONS.index(name)] = first, values.nbytes // 8, len(values)
        first += values.nbytes // 8
    plan.memory.view(numbers, "world")["size"] = first
    engine["modes_fixed"] = 1
    return np.concatenate([numbers, *(np.ascontiguousarray(values).view(np.float64) for values in sections.values())])


def _event_names(plan: Plan) -> tuple[str, ...]:
    """What the event functions of a plan belong to: coordinates, then effects with a guard; empty if none can fire."""
    guarded = tuple(one.title for one in plan.instances if one.ports.guard)
    dry = any(
        effects
        for name, effects in plan.signals.contributors.items()
        if "_hold_" in name or "_slide_" in name or ".mesh_dri" in name
    )
    return (*plan.coordinates, *guarded) if guarded or dry else ()


def _problem(plan: Plan, numbers: Array) -> CompiledProblem:
    """The initial value problem of a plan for the compiled solver; it works on the memory ``numbers`` by address."""
    event_names = _event_names(plan)
    changes = Events(right_side(_event_values), right_side(_handler), event_names) if event_names else None
    width = 1 + len(plan.layout.columns)
    hooks = Hooks(right_side(_account), right_side(_output_row), width, right_side(_segment_start))
    names = tuple(plan.memory.states)[: plan.memory.moving]
    groups = int(plan.memory.view(numbers, "sections")["count"][AT.groups])
    return CompiledProblem(
        right_side(rates), len(names), words=parts_of(numbers), jacobian=right_side(jacobian.jacobian),
        events=changes, hooks=hooks, names=names, may_jump=True, differences=1 + groups,
    )  # fmt: skip


def _with_state_tolerances(solver: Solver, plan: Plan) -> Solver:
    """The solver with the absolute tolerances of the plan's states, if it has none of its own."""
    if isinstance(solver, Rodas4) and solver.atol is None:
        atol = plan.memory.atol[: plan.memory.moving] * (solver.rtol / REFERENCE_RTOL)
        return replace(solver, atol=tuple(float(a) for a in atol))
    return solver


def _output_times(plan: Plan, options: RunOptions, first: float) -> Array:
    """Output times from ``first`` to the end of the run [s], (N,), N >= 2."""
    end = plan.scene.duration
    count = int(np.floor(end / options.interval * (1.0 - 1e-12))) + 1
    output_times = np.append(options.interval * np.arange(count), end)
    remaining = output_times[output_times > first + 1e-9 * options.interval]
    return np.append(first, remaining) if len(remaining) else np.array([first, np.nextafter(first, np.inf)])


def _break_times(plan: Plan, tolerance: float) -> Array:
    """All times that no step may cross, inside the run [s]: breakpoints, knots of tables and sampling times."""
    end = plan.scene.duration
    breaks: list[Array] = [np.asarray(plan.breakpoints)]
    breaks += [np.asarray(one.effect.knots(tolerance), dtype=np.float64) for one in plan.instances]
    for period in np.unique(plan.memory.view(plan.memory.numbers, "samples")["period"]):
        breaks.append(np.asarray(period * np.arange(1, int(np.ceil(end / period))), dtype=np.float64))
    times = np.unique(np.concatenate(breaks))
    times = times[(times > 0.0) & (times < end)]
    # Of times that differ only by rounding the last is kept: then everything due at them has happened.
    return np.asarray(times[np.append(np.diff(times) > 1e-9, True)]) if len(times) else times


def _stop_event(done: CompiledSolution, plan: Plan, numbers: Array) -> Event:
    """The event that describes why the run ended early."""
    t, solved = done.stopped_at, int(plan.memory.view(numbers, "engine")["solved"][0])
    if solved < 0:
        return unsolved_event(plan, t, solved)
    return Event(t, STOPPED_BY.get(done.code, "stopped"), done.stopped)


def _outcome(done: CompiledSolution, plan: Plan, numbers: Array, stopped: Event | None, skipped: int) -> Outcome:
    """The result of the run, without the first ``skipped`` output rows."""
    work, kept, logged = done.work, done.checkpoint, int(plan.memory.view(numbers, "engine")["logged"][0])
    first, size, _ = plan.memory.view(numbers, "sections")[AT.log]
    log = numbers[first : first + size].view(MODE_CHANGE)[: min(logged, MOST_EVENTS)]
    counters = {
        "steps": work.steps, "rejected": work.rejected, "rates": work.rates, "jacobians": work.jacobians,
        "factorisations": work.factorisations, "event_values": work.event_values, "mode_changes": logged,
    }  # fmt: skip
    events = tuple(mode_event(plan, *one) for one in log.tolist())
    left = {
        "numbers": numbers[: len(plan.memory.numbers)][plan.memory.changing],
        "run": kept.run.view(np.int64), "states": kept.states.view(np.int64), "events": kept.events.view(np.int64),
        "jacobian": kept.jacobian.ravel(),
    }  # fmt: skip
    return Outcome(done.states[skipped:], counters, events, stopped, left)


def _checkpoint(kept: dict[str, Array], problem: CompiledProblem, output_rows: int) -> Checkpoint:
    """The solver's checkpoint of an earlier run, with the data of this one and its output rows, not filled yet."""
    size, own = problem.size, kept["run"].copy().view(at.RUN)
    # Segments and rows count from here; the first row, where the earlier run ended, is not stored again.
    own["count"]["segment"], own["count"]["rows"] = 0, 1
    rows = np.zeros((output_rows, problem.hooks.width if problem.hooks else size))
    states, jacobian = kept["states"].view(at.STATE), kept["jacobian"].reshape(size + 1, size)
    numbers, words = problem.numbers.copy(), problem.words.copy()
    return Checkpoint(own, states, kept["events"].view(at.EVENT), jacobian, numbers, words, rows)
