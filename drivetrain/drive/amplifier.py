"""The amplifier of one joint and the common supply: limits, in the DC-equivalent convention of the motors.

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
from drivetrain.errors import Fault, member_of, raise_faults
from drivetrain.jit import FAST, kernel, law
from drivetrain.notebook import DataSheet
from drivetrain.records import known
from drivetrain.units import Capacitance, Current, Duration, Efficiency, Power, Resistance, Voltage

Values = TypeVar("Values", float, Array)


class CurrentBasis(StrEnum):
    """Convention of a printed current: DC equivalent, RMS of a phase, or amplitude (PEAK) of a phase."""

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


@dataclass(frozen=True, repr=False)
class Amplifier(DataSheet):
    """Limits of one joint's amplifier; None where unknown.

    Attributes:
        peak_current: Peak current [A], DC equivalent.
        continuous_current: Limit of the RMS current over the cycle [A], DC equivalent.
        modulation: Largest share of the supply voltage that reaches the motor terminals.
        standby_power: Power drawn independently of the motor [W].
        on_resistance: On-state resistance of one switch when hot [ohm]; switching loss is not included.
        current_basis: Convention of the user's currents, in which reports show currents in addition.
        peak_time: Permitted duration of the peak current after operation at the continuous current [s].
        thermal_time_constant: Time constant of a first-order overload model, used instead of a peak time [s].
        min_voltage, max_voltage: Range of the supply voltage [V].
        price: Price of the catalogue row; an amplifier that the study states by its limits alone costs nothing.
        key, source: Key and source of the catalogue row; empty: the study states its limits.
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
        raise_faults(range_faults("amplifier", self, ranges, required=("modulation",)))


_SHEET_RANGES = {
    **dict.fromkeys(
        "continuous_current peak_current peak_time thermal_time_constant min_voltage max_voltage mass".split(), POSITIVE
    ),
    **dict.fromkeys(("logic_power", "price"), NOT_NEGATIVE),
    "current_loop_rate": POSITIVE,
    "modulation": EFFICIENCY,
}


@dataclass(frozen=True, repr=False)
class AmplifierSheet(DataSheet):
    """An amplifier's data sheet; None if the data sheet gives no value (unknown is never zero).

    Attributes:
        key: Unique name in the catalogue.
        maker, series, part_number: As printed.
        current_basis: Convention of the printed currents, in which reports show currents in addition.
        continuous_current, peak_current: Continuous and peak current [A], DC equivalent.
        peak_time: Permitted duration of the peak current after operation at the continuous current [s].
        thermal_time_constant: Time constant of a first-order overload model, used instead of a peak time [s].
        min_voltage, max_voltage: Range of the supply voltage [V].
        modulation: Largest share of the supply voltage that reaches the motor terminals.
        current_loop_rate: Sampling rate of its current loop [Hz].
        logic_power: Power drawn by its electronics [W].
        mass: Mass [kg].
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
        raise_faults(range_faults(f"amplifier {self.key}", self, _SHEET_RANGES))


@dataclass(frozen=True)
class Supply:
    """The common supply of all amplifiers; None where unknown.

    Attributes:
        voltage: Supply voltage [V].
        peak_power, mean_power: Limits of the power of all joints together [W].
        regenerated_power: Largest mean regenerated power that it feeds back or dissipates in a brake resistor [W].
        capacity: Capacitance of the bus [F].
        max_voltage: Largest permitted bus voltage [V].
        threshold: Bus voltage at which the brake resistor switches on [V].
        resistance: Resistance of the brake resistor [ohm].
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
        raise_faults(faults)

    @property
    def resistor_always_on(self) -> bool:
        """Whether the source itself reaches the threshold, so that the brake resistor never goes off."""
        return self.threshold is not None and self.threshold <= self.voltage

    @property
    def braking_power(self) -> float | None:
        """Power of the brake resistor at its threshold voltage [W]; 0 if it never goes off, None without a resistor,
        and where the bus voltage is checked instead.
        """
        if self.resistance is None or self.threshold is None or self.max_voltage is not None:
            return None
        return 0.0 if self.resistor_always_on else self.threshold**2 / self.resistance


def limits_of(sheet: AmplifierSheet) -> Amplifier:
    """Limits of a catalogue amplifier at one joint; if its data sheet gives no modulation, that of ``Amplifier``."""
    modulation = Amplifier.modulation if sheet.modulation is None else sheet.modulation
    return Amplifier(
        sheet.peak_current, sheet.continuous_current, modulation, sheet.logic_power,
        current_basis=sheet.current_basis, peak_time=sheet.peak_time,
        thermal_time_constant=sheet.thermal_time_constant, min_voltage=sheet.min_voltage,
        max_voltage=sheet.max_voltage, price=sheet.price, key=sheet.key, source=sheet.source,
    )  # fmt: skip


def best_of(amplifiers: Sequence[Amplifier]) -> Amplifier:
    """An amplifier that permits whatever at least one of several permits; what not all of them limit in the same way is
    not limited.
    """
    largest: dict[str, Any] = {
        name: None if None in (values := [getattr(one, name) for one in amplifiers]) else max(values)
        for name in ("peak_current", "continuous_current", "max_voltage")
    }
    standby = min(one.standby_power or 0.0 for one in amplifiers)
    return Amplifier(**largest, modulation=max(one.modulation for one in amplifiers), standby_power=standby)


def rates_supply(amplifier: Amplifier) -> bool:
    """Whether the amplifier's range of supply voltage is checked: for catalogue rows, and if a range is stated."""
    return bool(amplifier.key) or (amplifier.min_voltage, amplifier.max_voltage) != (None, None)


# s; if none is printed: that of a 3.5 s time constant, as in two shipped amplifiers, at twice I_c
LEAST_PEAK_TIME = 1.0


def with_peak_time(amplifier: Amplifier) -> Amplifier:
    """An amplifier with a conservative duration of its peak current if none is stated."""
    both = amplifier.continuous_current is not None and amplifier.peak_current is not None
    complete = not both or judges_overload(amplifier)
    return amplifier if complete else replace(amplifier, peak_time=LEAST_PEAK_TIME)


def judges_overload(amplifier: Amplifier) -> bool:
    """Whether an amplifier states how long it can supply more than its continuous current."""
    timed = amplifier.peak_current is not None and amplifier.peak_time is not None
    return amplifier.continuous_current is not None and (timed or amplifier.thermal_time_constant is not None)


@law
def conduction_loss(on_resistance: Any, current: Any) -> Any:
    """Conduction loss of a bridge in which every current passes two switches [W].

    1.5 R I^2 with the amplitude I of a phase, 2/sqrt(3) of the DC equivalent (three half bridges, sinusoidal currents).
    """
    return 2.0 * on_resistance * current * current


def available_voltage(amplifier: Amplifier, supply_voltage: float) -> float:
    """The largest voltage the amplifier can put between two motor terminals."""
    return amplifier.modulation * supply_voltage


def to_dc(current: Values, basis: CurrentBasis | str) -> Values:
    """A printed current converted to the DC equivalent.

    Args:
        current: Current in the printed basis [A].
        basis: Convention of the printed current: ``dc``, ``rms`` or ``peak``.

    Returns:
        DC-equivalent current [A].

    Raises:
        InputError: An unknown basis.
    """
    return current * _dc_amperes(basis)


def from_dc(current: Values, basis: CurrentBasis | str) -> Values:
    """A DC-equivalent current converted to another basis, as the settings of an amplifier may require.

    Args:
        current: DC-equivalent current [A].
        basis: Convention of the result: ``dc``, ``rms`` or ``peak``.

    Returns:
        Current in that basis [A].

    Raises:
        InputError: An unknown basis.
    """
    return current / _dc_amperes(basis)


def motor_basis(kind: str, basis: CurrentBasis | str) -> CurrentBasis | str:
    """The convention of the current in a motor's leads on an amplifier of a basis.

    A brushed motor carries direct current, whose RMS value and amplitude are the current itself. How much of it an
    amplifier rated for sinusoidal phases permits is taken from equal conduction loss of its bridge, as for the DC
    equivalent: sqrt(3/2) times its RMS amperes. Manufacturers that print both permit more, the amplitude.
    """
    return CurrentBasis.DC if kind == "brushed" else basis


def torque_constant_to_dc(constant: Values, basis: CurrentBasis | str) -> Values:
    """A printed torque constant converted to the DC equivalent, the inverse of the conversion of currents."""
    return constant / _dc_amperes(basis)


def line_to_line(phase_value: Values) -> Values:
    """Resistance or inductance between two terminals of a star connection: that of two phases in series."""
    return 2.0 * phase_value


def _dc_amperes(basis: CurrentBasis | str) -> float:
    """DC-equivalent amperes in one ampere of the basis."""
    return _DC_AMPERES[member_of(CurrentBasis, basis, "current basis", "must be dc, rms or peak")]


# Overload above the continuous current: i2t with a peak time, or a model with one time constant.
#
# Both are periodic steady states: the result is valid for a cycle that is repeated endlessly.


@law
def overload_room(amplifier: Any) -> Any:
    """Overload at which the amplifier trips: 1 in the first-order model, else ((I_p/I_c)^2 - 1) t_p [s]."""
    if known(amplifier.thermal_time_constant):
        return 1.0
    return ((amplifier.peak_current / amplifier.continuous_current) ** 2 - 1.0) * amplifier.peak_time


@law
def overload_after(amplifier: Any, overload: Any, square: Any, step: Any) -> Any:
    """Overload after a step [s]; ``overload``: the one before it, ``square``: (current / continuous current)^2 [-]."""
    constant = amplifier.thermal_time_constant
    if known(constant):
        left = math.exp(-step / constant)
        return left * overload + (1.0 - left) * square
    grown = overload + (square - 1.0) * step
    return 0.5 * (grown + abs(grown))  # not below zero, without a branch, which C code could not record


@law
def overload_allows(amplifier: Any, overload: Any, step: Any) -> Any:
    """(current / continuous current)^2 with which the overload reaches its limit in a step [s]; 1 at its limit."""
    constant = amplifier.thermal_time_constant
    if known(constant):
        left = math.exp(-step / constant)
        return (1.0 - left * overload) / (1.0 - left)
    return 1.0 + (overload_room(amplifier) - overload) / step


class OverloadCycle(NamedTuple):
    """Overload during one cycle, as ``overload_after`` counts it."""

    most: float  # largest
    end: float  # after the cycle


@law
def overload_cycle(amplifier: Any, series: Any, over: Any, step: Any, overload: Any) -> Any:
    """Overload during one cycle; ``overload``: before it, ``over``: factor on the squares of the series.

    A step in which the current passes the continuous one counts in two parts: the overload is largest between them.
    """
    most, continuous = overload, 1.0 / math.sqrt(over)
    for t in range(len(step)):
        first, last, until = series[t], series[min(t + 1, len(series) - 1)], 0.0  # the last sample is held
        if (abs(first) > continuous) != (abs(last) > continuous):
            edge = math.copysign(continuous, first if abs(first) > continuous else last)
            until = step[t] * (edge - first) / (last - first)
            overload = overload_after(amplifier, overload, over * mean_square(first, edge), until)
            most, first = max(most, overload), edge
        overload = overload_after(amplifier, overload, over * mean_square(first, last), step[t] - until)
        most = max(most, overload)
    return OverloadCycle(most, overload)


@law
def overload_share(amplifier: Any, series: Any, scale: Any, step: Any, edges: Any) -> Any:
    """Largest utilisation of an amplifier's overload in the repeated cycle; above 1 it trips or folds back.

    The current is a series times a scale [A], linear between samples, and each sample is a step [s] before the next.
    With a peak time the integral of I^2 - I_c^2, never below zero, is compared with (I_p^2 - I_c^2) t_p; with a time
    constant the first-order mean of I^2 is compared with I_c^2. This is the i2t monitor of servo drives: E' = I^2 -
    I_c^2 and theta' = (I^2/I_c^2 - theta)/tau.

    ``edges`` are the first samples of the parts of a mix, and the one after the last. Each part is repeated until its
    overload is periodic, and may follow any other: it begins with the most that one of them leaves. As no part leaves
    more than the larger of that and its own, no order of the parts and no number of repetitions gives more.
    """
    over, constant = (scale / amplifier.continuous_current) ** 2, amplifier.thermal_time_constant
    most, left, used = 0.0, 0.0, 0.0
    for part in range(len(edges) - 1):
        first, last = edges[part], edges[part + 1]
        total, length, above = squares_of(series[first:last], over, step[first:last])
        used += above
        if not known(constant) and total > length * (1.0 + 1e-12):
            return math.inf
        if known(constant) or above > 0.0:  # starting from empty
            found = overload_cycle(amplifier, series[first:last], over, step[first:last], 0.0)
            # the state that the affine map of a cycle leaves unchanged; with a peak time that after the first cycle
            end = found.end / -math.expm1(-length / constant) if known(constant) else found.end
            most, left = max(most, found.most), max(left, end)
    if not known(constant) and used == 0.0:  # never above the continuous current
        return 0.0
    if left > 0.0:
        for part in range(len(edges) - 1):
            first, last = edges[part], edges[part + 1]
            most = max(most, overload_cycle(amplifier, series[first:last], over, step[first:last], left).most)
    if most == 0.0:
        return 0.0
    capacity = overload_room(amplifier)
    return most / capacity if capacity > 0.0 else math.inf


@law(fastmath=FAST)
def squares_of(series: Any, over: Any, step: Any) -> Any:
    """Integral of a factor times the square of a series that is linear over each step [s], total length [s], and how
    many samples have a square above 1; the last sample is held.
    """
    before, after, last = series[:-1], series[1:], over * series[-1] * series[-1]
    total, length, above = last * step[-1], step[-1], 1.0 * (last > 1.0)
    for t in range(len(before)):
        total += over * mean_square(before[t], after[t]) * step[t]
        length += step[t]
        above += 1.0 * (over * before[t] * before[t] > 1.0)
    return total, length, above


# Bus behind all amplifiers: regenerated energy raises its voltage until a brake resistor dissipates the rest.


ROUNDS = 1000  # largest number of cycles until the bus returns to its initial energy
GROWN = 1e-9  # relative gain of energy in a cycle below which it counts as returned


class BusStep(NamedTuple):
    """Result of one step of a bus."""

    energy: float  # energy in the capacitor [J]
    # Energy supplied by the source, and dissipated by the resistor [J].
    fed: float
    burnt: float


@law
def bus_step(energy: Any, drawn: Any, least_energy: Any, most_energy: Any, feedable: Any, burnable: Any) -> Any:
    """Energy of a bus after a step [J]: the source fills it to ``least_energy``, the resistor dissipates all above
    ``most_energy``.
    """
    left = energy - drawn
    fed = min(max(least_energy - left, 0.0), feedable)
    burnt = min(max(left + fed - most_energy, 0.0), burnable)
    return BusStep(left + fed - burnt, fed, burnt)


@law
def burnable(energy: Any, regenerated: Any, most_energy: Any, length: Any, rate: Any) -> Any:
    """Energy that a brake resistor can dissipate in an interval of constant regenerated power [J].

    Above ``most_energy`` [J] it is on, and the energy E of the bus follows E' = P - r E with r = 2/(R C) [1/s].
    """
    if energy < most_energy:
        above = energy + regenerated * length - most_energy
        if above <= 0.0:
            return 0.0
        energy, length = most_energy, above / regenerated  # from when it reaches the threshold
    final = regenerated / rate
    return max(regenerated * length + (final - energy) * math.expm1(-rate * length), 0.0)


class BusPeak(NamedTuple):
    """Bus voltage over a cycle that is repeated endlessly."""

    voltage: float  # highest voltage [V]; infinite if every cycle adds energy
    sample: int  # sample after which the highest voltage is reached
    burnt: float  # mean power of the brake resistor [W]
    left: float  # voltage at the end of a cycle [V]


@kernel
def bus_peak(
    voltage: float, capacity: float, threshold: float, resistance: float, time: Array, power: Array, begin: float
) -> BusPeak:
    """Highest voltage of a bus whose source can supply any power and accepts none; ``begin``: voltage before the first
    cycle, not below that of the source [V].

    V2 = sqrt(V1^2 + 2 E/C), E the energy fed back since the bus was last at V1; the power is linear between samples.
    """
    full, rate = 0.5 * capacity * voltage * voltage, 2.0 / (resistance * capacity)
    most = max(0.5 * capacity * threshold * threshold, full)
    energy = 0.5 * capacity * begin * begin
    highest, sample, burnt, before = energy, 0, 0.0, energy
    for _ in range(ROUNDS):
        before, burnt = energy, 0.0
        for t in range(len(power) - 1):
            step, first, last = time[t + 1] - time[t], power[t], power[t + 1]
            turns = first * last < 0.0
            # until the power changes its sign, and after: what one part feeds back, the other cannot take before it
            until, middle = (step * first / (first - last), 0.0) if turns else (step, last)
            for length, mean in ((until, 0.5 * (first + middle)), (step - until, 0.5 * (middle + last))):
                burns = burnable(energy, -mean, most, length, rate) if threshold < math.inf else 0.0
                after = bus_step(energy, mean * length, full, most, math.inf, burns)
                energy = after.energy
                burnt += after.burnt
                if energy > highest:
                    highest, sample = energy, t + 1
        if energy - before <= GROWN * energy:
            break
    if energy - before > GROWN * energy:
        highest = math.inf
    length = time[-1] - time[0]
    mean = burnt / length if length > 0.0 else 0.0
    return BusPeak(math.sqrt(2.0 * highest / capacity), sample, mean, math.sqrt(2.0 * energy / capacity))
