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
from drivetrain.drive.heat_kernels import cycle_map, cycle_trace
from drivetrain.drive.motor import Motor
from drivetrain.drive.periodic_rise import GROWN_BEYOND, cycle_losses, kernel_input, one_node
from drivetrain.drive.thermal_network import ThermalNetwork
from drivetrain.errors import Fault, InputError


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
        problem = "is unknown, so how fast the winding warms cannot be told"
        faults.append(Fault("network.winding_capacity", problem))
    if amperes.size < 2:
        faults.append(Fault("current", "must be at least two samples of a cycle", amperes.tolist()))
    if faults:
        raise InputError(faults)
    losses = cycle_losses(network, motor, time, amperes, housing_loss)
    rise = checked_array((network.ambient,) * 2 if start is None else start, (2,), "start") - network.ambient
    given = kernel_input(network, losses)
    rises = np.full((cycles + 1, 2), np.inf)
    rises[0] = rise
    whole = cycle_map(*given)
    for k in range(cycles):
        rise = whole[:, :2] @ rise + whole[:, 2]
        if not np.abs(rise).max() < GROWN_BEYOND:
            break
        rises[k + 1] = rise
    peak = np.inf
    if np.isfinite(rises[-1]).all():
        _, peak, _ = cycle_trace(*given, rises[-2])
    housing = rises[:, 0] if one_node(network) else rises[:, 1]
    length = float(losses.steps.sum())
    return WarmUp(
        length * np.arange(cycles + 1.0),
        network.ambient + rises[:, 0],
        network.ambient + housing,
        network.ambient + peak,
    )
