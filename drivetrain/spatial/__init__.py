"""Rigid-body algebra: rotations, poses, wrenches, inertia."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.spatial.beams import Beam as Beam
    from drivetrain.spatial.beams import box_tube as box_tube
    from drivetrain.spatial.beams import end_deflection as end_deflection
    from drivetrain.spatial.beams import round_tube as round_tube
    from drivetrain.spatial.free_body import body_acceleration as body_acceleration
    from drivetrain.spatial.free_body import body_wrench as body_wrench
    from drivetrain.spatial.free_body import free_motion as free_motion
    from drivetrain.spatial.inertia import RigidBody as RigidBody
    from drivetrain.spatial.inertia import combined as combined
    from drivetrain.spatial.inertia import cuboid as cuboid
    from drivetrain.spatial.inertia import cylinder as cylinder
    from drivetrain.spatial.inertia import ellipsoid as ellipsoid
    from drivetrain.spatial.mesh_inertia import TriangleMesh as TriangleMesh
    from drivetrain.spatial.mesh_inertia import mesh_body as mesh_body
    from drivetrain.spatial.mesh_inertia import read_mesh as read_mesh
    from drivetrain.spatial.poses import adjoint as adjoint
    from drivetrain.spatial.poses import exp_pose as exp_pose
    from drivetrain.spatial.poses import inverse_pose as inverse_pose
    from drivetrain.spatial.poses import log_pose as log_pose
    from drivetrain.spatial.poses import pose as pose
    from drivetrain.spatial.rotations import exp_rotation as exp_rotation
    from drivetrain.spatial.rotations import log_rotation as log_rotation
    from drivetrain.spatial.rotations import rotation_from_rpy as rotation_from_rpy

__getattr__, __dir__ = shown(__name__)
