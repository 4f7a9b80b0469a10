"""The equations of motion as two compiled functions with addresses, so that every engine shares them.

Both look like an effect's law from outside (``effects/effect.py``): ``motion`` finds the change of speeds, ``forces``
what follows from it. With h = 0 they are at an instant, where the changes are accelerations; ``theta`` of a step stands
in the numbers.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba as nb

from drivetrain.compile_ahead import take
from drivetrain.compiled_parts import CompiledWhole
from drivetrain.effects.effect import SIGNATURE
from drivetrain.simulation import fields as f
from drivetrain.simulation.equations_kernel import solve_instant, solve_step
from drivetrain.simulation.forces_kernel import tell_energies, tell_forces

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "simulation/calls.py": 1418883735, "simulation/equations_kernel.py": 1379456263, "simulation/fields.py": 1281845940,
    "simulation/forces_kernel.py": 3054532781, "simulation/friction_kernel.py": 4042368809,
    "simulation/tip_kernel.py": 2653406141,
    "dynamics/compiled_vectors.py": 1749102823, "dynamics/passes.py": 98651109,
    "dynamics/mass_and_bias.py": 728731785,
    "simulation/assembly_kernel.py": 4181047817, "simulation/coupled_kernel.py": 418507940,
    "simulation/settle_kernel.py": 3817236384, "simulation/vector_rows.py": 4108182124,
}  # fmt: skip


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
    take(f"{__name__}:motion")
    return nb.cfunc(SIGNATURE, cache=True, error_model="numpy", pipeline_class=CompiledWhole)(_motion)


@lru_cache(maxsize=1)
def forces() -> Any:
    """Forces and motion at the true middle, compiled likewise."""
    take(f"{__name__}:forces")
    return nb.cfunc(SIGNATURE, cache=True, error_model="numpy", pipeline_class=CompiledWhole)(_forces)
