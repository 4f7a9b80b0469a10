"""Motions over time, and the duty cycle made of them."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.motion.duty_cycle import Cycle, Step, build_cycle, build_mix
    from drivetrain.motion.motion import LoadTable, Motion
    from drivetrain.motion.point_to_point import MotionLimits, waypoint_motion, waypoints
    from drivetrain.motion.profiles import Quintic, SCurve, Trapezoid
    from drivetrain.motion.read import read_load_table, read_motion
    from drivetrain.motion.recording import MeasuredMotion, read_recording

__getattr__, __dir__ = shown(__name__)
