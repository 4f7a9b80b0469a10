"""The compiled integration loop for all methods given by a tableau: step, error control, events, output rows.

It is compiled once, since right-hand side, Jacobian, event functions and handler are addresses. Everything that must
be kept between two steps is in the arrays that it is given, so it can return after any step and be called again later
with a bit-identical result.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law
from drivetrain.solvers.compiled_function import call, call_at_state, call_rates, load_state
from drivetrain.solvers.events import end_at_event, fires_again, fires_at_start, first_event, handle, keep_event_values
from drivetrain.solvers.linear import fill_jacobian
from drivetrain.solvers.records import DIVERGES, DONE, JUMP, NOT_FINITE, PAUSED, TOO_MANY_STEPS
from drivetrain.solvers.step import (
    choose_step,
    dense_output,
    first_step,
    growth_limit,
    largest_error,
    propose_step,
    reject_step,
    take_step,
)

_SLACK = 1e-12  # relative difference up to which an output time coincides with the end of a step
_GAUSS = 0.5 / math.sqrt(3.0)  # distance of the two Gauss points from the middle of an interval of length 1


@kernel
def advance(
    methods: Any, runs: Any, states: Any, point: Array, result: Array, jacobian: Array, factors: Array,
    pivots: Any, events: Any, values: Array, output_times: Array, rows: Array, segments: Any,
) -> int:  # fmt: skip
    """Integrate from the state in the records until the end, until the budget of steps is used up, or until a failure;
    returns a code of ``records``.

    ``methods`` and ``runs`` are one record METHOD and RUN, ``states`` n records STATE, ``events`` m records EVENT,
    ``segments`` records SEGMENT. The rows of ``rows`` belong to the output times [s]. All else is scratch.
    """
    method, run = methods[0], runs[0]
    clock, count, settings = run.clock, run.count, run.settings
    while count.segment < len(segments):
        end = segments[count.segment].end
        clock.limit = segments[count.segment].limit
        if not count.opened:
            code = _begin_segment(run, states, point, result, events, values)
            if code != DONE:
                return code
            _rows_at_time(run, states, point, output_times, rows)
        while clock.time < end:
            if count.budget <= 0:
                return PAUSED
            if count.steps >= settings.most_steps:
                return TOO_MANY_STEPS
            count.budget -= 1
            if not count.fresh_rates and _update_rates(run, states, point, result) != DONE:
                return NOT_FINITE
            for i in range(len(states)):
                states[i].tolerance = states[i].atol + settings.rtol * abs(states[i].x)
            if method.adaptive and clock.step <= 0.0:
                clock.step = first_step(run, states, point, result, end)
            h = choose_step(method.adaptive, run, end)
            if method.gamma > 0.0 and not count.fresh_jacobian:
                count.fresh_jacobian = 1
                if not fill_jacobian(run, states, point, result, jacobian, h):
                    clock.jump_at = clock.time
                    return JUMP
            if method.gamma > 0.0:
                h = min(h, growth_limit(jacobian))
            take_step(method, run, states, point, result, jacobian, factors, pivots, h)
            error = largest_error(run, states)
            if method.adaptive and error > 1.0:
                code = reject_step(run, states, point, result, h, error)
                if code != DONE:
                    return code
                continue
            if not error < np.inf:
                return DIVERGES
            t_end, share = end if h == end - clock.time else clock.time + h, 2.0
            if len(events):
                share = first_event(run, states, point, events, values, h)
                if method.adaptive and share <= 0.0 and fires_again(run, h):
                    continue
            if method.adaptive:
                propose_step(method.order, run, h, error)
            if 0.0 < share <= 1.0:
                h = end_at_event(
                    method, run, states, point, result, jacobian, factors, pivots, values, share, h
                )  # fmt: skip
                t_end = min(clock.time + h, end)
            if share > 0.0:
                _rows_within_step(run, states, point, result, output_times, rows, t_end, h)
                _accept_step(method.reuses, run, states, t_end)
            code = DONE
            if share <= 1.0:
                code = handle(run, states, point, events, values)
            else:
                keep_event_values(events)
            if code != DONE or clock.time < end:
                _rows_at_time(run, states, point, output_times, rows)
            if code != DONE:
                return code
        # An output row at a breakpoint belongs to the segment that begins there, so the hook is also called at the end.
        count.segment += 1
        count.opened = 0
    if run.calls.segment_start:
        call_at_state(run, run.calls.segment_start, states, point, result)
    _rows_at_time(run, states, point, output_times, rows)
    return DONE


@law
def _begin_segment(run: Any, states: Any, point: Array, result: Array, events: Any, values: Array) -> int:
    """Begin a segment: call its hook, and handle the events that fire because of a jump at its beginning."""
    clock, count = run.clock, run.count
    count.opened = 1
    count.fresh_rates = 0
    count.fresh_jacobian = 0
    count.fixed_steps = 0
    clock.origin = clock.time
    if run.calls.segment_start:
        call_at_state(run, run.calls.segment_start, states, point, result)
    if len(events) and fires_at_start(run, states, point, events, values):
        return handle(run, states, point, events, values)
    return DONE


@law
def _update_rates(run: Any, states: Any, point: Array, result: Array) -> int:
    """Evaluate the rates at the current state; NO_NUMBER if one is NaN or infinite."""
    load_state(states, point)
    call_rates(run, run.clock.time, point, result)
    run.count.fresh_rates = 1
    for i in range(len(states)):
        states[i].rates = result[i]
        if not np.isfinite(result[i]):
            run.count.fault_index = i
            return NOT_FINITE
    return DONE


@law
def _accept_step(reuses: int, run: Any, states: Any, t_end: float) -> None:
    """Accept the step: its end becomes the current state, at time ``t_end`` [s]."""
    for i in range(len(states)):
        states[i].x = states[i].next
        if reuses:
            states[i].rates = states[i].next_rates
    run.count.fresh_rates = 1 if reuses else 0
    run.clock.time = t_end
    run.count.fresh_jacobian = 0
    run.count.steps += 1
    run.count.fixed_steps += 1


@law
def _rows_within_step(
    run: Any, states: Any, point: Array, result: Array, output_times: Array, rows: Array, until: float, h: float
) -> None:
    """Fill the output rows before the end of the step, and call the accounting hook over the whole step.

    ``until`` is the end of the step [s]; the current state is still that at its beginning.
    """
    clock, count, reached = run.clock, run.count, 0.0
    until -= _SLACK * max(1.0, abs(until))
    while count.rows < len(output_times) and output_times[count.rows] < until:
        t = output_times[count.rows]
        share = (t - clock.time) / h
        _account(run, states, point, result, reached, share, h)
        reached = share
        dense_output(states, share, point)
        _fill_row(run, point, rows, t)
    _account(run, states, point, result, reached, 1.0, h)


@law
def _account(run: Any, states: Any, point: Array, result: Array, start: float, end: float, h: float) -> None:
    """Call the accounting hook at the two Gauss points of a part of the step, each weighted with half its length."""
    if run.calls.account == 0 or end <= start:
        return
    for side in (-1.0, 1.0):
        share = 0.5 * (start + end) + side * _GAUSS * (end - start)
        dense_output(states, share, point)
        result[0] = 0.5 * (end - start) * h
        call(run, run.calls.account, min(run.clock.time + share * h, run.clock.limit), point, result)


@law
def _rows_at_time(run: Any, states: Any, point: Array, output_times: Array, rows: Array) -> None:
    """Fill the output rows whose time is the current time."""
    t, count = run.clock.time, run.count
    until = t + _SLACK * max(1.0, abs(t))
    while count.rows < len(output_times) and output_times[count.rows] <= until:
        load_state(states, point)
        _fill_row(run, point, rows, min(output_times[count.rows], t))


@law
def _fill_row(run: Any, point: Array, rows: Array, t: float) -> None:
    """Fill one output row: with the state, or by the hook that computes it from the state."""
    row = rows[run.count.rows]
    if run.calls.output:
        call(run, run.calls.output, t, point, row)
    else:
        for i in range(len(row)):
            row[i] = point[i]
    run.count.rows += 1
