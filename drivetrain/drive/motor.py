"""The motor: data sheet in SI, and the laws of its shaft and terminals.

All electrical values are those of the equivalent DC machine between two terminals (for a three-phase motor: block
commutation, line to line), so that torque constant and back-emf constant are one number; the catalogue reader
converts from other conventions and refuses a row that does not state its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from drivetrain.arrays import Array, axes_of, checked_array, checked_number, checked_numbers
from drivetrain.drive.brake import NO_BRAKE, Brake
from drivetrain.drive.friction import Friction
from drivetrain.drive.ranges import EFFICIENCY, NOT_NEGATIVE, POSITIVE, TEMPERATURE, Range, range_faults
from drivetrain.drive.thermal.exponentials import first, second
from drivetrain.errors import Fault, Faults, InputError, nearest, raise_faults
from drivetrain.jit import kernel, law
from drivetrain.notebook import DataSheet
from drivetrain.records import known_or

Values = TypeVar("Values", float, Array)

COPPER_COEFFICIENT = 0.0039  # 1/K at 25 C, annealed copper
MOTOR_KINDS = ("brushed", "brushless")

_OPTIONAL_POSITIVE = (
    "inductance rotor_inertia mass nominal_voltage no_load_speed nominal_current nominal_torque nominal_speed "
    "stall_torque stall_current peak_current peak_torque max_speed resistance_winding_housing "
    "resistance_housing_ambient resistance_winding_ambient winding_time_constant housing_time_constant diameter length"
).split()
_RANGES = {
    "resistance": POSITIVE,
    "torque_constant": POSITIVE,
    **dict.fromkeys(_OPTIONAL_POSITIVE, POSITIVE),
    **dict.fromkeys(("no_load_current", "coulomb_friction", "viscous_friction", "price"), NOT_NEGATIVE),
    "winding_share": EFFICIENCY,
    "max_winding_temperature": TEMPERATURE,
    "reference_temperature": TEMPERATURE,
    "magnet_coefficient": Range("must lie between -0.02 and 0.02 1/K", -0.02, 0.02, low_included=True),
}
_REQUIRED = ("resistance", "torque_constant", "reference_temperature", "magnet_coefficient")


@dataclass(frozen=True, repr=False)
class Motor(DataSheet):
    """A motor's data sheet; None if the data sheet gives no value (unknown is never zero).

    Attributes:
        key: Unique name in the catalogue.
        maker, series, part_number: As printed.
        kind: ``brushed`` or ``brushless``.
        frameless: Sold as rotor and stator, without housing and bearings.
        resistance: Terminal resistance at ``reference_temperature`` [ohm].
        torque_constant: At ``reference_temperature`` [N m/A], equal to the back-emf constant [V s/rad].
        inductance: Terminal inductance [H].
        rotor_inertia: Inertia of the rotor [kg m^2].
        mass: Mass [kg].
        nominal_voltage: Nominal voltage [V].
        no_load_current: No-load current at nominal voltage [A].
        no_load_speed: No-load speed at nominal voltage [rad/s].
        coulomb_friction: Speed-independent part of the no-load torque [N m].
        viscous_friction: Part of the no-load torque that grows with speed [N m s/rad].
        nominal_current: Largest continuous current printed [A].
        nominal_torque: Largest continuous torque printed [N m].
        nominal_speed: Speed at which the nominal values hold [rad/s].
        stall_torque, stall_current: Torque and current of the blocked motor at nominal voltage [N m], [A].
        peak_current, peak_torque: Printed short-time limits [A], [N m].
        max_speed: Mechanical limit of the speed [rad/s].
        resistance_winding_housing, resistance_housing_ambient: Thermal resistances [K/W].
        resistance_winding_ambient: Thermal resistance where a data sheet gives only the sum of both [K/W].
        winding_share: Share of that sum between winding and housing; no data sheet gives it, but a study may assume it.
        winding_time_constant, housing_time_constant: Thermal time constants [s].
        max_winding_temperature: Largest permitted winding temperature [C].
        reference_temperature: Temperature at which resistance and torque constant are given [C].
        magnet_coefficient: Change of the torque constant with magnet temperature [1/K].
        diameter, length: Dimensions [m].
        price: In the user's currency; empty in the shipped catalogue.
        source: File and row, sheet, edition: what a report prints.
        friction_allowance, inductance_allowance: Assumed upper bounds of friction [N m] and inductance [H] if the data
            sheet gives no value, see ``motor_limits.with_allowances``; else 0.
        brake: Holding brake on its shaft, included in inertia, mass and price (see ``braked``).
    """

    key: str
    resistance: float
    torque_constant: float
    maker: str = ""
    series: str = ""
    part_number: str = ""
    kind: str = "brushless"
    frameless: bool = False
    inductance: float | None = None
    rotor_inertia: float | None = None
    mass: float | None = None
    nominal_voltage: float | None = None
    no_load_current: float | None = None
    no_load_speed: float | None = None
    coulomb_friction: float | None = None
    viscous_friction: float | None = None
    nominal_current: float | None = None
    nominal_torque: float | None = None
    nominal_speed: float | None = None
    stall_torque: float | None = None
    stall_current: float | None = None
    peak_current: float | None = None
    peak_torque: float | None = None
    max_speed: float | None = None
    resistance_winding_housing: float | None = None
    resistance_housing_ambient: float | None = None
    resistance_winding_ambient: float | None = None
    winding_share: float | None = None
    winding_time_constant: float | None = None
    housing_time_constant: float | None = None
    max_winding_temperature: float | None = None
    reference_temperature: float = 25.0
    magnet_coefficient: float = -0.001
    diameter: float | None = None
    length: float | None = None
    price: float | None = None
    source: str = ""
    friction_allowance: float = 0.0
    inductance_allowance: float = 0.0
    brake: Brake = NO_BRAKE

    def __post_init__(self) -> None:
        owner = f"motor {self.key}"
        faults = range_faults(owner, self, _RANGES, required=_REQUIRED)
        if self.kind not in MOTOR_KINDS:
            faults.append(Fault(f"{owner}.kind", "unknown kind", self.kind, nearest(str(self.kind), MOTOR_KINDS)))
        raise_faults(faults)


def braked(motor: Motor, brake: Brake) -> Motor:
    """A motor with a holding brake on its shaft as one part with the key ``MOTOR+BRAKE``."""
    sums: dict[str, float | None] = {}
    for name, own in (("rotor_inertia", "inertia"), ("mass", "mass"), ("price", "price")):
        values = getattr(motor, name), getattr(brake, own)
        sums[name] = None if None in values else sum(values)
    if brake.mass is None:
        sums["mass"] = motor.mass  # the known part loads the arm; whole_mass is None where one of them is unknown
    return replace(motor, key=f"{motor.key}+{brake.key}", brake=brake, **sums)  # type: ignore[arg-type]


def bare_key(motor: Motor) -> str:
    """Key of a motor without its brake."""
    return motor.key.removesuffix(f"+{motor.brake.key}") if motor.brake.key else motor.key


def whole_mass(motor: Motor) -> float | None:
    """Mass of a motor with its brake [kg]; None where one of them is unknown."""
    return None if motor.brake.key and motor.brake.mass is None else motor.mass


@dataclass(frozen=True)
class Terminals:
    """The values of a motor that ``winding_resistance`` and ``torque_constant`` read; see ``Motor``."""

    resistance: float
    torque_constant: float
    reference_temperature: float
    magnet_coefficient: float


def terminals(motor: Motor) -> Terminals:
    """The electrical values of a motor, for laws that do not keep its whole data sheet."""
    return Terminals(motor.resistance, motor.torque_constant, motor.reference_temperature, motor.magnet_coefficient)


@law
def copper_coefficient(temperature: float) -> float:
    """Relative change of copper's resistance per kelvin, at a reference temperature [1/K]; 0.0039 at 25 C.

    The resistance is linear in temperature, with its zero at 25 C - 1/0.0039.
    """
    return 1.0 / (1.0 / COPPER_COEFFICIENT + temperature - 25.0)


@law
def winding_resistance(motor: Motor | Terminals, temperature: Values) -> Values:
    """Terminal resistance R = R0 (1 + a (T - T0)) [ohm], with a from ``copper_coefficient``.

    Args:
        motor: Motor with R0 and T0.
        temperature: Winding temperature T [C].
    """
    rise = temperature - motor.reference_temperature
    return motor.resistance * (1.0 + copper_coefficient(motor.reference_temperature) * rise)


@law
def torque_constant(motor: Motor | Terminals, magnet_temperature: Values) -> Values:
    """Torque constant kt = kt0 (1 + b (T - T0)) [N m/A] = [V s/rad].

    Args:
        motor: Motor with kt0, b and T0.
        magnet_temperature: Magnet temperature T [C].
    """
    rise = magnet_temperature - motor.reference_temperature
    return motor.torque_constant * (1.0 + motor.magnet_coefficient * rise)


@law
def strongest_constant(motor: Motor, coldest: Any) -> Any:
    """Torque constant at the lowest magnet temperature, or at the data sheet's temperature if that is lower [N m/A]."""
    return torque_constant(motor, min(coldest, motor.reference_temperature))


@law
def winding_voltage(
    constant: Values, resistance: Values, inductance: float, speed: Values, current: Values, current_rate: Values
) -> Values:
    """Terminal voltage u = kt w + R i + L di/dt [V]. Modern Robotics, equation 8.102."""
    return constant * speed + resistance * current + inductance * current_rate


def has_friction_data(motor: Motor) -> bool:
    """Whether a data sheet gives all values of ``no_load_friction``."""
    return motor.no_load_current is not None or None not in (motor.coulomb_friction, motor.viscous_friction)


def no_load_friction(motor: Motor) -> Friction | None:
    """Friction at the motor shaft from the data sheet's no-load values.

    If both friction values are given, they are used. If one of them and the no-load point are given, the other is the
    remainder of torque constant times no-load current at no-load speed. If neither is given, or one without a no-load
    speed, torque constant times no-load current is taken as independent of speed, which gives the larger friction at
    every speed below no-load speed. One friction value without no-load data is used alone.
    """
    coulomb, viscous = motor.coulomb_friction, motor.viscous_friction
    no_load = None if motor.no_load_current is None else motor.torque_constant * motor.no_load_current
    if coulomb is None and viscous is None:
        return None if no_load is None else Friction(coulomb=no_load)
    if no_load is not None and motor.no_load_speed is None and None in (coulomb, viscous):
        return Friction(coulomb=max(no_load, coulomb or 0.0))
    if no_load is not None and motor.no_load_speed is not None:
        if coulomb is None and viscous is not None:
            coulomb = max(no_load - viscous * motor.no_load_speed, 0.0)
        elif viscous is None and coulomb is not None:
            viscous = max(no_load - coulomb, 0.0) / motor.no_load_speed
    return Friction(coulomb=coulomb or 0.0, viscous=viscous or 0.0)


def current(motor: Motor, motor_torque: Values, magnet_temperature: float) -> Values:
    """Current for an electromagnetic torque [A]."""
    return motor_torque / torque_constant(motor, magnet_temperature)


def terminal_voltage(
    motor: Motor,
    speed: Array,
    current: Array,
    current_rate: Array | float,
    winding_temperature: Array | float,
    magnet_temperature: Array | float,
) -> Array:
    """Terminal voltage; the inductive term is omitted where the inductance is unknown.

    Args:
        motor: Data sheet.
        speed: Speed of the rotor relative to the stator [rad/s], any shape.
        current: Current [A], same shape.
        current_rate: Rate of change of the current [A/s], same shape or a scalar.
        winding_temperature: Winding temperature [C], same shape or a scalar.
        magnet_temperature: Magnet temperature [C], same shape or a scalar.

    Returns:
        Terminal voltage [V], same shape.
    """
    resistance = winding_resistance(motor, np.asarray(winding_temperature, dtype=np.float64))
    constant = torque_constant(motor, np.asarray(magnet_temperature, dtype=np.float64))
    rate = np.asarray(current_rate, dtype=np.float64)
    return np.asarray(winding_voltage(constant, resistance, known_or(motor.inductance, 0.0), speed, current, rate))


def stall_current(motor: Motor) -> float | None:
    """Current at nominal voltage with the shaft blocked, at reference temperature [A]."""
    return None if motor.nominal_voltage is None else motor.nominal_voltage / motor.resistance


def stall_torque(motor: Motor) -> float | None:
    """Electromagnetic torque at nominal voltage with the shaft blocked, at reference temperature.

    Args:
        motor: Data sheet.

    Returns:
        Torque [N m]; None without a nominal voltage.

    Reference:
        Lynch and Park, Modern Robotics (2017), section 8.9.1: k_t V / R.
    """
    blocked = stall_current(motor)
    return None if blocked is None else motor.torque_constant * blocked


def no_load_speed(motor: Motor) -> float | None:
    """Speed at nominal voltage without load, at reference temperature.

    Args:
        motor: Data sheet; without a no-load current the voltage drop in the winding is neglected.

    Returns:
        Speed [rad/s]; None without a nominal voltage.
    """
    if motor.nominal_voltage is None:
        return None
    return (motor.nominal_voltage - motor.resistance * (motor.no_load_current or 0.0)) / motor.torque_constant


# The winding as a linear electrical stage with an exact step, which is stable and accurate for any step and inductance.
#
# The time constant L/R of a winding is some tenths of a millisecond. An explicit step of a millisecond multiplies the
# current by ``1 - h R/L``, which is -2.6 for a common motor and therefore unstable. The stage is linear while voltage,
# speed and temperature are constant, so its step is an exponential.


ABSOLUTE_ZERO = -273.15  # C


class CurrentStep(NamedTuple):
    """Current after a step, and its mean over the step, which determines the impulse of the torque.

    Attributes:
        end: Current at the end of the step [A].
        mean: Mean current over the step [A].
    """

    end: Array
    mean: Array


def exact_current_step(
    motor: Motor,
    current: Array | float,
    voltage: Array | float,
    speed: Array | float,
    step: float,
    *,
    winding_temperature: float | None = None,
    magnet_temperature: float | None = None,
) -> CurrentStep:
    """Current after a time in which voltage and speed are constant, exact for any length of the step.

    Args:
        motor: Resistance, inductance (if unknown, the current follows immediately) and torque constant.
        current: Current at the start of the step [A], any shape.
        voltage: Terminal voltage [V], same shape or a scalar.
        speed: Speed of the rotor relative to the stator [rad/s], same shape or a scalar.
        step: Length of the step [s].
        winding_temperature, magnet_temperature: Temperatures [C]; None: the motor's reference temperature.

    Returns:
        Current at the end and its mean over the step, same shape.

    Raises:
        InputError: Values that are no finite numbers, a step that is not positive, or no resistance left.

    Reference: L dI/dt = V - R I - k_t w, Modern Robotics, equation 8.102; its solution with the right-hand side held.
    """
    cold = motor.reference_temperature
    winding, magnets = (cold if t is None else t for t in (winding_temperature, magnet_temperature))
    temperatures = {"winding_temperature": (winding, "C"), "magnet_temperature": (magnets, "C")}
    given = {"current": current, "voltage": voltage, "speed": speed}
    faults = Faults()
    faults.attempt(checked_numbers, temperatures, least=ABSOLUTE_ZERO)
    faults.attempt(checked_number, step, "step", "s", above=0.0)
    for name, value in given.items():
        faults.attempt(checked_array, value, (None,) * max(axes_of(value), 0), name)
    faults.raise_any()
    resistance, constant = winding_resistance(motor, winding), torque_constant(motor, magnets)
    if not resistance > 0.0:
        raise InputError(Fault("winding_temperature", "leaves the winding no resistance", resistance))
    start, volts, turning = (np.asarray(value, dtype=np.float64) for value in given.values())
    missing = volts - constant * turning - resistance * start
    end, mean = current_reach(resistance, motor.inductance or 0.0, float(step))
    return CurrentStep(np.asarray(start + end * missing), np.asarray(start + mean * missing))


@kernel
def current_reach(resistance: float, inductance: float, step: float) -> tuple[float, float]:
    """Changes of current at the end of a step and in its mean per volt of ``V - R I - k_t w`` at its start [A/V]."""
    if inductance == 0.0:
        return 1.0 / resistance, 1.0 / resistance
    rate = -resistance * step / inductance
    grown = first(rate)
    return step / inductance * grown, step / inductance * second(rate, grown)
