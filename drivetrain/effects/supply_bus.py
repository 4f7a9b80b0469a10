"""The supply behind all amplifiers: stiff, or a bus with capacitor, source of limited power and brake resistor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.supply_bus import bus_step
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal, State, TimeScale
from drivetrain.effects.laws import scene_law
from drivetrain.errors import Fault, InputError


@dataclass
class Stiff:
    """What a stiff supply keeps: the voltage that reaches the terminals [V]."""

    limit: float


@scene_law(Stiff)
def _stiff(t: Any, h: Any, own: Any, scene: Any) -> None:
    for j in range(len(scene.joints)):
        scene.joints[j].pin.limit = own.limit


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

    def own(self, place: Place) -> Stiff:
        return Stiff(self.voltage * self.modulation)


@dataclass
class Own:
    """What it keeps: the fields of ``SupplyBus``, its voltage [V], powers [W] and energy [J]."""

    nominal: float
    capacity: float
    power: float
    threshold: float
    resistance: float
    modulation: float
    bus_voltage: float = 0.0
    source_power: float = 0.0
    brake_resistor_power: float = 0.0
    delivered_power: float = 0.0
    bus_energy: float = 0.0


@scene_law(Own)
def _bus(t: Any, h: Any, own: Any, scene: Any) -> None:
    for j in range(len(scene.joints)):
        scene.joints[j].pin.limit = own.modulation * own.bus_voltage


@scene_law(Own)
def _settle(t: Any, h: Any, own: Any, scene: Any) -> None:
    drawn, volts = 0.0, own.bus_voltage
    for j in range(len(scene.joints)):
        drawn += scene.joints[j].pin.power
    own.delivered_power = drawn
    if h <= 0.0:
        own.source_power = min(max(drawn, 0.0), own.power) if volts <= own.nominal * (1.0 + 1e-9) else 0.0
        burnt = volts * volts / own.resistance
        if volts <= own.threshold * (1.0 + 1e-9):  # at the threshold it goes on and off, and burns what comes back
            burnt = min(max(-drawn, 0.0), burnt) if volts >= own.threshold * (1.0 - 1e-9) else 0.0
        own.brake_resistor_power = burnt
        own.bus_energy = 0.5 * own.capacity * volts * volts
        return
    half, burnable = 0.5 * own.capacity, h * volts * volts / own.resistance
    full, most = half * own.nominal * own.nominal, half * own.threshold * own.threshold
    after = bus_step(half * volts * volts, drawn * h, full, most, own.power * h, burnable)
    own.bus_energy = max(after.energy, 0.0)
    own.bus_voltage = math.sqrt(own.bus_energy / half)
    own.source_power, own.brake_resistor_power = after.fed / h, after.burnt / h


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

    def own(self, place: Place) -> Own:
        return Own(self.voltage, self.capacity, self.power, self.threshold, self.resistance, self.modulation)

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
