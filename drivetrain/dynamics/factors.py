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
from drivetrain.dynamics.core.factor import factorise
from drivetrain.dynamics.mass_matrix import mass_matrix
from drivetrain.errors import Fault, InputError


def mass_factor(arm: Arm, q: Array) -> Array:
    """The factor L of the mass matrix, lower triangular, (N, n, n) [kg^(1/2) m; kg^(1/2) at prismatic joints].

    Args:
        q: Positions [rad or m], (N, n).

    Raises:
        InputError: The mass matrix is singular: a joint moves no inertia.
    """
    factors = mass_matrix(arm, q)
    sample, joint = factorise(factors)
    if joint >= 0:
        raise no_inertia(arm, joint, f" at sample {sample}: the mass matrix is singular there")
    return factors


def no_inertia(arm: Arm, joint: int, where: str) -> InputError:
    """The complaint about a joint that moves no inertia, with where that is and what it means."""
    hint = "give the links from this joint on mass and inertia, or the joint a rotor"
    return InputError(Fault(f"joint {arm.joint_names[joint]!r}", f"moves no inertia of its own{where}", None, hint))


def solve_lower(factors: Array, columns: Array) -> Array:
    """``L^-1 B``, from L (N, n, n) and B (N, n, k)."""
    return _substitute(factors, columns, range(factors.shape[1]))


def solve_upper(factors: Array, columns: Array) -> Array:
    """``L^-T B``, from L (N, n, n) and B (N, n, k)."""
    return _substitute(np.swapaxes(factors, 1, 2), columns, range(factors.shape[1] - 1, -1, -1))


def _substitute(factors: Array, columns: Array, order: Any) -> Array:
    """Solve a triangular system row by row, in the order in which rows are known."""
    result = np.zeros(columns.shape)
    for i in order:  # rows that are not known yet are still zero
        known = (factors[:, i : i + 1] @ result)[:, 0]
        result[:, i] = (columns[:, i] - known) / factors[:, i, i, None]
    return result
