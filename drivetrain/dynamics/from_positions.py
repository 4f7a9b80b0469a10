"""Joint torques of a motion known by its positions alone: differentiated twice, with the noise of the readings told.

Second differences multiply the noise of a reading by 2.4/dt^2. A 12-bit encoder read at 1 kHz wavers by 1100 rad/s^2,
and torques computed so are an arm's noise, not its load. So each joint is first smoothed by as much as its resolution
explains, and no more; joints that need none are differentiated as they are. What noise is left in the torques is found
by reading again: with as much noise added, smoothed as much again, several times over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, axes_of, checked_array
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import Fault, InputError
from drivetrain.motion.smoothing import Parabolas, Smoothing, SmoothingSpline, chosen_smoothing, detected_resolution

READINGS = 8  # how often noise is added to see what it does; a deviation from 8 is good to a quarter


@dataclass(frozen=True, eq=False)
class TorqueFromPositions:
    """Torques, how sure they are, and the speeds and accelerations that they were computed from.

    Attributes:
        torque: Generalised torque [N m; N at a prismatic joint], (N, n).
        deviation: Its standard deviation by the noise of the readings [N m or N], (N, n); zero for exact positions.
        qd: Speeds [rad/s or m/s], (N, n).
        qdd: Accelerations [rad/s^2 or m/s^2], (N, n).
        smoothing: What was done to each joint, in words, (n,).
    """

    torque: Array
    deviation: Array
    qd: Array
    qdd: Array
    smoothing: tuple[str, ...]


def torque_from_positions(
    arm: Arm, time: Any, q: Any, *, resolution: Any = None, tip_wrench: Any = None
) -> TorqueFromPositions:
    """The generalised joint torques of a motion given by positions over time.

    Args:
        arm: With rotors or without.
        time: Increasing [s], (N,), N >= 3.
        q: Positions as read [rad or m], (N, n).
        resolution: Step between neighbouring readings [rad or m], one for all joints or one each, (n,); for noise that
            is no rounding, 3.46 times its standard deviation; 0 for exact positions, which are not smoothed. None:
            taken from the samples themselves, and smoothed only where it would show.
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Torques and what they come from. Within 50 to 100 samples of either end accelerations rest on one side only,
        and where the motion does not begin or end at rest they are off by more than ``deviation`` says, by several
        times in the outermost ten: record a little more than you need.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, times that do not increase, too few samples, or a negative
            resolution.

    Reference: Modern Robotics, exercise 8.14.
    """
    times = checked_array(time, (None,), "time")
    positions = checked_array(q, (len(times), arm.n), "q")
    if (np.diff(times) <= 0.0).any():
        raise InputError(Fault("time", "must increase [s]", times.tolist()[:8]))
    joints = [_Joint.of(times, *pair) for pair in zip(positions.T, _steps(arm, resolution), strict=True)]
    qd, qdd = _derivatives(times, positions, [joint.way for joint in joints])
    torque = inverse_dynamics(arm, positions, qd, qdd, tip_wrench=tip_wrench)
    noise = np.array([joint.step for joint in joints])
    squares = np.zeros(torque.shape)
    random = np.random.default_rng(0)
    for _ in range(READINGS if noise.any() else 0):
        again = positions + noise * random.uniform(-0.5, 0.5, positions.shape)
        rates = _derivatives(times, again, [joint.way_again for joint in joints])
        squares += (inverse_dynamics(arm, again, *rates, tip_wrench=tip_wrench) - torque) ** 2
    words = tuple(joint.way.description for joint in joints)
    return TorqueFromPositions(torque, np.sqrt(squares / READINGS), qd, qdd, words)


@dataclass(frozen=True)
class _Joint:
    """How a joint's readings are differentiated, and how they are once as much noise is added."""

    step: float
    way: Smoothing
    way_again: Smoothing

    @classmethod
    def of(cls, time: Array, values: Array, given: float | None) -> _Joint:
        step = detected_resolution(values) if given is None else given
        if np.ptp(values) == 0.0:  # a joint that stayed at one reading has no noise to remove
            return cls(0.0, Parabolas(), Parabolas())
        way = chosen_smoothing(time, values, step) if given is None else SmoothingSpline(step) if step else Parabolas()
        if not isinstance(way, SmoothingSpline):
            return cls(step, way, way)
        smoothed = way.resolution or step
        return cls(smoothed, way, SmoothingSpline(math.sqrt(2.0) * smoothed))


def _derivatives(time: Array, positions: Array, ways: list[Smoothing]) -> tuple[Array, Array]:
    """Speeds and accelerations, (N, n) each."""
    found = [way.derivatives(time, values) for way, values in zip(ways, positions.T, strict=True)]
    qd, qdd = (np.ascontiguousarray(np.transpose(rates)) for rates in zip(*found, strict=True))
    return qd, qdd


def _steps(arm: Arm, resolution: Any) -> list[float | None]:
    """The resolution of each joint, None where it is to be found."""
    if resolution is None:
        return [None] * arm.n
    each = np.full(arm.n, resolution) if axes_of(resolution) == 0 else resolution
    steps = checked_array(each, (arm.n,), "resolution")
    if (steps < 0.0).any():
        raise InputError(Fault("resolution", "must not be negative [rad or m]", steps.tolist()))
    return [float(step) for step in steps]
