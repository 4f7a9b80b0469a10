"""Steppers for y' = f(t, y) behind one interface, and the loop that drives them."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.solvers.solver import DormandPrince853 as DormandPrince853
    from drivetrain.solvers.solver import Euler as Euler
    from drivetrain.solvers.solver import Rodas4 as Rodas4
    from drivetrain.solvers.solver import Rodas5P as Rodas5P
    from drivetrain.solvers.solver import RungeKutta4 as RungeKutta4
    from drivetrain.solvers.solver import SemiImplicitEuler as SemiImplicitEuler

__getattr__, __dir__ = shown(__name__)
