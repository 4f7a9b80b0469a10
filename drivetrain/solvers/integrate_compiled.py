"""Integration of a right-hand side given by address: the compiled twin of ``integrate``, with events and resumption."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import layout as at
from drivetrain.solvers.compiled_events import VALUE_ROWS
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate import MOST_STEPS, inner_points, wanted_and_start
from drivetrain.solvers.solver import Solver, Work
from drivetrain.solvers.steppers import stepper

_LOG = 4096
_BATCH = 200_000  # steps between two looks at the progress


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that a run knows between two steps; a run that goes on from it gives the same bits as one never stopped.

    Attributes:
        block, values, clock, count: See ``rosenbrock_kernel.advance``.
        jacobian: The last one, which a refused step uses again, (n, n).
        numbers, words: The data of the problem, as its handler has left them.
        rows: States at the wanted instants, as far as it came.
        log: Instants [s] and indices of the events so far.
    """

    block: Array
    values: Array
    clock: Array
    count: Any
    jacobian: Array
    numbers: Array
    words: Any
    rows: Array
    log: tuple[tuple[float, ...], tuple[int, ...]] = ((), ())


@dataclass(frozen=True, eq=False)
class CompiledSolution:
    """States at the wanted instants, as far as the solver came.

    Attributes:
        times: Instants [s], (N,), those wanted, fewer if it stopped early.
        states: One row an instant [their own units], (N, n), or what ``Hooks.tell`` fills in.
        work: What it cost.
        stopped: Why it ended early, with what could help; empty when it did not.
        stopped_at: When [s]; the last wanted instant when it did not.
        culprit: Index of the state, or of the event, that the reason names; None when it names none.
        final: State at ``stopped_at``, before which every number can be trusted, (n,).
        event_times: Instants of the events [s].
        event_indices: Which they were.
        checkpoint: To go on from.
    """

    times: Array
    states: Array
    work: Work
    stopped: str
    stopped_at: float
    culprit: int | None
    final: Array
    event_times: Array
    event_indices: Any
    checkpoint: Checkpoint


@dataclass(frozen=True, eq=False)
class _Run:
    """The arrays of a run in the order in which the kernel takes them; see ``rosenbrock_kernel.advance``."""

    method: int
    addresses: Any
    data: tuple[Array, Any]
    block: Array
    matrices: tuple[Array, Array, Array, Array]
    order: Any
    pattern: tuple[Any, ...]
    carried: Any
    atol: Array
    settings: Array
    segments: tuple[Array, Array]
    wanted: Array
    rows: Array
    kinds: Any
    terminal: Any
    values: Array
    log: tuple[Array, Any]
    clock: Array
    count: Any
    events: tuple[list[float], list[int]] = field(default_factory=lambda: ([], []))

    def advance(self) -> int:
        from drivetrain.solvers.rosenbrock_kernel import advance  # compiles, or is read from disk: only when needed

        code = int(advance(
            self.method, self.addresses, self.data, self.block, self.matrices, self.order, self.pattern,
            self.carried, self.atol,
            self.settings, self.segments, self.wanted, self.rows, self.kinds, self.terminal, self.values, self.log,
            self.clock, self.count,
        ))  # fmt: skip
        logged = int(self.count[at.LOGGED])
        self.events[0].extend(self.log[0][:logged].tolist())
        self.events[1].extend(self.log[1][:logged].tolist())
        self.count[at.LOGGED] = 0
        return code


def integrate_compiled(
    problem: CompiledProblem,
    solver: Solver,
    start: Any,
    times: Any,
    *,
    breakpoints: Sequence[float] = (),
    most_steps: int = MOST_STEPS,
    pause_after: int | None = None,
    resume: Checkpoint | None = None,
    progress: Callable[[float], None] | None = None,
) -> CompiledSolution:
    """The states at wanted instants, without a call of Python between the first step and the last.

    Steps never cross a breakpoint, and on each side the right-hand side is asked only for instants of that side, and
    is told the number of the segment if it wants it (``CompiledProblem.segment_word``).

    Args:
        start: State at the first instant [its own units], (n,).
        times: Wanted instants, rising [s], (N,), N >= 2.
        breakpoints: Where the rates or their derivatives jump [s].
        most_steps: Stop after so many [-].
        pause_after: Come back after so many tried steps more, with a checkpoint to go on from; None: do not.
        progress: Called now and then with the instant reached [s].

    Raises:
        InputError: Times that do not rise, a start that is no finite vector, a solver that does not run compiled, a
            problem that does not declare itself smooth given to an adaptive method.
    """
    run = _prepared(problem, solver, start, times, breakpoints, resume)
    run.count[at.MOST_STEPS] = most_steps
    left = math.inf if pause_after is None else pause_after
    code = at.PAUSED
    while code == at.PAUSED and left > 0:
        batch = int(min(left, _BATCH))
        run.count[at.BUDGET] = batch
        code = run.advance()
        left -= batch - int(run.count[at.BUDGET])
        if progress:
            progress(float(run.clock[at.TIME]))
    return _solution(problem, run, code)


def _prepared(
    problem: CompiledProblem, solver: Solver, start: Any, times: Any, breakpoints: Sequence[float], resume: Any
) -> _Run:
    if not hasattr(solver, "compiled_settings"):
        problem_told = "must be a solver that runs compiled: Rodas4, Rodas5P, DormandPrince54, RungeKutta4 or Euler"
        raise InputError(Fault("solver", problem_told, solver))
    method, atol, settings = solver.compiled_settings(problem.size)
    settings[at.MAY_JUMP] = problem.may_jump
    if method <= at.DORMAND_PRINCE and not problem.declares_smooth:
        hint = "turn the jump into a breakpoint or an event with a handler, or step with a set-valued method"
        what = "an adaptive method needs rates that do not jump between breakpoints and events"
        raise InputError(Fault("problem.declares_smooth", what, False, hint))
    wanted, state = wanted_and_start(times, start)
    n, m = problem.size, len(problem.events.kinds) if problem.events else 0
    if len(state) != n:
        raise InputError(Fault("start", f"must have {n} entries, one a state", f"{len(state)} entries"))
    ends = np.array([*inner_points(breakpoints, wanted[0], wanted[-1]), wanted[-1]])
    limits = np.nextafter(ends, -np.inf)
    limits[-1] = ends[-1]
    carried = np.array(problem.hooks.carried if problem.hooks else (), dtype=np.int64)
    pattern = problem.pattern()
    events, kept = problem.events, resume or _fresh(problem, wanted, state, m)
    return _Run(
        method, np.append(problem.addresses(), stepper(method).address), (kept.numbers.copy(), kept.words.copy()),
        kept.block.copy(),
        (kept.jacobian.copy(), np.empty((n, n)), np.zeros((n + 1, n)), np.empty(n * n)),
        np.concatenate([np.empty(n * n + 2 * n + 1, dtype=np.int64), pattern[4]]), pattern, carried,
        atol, settings, (ends, limits), wanted, kept.rows.copy(),
        np.array(events.kinds if events else (), dtype=np.int64),
        np.array((events.terminal or (False,) * m) if events else (), dtype=np.int64),
        kept.values.copy(), (np.empty(max(_LOG, 2 * m)), np.empty(max(_LOG, 2 * m), dtype=np.int64)),
        kept.clock.copy(), kept.count.copy(), (list(kept.log[0]), list(kept.log[1])),
    )  # fmt: skip


def _fresh(problem: CompiledProblem, wanted: Array, state: Array, m: int) -> Checkpoint:
    block = np.zeros((at.BLOCK_ROWS, problem.size))
    block[at.X] = state
    clock, count = np.zeros(at.CLOCK_SIZE), np.zeros(at.COUNT_SIZE, dtype=np.int64)
    clock[at.TIME], clock[at.LAST_EVENT] = wanted[0], -np.inf
    clock[at.LAST_JUMP] = -np.inf
    count[at.SEGMENT_WORD], count[at.DIFFERENCES] = problem.segment_word, problem.differences
    rows = np.zeros((len(wanted), problem.hooks.width if problem.hooks and problem.hooks.tell else problem.size))
    jacobian, values = np.zeros((problem.size, problem.size)), np.zeros((VALUE_ROWS, m))
    return Checkpoint(block, values, clock, count, jacobian, problem.numbers, problem.words, rows)


def _solution(problem: CompiledProblem, run: _Run, code: int) -> CompiledSolution:
    count, clock = run.count, run.clock
    done, log = int(count[at.ROWS]), (tuple(run.events[0]), tuple(run.events[1]))
    work = Work(*(int(count[k]) for k in (at.RATES, at.STEPS, at.RESTARTS)))
    work = replace(
        work, rejected=int(count[at.REJECTED]), jacobians=int(count[at.JACOBIANS]),
        factorisations=int(count[at.FACTORISATIONS]), event_values=int(count[at.EVENT_VALUES]),
    )  # fmt: skip
    stopped = _reason(problem, run, code)
    culprit = int(count[at.CULPRIT]) if code >= at.NO_NUMBER or code == at.TERMINAL else None
    kept = Checkpoint(run.block, run.values, clock, count, run.matrices[0], *run.data, run.rows, log)
    return CompiledSolution(
        run.wanted[:done].copy(), run.rows[:done].copy(), work, stopped, float(clock[at.TIME]), culprit,
        run.block[at.X].copy(), np.array(log[0]), np.array(log[1], dtype=np.int64), kept,
    )  # fmt: skip


def _reason(problem: CompiledProblem, run: _Run, code: int) -> str:
    """Why it ended early, and what could help."""
    t, culprit = float(run.clock[at.TIME]), int(run.count[at.CULPRIT])
    if code == at.DONE:
        return ""
    if code == at.PAUSED:
        return f"paused at {t:.9g} s; go on from its checkpoint"
    if code == at.TOO_MANY:
        return f"{int(run.count[at.MOST_STEPS])} steps taken at {t:.9g} s; allow more, or a looser tolerance"
    if code in (at.TERMINAL, at.ZENO) and problem.events:
        name = problem.events.name(culprit)
        if code == at.TERMINAL:
            return f"{name} at {t:.9g} s ends it"
        return f"{name} happens again and again at {t:.9g} s and time does not pass; its handler must force a change"
    name = problem.name(culprit)
    if code == at.NO_NUMBER:
        return f"the rate of {name} is no number at {t:.9g} s"
    if code == at.RUNS_AWAY:
        return f"{name} runs away at {t:.9g} s: no step is short enough to stay among the numbers; it diverges"
    if code == at.JUMP:
        return _jump(problem, run, name)
    return f"no step is short enough for the tolerance of {name} at {t:.9g} s; loosen it, or look for a jump there"


def _jump(problem: CompiledProblem, run: _Run, name: str) -> str:
    clock, argument = run.clock, int(run.count[at.ARGUMENT])
    sizes = f"from {clock[at.BEFORE]:.6g} to {clock[at.AFTER]:.6g}"
    if argument < 0:
        mend = "make that instant a breakpoint"
        return f"the right-hand side jumps at {clock[at.JUMP_AT]:.12g} s: the rate of {name} {sizes}; {mend}"
    where = f"{problem.name(argument)} = {run.block[at.X, argument]:.6g}"
    mend = "make the jump an event with a handler, or use a set-valued method; sign() is no right-hand side"
    return f"the right-hand side jumps at {clock[at.JUMP_AT]:.12g} s, {where}: the rate of {name} {sizes}; {mend}"
