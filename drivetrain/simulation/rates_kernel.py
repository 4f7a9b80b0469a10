"""The equations of motion as a compiled right-hand side with an address, for solvers that choose their own steps."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all, call_one, shifted
from drivetrain.solvers.compiled_function import compiled


def _rates(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    states, at, spare = words[f.MOVING], words[f.AT_STATE], words[f.AT_SPARE]
    for k in range(states):
        numbers[at + k] = x[k]
        numbers[spare + k] = 0.0
    call_one(words[f.MOTION], t, 0.0, shifted(numbers, spare), numbers, words, 0)
    words[f.RATES_CALLS] += 1
    for k in range(states):
        result[k] = numbers[spare + k] if words[f.SOLVED] >= 0 else math.nan


def _signals(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    states, at, first = words[f.STATES], words[f.AT_STATE], words[f.AT_SIGNALS]
    rates = shifted(numbers, words[f.AT_SPARE])
    for k in range(states):
        numbers[at + k] = x[k]
        rates[k] = 0.0
    call_one(words[f.MOTION], t, 0.0, rates, numbers, words, 0)
    call_one(words[f.FORCES], t, 0.0, rates, numbers, words, 0)
    call_all(words[f.ACCOUNTS], words[f.AT_ACCOUNTS], t, 0.0, rates, numbers, words)
    for k in range(words[f.SIGNALS]):
        result[k] = numbers[first + k]


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
    """All signals at an instant (t, x, result, numbers, words), compiled likewise."""
    return compiled(_signals)
