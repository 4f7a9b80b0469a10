"""Winding and housing temperature of a motor that repeats one cycle for ever, or a mix of several; solved directly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

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
)
from drivetrain.drive.thermal.thermal_network import ThermalNetwork, thermal_network
from drivetrain.errors import Fault, InputError
from drivetrain.jit import kernel
from drivetrain.records import UNKNOWN, as_record

__all__ = [
    "Mix",
    "PeriodicTemperature",
    "ThermalNetwork",
    "mixed_temperature",
    "mixed_temperature_of_current",
    "periodic_temperature",
    "rms_rule_validity",
    "temperature_of_current",
    "thermal_network",
]

OVERLOAD_SHARE = 0.05  # of the winding's time constant: the longest overload the RMS rule allows


class Mix(NamedTuple):
    """How a motor is used."""

    parts: Sequence[slice]  # samples of each repeated cycle, one slice each, in their order
    shares: Sequence[float]  # of the time, one a part, together 1


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
    """The temperatures of a torque cycle repeated without end, with winding and magnets as warm as they make them.

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
    return mixed_temperature(network, motor, time, torque, _one(torque), housing_loss=housing_loss)


def temperature_of_current(
    network: ThermalNetwork, motor: Motor, time: Array, current: Array, *, housing_loss: Array | None = None
) -> PeriodicTemperature:
    """The temperatures of a current cycle repeated without end, with the winding as warm as it makes it.

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
    """The temperatures of a mix of torque cycles, winding and magnets as warm as they make them."""
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
    """The temperatures of a mix of current cycles, windings as warm as they make them."""
    amperes = checked_array(current, (None,), "current")
    slope = motor.resistance * copper_coefficient(motor.reference_temperature) if warming else 0.0
    cold = winding_resistance(motor, network.ambient) if warming else motor.resistance
    return _solved(network, Copper(cold, slope, 1.0, 0.0, 0.0), time, amperes, mix, housing_loss)


def _one(values: Array) -> Mix:
    """All samples as one part."""
    return Mix((slice(0, np.size(values)),), (1.0,))


def _solved(
    network: ThermalNetwork, copper: Copper, time: Array, values: Array, mix: Mix, housing_loss: Array | None
) -> PeriodicTemperature:
    """The state of a mix, of a torque or of a current."""
    time = checked_array(time, (values.size,), "time")
    loss = np.zeros_like(values) if housing_loss is None else checked_array(housing_loss, time.shape, "housing_loss")
    for part in mix.parts:
        checked_steps(time[part])
    losses, ambient, single = new_losses(values.size), network.ambient, len(mix.parts) == 1
    heat = _heat(
        nodes_of(network), copper, periods_of(time, mix.parts, mix.shares), losses, new_parts(len(mix.parts)), ambient,
        values, loss,
    )  # fmt: skip
    runaway, start = not math.isfinite(heat.peak), float(time[mix.parts[heat.peak_part]][0])
    return PeriodicTemperature(
        winding=losses.winding_at[: values.size],
        housing=losses.housing_at[: values.size],
        current=values,
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


def checked_steps(time: Array) -> None:
    """Raise an InputError where time decreases or stands still."""
    steps = np.diff(time)
    if (steps < 0.0).any():
        raise InputError(Fault(f"time[{int(np.argmax(steps < 0.0)) + 1}]", "must not decrease"))
    if len(steps) and not steps.sum() > 0.0:
        raise InputError(Fault("time", "must last longer than 0 s", float(time[-1])))


def nodes_of(network: ThermalNetwork) -> Nodes:
    """The nodes of a network, NaN where a capacity is unknown."""
    capacities = (network.winding_capacity, network.housing_capacity)
    inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
    return Nodes(inner, outer, *(UNKNOWN if one is None else one for one in capacities))


@kernel
def _heat(
    nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, ambient: float, values: Array, loss: Array
) -> Any:
    """``periodic_heat`` of a torque or current and the loss in the housing."""
    interval_means(values, loss, losses)
    return periodic_heat(nodes, copper, periods, losses, parts, ambient)


def rms_rule_validity(
    network: ThermalNetwork,
    time: Array,
    current: Array,
    continuous_current: float,
    *,
    parts: Sequence[slice] = (),
) -> str | None:
    """What stands against judging a cycle by its RMS current alone: overloads that are long for the winding.

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
    # Share of each interval that is above: all of it, none, or up to where the line crosses zero.
    total = np.abs(first) + np.abs(last)
    positive = np.maximum(first, 0.0) + np.maximum(last, 0.0)
    duration = steps * np.divide(positive, total, out=np.zeros_like(total), where=total > 0.0)
    breaks = np.flatnonzero(~above)
    sums = np.add.reduceat(np.append(duration, 0.0), breaks)
    if above[0] and above[-1]:  # the stretch that runs over the end of the cycle
        sums[-1] += duration[: breaks[0]].sum()
    before = duration[: breaks[0]].sum()
    return float(max(sums.max(), before))
