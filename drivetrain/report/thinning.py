"""Fewer points and no overlaps: what a picture leaves out without changing what the eye sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array


def thinned(values: Array, buckets: int = 300) -> NDArray[np.intp]:
    """Samples enough to draw a curve without losing a peak: the smallest and largest of every bucket.

    Args:
        values: The curve, (N,).
    """
    n = len(values)
    if n <= 3 * buckets:
        return np.arange(n)
    width = -(-n // buckets)
    padded = np.append(values, np.full(-n % width, values[-1])).reshape(-1, width)
    first = np.arange(len(padded)) * width
    kept = np.concatenate([[0, n - 1], first + padded.argmin(axis=1), first + padded.argmax(axis=1)])
    return np.unique(np.minimum(kept, n - 1))


def spread(positions: list[float], gap: float) -> list[float]:
    """Label positions pushed apart so that none overlap, each as near as may be to its own."""
    order = sorted(range(len(positions)), key=lambda i: positions[i])
    placed = [positions[i] for i in order]
    for _ in range(50):
        for i in range(len(placed) - 1):
            overlap = gap - (placed[i + 1] - placed[i])
            if overlap > 1e-9 * gap:
                placed[i] -= overlap / 2
                placed[i + 1] += overlap / 2
    result = [0.0] * len(positions)
    for i, position in zip(order, placed, strict=True):
        result[i] = position
    return result


def told_apart(x: Array, y: Array, group: NDArray[np.intp], cell: float) -> NDArray[np.intp]:
    """Dots that can be told apart: of those of one group in one cell of a grid, the last.

    Args:
        x, y: Where they stand, (N,).
        group: Of each, such as its colour; integers from 0, (N,).
    """
    if not len(x):
        return np.arange(0)
    columns, rows = (np.floor((v - v.min()) / cell).astype(np.int64) for v in (x, y))
    keys = (columns * (int(rows.max()) + 1) + rows) * (int(group.max()) + 1) + group
    _, last = np.unique(keys[::-1], return_index=True)
    return np.sort(len(x) - 1 - last)
