"""Identification of an arm from recordings: parameters, their uncertainty, and the errors on unseen data."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.identification.exciting import exciting_motion
    from drivetrain.identification.fit import Identification, identify
    from drivetrain.identification.outputs import write_identification

__getattr__, __dir__ = shown(__name__)
