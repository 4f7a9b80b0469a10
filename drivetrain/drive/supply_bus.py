"""The bus behind all amplifiers: what drives feed back lifts its voltage until a brake resistor burns the rest."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law

ROUNDS = 1000  # of the cycle, until its bus comes back to where it was
GROWN = 1e-9  # of the energy: a round that adds less comes back


class BusStep(NamedTuple):
    """After a step.

    Attributes:
        energy: In the capacitor [J].
        fed, burnt: What the source gave and the resistor took [J].
    """

    energy: float
    fed: float
    burnt: float


@law
def bus_step(energy: Any, drawn: Any, full: Any, most: Any, feedable: Any, burnable: Any) -> Any:
    """Energy of a bus after a step: the source fills it up, the resistor cuts off what is above its start [J]."""
    left = energy - drawn
    fed = min(max(full - left, 0.0), feedable)
    burnt = min(max(left + fed - most, 0.0), burnable)
    return BusStep(left + fed - burnt, fed, burnt)


class BusPeak(NamedTuple):
    """Of a cycle that repeats for ever.

    Attributes:
        voltage: Highest [V]; infinite where every round leaves more than it found.
        sample: After which it is reached.
        burnt: Mean power of the resistor [W].
    """

    voltage: float
    sample: int
    burnt: float


@kernel
def bus_peak(
    voltage: float, capacity: float, threshold: float, resistance: float, time: Array, power: Array
) -> BusPeak:
    """Highest voltage of a bus behind a source that can give any power and takes nothing back.

    V2 = sqrt(V1^2 + 2 E/C) with all that was fed back since the bus was last at V1; power is straight between samples.
    """
    full, most = 0.5 * capacity * voltage * voltage, 0.5 * capacity * threshold * threshold
    energy, highest, sample, burnt, before = full, full, 0, 0.0, full
    for _ in range(ROUNDS):
        before, burnt = energy, 0.0
        for t in range(len(power) - 1):
            step = time[t + 1] - time[t]
            burnable = step * threshold * threshold / resistance if threshold < math.inf else 0.0
            after = bus_step(energy, 0.5 * (power[t] + power[t + 1]) * step, full, max(most, full), math.inf, burnable)
            energy = after.energy
            burnt += after.burnt
            if energy > highest:
                highest, sample = energy, t + 1
        if energy - before <= GROWN * energy:
            break
    if energy - before > GROWN * energy:
        highest = math.inf
    length = time[-1] - time[0]
    return BusPeak(math.sqrt(2.0 * highest / capacity), sample, burnt / length if length > 0.0 else 0.0)
