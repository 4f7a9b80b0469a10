"""The samples of a motion in blocks, each short against the time constants of a motor's heat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array

Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]

NO_HEAT, STEADY_HEAT, ONE_NODE, TWO_NODES = range(4)

BLOCK = 0.015  # of the faster time constant: the longest block
LONG = 0.01  # of it: an interval that a few terms of a series no longer carry


class Blocks(NamedTuple):
    """Samples in blocks, of several joints one row each; n joints, M samples, K blocks, Q parts of a mix.

    Attributes:
        first: First interval of each block, and where the last ends, (n, K + 1).
        part: First block of each part, and their number, (n, Q + 1).
        sample: First sample of each part, and their number, (Q + 1,).
        length: Of each block [s], (n, K).
        step: From each sample to the next of its part [s], (M,).
        offset: Of the middle of each interval from the middle of its block, times the step [s^2], (n, M).
        spread: The second moment of each interval about the middle of its block [s^3], (n, M).
        long: Whether an interval is long against the time constants, (n, M).
    """

    first: Indices
    part: Indices
    sample: Indices
    length: Array
    step: Array
    offset: Array
    spread: Array
    long: Flags


def blocks_of(time: Array, parts: Sequence[slice], fastest: Sequence[float]) -> Blocks:
    """Samples in blocks short enough for the time constants of each joint's motor.

    Args:
        time: Never decreasing [s], (M,).
        fastest: Sum of the rates of heat flow of the fastest node of each motor [1/s]; 0: nothing moves.
    """
    step = np.append(np.diff(time), 0.0)
    for one in parts:
        step[one.stop - 1] = 0.0
    edges = [_edges(step, parts, rate) for rate in fastest]
    most = max(len(one[0]) for one in edges) - 1
    first = np.array([np.pad(one, (0, most + 1 - len(one)), mode="edge") for one, _ in edges])
    length = np.zeros((len(edges), most))
    offset, spread = np.zeros((2, len(edges), len(step)))
    clock = np.concatenate([[0.0], np.cumsum(step[:-1])])  # parts follow one another without a gap
    for joint, (cuts, _) in enumerate(edges):
        length[joint, : len(cuts) - 1] = np.diff(clock[cuts])
        of = np.clip(np.searchsorted(cuts, np.arange(len(step)), side="right") - 1, 0, len(cuts) - 2)
        away = clock + 0.5 * step - 0.5 * (clock[cuts[:-1]] + clock[cuts[1:]])[of]
        offset[joint] = step * away
        spread[joint] = step * (away**2 + step**2 / 12.0) - step * length[joint, of] ** 2 / 12.0
    return Blocks(
        first, np.array([of_part for _, of_part in edges]), np.array([*(one.start for one in parts), len(step)]),
        length, step, offset, spread, step * np.array(fastest)[:, np.newaxis] > LONG,
    )  # fmt: skip


def _edges(step: Array, parts: Sequence[slice], fastest: float) -> tuple[Indices, Indices]:
    """First interval of each block and the end of the last; first block of each part and their number."""
    longest = BLOCK / fastest if fastest > 0.0 else np.inf
    starts: list[int] = []
    of_part: list[int] = []
    for one in parts:
        of_part.append(len(starts))
        starts.append(one.start)
        filled = 0.0
        for k in range(one.start, one.stop - 1):
            if filled > 0.0 and filled + step[k] > longest:
                starts.append(k)
                filled = 0.0
            filled += step[k]
    return np.array([*starts, len(step) - 1]), np.array([*of_part, len(starts)])


def loss_moments(blocks: Blocks, joint: int, loss: Array) -> Array:
    """Sum and first moment of a loss in each block.

    Args:
        loss: From each sample to the next [W], (M,).

    Returns:
        [J] and [J s], (K, 2).
    """
    ends = zip(blocks.first[joint, :-1], blocks.first[joint, 1:], strict=True)
    step, offset = blocks.step, blocks.offset[joint]
    return np.array([(step[i:j] @ loss[i:j], offset[i:j] @ loss[i:j]) for i, j in ends])
