"""Parameters that a body can have: positive mass, and moments that satisfy the triangle inequality.

Both hold when the pseudo-inertia ``[[S, h], [h, m]]``, S the second moments, is positive definite; written as ``L L^T``
it always is, whatever L.

Reference: P. Wensing, S. Kim, J.-J. Slotine, Linear matrix inequalities for physically consistent inertial parameter
    identification, IEEE Robotics and Automation Letters 3 (2018) 60-67; C. Rucker, P. Wensing, Smooth parameterization
    of rigid-body inertia, the same 7 (2022) 2771-2778.
"""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.regressor import COLUMN, ROW

LEAST = 1e-9  # of a pseudo-inertia's eigenvalues over its largest: a point mass, or a planar arm's Izz alone
LOWER = np.tril_indices(4)


def pseudo_inertias(parameters: Array) -> Array:
    """Of bodies with ten parameters each, (b, 4, 4)."""
    ten = parameters.reshape(-1, 10)
    tensor = np.zeros((len(ten), 3, 3))
    tensor[:, ROW, COLUMN] = tensor[:, COLUMN, ROW] = ten[:, 4:]
    result = np.empty((len(ten), 4, 4))
    result[:, :3, :3] = 0.5 * np.trace(tensor, axis1=1, axis2=2)[:, None, None] * np.eye(3) - tensor
    result[:, :3, 3] = result[:, 3, :3] = ten[:, 1:4]
    result[:, 3, 3] = ten[:, 0]
    return result


def ten_parameters(pseudo: Array) -> Array:
    """The other way, (10 b,)."""
    second = pseudo[:, :3, :3]
    tensor = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return np.concatenate([pseudo[:, 3:, 3], pseudo[:, :3, 3], tensor[:, ROW, COLUMN]], axis=1).ravel()


def consistent(parameters: Array) -> bool:
    """Whether bodies can have these parameters, ten each."""
    values = np.linalg.eigvalsh(pseudo_inertias(parameters))
    return bool((values[:, 0] >= -LEAST * np.maximum(values[:, -1], LEAST)).all())


def nearest_consistent(found: Array, hessian: Array, bodies: int, start: Array) -> Array:
    """The parameters that a body can have, nearest to those found in the metric of the normal equations."""
    from scipy.optimize import least_squares

    inertial = 10 * bodies
    if consistent(found[:inertial]) and (found[inertial:] >= 0.0).all():
        return found
    root = np.linalg.cholesky(hessian).T
    values, vectors = np.linalg.eigh(pseudo_inertias(start[:inertial]))
    values = np.maximum(values, LEAST * np.maximum(values[:, -1:], LEAST))
    factors = np.linalg.cholesky((vectors * values[:, None, :]) @ np.swapaxes(vectors, 1, 2))
    first = np.concatenate([factors[:, LOWER[0], LOWER[1]].ravel(), np.sqrt(np.maximum(start[inertial:], 0.0) + LEAST)])

    def parameters(free: Array) -> Array:
        factor = np.zeros((bodies, 4, 4))
        factor[:, LOWER[0], LOWER[1]] = free[:inertial].reshape(bodies, 10)
        return np.concatenate([ten_parameters(factor @ np.swapaxes(factor, 1, 2)), free[inertial:] ** 2])

    def slopes(free: Array) -> Array:
        """Of the residuals; each entry of a factor moves its own body alone."""
        factor = np.zeros((bodies, 4, 4))
        factor[:, LOWER[0], LOWER[1]] = free[:inertial].reshape(bodies, 10)
        moved = np.zeros((len(free), len(free)))
        for k, (row, column) in enumerate(zip(*LOWER, strict=True)):
            change = np.zeros((bodies, 4, 4))
            change[:, row, :] = factor[:, :, column]
            ten = ten_parameters(change + np.swapaxes(change, 1, 2)).reshape(bodies, 10)
            for body in range(bodies):
                moved[10 * body : 10 * body + 10, 10 * body + k] = ten[body]
        moved[range(inertial, len(free)), range(inertial, len(free))] = 2.0 * free[inertial:]
        return root @ moved

    answer = least_squares(lambda free: root @ (parameters(free) - found), first, slopes, x_scale="jac", max_nfev=200)
    return parameters(answer.x)
