"""Rigid-body algebra: rotations, poses, wrenches, inertia."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.spatial.beams import Beam, box_tube, end_deflection, round_tube
    from drivetrain.spatial.free_body import body_acceleration, body_wrench, free_motion
    from drivetrain.spatial.inertia import RigidBody, combined, cuboid, cylinder, ellipsoid
    from drivetrain.spatial.mesh_inertia import TriangleMesh, mesh_body, read_mesh
    from drivetrain.spatial.poses import adjoint, exp_pose, inverse_pose, log_pose, pose
    from drivetrain.spatial.rotations import exp_rotation, log_rotation, rotation_from_rpy

__getattr__, __dir__ = shown(__name__)
