"""Accuracy and computing time of effects and solvers, and the choice of the cheapest scene within a tolerance."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.accuracy.study_run import simulate

__getattr__, __dir__ = shown(__name__)
