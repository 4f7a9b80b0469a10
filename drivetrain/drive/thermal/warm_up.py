"""Warm-up of a motor: temperatures over thousands of cycles, each of which is one exact affine map.

While a current cycle is repeated, the two temperature rises at its end are an affine function of those at its start.
Hours of cycles of a second cost one product of 2 x 2 matrices per cycle, and because there is no time integration no
pulse can be missed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.heat import checked_steps, nodes_of, with_samples_between
from drivetrain.drive.thermal.periodic_heat import (
    GROWN_BEYOND,
    copper_of,
    cycle_map,
    cycle_trace,
    flow_of,
    interval_means,
    new_losses,
    set_steps,
)
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.errors import Fault, raise_faults
from drivetrain.jit import kernel
from drivetrain.records import as_record


@dataclass(frozen=True, eq=False)
class WarmUp:
    """Temperatures over repeated cycles.

    Attributes:
        time: Start of each cycle, and end of the last one [s], (K + 1,).
        winding, housing: Temperatures at these times [C], (K + 1,); infinite after a thermal runaway.
        peak_winding: Largest winding temperature within the last cycle [C].
    """

    time: Array
    winding: Array
    housing: Array
    peak_winding: float


def warm_up(
    network: ThermalNetwork,
    motor: Motor,
    time: Any,
    current: Any,
    cycles: int,
    *,
    start: tuple[float, float] | None = None,
    housing_loss: Any = None,
) -> WarmUp:
    """Temperatures while a current cycle is repeated a number of times; the resistance follows the winding temperature.

    Args:
        network: Thermal network from ``thermal_network``, with a known winding capacity.
        motor: Motor with resistance and its change with temperature.
        time: Times of one cycle, never decreasing [s], (N,), N >= 2.
        current: DC-equivalent current [A], (N,), linear between samples.
        cycles: Number of cycles [-].
        start: Initial temperatures of winding and housing [C]; None: both at ambient.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures at the ends of all cycles.

    Raises:
        InputError: Lengths differ, time decreases or does not advance, the number of cycles is not a positive integer,
        or the winding capacity is unknown.
    """
    amperes = checked_array(current, (None,), "current")
    faults = []
    if isinstance(cycles, bool) or not isinstance(cycles, (int, np.integer)) or cycles < 1:
        faults.append(Fault("cycles", "must be a whole number from 1", cycles))
    if network.winding_capacity is None:
        problem = "is unknown, so how fast the winding warms is not known"
        faults.append(Fault("network.winding_capacity", problem))
    if amperes.size < 2:
        faults.append(Fault("current", "must be at least two samples of a cycle", amperes.tolist()))
    raise_faults(faults)
    loss = np.zeros(amperes.size) if housing_loss is None else housing_loss
    clock, loss = checked_array(time, amperes.shape, "time"), checked_array(loss, amperes.shape, "housing_loss")
    checked_steps(clock)
    _, (clock, amperes, loss) = with_samples_between(network, (clock, amperes, loss), (slice(None),))
    losses, ambient, copper = new_losses(amperes.size), network.ambient, copper_of(as_record(motor), network.ambient)
    rises = np.full((cycles + 1, 2), np.inf)
    rises[0] = checked_array((ambient,) * 2 if start is None else start, (2,), "start") - ambient
    cold, slope = float(copper.resistance), float(copper.slope)
    peak = _repeated(nodes_of(network), cold, slope, np.diff(clock), losses, amperes, loss, rises)
    housing = rises[:, 0] if network.resistance_winding_housing == 0.0 else rises[:, 1]
    length = float(clock[-1] - clock[0])
    return WarmUp(length * np.arange(cycles + 1.0), ambient + rises[:, 0], ambient + housing, ambient + peak)


@kernel
def _repeated(
    nodes: Any, cold: float, slope: float, steps: Array, losses: Any, current: Array, loss: Array, rises: Array
) -> float:
    """Fill the rises after each cycle, (K + 1, 2), until unbounded; return the winding's peak rise in the last one."""
    interval_means(current, loss, losses)
    count = len(steps)
    flow = flow_of(nodes, steps.sum(), cold, slope, 0.0)
    set_steps(steps, losses, 0, count, flow)
    whole = cycle_map(steps, losses, 0, count)
    for k in range(len(rises) - 1):
        winding = whole.ww * rises[k, 0] + whole.wh * rises[k, 1] + whole.w
        base = whole.hw * rises[k, 0] + whole.hh * rises[k, 1] + whole.h
        if not max(abs(winding), abs(base)) < GROWN_BEYOND:
            return np.inf
        rises[k + 1, 0], rises[k + 1, 1] = winding, base
    return cycle_trace(steps, losses, 0, count, flow, (rises[-2, 0], rises[-2, 1]), 0.0)[0]
