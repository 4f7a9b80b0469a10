"""The compiled loop: step, error, event, change of mode, go on; for every method that is a tableau.

It is compiled once: right-hand side, Jacobian, events and their handler are addresses. All that it knows between two
steps lies in the arrays it is given, so it can come back after any step and go on later, to the last bit the same.
"""

from __future__ import annotations

import ctypes
import math
from functools import lru_cache
from typing import Any

import numpy as np
from numba import carray, from_dtype, types

from drivetrain.jit import callback, law
from drivetrain.solvers.control import choose, first_step, largest_error, propose, refuse
from drivetrain.solvers.events import copy, end_at_event, first_event, handle, jump_fires, repeats
from drivetrain.solvers.jacobian import fill_jacobian
from drivetrain.solvers.records import (
    CALLS,
    CLOCK,
    COUNT,
    DONE,
    JUMP,
    NO_NUMBER,
    PAUSED,
    RUNS_AWAY,
    SETTINGS,
    SIZES,
    STATE,
    TOO_MANY,
    EventRoom,
    Linear,
    Output,
    Run,
    Segments,
)
from drivetrain.solvers.step import ask, ask_here, ask_rates, load, take_step, within
from drivetrain.solvers.tableaux import Tableau

_SLACK = 1e-12
_GAUSS = 0.5 / math.sqrt(3.0)


def _advance(
    sizes: Any, adaptive: Any, order: Any, reuses: Any, gamma: Any, times: Any, gammas: Any, error: Any, a: Any,
    c: Any, dense: Any, states: Any, stages: Any, curve: Any, asked: Any, answer: Any, calls: Any, settings: Any,
    clock: Any, count: Any, jacobian: Any, exact: Any, factors: Any, rows: Any, places: Any, lower: Any, filled: Any,
    solved: Any, elimination: Any,
    ranks: Any, starts: Any, columns: Any, row_starts: Any, row_indices: Any, kinds: Any, terminal: Any, old: Any,
    new: Any, later: Any, trial: Any, log_times: Any, log_indices: Any, wanted: Any, told: Any, carried: Any,
    ends: Any, limits: Any, words: Any,
) -> Any:  # fmt: skip
    """The loop on arrays that Python owns: pointers keep the compiled code free of the counting of references."""
    z = carray(sizes, 1)[0]
    n, s, m = z.states, z.stages, z.events
    return advance(
        Tableau(
            adaptive, order, reuses, gamma, carray(times, s), carray(gammas, s), carray(error, (1, s)),
            carray(a, (s + 1, s)), carray(c, (s, s)), carray(dense, (4, s)),
        ),
        Run(
            carray(states, n), carray(stages, (n, s)), carray(curve, (n, 4)), carray(asked, n), carray(answer, n),
            carray(calls, 1)[0], carray(settings, 1)[0], carray(clock, 1)[0], carray(count, 1)[0],
        ),
        Linear(
            carray(jacobian, (n, n)), carray(exact, (n + 1, n)), carray(factors, (n, n)), carray(rows, n),
            carray(places, (n, n)), carray(lower, n), carray(filled, n), carray(solved, n),
            carray(elimination, n), carray(ranks, n), carray(starts, z.groups + 1),
            carray(columns, z.grouped), carray(row_starts, n + 1), carray(row_indices, z.entries),
        ),
        EventRoom(
            carray(kinds, m), carray(terminal, m), carray(old, m), carray(new, m), carray(later, m), carray(trial, m),
            carray(log_times, z.log), carray(log_indices, z.log),
        ),
        Output(carray(wanted, z.wanted), carray(told, (z.wanted, z.width)), carray(carried, z.carried)),
        Segments(carray(ends, z.segments), carray(limits, z.segments), carray(words, z.words)),
    )  # fmt: skip


@lru_cache(maxsize=1)
def loop() -> Any:
    """The loop, compiled at the first call or taken from the disk cache."""
    number, word, place = (types.CPointer(kind) for kind in (types.float64, types.int64, types.uint64))
    size, state, calls, settings, clock, count = (
        types.CPointer(from_dtype(kind)) for kind in (SIZES, STATE, CALLS, SETTINGS, CLOCK, COUNT)
    )
    kinds = [
        size, types.boolean, types.float64, types.boolean, types.float64, *[number] * 6, state, *[number] * 4,
        calls, settings, clock, count, *[number] * 3, *[place] * 4,
        number, *[place] * 2, *[word] * 6, *[number] * 5, word,
        number, number, word, number, number, word,
    ]  # fmt: skip
    as_c: dict[Any, Any] = {types.boolean: ctypes.c_bool, types.float64: ctypes.c_double}
    made = callback(types.int64(*kinds), _advance)
    return ctypes.CFUNCTYPE(ctypes.c_int64, *(as_c.get(kind, ctypes.c_void_p) for kind in kinds))(made.address)


@law
def advance(tableau: Tableau, run: Run, linear: Linear, events: EventRoom, output: Output, segments: Segments) -> int:
    """Go on from where the arrays say, until the end, the budget of steps, a terminal event or a reason to stop."""
    clock, count, settings = run.clock, run.count, run.settings
    while count.segment < len(segments.ends):
        end = segments.ends[count.segment]
        clock.limit = segments.limits[count.segment]
        if not count.opened:
            code = _open(run, events, segments)
            if code != DONE:
                return code
            _tell_here(run, output)
        while clock.time < end:
            if count.budget <= 0 or (len(events.kinds) and len(events.log_times) - count.logged < len(events.kinds)):
                return PAUSED
            if count.steps >= settings.most_steps:
                return TOO_MANY
            count.budget -= 1
            if not count.fresh and _refresh(run) != DONE:
                return NO_NUMBER
            for i in range(len(run.states)):
                run.states[i].tolerance = run.states[i].atol + settings.rtol * abs(run.states[i].x)
            if tableau.adaptive and clock.step <= 0.0:
                clock.step = first_step(run, end)
            h = choose(tableau.adaptive, run, end)
            if tableau.gamma > 0.0 and not count.fresh_jacobian:
                count.fresh_jacobian = 1
                if not fill_jacobian(run, linear, h):
                    clock.jump_at = clock.time
                    return JUMP
            take_step(tableau, run, linear, h)
            error = largest_error(run)
            if tableau.adaptive and error > 1.0:
                code = refuse(run, h, error)
                if code != DONE:
                    return code
                continue
            if not error < np.inf:
                return RUNS_AWAY
            later, share = end if h == end - clock.time else clock.time + h, 2.0
            if len(events.kinds):
                share = first_event(run, events, h)
                if tableau.adaptive and share <= 0.0 and repeats(run, h):
                    continue
            if tableau.adaptive:
                propose(tableau.order, run, h, error)
            if 0.0 < share <= 1.0:
                h = end_at_event(tableau, run, linear, events, share, h)
                later = min(clock.time + h, end)
            if share > 0.0:
                _tell_within(run, output, later, h)
                _keep(tableau.reuses, run, later)
            code = DONE
            if share <= 1.0:
                code = handle(run, events)
            else:
                copy(events.old, events.new)
            if code != DONE or clock.time < end:
                _tell_here(run, output)
            if code != DONE:
                return code
        # Rows where two segments meet belong to the later one; so the last end is opened too.
        count.segment += 1
        count.opened = 0
    if run.calls.opens:
        ask_here(run, run.calls.opens, run.answer)
    _tell_here(run, output)
    return DONE


@law
def _open(run: Run, events: EventRoom, segments: Segments) -> int:
    """A segment begins: tell the right-hand side which, and see what the jump at its beginning sets off."""
    clock, count = run.clock, run.count
    if run.settings.segment_word >= 0:
        segments.words[run.settings.segment_word] = count.segment
    count.opened = 1
    count.fresh = 0
    count.fresh_jacobian = 0
    count.strides = 0
    clock.origin = clock.time
    if run.calls.opens:
        ask_here(run, run.calls.opens, run.answer)
    if len(events.kinds) and jump_fires(run, events):
        code = handle(run, events)
        if code != DONE:
            return code
    count.started = 1
    return DONE


@law
def _refresh(run: Run) -> int:
    """Rates at the present state, if they are numbers."""
    load(run)
    ask_rates(run, run.clock.time)
    run.count.fresh = 1
    for i in range(len(run.answer)):
        run.states[i].rates = run.answer[i]
        if not np.isfinite(run.answer[i]):
            run.count.culprit = i
            return NO_NUMBER
    return DONE


@law
def _keep(reuses: bool, run: Run, later: float) -> None:
    """The end of the step becomes the run."""
    for i in range(len(run.states)):
        run.states[i].x = run.states[i].next
        if reuses:
            run.states[i].rates = run.states[i].next_rates
    run.count.fresh = 1 if reuses else 0
    run.clock.time = later
    run.count.fresh_jacobian = 0
    run.count.steps += 1
    run.count.strides += 1


@law
def _tell_within(run: Run, output: Output, until: float, h: float) -> None:
    """Rows at the wanted instants before the end of the step, and the account of the whole step; x is its beginning."""
    clock, count, wanted, reached = run.clock, run.count, output.wanted, 0.0
    until -= _SLACK * max(1.0, abs(until))
    while count.rows < len(wanted) and wanted[count.rows] < until:
        t = wanted[count.rows]
        share = (t - clock.time) / h
        _account(run, output, reached, share, h)
        reached = share
        within(run, share)
        _row(run, output, t)
    _account(run, output, reached, 1.0, h)


@law
def _account(run: Run, output: Output, start: float, end: float, h: float) -> None:
    """Let the owner add up over a part of the step: called at two Gauss points, each standing for half of it."""
    if run.calls.account == 0 or end <= start:
        return
    for side in (-1.0, 1.0):
        share = 0.5 * (start + end) + side * _GAUSS * (end - start)
        within(run, share)
        run.answer[0] = 0.5 * (end - start) * h
        ask(run, run.calls.account, min(run.clock.time + share * h, run.clock.limit), run.answer)
        for i in output.carried:
            run.states[i].x = run.states[i].next = run.asked[i]


@law
def _tell_here(run: Run, output: Output) -> None:
    """Rows at the wanted instants that are now."""
    t, count, wanted = run.clock.time, run.count, output.wanted
    until = t + _SLACK * max(1.0, abs(t))
    while count.rows < len(wanted) and wanted[count.rows] <= until:
        load(run)
        _row(run, output, min(wanted[count.rows], t))


@law
def _row(run: Run, output: Output, t: float) -> None:
    """A wanted row: the state ``asked``, or what the owner tells of it."""
    row = output.rows[run.count.rows]
    if run.calls.tell:
        ask(run, run.calls.tell, t, row)
    else:
        for i in range(len(row)):
            row[i] = run.asked[i]
    run.count.rows += 1
