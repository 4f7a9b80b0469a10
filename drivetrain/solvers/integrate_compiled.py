"""Integration of a ``CompiledProblem``, whose functions are given by address, with events, pause and resumption."""

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
from drivetrain.solvers.solver import MOST_STEPS, Solution, Solver, Work, checked_times_and_start, inner_breakpoints

_FOREVER = 2**62


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """Complete state of an integration between two steps; resuming from it is bit-identical to never having stopped."""

    # records RUN (1,), STATE (n,) and EVENT (m,)
    run: Any
    states: Any
    events: Any
    jacobian: Array  # last Jacobian, column by column, which the next try after a rejected step reuses, (n + 1, n)
    # data of the problem, with the changes made by its handler
    numbers: Array
    words: Any
    rows: Array  # output rows; those not yet reached are zero


@dataclass(frozen=True, eq=False)
class CompiledSolution(Solution):
    """A solution that can be continued; where there is a hook ``output``, ``states`` are the rows that it fills."""

    code: int  # return code of the loop, see ``records``
    final: Array  # state at ``stopped_at``, the last valid one, (n,)
    checkpoint: Checkpoint  # from which the integration can be resumed


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
    """Integrate a compiled problem, without a call of Python between the first step and the last.

    Times, breakpoints and ``start`` (ignored when resuming) are as for ``integrate``. After ``pause_after`` attempted
    steps it returns with a checkpoint, from which ``resume`` continues.
    """
    from drivetrain.solvers.loop import advance  # imported here, since it compiles or reads the disk cache

    output_times, state = checked_times_and_start(times, start)
    if len(state) != problem.size:
        raise InputError(Fault("start", f"must have {problem.size} entries, one a state", f"{len(state)} entries"))
    tableau, atol, settings = solver.compiled_settings(problem.size)
    kept = _new_checkpoint(problem, output_times, state) if resume is None else copy.deepcopy(resume)
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
        np.empty(n, dtype=np.uint64), kept.events, np.zeros(len(kept.events)), output_times, kept.rows,
        _segments(breakpoints, output_times),
    )  # fmt: skip
    return _solution(problem, kept, output_times, int(code))


def _segments(breakpoints: Sequence[float], output_times: Array) -> Any:
    """Records SEGMENT from breakpoint to breakpoint; rates are evaluated strictly before their end only."""
    ends = np.array([*inner_breakpoints(breakpoints, output_times[0], output_times[-1]), output_times[-1]])
    segments = np.empty(len(ends), dtype=r.SEGMENT)
    segments["end"], segments["limit"] = ends, np.nextafter(ends, -np.inf)
    return segments


def _new_checkpoint(problem: CompiledProblem, output_times: Array, x: Array) -> Checkpoint:
    """The checkpoint from which a new integration starts, at the first output time and state x."""
    n, hooks = problem.size, problem.hooks or Hooks()
    run, states = np.zeros(1, dtype=r.RUN), np.zeros(n, dtype=r.STATE)
    clock = run["clock"]
    clock["time"], clock["last_event"], clock["last_jump"] = output_times[0], -np.inf, -np.inf
    states["x"] = x
    events = np.zeros(len(problem.events.names) if problem.events else 0, dtype=r.EVENT)
    rows = np.zeros((len(output_times), hooks.width if hooks.output else n))
    return Checkpoint(run, states, events, np.zeros((n + 1, n)), problem.numbers.copy(), problem.words.copy(), rows)


def _solution(problem: CompiledProblem, kept: Checkpoint, output_times: Array, code: int) -> CompiledSolution:
    """The result of the integration, from the records and the return code of the compiled loop."""
    count, done = kept.run["count"][0], int(kept.run["count"]["rows"][0])
    work = Work(**{one.name: int(count[one.name]) for one in fields(Work)})
    fault_index = int(count["fault_index"]) if code >= r.NOT_FINITE else None
    return CompiledSolution(
        output_times[:done].copy(), kept.rows[:done].copy(), work, _reason(problem, kept, code),
        float(kept.run["clock"]["time"][0]), fault_index, code, kept.states["x"].copy(), kept,
    )  # fmt: skip


def _reason(problem: CompiledProblem, kept: Checkpoint, code: int) -> str:
    """Why the integration ended early, with advice, from the return code; empty if it did not."""
    run = kept.run[0]
    t, fault_index = float(run["clock"]["time"]), int(run["count"]["fault_index"])
    if code == r.DONE:
        return ""
    if code == r.PAUSED:
        return f"paused at {t:.9g} s; go on from its checkpoint"
    if code == r.TOO_MANY_STEPS:
        return f"{int(run['settings']['most_steps'])} steps taken at {t:.9g} s; allow more, or a looser tolerance"
    if code == r.ZENO and problem.events:
        name = problem.events.names[fault_index]
        return f"{name} happens again and again at {t:.9g} s and time does not pass; its handler must force a change"
    name = problem.name(fault_index)
    if code == r.NOT_FINITE:
        return f"the rate of {name} is no number at {t:.9g} s"
    if code == r.DIVERGES:
        return f"{name} runs away at {t:.9g} s: no step is short enough to stay among the numbers; it diverges"
    if code == r.JUMP:
        return _jump_message(problem, kept, name)
    return f"no step is short enough for the tolerance of {name} at {t:.9g} s; loosen it, or look for a jump there"


def _jump_message(problem: CompiledProblem, kept: Checkpoint, name: str) -> str:
    """The message for a discontinuity of the rates: when, on which state it depends, its size, and what to do."""
    clock, jump_state = kept.run[0]["clock"], int(kept.run[0]["count"]["jump_state"])
    sizes = f"from {clock['before']:.6g} to {clock['after']:.6g}"
    jumps = f"the right-hand side jumps at {clock['jump_at']:.12g} s"
    if jump_state < 0:
        return f"{jumps}: the rate of {name} {sizes}; make that instant a breakpoint"
    where = f"{problem.name(jump_state)} = {kept.states['x'][jump_state]:.6g}"
    fix = "make the jump an event with a handler, or use a set-valued law of friction, as the fixed step does"
    return f"{jumps}, {where}: the rate of {name} {sizes}; {fix}"
