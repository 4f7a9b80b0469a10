"""State events: locating the zero of an event function within a step, repeating the step to end there, the handler.

``values`` is the array that the event functions of a problem fill, (m,); ``events`` are records ``EVENT``, (m,).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call, call_at_state, load_state
from drivetrain.solvers.records import DONE, ZENO
from drivetrain.solvers.step import dense_output, take_step

_EPSILON = float(np.finfo(np.float64).eps)
# Detection of a Zeno sequence: allowed events without progress of time, the weight of an event that repeats itself in
# that count, and the time difference up to which two events count as simultaneous [s].
_ZENO_LIMIT, _REPEAT_WEIGHT, _SIMULTANEOUS = 50, 5, 1e-9
_STEP_AFTER_REPEAT = 0.25  # factor on the step when the event just handled fires again at its beginning
_LAST_SHIFT = 1e-3  # a Newton correction smaller than this share of the step is the last
_SUBINTERVALS = 4  # equal parts of a step at whose ends the event functions are evaluated
_JUST_LEFT = 1e-9  # share of a value that counts as zero a part of a step earlier
_MOST_ITERATIONS = 160  # of the root finding


@law
def _events_at(run: Any, t: float, point: Array, values: Array) -> None:
    """Evaluate all event functions at a state and count the evaluation; the time is limited to the present segment."""
    call(run, run.calls.values, min(t, run.clock.limit), point, values)
    run.count.event_values += 1


@law
def _events_at_state(run: Any, states: Any, point: Array, values: Array) -> None:
    """Evaluate all event functions at the current time and state."""
    load_state(states, point)
    _events_at(run, run.clock.time, point, values)


@law
def _events_within_step(run: Any, states: Any, share: float, h: float, point: Array, values: Array) -> None:
    """Evaluate all event functions within the step, at t + share h, on the dense output."""
    dense_output(states, share, point)
    _events_at(run, run.clock.time + share * h, point, values)


@law
def keep_event_values(events: Any) -> None:
    """After an accepted step: the values at its end are those at the beginning of the next step."""
    for k in range(len(events)):
        events[k].start = events[k].latest


@law
def first_event(run: Any, states: Any, point: Array, events: Any, values: Array, h: float) -> float:
    """Locate the first event within the step just taken.

    Returns the share of the step at which it fires, from 0 to 1, or 2 if none fires; ``count.fired`` is its index.
    """
    run.count.fired = -1
    for k in range(len(events)):
        events[k].before = -1.0
        events[k].left = events[k].start
    for part in range(_SUBINTERVALS):
        end = (part + 1) / _SUBINTERVALS
        _events_within_step(run, states, end, h, point, values)
        for k in range(len(events)):
            events[k].latest = values[k]
        first = 2.0
        for k in range(len(events)):
            event, low, high = events[k], part / _SUBINTERVALS, end
            if not (event.latest < 0.0 and event.latest < event.left):
                high = _dip(run, states, point, event, k, values, low, h)
                if high == 0.0:
                    continue
                if high < low:
                    low -= 1.0 / _SUBINTERVALS
            at_low = event.left <= 0.0  # zero at the beginning and falling: it fires there
            if at_low and part == 0:  # unless it first becomes positive and returns to zero within the step
                low = _first_positive(run, states, point, event, k, values, h)
                at_low = low == 0.0
            share = low if at_low else _root(run, states, point, event, k, values, low, high, h)
            if share < first:
                first, run.count.fired = share, k
        if first <= 1.0:
            return first
        for k in range(len(events)):
            events[k].before = events[k].left
            events[k].left = events[k].latest
    return 2.0


@law
def _dip(run: Any, states: Any, point: Array, event: Any, k: int, values: Array, middle: float, h: float) -> float:
    """A share of the step at which event value k is negative, between three shares at which it is positive.

    These are ``middle`` and its neighbours, with the values ``before``, ``left`` and ``latest`` of the event. The share
    is the minimum of the parabola through them; 0 if the value there is not negative. ``left`` and ``latest`` become
    the values at the ends of the interval that ends there. A value that has just left zero is not asked, since the
    dense output would not decide.
    """
    slope, bend = 0.5 * (event.latest - event.before), event.before - 2.0 * event.left + event.latest
    if not (event.before > _JUST_LEFT * event.left > 0.0 and abs(slope) < bend):
        return 0.0
    if event.left - 0.5 * slope * slope / bend >= 0.0:
        return 0.0
    share = middle - slope / bend / _SUBINTERVALS
    _events_within_step(run, states, share, h, point, values)
    if not values[k] < 0.0:
        return 0.0
    event.latest = values[k]
    if share < middle:
        event.left = event.before
    return share


@law
def _first_positive(run: Any, states: Any, point: Array, event: Any, k: int, values: Array, h: float) -> float:
    """A small share of the step at which event value k, zero at the beginning, is positive; 0 if there is none.

    With it a ball that has just bounced is found to land again within the same step.
    """
    _events_within_step(run, states, 0.0, h, point, values)
    residual = 4.0 * abs(values[k])  # rounding error that the location of the previous event has left
    for share in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        _events_within_step(run, states, share, h, point, values)
        if values[k] > residual:
            event.left = values[k]
            return share
    return 0.0


@law
def _root(
    run: Any, states: Any, point: Array, event: Any, k: int, values: Array, low: float, high: float, h: float
) -> float:
    """The share of the step at which event value k crosses zero, between ``low`` and ``high``, where it changes sign.

    Regula falsi on the dense output (Illinois variant), with a bisection every third iteration.
    """
    t, before, after, side = run.clock.time, event.left, event.latest, 0
    for turn in range(_MOST_ITERATIONS):
        if high - low <= 4e-16 * max(abs(t) / h, 1.0):
            break
        share = low + (high - low) * before / (before - after)
        if turn % 3 == 2 or not low < share < high:
            share = math.sqrt(low * high) if high > 4.0 * low > 0.0 else 0.5 * (low + high)
        _events_within_step(run, states, share, h, point, values)
        value = values[k]
        if value == 0.0:
            return share
        if (value > 0.0) == (before > 0.0):
            low, before = share, value
            if side == 1:
                after *= 0.5
            side = 1
        else:
            high, after = share, value
            if side == -1:
                before *= 0.5
            side = -1
    return high


@law
def end_at_event(
    method: Any, run: Any, states: Any, point: Array, result: Array, jacobian: Array, factors: Array, pivots: Any,
    values: Array, share: float, whole: float,
) -> float:  # fmt: skip
    """Repeat the step so that it ends at the event, and return its length [s].

    ``share`` of the step ``whole`` is the location on the dense output, which is less accurate than the method. So the
    length is corrected by Newton's method, with the event value at the end of the step that is actually taken.
    """
    k, t, h = run.count.fired, run.clock.time, share * whole
    near = min(_LAST_SHIFT, 0.1 * math.sqrt(run.settings.rtol))
    last = False
    for turn in range(4):
        take_step(method, run, states, point, result, jacobian, factors, pivots, h)
        if last or turn == 3:
            break
        for i in range(len(states)):
            point[i] = states[i].next
        _events_at(run, t + h, point, values)
        reached = values[k]
        _events_within_step(run, states, 1.0 - 1e-4, h, point, values)
        slope = (reached - values[k]) / (1e-4 * h)
        shift = -reached / slope if slope != 0.0 else 0.0
        moved = min(h + shift, whole)
        if not abs(shift) < 0.1 * h or abs(shift) <= _EPSILON * max(abs(t), h) or moved == h:
            break
        last = abs(shift) < near * h  # convergence is quadratic: no further correction is needed
        h = moved
    return h


@law
def fires_again(run: Any, h: float) -> bool:
    """Whether the event just handled fires again at the beginning of the step; if so, reject it, propose a shorter one.

    A shorter step can resolve the motion that the event has started.
    """
    clock, count = run.clock, run.count
    if clock.time != clock.last_event or count.fired != count.last_fired or h < _SIMULTANEOUS:
        return False
    clock.step = _STEP_AFTER_REPEAT * h
    count.was_rejected = 1
    count.rejected += 1
    return True


@law
def fires_at_start(run: Any, states: Any, point: Array, events: Any, values: Array) -> bool:
    """Whether an event fires at the beginning of a segment, because a law or the state has jumped there."""
    fired = False
    _events_at_state(run, states, point, values)
    for k in range(len(events)):
        events[k].latest = values[k]
        fired = fired or values[k] < 0.0
    run.count.fired = -1
    if not fired:
        keep_event_values(events)
    return fired


@law
def handle(run: Any, states: Any, point: Array, events: Any, values: Array) -> int:
    """Call the handler for the events that fire at the current state, and evaluate the event functions anew.

    Returns DONE, or ZENO when events keep firing without progress of time.
    """
    clock, count = run.clock, run.count
    _events_at_state(run, states, point, values)
    for k in range(len(events)):
        events[k].latest = values[k]
        values[k] = -1.0 if k == count.fired or values[k] < 0.0 else 0.0
    near = clock.time - clock.last_event <= _SIMULTANEOUS * max(1.0, abs(clock.time))
    # Several events may be simultaneous, but one event must not fire again and again.
    weight = _REPEAT_WEIGHT if count.fired == count.last_fired else 1
    count.without_progress = count.without_progress + weight if near else 0
    count.last_fired = count.fault_index = count.fired
    clock.last_event = clock.origin = clock.time
    call_at_state(run, run.calls.handler, states, point, values)
    count.fresh_rates = count.fresh_jacobian = count.fixed_steps = 0
    count.restarts += 1
    _events_at_state(run, states, point, values)
    for k in range(len(events)):
        events[k].start = values[k]
    return ZENO if count.without_progress > _ZENO_LIMIT else DONE
