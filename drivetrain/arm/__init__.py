"""The arm as data, where it is when its joints move, and the files it comes from."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.arm.arm import Arm as Arm
    from drivetrain.arm.bodies import on_external_axes as on_external_axes
    from drivetrain.arm.bodies import on_moving_base as on_moving_base
    from drivetrain.arm.bodies import with_body as with_body
    from drivetrain.arm.bodies import with_payload as with_payload
    from drivetrain.arm.builtin import builtin_names as builtin_names
    from drivetrain.arm.closures import Closure as Closure
    from drivetrain.arm.closures import LoopLink as LoopLink
    from drivetrain.arm.closures import with_closures as with_closures
    from drivetrain.arm.coupling import belts_over as belts_over
    from drivetrain.arm.coupling import differential as differential
    from drivetrain.arm.coupling import rotor_turns as rotor_turns
    from drivetrain.arm.coupling import with_coupling as with_coupling
    from drivetrain.arm.dh import DHConvention as DHConvention
    from drivetrain.arm.dh import DHRow as DHRow
    from drivetrain.arm.dh import JointKind as JointKind
    from drivetrain.arm.dh import arm_from_dh as arm_from_dh
    from drivetrain.arm.files.load import load_arm as load_arm
    from drivetrain.arm.flexible_links import BendingLink as BendingLink
    from drivetrain.arm.flexible_links import with_flexible_links as with_flexible_links
    from drivetrain.arm.geared import at_level as at_level
    from drivetrain.arm.geared import with_rotors as with_rotors
    from drivetrain.arm.kinematics import body_jacobian as body_jacobian
    from drivetrain.arm.kinematics import body_jacobian_rate as body_jacobian_rate
    from drivetrain.arm.kinematics import link_poses as link_poses
    from drivetrain.arm.kinematics import space_jacobian as space_jacobian
    from drivetrain.arm.kinematics import space_jacobian_rate as space_jacobian_rate
    from drivetrain.arm.kinematics import tip_acceleration_terms as tip_acceleration_terms
    from drivetrain.arm.kinematics import tip_pose as tip_pose
    from drivetrain.arm.lists import book_lists as book_lists
    from drivetrain.arm.pose_solver import inverse_kinematics as inverse_kinematics
    from drivetrain.arm.rotors import Rotor as Rotor
    from drivetrain.arm.rotors import RotorLevel as RotorLevel
    from drivetrain.arm.tool_moves import Move as Move
    from drivetrain.arm.tool_moves import ToolLimits as ToolLimits
    from drivetrain.arm.tool_moves import tool_motion as tool_motion

__getattr__, __dir__ = shown(__name__)
