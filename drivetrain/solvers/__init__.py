"""Numerical integration of y' = f(t, y): methods with their settings, and the integration loops with events."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.solvers.solver import DormandPrince853, Euler, Rodas4, Rodas5P, RungeKutta4, SemiImplicitEuler

__getattr__, __dir__ = shown(__name__)
