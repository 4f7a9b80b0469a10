"""The motor's winding under a continuous current controller, between the limits of current and voltage."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.drive.current_loop_kernel import held_at, loop_step, stretch
from drivetrain.drive.held_step_kernel import held_step, put_matrix
from drivetrain.drive.motor import Motor, motor_lines
from drivetrain.effects import signals as s
from drivetrain.effects.bounds import bounded, lagging
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, State, TimeScale
from drivetrain.effects.estimate import Conditions, Estimate, TaskSeries
from drivetrain.effects.motor_current import MotorCurrent
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

HOT = 200.0  # K over the air
# Matrices of the free loop, kept behind the constants: resistance and step they are made for, over the whole step the
# end's share of the beginning and of what is held, the mean's, and over half of it the end's.
MADE_FOR, WHOLE, HELD, MEAN, HALF, HALF_HELD = 9, 11, 15, 19, 21, 25
# Behind them speed and place that the step was guessed at, and whether command and voltage were between their limits.
GUESSED, FREE, BETWEEN, ROOM = 29, 31, 32, 33


@law
def _make(numbers: Any, at: int, resistance: float, h: float) -> None:
    """The matrices of the free loop, as long as neither the winding's temperature nor the step changes."""
    inductance, kp, ki = numbers[at + 4], numbers[at + 5], numbers[at + 6]
    a, b, c = -(kp + resistance) / inductance, 1.0 / inductance, -ki
    for part in range(2):
        step = h if part == 0 else 0.5 * h
        whole, first, second = held_step((a, b, c, 0.0), step)
        put_matrix(numbers, at + (WHOLE if part == 0 else HALF), whole)
        put_matrix(numbers, at + (HELD if part == 0 else HALF_HELD), first)
        if part == 0:
            numbers[at + MEAN], numbers[at + MEAN + 1] = second[0], second[1]
    numbers[at + MADE_FOR], numbers[at + MADE_FOR + 1] = resistance, h


@law
def _reached(n: Any, at: int, held: int, x: tuple[float, float], by: tuple[float, float]) -> tuple[float, float]:
    """Current and integrator at the end of a step, or of half of it; ``by`` is h b."""
    return (
        n[at] * x[0] + n[at + 1] * x[1] + n[held] * by[0] + n[held + 1] * by[1],
        n[at + 2] * x[0] + n[at + 3] * x[1] + n[held + 2] * by[0] + n[held + 3] * by[1],
    )


# long kernel: at an instant and over a step, with the slopes that the mechanics need
@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        current, integral = x[words[row + 1]], x[words[row + 2]]
        speed = signals[words[row + 6]]
        resistance = numbers[at] + numbers[at + 1] * signals[words[row + 7]]
        constant = numbers[at + 2] + numbers[at + 3] * signals[words[row + 8]]
        inductance, kp, ki, peak = numbers[at + 4], numbers[at + 5], numbers[at + 6], numbers[at + 7]
        volts = signals[words[row + 9]]
        asked, free, between = signals[words[row + 3]], 1.0, 1.0
        if abs(asked) > peak:
            asked, free = peak if asked > 0.0 else -peak, 0.0
        forward, emf = numbers[at + 8] * speed, constant * speed
        limit = held_at(current, integral, volts, kp, asked, forward)
        if h == 0.0:
            wanted = kp * (asked - current) + integral + forward
            voltage = limit if limit != 0.0 else wanted
            rates[words[row + 1]] = (voltage - resistance * current - emf) / inductance
            rates[words[row + 2]] = ki * (asked - current) + (voltage - wanted) * ki / kp
            signals[words[row + 11]] = voltage
            signals[words[row + 12]] += constant * current
            continue
        if numbers[at + MADE_FOR] != resistance or numbers[at + MADE_FOR + 1] != h:
            _make(numbers, at, resistance, h)
        begin, by = (current, integral), (h * (kp * asked + forward - emf) / inductance, h * ki * asked)
        end, drawn = _reached(numbers, at + WHOLE, at + HELD, begin, by)
        mean = numbers[at + HELD] * current + numbers[at + HELD + 1] * integral
        mean += numbers[at + MEAN] * by[0] + numbers[at + MEAN + 1] * by[1]
        # The mean is a straight function of command and back-emf as long as the limit stays.
        by_command = h * (numbers[at + MEAN] * kp / inductance + numbers[at + MEAN + 1] * ki)
        by_speed = h * numbers[at + MEAN] * (numbers[at + 8] - constant) / inductance
        if volts < math.inf:
            middle = _reached(numbers, at + HALF, at + HALF_HELD, begin, (0.5 * by[0], 0.5 * by[1]))
            limited = limit != 0.0 or held_at(end, drawn, volts, kp, asked, forward) != 0.0
            if limited or held_at(middle[0], middle[1], volts, kp, asked, forward) != 0.0:
                loop = (resistance, inductance, kp, ki, asked, emf, forward)
                end, drawn, mean = loop_step(current, integral, h, volts, loop)
                between = 0.0
        if limit != 0.0:
            # Held there, the current follows the back-emf alone.
            _, _, by_speed = stretch(0.0, 0.0, h, limit, (resistance, inductance, kp, ki, 0.0, limit + constant, 0.0))
            free = 0.0
        numbers[at + GUESSED], numbers[at + GUESSED + 1] = speed, signals[words[row + 10]]
        numbers[at + FREE], numbers[at + BETWEEN] = free, between
        rates[words[row + 1]] = (end - current) / h
        rates[words[row + 2]] = (drawn - integral) / h
        signals[words[row + 11]] = resistance * mean + emf + inductance * (end - current) / h
        signals[words[row + 12]] += constant * mean
        signals[words[row + 13]] += constant * (free * by_command * signals[words[row + 4]] - by_speed)
        signals[words[row + 14]] += constant * free * by_command * signals[words[row + 5]]


@law
def _correct(h: float, constant: float, rates: Any, signals: Any, n: Any, words: Any, row: int) -> None:
    """Move the end of a step from the guessed motion, which the law has seen, to that which was found."""
    at = words[row]
    faster, further = signals[words[row + 6]] - n[at + GUESSED], signals[words[row + 10]] - n[at + GUESSED + 1]
    more = -n[at + FREE] * (signals[words[row + 4]] * faster + signals[words[row + 5]] * further)
    by = (h * (n[at + 5] * more + (n[at + 8] - constant) * faster) / n[at + 4], h * n[at + 6] * more)
    end = n[at + HELD] * by[0] + n[at + HELD + 1] * by[1]
    mean = n[at + MEAN] * by[0] + n[at + MEAN + 1] * by[1]
    resistance = n[at + MADE_FOR]
    signals[words[row + 11]] += resistance * mean + constant * faster + n[at + 4] * end / h
    rates[words[row + 1]] += end / h
    rates[words[row + 2]] += (n[at + HELD + 2] * by[0] + n[at + HELD + 3] * by[1]) / h


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        current, speed = x[words[row + 1]], signals[words[row + 6]]
        resistance = numbers[at] + numbers[at + 1] * signals[words[row + 7]]
        constant = numbers[at + 2] + numbers[at + 3] * signals[words[row + 8]]
        inductance = numbers[at + 4]
        square, mean, grown = current * current, current, 0.0
        if h > 0.0:
            if numbers[at + BETWEEN] != 0.0:
                _correct(h, constant, rates, signals, numbers, words, row)
            change = h * rates[words[row + 1]]
            end = current + change
            # The mean that the voltage told: V = R I + e + L dI/dt, all of them means over the step.
            mean = (signals[words[row + 11]] - constant * speed - inductance * change / h) / resistance
            # Simpson's rule, with the middle that this mean asks for.
            middle = 1.5 * mean - 0.25 * (current + end)
            square = (current * current + 4.0 * middle * middle + end * end) / 6.0
            grown = 0.5 * inductance * (end * end - current * current) / h
        copper = resistance * square
        signals[words[row + 15]] = copper
        power = copper + constant * speed * mean + grown
        signals[words[row + 16]] = power if h > 0.0 else signals[words[row + 11]] * current
        signals[words[row + 17]] = 0.5 * inductance * current * current


@dataclass(frozen=True)
class CurrentLoop(Effect):
    """A proportional and integral controller of the current, whose zero cancels the winding's pole.

    In a fixed step the winding and its controller move exactly, through any change at the voltage's limit; the
    integrator does not wind up there (see ``drive/current_loop_kernel.py``).

    Attributes:
        motor: Resistance, inductance, torque constant, and how they change with temperature.
        bandwidth: Of the closed loop [rad/s]: kp = L w, ki = R w, with R cold.
        peak_current: To which commands are cut [A].
        fed_forward: Share of the cold motor's back-emf that the controller adds to its voltage [-].
    """

    motor: Motor
    bandwidth: float
    peak_current: float = math.inf
    fed_forward: float = 1.0

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = []
        if not (self.motor.inductance or 0.0) > 0.0:
            hint = "MotorCurrent is the motor without inductance"
            faults.append(Fault("CurrentLoop.motor", "has no inductance on its sheet [H]", self.motor.key, hint))
        if not 0.0 < self.bandwidth < math.inf:
            faults.append(Fault("CurrentLoop.bandwidth", "must be positive [rad/s]", self.bandwidth))
        if not self.peak_current > 0.0:
            faults.append(Fault("CurrentLoop.peak_current", "must be positive [A]", self.peak_current))
        if not math.isfinite(self.fed_forward):
            faults.append(Fault("CurrentLoop.fed_forward", "must be a finite number [-]", self.fed_forward))
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        rest = self.motor.reference_temperature
        return Ports(
            states=(State(s.CURRENT.name, s.CURRENT.unit, 1e-6), State("integrated_voltage", "V", 1e-6)),
            needs=(
                s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS,
                s.MOTOR_SPEED,
                replace(s.WINDING_TEMPERATURE, default=rest), replace(s.HOUSING_TEMPERATURE, default=rest),
                s.VOLTAGE_LIMIT, s.MOTOR_POSITION,
            ),
            provides=(s.VOLTAGE,),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_DAMPING, s.MOTOR_STIFFNESS),
            outputs=(s.COPPER_LOSS, s.ELECTRICAL_POWER, s.MAGNETIC_ENERGY),
            powers={s.COPPER_LOSS.name: Role.LOSS, s.ELECTRICAL_POWER.name: Role.SOURCE},
            stores=(s.MAGNETIC_ENERGY.name,),
        )  # fmt: skip

    def numbers(self, place: Place) -> Sequence[float]:
        inductance = self.motor.inductance or math.nan
        kp, ki = inductance * self.bandwidth, self.motor.resistance * self.bandwidth
        forward = self.fed_forward * self.motor.torque_constant
        room = [0.0] * (ROOM - MADE_FOR)
        return *motor_lines(self.motor), inductance, kp, ki, self.peak_current, forward, *room

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        asked = signals.get(f"{place.name}.{s.CURRENT_COMMAND.name}", 0.0)
        current = min(max(asked, -self.peak_current), self.peak_current)
        speed = signals.get(f"{place.name}.{s.MOTOR_SPEED.name}", 0.0)
        rest = self.motor.reference_temperature
        cold, rise, weak, weaker = motor_lines(self.motor)
        resistance = cold + rise * signals.get(f"{place.name}.{s.WINDING_TEMPERATURE.name}", rest)
        constant = weak + weaker * signals.get(f"{place.name}.{s.HOUSING_TEMPERATURE.name}", rest)
        volts = signals.get(f"{place.name}.{s.VOLTAGE_LIMIT.name}", 0.0) or math.inf  # 0: not known yet
        current = min(max(current, (-volts - constant * speed) / resistance), (volts - constant * speed) / resistance)
        return current, resistance * current + (constant - self.fed_forward * self.motor.torque_constant) * speed

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        winding = (self.motor.inductance or math.nan) / self.motor.resistance
        return TimeScale("current loop", 1.0 / self.bandwidth), TimeScale("winding", winding)

    def quasi_static(self) -> Effect:
        return MotorCurrent(self.motor, self.peak_current)

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        """The lag of a first-order loop behind a command that moves within the time of a move.

        Reference:
            Fits over twelve scenes of one joint; the current lags by dI/dt over w, and never differs by more.
        """
        if conditions.series is not None:
            return self._along(place, conditions, conditions.series)
        slow = 1.0 / (self.bandwidth * max(conditions.move_time, 1e-300))
        rms = 7.6 * slow**1.11
        why = "lag of the current loop: 5.7 p^0.94 of the peak, p = 1/(bandwidth x time of a move)"
        return Estimate(5.7 * slow**0.94, rms, 2.0 * rms, 0.0, conditions.free and slow < 0.02, why)

    def _along(self, place: Place, conditions: Conditions, series: TaskSeries) -> Estimate:
        """Current less lagging current; of the position what such a momentum does to a loop damped critically.

        With e' = I' - w e the momentum gathered is (I - e) / w; the largest answer of x'' + 2 a x' + a^2 x to a
        momentum p is p / (2.718 m a). Not valid where a move lasts less than 50 lags.
        """
        error = lagging(series, self.bandwidth)
        torque = conditions.torque_constant * abs(place.ratio) * float(np.ptp(series.current - error))
        away = 4.0 * torque / self.bandwidth / (math.e * 0.5 * conditions.loop_damping)
        # Of a winding that hot the gains, which are those of the cold one, no longer cancel the pole.
        hot = HOT < conditions.rise < math.inf
        valid = self.bandwidth * conditions.move_time > 50.0 and not hot
        return bounded(conditions, error, "lag of the loop behind the task's current", deviation=away, valid=valid)
