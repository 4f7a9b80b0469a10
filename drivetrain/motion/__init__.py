"""Motions over time and the duty cycle they make."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.motion.duty_cycle import Cycle as Cycle
    from drivetrain.motion.duty_cycle import Step as Step
    from drivetrain.motion.duty_cycle import build_cycle as build_cycle
    from drivetrain.motion.mix import build_mix as build_mix
    from drivetrain.motion.motion import LoadTable as LoadTable
    from drivetrain.motion.motion import Motion as Motion
    from drivetrain.motion.point_to_point import MotionLimits as MotionLimits
    from drivetrain.motion.point_to_point import waypoint_motion as waypoint_motion
    from drivetrain.motion.point_to_point import waypoints as waypoints
    from drivetrain.motion.profiles import Quintic as Quintic
    from drivetrain.motion.profiles import SCurve as SCurve
    from drivetrain.motion.profiles import Trapezoid as Trapezoid
    from drivetrain.motion.read import read_load_table as read_load_table
    from drivetrain.motion.read import read_motion as read_motion
    from drivetrain.motion.recording import MeasuredMotion as MeasuredMotion
    from drivetrain.motion.recording import read_recording as read_recording

__getattr__, __dir__ = shown(__name__)
