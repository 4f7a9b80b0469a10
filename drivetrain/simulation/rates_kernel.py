"""The equations of motion as one compiled right-hand side with an address, for solvers that choose their own steps."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import carray

from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all
from drivetrain.simulation.equations_kernel import parts_of, solve_instant, tell_forces
from drivetrain.solvers.compiled_function import compiled

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "calls.py": 0, "equations_kernel.py": 0, "fields.py": 0, "friction_kernel.py": 0,
    "dynamics/compiled_vectors.py": 0, "dynamics/mass_and_bias.py": 0,
}  # fmt: skip


def _rates(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    head = carray(words, f.HEADER)
    p = parts_of(carray(numbers, head[f.NUMBERS]), carray(words, head[f.WORDS]))
    states = head[f.STATES]
    for k in range(states):
        p.state[k] = x[k]
        p.rates[k] = 0.0
    failed = solve_instant(p, t, p.rates) < 0
    for k in range(states):
        result[k] = p.rates[k] if not failed else p.rates[k] / 0.0 * 0.0
    head[f.RATES_CALLS] += 1


def _signals(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    head = carray(words, f.HEADER)
    p = parts_of(carray(numbers, head[f.NUMBERS]), carray(words, head[f.WORDS]))
    for k in range(head[f.STATES]):
        p.state[k] = x[k]
        p.rates[k] = 0.0
    solve_instant(p, t, p.rates)
    tell_forces(p, 1.0, 0.0, 0.0)
    call_all(
        head[f.ACCOUNTS], head[f.AT_ACCOUNTS], t, 0.0, p.state, p.rates, p.signals, p.numbers, p.words
    )
    for k in range(head[f.SIGNALS]):
        result[k] = p.signals[k]


@lru_cache(maxsize=1)
def rates() -> Any:
    """The right-hand side (t, x, result, numbers, words), compiled at the first call or taken from the disk cache.

    Returns:
        The compiled function, with ``.address``; ``numbers`` and ``words`` are those of a plan's layout.
    """
    return compiled(_rates)


@lru_cache(maxsize=1)
def signals() -> Any:
    """All signals at an instant (t, x, result, numbers, words), compiled likewise.

    Returns:
        The compiled function, with ``.address``; the result takes all signals.
    """
    return compiled(_signals)
