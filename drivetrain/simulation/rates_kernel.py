"""The equations of motion as a compiled right-hand side with an address, for solvers that choose their own steps."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

from numba import carray

from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all, call_one
from drivetrain.solvers.compiled_function import compiled

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {"simulation/calls.py": 0, "simulation/fields.py": 0}


def _rates(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    head = carray(words, f.HEADER)
    block, whole, states = carray(numbers, head[f.NUMBERS]), carray(words, head[f.WORDS]), head[f.STATES]
    at = head[f.AT_STATE]
    for k in range(states):
        numbers[at + k] = x[k]
        result[k] = 0.0
    rates = carray(result, states)
    call_one(head[f.MOTION], t, 0.0, block, rates, block, block, whole, 0)
    head[f.RATES_CALLS] += 1
    if head[f.SOLVED] < 0:
        for k in range(states):
            result[k] = math.nan


def _signals(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    head = carray(words, f.HEADER)
    block, whole = carray(numbers, head[f.NUMBERS]), carray(words, head[f.WORDS])
    states, at, first = head[f.STATES], head[f.AT_STATE], head[f.AT_SIGNALS]
    rates = block[head[f.AT_RATES] : head[f.AT_RATES] + states]
    state, signals = block[at : at + states], block[first : first + head[f.SIGNALS]]
    for k in range(states):
        numbers[at + k] = x[k]
        rates[k] = 0.0
    call_one(head[f.MOTION], t, 0.0, state, rates, signals, block, whole, 0)
    call_one(head[f.FORCES], t, 0.0, state, rates, signals, block, whole, 0)
    call_all(head[f.ACCOUNTS], head[f.AT_ACCOUNTS], t, 0.0, state, rates, signals, block, whole)
    for k in range(head[f.SIGNALS]):
        result[k] = signals[k]


@lru_cache(maxsize=1)
def rates() -> Any:
    """The right-hand side (t, x, result, numbers, words), compiled at the first call or taken from the disk cache.

    Returns:
        The compiled function, with ``.address``; ``numbers`` and ``words`` are those of a plan's memory. Rates that
        have no answer are NaN.
    """
    return compiled(_rates)


@lru_cache(maxsize=1)
def signals() -> Any:
    """All signals at an instant (t, x, result, numbers, words), compiled likewise.

    Returns:
        The compiled function, with ``.address``; the result takes all signals.
    """
    return compiled(_signals)
