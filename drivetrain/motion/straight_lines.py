"""A load table's straight lines as samples: turning points and enough points between that sums are integrals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.motion.motion import LoadTable

PIECES = 400  # of the table's length, that a line on which torque or speed changes is cut into


def sampled(table: LoadTable) -> LoadTable:
    """The same table with samples along its lines and wherever a speed passes through zero.

    Currents are not straight where torque and speed are: losses change sides where the speed turns, and what heats is
    a square. A table of a few corners would else be judged by its corners alone.
    """
    columns = np.hstack([table.torque, table.speed, table.acceleration])
    step = (table.time[-1] - table.time[0]) / PIECES
    n = len(table.joint_names)
    times, rows = [table.time[:1]], [columns[:1]]
    for i, length in enumerate(np.diff(table.time)):
        low, high = columns[i], columns[i + 1]
        shares, turning = _shares(low, high, n, length / step if step > 0.0 else 0.0)
        between = low + shares[:, np.newaxis] * (high - low)
        between[:, n : 2 * n][turning] = 0.0
        times += [table.time[i] + shares * length, table.time[i + 1 : i + 2]]
        rows += [between, columns[i + 1 : i + 2]]
    torque, speed, acceleration = np.split(np.concatenate(rows), 3, axis=1)
    return replace(table, time=np.concatenate(times), torque=torque, speed=speed, acceleration=acceleration)


def _shares(low: Array, high: Array, n: int, pieces: float) -> tuple[Array, Array]:
    """Where on a line, from 0 to 1 without the ends, samples are added; and where which joint's speed is zero."""
    if pieces == 0.0 or np.array_equal(low[: 2 * n], high[: 2 * n]):
        return np.empty(0), np.empty((0, n), dtype=bool)
    speed, after = low[n : 2 * n], high[n : 2 * n]
    turns = speed * after < 0.0
    zero = np.where(turns, speed / np.where(turns, speed - after, 1.0), np.nan)
    count = np.ceil(pieces - 1e-6)  # rounding of equal steps is no reason for another cut
    cuts = np.arange(1, count) / count
    shares = np.union1d(cuts, zero[turns])
    return shares, shares[:, np.newaxis] == zero
