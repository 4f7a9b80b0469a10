"""Joint torques of a motion known by its positions alone: differentiated twice, with the noise of the readings
estimated.

Second differences multiply the noise of a reading by 2.4/dt^2. A 12-bit encoder read at 1 kHz wavers by 1100 rad/s^2,
and torques computed so are an arm's noise, not its load. So each joint is first smoothed by as much as its resolution,
its noise and the jitter of its clock explain; joints that need none are differentiated as they are. How sure positions,
speeds and accelerations then are comes with the smoothing, and reaches the torques by their derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, axes_of, checked_array
from drivetrain.dynamics.derivatives import inverse_dynamics_derivatives
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import Fault, InputError
from drivetrain.motion.smoothing import (
    NOISE_OF_RESOLUTION,
    Fitted,
    Parabolas,
    Smoothing,
    SmoothingSpline,
    chosen_smoothing,
    detected_resolution,
    estimated_jitter,
    estimated_noise,
)

UNEQUAL = 1e6  # between gaps of one recording: beyond, it is none


@dataclass(frozen=True, eq=False)
class TorqueFromPositions:
    """Torques, how sure they are, and the speeds and accelerations that they were computed from.

    Attributes:
        torque: Generalised torque [N m; N at a prismatic joint], (N, n).
        deviation: Its standard deviation by the noise of readings and clock, and by what the samples miss between them
            [N m or N], (N, n): the torque is within 1.96 of it for 95 % of the samples; for 85 to 95 % where the
            acceleration jumps, or where a move has no more than some thirty samples. Zero for exact positions.
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
        Torques and what they come from. Towards either end accelerations rest on one side only, and ``deviation``
        grows: record a little more than you need.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, times that do not increase or whose gaps differ by a factor of a
            million, too few samples, or a negative resolution.

    Reference: Modern Robotics, exercise 8.14.
    """
    times = checked_array(time, (None,), "time")
    positions = checked_array(q, (len(times), arm.n), "q")
    gaps = np.diff(times)
    if (gaps <= 0.0).any():
        raise InputError(Fault("time", "must increase [s]", times.tolist()[:8]))
    usual = float(np.median(gaps))
    if gaps.max() > UNEQUAL * usual or gaps.min() < usual / UNEQUAL:
        odd = float(max(gaps, key=lambda gap: max(gap / usual, usual / gap)))
        raise InputError(Fault("time", f"a gap is a million times longer or shorter than the usual {usual:g} s", odd))
    motion, covariance, words = rates_from_positions(times, positions, _steps(arm, resolution))
    torque = inverse_dynamics(arm, *motion, tip_wrench=tip_wrench)
    slopes = inverse_dynamics_derivatives(arm, *motion, tip_wrench=tip_wrench)
    by = np.stack([slopes.q, slopes.qd, slopes.qdd], axis=-1)
    deviation = np.sqrt(np.maximum(np.einsum("sijk,sklj,sijl->si", by, covariance, by), 0.0))
    return TorqueFromPositions(torque, deviation, motion[1], motion[2], words)


def rates_from_positions(
    time: Array, positions: Array, steps: Sequence[float | None]
) -> tuple[list[Array], Array, tuple[str, ...]]:
    """Positions, speeds and accelerations, (N, n) each, their covariance (N, 3, 3, n), and in words how.

    The steps are those between neighbouring readings [rad or m], None where they are to be found.
    """
    joints = [_differentiated(time, values, step) for values, step in zip(positions.T, steps, strict=True)]
    rates, covariance = (np.stack(parts, axis=-1) for parts in zip(*(fitted for fitted, _ in joints), strict=True))
    return [np.ascontiguousarray(rate) for rate in rates], covariance, tuple(words for _, words in joints)


def _differentiated(time: Array, values: Array, given: float | None) -> tuple[Fitted, str]:
    """Position, speed, acceleration and their covariance, and in words how they came about."""
    step = detected_resolution(values) if given is None else given
    way: Smoothing = Parabolas()
    if np.ptp(values) == 0.0:  # a joint that stayed at one reading has no noise to remove
        step = 0.0
    elif given is None:
        way = chosen_smoothing(time, values, step)
    elif step:
        step = max(step, float(np.spacing(np.abs(values).max())))  # no reading is finer than its number
        way = SmoothingSpline(step, estimated_jitter(time, values, step * NOISE_OF_RESOLUTION))
    if isinstance(way, SmoothingSpline):
        return way.fitted(time, values), way.description
    first, second = way.derivatives(time, values)
    noise, jitter, gap = step * NOISE_OF_RESOLUTION, 0.0, np.gradient(time)
    missed = np.zeros((2, len(time)))
    if given is None and np.ptp(values) > 0.0:
        noise = max(noise, estimated_noise(time, values))
        jitter = estimated_jitter(time, values, noise)
        # What a parabola misses of speed and acceleration by the change of the latter, of unequal steps more.
        unequal = np.diff(time, 2, prepend=2 * time[0] - time[1], append=2 * time[-1] - time[-2])
        jerk = np.gradient(second, time)
        missed[0] = (jerk * gap**2 / 6.0) ** 2
        missed[1] = (jerk * unequal / 3.0) ** 2 + (np.gradient(jerk, time) * gap**2 / 12.0) ** 2
    variance = noise**2 + (jitter * first) ** 2
    each = np.stack([variance, variance / (2 * gap**2) + missed[0], 6 * variance / gap**4 + missed[1]], axis=1)
    return Fitted(np.stack([values, first, second]), each[:, :, None] * np.eye(3)), way.description


def _steps(arm: Arm, resolution: Any) -> list[float | None]:
    """The resolution of each joint, None where it is to be found."""
    if resolution is None:
        return [None] * arm.n
    each = np.full(arm.n, resolution) if axes_of(resolution) == 0 else resolution
    steps = checked_array(each, (arm.n,), "resolution")
    if (steps < 0.0).any():
        raise InputError(Fault("resolution", "must not be negative [rad or m]", steps.tolist()))
    return [float(step) for step in steps]
