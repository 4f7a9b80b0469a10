"""Events within a step: where a value crosses zero, what its handler changes, and a step taken again to end there."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.records import DONE, FALLING, GUARD, RISING, TERMINAL, ZENO, EventRoom, Linear, Run
from drivetrain.solvers.step import ask, ask_here, load, take_step, within
from drivetrain.solvers.tableaux import Tableau

_EPSILON = float(np.finfo(np.float64).eps)
_BUSY, _SAME, _NEAR = 50, 5, 1e-9  # events without progress of time; the weight of a repeated one; [s]
_AGAIN, _CLOSE = 0.25, 1e-3
_LOOKS = 2  # parts of a step whose ends are looked at
_MOST = 160


@law
def ask_events(run: Run, t: float, result: Array) -> None:
    """The values of all events at the state ``asked``, counted; never beyond what the segment may see."""
    ask(run, run.calls.values, min(t, run.clock.limit), result)
    run.count.event_values += 1


@law
def events_here(run: Run, result: Array) -> None:
    """The values of all events here and now."""
    load(run)
    ask_events(run, run.clock.time, result)


@law
def _events_within(run: Run, share: float, h: float, result: Array) -> None:
    """The values of all events at a share of the step."""
    within(run, share)
    ask_events(run, run.clock.time + share * h, result)


@law
def copy(goal: Array, source: Array) -> None:
    """Event values become others."""
    for k in range(len(goal)):
        goal[k] = source[k]


@law
def fires(kind: int, before: float, after: float) -> bool:
    """Whether a change of value is the event."""
    if kind == GUARD:
        return after < 0.0 and (before > 0.0 or after < before)
    falls, rises = before > 0.0 and after <= 0.0, before < 0.0 and after >= 0.0
    return (falls and kind != RISING) or (rises and kind != FALLING)


@law
def first_event(run: Run, events: EventRoom, h: float) -> float:
    """The share of the step at which the first event happens, 2 when none does; ``count.fired`` says which."""
    kinds, later, new = events.kinds, events.later, events.new
    run.count.fired = -1
    copy(later, events.old)
    for part in range(_LOOKS):
        high = (part + 1) / _LOOKS
        _events_within(run, high, h, new)
        first = 2.0
        for k in range(len(kinds)):
            low = part / _LOOKS
            if part == 0 and events.old[k] == 0.0 and new[k] != 0.0 and kinds[k] != GUARD:
                low = _leaves(run, events, k, h)
            if not fires(kinds[k], later[k], new[k]):
                continue
            held = kinds[k] == GUARD and later[k] <= 0.0  # it was about to be broken when the step began
            if held and part == 0:  # unless it rises first, to be broken later
                low = _leaves(run, events, k, h)
                held = low == 0.0
            share = low if held else _root(run, events, k, low, high, h)
            if share < first:
                first, run.count.fired = share, k
        if first <= 1.0:
            return first
        copy(later, new)
    return 2.0


@law
def _leaves(run: Run, events: EventRoom, k: int, h: float) -> float:
    """A share soon after which value k, zero at the beginning, has the other sign than in ``new``; 0: there is none.

    So a ball that has just bounced is seen to fall again within the same step.
    """
    _events_within(run, 0.0, h, events.trial)
    residual = 4.0 * abs(events.trial[k])  # what rounding has left of the event before
    for share in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        _events_within(run, share, h, events.trial)
        if events.trial[k] * events.new[k] < 0.0 and abs(events.trial[k]) > residual:
            events.later[k] = events.trial[k]
            return share
    return 0.0


@law
def _root(run: Run, events: EventRoom, k: int, low: float, high: float, h: float) -> float:
    """The share of the step at which value k crosses, from ``later`` at low to ``new`` at high: regula falsi."""
    t, before, after, side = run.clock.time, events.later[k], events.new[k], 0
    if before == 0.0:
        return low
    for turn in range(_MOST):
        if high - low <= 4e-16 * max(abs(t) / h, 1.0):
            break
        share = low + (high - low) * before / (before - after)
        if turn % 3 == 2 or not low < share < high:
            share = math.sqrt(low * high) if high > 4.0 * low > 0.0 else 0.5 * (low + high)
        _events_within(run, share, h, events.trial)
        value = events.trial[k]
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
def end_at_event(tableau: Tableau, run: Run, linear: Linear, events: EventRoom, share: float, whole: float) -> float:
    """Take the step again so that it ends at the event: found on the polynomial, corrected on the method itself [s]."""
    k, t, new, h = run.count.fired, run.clock.time, events.new, share * whole
    near = min(_CLOSE, 0.1 * math.sqrt(run.settings.rtol))
    last = False
    for turn in range(4):
        take_step(tableau, run, linear, h)
        if last or turn == 3:
            break
        for i in range(len(run.asked)):
            run.asked[i] = run.states[i].next
        ask_events(run, t + h, new)
        _events_within(run, 1.0 - 1e-4, h, events.trial)
        slope = (new[k] - events.trial[k]) / (1e-4 * h)
        shift = -new[k] / slope if slope != 0.0 else 0.0
        moved = min(h + shift, whole)
        if not abs(shift) < 0.1 * h or abs(shift) <= _EPSILON * max(abs(t), h) or moved == h:
            break
        last = abs(shift) < near * h  # what this leaves is its square
        h = moved
    return h


@law
def repeats(run: Run, h: float) -> bool:
    """Whether an event just handled happens at once again; a shorter step, that sees what it set off, is proposed."""
    clock, count = run.clock, run.count
    if clock.time != clock.last_event or count.fired != count.last_fired or h < _NEAR:
        return False
    clock.step = _AGAIN * h
    count.was_rejected = 1
    count.rejected += 1
    return True


@law
def jump_fires(run: Run, events: EventRoom) -> bool:
    """Whether what has changed where a segment begins sets off an event."""
    old, new, fired = events.old, events.new, False
    events_here(run, new)
    if not run.count.started:
        copy(old, new)
    for k in range(len(old)):
        overdone = events.kinds[k] == GUARD and new[k] < 0.0
        fired = fired or overdone or fires(events.kinds[k], old[k], new[k])
    copy(events.later, old)
    run.count.fired = -1
    if not fired:
        copy(old, new)
    return fired


@law
def handle(run: Run, events: EventRoom) -> int:
    """Events fire at the present state: log them, let the handler change it, look again. DONE: go on."""
    clock, count, kinds, old, new = run.clock, run.count, events.kinds, events.old, events.new
    crossed, ends = events.later, False  # in ``later`` still stands where the search for the event began
    events_here(run, new)
    for k in range(len(kinds)):
        before, overdone = crossed[k], kinds[k] == GUARD and new[k] < 0.0
        fired = k == count.fired or overdone or fires(kinds[k], before, new[k])
        crossed[k] = 0.0
        if fired:
            crossed[k] = 1.0 if before < 0.0 and kinds[k] != GUARD else -1.0
            ends = ends or events.terminal[k] != 0
            if count.logged < len(events.log_times):
                events.log_times[count.logged], events.log_indices[count.logged] = clock.time, k
                count.logged += 1
    near = abs(clock.time - clock.last_event) <= _NEAR * max(1.0, abs(clock.time))
    weight = _SAME if count.fired == count.last_fired else 1  # many events may fall together, one may not repeat
    count.busy = count.busy + weight if near else 0
    count.last_fired = count.fired
    clock.last_event = clock.time
    if run.calls.handler:
        ask_here(run, run.calls.handler, crossed)
        count.fresh = 0
        count.fresh_jacobian = 0
        count.restarts += 1
        clock.origin = clock.time
        count.strides = 0
        events_here(run, old)
    else:
        copy(old, new)
    for k in range(len(kinds)):
        # What has just crossed is a rounding short of zero or beyond; at zero it is armed again when it has moved.
        unmoved = old[k] == new[k] or crossed[k] * old[k] < 0.0
        if crossed[k] != 0.0 and unmoved and kinds[k] != GUARD:
            old[k] = 0.0
    count.culprit = count.fired
    if ends:
        return TERMINAL
    return ZENO if count.busy > _BUSY else DONE
