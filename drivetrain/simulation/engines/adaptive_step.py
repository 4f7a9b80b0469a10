"""E2: steps as long as a tolerance allows, friction's modes changed at located events: the engine for accuracy.

The same effects, mechanics and friction as the fixed implicit step, whose limit for short steps it is. No step crosses
a breakpoint or a sample; on each side the laws are asked only for instants of that side.

Friction has a mode a coordinate: stuck, or sliding one way. Within a step the mode is given, so the rates are smooth;
it changes at an event, located by the solver: a sliding coordinate comes to rest, or what a stuck one holds reaches its
bound. Then the change that belongs to the event is forced, and only what it does to the others is left to
complementarity: who asks "which mode?" anew at rest gets the old answer back, for ever.
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
    OPEN,
    OPEN_WORDS,
    account_at,
    pass_payloads,
    put_row,
    put_states,
    rates,
    right_side,
    solve_at,
    take_samples,
)
from drivetrain.simulation.core.friction import NO_SET
from drivetrain.simulation.core.jacobian import dependence
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
from drivetrain.simulation.engines.fixed_step import mode_event, resumed
from drivetrain.simulation.engines.starting import started
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event
from drivetrain.solvers import records as at
from drivetrain.solvers.compiled_problem import CompiledProblem, Events, Hooks
from drivetrain.solvers.integrate_compiled import Checkpoint, CompiledSolution, integrate_compiled
from drivetrain.solvers.solver import Adaptive, Rodas4, Rodas5P, Solver

AT_REST = 1e-5  # [rad/s or m/s]: what is slower when its speed crosses zero is at rest
TOGETHER = 1e-9  # of its friction: what is closer to its bound when another lets go does so too
QUIET = 3e-8  # [rad/s^2 or m/s^2]: less beyond its bound a mesh does not let go; more than what comes to rest needs
PUSH = 1e-300  # [rad/s]: a speed that marks in which direction a coordinate was pushed off


@part
def _solve(run: Run, t: float, x: Any) -> None:
    """The equations at an instant."""
    put_states(run, x)
    solve_at(run, t)


def _values(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """How far each coordinate and each guard is from changing its mode; negative when it has overdone it."""
    coordinates, guards, memory = coordinates_of(run), guards_of(run), memory_of(run)
    guarded = len(guards) > 0
    for i in range(len(coordinates)):
        guarded = guarded or coordinates[i].dry.mode == 0 or coordinates[i].surface != 0.0
    if guarded:
        _solve(run, t, x)
    if len(guards):
        account_at(run, t)
    for k in range(len(guards)):
        result[len(coordinates) + k] = memory[guards[k].value]
    for i in range(len(coordinates)):
        one = coordinates[i]
        if not one.dry.active:
            result[i] = 1.0
        elif one.dry.mode == 0:
            # A mesh without load has no bound: the first push would come at 1e-150 s, or by rounding.
            result[i] = one.margin + (QUIET * pairs_of(run)[i, i].matrix if one.dry.driven != 0.0 else 0.0)
            if one.margin < 0.0:
                # It breaks loose the way in which it gave, also where the force at the event itself is zero.
                one.gave = 1 if one.friction >= 0.0 else -1
        else:
            result[i] = one.dry.mode * (x[len(coordinates) + i] - one.surface)


@part
def _own_states(run: Run, x: Any) -> None:
    """States of effects, which these have changed."""
    states, memory = states_of(run), memory_of(run)
    for k in range(2 * len(coordinates_of(run)), engine_of(run).moving):
        x[k] = memory[states[k].value]


def _handler(t: Any, x: Any, crossed: Any, numbers: Any, run: Any) -> None:
    """Force the change of mode that an event stands for, and let the others at rest find theirs."""
    coordinates = coordinates_of(run)
    c, letting_go = len(coordinates), False
    _solve(run, t, x)
    for i in range(c):
        letting_go = letting_go or (crossed[i] != 0.0 and coordinates[i].dry.mode == 0)
    for i in range(c):
        one = coordinates[i]
        one.before = one.dry.mode
        # Who reaches its bound at the same instant lets go with the first.
        joins = letting_go and one.dry.mode == 0 and one.margin <= TOGETHER * abs(one.friction)
        if (crossed[i] == 0.0 and not joins) or not one.dry.active:
            continue
        if one.dry.mode == 0:
            if crossed[i] == 0.0:
                one.gave = 1 if one.friction >= 0.0 else -1
            x[c + i] = one.surface + one.gave * max(PUSH, 4e-16 * abs(one.surface))
        elif abs(x[c + i] - one.surface) <= AT_REST:
            x[c + i] = one.surface
            one.dry.mode = 0  # what comes to rest sticks, unless that asks too much of friction
    guards = guards_of(run)
    if len(guards):
        account_at(run, t)
    for k in range(len(guards)):
        if crossed[c + k] != 0.0:
            call_law(run, guards[k], t, 0.0)
            _own_states(run, x)
    engine_of(run).held = 0
    _solve(run, t, x)
    engine_of(run).held = 1
    call_equations(run, engine_of(run).outcomes_law, t, 1.0)
    log = carray(run[AT.log], count_of(run, AT.log), MODE_CHANGE)
    engine_of(run).logged = log_changes(run, t, log, engine_of(run).logged)


def _account(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Powers and what effects remember, over the time that this instant stands for."""
    h = result[0]
    memory, powers, energies = memory_of(run), words_of(run, AT.powers), numbers_of(run, AT.energies)
    _solve(run, t, x)
    # Powers are those of the instant; with h > 0 effects put out means over a fixed step that begins here.
    account_at(run, t)
    for k in range(len(powers)):
        energies[k] += h * memory[powers[k]]


def _record(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    _solve(run, t, x)
    account_at(run, t)
    put_row(run, t, result)


def _opens(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Samples that are due where a segment begins."""
    put_states(run, x)
    pass_payloads(run, t)
    take_samples(run, t, 0.0, 1e-6)
    _own_states(run, x)


ROOM = 20_000  # events stored; more are counted
CHUNK = 20_000  # steps between two looks at the progress
USUAL = 1e-6  # the rtol to which the states' own tolerances belong


@dataclass(frozen=True)
class AdaptiveStep(Engine):
    """The engine for accuracy.

    Attributes:
        solver: Rodas5P or Rodas4, or, to compare with, another solver that runs compiled. Where one of these two has no
            absolute tolerances of its own, those of the plan's states are taken, in proportion to its relative one.
        most_steps: After so many a run stops and reports how far it has come; resumed, it may take as many again.
    """

    solver: Solver = field(default_factory=Rodas5P)
    most_steps: int = 20_000_000

    def __post_init__(self) -> None:
        if not isinstance(self.most_steps, int) or self.most_steps < 1:
            raise InputError(Fault("AdaptiveStep.most_steps", "must be a whole number, at least 1", self.most_steps))

    @property
    def tolerance(self) -> float:
        return float(getattr(self.solver, "rtol", 0.0))

    def finer(self, period: float = math.inf) -> AdaptiveStep:
        if not isinstance(self.solver, Adaptive):
            raise InputError(Fault("verify", "needs a solver with a tolerance", type(self.solver).__name__))
        atol = self.solver.atol
        tenth = tuple(0.1 * one for one in atol) if isinstance(atol, tuple) else atol if atol is None else 0.1 * atol
        return replace(self, solver=replace(self.solver, rtol=0.1 * self.solver.rtol, atol=tenth))

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Run a plan with steps that hold a tolerance."""
        if options.resume is None:
            numbers, first, kept = started(plan, options.start), 0.0, None
        else:
            kept, size = options.resume, plan.memory.moving
            sizes = {"run": at.RUN.itemsize // 8, "states": size * (at.STATE.itemsize // 8)}
            numbers = resumed(kept, plan, {**sizes, "jacobian": size * (size + 1)})
            first = float(kept["run"].view(at.RUN)["clock"]["time"][0])
        start = numbers[plan.memory.view(numbers, "states")["value"][: plan.memory.moving]]
        hangs = dependence(plan)[: plan.memory.moving, : plan.memory.moving]
        numbers = _extended(plan, numbers, hangs)
        problem = _problem(plan, numbers)
        times, breaks = _instants(plan, options, first), _breaks(plan, getattr(self.solver, "rtol", 0.0))
        run = _Run(numbers, problem, _tuned(self.solver, plan), start, times, breaks, self.most_steps)
        return run.looped(plan, options, None if kept is None else _checkpoint(kept, plan, run))


@dataclass(frozen=True, eq=False)
class _Run:
    """What stays the same from chunk to chunk, and a run's numbers, which the problem refers to by addresses."""

    numbers: Array
    problem: CompiledProblem
    solver: Solver
    start: Array
    times: Array
    breaks: Array
    most_steps: int

    def looped(self, plan: Plan, options: RunOptions, resume: Checkpoint | None) -> Outcome:
        """Integrate chunk by chunk, and report progress."""
        stopped, end = None, plan.scene.duration
        most_steps = self.most_steps + (0 if resume is None else int(resume.run["count"]["steps"][0]))
        while True:
            done = integrate_compiled(
                self.problem, self.solver, self.start, self.times,
                breakpoints=self.breaks.tolist(), most_steps=most_steps, pause_after=CHUNK, resume=resume,
            )  # fmt: skip
            if not done.stopped.startswith("paused"):
                break
            resume = done.checkpoint
            if options.progress is not None and options.progress(done.stopped_at / end) is False:
                stopped = Event(done.stopped_at, "stopped", "by the progress callback; it can be resumed")
                break
        if stopped is None and done.stopped:
            stopped = _stopped(done, plan, self.numbers)
        return _outcome(done, plan, self.numbers, stopped, 0 if self.times[0] == 0.0 else 1)


def _extended(plan: Plan, numbers: Array, hangs: Any) -> Array:
    """A run's numbers with what the adaptive engine itself needs behind them: a log, room of the Jacobian."""
    sizes = plan.memory.atol[: plan.memory.moving] / USUAL
    sections = {"log": np.zeros(ROOM, MODE_CHANGE), **jacobian.room(sizes, plan.body.c, hangs)}
    engine, listed = plan.memory.view(numbers, "engine")[0], plan.memory.view(numbers, "sections")
    first = len(numbers)
    for name, values in sections.items():
        listed[SECTIONS.index(name)] = first, values.nbytes // 8, len(values)
        first += values.nbytes // 8
    plan.memory.view(numbers, "world")["size"] = first
    engine["held"] = 1
    return np.concatenate([numbers, *(np.ascontiguousarray(values).view(np.float64) for values in sections.values())])


def _problem(plan: Plan, numbers: Array) -> CompiledProblem:
    guarded = tuple(one.title for one in plan.instances if one.ports.guard)
    watched = (*plan.coordinates, *guarded)
    changes = Events(right_side(_values), right_side(_handler), watched)
    adders = plan.signals.adders
    dry = any(adders[name] for name in adders if "_hold_" in name or "_slide_" in name or ".mesh_dri" in name)
    hooks = Hooks(right_side(_account), right_side(_record), 1 + len(plan.layout.columns), right_side(_opens))
    names = tuple(plan.memory.states)[: plan.memory.moving]
    groups = int(plan.memory.view(numbers, "sections")["count"][AT.groups])
    return CompiledProblem(
        right_side(rates), len(names), words=parts_of(numbers), jacobian=right_side(jacobian.jacobian),
        events=changes if guarded or dry else None, hooks=hooks, names=names, may_jump=True, differences=1 + groups,
    )  # fmt: skip


def _tuned(solver: Solver, plan: Plan) -> Solver:
    """The solver with the tolerances of the plan's states."""
    if isinstance(solver, Rodas4) and solver.atol is None:
        atol = plan.memory.atol[: plan.memory.moving] * (solver.rtol / USUAL)
        return replace(solver, atol=tuple(float(a) for a in atol))
    return solver


def _instants(plan: Plan, options: RunOptions, first: float) -> Array:
    end = plan.scene.duration
    wanted = np.append(options.interval * np.arange(int(np.floor(end / options.interval * (1.0 - 1e-12))) + 1), end)
    later = wanted[wanted > first + 1e-9 * options.interval]
    return np.append(first, later) if len(later) else np.array([first, np.nextafter(first, np.inf)])


def _breaks(plan: Plan, tolerance: float) -> Array:
    """Breakpoints, knots and samples [s]."""
    end = plan.scene.duration
    breaks: list[Array] = [np.asarray(plan.breakpoints)]
    breaks += [np.asarray(one.effect.knots(tolerance), dtype=np.float64) for one in plan.instances]
    for period in np.unique(plan.memory.view(plan.memory.numbers, "samples")["period"]):
        breaks.append(np.asarray(period * np.arange(1, int(np.ceil(end / period))), dtype=np.float64))
    every = np.unique(np.concatenate(breaks))
    every = every[(every > 0.0) & (every < end)]
    # Of instants that differ by rounding alone the later one counts: all have then happened.
    return np.asarray(every[np.append(np.diff(every) > 1e-9, True)]) if len(every) else every


def _stopped(done: CompiledSolution, plan: Plan, numbers: Array) -> Event:
    """What ended the run."""
    t, solved = done.stopped_at, int(plan.memory.view(numbers, "engine")["solved"][0])
    if solved == OPEN:
        return Event(t, "apart", OPEN_WORDS)
    if solved < 0:
        if solved > NO_SET:
            problem = "its mesh friction has no solution in this posture"
            return Event(t, "jammed", f"{plan.coordinates[-1 - solved]}: {problem}")
        return Event(t, "endless", "no set of sticking and sliding joints fits")
    kinds = {
        "steps taken": "budget",
        "jumps": "jump",
        "again and again": "endless",
        "diverges": "diverged",
        "no number": "diverged",
    }
    return Event(t, next((name for mark, name in kinds.items() if mark in done.stopped), "stopped"), done.stopped)


def _outcome(done: CompiledSolution, plan: Plan, numbers: Array, stopped: Event | None, skipped: int) -> Outcome:
    work, kept, logged = done.work, done.checkpoint, int(plan.memory.view(numbers, "engine")["logged"][0])
    first, size, _ = plan.memory.view(numbers, "sections")[AT.log]
    log = numbers[first : first + size].view(MODE_CHANGE)[: min(logged, ROOM)]
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


def _checkpoint(kept: dict[str, Array], plan: Plan, run: _Run) -> Checkpoint:
    """Where an earlier run was, in terms of this one."""
    size, own = plan.memory.moving, kept["run"].copy().view(at.RUN)
    # Segments and rows count from here; the first row is where the earlier run ended, and is not stored again.
    own["count"]["segment"], own["count"]["rows"] = 0, 1
    rows = np.zeros((len(run.times), run.problem.hooks.width if run.problem.hooks else size))
    states, jacobian = kept["states"].view(at.STATE), kept["jacobian"].reshape(size + 1, size)
    numbers, words = run.problem.numbers.copy(), run.problem.words.copy()
    return Checkpoint(own, states, kept["events"].view(at.EVENT), jacobian, numbers, words, rows)
