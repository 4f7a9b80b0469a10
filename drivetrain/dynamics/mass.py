"""The mass matrix of one or many samples by composite bodies, and its factors: ``M = L L^T``.

Measured on a UR5 with 20 000 samples: 0.10 us per sample, against 0.57 column by column from inverse dynamics.
Its inverse is never computed. Quantities such as ``M^-1 A^T`` and ``(A M^-1 A^T)^-1`` are products of L, of
``W = L^-1 A^T`` and of the singular values of W. Near a singularity the error is that of one division by a small
singular value, while ``inv(A inv(M) A^T)`` divides by its square.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, finite_samples
from drivetrain.dynamics.core.composite import compose
from drivetrain.dynamics.core.factor import factorise
from drivetrain.dynamics.core.packed import Packed, packed
from drivetrain.errors import Fault, InputError

CHUNK = 2048  # samples per block: bounds the memory of functions that need n or more recursions per sample


def mass_matrix(arm: Arm, q: Any) -> Array:
    """The matrix M of ``torque = M(q) qdd + ...``, rotors included.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        M [kg m^2; kg m and kg where joints are prismatic], (n, n) or (N, n, n), exactly symmetric. Row i belongs to
        ``ratio_i`` times the torque of motor i, or for coupled motors to row i of ``N^T`` times the motor torques.

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.13 (the sum of equation 8.57, over composite bodies), with the rotors of
        section 8.9.3.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    result = mass_matrices(packed(arm), positions)
    return result if np.ndim(q) == 2 else result[0]


def mass_matrices(model: Packed, q: Array) -> Array:
    """Mass matrices at valid samples, (N, n, n), exactly symmetric."""
    wide = q if model.spread is None else q @ model.spread.T
    count, n = wide.shape
    result = np.empty((count, n, n))
    if compose(model.links, model.rotors, wide, result) != 0.0:
        raise InputError(Fault("q", "is too large to calculate with", float(np.abs(q).max())))
    if model.spread is None:
        return result
    # Without the separate rows of the substitute joints of coupled rotors.
    result = model.spread.T @ (result @ model.spread)
    return np.asarray(0.5 * (result + np.swapaxes(result, 1, 2)))


def mass_factor(arm: Arm, q: Array) -> Array:
    """The factor L of the mass matrix, lower triangular, (N, n, n) [kg^(1/2) m; kg^(1/2) at prismatic joints]."""
    factors = mass_matrix(arm, q)
    sample, joint = factorise(factors)
    if joint >= 0:
        raise no_inertia_error(arm, joint, f" at sample {sample}: the mass matrix is singular there")
    return factors


def no_inertia_error(arm: Arm, joint: int, where: str) -> InputError:
    hint = "give the links from this joint on mass and inertia, or the joint a rotor"
    return InputError(Fault(f"joint {arm.joint_names[joint]!r}", f"moves no inertia of its own{where}", None, hint))


def solve_lower(factors: Array, columns: Array) -> Array:
    """``L^-1 B``, from L (N, n, n) and B (N, n, k)."""
    return _substitute(factors, columns, range(factors.shape[1]))


def solve_upper(factors: Array, columns: Array) -> Array:
    """``L^-T B``, from L (N, n, n) and B (N, n, k)."""
    return _substitute(np.swapaxes(factors, 1, 2), columns, range(factors.shape[1] - 1, -1, -1))


def _substitute(factors: Array, columns: Array, order: Any) -> Array:
    """Solve a triangular system row by row in the given order."""
    result = np.zeros(columns.shape)
    for i in order:  # rows that are not solved yet are still zero
        known = (factors[:, i : i + 1] @ result)[:, 0]
        result[:, i] = (columns[:, i] - known) / factors[:, i, i, None]
    return result
