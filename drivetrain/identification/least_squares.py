"""Weighted least squares with a prior; sums of squares are kept per fold, so that holding out a fold is cheap."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, Mask
from drivetrain.dynamics.regressor import COLUMN, ROW, ten_parameters

# Smallest eigenvalue of a pseudo-inertia over its largest: allows point masses, and planar arms with only Izz.
LEAST = 1e-9
INSIDE = 1e-3  # the same ratio where the search starts: from the limit, as of a point mass, it would not get away
FIRST = 1e-4  # friction from which the search starts where it is zero: there the slope of its square root vanishes
LOWER = np.tril_indices(4)
DEPENDENT = 1e-8  # share of the largest column below which a column of torques is none of its own


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
    """The physically consistent parameters nearest to ``found`` in the metric of the normal equations, (p,).

    These are ten parameters per body, then parameters that must not be negative; ``hessian`` is the matrix of the
    normal equations, (p, p), ``start`` are parameters of bodies from which the search starts, (p,).
    """
    from scipy.optimize import least_squares, lsq_linear

    inertial, near = 10 * bodies, found
    root = np.linalg.cholesky(hessian).T
    if (found[inertial:] < 0.0).any():  # without the limits of the bodies the problem is convex and soon solved
        size = np.sqrt(np.diag(hessian))
        least = np.r_[np.full(inertial, -np.inf), np.zeros(len(found) - inertial)]
        near = lsq_linear(root / size, root @ found, (least, np.inf), method="bvls").x / size
    if consistent(near[:inertial]):
        return near
    values, vectors = np.linalg.eigh(pseudo_inertias(start[:inertial]))
    values = np.maximum(values, INSIDE * np.maximum(values[:, -1:], LEAST))
    factors = np.linalg.cholesky((vectors * values[:, None, :]) @ np.swapaxes(vectors, 1, 2))
    first = np.concatenate([factors[:, LOWER[0], LOWER[1]].ravel(), np.sqrt(near[inertial:] + FIRST)])

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

    answer = least_squares(
        lambda free: root @ (parameters(free) - found), first, jacobian, method="lm", x_scale="jac", max_nfev=200
    )
    return parameters(answer.x)


ROUNDING = 1e-10  # columns below this share of the largest are zero: the motion does not excite them


class Fold(NamedTuple):
    """Normal equations of a part of the recording, X^T X and X^T y, and its rows."""

    gram: Array
    moment: Array
    rows: Array  # (samples, n, p), weighted
    wanted: Array  # (samples, n), weighted
    samples: np.ndarray  # their numbers in the recording


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
    # Which columns are more than rounding, (p,); the others only have to be physically consistent, and a strong prior
    # at inconsistent values, such as those of planar arms with only Izz, would be paid for by the others.
    excited: np.ndarray

    def system(self, kept: list[int], weights: Weights) -> tuple[Array, Array]:
        """The normal equations ``H d = g`` of the folds ``kept``, including the prior."""
        gram, moment = (sum(np.asarray(self.folds[k][part]) for k in kept) for part in (0, 1))
        return gram + np.diag(self.held(kept, weights)), np.asarray(moment)

    def held(self, kept: list[int], weights: Weights) -> Array:
        """What the prior adds to the diagonal of the normal equations, (p,)."""
        count = sum(len(self.folds[k].rows) for k in kept)
        held = np.where(self.friction, weights.friction, weights.bodies)
        return np.where(self.excited, held, BODIES[0]) * count

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

    def consistent_change(self, kept: list[int], weights: Weights, prior: Array, bodies: int) -> Array:
        """The change of the parameters from ``prior``, unscaled, that the folds ``kept`` give, (p,); consistent."""
        hessian, moment = self.system(kept, weights)
        free = prior + np.linalg.solve(hessian, moment) / self.scale
        return nearest_consistent(free, hessian * np.outer(self.scale, self.scale), bodies, prior) - prior

    def held_out(self, prior: Array, bodies: int) -> list[Array]:
        """Weighted residuals of each fold, (samples, n), with parameters and prior weights from the other folds."""
        everything, left = list(range(len(self.folds))), []
        for k, fold in enumerate(self.folds):
            others = [j for j in everything if j != k]
            change = self.consistent_change(others, self.best_weights(others), prior, bodies)
            left.append(fold.wanted - fold.rows @ (self.scale * change))
        return left


def problem_of(rows: Array, wanted: Array, friction: np.ndarray, folds: int, gap: int) -> Problem:
    """The problem of weighted rows, (N, n, p), and right-hand sides, (N, n); folds lose ``gap`` samples at each end."""
    scale = np.sqrt(np.mean(np.sum(rows**2, axis=1), axis=0))
    scale = np.where(scale > ROUNDING * scale.max(), scale, np.inf)
    parts = []
    for first, last in pairwise(np.linspace(0, len(rows), folds + 1).astype(int)):
        samples = np.arange(first + gap, last - gap)
        some, target = rows[samples] / scale, wanted[samples]
        flat = some.reshape(-1, rows.shape[2])
        parts.append(Fold(flat.T @ flat, flat.T @ target.ravel(), some, target, samples))
    excited = np.isfinite(scale)
    return Problem(tuple(parts), np.where(excited, scale, 1.0), friction, excited)


class BaseParameters(NamedTuple):
    """The combinations of parameters that torques can distinguish."""

    leading: np.ndarray  # index of the leading parameter of each combination, (r,)
    combined: Array  # factors of all parameters in each combination, (r, p)


def base_parameters(rows: Array) -> BaseParameters:
    """The base parameters of rows (m, p), by rank-revealing QR; Gautier, J. Robotic Systems 8 (1991) 485-506."""
    from scipy.linalg import qr, solve_triangular

    size = np.sqrt(np.sum(rows**2, axis=0))
    excited = size > DEPENDENT * size.max()
    scaled = rows / np.where(excited, size, 1.0) * excited
    triangle, order = qr(scaled, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.sum(diagonal > DEPENDENT * diagonal[0]))
    combined = np.zeros((rank, rows.shape[1]))
    combined[:, order[:rank]] = np.eye(rank)
    rest = order[rank:]
    combined[:, rest] = solve_triangular(triangle[:rank, :rank], triangle[:rank, rank : len(size)])
    combined *= size / size[order[:rank], None]
    combined[np.abs(combined) < 1e-7 * np.abs(combined).max(axis=1, keepdims=True)] = 0.0
    return BaseParameters(order[:rank], combined)


MOST_ORDER = 20  # of the autoregressive model of the errors


def correlated_covariance(regressor: Array, left: Array, used: Mask) -> Array:
    """Covariance of least squares with errors that are correlated over time and between joints, (r, r).

    Rows of the regressor, (N, n, r), and residuals, (N, n), that are not ``used`` are zero.

    Reference: X^T S X between two (X^T X)^-1, with the covariance S of autoregressive errors, whose order minimises
        BIC: P. Brockwell and R. Davis, Time Series: Theory and Methods (1991), sections 8.1 and 9.3.
    """
    from scipy.signal import lfilter

    innovations, filtered = np.empty_like(left), np.empty_like(regressor)
    for i, count in enumerate(np.maximum(used.sum(axis=0), 1)):
        model = _autoregression(left[:, i])
        innovations[:, i] = lfilter(model, [1.0], left[:, i]) / np.sqrt(count)
        # Errors are e = L w with innovations w: X^T L is the recursion run backwards in time.
        filtered[:, i] = lfilter([1.0], model, regressor[::-1, i], axis=0)
    count, free = used.sum(), regressor.shape[2]
    size = innovations.T @ innovations * count / (count - free)
    bread = np.linalg.inv(np.einsum("tir,tis->rs", regressor, regressor))
    return np.asarray(bread @ np.einsum("tir,ij,tjs->rs", filtered, size, filtered, optimize=True) @ bread)


def _autoregression(errors: Array) -> Array:
    """Coefficients (1, -a_1, ..., -a_p) of the innovations e_t - a_1 e_(t-1) - ...: Yule-Walker, order by BIC."""
    from scipy.linalg import solve_toeplitz

    count = len(errors)
    lagged = np.array([errors[: count - k] @ errors[k:] for k in range(min(MOST_ORDER, count // 10) + 1)]) / count
    best, least = np.ones(1), np.inf
    if lagged[0] == 0.0:
        return best
    for order in range(len(lagged)):
        model = solve_toeplitz(lagged[:order], lagged[1 : order + 1]) if order else np.empty(0)
        variance = lagged[0] - model @ lagged[1 : order + 1]
        criterion = count * np.log(max(variance / lagged[0], 1e-300)) + order * np.log(count)
        if criterion < least:
            best, least = np.r_[1.0, -model], criterion
    return best
