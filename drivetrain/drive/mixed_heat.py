"""Winding and housing temperature of a motor that is used for several repeated cycles, each for a share of the time.

How long each part is run before the next one takes over is not known. Assumed is, on the safe side for the winding:

- Parts alternate fast against the housing, so all of them share one mean housing temperature, that of the mean heat
  of the mix. (A part that is run for longer than the housing's time constant is a task of its own: judge it alone.)
- Parts alternate slowly against the winding, so in each part the winding comes to that part's own periodic state
  above the common housing. Faster alternation only evens its temperature out.
- A motor whose sheet knows one node only has no housing to even heat out: each part comes to its own periodic state,
  and the hottest counts.

So each part is a periodic cycle with a constant heat into its housing, which the other parts bring or take away: it is
such that the mean housing temperature is the common one, and over the mix, by shares of time, these heats cancel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.heat import PeriodicTemperature, settled
from drivetrain.drive.heat_kernels import cycle_map, cycle_trace
from drivetrain.drive.motor import Motor, torque_constant
from drivetrain.drive.periodic_rise import (
    GROWN_BEYOND,
    CycleLosses,
    PeriodicRise,
    cycle_losses,
    kernel_input,
    mean_rise,
    one_node,
    periodic_rise,
    weakened,
)
from drivetrain.drive.thermal_network import ThermalNetwork


class Use(NamedTuple):
    """How a motor is used.

    Attributes:
        parts: Samples of each repeated cycle, one slice each, in their order.
        shares: Of the time, one a part, together 1.
    """

    parts: Sequence[slice]
    shares: Sequence[float]


class MixedRise(NamedTuple):
    """The state of a mix, as rises over ambient of (winding, housing).

    Attributes:
        starts: At the start of each part's cycle [K], (P, 2).
        means: Over each part [K], (P, 2).
        brought: Heat that the other parts bring into the housing [W], (P,).
        housing: Mean over the mix [K]; infinite when it runs away.
    """

    starts: Array
    means: Array
    brought: Array
    housing: float


def mixed_temperature(
    network: ThermalNetwork,
    motor: Motor,
    time: Array,
    motor_torque: Array,
    use: Use,
    *,
    housing_loss: Array | None = None,
) -> PeriodicTemperature:
    """The temperatures of a mix of torque cycles, winding and magnets as warm as they make them.

    Args:
        network: From ``thermal_network``.
        motor: Resistance, torque constant and their change with temperature.
        time: Never decreasing [s], (N,), through one period of each part after another.
        motor_torque: Electromagnetic [N m], (N,), linear between samples of a part.
        use: Parts and their shares; one part gives what ``periodic_temperature`` does.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures and current; means are those over the mix, the spectral radius is not told (NaN).

    Raises:
        InputError: Lengths that differ, time that decreases, a part that takes no time.
    """
    torque = checked_array(motor_torque, (None,), "motor_torque")
    loss = np.zeros_like(torque) if housing_loss is None else housing_loss
    cold = [
        cycle_losses(network, motor, time[part], torque[part] / motor.torque_constant, loss[part]) for part in use.parts
    ]

    def state(magnets: float) -> MixedRise:
        """Of the mix, when the magnets have a temperature."""
        return mixed_rise(network, [weakened(one, motor, magnets) for one in cold], use.shares)

    magnets, converged = settled(lambda magnets: network.ambient + state(magnets).housing, network.ambient)
    shown = magnets if math.isfinite(magnets) else network.ambient
    current = torque / torque_constant(motor, shown)
    warm = [weakened(one, motor, magnets) for one in cold]
    return _result(network, (time, current, use), warm, state(magnets), (shown, converged))


def mixed_temperature_of_current(
    network: ThermalNetwork,
    motor: Motor,
    time: Array,
    current: Array,
    use: Use,
    *,
    housing_loss: Array | None = None,
) -> PeriodicTemperature:
    """The temperatures of a mix of current cycles, windings as warm as they make them.

    Args:
        network: From ``thermal_network``.
        motor: Resistance and its change with temperature.
        time: Never decreasing [s], (N,), through one period of each part after another.
        current: [A], DC equivalent, (N,), linear between samples of a part.
        use: Parts and their shares; one part gives what ``temperature_of_current`` does.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures; the magnets decide nothing here and are at the mean housing temperature.

    Raises:
        InputError: Lengths that differ, time that decreases, a part that takes no time.
    """
    current = checked_array(current, (None,), "current")
    loss = np.zeros_like(current) if housing_loss is None else housing_loss
    losses = [cycle_losses(network, motor, time[part], current[part], loss[part]) for part in use.parts]
    state = mixed_rise(network, losses, use.shares)
    return _result(network, (time, current, use), losses, state, (network.ambient + state.housing, True))


def mixed_rise(network: ThermalNetwork, losses: Sequence[CycleLosses], shares: Sequence[float]) -> MixedRise:
    """The rises of a mix.

    Args:
        network: Its resistances and capacities.
        losses: Of one cycle of each part.
        shares: Of the time, one a part.

    Returns:
        Rises; infinite in a runaway: of the housing's mean, or of a winding whose housing stays as it is.
    """
    if not all(np.isfinite(one.copper).all() for one in losses):
        return _runaway(len(losses))
    if one_node(network):
        return _each_alone(network, losses, shares)
    answers = [_answer(network, one) for one in losses]
    if any(answer is None for answer in answers):
        return _runaway(len(losses))
    found = [answer for answer in answers if answer is not None]
    needed = sum(share * one.brought for share, one in zip(shares, found, strict=True))
    slope = sum(share * one.brought_slope for share, one in zip(shares, found, strict=True))
    if not slope > 0.0:  # a warmer housing would need no more heat: it grows for ever
        return _runaway(len(losses))
    housing = -needed / slope
    return MixedRise(
        np.array([one.start + housing * one.start_slope for one in found]),
        np.array([(one.winding + housing * one.winding_slope, housing) for one in found]),
        np.array([one.brought + housing * one.brought_slope for one in found]),
        housing,
    )


class _Answer(NamedTuple):
    """A part's periodic state with a mean housing rise of h: value + h slope, each.

    Start of the cycle [K], mean winding [K], heat that must be brought into the housing [W].
    """

    start: Array
    start_slope: Array
    winding: float
    winding_slope: float
    brought: float
    brought_slope: float


def _answer(network: ThermalNetwork, losses: CycleLosses) -> _Answer | None:
    """None where the winding runs away although the housing stays as it is."""
    if network.winding_capacity is None:
        return _mean_answer(network, losses)
    steps, growth, winding, housing, rates = kernel_input(network, losses)
    if not float(steps @ growth) < rates[0] * float(steps.sum()):
        return None
    cycle = cycle_map(steps, growth, winding, housing, rates)
    unit = np.full_like(housing, rates[2] * network.resistance_winding_housing)  # of one watt into the housing
    pushed = cycle_map(steps, growth, np.zeros_like(winding), unit, rates)
    if not max(np.abs(cycle).max(), np.abs(pushed).max()) < GROWN_BEYOND:
        return None
    length = float(steps.sum())
    matrix, right = np.zeros((3, 3)), np.zeros((3, 2))
    matrix[:2, :2], matrix[:2, 2] = np.eye(2) - cycle[:, :2], -pushed[:, 2]
    matrix[2, :2], matrix[2, 2] = cycle[1, 3:5] / length, pushed[1, 5] / length
    right[:2, 0], right[2] = cycle[:, 2], (-cycle[1, 5] / length, 1.0)
    try:
        solved: Array = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:  # within the cycle the winding grows by more than rounding leaves digits for
        return None
    row = np.array([*cycle[0, 3:5], pushed[0, 5]]) / length
    means = row @ solved
    return _Answer(
        solved[:2, 0], solved[:2, 1], float(means[0] + cycle[0, 5] / length), float(means[1]), *solved[2].tolist()
    )


def _mean_answer(network: ThermalNetwork, losses: CycleLosses) -> _Answer | None:
    """The same for temperatures that do not move within the cycle."""
    copper, slope, loss = _means(losses)
    inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
    left = 1.0 - inner * slope
    if not left > 0.0:
        return None
    winding, winding_slope = inner * copper / left, 1.0 / left
    start, start_slope = np.array([winding, 0.0]), np.array([winding_slope, 1.0])
    return _Answer(start, start_slope, winding, winding_slope, -loss - copper / left, 1.0 / outer - slope / left)


def _each_alone(network: ThermalNetwork, losses: Sequence[CycleLosses], shares: Sequence[float]) -> MixedRise:
    """Of one node: every part in its own periodic state."""
    rise_of = mean_rise if network.winding_capacity is None else periodic_rise
    rises: list[PeriodicRise] = [rise_of(network, one) for one in losses]
    if not all(np.isfinite(one.mean).all() for one in rises):
        return _runaway(len(losses))
    hottest = max(float(one.mean[1]) for one in rises)  # whose magnets are the weakest
    starts, means = (np.array([getattr(one, name) for one in rises]) for name in ("start", "mean"))
    return MixedRise(starts, means, np.zeros(len(losses)), hottest)


def _means(losses: CycleLosses) -> tuple[float, float, float]:
    weights = losses.steps / losses.steps.sum()
    copper, slope, loss = (float(weights @ part) for part in (losses.copper, losses.slope, losses.housing))
    return copper, slope, loss


def _runaway(parts: int) -> MixedRise:
    endless = np.full((parts, 2), np.inf)
    return MixedRise(endless, endless, np.zeros(parts), math.inf)


def _result(
    network: ThermalNetwork,
    electrical: tuple[Array, Array, Use],
    losses: Sequence[CycleLosses],
    rise: MixedRise,
    magnets: tuple[float, bool],
) -> PeriodicTemperature:
    """The states traced through the parts, in degrees."""
    time, current, use = electrical
    winding, housing = np.full((2, current.size), np.inf)
    peak, peak_time = -math.inf, float(time[0])
    runaway = not math.isfinite(rise.housing)
    for i, part in enumerate(() if runaway else use.parts):
        rises, highest, at = np.tile(rise.means[i], (part.stop - part.start, 1)), float(rise.means[i, 0]), 0.0
        if network.winding_capacity is not None:
            pushed = losses[i]._replace(housing=losses[i].housing + rise.brought[i])
            rises, highest, at = cycle_trace(*kernel_input(network, pushed), rise.starts[i])
            if one_node(network):
                rises[:, 1] = rises[:, 0]
        winding[part], housing[part] = network.ambient + rises[:, 0], network.ambient + rises[:, 1]
        if highest > peak:
            peak, peak_time = highest, float(time[part.start]) + at
    mean = np.asarray(use.shares) @ np.where(np.isfinite(rise.means), rise.means, 0.0)
    return PeriodicTemperature(
        winding=winding,
        housing=housing,
        current=current,
        mean_winding=math.inf if runaway else network.ambient + float(mean[0]),
        mean_housing=math.inf if runaway else network.ambient + float(mean[1]),
        peak_winding=math.inf if runaway else network.ambient + peak,
        peak_time=peak_time,
        magnet_temperature=magnets[0],
        spectral_radius=math.nan,
        runaway=runaway,
        converged=magnets[1],
        ripple_known=network.winding_capacity is not None,
    )
