"""Exact derivatives of torques by the motion, and of accelerations by state and torques, rotors included."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, finite_samples, samples
from drivetrain.dynamics.core.derivatives import derivatives_alone, differentiate
from drivetrain.dynamics.core.packed import Packed, packed
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.mass import CHUNK
from drivetrain.dynamics.samples import NO_TIP, is_one_finite_sample, not_finite_error, run, tip_samples


@dataclass(frozen=True, eq=False)
class TorqueDerivatives:
    """Derivatives of the joint torques (row) by the coordinates (column); one sample has no leading axis.

    Attributes:
        q: By positions [N m/rad; N/m, N m/m, N/rad where joints are prismatic], (N, n, n).
        qd: By speeds [N m s/rad, ...], (N, n, n); twice the Coriolis matrix.
        qdd: By accelerations [kg m^2; kg m and kg where joints are prismatic], (N, n, n): the mass matrix.
    """

    q: Array
    qd: Array
    qdd: Array

    def __repr__(self) -> str:
        return f"TorqueDerivatives(by q, qd, qdd: {' x '.join(map(str, self.q.shape))} each)"


@dataclass(frozen=True, eq=False)
class AccelerationDerivatives:
    """Derivatives of the joint accelerations (row) by the coordinates (column); one sample has no leading axis.

    Attributes:
        q: By positions [1/s^2; 1/(m s^2), m/s^2 where joints are prismatic], (N, n, n).
        qd: By speeds [1/s, ...], (N, n, n).
        tau: By torques [1/(kg m^2), ...], (N, n, n): the inverse of the mass matrix.
    """

    q: Array
    qd: Array
    tau: Array

    def __repr__(self) -> str:
        return f"AccelerationDerivatives(by q, qd, tau: {' x '.join(map(str, self.q.shape))} each)"


def inverse_dynamics_derivatives(arm: Arm, q: Any, qd: Any, qdd: Any, *, tip_wrench: Any = None) -> TorqueDerivatives:
    """The derivatives of ``inverse_dynamics``, rotors included.

    Args:
        arm: With rotors or without.
        q, qd, qdd: Positions, speeds and accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame and carried along with it,
            (moment [N m], force [N]), (6,) or (N, 6). None: nothing.

    Returns:
        The derivatives by q, qd and qdd [N m or N, per unit], (n, n) or (N, n, n) each.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: S. Singh, R. Russell, P. Wensing, Efficient Analytical Derivatives of Rigid-Body Dynamics using Spatial
        Vector Algebra, IEEE Robotics and Automation Letters 7 (2022) 1776-1783, table I; rotors as described in
        ``core/derivatives.py``.
    """
    model = packed(arm)
    if model.spread is None and is_one_finite_sample(arm.n, q, qd, qdd):
        return one_derivatives(model, q, qd, qdd, tip_samples(model, tip_wrench, 1))
    motion = samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    found = derivatives(model, motion, tip=tip_samples(model, tip_wrench, len(motion[0])))
    return found if np.ndim(q) == 2 else TorqueDerivatives(found.q[0], found.qd[0], found.qdd[0])


def forward_dynamics_derivatives(
    arm: Arm, q: Any, qd: Any, tau: Any, *, tip_wrench: Any = None
) -> AccelerationDerivatives:
    """The derivatives of ``forward_dynamics``, rotors included.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tau: Generalised torques, ``ratio_i`` times the torque of motor i [N m; N at a prismatic joint], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame and carried along with it,
            (moment [N m], force [N]), (6,) or (N, 6). None: nothing.

    Returns:
        The derivatives by q, qd and tau [rad/s^2 or m/s^2, per unit], (n, n) or (N, n, n) each.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or a mass matrix that is singular: a joint that moves no inertia.

    Reference: J. Carpentier, N. Mansard, Analytical Derivatives of Rigid Body Dynamics Algorithms, Robotics: Science
        and Systems (2018), section V: ``d qdd = -M^-1 d tau`` at the accelerations that tau gives.
    """
    qdd = forward_dynamics(arm, q, qd, tau, tip_wrench=tip_wrench)
    torques = inverse_dynamics_derivatives(arm, q, qd, qdd, tip_wrench=tip_wrench)
    inverse = np.asarray(np.linalg.inv(torques.qdd), np.float64)
    return AccelerationDerivatives(-inverse @ torques.q, -inverse @ torques.qd, inverse)


def one_derivatives(model: Packed, q: Array, qd: Array, qdd: Array, tip: Array) -> TorqueDerivatives:
    """The derivatives at one valid sample, (n, n) each, of an arm without coupled rotors."""
    n = len(q)
    result = np.empty((3, 1, n, n))
    derivatives_alone(model.arm, q, qd, qdd, tip, result)
    return TorqueDerivatives(result[0, 0], result[1, 0], result[2, 0])


def derivatives(model: Packed, motion: list[Array], *, tip: Array = NO_TIP) -> TorqueDerivatives:
    """The derivatives at samples of valid shape, (N, n, n) each; arguments as in ``samples.run``."""
    wide = motion if model.spread is None else [x @ model.spread.T for x in motion]
    count, n = wide[0].shape
    result = [np.empty((count, n, n)) for _ in range(3)]
    if differentiate(model.links, model.rotors, model.gravity, *wide, tip, *result) != 0.0:
        raise not_finite_error(motion)
    if model.spread is not None:
        result = [model.spread.T @ matrix @ model.spread for matrix in result]
    return TorqueDerivatives(*result)


# The Coriolis matrix and the Christoffel symbols
#
# Entry i of the velocity torques ``h(q, qd)`` is the quadratic form of the symbols ``Gamma_ijk``, symmetric in j and k.
# So the Coriolis matrix is half the derivative of the torques by the speeds, and the form determines the symbols by
# polarisation, ``Gamma(u, v) = (h(u + v) - h(u - v)) / 4``, from the recursion without gravity and accelerations. This
# needs no derivatives and no approximation, and holds for rotors of any kind and at any level.


def coriolis_matrix(arm: Arm, q: Any, qd: Any) -> Array:
    """The matrix C of ``torque = M qdd + C(q, qd) qd + g(q)`` that makes ``dM/dt - 2 C`` skew-symmetric.

    Args:
        arm: With rotors or without; rotors of any kind are included.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        C [kg m^2/s; kg m/s and kg/s where joints are prismatic], (n, n) or (N, n, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.17 to 8.19 and proposition 8.1.
    """
    model = packed(arm)
    if model.spread is None and is_one_finite_sample(arm.n, q, qd, rest := np.zeros(arm.n)):
        return 0.5 * one_derivatives(model, q, qd, rest, NO_TIP).qd
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    result = 0.5 * derivatives(model, [positions, speeds, np.zeros(positions.shape)]).qd
    return result if np.ndim(q) == 2 else result[0]


def christoffel_symbols(arm: Arm, q: Any) -> Array:
    """The Christoffel symbols of the first kind: entry i, j, k is the coefficient of ``qd_j qd_k`` in torque i.

    ``sum over j and k of Gamma_ijk qd_j qd_k`` is the torque of joint i at constant speeds without gravity; the terms
    j = k are centripetal, the others Coriolis terms.

    Args:
        arm: With rotors or without; rotors of any kind are included.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Gamma [kg m^2; kg m and kg where joints are prismatic], (n, n, n) or (N, n, n, n), exactly symmetric in the
        last two indices.

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.16 to 8.18.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    model = packed(arm)
    n, units = arm.n, np.eye(arm.n)
    result = np.empty((len(positions), n, n, n))
    j, k = np.triu_indices(n)
    for first in range(0, len(positions), CHUNK):
        some = slice(first, first + CHUNK)
        pairs = np.swapaxes(_velocity_form(model, positions[some], units[None, j], units[None, k]), 1, 2)
        result[some, :, j, k] = result[some, :, k, j] = pairs
    return result if np.ndim(q) == 2 else result[0]


def _velocity_form(model: Packed, q: Array, u: Array, v: Array) -> Array:
    """Gamma(u, v) for m pairs of speeds per sample, (N, m, n); q is (N, n), u and v broadcast to (N, m, n)."""
    fast, slow = np.broadcast_arrays(u + v, u - v)
    speeds = np.broadcast_to(np.concatenate([fast, slow], axis=1), (len(q), 2 * fast.shape[1], q.shape[1]))
    m = fast.shape[1]
    rows = np.ascontiguousarray(speeds).reshape(-1, q.shape[1])
    motion = (np.repeat(q, 2 * m, axis=0), rows, np.zeros(rows.shape))
    torque = run(model, motion, gravity=np.zeros(3)).reshape(len(q), 2 * m, -1)
    return np.asarray(0.25 * (torque[:, :m] - torque[:, m:]))
