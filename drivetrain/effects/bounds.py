"""From the current that an effect takes or adds at each instant to what leaving it out can change."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects.estimate import Conditions, Estimate, TaskSeries

LARGEST_ANSWER = 1.0 + 2.0 * math.exp(-2.0)
"""Of a position loop damped critically, beside any torque that stays within a bound: the area under the size of its
impulse response ``(2 w - w^2 t) exp(-w t)``. The position itself goes no further than bound over stiffness."""
OVERSHOOT = 1.2  # of a position loop damped critically, behind a step of torque: 1 + exp(-2), and a little
JUMP = 1e-9  # s: two samples so close are the two sides of a jump


def bounded(
    conditions: Conditions, error: Array, why: str, *, deviation: float = 0.0, power: Array | None = None,
    valid: bool = True,
) -> Estimate:  # fmt: skip
    """An estimate from a bound on the error of the current.

    The largest current changes by no more than the largest error, the RMS by no more than the RMS of the error (the
    triangle inequality), the copper loss by twice that share and its square, and the rise by as much over what the
    warmth of the winding adds.

    Args:
        error: Bound on what the current differs by at each instant of the series [A], (N,).
        deviation: Of the joint's position [rad or m].
        power: That the effect puts into the motor's housing [W], (N,).
    """
    series = conditions.series
    if series is None or not conditions.rms_current > 0.0:
        return Estimate(valid=False, why="the task is not known: keep it")
    peak = float(np.abs(error).max()) / conditions.peak_current
    rms = rms_of(error, series.time) / conditions.rms_current
    room = 1.0 - conditions.heat_gain * (1.0 + rms) ** 2
    if not room > 0.0:
        return Estimate(peak, rms, math.inf, deviation, False, "the winding's heat is near running away: keep it")
    heat = (2.0 * rms + rms * rms) / room
    if power is not None:
        heat += conditions.housing_resistance * mean_of(np.abs(power), series.time) / conditions.rise / room
    return Estimate(peak, rms, heat, deviation, valid and conditions.free, why)


def mean_of(values: Array, time: Array) -> float:
    """Mean over time of what is linear between samples.

    Args:
        values: (N,).
        time: Never decreasing [s], (N,).
    """
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def rms_of(values: Array, time: Array) -> float:
    """Root of the mean square over time of what is linear between samples.

    Args:
        values: (N,).
        time: Never decreasing [s], (N,).
    """
    square = (values[:-1] ** 2 + values[:-1] * values[1:] + values[1:] ** 2) / 3.0
    return math.sqrt(float(square @ np.diff(time)) / float(time[-1] - time[0]))


def lagging(series: TaskSeries, bandwidth: float) -> Array:
    """What a first-order lag does to the current.

    Args:
        bandwidth: Of the lag [rad/s].

    Returns:
        Current less lagging current [A], (N,), exact for a current that is linear between samples.
    """
    error = np.zeros(len(series.time))
    for k in range(len(error) - 1):
        step, jump = series.time[k + 1] - series.time[k], series.current[k + 1] - series.current[k]
        if step <= JUMP:
            error[k + 1] = error[k] + jump
            continue
        # e' = slope - w e, from e = I - lagging I.
        fade, settled = math.exp(-bandwidth * step), jump / step / bandwidth
        error[k + 1] = settled + (error[k] - settled) * fade
    return error


def swinging(series: TaskSeries, frequency: float, damping: float) -> Array:
    """How far a spring that carries the torque swings beside it.

    Args:
        frequency: Of the load on the spring, its other end held [rad/s].
        damping: As a share of the critical one [-].

    Returns:
        Envelope of the spring's torque less the task's [N m or N], (N,), not negative; exact for a torque that is
        linear between samples, each bend and each jump of which sets it swinging.

    Reference:
        With T the torque of the task and S that of the spring, S'' / w^2 + 2 z S' / w + S = T, as the load stays
        behind by S / K while the other end follows the command; e = S - T then follows e'' + 2 z w e' + w^2 e = -T''.
    """
    z = min(damping, 0.99)
    turned = frequency * math.sqrt(1.0 - z * z)
    time, torque = series.time, series.torque
    envelope, error, rate, slope = np.zeros(len(time)), 0.0, 0.0, 0.0
    for k in range(len(time) - 1):
        step, jump = time[k + 1] - time[k], torque[k + 1] - torque[k]
        if step <= JUMP:
            error -= jump
        else:
            # S' is continuous: at a bend the rate of e takes the change of slope.
            rate -= jump / step - slope
            slope = jump / step
            settled = -2.0 * z / frequency * slope
            a, b = error - settled, (rate + z * frequency * (error - settled)) / turned
            fade, c, s = math.exp(-z * frequency * step), math.cos(turned * step), math.sin(turned * step)
            error = settled + fade * (a * c + b * s)
            rate = fade * ((b * turned - z * frequency * a) * c - (a * turned + z * frequency * b) * s)
            envelope[k] = max(envelope[k], abs(settled) + math.hypot(a, b))
        envelope[k + 1] = abs(error) if step <= JUMP else abs(settled) + fade * math.hypot(a, b)
    return envelope
