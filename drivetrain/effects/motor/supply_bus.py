"""The supply of all amplifiers: constant voltage, or a bus with capacitor, power-limited source and brake resistor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.amplifier import bus_step
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Signal, State, TimeScale
from drivetrain.effects.fields import positive, positive_or_infinite, ranges
from drivetrain.effects.laws import scene_law
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class Stiff:
    """Record of a stiff supply: largest voltage between two motor terminals [V]."""

    limit: float


@scene_law(Stiff)
def _provide_stiff_limit(t: Any, h: Any, own: Any, scene: Any) -> None:
    """Provide the constant voltage limit of all motors."""
    for j in range(len(scene.joints)):
        scene.joints[j].pin.limit = own.limit


@dataclass(frozen=True)
class StiffSupply(Effect):
    """Supply with constant voltage.

    Attributes:
        voltage: Voltage of the supply [V].
        modulation: Share of it that an amplifier can apply between two terminals [-].
    """

    voltage: float
    modulation: float = 1.0

    scope = "scene"
    limits = ranges(voltage=positive("V"), modulation=positive("-"))
    compute = _provide_stiff_limit

    def ports(self, place: Place) -> Ports:
        return Ports(provides=tuple(Signal(f"{joint}:{s.VOLTAGE_LIMIT.name}", "V") for joint in place.joints))

    def own(self, place: Place) -> Stiff:
        return Stiff(self.voltage * self.modulation)


MOST_CHANGE = 0.005  # largest relative change of the voltage in a step, since the drives see its mean
CONVERGED = 1e-7  # error of the mean voltage at which the iteration has converged, over the nominal voltage
REGULATION_BAND = 1e-9  # distance up to which a voltage counts as regulated, over the nominal voltage
SLOWEST = 1e-6  # demand below which the mode does not change, over the energy of the bus at the nominal voltage [1/s]
# Modes of the bus: the source holds the nominal voltage; below it, the source at its power limit; between nominal
# voltage and threshold; the brake resistor holds the threshold; above it, the brake resistor permanently on.
SOURCE_HOLDS, SOURCE_LIMITED, UNREGULATED, RESISTOR_HOLDS, RESISTOR_ON = range(5)


@dataclass
class Own:
    # parameters of ``SupplyBus``
    voltage: float
    capacity: float
    power: float
    threshold: float
    resistance: float
    modulation: float
    # the state [V], and its rate [V/s]
    bus_voltage: float = 0.0
    bus_voltage_rate: float = 0.0
    slope: float = 0.0  # mean rate of the voltage over the last fixed step [V/s]
    trial: float = 0.0  # mean voltage of the step that the drives use in the present iteration [V]
    # trial voltage of the iteration before, and the resulting mean voltage minus that [V]
    last_trial: float = 0.0
    last_error: float = 0.0
    # bracket of the mean voltage [V]
    low: float = 0.0
    high: float = 0.0
    # mode, and its distance from a change [V or W]
    mode: int = SOURCE_HOLDS
    margin: float = 0.0
    # powers [W] and stored energy [J]
    source_power: float = 0.0
    brake_resistor_power: float = 0.0
    delivered_power: float = 0.0
    bus_energy: float = 0.0


@law
def _bus_after_step(own: Any, drawn: float, h: float) -> tuple[float, float, float]:
    """Voltage at the end of a step of length h [s] in which the drives draw a power [W].

    Returns that voltage [V], the mean power of the source and that of the brake resistor [W].
    """
    half, volts = 0.5 * own.capacity, own.bus_voltage
    full, most = half * own.voltage * own.voltage, half * own.threshold * own.threshold
    left = bus_step(half * volts * volts, drawn * h, full, most, own.power * h, h * volts * volts / own.resistance)
    return (math.sqrt(left.energy / half) if left.energy > 0.0 else 0.0), left.fed / h, left.burnt / h


@scene_law(Own)
def _provide_limit(t: Any, h: Any, own: Any, scene: Any) -> None:
    """Provide the voltage limit of all motors: at an instant from the bus voltage, in a step from its trial mean."""
    volts = own.bus_voltage
    if h > 0.0:
        if scene.world.iteration == 0:
            own.low, own.high = 0.0, math.inf
            own.trial = max(volts + 0.5 * h * own.slope, 0.5 * volts)
        volts = own.trial
    for j in range(len(scene.joints)):
        scene.joints[j].pin.limit = own.modulation * volts


@scene_law(Own)
def _account_bus(t: Any, h: Any, own: Any, scene: Any) -> None:
    """Powers and rate of the bus voltage.

    At an instant they depend on the mode, whose margin is computed too. In a step the mean voltage follows from the
    power that the drives draw; if it does not agree with the trial voltage, another solution of the step is requested.
    """
    drawn, volts, world = 0.0, own.bus_voltage, scene.world
    for j in range(len(scene.joints)):
        drawn += scene.joints[j].pin.power
    own.delivered_power, own.bus_energy = drawn, 0.5 * own.capacity * volts * volts
    if h <= 0.0:
        most, mode, edge = volts * volts / own.resistance, own.mode, REGULATION_BAND * own.voltage
        small = SLOWEST * 0.5 * own.capacity * own.voltage * own.voltage
        own.source_power = own.brake_resistor_power = 0.0
        if mode == SOURCE_HOLDS:
            own.source_power = min(max(drawn, 0.0), own.power)
            own.margin = min(drawn + small, own.power - drawn)
        elif mode == SOURCE_LIMITED:
            own.source_power, own.margin = own.power, own.voltage + edge - volts
        elif mode == RESISTOR_HOLDS:
            own.brake_resistor_power = min(max(-drawn, 0.0), most)
            own.margin = min(small - drawn, most + drawn)
        elif mode == RESISTOR_ON:
            own.brake_resistor_power, own.margin = most, volts + edge - own.threshold
        else:
            own.margin = min(volts + edge - own.voltage, own.threshold + edge - volts)
        surplus = own.source_power - drawn - own.brake_resistor_power
        own.bus_voltage_rate = 0.0
        if mode != SOURCE_HOLDS and mode != RESISTOR_HOLDS:
            own.bus_voltage_rate = surplus / (own.capacity * max(volts, REGULATION_BAND * own.voltage))
        return
    end, own.source_power, own.brake_resistor_power = _bus_after_step(own, drawn, h)
    own.bus_voltage_rate = own.slope = (end - volts) / h
    change, mean = abs(end - volts), 0.5 * (volts + end)
    if change > 0.0:
        world.step_limit = min(world.step_limit, MOST_CHANGE * h * max(volts, MOST_CHANGE * own.voltage) / change)
    # With a higher voltage the drives draw more and the voltage drops further, so the solution can be bracketed.
    if abs(mean - own.trial) <= CONVERGED * own.voltage:
        return
    world.repeat_step = 1
    trial, error, last_trial, last_error = own.trial, mean - own.trial, own.last_trial, own.last_error
    if error > 0.0:
        own.low = trial
    else:
        own.high = trial
    secant = world.iteration > 0 and error != last_error
    guess = trial - error * (trial - last_trial) / (error - last_error) if secant else mean
    if not own.low < guess < own.high:
        guess = 0.5 * (own.low + min(own.high, 2.0 * mean))
    own.last_trial, own.last_error, own.trial = trial, error, guess


@scene_law(Own)
def _accept(t: Any, h: Any, own: Any, scene: Any) -> None:
    """Set the mode after a fixed step, or (h = 0) make the transition when its margin is zero."""
    drawn, most = own.delivered_power, own.bus_voltage * own.bus_voltage / own.resistance
    if h > 0.0:
        volts, edge = own.bus_voltage + h * own.bus_voltage_rate, REGULATION_BAND * own.voltage
        own.mode = UNREGULATED
        if volts <= own.voltage + edge:
            own.mode = SOURCE_HOLDS if volts > own.voltage - edge else SOURCE_LIMITED
        if volts > own.threshold - edge:
            own.mode = RESISTOR_ON if volts > own.threshold + edge else RESISTOR_HOLDS
        return
    # The guard is zero: force the transition that belongs to it, since a new decision might return the old mode.
    if own.mode == SOURCE_HOLDS:
        own.mode = SOURCE_LIMITED if drawn > 0.5 * own.power else UNREGULATED
    elif own.mode == RESISTOR_HOLDS:
        own.mode = RESISTOR_ON if -drawn > 0.5 * most else UNREGULATED
    elif own.mode == SOURCE_LIMITED or (
        # the limit that is nearer: at the located instant the voltage may still be just within both
        own.mode == UNREGULATED and own.bus_voltage - own.voltage < own.threshold - own.bus_voltage
    ):
        own.mode = SOURCE_LIMITED if drawn > own.power else SOURCE_HOLDS if drawn >= 0.0 else UNREGULATED
        own.bus_voltage = own.voltage
    else:
        own.mode = RESISTOR_ON if -drawn > most else RESISTOR_HOLDS if drawn <= 0.0 else UNREGULATED
        own.bus_voltage = own.threshold


@dataclass(frozen=True)
class SupplyBus(Effect):
    """Common DC bus: drives use what others feed back, and the brake resistor dissipates the surplus.

    Its voltage follows from the energy of its capacitor: a rectifier of limited power keeps it at the nominal voltage
    and cannot feed energy back; above the threshold the brake resistor is switched on.

    Attributes:
        voltage: Nominal voltage, which the source maintains [V].
        capacity: Capacitance of the bus [F].
        power: Power limit of the source [W]; infinite: no limit.
        threshold: Voltage at which the brake resistor is switched on [V]; infinite: there is none.
        resistance: Resistance of the brake resistor [ohm].
        modulation: Share of the bus voltage that an amplifier can apply between two terminals [-].
    """

    voltage: float
    capacity: float
    power: float = math.inf
    threshold: float = math.inf
    resistance: float = math.inf
    modulation: float = 1.0

    scope = "scene"
    limits = ranges(
        voltage=positive("V"), capacity=positive("F"), modulation=positive("-"),
        power=positive_or_infinite("W"), resistance=positive_or_infinite("ohm"),
    )  # fmt: skip
    compute = _provide_limit
    account = _account_bus
    accept = _accept

    def faults(self) -> list[Fault]:
        faults = []
        if not self.threshold > self.voltage:
            problem = "must be above the voltage of the source, or the resistor never goes off [V]"
            faults.append(Fault("SupplyBus.threshold", problem, self.threshold))
        if self.threshold < math.inf and not self.resistance < math.inf:
            faults.append(Fault("SupplyBus.resistance", "is needed with a threshold [ohm]", self.resistance))
        return faults

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State("bus_voltage", "V", 1e-3, late=True),),
            needs=tuple(Signal(f"{joint}:{s.ELECTRICAL_POWER.name}", "W", default=0.0) for joint in place.joints),
            provides=tuple(Signal(f"{joint}:{s.VOLTAGE_LIMIT.name}", "V") for joint in place.joints),
            # The drives count the power that they draw as a source, so it is a loss of the bus.
            outputs=(
                s.source("source_power", ""), s.loss("brake_resistor_power", ""), s.loss("delivered_power", ""),
                s.store("bus_energy", ""),
            ),
            guard="margin",
        )  # fmt: skip

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        return (self.voltage,)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        scales = [] if math.isinf(self.resistance) else [TimeScale("brake resistor", self.resistance * self.capacity)]
        if self.power < math.inf:
            scales.append(TimeScale("source fills the bus", 0.5 * self.capacity * self.voltage**2 / self.power))
        return tuple(scales)
