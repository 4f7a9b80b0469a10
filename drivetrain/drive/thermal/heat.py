"""Periodic winding and housing temperature of a motor that repeats one cycle, or a mix of several; solved directly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.motor import Motor, copper_coefficient, torque_constant, winding_resistance
from drivetrain.drive.thermal.periodic_heat import (
    Copper,
    Nodes,
    copper_of,
    interval_means,
    new_losses,
    new_parts,
    periodic_heat,
    periods_of,
    trace_own_periods,
)
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.errors import Fault, InputError
from drivetrain.jit import kernel
from drivetrain.records import UNKNOWN, as_record

# Longest interval with changing heat, over the winding's time constant: its error is then about 0.1 % of the rise, or
# less. And most pieces of an interval.
LONGEST_INTERVAL, MOST_PIECES = 0.02, 1000
OVERLOAD_SHARE = 0.05  # longest overload that the RMS rule permits, over the winding's time constant


class Mix(NamedTuple):
    """Use of a motor as several cycles."""

    parts: Sequence[slice]  # samples of each cycle, one slice per part, in order
    shares: Sequence[float]  # share of the operating time of each part; the sum is 1


@dataclass(frozen=True, eq=False)
class PeriodicTemperature:
    """Temperatures in the periodic steady state of a repeated cycle; infinite after a thermal runaway.

    Attributes:
        winding, housing: Temperatures at the samples [C], (N,); constant at the mean if ``ripple_known`` is False.
        current: Current at the samples [A], (N,), with the magnets at ``magnet_temperature``; in a runaway with cold
            magnets.
        mean_winding, mean_housing: Mean temperatures over the cycle [C].
        peak_winding: Largest winding temperature, also between samples [C].
        peak_time: Instant of the largest winding temperature [s].
        magnet_temperature: Temperature of the torque constant: the mean housing temperature [C].
        spectral_radius: Share of a small temperature disturbance that remains after one cycle; at 1 or more it grows
            without bound. NaN if ``ripple_known`` is False.
        runaway: Whether no steady temperature exists, because losses grow faster with temperature than the cooling.
        converged: False if magnet temperature and mean housing temperature could not be matched.
        ripple_known: False if the winding's time constant is unknown.
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
    """Periodic temperatures of a repeated torque cycle, with resistance and torque constant at these temperatures.

    The resistance follows the winding temperature at every instant, the torque constant the mean housing temperature.

    Args:
        network: Thermal network from ``thermal_network``.
        motor: Motor with resistance, torque constant and their change with temperature.
        time: Times of the cycle, never decreasing [s], (N,); its end is the start of the next cycle. One sample is a
            constant load.
        motor_torque: Electromagnetic torque [N m], (N,), linear between samples.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures and current in the periodic state.

    Raises:
        InputError: Lengths differ, or time decreases or does not advance.
    """
    torque = checked_array(motor_torque, (None,), "motor_torque")
    return mixed_temperature(network, motor, time, torque, _one(torque), housing_loss=housing_loss)


def temperature_of_current(
    network: ThermalNetwork, motor: Motor, time: Array, current: Array, *, housing_loss: Array | None = None
) -> PeriodicTemperature:
    """Periodic temperatures of a repeated current cycle, with the resistance at the winding's temperature.

    Args:
        network: Thermal network from ``thermal_network``.
        motor: Motor with resistance and its change with temperature.
        time: Times of the cycle, never decreasing [s], (N,); its end is the start of the next cycle. One sample is a
            constant load.
        current: DC-equivalent current [A], (N,), linear between samples.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures in the periodic state; the magnets have no influence here and are at the mean housing temperature.

    Raises:
        InputError: Lengths differ, or time decreases or does not advance.
    """
    current = checked_array(current, (None,), "current")
    return mixed_temperature_of_current(network, motor, time, current, _one(current), housing_loss=housing_loss)


def mixed_temperature(
    network: ThermalNetwork,
    motor: Motor,
    time: Array,
    motor_torque: Array,
    mix: Mix,
    *,
    housing_loss: Array | None = None,
) -> PeriodicTemperature:
    """Periodic temperatures of a mix of torque cycles, with resistance and torque constant at these temperatures."""
    torque = checked_array(motor_torque, (None,), "motor_torque")
    copper = Copper(*(float(value) for value in copper_of(as_record(motor), network.ambient)))
    found = _solved(network, copper, time, torque, mix, housing_loss)
    magnets = network.ambient if found.runaway else found.magnet_temperature
    return replace(found, current=torque / torque_constant(motor, magnets), magnet_temperature=magnets)


def mixed_temperature_of_current(
    network: ThermalNetwork,
    motor: Motor,
    time: Array,
    current: Array,
    mix: Mix,
    *,
    housing_loss: Array | None = None,
    warming: bool = True,
) -> PeriodicTemperature:
    """Periodic temperatures of a mix of current cycles, with the resistance at the winding's temperature."""
    amperes = checked_array(current, (None,), "current")
    slope = motor.resistance * copper_coefficient(motor.reference_temperature) if warming else 0.0
    cold = winding_resistance(motor, network.ambient) if warming else motor.resistance
    return _solved(network, Copper(cold, slope, 1.0, 0.0, 0.0), time, amperes, mix, housing_loss)


def _one(values: Array) -> Mix:
    """A mix with all samples as its only part."""
    return Mix((slice(0, np.size(values)),), (1.0,))


def _solved(
    network: ThermalNetwork, copper: Copper, time: Array, values: Array, mix: Mix, housing_loss: Array | None
) -> PeriodicTemperature:
    """The periodic state of a mix, for a torque or a current."""
    time = checked_array(time, (values.size,), "time")
    loss = np.zeros_like(values) if housing_loss is None else checked_array(housing_loss, time.shape, "housing_loss")
    if not values.size:
        raise InputError(Fault("time", "must have at least one sample", time))
    for part in mix.parts:
        checked_steps(time[part])
    current = values
    given, (time, values, loss) = with_samples_between(network, (time, values, loss), mix.parts)
    mix = mix._replace(parts=[slice(given[part][0], given[part][-1] + 1) for part in mix.parts])
    losses, ambient, single = new_losses(values.size), network.ambient, len(mix.parts) == 1
    heat = _heat(
        nodes_of(network), copper, periods_of(time, mix.parts, mix.shares), losses, new_parts(len(mix.parts)), ambient,
        values, loss,
    )  # fmt: skip
    runaway, start = not math.isfinite(heat.peak), float(time[mix.parts[heat.peak_part]][0])
    return PeriodicTemperature(
        winding=losses.winding_at[: values.size][given],
        housing=losses.housing_at[: values.size][given],
        current=current,
        mean_winding=heat.winding,
        mean_housing=heat.housing,
        peak_winding=heat.peak,
        peak_time=start + (heat.peak_time if values.size > 1 else 0.0),
        magnet_temperature=math.inf if runaway else heat.magnets,
        spectral_radius=heat.radius if single else math.nan,
        runaway=runaway,
        converged=heat.converged,
        ripple_known=network.winding_capacity is not None,
    )


def with_samples_between(
    network: ThermalNetwork, columns: tuple[Array, ...], parts: Sequence[slice]
) -> tuple[NDArray[np.intp], tuple[Array, ...]]:
    """Columns (time first, linear between samples) with samples in between, and the places of those given.

    The solution has the mean heat of each interval. Where this changes within an interval that is not short against the
    winding's time constant, the winding would be too cold at its end.
    """
    time, *others = columns
    pieces = np.ones(len(time) - 1, dtype=np.intp)
    if network.winding_time_constant is not None:
        longest = LONGEST_INTERVAL * network.winding_time_constant
        within = np.minimum(np.ceil(np.diff(time) / longest), MOST_PIECES)
        changing = np.any([np.diff(one) != 0.0 for one in others], axis=0)
        changing[[part.stop - 1 for part in parts[:-1]]] = False
        pieces[changing] = np.maximum(within[changing], 1.0)
    given = np.concatenate([[0], np.cumsum(pieces)])
    every, before = np.interp(np.arange(given[-1] + 1), given, np.arange(len(time))), np.arange(len(time))
    return given, tuple(np.interp(every, before, one) for one in columns)


def checked_steps(time: Array) -> None:
    """Raise an InputError where time decreases or stands still."""
    steps = np.diff(time)
    if (steps < 0.0).any():
        raise InputError(Fault(f"time[{int(np.argmax(steps < 0.0)) + 1}]", "must not decrease"))
    if len(steps) and not steps.sum() > 0.0:
        raise InputError(Fault("time", "must last longer than 0 s", float(time[-1])))


def nodes_of(network: ThermalNetwork) -> Nodes:
    """The thermal nodes of a network; NaN for an unknown capacity."""
    capacities = (network.winding_capacity, network.housing_capacity)
    inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
    return Nodes(inner, outer, *(UNKNOWN if one is None else one for one in capacities))


@kernel
def _heat(
    nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, ambient: float, values: Array, loss: Array
) -> Any:
    """``periodic_heat`` for a torque or current and the loss in the housing."""
    interval_means(values, loss, losses)
    heat = periodic_heat(nodes, copper, periods, losses, parts, ambient)
    trace_own_periods(nodes, copper, periods, losses, parts, heat.magnets, ambient)
    return heat


def rms_rule_validity(
    network: ThermalNetwork,
    time: Array,
    current: Array,
    continuous_current: float,
    *,
    parts: Sequence[slice] = (),
) -> str | None:
    """Why a cycle cannot be checked by its RMS current alone: overloads too long for the winding. None if it can.

    They must be far shorter than the copper time constant (Parker K series, p. 12); the intermittent-duty formula is to
    be used above about 5 % of it (Danaher; EB-10X, p. 33).
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
        f"({constant:.3g} s): the RMS current hides a hotter winding, check the winding temperature"
    )


def _longest_overload(time: Array, excess: Array) -> float:
    """The longest time for which an excess, linear between samples, stays positive in the repeated cycle [s]."""
    above = excess > 0.0
    if above.all():
        return math.inf
    if not above.any():
        return 0.0
    first, last, steps = excess[:-1], excess[1:], np.diff(time)
    # Share of each interval above zero: all of it, none, or up to the zero crossing.
    total = np.abs(first) + np.abs(last)
    positive = np.maximum(first, 0.0) + np.maximum(last, 0.0)
    duration = steps * np.divide(positive, total, out=np.zeros_like(total), where=total > 0.0)
    breaks = np.flatnonzero(~above)
    sums = np.add.reduceat(np.append(duration, 0.0), breaks)
    if above[0] and above[-1]:  # the interval across the end of the cycle
        sums[-1] += duration[: breaks[0]].sum()
    before = duration[: breaks[0]].sum()
    return float(max(sums.max(), before))
