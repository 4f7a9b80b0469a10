"""From a recording to the arm that made it: parameters, how sure they are, and what they explain of unseen data."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.identification.exciting import exciting_motion
    from drivetrain.identification.fit import Identification, identify
    from drivetrain.identification.outputs import write_identification

__getattr__, __dir__ = shown(__name__)
