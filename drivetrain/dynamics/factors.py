"""The mass matrix and what it carries to, by factors: ``M = L L^T``, never an inverse.

What is asked of M here always has the form ``M^-1 A^T``, ``A M^-1 A^T`` or its inverse. With ``W = L^-1 A^T`` and the
singular values of W all of them are products of factors, and no matrix is inverted twice: near a singularity the error
is that of one division by a small singular value, where ``inv(A inv(M) A^T)`` divides by its square.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.mass_matrix import mass_matrix
from drivetrain.errors import Fault, InputError

SINGULAR = 1e-12  # of a joint's inertia, left when the joints before it give way; rounding leaves 1e-15 of none


def mass_factor(arm: Arm, q: Array) -> Array:
    """The factor L of the mass matrix, ``M = L L^T``.

    Args:
        q: Positions [rad or m], (N, n).

    Returns:
        Lower triangular, (N, n, n), [kg^(1/2) m; kg^(1/2) at prismatic joints].

    Raises:
        InputError: The mass matrix is singular: a joint moves no inertia.
    """
    matrices = mass_matrix(arm, q)
    diagonal = np.diagonal(matrices, axis1=1, axis2=2)
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    try:
        factors = np.linalg.cholesky(matrices / (scale[:, :, None] * scale[:, None, :]))
    except np.linalg.LinAlgError:
        factors = np.zeros(matrices.shape)
    pivots = np.diagonal(factors, axis1=1, axis2=2) ** 2
    if not (pivots > SINGULAR).all():
        raise _singular(arm, matrices, diagonal)
    return np.asarray(factors * scale[:, :, None])


def solve_lower(factors: Array, columns: Array) -> Array:
    """``L^-1 B``.

    Args:
        factors: L, (N, n, n).
        columns: B, (N, n, k).

    Returns:
        (N, n, k), in the units of B over those of L.
    """
    return _substitute(factors, columns, range(factors.shape[1]))


def solve_upper(factors: Array, columns: Array) -> Array:
    """``L^-T B``.

    Args:
        factors: L, (N, n, n).
        columns: B, (N, n, k).

    Returns:
        (N, n, k), in the units of B over those of L.
    """
    return _substitute(np.swapaxes(factors, 1, 2), columns, range(factors.shape[1] - 1, -1, -1))


def _substitute(factors: Array, columns: Array, order: Any) -> Array:
    """Solve a triangular system row by row, in the order in which rows are known."""
    result = np.zeros(columns.shape)
    for i in order:  # rows that are not known yet are still zero
        known = (factors[:, i : i + 1] @ result)[:, 0]
        result[:, i] = (columns[:, i] - known) / factors[:, i, i, None]
    return result


def _singular(arm: Arm, matrices: Array, diagonal: Array) -> InputError:
    """Which joint it is, found with the care that the fast road has no time for."""
    for sample, matrix in enumerate(matrices):
        if not (diagonal[sample] > 0.0).all():
            joint = int(np.flatnonzero(~(diagonal[sample] > 0.0))[0])
            break
        whole = matrix / np.sqrt(np.outer(diagonal[sample], diagonal[sample]))
        # What joint j moves when those before it give way: a Schur complement.
        left = [whole[j, j] - _explained(whole, j) for j in range(len(matrix))]
        if min(left) <= SINGULAR * 10.0:
            joint = int(np.flatnonzero(np.array(left) <= SINGULAR * 10.0)[0])
            break
    else:
        sample, joint = 0, arm.n - 1
    problem = f"moves no inertia of its own at sample {sample}: the mass matrix is singular there"
    hint = "give the links from this joint on mass and inertia, or the joint a rotor"
    return InputError(Fault(f"joint {arm.joint_names[joint]!r}", problem, None, hint))


def _explained(matrix: Array, joint: int) -> float:
    if joint == 0:
        return 0.0
    row = matrix[joint, :joint]
    return float(row @ np.linalg.lstsq(matrix[:joint, :joint], row, rcond=None)[0])
