"""The motor with inductance: the current follows the voltage at its terminals, stepped exactly."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from drivetrain.drive.electrical import current_reach
from drivetrain.drive.motor import Motor, motor_lines
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, State, TimeScale
from drivetrain.effects.estimate import Conditions, Estimate
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

# Kept behind the constants: resistance and step that the rest is made for, growth at the end of a step and in its mean
# for a volt, means of the fading exponential and of its square; the speed in the middle of the last step.
MADE_FOR, END, MEAN, FADE, FADED, MIDDLE, ROOM = 5, 7, 8, 9, 10, 11, 12


@law
def _make(numbers: Any, at: int, resistance: float, h: float) -> None:
    """The exponentials of a step, as long as neither the winding's temperature nor the step changes."""
    numbers[at + END], numbers[at + MEAN] = current_reach(resistance, numbers[at + 4], h)
    _, twice = current_reach(2.0 * resistance, numbers[at + 4], h)
    # 1 - R share is the mean of the fading exponential, 1 - 2 R twice that of its square.
    numbers[at + FADE] = 1.0 - resistance * numbers[at + MEAN]
    numbers[at + FADED] = 1.0 - 2.0 * resistance * twice
    numbers[at + MADE_FOR], numbers[at + MADE_FOR + 1] = resistance, h


@law
def _told(current: float, constant: float, speed: float, numbers: Any, at: int) -> float:
    """The current at an instant.

    The state follows a back-emf that is held over each step, half a step late; who looks at an instant is told what it
    comes to where the back-emf goes on as the speed does.
    """
    if numbers[at + MADE_FOR + 1] == 0.0:  # no step yet
        return current
    return current + (numbers[at + END] - 2.0 * numbers[at + MEAN]) * constant * (speed - numbers[at + MIDDLE])


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        current = x[words[row + 1]]
        resistance = numbers[at] + numbers[at + 1] * signals[words[row + 4]]
        constant = numbers[at + 2] + numbers[at + 3] * signals[words[row + 5]]
        if h == 0.0:
            current = _told(current, constant, signals[words[row + 3]], numbers, at)
        missing = signals[words[row + 2]] - constant * signals[words[row + 3]] - resistance * current
        if h == 0.0:
            rates[words[row + 1]] = missing / numbers[at + 4]
            signals[words[row + 7]] += constant * current
            continue
        if numbers[at + MADE_FOR] != resistance or numbers[at + MADE_FOR + 1] != h:
            _make(numbers, at, resistance, h)
        mean = numbers[at + MEAN]
        rates[words[row + 1]] = numbers[at + END] * missing / h
        signals[words[row + 7]] += constant * (current + mean * missing)
        signals[words[row + 8]] += constant * constant * mean


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        current = x[words[row + 1]]
        resistance = numbers[at] + numbers[at + 1] * signals[words[row + 4]]
        constant = numbers[at + 2] + numbers[at + 3] * signals[words[row + 5]]
        told = _told(current, constant, signals[words[row + 3]], numbers, at)
        square, mean = told * told, told
        if h > 0.0:  # exactly over the step, in which the current nears its end as an exponential
            missing = signals[words[row + 2]] - constant * signals[words[row + 3]] - resistance * current
            # Now that the speed is known: the law has seen a guess of it.
            rates[words[row + 1]] = numbers[at + END] * missing / h
            numbers[at + MIDDLE] = signals[words[row + 3]]
            reach = missing / resistance
            mean = current + numbers[at + MEAN] * missing
            final = current + reach
            square = final * final - 2.0 * final * reach * numbers[at + FADE] + reach * reach * numbers[at + FADED]
        else:
            signals[words[row + 6]] = told
        signals[words[row + 9]] = resistance * square
        signals[words[row + 10]] = signals[words[row + 2]] * mean
        signals[words[row + 11]] = 0.5 * numbers[at + 4] * current * current


@dataclass(frozen=True)
class Winding(Effect):
    """Resistance and inductance between the terminals; torque from the current that flows.

    In a fixed step voltage and speed are held at their means and the current moves along its exponential, so that no
    step is too long for it. At the instants that are recorded it is ahead of its state by what the back-emf has changed
    since the middle of the step.

    Attributes:
        motor: Resistance, inductance, torque constant, and how they change with temperature.
        current: At the start [A].
    """

    motor: Motor
    current: float = 0.0

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = []
        if not (self.motor.inductance or 0.0) > 0.0:
            hint = "MotorCurrent is the motor without inductance"
            faults.append(Fault("Winding.motor", "has no inductance on its sheet [H]", self.motor.key, hint))
        if not math.isfinite(self.current):
            faults.append(Fault("Winding.current", "must be a finite number [A]", self.current))
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        rest = self.motor.reference_temperature
        return Ports(
            states=(State(s.CURRENT.name, s.CURRENT.unit, 1e-6),),
            needs=(
                s.VOLTAGE, s.MOTOR_SPEED, replace(s.WINDING_TEMPERATURE, default=rest),
                replace(s.HOUSING_TEMPERATURE, default=rest), s.CURRENT,
            ),
            adds=(s.MOTOR_TORQUE, s.MOTOR_DAMPING),
            tells=(s.COPPER_LOSS, s.ELECTRICAL_POWER, s.MAGNETIC_ENERGY),
            powers={s.COPPER_LOSS.name: Role.LOSS, s.ELECTRICAL_POWER.name: Role.SOURCE},
            stores=(s.MAGNETIC_ENERGY.name,),
        )  # fmt: skip

    def numbers(self, place: Place) -> Sequence[float]:
        return *motor_lines(self.motor), self.motor.inductance or math.nan, *[0.0] * (ROOM - MADE_FOR)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        return (self.current,)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("current follows", (self.motor.inductance or math.nan) / self.motor.resistance),)

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        return Estimate(valid=False, why="a voltage-driven winding: the current follows no command")
