"""Events within a step: where a value becomes negative, what the handler changes, and a step taken again to end there.

``values`` is what the functions of a problem fill, (m,).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call, call_here, load
from drivetrain.solvers.records import DONE, ZENO
from drivetrain.solvers.step import take_step, within

_EPSILON = float(np.finfo(np.float64).eps)
_BUSY, _SAME, _NEAR = 50, 5, 1e-9  # events without progress of time; the weight of a repeated one; [s]
_AGAIN, _CLOSE = 0.25, 1e-3
_LOOKS = 2  # parts of a step whose ends are looked at
_MOST = 160


@law
def _events_at(run: Any, t: float, point: Array, values: Array) -> None:
    """The values of all events at a state, counted; never beyond what the segment may see."""
    call(run, run.calls.values, min(t, run.clock.limit), point, values)
    run.count.event_values += 1


@law
def _events_here(run: Any, states: Any, point: Array, values: Array) -> None:
    load(states, point)
    _events_at(run, run.clock.time, point, values)


@law
def _events_within(run: Any, states: Any, share: float, h: float, point: Array, values: Array) -> None:
    """The values of all events at a share of the step."""
    within(states, share, point)
    _events_at(run, run.clock.time + share * h, point, values)


@law
def pass_events(events: Any) -> None:
    """A step is kept: where values were asked for last is where the next one begins."""
    for k in range(len(events)):
        events[k].old = events[k].new


@law
def first_event(run: Any, states: Any, point: Array, events: Any, values: Array, h: float) -> float:
    """The share of the step at which the first event happens, 2 when none does; ``count.fired`` gives which."""
    run.count.fired = -1
    for k in range(len(events)):
        events[k].later = events[k].old
    for part in range(_LOOKS):
        high = (part + 1) / _LOOKS
        _events_within(run, states, high, h, point, values)
        for k in range(len(events)):
            events[k].new = values[k]
        first = 2.0
        for k in range(len(events)):
            event, low = events[k], part / _LOOKS
            if not (event.new < 0.0 and (event.later > 0.0 or event.new < event.later)):
                continue
            held = event.later <= 0.0  # it was about to be broken when the step began
            if held and part == 0:  # unless it rises first, to be broken later
                low = _leaves(run, states, point, event, k, values, h)
                held = low == 0.0
            share = low if held else _root(run, states, point, event, k, values, low, high, h)
            if share < first:
                first, run.count.fired = share, k
        if first <= 1.0:
            return first
        for k in range(len(events)):
            events[k].later = events[k].new
    return 2.0


@law
def _leaves(run: Any, states: Any, point: Array, event: Any, k: int, values: Array, h: float) -> float:
    """A share soon after which value k, zero at the beginning, is positive; 0: there is none.

    So a ball that has just bounced is seen to fall again within the same step.
    """
    _events_within(run, states, 0.0, h, point, values)
    residual = 4.0 * abs(values[k])  # what rounding has left of the event before
    for share in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        _events_within(run, states, share, h, point, values)
        if values[k] > residual:
            event.later = values[k]
            return share
    return 0.0


@law
def _root(
    run: Any, states: Any, point: Array, event: Any, k: int, values: Array, low: float, high: float, h: float
) -> float:
    """The share of the step at which value k crosses, from ``later`` at low to ``new`` at high: regula falsi."""
    t, before, after, side = run.clock.time, event.later, event.new, 0
    for turn in range(_MOST):
        if high - low <= 4e-16 * max(abs(t) / h, 1.0):
            break
        share = low + (high - low) * before / (before - after)
        if turn % 3 == 2 or not low < share < high:
            share = math.sqrt(low * high) if high > 4.0 * low > 0.0 else 0.5 * (low + high)
        _events_within(run, states, share, h, point, values)
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
    method: Any, run: Any, states: Any, point: Array, answer: Array, jacobian: Array, factors: Array, pivots: Any,
    values: Array, share: float, whole: float,
) -> float:  # fmt: skip
    """Take the step again so that it ends at the event: found on the polynomial, corrected on the method itself [s]."""
    k, t, h = run.count.fired, run.clock.time, share * whole
    near = min(_CLOSE, 0.1 * math.sqrt(run.settings.rtol))
    last = False
    for turn in range(4):
        take_step(method, run, states, point, answer, jacobian, factors, pivots, h)
        if last or turn == 3:
            break
        for i in range(len(states)):
            point[i] = states[i].next
        _events_at(run, t + h, point, values)
        reached = values[k]
        _events_within(run, states, 1.0 - 1e-4, h, point, values)
        slope = (reached - values[k]) / (1e-4 * h)
        shift = -reached / slope if slope != 0.0 else 0.0
        moved = min(h + shift, whole)
        if not abs(shift) < 0.1 * h or abs(shift) <= _EPSILON * max(abs(t), h) or moved == h:
            break
        last = abs(shift) < near * h  # what this leaves is its square
        h = moved
    return h


@law
def repeats(run: Any, h: float) -> bool:
    """Whether an event just handled happens at once again; a shorter step, that sees what it set off, is proposed."""
    clock, count = run.clock, run.count
    if clock.time != clock.last_event or count.fired != count.last_fired or h < _NEAR:
        return False
    clock.step = _AGAIN * h
    count.was_rejected = 1
    count.rejected += 1
    return True


@law
def jump_fires(run: Any, states: Any, point: Array, events: Any, values: Array) -> bool:
    """Whether what has changed where a segment begins sets off an event."""
    fired = False
    _events_here(run, states, point, values)
    for k in range(len(events)):
        events[k].new = values[k]
        fired = fired or values[k] < 0.0
    run.count.fired = -1
    if not fired:
        pass_events(events)
    return fired


@law
def handle(run: Any, states: Any, point: Array, events: Any, values: Array) -> int:
    """Events fire at the present state: let the handler change it, look again. DONE: go on."""
    clock, count = run.clock, run.count
    _events_here(run, states, point, values)
    for k in range(len(events)):
        events[k].new = values[k]
        values[k] = -1.0 if k == count.fired or values[k] < 0.0 else 0.0
    near = clock.time - clock.last_event <= _NEAR * max(1.0, abs(clock.time))
    weight = _SAME if count.fired == count.last_fired else 1  # many events may fall together, one may not repeat
    count.busy = count.busy + weight if near else 0
    count.last_fired = count.culprit = count.fired
    clock.last_event = clock.origin = clock.time
    call_here(run, run.calls.handler, states, point, values)
    count.fresh = count.fresh_jacobian = count.strides = 0
    count.restarts += 1
    _events_here(run, states, point, values)
    for k in range(len(events)):
        events[k].old = values[k]
    return ZENO if count.busy > _BUSY else DONE
