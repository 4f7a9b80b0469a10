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
from drivetrain.solvers.compiled_problem import CompiledProblem, Hooks
from drivetrain.solvers.solver import MOST_STEPS, Solver, Work, inner_points, wanted_and_start

_LOG = 4096
_BATCH = 200_000  # steps between two looks at the progress


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that a run knows between two steps; a run that goes on from it gives the same bits as one never stopped.

    Attributes:
        states: One record a state, see ``records``, (n,).
        jacobian: The last one, which a refused step uses again, (n, n).
        values: Event values at the state, (m,).
        run: One record, see ``records``, (1,).
        numbers, words: The data of the problem, as its handler has left them.
        rows: States at the wanted instants, as far as it came.
        log: Instants [s] and indices of the events so far.
    """

    states: Any
    jacobian: Array
    values: Array
    run: Any
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
    code, run = r.PAUSED, job.kept.run
    while code == r.PAUSED and left > 0:
        batch = int(min(left, _BATCH))
        code = job.advance(batch)
        left -= batch - int(run["count"]["budget"][0])
        if progress:
            progress(float(run["clock"]["time"][0]))
    return _solution(problem, job, code)


@dataclass(frozen=True, eq=False)
class _Job:
    """The arguments of ``loop.advance`` by name, and the events of all its calls."""

    arguments: dict[str, Any]
    kept: Checkpoint
    times: list[float]
    indices: list[int]

    def advance(self, budget: int) -> int:
        """Try so many steps; why it came back."""
        from drivetrain.solvers.loop import advance  # compiles, or is read from disk: only when needed

        count = self.kept.run["count"]
        count["budget"] = budget
        code = int(advance(*self.arguments.values()))
        log = self.arguments["log"][: count["logged"][0]]
        self.times.extend(log["time"].tolist())
        self.indices.extend(log["event"].tolist())
        count["logged"] = 0
        return code


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
    n, m = problem.size, len(problem.events.kinds) if problem.events else 0
    if len(state) != n:
        raise InputError(Fault("start", f"must have {n} entries, one a state", f"{len(state)} entries"))
    kept = _fresh(problem, wanted, state) if resume is None else _copied(resume)
    kept.states["atol"] = atol
    settings |= {"may_jump": problem.may_jump, "segment_word": problem.segment_word}
    settings |= {"differences": problem.differences, "most_steps": most_steps}
    data = {"numbers": kept.numbers.ctypes.data, "words": kept.words.ctypes.data}
    for part, values in (("settings", settings), ("calls", problem.addresses() | data)):
        for name, value in values.items():
            kept.run[part][name] = value
    segments = np.empty(len(inner := inner_points(breakpoints, wanted[0], wanted[-1])) + 1, dtype=r.SEGMENT)
    segments["end"] = [*inner, wanted[-1]]
    segments["limit"] = np.nextafter(segments["end"], -np.inf)
    segments["limit"][-1] = wanted[-1]
    order, place, *groups = problem.pattern()
    pivots = np.empty(n, dtype=r.PIVOT)
    pivots["state"], pivots["place"] = order, place
    events = np.zeros(m, dtype=r.EVENT)
    events["old"] = kept.values
    if problem.events:
        events["kind"], events["terminal"] = problem.events.kinds, problem.events.terminal or False
    carried = np.array((problem.hooks or Hooks()).carried, dtype=np.int64)
    arguments = {
        "methods": tableau.record, "runs": kept.run, "states": kept.states, "asked": np.empty(n),
        "answer": np.empty(n), "jacobian": kept.jacobian, "exact": np.empty((n + 1, n)), "factors": np.empty((n, n)),
        "pivots": pivots, "starts": groups[0], "columns": groups[1],
        "row_starts": groups[2], "row_indices": groups[3], "events": events, "values": np.zeros(m),
        "log": np.empty(max(_LOG, 2 * m), dtype=r.LOGGED), "wanted": wanted, "rows": kept.rows, "carried": carried,
        "segments": segments, "words": kept.words,
    }  # fmt: skip
    return _Job(arguments, kept, list(kept.log[0]), list(kept.log[1]))


def _fresh(problem: CompiledProblem, wanted: Array, x: Array) -> Checkpoint:
    n, m = problem.size, len(problem.events.kinds) if problem.events else 0
    run, states = np.zeros(1, dtype=r.RUN), np.zeros(n, dtype=r.STATE)
    clock = run["clock"]
    clock["time"], clock["last_event"], clock["last_jump"] = wanted[0], -np.inf, -np.inf
    states["x"] = x
    rows = np.zeros((len(wanted), problem.hooks.width if problem.hooks and problem.hooks.tell else n))
    own = problem.numbers.copy(), problem.words.copy()
    return Checkpoint(states, np.zeros((n, n)), np.zeros(m), run, *own, rows)


def _copied(kept: Checkpoint) -> Checkpoint:
    """A checkpoint of its own arrays, so that one can be gone on from twice."""
    values: dict[str, Any] = {one.name: getattr(kept, one.name) for one in fields(kept)}
    return replace(kept, **{name: value.copy() for name, value in values.items() if name != "log"})


def _solution(problem: CompiledProblem, job: _Job, code: int) -> CompiledSolution:
    kept, count = job.kept, job.kept.run["count"][0]
    done = int(count["rows"])
    work = Work(**{one.name: int(count[one.name]) for one in fields(Work)})
    culprit = int(count["culprit"]) if code >= r.NO_NUMBER or code == r.TERMINAL else None
    log = tuple(job.times), tuple(job.indices)
    return CompiledSolution(
        job.arguments["wanted"][:done].copy(), kept.rows[:done].copy(), work, _reason(problem, kept, code),
        float(kept.run["clock"]["time"][0]), culprit, kept.states["x"].copy(), np.array(job.times),
        np.array(job.indices, dtype=np.int64), replace(kept, values=job.arguments["events"]["old"].copy(), log=log),
    )  # fmt: skip


def _reason(problem: CompiledProblem, kept: Checkpoint, code: int) -> str:
    """Why it ended early, and what could help."""
    run = kept.run[0]
    t, culprit = float(run["clock"]["time"]), int(run["count"]["culprit"])
    if code == r.DONE:
        return ""
    if code == r.PAUSED:
        return f"paused at {t:.9g} s; go on from its checkpoint"
    if code == r.TOO_MANY:
        return f"{int(run['settings']['most_steps'])} steps taken at {t:.9g} s; allow more, or a looser tolerance"
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
        return _jump(problem, kept, name)
    return f"no step is short enough for the tolerance of {name} at {t:.9g} s; loosen it, or look for a jump there"


def _jump(problem: CompiledProblem, kept: Checkpoint, name: str) -> str:
    clock, argument = kept.run[0]["clock"], int(kept.run[0]["count"]["argument"])
    sizes = f"from {clock['before']:.6g} to {clock['after']:.6g}"
    jumps = f"the right-hand side jumps at {clock['jump_at']:.12g} s"
    if argument < 0:
        return f"{jumps}: the rate of {name} {sizes}; make that instant a breakpoint"
    where = f"{problem.name(argument)} = {kept.states['x'][argument]:.6g}"
    fix = "make the jump an event with a handler, or use a set-valued method; sign() is no right-hand side"
    return f"{jumps}, {where}: the rate of {name} {sizes}; {fix}"
