"""A motor that warms up: its temperatures over thousands of cycles, each cycle one exact affine map.

While a cycle of current repeats, the two temperature rises at its end are an affine function of those at its start.
Hours of a duty of a second or less cost as many products of 2 x 2 matrices as there are cycles, and no step of a solver
can miss a pulse: there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.heat import checked_steps, nodes_of
from drivetrain.drive.thermal.periodic_heat import (
    GROWN_BEYOND,
    copper_of,
    cycle_map,
    cycle_trace,
    flow_of,
    integrals_of,
    interval_means,
    new_losses,
)
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.errors import Fault, InputError
from drivetrain.jit import kernel
from drivetrain.records import as_record


@dataclass(frozen=True, eq=False)
class WarmUp:
    """Temperatures of repeated cycles from a start.

    Attributes:
        time: Starts of the cycles, and the end of the last [s], (K + 1,).
        winding, housing: Then [C], (K + 1,); infinite from where they run away.
        peak_winding: Largest within the last cycle [C].
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
    """The temperatures of a current cycle that is repeated a number of times, with the winding as warm as it makes it.

    Args:
        network: From ``thermal_network``; its winding capacity must be known.
        motor: Resistance and its change with temperature.
        time: Of one cycle, never decreasing [s], (N,), N >= 2.
        current: [A], DC equivalent, (N,), linear between samples.
        cycles: How often it runs [-].
        start: Temperatures of winding and housing at the start [C]. None: both at ambient.
        housing_loss: Iron and friction loss that heats the housing [W], (N,); None: none.

    Returns:
        Temperatures at the ends of all cycles.

    Raises:
        InputError: Lengths that differ, time that decreases or stands still, no whole positive number of cycles, or a
            network without the capacity of the winding.
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
    if faults:
        raise InputError(faults)
    losses, ambient, copper = new_losses(amperes.size), network.ambient, copper_of(as_record(motor), network.ambient)
    loss = np.zeros(amperes.size) if housing_loss is None else housing_loss
    clock, loss = checked_array(time, amperes.shape, "time"), checked_array(loss, amperes.shape, "housing_loss")
    checked_steps(clock)
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
    """Fill the rises after each cycle, (K + 1, 2), until they are beyond all bounds; the winding's peak in the last."""
    interval_means(current, loss, losses)
    count = len(steps)
    flow = flow_of(nodes, steps.sum(), cold, slope, 0.0)
    integrals_of(steps, losses, 0, count, flow)
    whole = cycle_map(steps, losses, 0, count, flow)
    for k in range(len(rises) - 1):
        winding = whole.ww * rises[k, 0] + whole.wh * rises[k, 1] + whole.w
        base = whole.hw * rises[k, 0] + whole.hh * rises[k, 1] + whole.h
        if not max(abs(winding), abs(base)) < GROWN_BEYOND:
            return np.inf
        rises[k + 1, 0], rises[k + 1, 1] = winding, base
    return cycle_trace(steps, losses, 0, count, flow, (rises[-2, 0], rises[-2, 1]), 0.0)[0]
