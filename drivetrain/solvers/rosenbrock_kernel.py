"""The compiled loop: step, error, event, change of mode, go on; for RODAS and for the explicit methods beside it.

It is compiled once: right-hand side, Jacobian, events and their handler are addresses. All that it knows between two
steps lies in the arrays it is given, so it can come back after any step and go on later, to the last bit the same.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law
from drivetrain.solvers.compiled_events import BRACKET, LATER, NEW, OLD, event_values, fires, first_event
from drivetrain.solvers.compiled_function import call_rows, call_step
from drivetrain.solvers.compiled_jacobian import fill_jacobian
from drivetrain.solvers.compiled_output import emit, emit_here
from drivetrain.solvers.compiled_steps import rates, within
from drivetrain.solvers.layout import (
    BUDGET,
    BUSY,
    CULPRIT,
    DONE,
    DORMAND_PRINCE,
    EULER,
    EVENTS,
    F0,
    F1,
    FIRED,
    FRESH,
    FRESH_JACOBIAN,
    GUARD,
    INNER,
    JUMP,
    JUMP_AT,
    LAST_EVENT,
    LAST_FIRED,
    LIMIT,
    LOGGED,
    MOST_STEPS,
    NEXT,
    NO_NUMBER,
    OPEN,
    OPENS,
    ORIGIN,
    PAUSED,
    REJECTED,
    RESTARTS,
    RODAS5P,
    RTOL,
    RUNS_AWAY,
    SEGMENT,
    SEGMENT_WORD,
    STARTED,
    STEP,
    STEPPER,
    STEPS,
    STRIDES,
    TERMINAL,
    TIME,
    TOLERANCE,
    TOO_MANY,
    WAS_REJECTED,
    ZENO,
    X,
)
from drivetrain.solvers.step_control import choose, first_step, largest_error, next_step, refuse

_EPSILON = float(np.finfo(np.float64).eps)
_BUSY, _SAME, _NEAR = 50, 5, 1e-9  # events without progress of time; the weight of a repeated one; [s]
_SLACK = 1e-12
_AGAIN, _CLOSE = 0.25, 1e-3


@law
def _commit(method: int, later: float, block: Array, clock: Array, count: Any) -> None:
    """The end of the step becomes the state."""
    keeps = method > RODAS5P and method != EULER
    for i in range(block.shape[1]):
        block[X, i] = block[NEXT, i]
        if keeps:
            block[F0, i] = block[F1, i]
    clock[TIME] = later
    count[FRESH] = 1 if keeps else 0
    count[FRESH_JACOBIAN] = 0
    count[STEPS] += 1
    count[STRIDES] += 1


@law
def _handle(
    addresses: Any,
    kinds: Any,
    terminal: Any,
    values: Array,
    log: Any,
    block: Array,
    data: Any,
    clock: Array,
    count: Any,
) -> int:
    """Events fire at the present state: log them, let the handler change it, look again. DONE: go on."""
    t, ends = clock[TIME], False
    event_values(addresses[2], t, block, X, values, NEW, data, count)
    for k in range(len(kinds)):
        held = kinds[k] == GUARD and values[NEW, k] < 0.0
        before = values[LATER, k]  # where the search for the event began
        fired = k == count[FIRED] or held or fires(kinds[k], before, values[NEW, k])
        values[LATER, k] = 0.0
        if fired:
            values[LATER, k] = 1.0 if before < 0.0 and kinds[k] != GUARD else -1.0
            ends = ends or terminal[k] != 0
            if count[LOGGED] < len(log[0]):
                log[0][count[LOGGED]], log[1][count[LOGGED]] = t, k
                count[LOGGED] += 1
            count[EVENTS] += 1
    near = abs(t - clock[LAST_EVENT]) <= _NEAR * max(1.0, abs(t))
    weight = _SAME if count[FIRED] == count[LAST_FIRED] else 1  # many events may fall together, one may not repeat
    count[BUSY] = count[BUSY] + weight if near else 0
    count[LAST_FIRED] = count[FIRED]
    clock[LAST_EVENT] = t
    if addresses[3]:
        call_rows(addresses[3], t, block, X, values, LATER, data)
        count[FRESH] = count[FRESH_JACOBIAN] = 0
        count[RESTARTS] += 1
        clock[ORIGIN], count[STRIDES] = t, 0
        event_values(addresses[2], t, block, X, values, OLD, data, count)
    else:
        for k in range(len(kinds)):
            values[OLD, k] = values[NEW, k]
    for k in range(len(kinds)):
        # What has just crossed is a rounding short of zero or beyond; at zero it is armed again when it has moved.
        unmoved = values[OLD, k] == values[NEW, k] or values[LATER, k] * values[OLD, k] < 0.0
        if values[LATER, k] != 0.0 and unmoved and kinds[k] != GUARD:
            values[OLD, k] = 0.0
    count[CULPRIT] = count[FIRED]
    if ends:
        return TERMINAL
    return ZENO if count[BUSY] > _BUSY else DONE


@law
def _open(
    addresses: Any,
    kinds: Any,
    terminal: Any,
    values: Array,
    log: Any,
    block: Array,
    data: Any,
    clock: Array,
    count: Any,
) -> int:
    """A segment begins: tell the right-hand side which, and see what the jump at its beginning sets off."""
    if count[SEGMENT_WORD] >= 0:
        data[1][count[SEGMENT_WORD]] = count[SEGMENT]
    count[OPEN], count[FRESH], count[FRESH_JACOBIAN], count[STRIDES] = 1, 0, 0, 0
    clock[ORIGIN] = clock[TIME]
    if addresses[OPENS]:
        call_rows(addresses[OPENS], clock[TIME], block, X, block, INNER, data)
    m, fired = len(kinds), False
    if m:
        event_values(addresses[2], clock[TIME], block, X, values, NEW, data, count)
        for k in range(m):
            if not count[STARTED]:
                values[OLD, k] = values[NEW, k]
            held = kinds[k] == GUARD and values[NEW, k] < 0.0
            fired = fired or held or fires(kinds[k], values[OLD, k], values[NEW, k])
            values[LATER, k] = values[OLD, k]
        count[FIRED] = -1
        if fired:
            return _handle(addresses, kinds, terminal, values, log, block, data, clock, count)
        for k in range(m):
            values[OLD, k] = values[NEW, k]
    return DONE


@law
def _shorten(
    share: float,
    h: float,
    rtol: float,
    addresses: Any,
    data: Any,
    block: Array,
    matrices: Any,
    order: Any,
    values: Array,
    clock: Array,
    count: Any,
) -> float:
    """Take the step again so that it ends at the event: found on the polynomial, mended on the method itself."""
    k, t, used = count[FIRED], clock[TIME], share * h
    near = min(_CLOSE, 0.1 * math.sqrt(rtol))
    last = False
    room = (block, matrices[0], matrices[1], matrices[3], order)
    for turn in range(4):
        call_step(addresses[STEPPER], addresses[0], used, room, data, clock, count)
        if last or turn == 3:
            break
        later = min(t + used, clock[LIMIT])
        event_values(addresses[2], later, block, NEXT, values, NEW, data, count)
        within(1.0 - 1e-4, block, INNER)
        event_values(addresses[2], later - 1e-4 * used, block, INNER, values, BRACKET, data, count)
        slope = (values[NEW, k] - values[BRACKET, k]) / (1e-4 * used)
        shift = -values[NEW, k] / slope if slope != 0.0 else 0.0
        moved = min(used + shift, h)
        if not abs(shift) < 0.1 * used or abs(shift) <= _EPSILON * max(abs(t), used) or moved == used:
            break
        last = abs(shift) < near * used  # what this leaves is its square
        used = moved
    return used


@law
def _repeats(h: float, clock: Array, count: Any) -> bool:
    """Whether an event just handled happens at once again; a shorter step, that sees what it set off, is proposed."""
    if clock[TIME] != clock[LAST_EVENT] or count[FIRED] != count[LAST_FIRED] or h < _NEAR:
        return False
    clock[STEP], count[WAS_REJECTED] = _AGAIN * h, 1
    count[REJECTED] += 1
    return True


@law
def _refresh(address: int, block: Array, data: Any, clock: Array, count: Any) -> int:
    """Rates at the present state, if they are numbers."""
    n = block.shape[1]
    rates(address, clock[TIME], X, F0, block, data, count)
    count[FRESH] = 1
    for i in range(n):
        if not np.isfinite(block[F0, i]):
            count[CULPRIT] = i
            return NO_NUMBER
    return DONE


# long kernel: the loop as it runs, its parts above
@kernel
def advance(
    method: int,
    addresses: Any,
    data: Any,
    block: Array,
    matrices: Any,
    order: Any,
    pattern: Any,
    carried: Any,
    atol: Array,
    settings: Array,
    segments: Any,
    wanted: Array,
    rows: Array,
    kinds: Any,
    terminal: Any,
    values: Array,
    log: Any,
    clock: Array,
    count: Any,
) -> int:
    """Go on from where the arrays say, until the end, the budget of steps, a terminal event or a reason to stop.

    Args:
        addresses: Of the right-hand side, its Jacobian, the event values, their handler, the account, what tells a
            row, what opens a segment, and of the method's step, (8,); 0 for none.
        block: Vectors of the length of the state, (BLOCK_ROWS, n); row X is the state.
        matrices: Jacobian in the order of elimination (n, n), its factors (n, n), room for the exact one (n + 1, n),
            and the factors packed (n n).
        order: Room for the factors' order, at its end the states in that of elimination, (n n + 3 n + 1,).
        atol: Error allowed in a step where a state is near zero [the state's own unit], (n,).
        segments: Ends of the segments [s], and the last instant that each may see [s].
        wanted, rows: Instants wanted [s], and what is told there, (N, ...).
        kinds, terminal: Of the events, see ``layout``, (m,).
        values: Event values, (VALUE_ROWS, m).
        log: Instants [s] and indices of events.
    """
    address, rtol, adaptive = addresses[0], settings[RTOL], method <= DORMAND_PRINCE
    room = (block, matrices[0], matrices[1], matrices[3], order)
    while count[SEGMENT] < len(segments[0]):
        end = segments[0][count[SEGMENT]]
        clock[LIMIT] = segments[1][count[SEGMENT]]
        if not count[OPEN]:
            code = _open(addresses, kinds, terminal, values, log, block, data, clock, count)
            if code != DONE:
                return code
            count[STARTED] = 1
            emit_here(addresses, wanted, rows, block, data, clock, count)
        while clock[TIME] < end:
            if count[BUDGET] <= 0 or (len(log[0]) and len(log[0]) - count[LOGGED] < len(kinds)):
                return PAUSED
            if count[STEPS] >= count[MOST_STEPS]:
                return TOO_MANY
            count[BUDGET] -= 1
            if not count[FRESH] and _refresh(address, block, data, clock, count) != DONE:
                return NO_NUMBER
            for i in range(block.shape[1]):
                block[TOLERANCE, i] = atol[i] + rtol * abs(block[X, i])
            if adaptive and clock[STEP] <= 0.0:
                clock[STEP] = first_step(address, settings, block, end, data, clock, count)
            h = choose(method, end, settings, clock, count)
            if method <= RODAS5P and not count[FRESH_JACOBIAN]:
                count[FRESH_JACOBIAN] = 1
                if not fill_jacobian(
                    addresses, h, block, matrices[0], matrices[2], pattern, atol, rtol, data, clock, count
                ):
                    clock[JUMP_AT] = clock[TIME]
                    return JUMP
            call_step(addresses[STEPPER], address, h, room, data, clock, count)
            error = largest_error(block, atol, rtol, count)
            if error > 1.0 and adaptive:
                code = refuse(address, h, error, settings, block, data, clock, count)
                if code != DONE:
                    return code
                continue
            if not error < np.inf:
                return RUNS_AWAY
            later, share = end if h == end - clock[TIME] else clock[TIME] + h, 2.0
            if len(kinds):
                share = first_event(addresses[2], h, kinds, block, values, data, clock, count)
                if adaptive and share <= 0.0 and _repeats(h, clock, count):
                    continue
            if adaptive:
                next_step(method, h, error, clock, count)
            if 0.0 < share <= 1.0:
                h = _shorten(share, h, rtol, addresses, data, block, matrices, order, values, clock, count)
                later = min(clock[TIME] + h, end)
            if share > 0.0:
                emit(addresses, later, h, wanted, rows, carried, block, data, clock, count)
                _commit(method, later, block, clock, count)
            if share <= 1.0:
                code = _handle(addresses, kinds, terminal, values, log, block, data, clock, count)
                if code != DONE:
                    emit_here(addresses, wanted, rows, block, data, clock, count)
                    return code
            else:
                for k in range(len(kinds)):
                    values[OLD, k] = values[NEW, k]
            if clock[TIME] < end:
                emit_here(addresses, wanted, rows, block, data, clock, count)
        # Rows where two segments meet belong to the later one; so the last end is opened too.
        count[SEGMENT] += 1
        count[OPEN] = 0
    if addresses[OPENS]:
        call_rows(addresses[OPENS], clock[TIME], block, X, block, INNER, data)
    emit_here(addresses, wanted, rows, block, data, clock, count)
    return DONE
