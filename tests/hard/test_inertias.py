"""Inertias that no body can have."""

from __future__ import annotations

import warnings

import numpy as np
from hard_case import Figure, hard_case

from drivetrain.arm.arm import Arm
from drivetrain.errors import PhysicsWarning
from drivetrain.spatial.inertia import triangle_excess

COUNT = 20_000
ROUNDING = 1e-12  # on shares of the trace


def turned(moments: np.ndarray, seed: int) -> np.ndarray:
    """Tensors with these principal moments along random axes, (N, 3, 3)."""
    axes, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(moments), 3, 3)))
    tensors = axes * moments[:, None, :] @ np.swapaxes(axes, 1, 2)
    return 0.5 * (tensors + np.swapaxes(tensors, 1, 2))


def possible() -> np.ndarray:
    """Of two to six point masses: every one a body, many of them thin rods and plates on the very edge."""
    rng = np.random.default_rng(1)
    tensors = []
    for _ in range(COUNT):
        points = rng.normal(size=(rng.integers(2, 7), 3)) * rng.uniform(0.01, 1.0)
        tensors.append((points**2).sum() * np.eye(3) - points.T @ points)
    return np.array(tensors)


def impossible() -> np.ndarray:
    """Positive definite, and the largest moment passes the sum of the others by 1e-9 of it to 300 %."""
    rng = np.random.default_rng(2)
    two = rng.uniform(0.01, 1.0, (COUNT, 2))
    third = two.sum(axis=1) * (1.0 + 10.0 ** rng.uniform(-9, 0.5, COUNT))
    return turned(np.column_stack([two, third]), 3)


def by_diagonal(tensors: np.ndarray) -> np.ndarray:
    diagonal = np.diagonal(tensors, axis1=1, axis2=2)
    return 2.0 * diagonal.max(axis=1) > diagonal.sum(axis=1)


@hard_case(
    "T29",
    "Inertias that no body can have",
    setup=(
        "20 000 possible and 20 000 impossible inertia tensors in random directions; the impossible ones "
        "violate the triangle inequality by 1e-9 to 300 %."
    ),
    naive="triangle inequality of the diagonal entries",
)
def test_validity() -> list[Figure]:
    good, bad = possible(), impossible()
    definite = np.linalg.eigvalsh(bad)[:, 0] <= 0.0
    assert definite.sum() == 0  # the usual test, positive definite, finds none of them
    found = np.array([triangle_excess(tensor) > ROUNDING for tensor in bad])
    alarms = np.array([triangle_excess(tensor) > ROUNDING for tensor in good])
    return [
        Figure(
            "impossible tensors found", 100.0 * found.mean(), 100.0 * by_diagonal(bad).mean(), at_least=100.0, unit="%"
        ),
        Figure("false alarms", float(alarms.sum()), float(by_diagonal(good).sum()), at_most=0.0),
    ]


def test_the_warning_names_the_link() -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        tensors = [np.eye(3), np.diag([1.0, 1.0, 2.5])]
        Arm.from_screws([np.eye(4)] * 2, [[0, 0, 1, 0, 0, 0]] * 2, [1, 1], tensors, link_names=["upper", "lower"])
    assert [warning.category for warning in told] == [PhysicsWarning]
    assert "lower" in str(told[0].message)
