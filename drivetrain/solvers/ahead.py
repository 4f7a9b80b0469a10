"""The compiled loop of the adaptive solver, compiled before it is needed: see ``compile_ahead.py``."""

from __future__ import annotations

from typing import Any

from drivetrain.solvers.compiled_function import compiled
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.rosenbrock import Rodas5P

STEPS = ("drivetrain.solvers.ahead:compile_solver",)


def _falls(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    result[0] = -x[0]


def compile_solver() -> None:
    """Have loop and step compiled, if they are not in the disk cache: they are used once."""
    integrate_compiled(CompiledProblem(compiled(_falls), 1), Rodas5P(), [1.0], [0.0, 1e-3])
