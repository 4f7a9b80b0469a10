"""Current controllers, continuous and sampled, with limits of current and voltage."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.loops.current_loop_kernel import flows, held_at, held_step, loop_step, put_matrix, stretch
from drivetrain.drive.motor import Motor, Terminals, terminals, torque_constant, winding_resistance
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.fields import finite, positive, positive_or_infinite, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.effects.motor.motor_current import MotorCurrent, warm
from drivetrain.effects.motor.winding import inductance_faults
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class Own:
    """Record of the effect; the matrices belong to the state (current, integrator) of the loop without limits."""

    # as in ``Winding``
    motor: Terminals
    inductance: float
    # gains [V/A], [V/(A s)]
    proportional: float
    integral: float
    peak: float  # limit of the command [A]
    forward: float  # feed-forward voltage per speed [V s/rad]
    # resistance [ohm] and step [s] for which the matrices were computed
    resistance: float = 0.0
    step: float = 0.0
    # transition and input matrix over a whole step, with constant inputs
    whole: Annotated[Array, 4] = field(default_factory=lambda: np.zeros(4))
    held: Annotated[Array, 4] = field(default_factory=lambda: np.zeros(4))
    mean: Annotated[Array, 2] = field(default_factory=lambda: np.zeros(2))  # input row of the mean current
    # transition and input matrix over half a step
    half: Annotated[Array, 4] = field(default_factory=lambda: np.zeros(4))
    half_held: Annotated[Array, 4] = field(default_factory=lambda: np.zeros(4))
    demanded: float = 0.0  # command within its limits [A]
    # guessed motion of the motor at which ``compute`` was evaluated [rad/s], [rad]
    speed: float = 0.0
    position: float = 0.0
    free: float = 0.0  # 1 if neither the command nor, at the beginning of the step, the voltage was limited; else 0
    # states current [A] and integrator [V], with their rates
    current: float = 0.0
    current_rate: float = 0.0
    integrated_voltage: float = 0.0
    integrated_voltage_rate: float = 0.0


@law
def _update_matrices(own: Any, resistance: float, h: float) -> None:
    """Compute the matrices of the loop without limits, which depend on the resistance [ohm] and the step h [s]."""
    matrix = (-(own.proportional + resistance) / own.inductance, 1.0 / own.inductance, -own.integral, 0.0)
    whole, held, mean = held_step(matrix, h)
    put_matrix(own.whole, whole)
    put_matrix(own.held, held)
    own.mean[0], own.mean[1] = mean[0], mean[1]
    whole, held, mean = held_step(matrix, 0.5 * h)
    put_matrix(own.half, whole)
    put_matrix(own.half_held, held)
    own.resistance, own.step = resistance, h


@law
def _propagated(share: Any, held: Any, own: Any, push: float, drive: float) -> tuple[float, float]:
    """Current [A] and integrator [V] at the end of a step or half of it, without limits.

    ``share`` and ``held`` are transition and input matrix; ``push`` and ``drive`` are the inputs times the step.
    """
    i, z = own.current, own.integrated_voltage
    return (
        share[0] * i + share[1] * z + held[0] * push + held[1] * drive,
        share[2] * i + share[3] * z + held[2] * push + held[3] * drive,
    )


@law
def _advanced(
    h: float, own: Any, volts: float, demanded: float, resistance: float, constant: float, speed: float
) -> tuple[float, float, float, float, float, bool]:
    """Advance winding and controller over a step of length h [s] with constant command and speed, exactly.

    Returns current [A] and integrator [V] at the end, means over the step of current [A], squared current [A^2] and
    electrical power [W], and whether the voltage was limited at any time.
    """
    if own.resistance != resistance or own.step != h:
        _update_matrices(own, resistance, h)
    current, integral, kp, ki, inductance = (
        own.current, own.integrated_voltage, own.proportional, own.integral, own.inductance
    )  # fmt: skip
    forward, emf = own.forward * speed, constant * speed
    loop = (resistance, inductance, kp, ki, demanded, emf, forward)
    push, drive = h * (kp * demanded + forward - emf) / inductance, h * ki * demanded
    end, drawn = _propagated(own.whole, own.held, own, push, drive)
    if volts < math.inf:
        middle = _propagated(own.half, own.half_held, own, 0.5 * push, 0.5 * drive)
        limited = held_at(current, integral, volts, kp, demanded, forward) != 0.0
        limited = limited or held_at(middle[0], middle[1], volts, kp, demanded, forward) != 0.0
        if limited or held_at(end, drawn, volts, kp, demanded, forward) != 0.0:
            end, drawn, mean, square, power = loop_step(current, integral, h, volts, loop)
            return end, drawn, mean, square, power, True
    mean = own.held[0] * current + own.held[1] * integral + own.mean[0] * push + own.mean[1] * drive
    square, power = flows(current, integral, end, drawn, mean, h, 0.0, loop)
    return end, drawn, mean, square, power, False


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    """At an instant, rates of current and integrator; in a step, mean torque with its derivatives, and mean voltage."""
    pin, motor, heat = joint.pin, joint.motor, joint.heat
    resistance, constant = warm(own.motor, heat)
    inductance, kp, ki, volts = own.inductance, own.proportional, own.integral, pin.limit
    own.demanded, free = pin.command, 1.0
    if abs(own.demanded) > own.peak:
        own.demanded, free = own.peak if own.demanded > 0.0 else -own.peak, 0.0
    current, integral = own.current, own.integrated_voltage
    forward = own.forward * motor.speed
    limit = held_at(current, integral, volts, kp, own.demanded, forward)
    if h == 0.0:
        wanted = kp * (own.demanded - current) + integral + forward
        pin.voltage = limit if limit != 0.0 else wanted
        own.current_rate = (pin.voltage - resistance * current - constant * motor.speed) / inductance
        own.integrated_voltage_rate = ki * (own.demanded - current) + (pin.voltage - wanted) * ki / kp
        motor.torque += constant * current
        return
    end, _, mean, _, _, _ = _advanced(h, own, volts, own.demanded, resistance, constant, motor.speed)
    # While the voltage stays limited, or stays free, the mean current is a linear function of command and back-emf.
    by_command = h * (own.mean[0] * kp / inductance + own.mean[1] * ki)
    by_speed = h * own.mean[0] * (own.forward - constant) / inductance
    if limit != 0.0:
        # At the voltage limit the current depends on the back-emf only.
        _, _, by_speed = stretch(0.0, 0.0, h, limit, (resistance, inductance, kp, ki, 0.0, limit + constant, 0.0))
        free = 0.0
    own.speed, own.position, own.free = motor.speed, motor.position, free
    pin.voltage = resistance * mean + constant * motor.speed + inductance * (end - current) / h
    motor.torque += constant * mean
    motor.damping += constant * (free * by_command * pin.damping - by_speed)
    motor.stiffness += constant * free * by_command * pin.stiffness


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Losses, power and magnetic energy; in a step, the final changes of current and integrator."""
    pin, heat, motor, current = joint.pin, joint.heat, joint.motor, own.current
    resistance, constant = warm(own.motor, heat)
    square, pin.power = current * current, pin.voltage * current
    if h > 0.0:
        # Evaluated again at the speed and position of the solution; ``compute`` knows only the guess.
        speed_change, position_change = motor.speed - own.speed, motor.position - own.position
        demanded = own.demanded - own.free * (pin.damping * speed_change + pin.stiffness * position_change)
        end, drawn, mean, square, pin.power, _ = _advanced(
            h, own, pin.limit, demanded, resistance, constant, motor.speed
        )
        own.current_rate, own.integrated_voltage_rate = (end - current) / h, (drawn - own.integrated_voltage) / h
        pin.voltage = resistance * mean + constant * motor.speed + own.inductance * own.current_rate
    heat.copper_loss = resistance * square
    pin.magnetic_energy = 0.5 * own.inductance * current * current


@dataclass(frozen=True)
class CurrentLoop(Effect):
    """PI controller of the current, whose zero cancels the winding's pole.

    In a fixed step, winding and controller are integrated exactly, also where the voltage reaches or leaves its limit;
    the integrator has anti-windup (see ``drive/loops/current_loop_kernel.py``).

    Attributes:
        motor: Resistance, inductance, torque constant, and how they change with temperature.
        bandwidth: Bandwidth of the closed loop [rad/s]: kp = L w, ki = R w, with the cold resistance R.
        peak_current: Limit of the command [A].
        fed_forward: Share of the cold motor's back-emf that is fed forward to the voltage [-].
    """

    motor: Motor
    bandwidth: float
    peak_current: float = math.inf
    fed_forward: float = 1.0

    limits = ranges(
        bandwidth=positive("rad/s"), peak_current=positive_or_infinite("A"), fed_forward=finite("-"),
    )  # fmt: skip
    compute = _compute
    account = _account

    def faults(self) -> list[Fault]:
        return inductance_faults(self)

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State(s.CURRENT.name, s.CURRENT.unit, 1e-6), State("integrated_voltage", "V", 1e-6)),
            needs=(
                s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS, s.MOTOR_SPEED,
                *s.temperatures(self.motor), s.VOLTAGE_LIMIT, s.MOTOR_POSITION,
            ),
            provides=(s.VOLTAGE,),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_DAMPING, s.MOTOR_STIFFNESS),
            outputs=(s.COPPER_LOSS, s.ELECTRICAL_POWER, s.MAGNETIC_ENERGY),
        )  # fmt: skip

    def own(self, place: Place) -> Own:
        inductance = self.motor.inductance or math.nan
        kp, ki = inductance * self.bandwidth, self.motor.resistance * self.bandwidth
        forward = self.fed_forward * self.motor.torque_constant
        return Own(terminals(self.motor), inductance, kp, ki, self.peak_current, forward)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        current = min(max(s.read(place, signals, s.CURRENT_COMMAND), -self.peak_current), self.peak_current)
        speed, rest = s.read(place, signals, s.MOTOR_SPEED), self.motor.reference_temperature
        resistance = winding_resistance(self.motor, s.read(place, signals, s.WINDING_TEMPERATURE, rest))
        constant = torque_constant(self.motor, s.read(place, signals, s.HOUSING_TEMPERATURE, rest))
        volts = s.read(place, signals, s.VOLTAGE_LIMIT) or math.inf  # 0: not yet computed
        current = min(max(current, (-volts - constant * speed) / resistance), (volts - constant * speed) / resistance)
        return current, resistance * current + (constant - self.fed_forward * self.motor.torque_constant) * speed

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        winding = (self.motor.inductance or math.nan) / self.motor.resistance
        return TimeScale("current loop", 1.0 / self.bandwidth), TimeScale("winding", winding)

    def quasi_static(self) -> Effect:
        return MotorCurrent(self.motor, self.peak_current)


@dataclass
class SampledOwn:
    proportional: float  # gain [V/A]
    integral: float  # integral gain per sample [V/A]
    peak: float  # limit of the command [A]
    slope: float  # largest change of the command per sample [A]
    forward: float  # feed-forward voltage per speed [V s/rad]
    sampled_voltage: float = 0.0  # output [V]
    integrated_voltage: float = 0.0  # integrator [V]
    followed_command: float = 0.0  # command after the slew rate limit [A]


@joint_law(SampledOwn)
def _output(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Provide the voltage of the last sample."""
    # The supply voltage may have dropped since the sample.
    joint.pin.voltage = min(max(own.sampled_voltage, -joint.pin.limit), joint.pin.limit)


@joint_law(SampledOwn)
def _sample(t: Any, h: Any, own: Any, joint: Any) -> None:
    """One sample of the controller: limits of current and slew rate, PI controller, voltage limit with anti-windup."""
    pin = joint.pin
    demanded = min(max(pin.command, -own.peak), own.peak)
    # Slew rate limit of the amplifier.
    own.followed_command += min(max(demanded - own.followed_command, -own.slope), own.slope)
    error = own.followed_command - pin.current
    grown = own.integrated_voltage + own.integral * error
    wanted = own.proportional * error + grown + own.forward * joint.motor.speed
    own.sampled_voltage = min(max(wanted, -pin.limit), pin.limit)
    # Anti-windup: the integrator is reduced by the voltage that the limit cuts off.
    own.integrated_voltage = grown + (own.sampled_voltage - wanted) * own.integral / own.proportional


@dataclass(frozen=True)
class SampledCurrentLoop(Effect):
    """Sampled controller of a ``Winding``'s current, within limits of current, slew rate and voltage.

    Attributes:
        motor: Cold resistance, inductance and torque constant, as in the controller's model.
        bandwidth: Bandwidth of a continuous loop with these gains [rad/s]: kp = L w, ki = R w.
        every: Sampling period [s].
        peak_current: Limit of the command [A].
        slew: Slew rate limit of the command [A/s]; infinite: no limit.
        fed_forward: Share of the back-emf that is fed forward to the voltage [-].
    """

    motor: Motor
    bandwidth: float
    every: float = 1e-4
    peak_current: float = math.inf
    slew: float = math.inf
    fed_forward: float = 1.0

    limits = ranges(
        bandwidth=positive("rad/s"), every=positive("s"), peak_current=positive_or_infinite("A"),
        slew=positive_or_infinite("A/s"), fed_forward=finite("-"),
    )  # fmt: skip
    compute = _output
    sample = _sample

    def faults(self) -> list[Fault]:
        faults = inductance_faults(self)
        if not faults and not self.bandwidth * self.every < 2.0:
            problem = "times the period must stay below 2: a faster loop diverges from sample to sample"
            faults.append(Fault("SampledCurrentLoop.bandwidth", problem, self.bandwidth * self.every))
        return faults

    @property
    def period(self) -> float:
        return self.every

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(
                State("sampled_voltage", "V", memory=True),
                State("integrated_voltage", "V", memory=True),
                State("followed_command", "A", memory=True),
            ),
            needs=(s.CURRENT_COMMAND, s.CURRENT, s.MOTOR_SPEED, s.VOLTAGE_LIMIT),
            provides=(s.VOLTAGE,),
        )

    def own(self, place: Place) -> SampledOwn:
        kp = (self.motor.inductance or math.nan) * self.bandwidth
        ki = self.motor.resistance * self.bandwidth * self.every
        return SampledOwn(
            kp, ki, self.peak_current, self.slew * self.every, self.fed_forward * self.motor.torque_constant
        )

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        current, speed = s.read(place, signals, s.CURRENT), s.read(place, signals, s.MOTOR_SPEED)
        winding = s.read(place, signals, s.WINDING_TEMPERATURE) or self.motor.reference_temperature
        drop, emf = float(winding_resistance(self.motor, winding)) * current, self.motor.torque_constant * speed
        return drop + emf, drop + (1.0 - self.fed_forward) * emf, current

    def quasi_static(self) -> Effect:
        return CurrentLoop(self.motor, self.bandwidth, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("current sample", self.every),)
