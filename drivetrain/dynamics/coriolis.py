"""The Coriolis matrix of Christoffel symbols, out of the recursion alone.

The recursion without gravity and accelerations gives ``h(q, qd)``, whose entry i is the quadratic form of the symbols
``Gamma_ijk``. They are symmetric in j and k, so the form determines them: column j of C is ``Gamma(e_j, qd)``, by
polarisation ``(h(qd + s e_j) - h(qd - s e_j)) / (4 s)``, for any s; the size of qd keeps the most digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.doors import finite_samples, run
from drivetrain.dynamics.mass_matrix import CHUNK
from drivetrain.dynamics.packed import Packed, packed


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
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    model = packed(arm)
    result = np.empty((*positions.shape, arm.n))
    for first in range(0, len(positions), CHUNK):
        some = slice(first, first + CHUNK)
        result[some] = _symbols_times(model, positions[some], speeds[some])
    return result if np.ndim(q) == 2 else result[0]


def _symbols_times(model: Packed, q: Array, qd: Array) -> Array:
    count, n = q.shape
    size = np.sqrt(np.sum(qd * qd, axis=1))
    size[size == 0.0] = 1.0
    steps = size[:, None, None] * np.eye(n)
    speeds = np.concatenate([qd[:, None] + steps, qd[:, None] - steps], axis=1).reshape(-1, n)
    motion = (np.repeat(q, 2 * n, axis=0), speeds, np.zeros(speeds.shape))
    torque = run(model, motion, gravity=np.zeros(3)).reshape(count, 2, n, n)
    columns = (torque[:, 0] - torque[:, 1]) / (4.0 * size[:, None, None])
    return np.swapaxes(columns, 1, 2)
