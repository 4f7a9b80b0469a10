"""The fixed implicit step, compiled: from node to node, over breakpoints and samples, with a row a wanted instant.

A step never crosses a breakpoint or a sample: it is shortened to end there. The grid counts from the last of them, so
that to stop and to go on changes nothing.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all, call_one, pointer_to, shifted
from drivetrain.simulation.equations_kernel import compute, guess_still, show_states, tell_motion
from drivetrain.simulation.vector_rows import row_of

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "simulation/calls.py": 1418883735, "simulation/equations_kernel.py": 1379456263, "simulation/fields.py": 2867580264,
    "dynamics/compiled_vectors.py": 1257686601,
    "simulation/vector_rows.py": 4108182124,
}  # fmt: skip

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
    own = shifted(n, rates)
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
            n[last + i] = n[change + i] / h
        if not abs(n[speed]) < BEYOND:
            bad = c + i
    for k in range(2 * c, w[f.STATES]):
        n[x + k] += h * n[rates + k]
        if not abs(n[x + k]) < BEYOND:
            bad = k
    return bad


@part
def _log(w: Any, c: int, t: float, before: Any, events: Any, counts: Any) -> None:
    """Write down the modes that have changed."""
    for i in range(c):
        mode = w[w[f.AT_MODES] + i]
        if mode != before[i]:
            if counts[EVENTS] < len(events):
                events[counts[EVENTS], 0] = t
                events[counts[EVENTS], 1] = i
                events[counts[EVENTS], 2] = before[i]
                events[counts[EVENTS], 3] = mode
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
@nb.njit(cache=True, error_model="numpy", nogil=True)
def _advance(numbers: Any, words: Any, clock: Any, counts: Any, breaks: Any, rows: Any, events: Any) -> int:
    """Step until the end, until the rows are full, or until the budget of steps is spent; why it came back."""
    n, w = pointer_to(numbers), pointer_to(words)
    c, slack = words[f.COORDINATES], SLACK * clock[STEP]
    kept, before = np.zeros(3 * c, dtype=np.int64), np.zeros(c, dtype=np.int64)
    budget, modes = counts[BUDGET], words[f.AT_MODES]
    guess, last, speeds = row_of(w, f.GUESS), row_of(w, f.LAST), words[f.AT_STATE] + c
    while True:
        t = clock[TIME]
        _sample(n, w, t, slack)
        if t >= clock[NEXT_ROW] - slack:
            if counts[ROWS] == len(rows):
                return FULL
            _row(n, w, t, rows[counts[ROWS]], kept)
            if abs(t - clock[END]) <= slack:
                rows[counts[ROWS], 0] = clock[END]
            counts[ROWS] += 1
            counts[INSTANTS] += 1
            clock[NEXT_ROW] = min(clock[INTERVAL] * (math.floor(t / clock[INTERVAL] + 1e-6) + 1.0), clock[END])
        if t >= clock[END] - slack:
            return DONE
        if budget == 0:
            return PAUSED
        budget -= 1
        to = _next_node(n, w, clock, counts, breaks)
        # A whole step is exactly that, however the clock is rounded: laws may keep what they have made for it.
        h = clock[STEP] if abs(to - t - clock[STEP]) <= slack else to - t
        theta = 1.0 if counts[SOFT] else 0.5
        counts[SOFT] = 0
        for i in range(c):
            before[i] = words[modes + i]
            numbers[guess + i] = numbers[speeds + i] + theta * h * numbers[last + i]
        numbers[words[f.AT_THETA]] = theta
        _equations(n, w, f.MOTION, t, h, shifted(n, words[f.AT_RATES]))
        if words[f.SOLVED] < 0:
            counts[CULPRIT] = -1 - words[f.SOLVED]
            return JAMMED if words[f.SOLVED] > -1000 else ENDLESS
        counts[SOLVES] += words[f.SOLVED]
        counts[STEPS] += 1
        bad = _accept(n, w, t, h, theta)
        clock[TIME] = to
        _log(w, c, to, before, events, counts)
        if bad >= 0:
            counts[CULPRIT] = bad
            return DIVERGED
        if to >= breaks[counts[NEXT_BREAK]] - slack:
            while breaks[counts[NEXT_BREAK]] <= to + slack:
                counts[NEXT_BREAK] += 1
            # Half a step ahead a stiff spring would ring for ever after a jump; a whole one calms it.
            counts[SOFT] = words[f.STIFF]


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The loop, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        A function of ``numbers, words`` (as ``plan.py`` lays them out), ``clock, counts`` (as named above), ``breaks``
        (instants, rising, an infinity last), and what it fills: ``rows`` (time, states, signals, energies) and
        ``events`` (time, coordinate, mode before and after). It returns why it came back.
    """
    flat, whole = nb.types.Array(nb.float64, 1, "C"), nb.types.Array(nb.int64, 1, "C")
    table = nb.types.Array(nb.float64, 2, "C")
    _advance.compile(nb.int64(flat, whole, flat, whole, flat, table, table))
    _advance.disable_compile()
    return _advance
