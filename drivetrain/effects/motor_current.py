"""The motor without inductance: the current is what is commanded, as far as amplifier and voltage let it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from drivetrain.drive.motor import Motor, motor_lines
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        speed = signals[words[row + 4]]
        resistance = numbers[at] + numbers[at + 1] * signals[words[row + 5]]
        constant = numbers[at + 2] + numbers[at + 3] * signals[words[row + 6]]
        volts, peak = signals[words[row + 7]], numbers[at + 4]
        current, damping, stiffness = signals[words[row + 1]], signals[words[row + 2]], signals[words[row + 3]]
        if abs(current) > peak:
            current = peak if current > 0.0 else -peak
            damping = stiffness = 0.0
        emf = constant * speed
        if volts < math.inf:
            high, low = (volts - emf) / resistance, (-volts - emf) / resistance
            if current > high or current < low:
                current = high if current > high else low
                damping, stiffness = constant / resistance, 0.0
        signals[words[row + 8]] = current
        signals[words[row + 9]] = emf + resistance * current
        signals[words[row + 10]] += constant * current
        signals[words[row + 11]] += constant * damping
        signals[words[row + 12]] += constant * stiffness


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        resistance = numbers[at] + numbers[at + 1] * signals[words[row + 5]]
        constant = numbers[at + 2] + numbers[at + 3] * signals[words[row + 6]]
        current = signals[words[row + 8]]
        copper = resistance * current * current
        signals[words[row + 13]] = copper
        signals[words[row + 14]] = copper + constant * current * signals[words[row + 4]]


@dataclass(frozen=True)
class MotorCurrent(Effect):
    """Torque from the commanded current, at once; resistance and torque constant follow the temperatures.

    Attributes:
        motor: Resistance, torque constant and how they change with temperature.
        peak_current: That the amplifier gives [A]; infinite: it knows no limit.
        voltage: That it can put between the terminals where no effect tells [V]; infinite: it knows no limit.
    """

    motor: Motor
    peak_current: float = math.inf
    voltage: float = math.inf

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        limits = (("peak_current", self.peak_current, "A"), ("voltage", self.voltage, "V"))
        faults = [Fault(f"MotorCurrent.{n}", f"must be positive [{unit}]", v) for n, v, unit in limits if not v > 0.0]
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        rest = self.motor.reference_temperature
        return Ports(
            needs=(
                s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS, s.MOTOR_SPEED,
                replace(s.WINDING_TEMPERATURE, default=rest), replace(s.HOUSING_TEMPERATURE, default=rest),
                replace(s.VOLTAGE_LIMIT, default=self.voltage),
            ),
            provides=(s.CURRENT, s.VOLTAGE),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_DAMPING, s.MOTOR_STIFFNESS),
            outputs=(s.COPPER_LOSS, s.ELECTRICAL_POWER),
            powers={s.COPPER_LOSS.name: Role.LOSS, s.ELECTRICAL_POWER.name: Role.SOURCE},
        )  # fmt: skip

    def numbers(self, place: Place) -> Sequence[float]:
        return *motor_lines(self.motor), self.peak_current
