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
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeVar

from drivetrain.arrays import Array
from drivetrain.drive.ranges import EFFICIENCY, NOT_NEGATIVE, POSITIVE, range_faults
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.jit import law
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
        current_basis: The ampere in which the user thinks; currents are told in it beside.
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
    """An amplifier's data sheet; None where the sheet says nothing (unknown is never zero).

    Attributes:
        key: Unique name in the catalogue.
        maker, series, part_number: As printed.
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
        regenerated_power: Largest mean power it takes back or burns in a brake resistor [W].
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
        sheet.peak_current, sheet.continuous_current, modulation, sheet.logic_power, peak_time=sheet.peak_time,
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
    """Whether it should say which supply it bears: those of a catalogue, and those that say so."""
    return bool(amplifier.key) or (amplifier.min_voltage, amplifier.max_voltage) != (None, None)


def judges_overload(amplifier: Amplifier) -> bool:
    """Whether it says how long it bears more than its continuous current."""
    timed = amplifier.peak_current is not None and amplifier.peak_time is not None
    return amplifier.continuous_current is not None and (timed or amplifier.thermal_time_constant is not None)


@law
def conduction_loss(on_resistance: Any, current: Any) -> Any:
    """Of the switches of a bridge, two of which every current passes [W].

    1.5 R I^2 with the amplitude I of a phase, 2/sqrt(3) of the DC equivalent (three half bridges, sinusoidal currents).
    """
    return 2.0 * on_resistance * current * current


@law
def standstill_current(current: Any) -> Any:
    """What a motor that stands still may ask of one phase for ever, as an RMS current [A].

    Turning, every phase carries the amplitude for an instant; at rest one of them may carry it all the time, sqrt(2)
    times its RMS. Brushed motors, whose brushes then load the same bars, are counted alike.
    """
    return math.sqrt(2.0) * current


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
    try:
        return _DC_AMPERES[CurrentBasis(basis)]
    except ValueError:
        names = [str(known) for known in CurrentBasis]
        raise InputError(Fault("current basis", "must be dc, rms or peak", basis, nearest(str(basis), names))) from None
