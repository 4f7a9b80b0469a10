"""The periodic thermal state of a cycle of losses, found without simulating cycles."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.heat_kernels import cycle_map
from drivetrain.drive.motor import Motor, copper_coefficient, torque_constant, winding_resistance
from drivetrain.drive.thermal_network import ThermalNetwork
from drivetrain.errors import Fault, InputError

STEADY = 1e4  # cycles that a housing of unknown capacity outlasts: it rests at its mean

GROWN_BEYOND = 1e100  # a map of a cycle whose losses run away at once; squares of less are still numbers


class CycleLosses(NamedTuple):
    """A cycle's losses, one value an interval, each (M,).

    Attributes:
        steps: Length of the interval [s].
        copper: Copper loss with the winding at ambient temperature [W].
        slope: Of the copper loss with winding temperature [W/K].
        housing: Other losses, into the housing [W].
    """

    steps: Array
    copper: Array
    slope: Array
    housing: Array


class PeriodicRise(NamedTuple):
    """The periodic state of a cycle, as rises over ambient of (winding, housing).

    Attributes:
        start: At the start of the cycle [K], (2,).
        mean: Over the cycle [K], (2,).
        spectral_radius: Share of a small extra rise left after a cycle; NaN for temperatures that do not move.
    """

    start: Array
    mean: Array
    spectral_radius: float


_RUNAWAY = PeriodicRise(np.full(2, np.inf), np.full(2, np.inf), math.inf)


def cycle_losses(
    network: ThermalNetwork, motor: Motor, time: Array, current: Array, housing_loss: Array | None
) -> CycleLosses:
    """The losses of each interval, from the exact integral of the square of a current linear in time.

    Args:
        network: Its ambient temperature.
        motor: Resistance and its change with temperature.
        time: Never decreasing [s], (N,); one sample is a constant load.
        current: [A], (N,), linear between samples.
        housing_loss: [W], (N,), linear between samples; None: none.

    Returns:
        One value an interval.

    Raises:
        InputError: Lengths that differ, time that decreases or stands still.
    """
    time = checked_array(time, (current.size,), "time")
    loss = np.zeros_like(current) if housing_loss is None else checked_array(housing_loss, time.shape, "housing_loss")
    steps = np.diff(time)
    if (steps < 0.0).any():
        raise InputError(Fault(f"time[{int(np.argmax(steps < 0.0)) + 1}]", "must not decrease"))
    if time.size > 1 and time[-1] == time[0]:
        raise InputError(Fault("time", "must last longer than 0 s", float(time[-1])))
    if time.size == 1:  # any length will do for a load that never changes
        steps, current, loss = np.ones(1), np.repeat(current, 2), np.repeat(loss, 2)
    square = (current[:-1] ** 2 + current[:-1] * current[1:] + current[1:] ** 2) / 3.0
    slope = motor.resistance * copper_coefficient(motor.reference_temperature)
    copper = square * winding_resistance(motor, network.ambient)
    return CycleLosses(steps, copper, square * slope, 0.5 * (loss[:-1] + loss[1:]))


def weakened(losses: CycleLosses, motor: Motor, magnets: float) -> CycleLosses:
    """The losses when the magnets are warm: the same torque takes more current.

    Args:
        losses: At reference magnet temperature.
        motor: The change of its torque constant.
        magnets: Their temperature [C].

    Returns:
        The same cycle with more copper loss; infinite where nothing is left of the torque constant.
    """
    constant = torque_constant(motor, magnets) if math.isfinite(magnets) else 0.0
    scale = (motor.torque_constant / constant) ** 2 if constant > 0.0 else math.inf
    if scale == math.inf:
        return losses._replace(copper=np.full_like(losses.copper, np.inf))
    return losses._replace(copper=scale * losses.copper, slope=scale * losses.slope)


def mean_rise(network: ThermalNetwork, losses: CycleLosses) -> PeriodicRise:
    """The rises of temperatures that do not move: mean losses in balance with the flow of heat.

    Args:
        network: Its resistances.
        losses: Of the cycle.

    Returns:
        Start and mean alike; infinite in a runaway: slope of the loss times resistance is 1 or more.
    """
    if not np.isfinite(losses.copper).all():
        return _RUNAWAY
    weights = losses.steps / losses.steps.sum()
    copper, slope, loss = (float(weights @ part) for part in (losses.copper, losses.slope, losses.housing))
    inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
    gain = slope * (inner + outer)
    if not gain < 1.0:
        return _RUNAWAY
    winding_loss = (copper + slope * outer * loss) / (1.0 - gain)
    housing = outer * (winding_loss + loss)
    mean = np.array([housing + inner * winding_loss, housing])
    return PeriodicRise(mean, mean, math.nan)


def periodic_rise(network: ThermalNetwork, losses: CycleLosses) -> PeriodicRise:
    """The rises that one exact cycle brings back to themselves.

    Args:
        network: Its resistances and capacities.
        losses: Of the cycle.

    Returns:
        Rises at the start and over the cycle; infinite in a runaway: spectral radius 1 or more.
    """
    if not np.isfinite(losses.copper).all():
        return _RUNAWAY
    cycle = cycle_map(*kernel_input(network, losses))
    transfer = cycle[:, :2]
    if not np.abs(cycle).max() < GROWN_BEYOND:  # NaN too
        return _RUNAWAY
    # Both rises only ever warm each other, so the larger eigenvalue is real and the radius.
    mean = 0.5 * (transfer[0, 0] + transfer[1, 1])
    spread = (0.5 * (transfer[0, 0] - transfer[1, 1])) ** 2 + transfer[0, 1] * transfer[1, 0]
    radius = mean + math.sqrt(max(spread, 0.0))  # rounding may leave less than nothing
    if not radius < 1.0:
        return _RUNAWAY._replace(spectral_radius=radius)
    start = np.asarray(np.linalg.solve(np.eye(2) - transfer, cycle[:, 2]), dtype=np.float64)
    means: Array = (cycle[:, 3:5] @ start + cycle[:, 5]) / losses.steps.sum()
    return PeriodicRise(start, np.repeat(means[:1], 2) if one_node(network) else means, radius)


def one_node(network: ThermalNetwork) -> bool:
    """Whether winding and housing are one.

    Args:
        network: Its resistances.

    Returns:
        True when no resistance lies between them.
    """
    return network.resistance_winding_housing == 0.0


def kernel_input(network: ThermalNetwork, losses: CycleLosses) -> tuple[Array, Array, Array, Array, Array]:
    """Losses over capacities and rates of heat flow, as the kernels take them.

    Args:
        network: Its winding capacity is known.
        losses: Of the cycle.

    Returns:
        The arguments of ``cycle_map``.
    """
    capacity = network.winding_capacity or math.nan
    inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
    growth = losses.slope / capacity
    if one_node(network):
        rate = 1.0 / (outer * capacity)
        source = (losses.copper + losses.housing) / capacity
        return losses.steps, growth, source, np.zeros_like(source), np.array([rate, 0.0, 0.0, rate])
    housing = network.housing_capacity or STEADY * float(losses.steps.sum()) / outer
    exchange = 1.0 / inner
    rates = np.array([exchange / capacity, exchange / capacity, exchange / housing, (exchange + 1.0 / outer) / housing])
    return losses.steps, growth, losses.copper / capacity, losses.housing / housing, rates
