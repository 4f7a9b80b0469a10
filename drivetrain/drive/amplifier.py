"""The amplifier of one joint and the supply of them all: limits, in the DC-equivalent convention of the motors.

The DC equivalent of a sinusoidal three-phase machine in star connection. Between two terminals lie two phases, so its
resistance is R = 2 R_phase. Equal copper loss, R I_dc^2 = 3 R_phase I_rms^2, gives I_dc = sqrt(3/2) I_rms, which is
(sqrt(3)/2) I_peak. Equal torque, k_dc I_dc = k_rms I_rms, gives k_dc = sqrt(2/3) k_rms. With the torque
3 E_rms I_rms / w of three sinusoidal phases this k_dc is the amplitude of the line-to-line back-emf over speed: torque
constant and back-emf constant are one number, and the amplitude of the line-to-line voltage is k_dc w + R I_dc.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple, TypeVar

from drivetrain.arrays import Array
from drivetrain.drive.linear_interval import mean_square
from drivetrain.drive.ranges import EFFICIENCY, NOT_NEGATIVE, POSITIVE, range_faults
from drivetrain.errors import Fault, InputError, member_of
from drivetrain.jit import FAST, kernel, law
from drivetrain.records import known
from drivetrain.units import Capacitance, Current, Duration, Efficiency, Power, Resistance, Voltage

Values = TypeVar("Values", float, Array)


class CurrentBasis(StrEnum):
    """What a printed ampere is: DC equivalent, RMS of a phase, or amplitude (PEAK) of a phase."""

    DC = "dc"
    RMS = "rms"
    PEAK = "peak"


_DC_AMPERES = {
    CurrentBasis.DC: 1.0,
    CurrentBasis.RMS: math.sqrt(1.5),
    CurrentBasis.PEAK: math.sqrt(0.75),
}


_LIMITS = (
    "peak_current continuous_current peak_time thermal_time_constant min_voltage max_voltage on_resistance".split()
)


@dataclass(frozen=True)
class Amplifier:
    """Limits of one joint's amplifier; None where unknown.

    Attributes:
        peak_current: [A], DC equivalent.
        continuous_current: RMS over the cycle [A], DC equivalent.
        modulation: Largest share of the supply voltage that reaches the motor terminals.
        standby_power: That it takes whatever the motor does [W].
        on_resistance: Of one of its switches, hot; the loss of switching is not counted [ohm].
        current_basis: Convention of the user's currents, which reports show as well.
        peak_time: For which it gives the peak current from its continuous one on [s].
        thermal_time_constant: Of its first-order overload model, where it has that instead [s].
        min_voltage, max_voltage: Of the supply [V].
        price: Of its row; what is stated by its limits alone is not bought and costs nothing.
        key, source: Of its row in the catalogue; empty: the study states its limits.
    """

    peak_current: Current | None = None
    continuous_current: Current | None = None
    modulation: Efficiency = 0.95
    standby_power: Power | None = None
    on_resistance: Resistance | None = None
    current_basis: str = "dc"
    peak_time: Duration | None = None
    thermal_time_constant: Duration | None = None
    min_voltage: Voltage | None = None
    max_voltage: Voltage | None = None
    price: float | None = None
    key: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        ranges = dict.fromkeys(_LIMITS, POSITIVE) | {
            "modulation": EFFICIENCY,
            "standby_power": NOT_NEGATIVE,
            "price": NOT_NEGATIVE,
        }
        faults = range_faults("amplifier", self, ranges, required=("modulation",))
        if faults:
            raise InputError(faults)


_SHEET_RANGES = {
    **dict.fromkeys(
        "continuous_current peak_current peak_time thermal_time_constant min_voltage max_voltage mass".split(), POSITIVE
    ),
    **dict.fromkeys(("logic_power", "price"), NOT_NEGATIVE),
    "current_loop_rate": POSITIVE,
    "modulation": EFFICIENCY,
}


@dataclass(frozen=True)
class AmplifierSheet:
    """An amplifier's data sheet; None if the data sheet gives no value (unknown is never zero).

    Attributes:
        key: Unique name in the catalogue.
        maker, series, part_number: As printed.
        current_basis: Convention of the printed currents, which reports show as well.
        continuous_current, peak_current: [A], DC equivalent.
        peak_time: For which it gives the peak current from its continuous one on [s].
        thermal_time_constant: Of its first-order overload model, where it has that instead [s].
        min_voltage, max_voltage: Of the supply [V].
        modulation: Largest share of the supply voltage that reaches the motor terminals.
        current_loop_rate: Of its current loop [Hz].
        logic_power: That its electronics take [W].
        mass: [kg].
        price: In the user's currency; empty in the shipped catalogue.
        source: File and row, sheet, edition: what a report prints.
    """

    key: str
    maker: str = ""
    series: str = ""
    part_number: str = ""
    current_basis: str = "dc"
    continuous_current: float | None = None
    peak_current: float | None = None
    peak_time: float | None = None
    thermal_time_constant: float | None = None
    min_voltage: float | None = None
    max_voltage: float | None = None
    modulation: float | None = None
    current_loop_rate: float | None = None
    logic_power: float | None = None
    mass: float | None = None
    price: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        faults = range_faults(f"amplifier {self.key}", self, _SHEET_RANGES)
        if faults:
            raise InputError(faults)


@dataclass(frozen=True)
class Supply:
    """The one supply behind all amplifiers; None where unknown.

    Attributes:
        voltage: [V].
        peak_power, mean_power: Limits over all joints together [W].
        regenerated_power: Largest mean regenerated power that it accepts or burns in a brake resistor [W].
        capacity: Of the bus behind it [F].
        max_voltage: That the bus may reach [V].
        threshold: At which the brake resistor comes on [V].
        resistance: Of the brake resistor [ohm].
    """

    voltage: Voltage
    peak_power: Power | None = None
    mean_power: Power | None = None
    regenerated_power: Power | None = None
    capacity: Capacitance | None = None
    max_voltage: Voltage | None = None
    threshold: Voltage | None = None
    resistance: Resistance | None = None

    def __post_init__(self) -> None:
        ranges = {
            "voltage": POSITIVE,
            "peak_power": POSITIVE,
            "mean_power": POSITIVE,
            "regenerated_power": NOT_NEGATIVE,
            **dict.fromkeys(("capacity", "max_voltage", "threshold", "resistance"), POSITIVE),
        }
        faults = range_faults("supply", self, ranges, required=("voltage",))
        for one, other in (("max_voltage", "capacity"), ("threshold", "resistance"), ("resistance", "threshold")):
            if getattr(self, one) is not None and getattr(self, other) is None:
                faults.append(Fault(f"supply.{other}", f"is needed beside {one}"))
        if faults:
            raise InputError(faults)

    @property
    def braking_power(self) -> float | None:
        """What the brake resistor burns as soon as it comes on [W]; None without one, and where the bus is judged."""
        if self.resistance is None or self.threshold is None or self.max_voltage is not None:
            return None
        return self.threshold**2 / self.resistance


def limits_of(sheet: AmplifierSheet) -> Amplifier:
    """What an amplifier of the catalogue allows one joint; where its sheet has no modulation, that of ``Amplifier``."""
    modulation = Amplifier.modulation if sheet.modulation is None else sheet.modulation
    return Amplifier(
        sheet.peak_current, sheet.continuous_current, modulation, sheet.logic_power,
        current_basis=sheet.current_basis, peak_time=sheet.peak_time,
        thermal_time_constant=sheet.thermal_time_constant, min_voltage=sheet.min_voltage,
        max_voltage=sheet.max_voltage, price=sheet.price, key=sheet.key, source=sheet.source,
    )  # fmt: skip


def best_of(amplifiers: Sequence[Amplifier]) -> Amplifier:
    """One that allows what any of some allows; what only one of them limits, or in another way, it does not limit."""
    most: dict[str, Any] = {
        name: None if None in (values := [getattr(one, name) for one in amplifiers]) else max(values)
        for name in ("peak_current", "continuous_current", "max_voltage")
    }
    standby = min(one.standby_power or 0.0 for one in amplifiers)
    return Amplifier(**most, modulation=max(one.modulation for one in amplifiers), standby_power=standby)


def rates_supply(amplifier: Amplifier) -> bool:
    """Whether its range of supply voltage is checked: for catalogue rows, and if one is stated."""
    return bool(amplifier.key) or (amplifier.min_voltage, amplifier.max_voltage) != (None, None)


LEAST_PEAK_TIME = 1.0  # s, of an amplifier that prints none: 3.5 s of time constant, as in two shipped, at twice I_c


def with_peak_time(amplifier: Amplifier) -> Amplifier:
    """An amplifier with a conservative duration of its peak current if none is stated."""
    both = amplifier.continuous_current is not None and amplifier.peak_current is not None
    complete = not both or judges_overload(amplifier)
    return amplifier if complete else replace(amplifier, peak_time=LEAST_PEAK_TIME)


def judges_overload(amplifier: Amplifier) -> bool:
    """Whether it states how long it can supply more than its continuous current."""
    timed = amplifier.peak_current is not None and amplifier.peak_time is not None
    return amplifier.continuous_current is not None and (timed or amplifier.thermal_time_constant is not None)


@law
def conduction_loss(on_resistance: Any, current: Any) -> Any:
    """Of the switches of a bridge, two of which every current passes [W].

    1.5 R I^2 with the amplitude I of a phase, 2/sqrt(3) of the DC equivalent (three half bridges, sinusoidal currents).
    """
    return 2.0 * on_resistance * current * current


def available_voltage(amplifier: Amplifier, supply_voltage: float) -> float:
    """The largest voltage the amplifier can put between two motor terminals."""
    return amplifier.modulation * supply_voltage


def to_dc(current: Values, basis: CurrentBasis | str) -> Values:
    """A printed current as that of the DC equivalent.

    Args:
        current: In the printed basis [A].
        basis: What the printed ampere is: ``dc``, ``rms`` or ``peak``.

    Returns:
        DC-equivalent current [A].

    Raises:
        InputError: An unknown basis.
    """
    return current * _dc_amperes(basis)


def from_dc(current: Values, basis: CurrentBasis | str) -> Values:
    """A DC-equivalent current in another basis, as an amplifier's settings may want it.

    Args:
        current: DC equivalent [A].
        basis: What the wanted ampere is: ``dc``, ``rms`` or ``peak``.

    Returns:
        Current in that basis [A].

    Raises:
        InputError: An unknown basis.
    """
    return current / _dc_amperes(basis)


def torque_constant_to_dc(constant: Values, basis: CurrentBasis | str) -> Values:
    """A printed torque constant as that of the DC equivalent: the inverse of the conversion of currents."""
    return constant / _dc_amperes(basis)


def line_to_line(phase_value: Values) -> Values:
    """The resistance or inductance between two terminals of a star: that of two phases in series."""
    return 2.0 * phase_value


def _dc_amperes(basis: CurrentBasis | str) -> float:
    """DC-equivalent amperes in one ampere of the basis."""
    return _DC_AMPERES[member_of(CurrentBasis, basis, "current basis", "must be dc, rms or peak")]


# How long an amplifier can supply more than its continuous current: i2t with a peak time, or one time constant.
#
# Both are periodic steady states: the answer holds for a cycle that repeats for ever.


@law
def overload_room(amplifier: Any) -> Any:
    """Where the overload trips: 1 of the first-order model, else ((I_p/I_c)^2 - 1) t_p [s]."""
    if known(amplifier.thermal_time_constant):
        return 1.0
    return ((amplifier.peak_current / amplifier.continuous_current) ** 2 - 1.0) * amplifier.peak_time


@law
def overload_after(amplifier: Any, held: Any, square: Any, step: Any) -> Any:
    """The overload after a step [s]; ``square``: squared current over the squared continuous current. [-] or [s]."""
    constant = amplifier.thermal_time_constant
    if known(constant):
        left = math.exp(-step / constant)
        return left * held + (1.0 - left) * square
    grown = held + (square - 1.0) * step
    return 0.5 * (grown + abs(grown))  # never below zero


@law
def overload_allows(amplifier: Any, held: Any, step: Any) -> Any:
    """Squared current over the continuous one's that just fills the overload in a step [s]; 1 where it is full."""
    constant = amplifier.thermal_time_constant
    if known(constant):
        left = math.exp(-step / constant)
        return (1.0 - left * held) / (1.0 - left)
    return 1.0 + (overload_room(amplifier) - held) / step


@law(fastmath=FAST)
def mean_square_after(series: Any, t: Any) -> Any:
    """Mean square of a series from a sample to the next one; the last sample is held."""
    return mean_square(series[t], series[min(t + 1, len(series) - 1)])


@law
def overload_share(amplifier: Any, series: Any, scale: Any, step: Any) -> Any:
    """The largest share of its overload that an amplifier uses up in a cycle; above 1 it trips or folds back.

    Of a current that is a series times a scale [A], linear between samples, each a step [s] before the next. With a
    peak time the integral of I^2 - I_c^2, never below zero, is held against (I_p^2 - I_c^2) t_p; with a time constant
    the first-order mean of I^2 against I_c^2: the i2t monitor of servo drives, E' = I^2 - I_c^2 and
    theta' = (I^2/I_c^2 - theta)/tau.
    """
    over, constant = (scale / amplifier.continuous_current) ** 2, amplifier.thermal_time_constant
    total, length, largest = squares_of(series, over, step)
    most, held = 0.0, 0.0
    if known(constant):  # of the affine map of a round, the state that it leaves as it was
        for t in range(len(step)):
            held = overload_after(amplifier, held, over * mean_square_after(series, t), step[t])
        held = held / -math.expm1(-length / constant)
        most = held
        for t in range(len(step)):
            held = overload_after(amplifier, held, over * mean_square_after(series, t), step[t])
            most = max(most, held)
        return most
    if largest <= 1.0:  # never above the continuous current
        return 0.0
    if total > length * (1.0 + 1e-12):
        return math.inf
    room = overload_room(amplifier)
    for first in (True, False):  # from empty; what is left at the end of the first round is that of every one after it
        if first or held > 0.0:
            for t in range(len(step)):
                held = overload_after(amplifier, held, over * mean_square_after(series, t), step[t])
                most = max(most, held)
    if most == 0.0:
        return 0.0
    return most / room if room > 0.0 else math.inf


@law(fastmath=FAST)
def squares_of(series: Any, over: Any, step: Any) -> Any:
    """The integral of a factor times the square of a series, linear over each step [s], its length and largest."""
    total, length, largest = 0.0, 0.0, 0.0
    for t in range(len(step)):
        square = over * mean_square_after(series, t)
        total += square * step[t]
        length += step[t]
        largest = max(largest, square)
    return total, length, largest


# The bus behind all amplifiers: what drives feed back lifts its voltage until a brake resistor burns the rest.


ROUNDS = 1000  # of the cycle, until its bus comes back to where it was
GROWN = 1e-9  # of the energy: a round that adds less comes back


class BusStep(NamedTuple):
    """After a step."""

    energy: float  # in the capacitor [J]
    # what the source gave and the resistor took [J]
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
    """Of a cycle that repeats for ever."""

    voltage: float  # highest [V]; infinite where every round leaves more than it found
    sample: int  # after which it is reached
    burnt: float  # mean power of the resistor [W]


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
