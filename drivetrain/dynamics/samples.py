"""Calls of the compiled recursion for samples, with the checks of shapes and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array, batch, wrong_samples
from drivetrain.dynamics.core.packed import Packed
from drivetrain.dynamics.core.recursion import recursion
from drivetrain.dynamics.core.vectors import squares
from drivetrain.errors import LARGEST, Fault, InputError

NO_TIP = np.empty((0, 6))
FLOAT = np.dtype(np.float64)


class Outputs(NamedTuple):
    """Arrays for the recursion to fill; those without rows are not computed."""

    gear: Array  # torque at the output of the gear [N m or N], (N, n)
    axial: Array  # angular acceleration of the previous link along the joint axis [rad/s^2], (N, n)
    wrench: Array  # through the joint, (moment [N m], force [N]), (N, n, 6)


TORQUE_ONLY = Outputs(np.empty((0, 1)), np.empty((0, 1)), np.empty((0, 1, 6)))


def is_one_sample(n: int, *values: Any) -> bool:
    """Whether all values are single samples that the one-sample kernels accept without conversion."""
    for value in values:
        if type(value) is not np.ndarray or value.shape != (n,) or value.dtype != FLOAT or not value.flags.carray:
            return False
    return True


def is_one_finite_sample(n: int, a: Any, b: Any, c: Any) -> bool:
    """As ``is_one_sample``, and all numbers are finite and not too large."""
    return is_one_sample(n, a, b, c) and squares(a, b, c) <= LARGEST * LARGEST


def tip_samples(model: Packed, tip_wrench: Any, count: int) -> Array:
    """The tip wrench in the form that the recursion needs: 0, 1 or N rows in the last link's frame, (.., 6)."""
    if tip_wrench is None:
        return NO_TIP
    rows = batch(tip_wrench, 6, "tip_wrench")
    if np.ndim(tip_wrench) == 2 and len(rows) != count:
        raise InputError(Fault("tip_wrench", f"must have shape (6,), or (N, 6) with N = {count} as q has", rows.shape))
    return rows @ model.tip


def run(
    model: Packed,
    motion: Sequence[Array],
    *,
    gravity: Array | None = None,
    tip: Array = NO_TIP,
    outputs: Outputs = TORQUE_ONLY,
) -> Array:
    """The generalised torques of a motion (q, qd, qdd) by the compiled recursion, (N, n); InputError for a number that
    is not finite.

    ``gravity`` is that of the arm unless it is given; ``tip`` comes from ``tip_samples``; ``outputs`` are further
    arrays to fill.
    """
    wide, filled = motion, outputs
    if model.spread is not None:
        wide = [x @ model.spread.T for x in motion]
        filled = Outputs(*(np.empty((len(x), wide[0].shape[1], *x.shape[2:])) for x in outputs))
    torque = np.empty(wide[0].shape)
    weight = model.gravity if gravity is None else gravity
    if recursion(model.links, model.rotors, weight, *wide, tip, torque, *filled) != 0.0:
        raise not_finite_error(motion)
    if model.spread is None:
        return torque
    for output, found in zip(outputs, filled, strict=True):
        output[:] = found[:, : output.shape[1]]
    return np.asarray(torque @ model.spread)


def not_finite_error(motion: Sequence[Array]) -> InputError:
    """The error for a motion (q, qd, qdd) with numbers that are not finite or too large."""
    return wrong_samples(motion[0].shape[1], dict(zip(("q", "qd", "qdd"), motion, strict=True)))
