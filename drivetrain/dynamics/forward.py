"""Forward dynamics: accelerations due to torques, by articulated bodies or from the mass matrix.

The articulated-body algorithm costs n, the mass matrix n^2 to fill and n^3 to factor; on long chains it loses digits by
its condition number, which grows as n^4. Articulated bodies apply to chains: rotors that follow several joints, or are
carried by a link not adjacent to their joint, form loops, and such arms use the mass matrix.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 7; rotors as described in
    ``core/articulated.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, finite_samples
from drivetrain.dynamics.core.articulated import accelerations_alone, articulated_accelerations
from drivetrain.dynamics.core.factor import solve
from drivetrain.dynamics.core.packed import Packed, packed
from drivetrain.dynamics.mass import mass_matrices, no_inertia_error
from drivetrain.dynamics.samples import NO_TIP, is_one_finite_sample, run, tip_samples
from drivetrain.errors import Fault, InputError

UNDEFINED = ": accelerations are not defined there"


def forward_dynamics(arm: Arm, q: Any, qd: Any, tau: Any, *, tip_wrench: Any = None) -> Array:
    """The accelerations due to generalised joint torques.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tau: Generalised torques, ``ratio_i`` times the torque of motor i [N m; N at a prismatic joint], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Accelerations [rad/s^2 or m/s^2], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or a mass matrix that is singular: a joint that moves no inertia.

    Reference: Modern Robotics, equation 8.81.
    """
    model = packed(arm)
    if model.chained and is_one_finite_sample(arm.n, q, qd, tau):
        found, tip = np.empty(arm.n), tip_samples(model, tip_wrench, 1)
        joint = accelerations_alone(model.arm, q, qd, tau, tip, found)
        if joint < 0 and found.dot(found) < np.inf:
            return found
    positions, speeds, torques = finite_samples(arm.n, {"q": q, "qd": qd, "tau": tau})
    tip, accelerations = tip_samples(model, tip_wrench, len(positions)), np.empty(positions.shape)
    if model.chained:
        _, joint = _by_articulated_bodies(model, (positions, speeds, torques), tip, accelerations)
        if joint < 0 and np.isfinite(accelerations).all():
            return accelerations if np.ndim(q) == 2 else accelerations[0]
    # A chain comes here, too, if a joint moves no inertia: the mass matrix names the first one from the base.
    accelerations = torques - run(model, (positions, speeds, np.zeros(positions.shape)), tip=tip)
    matrices = mass_matrices(model, positions)
    sample, joint = solve(matrices, accelerations)
    if joint >= 0:
        where = f" at sample {sample}" if np.ndim(q) == 2 else ""
        raise no_inertia_error(arm, joint, f"{where}: the mass matrix is singular there, accelerations are not defined")
    return accelerations if np.ndim(q) == 2 else accelerations[0]


def articulated_body(arm: Arm, q: Any, qd: Any, tau: Any, *, tip_wrench: Any = None) -> Array:
    """The accelerations due to generalised joint torques, without the mass matrix.

    Args:
        arm: With rotors or without, at any level.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tau: Generalised torques, ``ratio_i`` times the torque of motor i [N m; N at a prismatic joint], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Accelerations [rad/s^2 or m/s^2], (n,) or (N, n), equal to those of ``forward_dynamics`` to rounding.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, numbers too large to calculate with, or a joint that moves no
            inertia while the joints after it are free.

    Reference: Modern Robotics, section 8.5; Featherstone (2008), table 7.1.
    """
    positions, speeds, torques = finite_samples(arm.n, {"q": q, "qd": qd, "tau": tau})
    model = packed(arm)
    if not model.chained:
        return forward_dynamics(arm, q, qd, tau, tip_wrench=tip_wrench)
    tip = tip_samples(model, tip_wrench, len(positions))
    result = np.empty(positions.shape)
    sample, joint = _by_articulated_bodies(model, (positions, speeds, torques), tip, result)
    if joint >= 0 or not np.isfinite(result).all():
        where = f" at sample {sample}" if np.ndim(q) == 2 else ""
        raise _too_large(arm, result) if joint < 0 else no_inertia_error(arm, joint, f"{where}{UNDEFINED}")
    return result if np.ndim(q) == 2 else result[0]


def unchecked_accelerations(arm: Arm) -> Callable[[Array, Array, Array], Array]:
    """A function for solvers that computes ``articulated_body`` for one sample without checks, in a third of the time.

    Its arguments are q, qd and tau [rad or m, per s, N m or N], contiguous float64, (n,); it returns accelerations
    [rad/s^2 or m/s^2], (n,), which are not finite if the input is not.
    """
    model, n = packed(arm), arm.n

    def by_mass_matrix(q: Array, qd: Array, tau: Array) -> Array:
        finite = all(np.isfinite(values).all() for values in (q, qd, tau))
        return forward_dynamics(arm, q, qd, tau) if finite else np.full(n, np.nan)

    def accelerations(q: Array, qd: Array, tau: Array) -> Array:
        result = np.empty(n)
        joint = accelerations_alone(model.arm, q, qd, tau, NO_TIP, result)
        if joint >= 0 and np.isfinite(result).all():
            raise no_inertia_error(arm, joint, UNDEFINED)
        return result

    return accelerations if model.chained else by_mass_matrix


def _by_articulated_bodies(
    model: Packed, motion: tuple[Array, Array, Array], tip: Array, result: Array
) -> tuple[int, int]:
    """Fill the accelerations; returns sample and joint of the first joint that moves no inertia, or -1 and -1."""
    if len(result) != 1:
        return articulated_accelerations(model.arm, *motion, tip, result)
    q, qd, tau = motion
    joint = accelerations_alone(model.arm, q[0], qd[0], tau[0], tip, result[0])
    return 0 if joint >= 0 else -1, joint


def _too_large(arm: Arm, result: Array) -> InputError:
    joint = int(np.argwhere(~np.isfinite(result))[0][1])
    problem = "its acceleration is not finite: q, qd, tau or tip_wrench is too large to calculate with"
    return InputError(Fault(f"joint {arm.joint_names[joint]!r}", problem))
