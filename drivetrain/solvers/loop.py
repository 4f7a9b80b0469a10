"""The compiled loop: step, error, event, change of mode, go on; for every method that is a tableau.

It is compiled once: right-hand side, Jacobian, events and their handler are addresses. All state between two
steps lies in the arrays it is given, so it can come back after any step and go on later, to the last bit the same.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law
from drivetrain.solvers.compiled_function import call, call_here, call_rates, load
from drivetrain.solvers.events import end_at_event, first_event, handle, jump_fires, pass_events, repeats
from drivetrain.solvers.linear import fill_jacobian
from drivetrain.solvers.records import DONE, JUMP, NO_NUMBER, PAUSED, RUNS_AWAY, TOO_MANY
from drivetrain.solvers.step import choose, first_step, growing, largest_error, propose, refuse, take_step, within

_SLACK = 1e-12
_GAUSS = 0.5 / math.sqrt(3.0)


@kernel
def advance(
    methods: Any, runs: Any, states: Any, point: Array, answer: Array, jacobian: Array, factors: Array,
    pivots: Any, events: Any, values: Array, wanted: Array, rows: Array, segments: Any,
) -> int:  # fmt: skip
    """Go on from where the records say, until the end, the budget of steps or a reason to stop."""
    method, run = methods[0], runs[0]
    clock, count, settings = run.clock, run.count, run.settings
    while count.segment < len(segments):
        end = segments[count.segment].end
        clock.limit = segments[count.segment].limit
        if not count.opened:
            code = _open(run, states, point, answer, events, values)
            if code != DONE:
                return code
            _record_here(run, states, point, wanted, rows)
        while clock.time < end:
            if count.budget <= 0:
                return PAUSED
            if count.steps >= settings.most_steps:
                return TOO_MANY
            count.budget -= 1
            if not count.fresh and _refresh(run, states, point, answer) != DONE:
                return NO_NUMBER
            for i in range(len(states)):
                states[i].tolerance = states[i].atol + settings.rtol * abs(states[i].x)
            if method.adaptive and clock.step <= 0.0:
                clock.step = first_step(run, states, point, answer, end)
            h = choose(method.adaptive, run, end)
            if method.gamma > 0.0 and not count.fresh_jacobian:
                count.fresh_jacobian = 1
                if not fill_jacobian(run, states, point, answer, jacobian, h):
                    clock.jump_at = clock.time
                    return JUMP
            if method.gamma > 0.0:
                h = min(h, growing(jacobian))
            take_step(method, run, states, point, answer, jacobian, factors, pivots, h)
            error = largest_error(run, states)
            if method.adaptive and error > 1.0:
                code = refuse(run, states, point, answer, h, error)
                if code != DONE:
                    return code
                continue
            if not error < np.inf:
                return RUNS_AWAY
            later, share = end if h == end - clock.time else clock.time + h, 2.0
            if len(events):
                share = first_event(run, states, point, events, values, h)
                if method.adaptive and share <= 0.0 and repeats(run, h):
                    continue
            if method.adaptive:
                propose(method.order, run, h, error)
            if 0.0 < share <= 1.0:
                h = end_at_event(
                    method, run, states, point, answer, jacobian, factors, pivots, values, share, h
                )  # fmt: skip
                later = min(clock.time + h, end)
            if share > 0.0:
                _record_within(run, states, point, answer, wanted, rows, later, h)
                _keep(method.reuses, run, states, later)
            code = DONE
            if share <= 1.0:
                code = handle(run, states, point, events, values)
            else:
                pass_events(events)
            if code != DONE or clock.time < end:
                _record_here(run, states, point, wanted, rows)
            if code != DONE:
                return code
        # Rows where two segments meet belong to the later one; so the last end is opened too.
        count.segment += 1
        count.opened = 0
    if run.calls.opens:
        call_here(run, run.calls.opens, states, point, answer)
    _record_here(run, states, point, wanted, rows)
    return DONE


@law
def _open(run: Any, states: Any, point: Array, answer: Array, events: Any, values: Array) -> int:
    """A segment begins: see what the jump at its beginning sets off."""
    clock, count = run.clock, run.count
    count.opened = 1
    count.fresh = 0
    count.fresh_jacobian = 0
    count.strides = 0
    clock.origin = clock.time
    if run.calls.opens:
        call_here(run, run.calls.opens, states, point, answer)
    if len(events) and jump_fires(run, states, point, events, values):
        return handle(run, states, point, events, values)
    return DONE


@law
def _refresh(run: Any, states: Any, point: Array, answer: Array) -> int:
    """Rates at the present state, if they are numbers."""
    load(states, point)
    call_rates(run, run.clock.time, point, answer)
    run.count.fresh = 1
    for i in range(len(states)):
        states[i].rates = answer[i]
        if not np.isfinite(answer[i]):
            run.count.culprit = i
            return NO_NUMBER
    return DONE


@law
def _keep(reuses: int, run: Any, states: Any, later: float) -> None:
    """The end of the step becomes the run."""
    for i in range(len(states)):
        states[i].x = states[i].next
        if reuses:
            states[i].rates = states[i].next_rates
    run.count.fresh = 1 if reuses else 0
    run.clock.time = later
    run.count.fresh_jacobian = 0
    run.count.steps += 1
    run.count.strides += 1


@law
def _record_within(
    run: Any, states: Any, point: Array, answer: Array, wanted: Array, rows: Array, until: float, h: float
) -> None:
    """Rows at the wanted instants before the end of the step, and the account of the whole step; x is its beginning."""
    clock, count, reached = run.clock, run.count, 0.0
    until -= _SLACK * max(1.0, abs(until))
    while count.rows < len(wanted) and wanted[count.rows] < until:
        t = wanted[count.rows]
        share = (t - clock.time) / h
        _account(run, states, point, answer, reached, share, h)
        reached = share
        within(states, share, point)
        _row(run, point, rows, t)
    _account(run, states, point, answer, reached, 1.0, h)


@law
def _account(run: Any, states: Any, point: Array, answer: Array, start: float, end: float, h: float) -> None:
    """Let the owner add up over a part of the step: called at two Gauss points, each standing for half of it."""
    if run.calls.account == 0 or end <= start:
        return
    for side in (-1.0, 1.0):
        share = 0.5 * (start + end) + side * _GAUSS * (end - start)
        within(states, share, point)
        answer[0] = 0.5 * (end - start) * h
        call(run, run.calls.account, min(run.clock.time + share * h, run.clock.limit), point, answer)


@law
def _record_here(run: Any, states: Any, point: Array, wanted: Array, rows: Array) -> None:
    """Rows at the wanted instants that are now."""
    t, count = run.clock.time, run.count
    until = t + _SLACK * max(1.0, abs(t))
    while count.rows < len(wanted) and wanted[count.rows] <= until:
        load(states, point)
        _row(run, point, rows, min(wanted[count.rows], t))


@law
def _row(run: Any, point: Array, rows: Array, t: float) -> None:
    """A wanted row: the state, or what the owner derives from it."""
    row = rows[run.count.rows]
    if run.calls.tell:
        call(run, run.calls.tell, t, point, row)
    else:
        for i in range(len(row)):
            row[i] = point[i]
    run.count.rows += 1
