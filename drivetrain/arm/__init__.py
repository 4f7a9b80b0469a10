"""The arm as data, its kinematics, and the files from which it is read."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.arm.arm import Arm
    from drivetrain.arm.bodies import on_external_axes, on_moving_base, with_body, with_payload
    from drivetrain.arm.builtin import builtin_names
    from drivetrain.arm.closures import Closure, LoopLink, with_closures
    from drivetrain.arm.coupling import belts_over, differential, rotor_turns, with_coupling
    from drivetrain.arm.dh import DHConvention, DHRow, JointKind, arm_from_dh
    from drivetrain.arm.files.load import load_arm
    from drivetrain.arm.flexible_links import BendingLink, with_flexible_links
    from drivetrain.arm.geared import at_level, with_rotors
    from drivetrain.arm.kinematics import (
        body_jacobian,
        body_jacobian_rate,
        link_poses,
        space_jacobian,
        space_jacobian_rate,
        tip_acceleration_terms,
        tip_pose,
    )
    from drivetrain.arm.lists import book_lists
    from drivetrain.arm.pose_solver import inverse_kinematics
    from drivetrain.arm.rotors import Rotor, RotorLevel
    from drivetrain.arm.tool_moves import Move, ToolLimits, tool_motion

__getattr__, __dir__ = shown(__name__)
