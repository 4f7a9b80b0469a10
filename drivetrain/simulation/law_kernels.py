"""The equations of motion as two compiled functions with addresses, so that every engine shares them.

Both look like an effect's law from outside (``effects/effect.py``): ``motion`` finds the change of speeds, ``forces``
what follows from it. With h = 0 they are at an instant, where the changes are accelerations; ``theta`` of a step stands
in the numbers.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from drivetrain.effects.effect import SIGNATURE
from drivetrain.jit import callback
from drivetrain.simulation import fields as f
from drivetrain.simulation.equations_kernel import solve_instant, solve_step
from drivetrain.simulation.forces_kernel import tell_energies, tell_forces


def _motion(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    if h > 0.0:
        words[f.SOLVED] = solve_step(numbers, words, t, h, numbers[words[f.AT_THETA]], rates)
    else:
        words[f.SOLVED] = solve_instant(numbers, words, t, rates)


def _forces(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    theta = numbers[words[f.AT_THETA]]
    if h > 0.0:
        tell_forces(numbers, words, h, theta, theta * h)
    else:
        tell_forces(numbers, words, 1.0, 0.0, 0.0)
        tell_energies(numbers, words)


@lru_cache(maxsize=1)
def motion() -> Any:
    """The change of speeds, compiled at the first call (some seconds) or taken from numba's disk cache."""
    return callback(SIGNATURE, _motion)


@lru_cache(maxsize=1)
def forces() -> Any:
    """Forces and motion at the true middle, compiled likewise."""
    return callback(SIGNATURE, _forces)
