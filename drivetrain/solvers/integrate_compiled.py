"""Integration of a right-hand side given by address, with events and resumption."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import records as r
from drivetrain.solvers.compiled_problem import CompiledProblem, Hooks
from drivetrain.solvers.solver import MOST_STEPS, Solver, Work, inner_points, wanted_and_start

_FOREVER = 2**62


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The state of a run between two steps; a run that goes on from it gives the same bits as one never stopped."""

    # see ``records``, (1,), (n,) and (m,)
    run: Any
    states: Any
    events: Any
    jacobian: Array  # the last one, by columns, which a refused step uses again, (n + 1, n)
    # the data of the problem, as its handler has left them
    numbers: Array
    words: Any
    rows: Array  # states at the wanted instants, as far as it came


@dataclass(frozen=True, eq=False)
class CompiledSolution:
    """States at the wanted instants, as far as the solver came."""

    times: Array  # instants [s], (N,), those wanted, fewer if it stopped early
    states: Array  # one row an instant [their own units], (N, n), or what ``Hooks.tell`` fills in
    work: Work  # what it cost
    stopped: str  # why it ended early, with what could help; empty when it did not
    stopped_at: float  # when [s]; the last wanted instant when it did not
    culprit: int | None  # index of the state, or of the event, that the reason names; None when it names none
    final: Array  # state at ``stopped_at``, before which every number can be trusted, (n,)
    checkpoint: Checkpoint  # to go on from


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
) -> CompiledSolution:
    """The states at wanted instants, without a call of Python between the first step and the last.

    Steps never cross a breakpoint, and on each side the right-hand side is asked only for instants of that side.
    """
    from drivetrain.solvers.loop import advance  # compiles, or is read from disk: only when needed

    wanted, state = wanted_and_start(times, start)
    if len(state) != problem.size:
        raise InputError(Fault("start", f"must have {problem.size} entries, one a state", f"{len(state)} entries"))
    tableau, atol, settings = solver.compiled_settings(problem.size)
    kept = _fresh(problem, wanted, state) if resume is None else copy.deepcopy(resume)
    kept.states["atol"] = atol
    settings |= {"may_jump": problem.may_jump, "differences": problem.differences, "most_steps": most_steps}
    data = {"numbers": kept.numbers.ctypes.data, "words": kept.words.ctypes.data}
    for part, values in (("settings", settings), ("calls", problem.addresses() | data)):
        for name, value in values.items():
            kept.run[part][name] = value
    kept.run["count"]["budget"] = _FOREVER if pause_after is None else pause_after
    n = problem.size
    code = advance(
        tableau.record, kept.run, kept.states, np.empty(n), np.empty(n), kept.jacobian, np.empty((n, n)),
        np.empty(n, dtype=np.uint64), kept.events, np.zeros(len(kept.events)), wanted, kept.rows,
        _segments(breakpoints, wanted),
    )  # fmt: skip
    return _solution(problem, kept, wanted, int(code))


def _segments(breakpoints: Sequence[float], wanted: Array) -> Any:
    """From breakpoint to breakpoint; all but the last see no instant but their own."""
    ends = np.array([*inner_points(breakpoints, wanted[0], wanted[-1]), wanted[-1]])
    segments = np.empty(len(ends), dtype=r.SEGMENT)
    segments["end"], segments["limit"] = ends, np.nextafter(ends, -np.inf)
    segments["limit"][-1] = ends[-1]
    return segments


def _fresh(problem: CompiledProblem, wanted: Array, x: Array) -> Checkpoint:
    n, hooks = problem.size, problem.hooks or Hooks()
    run, states = np.zeros(1, dtype=r.RUN), np.zeros(n, dtype=r.STATE)
    clock = run["clock"]
    clock["time"], clock["last_event"], clock["last_jump"] = wanted[0], -np.inf, -np.inf
    states["x"] = x
    events = np.zeros(len(problem.events.names) if problem.events else 0, dtype=r.EVENT)
    rows = np.zeros((len(wanted), hooks.width if hooks.tell else n))
    return Checkpoint(run, states, events, np.zeros((n + 1, n)), problem.numbers.copy(), problem.words.copy(), rows)


def _solution(problem: CompiledProblem, kept: Checkpoint, wanted: Array, code: int) -> CompiledSolution:
    count, done = kept.run["count"][0], int(kept.run["count"]["rows"][0])
    work = Work(**{one.name: int(count[one.name]) for one in fields(Work)})
    culprit = int(count["culprit"]) if code >= r.NO_NUMBER else None
    return CompiledSolution(
        wanted[:done].copy(), kept.rows[:done].copy(), work, _reason(problem, kept, code),
        float(kept.run["clock"]["time"][0]), culprit, kept.states["x"].copy(), kept,
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
    if code == r.ZENO and problem.events:
        name = problem.events.names[culprit]
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
