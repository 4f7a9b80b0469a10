"""Motor currents for a real-time controller, computed tick by tick, in Python and in C."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.control.c_code import write_c
    from drivetrain.control.commander import Commander

__getattr__, __dir__ = shown(__name__)
