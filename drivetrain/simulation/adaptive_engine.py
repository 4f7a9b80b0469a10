"""E2: steps as long as a tolerance allows, friction's modes changed at located events: the engine for accuracy.

The same effects, mechanics and friction as the fixed implicit step, whose limit for short steps it is. No step crosses
a breakpoint or a sample; on each side the laws are asked only for instants of that side.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.simulation import adaptive_kernel as kernel
from drivetrain.simulation import fields as f
from drivetrain.simulation import jacobian_kernel, rates_kernel
from drivetrain.simulation.beginning import started
from drivetrain.simulation.dependence import dependence
from drivetrain.simulation.engine import Engine, Outcome, Wish, column_names
from drivetrain.simulation.plan import Plan
from drivetrain.simulation.plan import plan as planned
from drivetrain.simulation.recording import Event
from drivetrain.solvers import records as at
from drivetrain.solvers.compiled_problem import CompiledProblem, Events, Hooks, column_groups
from drivetrain.solvers.integrate_compiled import Checkpoint, CompiledSolution, integrate_compiled
from drivetrain.solvers.rosenbrock import Rodas4, Rodas5P
from drivetrain.solvers.solver import Solver

ROOM = 20_000  # events told; more are counted
CHUNK = 20_000  # steps between two looks at the progress
USUAL = 1e-6  # the rtol to which the states' own tolerances belong


@dataclass(frozen=True)
class AdaptiveStep(Engine):
    """The engine for accuracy.

    Attributes:
        solver: Rodas5P or Rodas4, or, to compare with, another solver that runs compiled. Where one of these two has no
            absolute tolerances of its own, those of the plan's states are taken, in proportion to its relative one.
    """

    solver: Solver = field(default_factory=Rodas5P)

    def run(self, plan: Plan, wish: Wish) -> Outcome:
        """Run a plan with steps that hold a tolerance.

        Raises:
            InputError: What is to be resumed belongs to another scene; a solver that does not run compiled.
        """
        plan = _refined(plan)
        numbers, words = plan.memory.numbers.copy(), plan.memory.words.copy()
        if wish.resume is None:
            numbers = started(plan, numbers, words)
            first, kept = 0.0, None
        else:
            _fits(wish.resume, plan, words)
            first, kept = float(wish.resume["clock"].view(at.CLOCK)["time"][0]), wish.resume
        words[f.HELD_MODES], words[f.MOVING] = 1, plan.memory.moving
        place = int(words[f.AT_STATE])
        start = numbers[place : place + plan.memory.moving].copy()
        hangs = dependence(plan)[: plan.memory.moving, : plan.memory.moving]
        problem = _problem(plan, *_extended(plan, numbers, words, hangs), hangs)
        times, breaks = _instants(plan, wish, first), _breaks(plan, words, getattr(self.solver, "rtol", 0.0))
        run = _Run(problem, _tuned(self.solver, plan), start, times, breaks)
        return run.looped(plan, wish, None if kept is None else _checkpoint(kept, plan, run))


@dataclass(frozen=True, eq=False)
class _Run:
    """What stays the same from chunk to chunk."""

    problem: CompiledProblem
    solver: Solver
    start: Array
    times: Array
    breaks: Array

    def looped(self, plan: Plan, wish: Wish, resume: Checkpoint | None) -> Outcome:
        """Integrate chunk by chunk, and tell how far it has come."""
        stopped, end = None, plan.scene.duration
        while True:
            done = integrate_compiled(
                self.problem, self.solver, self.start, self.times,
                breakpoints=self.breaks.tolist(), pause_after=CHUNK, resume=resume,
            )  # fmt: skip
            if not done.stopped.startswith("paused"):
                break
            resume = done.checkpoint
            if wish.progress is not None and wish.progress(done.stopped_at / end) is False:
                stopped = Event(done.stopped_at, "stopped", "by the progress callback; it can be resumed")
                break
        if stopped is None and done.stopped:
            stopped = _stopped(done, plan)
        return _outcome(done, plan, stopped, 0 if self.times[0] == 0.0 else 1)


def _refined(plan: Plan) -> Plan:
    """The plan of the same scene without effects that wait between steps of their own."""
    effects = {name: tuple(effect.refined() for effect in own) for name, own in plan.scene.effects.items()}
    same = all(a is b for name, own in plan.scene.effects.items() for a, b in zip(own, effects[name], strict=True))
    return plan if same else planned(replace(plan.scene, effects=effects))


def _extended(plan: Plan, numbers: Array, words: Any, hangs: Any) -> tuple[Array, Any]:
    """Numbers and words with what the adaptive engine itself needs behind them: modes, log, groups of the Jacobian."""
    c, states = plan.body.c, plan.memory.moving
    own = [0, ROOM, int(plan.memory.memory.any()), *[0] * (2 * c)]
    starts, columns, row_starts, rows = column_groups(hangs, states)
    at = len(words) + 2 + len(own), len(numbers) + kernel.ENTRY * ROOM
    columns = np.append(columns, np.zeros(states - len(columns), dtype=np.int64))  # some are in no group
    groups = [len(starts) - 1, *starts, *columns, *row_starts, *rows]
    sizes = np.zeros(jacobian_kernel.room(states, c))
    sizes[:states] = plan.memory.atol[:states] / USUAL
    return np.concatenate([numbers, np.zeros(kernel.ENTRY * ROOM), sizes]), np.concatenate([words, at, own, groups])


def _problem(plan: Plan, numbers: Array, words: Any, hangs: Any) -> CompiledProblem:
    c, felt = plan.body.c, hangs.copy()
    if words[f.KIND] == f.ARM:
        felt[c : 2 * c] = hangs[c : 2 * c].any(axis=0)  # through the inertia every acceleration feels every torque
    rubs = Events(kernel.values(), (at.GUARD,) * c, handler=kernel.handler(), names=tuple(_coordinates(plan)))
    hooks = Hooks(kernel.account(), (), kernel.tell(), 1 + len(column_names(plan)), kernel.opens())
    names = tuple(plan.memory.states)[: plan.memory.moving]
    events = rubs if _rubs(plan) else None
    return CompiledProblem(
        rates_kernel.rates(), len(names), numbers, words, jacobian=jacobian_kernel.jacobian(), sparsity=felt,
        events=events, hooks=hooks, names=names, may_jump=True, differences=2 + int(words[words[words[f.WORDS]]]),
    )  # fmt: skip


def _rubs(plan: Plan) -> bool:
    """Whether any effect has dry friction or mesh loss."""
    adders = plan.signals.adders
    return any(adders[name] for name in adders if "_hold_" in name or "_slide_" in name or ".mesh_dri" in name)


def _coordinates(plan: Plan) -> list[str]:
    """Names of the coordinates: joints, then motors on springs."""
    names = [*plan.scene.joints, *[""] * len(plan.body.springs)]
    for i in plan.body.springs:
        names[plan.body.motors[i]] = f"motor of {plan.scene.joints[i]}"
    return names


def _tuned(solver: Solver, plan: Plan) -> Solver:
    """The solver with the tolerances of the plan's states."""
    if isinstance(solver, Rodas4) and solver.atol is None:
        atol = plan.memory.atol[: plan.memory.moving] * (solver.rtol / USUAL)
        return replace(solver, atol=tuple(float(a) for a in atol))
    return solver


def _instants(plan: Plan, wish: Wish, first: float) -> Array:
    """Wanted instants from the first on."""
    end = plan.scene.duration
    wanted = np.append(wish.interval * np.arange(int(np.floor(end / wish.interval * (1.0 - 1e-12))) + 1), end)
    later = wanted[wanted > first + 1e-9 * wish.interval]
    return np.append(first, later) if len(later) else np.array([first, np.nextafter(first, np.inf)])


def _breaks(plan: Plan, words: Any, tolerance: float) -> Array:
    """Breakpoints, knots and samples [s]."""
    end = plan.scene.duration
    breaks: list[Array] = [np.asarray(plan.breakpoints)]
    breaks += [np.asarray(one.effect.knots(tolerance), dtype=np.float64) for one in plan.instances]
    for k in range(words[f.SAMPLES]):
        period = float(plan.memory.numbers[words[words[f.AT_SAMPLES] + 4 * k + 2]])
        breaks.append(np.asarray(period * np.arange(1, int(np.ceil(end / period))), dtype=np.float64))
    every = np.unique(np.concatenate(breaks))
    every = every[(every > 0.0) & (every < end)]
    # Of instants that differ by rounding alone the later one counts: all have then happened.
    return np.asarray(every[np.append(np.diff(every) > 1e-9, True)]) if len(every) else every


def _stopped(done: CompiledSolution, plan: Plan) -> Event:
    """What ended the run."""
    t, words = done.stopped_at, done.checkpoint.words
    if int(words[f.SOLVED]) < 0:
        jammed = -1 - int(words[f.SOLVED])
        if jammed < 1000:
            where = _coordinates(plan)[jammed]
            return Event(t, "jammed", f"{where}: its mesh friction has no solution in this posture")
        return Event(t, "endless", "no set of sticking and sliding joints fits")
    kinds = {"jumps": "jump", "again and again": "endless", "diverges": "diverged", "no number": "diverged"}
    return Event(t, next((name for mark, name in kinds.items() if mark in done.stopped), "stopped"), done.stopped)


def _outcome(done: CompiledSolution, plan: Plan, stopped: Event | None, skipped: int) -> Outcome:
    work, kept = done.work, done.checkpoint
    logged = int(kept.words[plan.memory.words.size + kernel.LOGGED])
    first = plan.memory.numbers.size
    log = kept.numbers[first : first + kernel.ENTRY * min(logged, ROOM)].reshape(-1, kernel.ENTRY)
    counters = {
        "steps": work.steps, "rejected": work.rejected, "rates": work.rates, "jacobians": work.jacobians,
        "factorisations": work.factorisations, "event_values": work.event_values, "mode_changes": logged,
    }  # fmt: skip
    events = tuple(_told(row, plan) for row in log)
    return Outcome(done.states[skipped:], counters, events, stopped, _kept(kept, plan))


def _told(row: Array, plan: Plan) -> Event:
    """A change of friction's mode, in words."""
    words = {0: "stuck", 1: "slides forward", -1: "slides backward"}
    before, after = int(row[2]), int(row[3])
    name = "stick" if after == 0 else "breakaway" if before == 0 else "reversal"
    return Event(float(row[0]), name, f"{_coordinates(plan)[int(row[1])]}: {words[before]}, then {words[after]}")


def _kept(done: Checkpoint, plan: Plan) -> dict[str, Array]:
    """All that a run needs to go on."""
    words = done.words
    modes, samples = words[f.AT_MODES], words[f.AT_SAMPLES]
    return {
        "numbers": done.numbers[: plan.memory.kept].copy(),
        "modes": words[modes : modes + 3 * words[f.COORDINATES]].copy(),
        "samples": words[samples : samples + 4 * words[f.SAMPLES]][3::4].copy(),
        "states": done.states.view(np.float64),
        "values": done.values,
        "jacobian": done.jacobian.ravel(),
        "clock": done.clock.view(np.float64),
        "count": done.count.view(np.int64),
    }


def _fits(kept: dict[str, Array], plan: Plan, words: Any) -> None:
    """Refuse what another scene, or another engine, has kept."""
    size, c = plan.memory.moving, int(words[f.COORDINATES])
    fits = {
        "numbers": plan.memory.kept, "modes": 3 * c, "samples": int(words[f.SAMPLES]),
        "states": size * at.STATE.itemsize // 8, "jacobian": size * size,
        "clock": at.CLOCK.itemsize // 8, "count": at.COUNT.itemsize // 8,
    }  # fmt: skip
    if any(name not in kept or len(kept[name]) != length for name, length in fits.items()):
        hint = "resume with the same effects, joints and engine"
        raise InputError(Fault("resume", "belongs to another scene", hint=hint))


def _checkpoint(kept: dict[str, Array], plan: Plan, run: _Run) -> Checkpoint:
    """Where an earlier run was, in terms of this one."""
    numbers, words = run.problem.numbers.copy(), run.problem.words.copy()
    c, modes, samples = words[f.COORDINATES], words[f.AT_MODES], words[f.AT_SAMPLES]
    numbers[: plan.memory.kept] = kept["numbers"]
    words[modes : modes + 3 * c] = kept["modes"]
    words[samples : samples + 4 * words[f.SAMPLES]][3::4] = kept["samples"]
    size, clock, count = plan.memory.moving, kept["clock"].view(at.CLOCK), kept["count"].astype(np.int64)
    # Segments and rows count from here; the first row is where the earlier run ended, and is not told again.
    count.view(at.COUNT)["segment"], count.view(at.COUNT)["rows"] = 0, 1
    rows = np.zeros((len(run.times), run.problem.hooks.width if run.problem.hooks else size))
    states, jacobian = kept["states"].view(at.STATE), kept["jacobian"].reshape(size, size)
    return Checkpoint(states, jacobian, kept["values"], clock, count.view(at.COUNT), numbers, words, rows)
