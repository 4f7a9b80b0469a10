"""What accuracy costs in time: effects, solvers, and the cheapest scene that is good enough."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.accuracy.study_run import simulate

__getattr__, __dir__ = shown(__name__)
