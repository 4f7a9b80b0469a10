"""The Coriolis matrix and the Christoffel symbols.

Entry i of the velocity torques ``h(q, qd)`` is the quadratic form of the symbols ``Gamma_ijk``, symmetric in j and k.
So the Coriolis matrix is half the derivative of the torques by the speeds, and the form determines the symbols: by
polarisation ``Gamma(u, v) = (h(u + v) - h(u - v)) / 4``, from the recursion without gravity and accelerations, with no
derivative taken and nothing neglected, and with rotors of any kind and at any level.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, finite_samples
from drivetrain.dynamics.core.packed import Packed, packed
from drivetrain.dynamics.derivatives import derivatives, one_derivatives
from drivetrain.dynamics.mass import CHUNK
from drivetrain.dynamics.samples import NO_TIP, alone_within_reach, run


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
    if model.spread is None and alone_within_reach(arm.n, q, qd, rest := np.zeros(arm.n)):
        return 0.5 * one_derivatives(model, q, qd, rest, NO_TIP).qd
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    result = 0.5 * derivatives(model, [positions, speeds, np.zeros(positions.shape)]).qd
    return result if np.ndim(q) == 2 else result[0]


def christoffel_symbols(arm: Arm, q: Any) -> Array:
    """The Christoffel symbols of the first kind: entry i, j, k is what speeds of joints j and k ask of joint i.

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
    """Gamma(u, v) of m pairs of speeds a sample, (N, m, n); q is (N, n), u and v fit to (N, m, n)."""
    fast, slow = np.broadcast_arrays(u + v, u - v)
    speeds = np.broadcast_to(np.concatenate([fast, slow], axis=1), (len(q), 2 * fast.shape[1], q.shape[1]))
    m = fast.shape[1]
    rows = np.ascontiguousarray(speeds).reshape(-1, q.shape[1])
    motion = (np.repeat(q, 2 * m, axis=0), rows, np.zeros(rows.shape))
    torque = run(model, motion, gravity=np.zeros(3)).reshape(len(q), 2 * m, -1)
    return np.asarray(0.25 * (torque[:, :m] - torque[:, m:]))
