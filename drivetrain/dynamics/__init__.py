"""Algorithms on an arm: inverse and forward dynamics."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.dynamics.book.closed_form import closed_form, mass_matrix_rate
    from drivetrain.dynamics.book.ellipsoids import (
        acceleration_ellipsoid,
        effective_mass,
        tip_acceleration_ellipsoid,
        tip_force_ellipsoid,
        torque_ellipsoid,
    )
    from drivetrain.dynamics.book.ratio_sweep import sweep_ratio
    from drivetrain.dynamics.book.symbolic import symbolic_dynamics
    from drivetrain.dynamics.constrained import (
        constrained_forward_dynamics,
        constrained_inverse_dynamics,
        constraint_projectors,
    )
    from drivetrain.dynamics.constraints import (
        Attachment,
        CallableConstraint,
        ClosingJoint,
        LoopClosure,
        Plane,
        PointOnSurface,
    )
    from drivetrain.dynamics.derivatives import (
        AccelerationDerivatives,
        TorqueDerivatives,
        christoffel_symbols,
        coriolis_matrix,
        forward_dynamics_derivatives,
        inverse_dynamics_derivatives,
    )
    from drivetrain.dynamics.energy import kinetic_energy, potential_energy, power_balance
    from drivetrain.dynamics.flexibility import free_frequencies, locked_frequencies, tip_compliance
    from drivetrain.dynamics.forward import articulated_body, forward_dynamics
    from drivetrain.dynamics.from_positions import torque_from_positions
    from drivetrain.dynamics.inverse import (
        DriveTorques,
        bias_torque,
        drive_torques,
        gravity_torque,
        inverse_dynamics,
        joint_loads,
        tip_torque,
        velocity_torque,
    )
    from drivetrain.dynamics.mass import mass_matrix
    from drivetrain.dynamics.regressor import parameter_names, torque_parameters, torque_regressor
    from drivetrain.dynamics.task_space import (
        BodyTwist,
        Damped,
        Reduced,
        SpaceTwist,
        TipVelocity,
        task_space_dynamics,
    )

__getattr__, __dir__ = shown(__name__)
