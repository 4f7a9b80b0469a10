"""The fixed implicit step, compiled: from node to node, over breakpoints and samples, with a row a wanted instant.

A step never crosses a breakpoint or a sample: it is shortened to end there. The grid counts from the last of them, so
that to stop and to go on changes nothing.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numba as nb

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.jit import kernel
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all, call_one, pointer_to, shifted
from drivetrain.simulation.equations_kernel import compute, guess_still, show_states, tell_motion
from drivetrain.simulation.vector_rows import row_of

# The clock, float64, and the counts, int64: all that a run must keep besides numbers and modes.
TIME, ANCHOR, NEXT_ROW, END, STEP, INTERVAL = range(6)
CLOCK = 6
IN_SEGMENT, NEXT_BREAK, STEPS, SOLVES, SOFT, ROWS, EVENTS, CULPRIT, INSTANTS, BUDGET = range(10)
COUNTS = 10
# Why the kernel came back.
DONE, FULL, PAUSED, DIVERGED, JAMMED, ENDLESS = range(6)
SLACK = 1e-9  # of a step: what rounding may leave
BEYOND = 1e60


@part
def _equations(n: Any, w: Any, which: int, t: float, h: float, rates: Any) -> None:
    """Motion or forces."""
    call_one(w[which], t, h, rates, n, w, 0)


@part
def _sample(n: Any, w: Any, t: float, slack: float) -> None:
    """Samples that are due at a node; all laws are computed there before the first."""
    told, spare = False, shifted(n, w[f.AT_SPARE])
    for k in range(w[f.SAMPLES]):
        at = w[f.AT_SAMPLES] + 4 * k
        if t < n[w[at + 2]] * w[at + 3] - slack:
            continue
        if not told:
            guess_still(n, w)
            tell_motion(n, w, 0.0)
            show_states(n, w, 0.0)
            compute(n, w, t, 0.0, spare)
            told = True
        call_all(1, at, t, 0.0, spare, n, w)
        w[at + 3] += 1


@part
def _next_sample(n: Any, w: Any) -> float:
    """The next instant at which something is sampled."""
    first = math.inf
    for k in range(w[f.SAMPLES]):
        at = w[f.AT_SAMPLES] + 4 * k
        first = min(first, n[w[at + 2]] * w[at + 3])
    return first


@part
def _row(n: Any, w: Any, t: float, row: Any, kept: Any) -> None:
    """States, signals and energies at a node; the modes of friction stay as they are."""
    c, states, signals, spare = w[f.COORDINATES], w[f.STATES], w[f.SIGNALS], shifted(n, w[f.AT_SPARE])
    for i in range(3 * c):
        kept[i] = w[w[f.AT_MODES] + i]
    _equations(n, w, f.MOTION, t, 0.0, spare)
    _equations(n, w, f.FORCES, t, 0.0, spare)
    call_all(w[f.ACCOUNTS], w[f.AT_ACCOUNTS], t, 0.0, spare, n, w)
    for i in range(3 * c):
        w[w[f.AT_MODES] + i] = kept[i]
    row[0] = t
    for k in range(states):
        row[1 + k] = n[w[f.AT_STATE] + k]
    for k in range(w[f.AT_SHOWN], w[f.AT_SHOWN] + 2 * w[f.SHOWN], 2):
        # An effect that moves a state on from time to time only tells what it is now.
        row[1 + w[k]] = n[w[f.AT_SIGNALS] + w[k + 1]]
    for k in range(signals):
        row[1 + states + k] = n[w[f.AT_SIGNALS] + k]
    for k in range(w[f.POWERS]):
        row[1 + states + signals + k] = n[w[f.AT_ENERGIES] + k]


# long kernel: every state once
@part
def _accept(n: Any, w: Any, t: float, h: float, theta: float) -> int:
    """Move on by a solved step; a coordinate or state that is no number any more, or -1."""
    joints, c, x, rates, bad = w[f.JOINTS], w[f.COORDINATES], w[f.AT_STATE], w[f.AT_RATES], -1
    change, guess, last, surface = row_of(w, f.CHANGE), row_of(w, f.GUESS), row_of(w, f.LAST), row_of(w, f.SURFACE)
    own, slower = shifted(n, rates), 1.0 / h
    _equations(n, w, f.FORCES, t, h, own)
    call_all(w[f.ACCOUNTS], w[f.AT_ACCOUNTS], t + theta * h, h, own, n, w)
    for k in range(w[f.POWERS]):
        n[w[f.AT_ENERGIES] + k] += h * n[w[f.AT_SIGNALS] + w[w[f.AT_POWERS] + k]]
    for i in range(joints):
        n[x + i] += h * n[guess + i]
        m = w[w[f.AT_MOTORS] + i]
        if m != i:
            n[x + m] += h * (n[guess + m] - n[guess + i])
    for i in range(c):
        speed = x + c + i
        if w[w[f.AT_MODES] + i] == 0:
            # Exactly the speed of what it rubs on, not what rounding makes of it.
            n[speed] = n[surface + i]
            n[last + i] = 0.0
        else:
            n[speed] += n[change + i]
            n[last + i] = n[change + i] * slower
        if not abs(n[speed]) < BEYOND:
            bad = c + i
    for k in range(2 * c, w[f.STATES]):
        n[x + k] += h * n[rates + k]
        if not abs(n[x + k]) < BEYOND:
            bad = k
    return bad


@part
def _log(w: Any, c: int, t: float, before: Any, log: Any, counts: Any, room: int) -> None:
    """Write down the modes that have changed."""
    for i in range(c):
        mode = w[w[f.AT_MODES] + i]
        if mode != before[i]:
            if counts[EVENTS] < room:
                at = 4 * counts[EVENTS]
                log[at] = t
                log[at + 1] = i
                log[at + 2] = before[i]
                log[at + 3] = mode
            counts[EVENTS] += 1


@part
def _next_node(n: Any, w: Any, clock: Any, counts: Any, breaks: Any) -> float:
    """Where the step ends: on the grid, or on what comes first."""
    inner = min(breaks[counts[NEXT_BREAK]], _next_sample(n, w))
    mark, slack = min(clock[END], inner), SLACK * clock[STEP]
    to = clock[ANCHOR] + clock[STEP] * (counts[IN_SEGMENT] + 1)
    if to <= mark - slack:
        counts[IN_SEGMENT] += 1
        return to
    if inner <= mark + slack:
        clock[ANCHOR] = inner
        counts[IN_SEGMENT] = 0
        return inner
    if to <= mark + slack:
        counts[IN_SEGMENT] += 1
        return to  # the end, as it would be if the run went on
    return mark


# long kernel: the loop over nodes
@kernel
def _advance(
    numbers: Any, words: Any, clock: Any, counts: Any, breaks: Any, rows: Any, events: Any, scratch: Any
) -> int:
    """Step until the end, until the rows are full, or until the budget of steps is spent; why it came back."""
    # Pointers all: handing over an array costs two counts of its references, each dearer than a small law.
    n, w, time, count = pointer_to(numbers), pointer_to(words), pointer_to(clock), pointer_to(counts)
    jumps, table, log, before = pointer_to(breaks), pointer_to(rows), pointer_to(events), pointer_to(scratch)
    most, width, room = rows.shape[0], rows.shape[1], events.shape[0]
    c, step, slack = w[f.COORDINATES], time[STEP], SLACK * time[STEP]
    budget, modes = count[BUDGET], w[f.AT_MODES]
    guess, last, speeds = row_of(w, f.GUESS), row_of(w, f.LAST), w[f.AT_STATE] + c
    while True:
        t = time[TIME]
        _sample(n, w, t, slack)
        if t >= time[NEXT_ROW] - slack:
            if count[ROWS] == most:
                return FULL
            row = shifted(table, count[ROWS] * width)
            _row(n, w, t, row, before)
            if abs(t - time[END]) <= slack:
                row[0] = time[END]
            count[ROWS] += 1
            count[INSTANTS] += 1
            time[NEXT_ROW] = min(time[INTERVAL] * (math.floor(t / time[INTERVAL] + 1e-6) + 1.0), time[END])
        if t >= time[END] - slack:
            return DONE
        if budget == 0:
            return PAUSED
        budget -= 1
        to = _next_node(n, w, time, count, jumps)
        # A whole step is exactly that, however the clock is rounded: laws may keep what they have made for it.
        h = step if abs(to - t - step) <= slack else to - t
        theta = 1.0 if count[SOFT] else 0.5
        count[SOFT] = 0
        for i in range(c):
            before[i] = w[modes + i]
            n[guess + i] = n[speeds + i] + theta * h * n[last + i]
        n[w[f.AT_THETA]] = theta
        _equations(n, w, f.MOTION, t, h, shifted(n, w[f.AT_RATES]))
        if w[f.SOLVED] < 0:
            count[CULPRIT] = -1 - w[f.SOLVED]
            return JAMMED if w[f.SOLVED] > -1000 else ENDLESS
        count[SOLVES] += w[f.SOLVED]
        count[STEPS] += 1
        bad = _accept(n, w, t, h, theta)
        time[TIME] = to
        _log(w, c, to, before, log, count, room)
        if bad >= 0:
            count[CULPRIT] = bad
            return DIVERGED
        if to >= jumps[count[NEXT_BREAK]] - slack:
            while jumps[count[NEXT_BREAK]] <= to + slack:
                count[NEXT_BREAK] += 1
            # Half a step ahead a stiff spring would ring for ever after a jump; a whole one calms it.
            count[SOFT] = w[f.STIFF]


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The loop, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        A function of ``numbers, words`` (as ``plan.py`` lays them out), ``clock, counts`` (as named above), ``breaks``
        (instants, rising, an infinity last), what it fills: ``rows`` (time, states, signals, energies) and ``events``
        (time, coordinate, mode before and after), and three whole numbers a coordinate as scratch. It returns why it
        came back.
    """
    flat, whole = nb.types.Array(nb.float64, 1, "C"), nb.types.Array(nb.int64, 1, "C")
    table = nb.types.Array(nb.float64, 2, "C")
    _advance.compile(nb.int64(flat, whole, flat, whole, flat, table, table, whole))
    _advance.disable_compile()
    return _advance
