"""Weighted least squares with a prior; sums of squares are kept per fold, so that holding out a fold is cheap."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.regressor import COLUMN, ROW, ten_parameters

# Smallest eigenvalue of a pseudo-inertia over its largest: allows point masses, and planar arms with only Izz.
LEAST = 1e-9
LOWER = np.tril_indices(4)


def pseudo_inertias(parameters: Array) -> Array:
    """Pseudo-inertias of bodies with ten parameters each, (10 b,) to (b, 4, 4)."""
    ten = parameters.reshape(-1, 10)
    tensor = np.zeros((len(ten), 3, 3))
    tensor[:, ROW, COLUMN] = tensor[:, COLUMN, ROW] = ten[:, 4:]
    result = np.empty((len(ten), 4, 4))
    result[:, :3, :3] = 0.5 * np.trace(tensor, axis1=1, axis2=2)[:, None, None] * np.eye(3) - tensor
    result[:, :3, 3] = result[:, 3, :3] = ten[:, 1:4]
    result[:, 3, 3] = ten[:, 0]
    return result


def consistent(parameters: Array) -> bool:
    """Whether the parameters of the bodies, ten each, are physically consistent."""
    values = np.linalg.eigvalsh(pseudo_inertias(parameters))
    return bool((values[:, 0] >= -LEAST * np.maximum(values[:, -1], LEAST)).all())


def nearest_consistent(found: Array, hessian: Array, bodies: int, start: Array) -> Array:
    """The physically consistent parameters nearest to ``found`` in the metric of the normal equations.

    Args:
        found: Unconstrained solution, (p,): ten parameters per body, then parameters that must not be negative.
        hessian: Matrix of the normal equations, (p, p).
        bodies: Number of bodies.
        start: Parameters from which the solution starts, (p,).
    """
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

    def jacobian(free: Array) -> Array:
        """Jacobian of the residuals; an entry of a Cholesky factor changes only the parameters of its own body."""
        factor = np.zeros((bodies, 4, 4))
        factor[:, LOWER[0], LOWER[1]] = free[:inertial].reshape(bodies, 10)
        derivative = np.zeros((len(free), len(free)))
        for k, (row, column) in enumerate(zip(*LOWER, strict=True)):
            change = np.zeros((bodies, 4, 4))
            change[:, row, :] = factor[:, :, column]
            ten = ten_parameters(change + np.swapaxes(change, 1, 2)).reshape(bodies, 10)
            for body in range(bodies):
                derivative[10 * body : 10 * body + 10, 10 * body + k] = ten[body]
        derivative[range(inertial, len(free)), range(inertial, len(free))] = 2.0 * free[inertial:]
        return root @ derivative

    answer = least_squares(lambda free: root @ (parameters(free) - found), first, jacobian, x_scale="jac", max_nfev=200)
    return parameters(answer.x)


ROUNDING = 1e-10  # columns below this share of the largest are zero: the motion does not excite them


class Fold(NamedTuple):
    """Normal equations of a part of the recording, X^T X and X^T y, and its rows."""

    gram: Array
    moment: Array
    rows: Array  # (samples, n, p), weighted
    wanted: Array  # (samples, n), weighted


class Weights(NamedTuple):
    """Weights of the prior for parameters of bodies and of friction, relative to the mean sum of squares."""

    bodies: float
    friction: float


BODIES, FRICTION = (1e-7, 1e-5, 1e-3, 0.1, 1.0, 3.0, 10.0, 30.0), (1e-7, 1e-4, 1e-2, 0.1)
GRID = tuple(Weights(bodies, friction) for bodies in BODIES for friction in FRICTION)


@dataclass(frozen=True, eq=False)
class Problem:
    """The least-squares problem of a recording; unknowns are deviations from the prior times their column's scale."""

    folds: tuple[Fold, ...]  # contiguous parts of the recording
    scale: Array  # RMS of each column over the recording, (p,); 1 for a column that is only rounding
    friction: np.ndarray  # which columns are friction, (p,)

    def system(self, kept: list[int], weights: Weights) -> tuple[Array, Array]:
        """The normal equations ``H d = g`` of the folds ``kept``, including the prior."""
        gram, moment = (sum(np.asarray(self.folds[k][part]) for k in kept) for part in (0, 1))
        count = sum(len(self.folds[k].rows) for k in kept)
        held = np.where(self.friction, weights.friction, weights.bodies) * count
        return gram + np.diag(held), np.asarray(moment)

    def deviation(self, kept: list[int], weights: Weights) -> Array:
        """The deviation of the parameters from the prior that the folds ``kept`` give, (p,)."""
        return np.asarray(np.linalg.solve(*self.system(kept, weights)))

    def best_weights(self, kept: list[int]) -> Weights:
        """The strongest prior whose cross-validation error is within one standard error of the best.

        Reference: T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning (2009), section 7.10.
        """
        missed = np.array([[self._validation_error(kept, k, weights) for k in kept] for weights in GRID])
        more = missed - missed[np.argmin(missed.sum(axis=1))]
        error = more.std(axis=1, ddof=1) * np.sqrt(len(kept))
        as_good = more.sum(axis=1) <= error
        return max(weights for weights, good in zip(GRID, as_good, strict=True) if good)

    def _validation_error(self, kept: list[int], left_out: int, weights: Weights) -> float:
        fold = self.folds[left_out]
        found = self.deviation([k for k in kept if k != left_out], weights)
        return float(found @ fold.gram @ found - 2.0 * found @ fold.moment)

    def held_out(self) -> list[Array]:
        """Weighted residuals of each fold, (samples, n), with parameters and prior weights from the other folds."""
        everything, left = list(range(len(self.folds))), []
        for k, fold in enumerate(self.folds):
            others = [j for j in everything if j != k]
            left.append(fold.wanted - fold.rows @ self.deviation(others, self.best_weights(others)))
        return left


def problem_of(rows: Array, wanted: Array, friction: np.ndarray, folds: int, gap: int) -> Problem:
    """The problem of weighted rows, (N, n, p), and right-hand sides, (N, n); folds lose ``gap`` samples at each end."""
    scale = np.sqrt(np.mean(np.sum(rows**2, axis=1), axis=0))
    scale = np.where(scale > ROUNDING * scale.max(), scale, np.inf)
    parts = []
    for first, last in pairwise(np.linspace(0, len(rows), folds + 1).astype(int)):
        some = rows[first + gap : last - gap] / scale
        flat, target = some.reshape(-1, rows.shape[2]), wanted[first + gap : last - gap]
        parts.append(Fold(flat.T @ flat, flat.T @ target.ravel(), some, target))
    return Problem(tuple(parts), np.where(np.isfinite(scale), scale, 1.0), friction)


class BaseParameters(NamedTuple):
    """The combinations of parameters that torques can distinguish."""

    leading: np.ndarray  # index of the leading parameter of each combination, (r,)
    combined: Array  # factors of all parameters in each combination, (r, p)


def base_parameters(rows: Array, tolerance: float = 1e-8) -> BaseParameters:
    """The base parameters of rows (m, p), by rank-revealing QR; Gautier, J. Robotic Systems 8 (1991) 485-506."""
    from scipy.linalg import qr, solve_triangular

    size = np.sqrt(np.sum(rows**2, axis=0))
    excited = size > tolerance * size.max()
    scaled = rows / np.where(excited, size, 1.0) * excited
    triangle, order = qr(scaled, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.sum(diagonal > tolerance * diagonal[0]))
    combined = np.zeros((rank, rows.shape[1]))
    combined[:, order[:rank]] = np.eye(rank)
    rest = order[rank:]
    combined[:, rest] = solve_triangular(triangle[:rank, :rank], triangle[:rank, rank : len(size)])
    combined *= size / size[order[:rank], None]
    combined[np.abs(combined) < 1e-7 * np.abs(combined).max(axis=1, keepdims=True)] = 0.0
    return BaseParameters(order[:rank], combined)
