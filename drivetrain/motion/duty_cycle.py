"""The duty cycle: motions, dwells and payloads in the order in which they repeat for ever."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.arrays import Array


@dataclass(frozen=True, eq=False)
class Cycle:
    """One period of the repeated task as one run of samples.

    Attributes:
        joint_names: (n,).
        time: From 0, never decreasing [s], (N,).
        position: [rad or m], (N, n); from the integral of speed for a load table.
        velocity: [rad/s or m/s], (N, n).
        acceleration: [rad/s^2 or m/s^2], (N, n).
        torque: Given torque at the gear output [N m], (N, n); None when an arm decides it.
        payload: Index into ``payload_names`` of what the tip carries, -1 for nothing, (N,), integers.
        payload_names: Names of the payloads that occur.
        segment: Index into ``segment_names``, (N,), integers.
        segment_names: Names of motions and dwells in their order.
        notes: Of the motions in it.
    """

    joint_names: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array | None
    payload: Array
    payload_names: tuple[str, ...]
    segment: Array
    segment_names: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Length of the period [s]."""
        return float(self.time[-1] - self.time[0])
