"""The equations of motion as two compiled functions with addresses, so that every engine shares them.

Both look like an effect's law from outside (``effects/effect.py``): ``motion`` finds the change of speeds, ``forces``
what follows from it. With h = 0 they are at an instant, where the changes are accelerations; ``theta`` of a step stands
in the numbers.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba as nb
from numba import carray

from drivetrain.effects.effect import SIGNATURE
from drivetrain.simulation import fields as f
from drivetrain.simulation.equations_kernel import parts_of, solve_instant, solve_step, tell_forces

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "simulation/calls.py": 0, "simulation/equations_kernel.py": 0, "simulation/fields.py": 0,
    "simulation/friction_kernel.py": 0, "dynamics/compiled_vectors.py": 0, "dynamics/mass_and_bias.py": 0,
}  # fmt: skip


def _motion(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    head = carray(words, f.HEADER)
    p = parts_of(carray(numbers, head[f.NUMBERS]), carray(words, head[f.WORDS]))
    if h > 0.0:
        head[f.SOLVED] = solve_step(p, t, h, numbers[head[f.AT_THETA]])
    else:
        head[f.SOLVED] = solve_instant(p, t, carray(rates, head[f.STATES]))


def _forces(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    head = carray(words, f.HEADER)
    p = parts_of(carray(numbers, head[f.NUMBERS]), carray(words, head[f.WORDS]))
    theta = numbers[head[f.AT_THETA]]
    if h > 0.0:
        tell_forces(p, h, theta, theta * h)
    else:
        tell_forces(p, 1.0, 0.0, 0.0)


@lru_cache(maxsize=1)
def motion() -> Any:
    """The change of speeds, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        The compiled function, with ``.address``.
    """
    return nb.cfunc(SIGNATURE, cache=True, error_model="numpy")(_motion)


@lru_cache(maxsize=1)
def forces() -> Any:
    """Forces and motion at the true middle, compiled likewise.

    Returns:
        The compiled function, with ``.address``.
    """
    return nb.cfunc(SIGNATURE, cache=True, error_model="numpy")(_forces)
