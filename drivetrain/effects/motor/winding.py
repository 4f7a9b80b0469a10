"""The motor with inductance: the current follows the voltage between the terminals, integrated exactly in a step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.motor import Motor, Terminals, current_reach, terminals
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.fields import finite, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.effects.motor.motor_current import warm
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class Own:
    motor: Terminals  # resistance and torque constant with their temperature coefficients
    inductance: float  # [H]
    # the state [A], and its rate [A/s]
    current: float = 0.0
    current_rate: float = 0.0
    # resistance [ohm] and step [s] for which the coefficients below were computed
    resistance: float = 0.0
    step: float = 0.0
    # change of the current per constant voltage: at the end of a step, and in the mean over it [A/V]
    end: float = 0.0
    mean: float = 0.0
    # means over a step of the decaying exponential exp(-R t / L), and of its square [-]
    fade: float = 0.0
    fade_square: float = 0.0
    middle_speed: float = 0.0  # speed in the middle of the last step [rad/s]


@law
def _update_coefficients(own: Any, resistance: float, h: float) -> None:
    """Compute the coefficients of a step, which depend on the resistance [ohm] and the step h [s]."""
    own.end, own.mean = current_reach(resistance, own.inductance, h)
    _, twice = current_reach(2.0 * resistance, own.inductance, h)
    # 1 - R mean is the mean of the decaying exponential, 1 - 2 R twice that of its square.
    own.fade = 1.0 - resistance * own.mean
    own.fade_square = 1.0 - 2.0 * resistance * twice
    own.resistance, own.step = resistance, h


@law
def _instant_current(own: Any, constant: float, speed: float) -> float:
    """The current at an instant [A].

    In fixed steps the state follows a back-emf that is constant over each step, so it lags by half a step. This output
    is corrected by the change of the back-emf since the middle of the last step. Before the first step it is the state.
    """
    return own.current + (own.end - 2.0 * own.mean) * constant * (speed - own.middle_speed)


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    """At an instant, rate of the current; in a step, mean torque and its damping by the back-emf."""
    pin, heat, motor = joint.pin, joint.heat, joint.motor
    resistance, constant = warm(own.motor, heat)
    if h == 0.0:
        current = pin.current = _instant_current(own, constant, motor.speed)  # what a sampled controller measures
        own.current_rate = (pin.voltage - constant * motor.speed - resistance * current) / own.inductance
        motor.torque += constant * current
        return
    if own.resistance != resistance or own.step != h:
        _update_coefficients(own, resistance, h)
    driving_voltage = pin.voltage - constant * motor.speed - resistance * own.current
    own.current_rate = own.end * driving_voltage / h
    motor.torque += constant * (own.current + own.mean * driving_voltage)
    motor.damping += constant * constant * own.mean


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Losses, power and magnetic energy; in a step, the final change of the current."""
    pin, heat, speed = joint.pin, joint.heat, joint.motor.speed
    resistance, constant = warm(own.motor, heat)
    mean = _instant_current(own, constant, speed)
    square = mean * mean
    if h > 0.0:  # exact means over the step, in which the current is an exponential function of time
        driving_voltage = pin.voltage - constant * speed - resistance * own.current
        # With the speed of the solution; ``compute`` knows only the guess.
        own.current_rate = own.end * driving_voltage / h
        own.middle_speed = speed
        reach = driving_voltage / resistance
        mean = own.current + own.mean * driving_voltage
        final = own.current + reach
        square = final * final - 2.0 * final * reach * own.fade + reach * reach * own.fade_square
    heat.copper_loss = resistance * square
    pin.power = pin.voltage * mean
    pin.magnetic_energy = 0.5 * own.inductance * own.current * own.current


def inductance_faults(effect: Any) -> list[Fault]:
    """The fault of an effect whose motor has no inductance in its data sheet."""
    if (effect.motor.inductance or 0.0) > 0.0:
        return []
    place, hint = f"{type(effect).__name__}.motor", "MotorCurrent is the motor without inductance"
    return [Fault(place, "has no inductance in its catalogue row [H]", effect.motor.key, hint)]


@dataclass(frozen=True)
class Winding(Effect):
    """Winding with resistance and inductance; torque from the actual current.

    In a fixed step the current is integrated exactly with the mean voltage and speed, so that no step is too long for
    it. The recorded current includes the change of the back-emf since the middle of the step.

    Attributes:
        motor: Resistance, inductance, torque constant, and how they change with temperature.
        current: Initial current [A]; None: the current command, or zero without one.
    """

    motor: Motor
    current: float | None = None

    limits = ranges(current=finite("A"))
    compute = _compute
    account = _account

    def faults(self) -> list[Fault]:
        return inductance_faults(self)

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State(s.CURRENT.name, s.CURRENT.unit, 1e-6),),
            needs=(s.VOLTAGE, s.MOTOR_SPEED, *s.temperatures(self.motor), s.CURRENT),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_DAMPING),
            outputs=(s.COPPER_LOSS, s.ELECTRICAL_POWER, s.MAGNETIC_ENERGY),
        )

    def own(self, place: Place) -> Own:
        return Own(terminals(self.motor), self.motor.inductance or math.nan)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        return (s.read(place, signals, s.CURRENT_COMMAND) if self.current is None else self.current,)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("current follows", (self.motor.inductance or math.nan) / self.motor.resistance),)
