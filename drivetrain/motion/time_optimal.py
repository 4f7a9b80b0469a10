"""Time-optimal speed along a path under limits that are linear in acceleration, speed and square of speed.

Torque limits of joints have this form: with s the position along the path, ``torque = m(s) sdd + c(s) sd^2 + g(s)``;
limits that fall with speed, such as the torque available at a given voltage, add a multiple of ``sd``.
A backward pass from the end computes the largest squares of speed from which the end can be reached; a forward pass
from the start takes the largest acceleration that stays below them.

Reference: Pham and Pham, A new approach to time-optimal path parameterization based on reachability analysis, IEEE
    Trans. Robotics 34 (2018) 645-659.
"""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError

HALVINGS = 50  # bisections of the square of speed

Rows = tuple[Array, Array, Array, Array]  # coefficients of acceleration, square, speed; limit; (k,) each


def quickest_squares(
    place: Array, by_acceleration: Array, by_square: Array, limit: Array, most: Array, by_speed: Array | None = None
) -> Array:
    """Largest squares of the speed along a path that its limits allow, at rest at both ends, (N,).

    Between two grid points ``place`` of s the acceleration is constant. The limits are ``by_acceleration sdd +
    by_square sd^2 + by_speed sd <= limit``, (N, k) each; they are not negative, since the path must be allowed to be at
    rest everywhere. ``most`` are the largest allowed squares of speed, (N,).
    """
    if (limit < 0.0).any():
        raise InputError(Fault("limit", "is broken standing still", int(np.argmax((limit < 0.0).any(axis=1)))))
    by_speed = np.zeros_like(limit) if by_speed is None else by_speed
    step, end = 2.0 * np.diff(place), len(place) - 1
    reach = np.zeros(len(place))
    for i in reversed(range(end)):
        p = np.append(by_acceleration[i], [step[i], -step[i]])
        q = np.append(by_square[i], [1.0, -1.0])
        v, rows = np.append(by_speed[i], [0.0, 0.0]), np.append(limit[i], [reach[i + 1], 0.0])
        reach[i] = _largest((p, q, v, rows), float(most[i]))
    square = np.zeros(len(place))
    for i in range(end):
        ahead = _between((by_acceleration[i], by_square[i], by_speed[i], limit[i]), float(square[i]))[1]
        square[i + 1] = min(max(square[i] + step[i] * ahead, 0.0), reach[i + 1])
    return square


def _between(rows: Rows, square: float) -> tuple[float, float]:
    """Smallest and largest acceleration that the limits allow at a square of speed; (inf, -inf) if there is none."""
    p, q, v, limit = rows
    margin = limit - q * square - v * square**0.5
    low = (margin[p < 0.0] / p[p < 0.0]).max(initial=-np.inf)
    high = (margin[p > 0.0] / p[p > 0.0]).min(initial=np.inf)
    if (margin[p == 0.0] < 0.0).any():
        return np.inf, -np.inf
    return float(low), float(high)


def _largest(rows: Rows, most: float) -> float:
    """The largest square of speed, up to ``most``, at which the limits allow some acceleration, by bisection.

    They allow one at zero speed, and the allowed squares of speed form an interval.
    """

    def allowed(square: float) -> bool:
        low, high = _between(rows, square)
        return low <= high

    if allowed(most):
        return most
    good, bad = 0.0, most
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if allowed(middle) else (good, middle)
    return good


def times(place: Array, square: Array) -> Array:
    """Time at which each grid point is reached, from 0 [s], (N,)."""
    mean = 0.5 * (np.sqrt(square[1:]) + np.sqrt(square[:-1]))
    return np.concatenate([[0.0], np.cumsum(np.diff(place) / mean)])
