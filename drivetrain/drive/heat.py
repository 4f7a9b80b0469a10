"""Winding and housing temperature of a motor that repeats one cycle for ever, solved directly."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.heat_kernels import cycle_trace
from drivetrain.drive.motor import Motor, torque_constant
from drivetrain.drive.periodic_rise import (
    CycleLosses,
    PeriodicRise,
    cycle_losses,
    kernel_input,
    mean_rise,
    one_node,
    periodic_rise,
    weakened,
)
from drivetrain.drive.thermal_network import ThermalNetwork, thermal_network

__all__ = [
    "PeriodicTemperature",
    "ThermalNetwork",
    "periodic_temperature",
    "rms_rule_validity",
    "temperature_of_current",
    "thermal_network",
]

MAGNET_TOLERANCE = 1e-6  # K, between the magnet temperature put in and the one that comes out
OVERLOAD_SHARE = 0.05  # of the winding's time constant: the longest overload the RMS rule allows


@dataclass(frozen=True, eq=False)
class PeriodicTemperature:
    """The temperatures of the cycle that repeats for ever; infinite when they run away.

    Attributes:
        winding, housing: At each sample [C], (N,); the mean everywhere when ``ripple_known`` is False.
        current: At each sample [A], (N,), with the magnets at ``magnet_temperature``; of cold magnets in a runaway.
        mean_winding, mean_housing: Over the cycle [C].
        peak_winding: Largest, also between samples [C].
        peak_time: Instant of it [s].
        magnet_temperature: That the torque constant was taken at: the mean housing temperature [C].
        spectral_radius: Share of a small extra temperature that is left after a cycle; 1 or more: it grows for ever.
            NaN when ``ripple_known`` is False.
        runaway: No steady temperature exists: losses grows faster with temperature than cooling.
        converged: False when magnet temperature and mean housing temperature could not be matched.
        ripple_known: False when the winding's time constant is unknown.
    """

    winding: Array
    housing: Array
    current: Array
    mean_winding: float
    mean_housing: float
    peak_winding: float
    peak_time: float
    magnet_temperature: float
    spectral_radius: float
    runaway: bool
    converged: bool
    ripple_known: bool


def periodic_temperature(
    network: ThermalNetwork, motor: Motor, time: Array, motor_torque: Array, *, housing_loss: Array | None = None
) -> PeriodicTemperature:
    """The temperatures of a torque cycle that repeats for ever, with winding and magnets as warm as they make them.

    The resistance follows the winding at every instant, the torque constant the mean housing temperature.

    Args:
        network: From ``thermal_network``.
        motor: Resistance, torque constant and their change with temperature.
        time: Never decreasing [s], (N,); the cycle ends where it starts again. One sample is a constant load.
        motor_torque: Electromagnetic [N m], (N,), linear between samples.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures and current in the periodic state.

    Raises:
        InputError: Lengths that differ, time that decreases or stands still.
    """
    torque = checked_array(motor_torque, (None,), "motor_torque")
    cold = cycle_losses(network, motor, time, torque / motor.torque_constant, housing_loss)

    def mean_housing(magnets: float, rise_of: Callable[[ThermalNetwork, CycleLosses], PeriodicRise]) -> float:
        """Mean housing temperature when the magnets have a temperature."""
        return network.ambient + float(rise_of(network, weakened(cold, motor, magnets)).mean[1])

    guess, _ = settled(lambda magnets: mean_housing(magnets, mean_rise), network.ambient)
    rise_of = mean_rise if network.winding_capacity is None else periodic_rise
    start = guess if math.isfinite(guess) else network.ambient
    magnets, converged = settled(lambda magnets: mean_housing(magnets, rise_of), start)
    losses = weakened(cold, motor, magnets)
    shown = magnets if math.isfinite(magnets) else network.ambient
    current = torque / torque_constant(motor, shown)
    return _result(
        network, losses, rise_of(network, losses), _Electrical(float(np.min(time)), current, shown, converged)
    )


def temperature_of_current(
    network: ThermalNetwork, motor: Motor, time: Array, current: Array, *, housing_loss: Array | None = None
) -> PeriodicTemperature:
    """The temperatures of a current cycle that repeats for ever, with the winding as warm as it makes it.

    Args:
        network: From ``thermal_network``.
        motor: Resistance and its change with temperature.
        time: Never decreasing [s], (N,); the cycle ends where it starts again. One sample is a constant load.
        current: [A], DC equivalent, (N,), linear between samples.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures in the periodic state; the magnets decide nothing here and are at the mean housing temperature.

    Raises:
        InputError: Lengths that differ, time that decreases or stands still.
    """
    current = checked_array(current, (None,), "current")
    losses = cycle_losses(network, motor, time, current, housing_loss)
    rise = (mean_rise if network.winding_capacity is None else periodic_rise)(network, losses)
    magnets = network.ambient + float(rise.mean[1])
    return _result(network, losses, rise, _Electrical(float(np.min(time)), current, magnets, True))


def rms_rule_validity(
    network: ThermalNetwork,
    time: Array,
    current: Array,
    continuous_current: float,
    *,
    parts: Sequence[slice] = (),
) -> str | None:
    """What stands against judging a cycle by its RMS current alone: overloads that are long for the winding.

    Args:
        network: Its winding time constant is what overloads are short against.
        time: Never decreasing [s], (N,); the cycle ends where it starts again.
        current: [A], (N,), linear between samples.
        continuous_current: Above which the current overloads the motor [A].
        parts: Samples that repeat by themselves, one slice each; empty: all together.

    Returns:
        A remark, or None when the longest overload is at most 5 % of the winding time constant.

    Reference:
        Overload periods far shorter than the copper time constant (Parker K series, p. 12); the intermittent-duty
        formula is to be used above about 5 % of the time constant (Danaher; EB-10X, p. 33).
    """
    time, excess = np.asarray(time, dtype=np.float64), np.abs(current) - continuous_current
    longest = max(_longest_overload(time[part], excess[part]) for part in parts or (slice(None),))
    constant = network.winding_time_constant
    if longest == 0.0 or (constant is not None and longest <= OVERLOAD_SHARE * constant):
        return None
    if math.isinf(longest):
        return "the current is above the continuous current all the time"
    if constant is None:
        return f"overload of {longest:.3g} s, winding time constant unknown: the RMS current may hide a hot winding"
    return (
        f"overload of {longest:.3g} s is {100.0 * longest / constant:.3g} % of the winding time constant "
        f"({constant:.3g} s): the RMS current hides a hotter winding, judge the winding temperature"
    )


def settled(mean_housing: Callable[[float], float], start: float) -> tuple[float, bool]:
    """The magnet temperature that the mean housing temperature confirms.

    Weaker magnets heat more, and the more the warmer they are: a convex map, on which the secant from the cold side
    never passes the answer; a slope of 1 or more means there is none.

    Args:
        mean_housing: Mean housing temperature that magnets of a temperature make [C].
        start: Below the answer [C].

    Returns:
        The temperature [C], infinite where there is none, and whether it was found.
    """
    previous, reached = start, mean_housing(start)
    magnets = reached
    for _ in range(40):
        if not math.isfinite(magnets):
            return math.inf, True
        if abs(magnets - previous) <= MAGNET_TOLERANCE:
            return magnets, True
        found = mean_housing(magnets)
        slope = (found - reached) / (magnets - previous)
        if slope >= 1.0:
            return math.inf, True
        previous, reached = magnets, found
        magnets = magnets + (found - magnets) / (1.0 - slope)
    return magnets, False


class _Electrical(NamedTuple):
    """What the result tells beside the temperatures."""

    start: float
    current: Array
    magnets: float
    converged: bool


def _result(
    network: ThermalNetwork, losses: CycleLosses, rise: PeriodicRise, electrical: _Electrical
) -> PeriodicTemperature:
    """The state traced through the cycle, in degrees."""
    ripple_known = network.winding_capacity is not None
    size = electrical.current.size
    runaway = not np.isfinite(rise.mean).all()
    rises, peak, peak_time = np.tile(rise.mean, (size, 1)), float(rise.mean[0]), 0.0
    if ripple_known and not runaway:
        rises, peak, peak_time = cycle_trace(*kernel_input(network, losses), rise.start)
        if one_node(network):
            rises[:, 1] = rises[:, 0]
    return PeriodicTemperature(
        winding=network.ambient + rises[:size, 0],
        housing=network.ambient + rises[:size, 1],
        current=electrical.current,
        mean_winding=network.ambient + float(rise.mean[0]),
        mean_housing=network.ambient + float(rise.mean[1]),
        peak_winding=network.ambient + peak,
        peak_time=electrical.start + (peak_time if size > 1 else 0.0),
        magnet_temperature=electrical.magnets,
        spectral_radius=rise.spectral_radius,
        runaway=runaway,
        converged=electrical.converged,
        ripple_known=ripple_known,
    )


def _longest_overload(time: Array, excess: Array) -> float:
    """The longest time for which an excess, linear between samples, stays positive in the repeated cycle [s]."""
    above = excess > 0.0
    if above.all():
        return math.inf
    if not above.any():
        return 0.0
    first, last, steps = excess[:-1], excess[1:], np.diff(time)
    # Share of each interval that is above: all of it, none, or up to where the line crosses zero.
    total = np.abs(first) + np.abs(last)
    positive = np.maximum(first, 0.0) + np.maximum(last, 0.0)
    lasting = steps * np.divide(positive, total, out=np.zeros_like(total), where=total > 0.0)
    breaks = np.flatnonzero(~above)
    sums = np.add.reduceat(np.append(lasting, 0.0), breaks)
    if above[0] and above[-1]:  # the stretch that runs over the end of the cycle
        sums[-1] += lasting[: breaks[0]].sum()
    before = lasting[: breaks[0]].sum()
    return float(max(sums.max(), before))
