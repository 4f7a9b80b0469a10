"""Motions as samples: joint positions over time, or joint torques and speeds for users without an arm."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.arrays import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint positions, speeds and accelerations over time.

    Two samples may share one instant: the values before and after a step (a profile with piecewise-constant
    acceleration has such pairs), so that integrals over the samples are exact.

    Attributes:
        name: What to call it.
        joint_names: (n,).
        time: Never decreasing [s], (N,).
        position: [rad or m], (N, n).
        velocity: [rad/s or m/s], (N, n).
        acceleration: [rad/s^2 or m/s^2], (N, n).
        notes: How it was made: profile, file, smoothing used, doubts.
    """

    name: str
    joint_names: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class LoadTable:
    """Torque and speed at the output shafts over time, when there is no arm.

    Attributes:
        name: What to call it.
        joint_names: (n,).
        time: Never decreasing [s], (N,).
        torque: At the gear output, what the drive must deliver [N m], (N, n).
        speed: [rad/s], (N, n).
        acceleration: [rad/s^2], (N, n); needed for the rotor's own inertia.
        notes: How it was made.
    """

    name: str
    joint_names: tuple[str, ...]
    time: Array
    torque: Array
    speed: Array
    acceleration: Array
    notes: tuple[str, ...] = ()
