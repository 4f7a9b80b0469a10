"""Joint torques of a motion from measured positions: smoothing, differentiation, and standard deviations.

Second differences multiply the noise of a reading by 2.4/dt^2. A 12-bit encoder read at 1 kHz gives a noise of 1100
rad/s^2, so that torques computed from it would consist of noise. Therefore each joint is smoothed by as much as its
resolution, its noise and the jitter of its clock justify; joints that need no smoothing are differentiated directly.
The smoothing also gives the standard deviations of positions, speeds and accelerations; those of the torques follow
with the derivatives of the inverse dynamics.
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

UNEQUAL = 1e6  # largest accepted ratio of time steps in a recording


@dataclass(frozen=True, eq=False)
class TorqueFromPositions:
    """Torques with their standard deviations, and the speeds and accelerations from which they were computed.

    Attributes:
        torque: Generalised torque [N m; N at a prismatic joint], (N, n).
        deviation: Its standard deviation due to noise of positions and clock, and to the finite sampling [N m or N],
            (N, n): the error is below 1.96 times it for 95 % of the samples; for 78 to 95 % if the acceleration jumps,
            or if a recording has at most about fifteen samples. Zero for exact positions.
        qd: Speeds [rad/s or m/s], (N, n).
        qdd: Accelerations [rad/s^2 or m/s^2], (N, n).
        smoothing: Method used for each joint, as text, (n,).
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
        q: Positions as measured [rad or m], (N, n).
        resolution: Step between neighbouring readings [rad or m], a number or (n,); for noise other than rounding,
            sqrt(12) = 3.46 times its standard deviation; 0 for exact positions, which are not smoothed. None: detected
            from the samples, which are smoothed only if the noise would show in the acceleration.
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Torques, deviations and rates. Near both ends accelerations depend on samples on one side only, and
        ``deviation`` grows: record a little more than needed.

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
    """Positions, speeds and accelerations, (N, n) each, their covariance, (N, 3, 3, n), and the methods as text.

    ``steps`` are the resolutions [rad or m] of the joints; None: detected.
    """
    joints = [_differentiated(time, values, step) for values, step in zip(positions.T, steps, strict=True)]
    rates, covariance = (np.stack(parts, axis=-1) for parts in zip(*(fitted for fitted, _ in joints), strict=True))
    return [np.ascontiguousarray(rate) for rate in rates], covariance, tuple(words for _, words in joints)


def _differentiated(time: Array, values: Array, given: float | None) -> tuple[Fitted, str]:
    """Position, speed and acceleration of one joint with their covariance, and the method as text."""
    step = detected_resolution(values) if given is None else given
    way: Smoothing = Parabolas()
    if np.ptp(values) == 0.0:  # constant readings have no noise to remove
        step = 0.0
    elif given is None:
        way = chosen_smoothing(time, values, step)
    elif step:
        step = max(step, float(np.spacing(np.abs(values).max())))  # no finer than the rounding of the numbers
        way = SmoothingSpline(step, estimated_jitter(time, values, step * NOISE_OF_RESOLUTION))
    if isinstance(way, SmoothingSpline):
        return way.fitted(time, values), way.description
    first, second = way.derivatives(time, values)
    noise, jitter, gap = step * NOISE_OF_RESOLUTION, 0.0, np.gradient(time)
    missed = np.zeros((2, len(time)))
    if given is None and np.ptp(values) > 0.0:
        noise = max(noise, estimated_noise(time, values))
        jitter = estimated_jitter(time, values, noise)
        # Error of the parabola's speed and acceleration due to the change of acceleration, larger for unequal steps.
        unequal = np.diff(time, 2, prepend=2 * time[0] - time[1], append=2 * time[-1] - time[-2])
        jerk = np.gradient(second, time)
        missed[0] = (jerk * gap**2 / 6.0) ** 2
        missed[1] = (jerk * unequal / 3.0) ** 2 + (np.gradient(jerk, time) * gap**2 / 12.0) ** 2
    variance = noise**2 + (jitter * first) ** 2
    each = np.stack([variance, variance / (2 * gap**2) + missed[0], 6 * variance / gap**4 + missed[1]], axis=1)
    return Fitted(np.stack([values, first, second]), each[:, :, None] * np.eye(3)), way.description


def _steps(arm: Arm, resolution: Any) -> list[float | None]:
    """The given resolution of each joint; None if it is to be detected."""
    if resolution is None:
        return [None] * arm.n
    each = np.full(arm.n, resolution) if axes_of(resolution) == 0 else resolution
    steps = checked_array(each, (arm.n,), "resolution")
    if (steps < 0.0).any():
        raise InputError(Fault("resolution", "must not be negative [rad or m]", steps.tolist()))
    return [float(step) for step in steps]
