"""Sampled motions: joint positions over time, or torques and speeds at output shafts if there is no arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from drivetrain.arrays import Array
from drivetrain.notebook import axes_of, shown

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


PIECES = 400  # samples per length of a load table wherever torque or speed changes


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint positions, speeds and accelerations over time.

    Two samples may share one instant: the values before and after a step (a profile with piecewise-constant
    acceleration has such pairs), so that integrals over the samples are exact.

    Attributes:
        name: Name used in messages and reports.
        joint_names: (n,).
        time: Non-decreasing [s], (N,).
        position: [rad or m], (N, n).
        velocity: [rad/s or m/s], (N, n).
        acceleration: [rad/s^2 or m/s^2], (N, n).
        notes: Origin and processing: profile, file, smoothing used, warnings.
    """

    name: str
    joint_names: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Motion({_summary(self)})"

    def _repr_html_(self) -> str:
        return shown(repr(self), _extremes(self.joint_names, self.position, self.velocity, self.acceleration))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Positions over time [rad or m].

        Args:
            ax: Where to draw; None: a new figure.

        Returns:
            The axes.
        """
        ax = axes_of(ax)
        ax.plot(self.time, self.position, label=self.joint_names)
        ax.set(xlabel="time [s]", ylabel="position [rad or m]", title=self.name)
        ax.legend()
        return ax


def _summary(samples: Motion | LoadTable) -> str:
    length = samples.time[-1] - samples.time[0]
    return f"{samples.name}: {len(samples.joint_names)} joints, {len(samples.time)} samples, {length:.4g} s"


def _extremes(joints: tuple[str, ...], position: Array, velocity: Array, acceleration: Array) -> pd.DataFrame:
    """Table of each joint's range of position, largest speed and largest acceleration."""
    import pandas as pd

    return pd.DataFrame(
        {
            "lowest": position.min(axis=0), "highest": position.max(axis=0),
            "largest speed": abs(velocity).max(axis=0), "largest acceleration": abs(acceleration).max(axis=0),
        },
        index=list(joints),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class LoadTable:
    """Torque and speed at the output shafts over time, for sizing without an arm.

    Attributes:
        name: Name used in messages and reports.
        joint_names: (n,).
        time: Non-decreasing [s], (N,).
        torque: Torque that the drive must deliver at the gear output [N m], (N, n).
        speed: [rad/s], (N, n).
        acceleration: [rad/s^2], (N, n); needed for the torque of the rotor's inertia.
        notes: Origin and processing, warnings.
    """

    name: str
    joint_names: tuple[str, ...]
    time: Array
    torque: Array
    speed: Array
    acceleration: Array
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"LoadTable({_summary(self)})"


def sampled(table: LoadTable) -> LoadTable:
    """The same table with further samples between its rows, and wherever a speed crosses zero.

    Between two rows, torque and speed are linear but current and heat are not: mesh losses change sign with the speed,
    and heat grows with the square of the current. Checks evaluate samples only, so a table needs samples in between.
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
    """Positions of new samples between two rows, from 0 to 1 without the ends, (k,).

    Also returns which joint's speed is zero at which of them, (k, n).
    """
    if pieces == 0.0 or np.array_equal(low[: 2 * n], high[: 2 * n]):
        return np.empty(0), np.empty((0, n), dtype=bool)
    speed, after = low[n : 2 * n], high[n : 2 * n]
    turns = speed * after < 0.0
    zero = np.where(turns, speed / np.where(turns, speed - after, 1.0), np.nan)
    count = np.ceil(pieces - 1e-6)  # the margin keeps rounding of equal steps from adding a sample
    cuts = np.arange(1, count) / count
    shares = np.union1d(cuts, zero[turns])
    return shares, shares[:, np.newaxis] == zero
