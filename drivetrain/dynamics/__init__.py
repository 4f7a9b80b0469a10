"""Algorithms on an arm: inverse and forward dynamics."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.dynamics.book.closed_form import closed_form as closed_form
    from drivetrain.dynamics.book.closed_form import mass_matrix_rate as mass_matrix_rate
    from drivetrain.dynamics.book.ellipsoids import acceleration_ellipsoid as acceleration_ellipsoid
    from drivetrain.dynamics.book.ellipsoids import effective_mass as effective_mass
    from drivetrain.dynamics.book.ellipsoids import tip_acceleration_ellipsoid as tip_acceleration_ellipsoid
    from drivetrain.dynamics.book.ellipsoids import tip_force_ellipsoid as tip_force_ellipsoid
    from drivetrain.dynamics.book.ellipsoids import torque_ellipsoid as torque_ellipsoid
    from drivetrain.dynamics.book.ratio_sweep import sweep_ratio as sweep_ratio
    from drivetrain.dynamics.book.symbolic import symbolic_dynamics as symbolic_dynamics
    from drivetrain.dynamics.constrained import constrained_forward_dynamics as constrained_forward_dynamics
    from drivetrain.dynamics.constrained import constrained_inverse_dynamics as constrained_inverse_dynamics
    from drivetrain.dynamics.constrained import constraint_projectors as constraint_projectors
    from drivetrain.dynamics.constraints import Attachment as Attachment
    from drivetrain.dynamics.constraints import ClosingJoint as ClosingJoint
    from drivetrain.dynamics.constraints import LoopClosure as LoopClosure
    from drivetrain.dynamics.constraints import Plane as Plane
    from drivetrain.dynamics.constraints import PointOnSurface as PointOnSurface
    from drivetrain.dynamics.coriolis import christoffel_symbols as christoffel_symbols
    from drivetrain.dynamics.coriolis import coriolis_matrix as coriolis_matrix
    from drivetrain.dynamics.derivatives import AccelerationDerivatives as AccelerationDerivatives
    from drivetrain.dynamics.derivatives import TorqueDerivatives as TorqueDerivatives
    from drivetrain.dynamics.derivatives import forward_dynamics_derivatives as forward_dynamics_derivatives
    from drivetrain.dynamics.derivatives import inverse_dynamics_derivatives as inverse_dynamics_derivatives
    from drivetrain.dynamics.energy import kinetic_energy as kinetic_energy
    from drivetrain.dynamics.energy import potential_energy as potential_energy
    from drivetrain.dynamics.energy import power_balance as power_balance
    from drivetrain.dynamics.flexibility import free_frequencies as free_frequencies
    from drivetrain.dynamics.flexibility import locked_frequencies as locked_frequencies
    from drivetrain.dynamics.flexibility import tip_compliance as tip_compliance
    from drivetrain.dynamics.forward import articulated_body as articulated_body
    from drivetrain.dynamics.forward import forward_dynamics as forward_dynamics
    from drivetrain.dynamics.from_positions import torque_from_positions as torque_from_positions
    from drivetrain.dynamics.inverse import DriveTorques as DriveTorques
    from drivetrain.dynamics.inverse import bias_torque as bias_torque
    from drivetrain.dynamics.inverse import drive_torques as drive_torques
    from drivetrain.dynamics.inverse import gravity_torque as gravity_torque
    from drivetrain.dynamics.inverse import inverse_dynamics as inverse_dynamics
    from drivetrain.dynamics.inverse import joint_loads as joint_loads
    from drivetrain.dynamics.inverse import tip_torque as tip_torque
    from drivetrain.dynamics.inverse import velocity_torque as velocity_torque
    from drivetrain.dynamics.mass import mass_matrix as mass_matrix
    from drivetrain.dynamics.regressor import parameter_names as parameter_names
    from drivetrain.dynamics.regressor import torque_parameters as torque_parameters
    from drivetrain.dynamics.regressor import torque_regressor as torque_regressor
    from drivetrain.dynamics.task_space import task_space_dynamics as task_space_dynamics

__getattr__, __dir__ = shown(__name__)
