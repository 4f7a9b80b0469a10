"""Integration of a right-hand side given by address, with events and resumption."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import records as r
from drivetrain.solvers.compiled_problem import CompiledProblem, Events, Hooks
from drivetrain.solvers.jump import jump_stays
from drivetrain.solvers.solver import MOST_STEPS, Solver, Work, inner_points, wanted_and_start
from drivetrain.solvers.tableaux import Tableau

_LOG = 4096
_BATCH = 200_000  # steps between two looks at the progress


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that a run knows between two steps; a run that goes on from it gives the same bits as one never stopped.

    Attributes:
        states: One record a state, see ``records``, (n,).
        jacobian: The last one, which a refused step uses again, (n, n).
        values: Event values at the state, (m,).
        clock, count: One record each, see ``records``, (1,).
        numbers, words: The data of the problem, as its handler has left them.
        rows: States at the wanted instants, as far as it came.
        log: Instants [s] and indices of the events so far.
    """

    states: Any
    jacobian: Array
    values: Array
    clock: Any
    count: Any
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
class _Job:
    """The arguments of ``loop.advance``, and the events of all its calls."""

    sizes: Any
    tableau: Tableau
    run: r.Run
    linear: r.Linear
    events: r.EventRoom
    output: r.Output
    segments: r.Segments
    kept: Checkpoint
    times: list[float]
    indices: list[int]

    def advance(self) -> int:
        from drivetrain.solvers.loop import loop  # compiles, or is read from disk: only when needed

        code = r.SUSPECT
        parts = (*self.tableau, *self.run, *self.linear, *self.events, *self.output, *self.segments)
        given = [one.ctypes.data if isinstance(one, np.ndarray) else one for one in parts]
        while code == r.SUSPECT:
            code = int(loop()(self.sizes.ctypes.data, *given))
            if code == r.SUSPECT and jump_stays(self.run, self.kept.numbers, self.kept.words):
                code = r.JUMP
            elif code == r.SUSPECT and self.run.count[0].ends:
                code = r.TOO_SHORT
        logged = int(self.run.count[0].logged)
        self.times.extend(self.events.log_times[:logged].tolist())
        self.indices.extend(self.events.log_indices[:logged].tolist())
        self.run.count[0].logged = 0
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
    job = _prepared(problem, solver, start, times, breakpoints, most_steps, resume)
    left = math.inf if pause_after is None else pause_after
    code, count = r.PAUSED, job.run.count[0]
    while code == r.PAUSED and left > 0:
        batch = int(min(left, _BATCH))
        count.budget = batch
        code = job.advance()
        left -= batch - int(count.budget)
        if progress:
            progress(float(job.run.clock[0].time))
    return _solution(problem, job, code)


def _prepared(
    problem: CompiledProblem,
    solver: Solver,
    start: Any,
    times: Any,
    breakpoints: Sequence[float],
    most_steps: int,
    resume: Checkpoint | None,
) -> _Job:
    tableau, atol, settings = solver.compiled_settings(problem.size)
    if tableau.adaptive and not problem.declares_smooth:
        hint = "turn the jump into a breakpoint or an event with a handler, or step with a set-valued method"
        what = "an adaptive method needs rates that do not jump between breakpoints and events"
        raise InputError(Fault("problem.declares_smooth", what, False, hint))
    wanted, state = wanted_and_start(times, start)
    n = problem.size
    if len(state) != n:
        raise InputError(Fault("start", f"must have {n} entries, one a state", f"{len(state)} entries"))
    ends = np.array([*inner_points(breakpoints, wanted[0], wanted[-1]), wanted[-1]])
    limits = np.nextafter(ends, -np.inf)
    limits[-1] = ends[-1]
    kept = _copied(resume) if resume is not None else _fresh(problem, wanted, state)
    told = {**settings, "may_jump": problem.may_jump, "segment_word": problem.segment_word}
    told |= {"differences": problem.differences, "most_steps": most_steps}
    stages, data = len(tableau.times), {"numbers": kept.numbers.ctypes.data, "words": kept.words.ctypes.data}
    calls = problem.addresses() | data
    kept.states["atol"] = atol
    run = r.Run(
        kept.states, np.empty((n, stages)), np.empty((n, 4)), np.empty(n), np.empty(n), _record(r.CALLS, calls),
        _record(r.SETTINGS, told), kept.clock.view(np.recarray), kept.count.view(np.recarray),
    )  # fmt: skip
    places = np.empty((n + 3, n), dtype=np.uint64)
    linear = r.Linear(
        kept.jacobian, np.zeros((n + 1, n)), np.empty((n, n)), places[n], places[:n], places[n + 1], places[n + 2],
        np.empty(n), *problem.pattern(),
    )  # fmt: skip
    events = _event_room(problem.events, kept.values)
    carried = np.array((problem.hooks or Hooks()).carried, dtype=np.int64)
    sizes = {
        "states": n, "stages": stages, "groups": len(linear.starts) - 1, "grouped": len(linear.columns),
        "entries": len(linear.row_indices), "events": len(kept.values), "log": len(events.log_times),
        "wanted": len(wanted), "width": kept.rows.shape[1], "carried": len(carried), "segments": len(ends),
        "words": len(kept.words),
    }  # fmt: skip
    output, segments = r.Output(wanted, kept.rows, carried), r.Segments(ends, limits, kept.words)
    return _Job(
        _record(r.SIZES, sizes),
        tableau,
        run,
        linear,
        events,
        output,
        segments,
        kept,
        list(kept.log[0]),
        list(kept.log[1]),
    )


def _record(kind: Any, values: dict[str, Any]) -> Any:
    """A record of some of its fields; the others are 0."""
    made = np.zeros(1, dtype=kind).view(np.recarray)
    for name, value in values.items():
        made[name] = value
    return made


def _event_room(events: Events | None, old: Array) -> r.EventRoom:
    m, whole = len(old), np.int64
    terminal = (events.terminal if events else None) or (False,) * m
    room = max(_LOG, 2 * m)
    return r.EventRoom(
        np.array(events.kinds if events else (), dtype=whole), np.array(terminal, dtype=whole), old,
        np.zeros(m), np.zeros(m), np.zeros(m), np.empty(room), np.empty(room, dtype=whole),
    )  # fmt: skip


def _fresh(problem: CompiledProblem, wanted: Array, x: Array) -> Checkpoint:
    n, m = problem.size, len(problem.events.kinds) if problem.events else 0
    clock, count = np.zeros(1, dtype=r.CLOCK), np.zeros(1, dtype=r.COUNT)
    clock["time"], clock["last_event"], clock["last_jump"] = wanted[0], -np.inf, -np.inf
    rows = np.zeros((len(wanted), problem.hooks.width if problem.hooks and problem.hooks.tell else n))
    states = np.zeros(n, dtype=r.STATE)
    states["x"] = x
    own = problem.numbers.copy(), problem.words.copy()
    return Checkpoint(states, np.zeros((n, n)), np.zeros(m), clock, count, *own, rows)


def _copied(kept: Checkpoint) -> Checkpoint:
    """A checkpoint of its own arrays, so that one can be gone on from twice."""
    values: dict[str, Any] = {one.name: getattr(kept, one.name) for one in fields(kept)}
    return replace(kept, **{name: value.copy() for name, value in values.items() if name != "log"})


def _solution(problem: CompiledProblem, job: _Job, code: int) -> CompiledSolution:
    clock, count = job.run.clock[0], job.run.count[0]
    done = int(count.rows)
    work = Work(**{one.name: int(count[one.name]) for one in fields(Work)})
    culprit = int(count.culprit) if code >= r.NO_NUMBER or code == r.TERMINAL else None
    return CompiledSolution(
        job.output.wanted[:done].copy(), job.output.rows[:done].copy(), work, _reason(problem, job.run, code),
        float(clock.time), culprit, job.run.states["x"].copy(), np.array(job.times),
        np.array(job.indices, dtype=np.int64), replace(job.kept, log=(tuple(job.times), tuple(job.indices))),
    )  # fmt: skip


def _reason(problem: CompiledProblem, run: r.Run, code: int) -> str:
    """Why it ended early, and what could help."""
    t, culprit = float(run.clock[0].time), int(run.count[0].culprit)
    if code == r.DONE:
        return ""
    if code == r.PAUSED:
        return f"paused at {t:.9g} s; go on from its checkpoint"
    if code == r.TOO_MANY:
        return f"{int(run.settings[0].most_steps)} steps taken at {t:.9g} s; allow more, or a looser tolerance"
    if code in (r.TERMINAL, r.ZENO) and problem.events:
        name = problem.events.name(culprit)
        if code == r.TERMINAL:
            return f"{name} at {t:.9g} s ends it"
        return f"{name} happens again and again at {t:.9g} s and time does not pass; its handler must force a change"
    name = problem.name(culprit)
    if code == r.NO_NUMBER:
        return f"the rate of {name} is no number at {t:.9g} s"
    if code == r.RUNS_AWAY:
        return f"{name} runs away at {t:.9g} s: no step is short enough to stay among the numbers; it diverges"
    if code == r.JUMP:
        return _jump(problem, run, name)
    return f"no step is short enough for the tolerance of {name} at {t:.9g} s; loosen it, or look for a jump there"


def _jump(problem: CompiledProblem, run: r.Run, name: str) -> str:
    clock, argument = run.clock[0], int(run.count[0].argument)
    sizes = f"from {clock.before:.6g} to {clock.after:.6g}"
    if argument < 0:
        fix = "make that instant a breakpoint"
        return f"the right-hand side jumps at {clock.jump_at:.12g} s: the rate of {name} {sizes}; {fix}"
    where = f"{problem.name(argument)} = {run.states['x'][argument]:.6g}"
    fix = "make the jump an event with a handler, or use a set-valued method; sign() is no right-hand side"
    return f"the right-hand side jumps at {clock.jump_at:.12g} s, {where}: the rate of {name} {sizes}; {fix}"
