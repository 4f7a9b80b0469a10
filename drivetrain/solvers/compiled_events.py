"""Where within a step an event's value crosses zero, on the polynomial of the step and then on the method itself."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call_rows
from drivetrain.solvers.compiled_steps import within
from drivetrain.solvers.layout import EVENT_VALUES, FALLING, FIRED, GUARD, INNER, LIMIT, RISING, TIME

OLD, NEW, LATER, BRACKET = range(4)  # rows of the block of event values
VALUE_ROWS = 4
_LOOKS = 2  # parts of a step whose ends are looked at
_MOST = 160


@law
def event_values(
    address: int, t: float, block: Array, row: int, values: Array, goal: int, data: Any, count: Any
) -> None:
    """The values of all events at a row of the block, counted.

    Args:
        t: Instant [s].
    """
    call_rows(address, t, block, row, values, goal, data)
    count[EVENT_VALUES] += 1


@law
def fires(kind: int, before: float, after: float) -> bool:
    """Whether a change of value is the event."""
    if kind == GUARD:
        return after < 0.0 and (before > 0.0 or after < before)
    falls, rises = before > 0.0 and after <= 0.0, before < 0.0 and after >= 0.0
    return (falls and kind != RISING) or (rises and kind != FALLING)


@law
def _root(
    address: int,
    k: int,
    low: float,
    high: float,
    h: float,
    block: Array,
    values: Array,
    data: Any,
    clock: Any,
    count: Any,
) -> float:
    """The share of the step at which value k crosses, between low (row LATER) and high (row NEW): regula falsi."""
    t, limit = clock[TIME], clock[LIMIT]
    before, after = values[LATER, k], values[NEW, k]
    if before == 0.0:
        return low
    side = 0
    for turn in range(_MOST):
        if high - low <= 4e-16 * max(abs(t) / h, 1.0):
            break
        share = low + (high - low) * before / (before - after)
        if turn % 3 == 2 or not low < share < high:
            share = math.sqrt(low * high) if high > 4.0 * low > 0.0 else 0.5 * (low + high)
        within(share, block, INNER)
        event_values(address, min(t + share * h, limit), block, INNER, values, BRACKET, data, count)
        value = values[BRACKET, k]
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
def _leaves(address: int, k: int, h: float, block: Array, values: Array, data: Any, clock: Array, count: Any) -> float:
    """A share soon after which value k, zero at the beginning, has the other sign than in row NEW; 0: there is none.

    So a ball that has just bounced is seen to fall again within the same step.
    """
    within(0.0, block, INNER)
    event_values(address, clock[TIME], block, INNER, values, BRACKET, data, count)
    residual = 4.0 * abs(values[BRACKET, k])  # what rounding has left of the event before
    for share in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        within(share, block, INNER)
        later = min(clock[TIME] + share * h, clock[LIMIT])
        event_values(address, later, block, INNER, values, BRACKET, data, count)
        if values[BRACKET, k] * values[NEW, k] < 0.0 and abs(values[BRACKET, k]) > residual:
            values[LATER, k] = values[BRACKET, k]
            return share
    return 0.0


@law
def first_event(
    address: int, h: float, kinds: Any, block: Array, values: Array, data: Any, clock: Array, count: Any
) -> float:
    """The share of the step at which the first event happens, 2 when none does; count[FIRED] says which.

    Args:
        h: Step [s].
    """
    t, limit, m = clock[TIME], clock[LIMIT], len(kinds)
    count[FIRED] = -1
    for k in range(m):
        values[LATER, k] = values[OLD, k]
    for part in range(_LOOKS):
        high = (part + 1) / _LOOKS
        within(high, block, INNER)
        event_values(address, min(t + high * h, limit), block, INNER, values, NEW, data, count)
        first = 2.0
        for k in range(m):
            low = part / _LOOKS
            if part == 0 and values[OLD, k] == 0.0 and values[NEW, k] != 0.0 and kinds[k] != GUARD:
                low = _leaves(address, k, h, block, values, data, clock, count)
            if not fires(kinds[k], values[LATER, k], values[NEW, k]):
                continue
            held = kinds[k] == GUARD and values[LATER, k] <= 0.0  # it was about to be broken when the step began
            if held and part == 0:  # unless it rises first, to be broken later
                low = _leaves(address, k, h, block, values, data, clock, count)
                held = low == 0.0
            share = low if held else _root(address, k, low, high, h, block, values, data, clock, count)
            if share < first:
                first, count[FIRED] = share, k
        if first <= 1.0:
            return first
        for k in range(m):
            values[LATER, k] = values[NEW, k]
    return 2.0
