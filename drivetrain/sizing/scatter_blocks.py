"""The samples of a motion in blocks, each short against the time constants of a motor's heat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array

Indices = NDArray[np.int64]

NO_HEAT, STEADY_HEAT, ONE_NODE, TWO_NODES = range(4)

BLOCK = 0.015  # of the faster time constant: the longest block

class Blocks(NamedTuple):
    """Samples in blocks; M samples, K blocks.

    Attributes:
        first: First interval of each block, and the number of intervals, (K + 1,).
        length: Of each block [s], (K,).
        of: Block in which each sample lies, (M,).
        step: From each sample to the next [s], (M,).
        offset: Of the middle of each interval from the middle of its block, times the step [s^2], (M,).
        spread: The second moment of each interval about the middle of its block [s^3], (M,).
    """

    first: Indices
    length: Array
    of: Indices
    step: Array
    offset: Array
    spread: Array


class HeatMemory(NamedTuple):
    """What one thread writes into.

    Attributes:
        low, high: Rises between which the winding stays in each block [K], (K,).
        state: Rises of winding and housing at the start of each block, and at the end of the last [K], (K + 1, 2).
        maps: What each block does to a state: four numbers of a matrix and two of a vector, (K, 6).
        moments: Sum, first and second moment of the squared torque in each block, (K, 3).
        rise: Of the winding at each sample, where it was traced [K], (M,).
        rates: For the trace, (8,).
        loss: Loss in the housing from each sample to the next [W], (M,).
    """

    low: Array
    high: Array
    state: Array
    maps: Array
    moments: Array
    rise: Array
    rates: Array
    loss: Array


def blocks_of(time: Array, fastest: float) -> Blocks:
    """Samples in blocks short enough for a time constant.

    Args:
        time: Never decreasing [s], (M,).
        fastest: Sum of the rates of heat flow of the fastest motor [1/s].

    Returns:
        The blocks; an interval that is longer is one by itself.
    """
    step = np.append(np.diff(time), 0.0)
    longest = BLOCK / fastest if fastest > 0.0 else np.inf
    starts, filled = [0], 0.0
    for k in range(len(step) - 1):
        if filled > 0.0 and filled + step[k] > longest:
            starts.append(k)
            filled = 0.0
        filled += step[k]
    edges = np.array([*starts, len(step) - 1], dtype=np.int64) if len(step) > 1 else np.array([0, 1])
    of = np.clip(np.searchsorted(edges, np.arange(len(time)), side="right") - 1, 0, len(edges) - 2)
    begin, end = time[edges[:-1]], time[np.minimum(edges[1:], len(time) - 1)]
    length = end - begin
    away = time + 0.5 * step - 0.5 * (begin + end)[of]
    spread = step * (away**2 + step**2 / 12.0) - step * length[of] ** 2 / 12.0
    return Blocks(edges, length, of.astype(np.int64), step, step * away, spread)


def stacked(blocks: Sequence[Blocks]) -> tuple[Blocks, Indices]:
    """The blocks of all joints as one, rows filled up with zeros.

    Args:
        blocks: Of the same samples, one a joint.

    Returns:
        Arrays with one row a joint, and how many blocks each has, (n,).
    """
    counts = np.array([len(one.length) for one in blocks], dtype=np.int64)
    most = int(counts.max())

    first = np.zeros((len(blocks), most + 1), dtype=np.int64)
    length = np.zeros((len(blocks), most))
    for i, one in enumerate(blocks):
        first[i, : len(one.first)], length[i, : len(one.length)] = one.first, one.length
    samples = [np.array(rows) for rows in zip(*((one.step, one.offset, one.spread) for one in blocks), strict=True)]
    return Blocks(first, length, np.array([one.of for one in blocks]), *samples), counts


def heat_memory(blocks: Blocks) -> HeatMemory:
    """Memory for one motor's heat.

    Args:
        blocks: Its samples; or of several motors, one row each.

    Returns:
        Nothing in it yet.
    """
    count, samples = blocks.length.shape[-1], blocks.of.shape[-1]
    return HeatMemory(
        np.zeros(count), np.zeros(count), np.zeros((count + 1, 2)), np.zeros((count, 6)), np.zeros((count, 3)),
        np.zeros(samples), np.zeros(8), np.zeros(samples),
    )  # fmt: skip


def loss_moments(blocks: Blocks, loss: Array) -> Array:
    """Sum and first moment of a loss in each block.

    Args:
        blocks: Of samples.
        loss: From each sample to the next [W], (M,).

    Returns:
        [J] and [J s], (K, 2).
    """
    ends = zip(blocks.first[:-1], blocks.first[1:], strict=True)
    return np.array([(blocks.step[i:j] @ loss[i:j], blocks.offset[i:j] @ loss[i:j]) for i, j in ends])
