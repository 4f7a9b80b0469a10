"""The supply behind all amplifiers: stiff, or a bus with capacitor, source of limited power and brake resistor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, Signal, State, TimeScale
from drivetrain.errors import Fault, InputError


@Compiled
def _stiff(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    row = 2
    at = words[row]
    for j in range(int(numbers[at + 1])):
        signals[words[row + 1 + j]] = numbers[at]


@dataclass(frozen=True)
class StiffSupply(Effect):
    """A supply whose voltage nothing moves.

    Attributes:
        voltage: [V].
        modulation: Share of it that an amplifier can put between two terminals [-].
    """

    voltage: float
    modulation: float = 1.0

    scope = "scene"
    compute = _stiff

    def __post_init__(self) -> None:
        faults = _positive("StiffSupply", {"voltage": self.voltage, "modulation": self.modulation})
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        return Ports(provides=tuple(Signal(f"{joint}:{s.VOLTAGE_LIMIT.name}", "V") for joint in place.joints))

    def numbers(self, place: Place) -> Sequence[float]:
        return self.voltage * self.modulation, float(len(place.joints))


@Compiled
def _bus(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    row = 2
    at, joints = words[row], int(numbers[words[row] + 6])
    for j in range(joints):
        signals[words[row + 2 + joints + j]] = numbers[at + 5] * x[words[row + 1]]


@Compiled
def _settle(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    row = 2
    at, joints = words[row], int(numbers[words[row] + 6])
    nominal, capacity, power = numbers[at], numbers[at + 1], numbers[at + 2]
    threshold, resistance = numbers[at + 3], numbers[at + 4]
    drawn = 0.0
    for j in range(joints):
        drawn += signals[words[row + 2 + j]]
    volts, out = x[words[row + 1]], row + 2 + 2 * joints
    if h <= 0.0:
        feed = min(max(drawn, 0.0), power) if volts <= nominal * (1.0 + 1e-9) else 0.0
        burnt = volts * volts / resistance
        if volts <= threshold * (1.0 + 1e-9):  # at the threshold it is switched on and off, and burns what comes back
            burnt = min(max(-drawn, 0.0), burnt) if volts >= threshold * (1.0 - 1e-9) else 0.0
        signals[words[out]] = feed
        signals[words[out + 1]] = burnt
        signals[words[out + 2]] = drawn
        signals[words[out + 3]] = 0.5 * capacity * volts * volts
        return
    # Energy of the capacitor after the step; the source lifts it to its nominal voltage, the resistor cuts it off.
    energy = 0.5 * capacity * volts * volts - drawn * h
    full, most = 0.5 * capacity * nominal * nominal, 0.5 * capacity * threshold * threshold
    feed = min(max(full - energy, 0.0), power * h)
    energy += feed
    burnt = 0.0
    if energy > most:
        burnt = min(energy - most, h * volts * volts / resistance)
        energy -= burnt
    x[words[row + 1]] = math.sqrt(2.0 * max(energy, 0.0) / capacity)
    signals[words[out]] = feed / h
    signals[words[out + 1]] = burnt / h
    signals[words[out + 2]] = drawn
    signals[words[out + 3]] = max(energy, 0.0)


@dataclass(frozen=True)
class SupplyBus(Effect):
    """One bus for all amplifiers: what one drive feeds back, another may take; what is too much, the resistor burns.

    Its voltage follows the energy of its capacitor from step to step: a rectifier of limited power holds it up at the
    nominal voltage and takes nothing back; above the threshold the brake resistor is switched on.

    Attributes:
        voltage: That the source holds [V].
        capacity: Of the bus [F].
        power: Largest that the source gives [W]; infinite: any.
        threshold: At which the brake resistor comes on [V]; infinite: there is none.
        resistance: Of the brake resistor [ohm].
        modulation: Share of the bus voltage that an amplifier can put between two terminals [-].
    """

    voltage: float
    capacity: float
    power: float = math.inf
    threshold: float = math.inf
    resistance: float = math.inf
    modulation: float = 1.0

    scope = "scene"
    compute = _bus
    account = _settle

    def __post_init__(self) -> None:
        finite = {"voltage": self.voltage, "capacity": self.capacity, "modulation": self.modulation}
        faults = _positive("SupplyBus", finite)
        for name, unit in (("power", "W"), ("resistance", "ohm")):
            if not getattr(self, name) > 0.0:
                faults.append(Fault(f"SupplyBus.{name}", f"must be positive [{unit}]", getattr(self, name)))
        if not self.threshold > self.voltage:
            problem = "must be above the voltage of the source, or the resistor never goes off [V]"
            faults.append(Fault("SupplyBus.threshold", problem, self.threshold))
        if self.threshold < math.inf and not self.resistance < math.inf:
            faults.append(Fault("SupplyBus.resistance", "is needed with a threshold [ohm]", self.resistance))
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State("bus_voltage", "V", 1e-3, memory=True),),
            needs=tuple(Signal(f"{joint}:{s.ELECTRICAL_POWER.name}", "W", default=0.0) for joint in place.joints),
            provides=tuple(Signal(f"{joint}:{s.VOLTAGE_LIMIT.name}", "V") for joint in place.joints),
            outputs=(
                Signal("source_power", "W"), Signal("brake_resistor_power", "W"), Signal("delivered_power", "W"),
                Signal("bus_energy", "J"),
            ),
            # What the drives take counts as their source: here it leaves.
            powers={"source_power": Role.SOURCE, "brake_resistor_power": Role.LOSS, "delivered_power": Role.LOSS},
            stores=("bus_energy",),
        )  # fmt: skip

    def numbers(self, place: Place) -> Sequence[float]:
        sheet = (self.voltage, self.capacity, self.power, self.threshold, self.resistance, self.modulation)
        return *sheet, float(len(place.joints))

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        return (self.voltage,)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("brake resistor", self.resistance * self.capacity),) if self.resistance < math.inf else ()


def _positive(kind: str, numbers: Mapping[str, float]) -> list[Fault]:
    return [
        Fault(f"{kind}.{name}", "must be positive and finite", value)
        for name, value in numbers.items()
        if not 0.0 < value < math.inf
    ]
