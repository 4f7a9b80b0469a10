"""The motor without inductance: the current equals its command, within the limits of amplifier and voltage."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from drivetrain.drive.motor import Motor, Terminals, terminals, torque_constant, winding_resistance
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import positive_or_infinite, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.jit import law


@dataclass
class Own:
    """Record of the effect: the motor's parameters with their temperature coefficients, and the peak current [A]."""

    motor: Terminals
    peak: float


@law
def warm(motor: Any, heat: Any) -> tuple[float, float]:
    """Resistance [ohm] and torque constant [N m/A] of a motor at its present temperatures."""
    return winding_resistance(motor, heat.winding), torque_constant(motor, heat.housing)


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin, motor = joint.pin, joint.motor
    resistance, constant = warm(own.motor, joint.heat)
    current, damping, stiffness = pin.command, pin.damping, pin.stiffness
    if abs(current) > own.peak:
        current = own.peak if current > 0.0 else -own.peak
        damping = stiffness = 0.0
    emf = constant * motor.speed
    if pin.limit < math.inf:
        high, low = (pin.limit - emf) / resistance, (-pin.limit - emf) / resistance
        if current > high or current < low:
            current = high if current > high else low
            damping, stiffness = constant / resistance, 0.0
    pin.current, pin.voltage = current, emf + resistance * current
    motor.torque += constant * current
    motor.damping += constant * damping
    motor.stiffness += constant * stiffness


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin, heat = joint.pin, joint.heat
    resistance, constant = warm(own.motor, heat)
    heat.copper_loss = resistance * pin.current * pin.current
    pin.power = heat.copper_loss + constant * pin.current * joint.motor.speed


@dataclass(frozen=True)
class MotorCurrent(Effect):
    """Torque follows the commanded current without delay; resistance and torque constant follow the temperatures.

    Attributes:
        motor: Resistance, torque constant and how they change with temperature.
        peak_current: Peak current of the amplifier [A]; infinite: no limit.
        voltage: Voltage available between the terminals if no effect provides it [V]; infinite: no limit.
    """

    motor: Motor
    peak_current: float = math.inf
    voltage: float = math.inf

    limits = ranges(peak_current=positive_or_infinite("A"), voltage=positive_or_infinite("V"))
    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(
                s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS, s.MOTOR_SPEED,
                *s.temperatures(self.motor), replace(s.VOLTAGE_LIMIT, default=self.voltage),
            ),
            provides=(s.CURRENT, s.VOLTAGE),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_DAMPING, s.MOTOR_STIFFNESS),
            outputs=(s.COPPER_LOSS, s.ELECTRICAL_POWER),
        )  # fmt: skip

    def own(self, place: Place) -> Own:
        return Own(terminals(self.motor), self.peak_current)
