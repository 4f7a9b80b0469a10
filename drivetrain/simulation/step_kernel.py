"""The fixed implicit step, compiled: from node to node, over breakpoints and samples, with a row for each wanted instant.

A step never crosses a breakpoint or a sample: it is shortened to end there. The grid counts from the last of them, so
that to stop and to go on changes nothing.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import math

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all, call_one
from drivetrain.simulation.equations_kernel import (
    Parts,
    compute,
    parts_of,
    show_states,
    tell_motion,
)

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "simulation/calls.py": 0, "simulation/equations_kernel.py": 0, "simulation/fields.py": 0,
    "dynamics/compiled_vectors.py": 0,
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
def _equations(p: Parts, which: int, t: float, h: float, rates: Array) -> None:
    """Motion or forces."""
    call_one(p.words[which], t, h, p.state, rates, p.signals, p.numbers, p.words, 0)


@part
def _still(p: Parts, t: float, h: float) -> None:
    """Signals of motion and laws at a node, without forces."""
    for i in range(p.words[f.COORDINATES]):
        p.vectors[f.GUESS, i] = p.state[p.words[f.COORDINATES] + i]
    tell_motion(p, 0.0)
    show_states(p, 0.0)


@part
def _sample(p: Parts, t: float, h: float, spare: Array) -> None:
    """Samples that are due at a node."""
    told = False
    for k in range(p.words[f.SAMPLES]):
        at = p.words[f.AT_SAMPLES] + 4 * k
        period, count = p.numbers[p.words[at + 2]], p.words[at + 3]
        if t < period * count - SLACK * h:
            continue
        if not told:
            _still(p, t, h)
            compute(p, t, 0.0, spare)
            told = True
        call_all(1, at, t, 0.0, p.state, spare, p.signals, p.numbers, p.words)
        p.words[at + 3] = count + 1


@part
def _next_sample(p: Parts) -> float:
    """The next instant at which something is sampled."""
    first = math.inf
    for k in range(p.words[f.SAMPLES]):
        at = p.words[f.AT_SAMPLES] + 4 * k
        first = min(first, p.numbers[p.words[at + 2]] * p.words[at + 3])
    return first


@part
def _row(p: Parts, t: float, row: Array, spare: Array, kept: Array) -> None:
    """States, signals and energies at a node."""
    c, states, signals = p.words[f.COORDINATES], p.words[f.STATES], p.words[f.SIGNALS]
    for i in range(c):
        kept[i], kept[c + i] = p.modes[i], p.sides[i]
    _equations(p, f.MOTION, t, 0.0, spare)
    _equations(p, f.FORCES, t, 0.0, spare)
    call_all(
        p.words[f.ACCOUNTS], p.words[f.AT_ACCOUNTS], t, 0.0, p.state, spare, p.signals, p.numbers, p.words
    )
    for i in range(c):
        p.modes[i], p.sides[i] = kept[i], kept[c + i]
    row[0] = t
    for k in range(states):
        row[1 + k] = p.state[k]
    for k in range(signals):
        row[1 + states + k] = p.signals[k]
    for k in range(p.words[f.POWERS]):
        row[1 + states + signals + k] = p.numbers[p.words[f.AT_ENERGIES] + k]


@part
def _accept(p: Parts, t: float, h: float, theta: float) -> int:
    """Move on by a solved step; a coordinate or state that is no number any more, or -1."""
    n, c, states = p.words[f.JOINTS], p.words[f.COORDINATES], p.words[f.STATES]
    change, v = p.vectors[f.CHANGE], p.vectors
    _equations(p, f.FORCES, t, h, p.rates)
    call_all(
        p.words[f.ACCOUNTS], p.words[f.AT_ACCOUNTS], t + theta * h, h, p.state, p.rates, p.signals, p.numbers, p.words
    )
    for k in range(p.words[f.POWERS]):
        p.numbers[p.words[f.AT_ENERGIES] + k] += h * p.signals[p.words[p.words[f.AT_POWERS] + k]]
    bad = -1
    for i in range(n):
        p.state[i] += h * v[f.GUESS, i]
        m = p.motors[i]
        if m != i:
            p.state[m] += h * (v[f.GUESS, m] - v[f.GUESS, i])
    for i in range(c):
        if p.modes[i] == 0:
            # Exactly the speed of what it rubs on, not what rounding makes of it.
            p.state[c + i] = v[f.SURFACE, i]
            v[f.LAST, i] = 0.0
        else:
            p.state[c + i] += change[i]
            v[f.LAST, i] = change[i] / h
        if not abs(p.state[c + i]) < BEYOND:
            bad = c + i
    for k in range(2 * c, states):
        p.state[k] += h * p.rates[k]
        if not abs(p.state[k]) < BEYOND:
            bad = k
    return bad


@part
def _log(p: Parts, t: float, kept: Array, events: Array, counts: Array) -> None:
    """Write down the modes that have changed."""
    for i in range(p.words[f.COORDINATES]):
        if p.modes[i] != kept[i] and p.levels[i, f.ACTIVE] != 0.0:
            if counts[EVENTS] < len(events):
                events[counts[EVENTS], 0] = t
                events[counts[EVENTS], 1] = i
                events[counts[EVENTS], 2] = kept[i]
                events[counts[EVENTS], 3] = p.modes[i]
            counts[EVENTS] += 1


# long kernel: the loop over nodes
@nb.njit(cache=True, error_model="numpy", nogil=True)
def _advance(
    numbers: Any, words: Any, clock: Any, counts: Any, breaks: Any, rows: Any, events: Any
) -> int:
    """Step until the end, until the rows are full, or until the budget of steps is spent; why it came back."""
    p = parts_of(numbers, words)
    c, h = words[f.COORDINATES], clock[STEP]
    spare, kept, before = np.zeros(words[f.STATES]), np.zeros(2 * c), np.zeros(c)
    budget = counts[BUDGET]
    while True:
        t = clock[TIME]
        slack = SLACK * h
        _sample(p, t, h, spare)
        if t >= clock[NEXT_ROW] - slack:
            if counts[ROWS] == len(rows):
                return FULL
            _row(p, t, rows[counts[ROWS]], spare, kept)
            counts[ROWS] += 1
            counts[INSTANTS] += 1
            clock[NEXT_ROW] = min(clock[INTERVAL] * (math.floor(t / clock[INTERVAL] + 1e-6) + 1.0), clock[END])
        if t >= clock[END] - slack:
            return DONE
        if budget == 0:
            return PAUSED
        budget -= 1
        sample = _next_sample(p)
        mark = min(clock[END], min(breaks[counts[NEXT_BREAK]], sample))
        to = clock[ANCHOR] + h * (counts[IN_SEGMENT] + 1)
        counts[IN_SEGMENT] += 1
        if to > mark - slack:
            to = mark
            if mark < clock[END]:
                clock[ANCHOR] = mark
                counts[IN_SEGMENT] = 0
        theta = 1.0 if counts[SOFT] else 0.5
        counts[SOFT] = 0
        for i in range(c):
            before[i] = p.modes[i]
            p.vectors[f.GUESS, i] = p.state[c + i] + theta * (to - t) * p.vectors[f.LAST, i]
        numbers[words[f.AT_THETA]] = theta
        _equations(p, f.MOTION, t, to - t, p.rates)
        solved = words[f.SOLVED]
        if solved < 0:
            counts[CULPRIT] = -1 - solved
            return JAMMED if solved > -1000 else ENDLESS
        counts[SOLVES] += solved
        counts[STEPS] += 1
        bad = _accept(p, t, to - t, theta)
        clock[TIME] = to
        _log(p, to, before, events, counts)
        if bad >= 0:
            counts[CULPRIT] = bad
            return DIVERGED
        if to >= breaks[counts[NEXT_BREAK]] - slack:
            while breaks[counts[NEXT_BREAK]] <= to + slack:
                counts[NEXT_BREAK] += 1
            counts[SOFT] = 1


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
