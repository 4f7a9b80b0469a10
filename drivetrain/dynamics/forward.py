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
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.mass import mass_matrices, no_inertia_error
from drivetrain.dynamics.samples import NO_TIP, is_one_finite_sample, run, tip_samples
from drivetrain.errors import Fault, InputError


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
        _, joint = articulated_accelerations(model.arm, positions, speeds, torques, tip, accelerations)
        if joint < 0 and np.isfinite(accelerations).all():
            return accelerations if np.ndim(q) == 2 else accelerations[0]
    # A chain comes here, too, if a joint moves no inertia: the mass matrix names the first one from the base.
    accelerations = torques - run(model, (positions, speeds, np.zeros(positions.shape)), tip=tip)
    matrices = mass_matrices(model, positions)
    sample, joint = solve(matrices, accelerations)
    if joint >= 0:
        where = f" at sample {sample}" if np.ndim(q) == 2 else ""
        raise no_inertia_error(arm, joint, f"{where}: the mass matrix is singular there, accelerations are not defined")
    if not np.isfinite(accelerations).all():
        worst = int(np.argwhere(~np.isfinite(accelerations))[0][1])
        problem = "its acceleration is not finite: q, qd, tau or tip_wrench is too large to calculate with"
        raise InputError(Fault(f"joint {arm.joint_names[worst]!r}", problem))
    return accelerations if np.ndim(q) == 2 else accelerations[0]


articulated_body = forward_dynamics  # the book's name for it


def unchecked_accelerations(arm: Arm) -> Callable[[Array, Array, Array], Array]:
    """A function for solvers that computes ``forward_dynamics`` for one sample without checks, in a third of the time.

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
            raise no_inertia_error(arm, joint, ": accelerations are not defined there")
        return result

    return accelerations if model.chained else by_mass_matrix
