"""The current controller of a digital amplifier: at samples, its voltage held between them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.motor import Motor, winding_resistance
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.laws import joint_law
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.errors import Fault, InputError


@dataclass
class Own:
    """What it keeps: gains [V/A], [V/A] a sample, peak [A] and rise a sample [A], back-emf fed forward [V s/rad]."""

    proportional: float
    integral: float
    peak: float
    slope: float
    forward: float
    sampled_voltage: float = 0.0
    integrated_voltage: float = 0.0
    followed_command: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    # The supply may have sunk since the sample.
    joint.pin.voltage = min(max(own.sampled_voltage, -joint.pin.limit), joint.pin.limit)


@joint_law(Own)
def _sample(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin = joint.pin
    asked = min(max(pin.command, -own.peak), own.peak)
    # The amplifier lets the command rise no faster than this.
    own.followed_command += min(max(asked - own.followed_command, -own.slope), own.slope)
    error = own.followed_command - pin.current
    grown = own.integrated_voltage + own.integral * error
    wanted = own.proportional * error + grown + own.forward * joint.motor.speed
    own.sampled_voltage = min(max(wanted, -pin.limit), pin.limit)
    # Drawn back by what is asked in vain, so that the integrator does not wind up.
    own.integrated_voltage = grown + (own.sampled_voltage - wanted) * own.integral / own.proportional


@dataclass(frozen=True)
class SampledCurrentLoop(Effect):
    """Controls the current of a ``Winding`` at samples, within limits of current, rise and voltage.

    Attributes:
        motor: Resistance, inductance and torque constant, cold, as the controller knows them.
        bandwidth: That a continuous loop of these gains would have [rad/s]: kp = L w, ki = R w.
        every: Period [s].
        peak_current: To which commands are cut [A].
        slew: Fastest rise of the command [A/s]; infinite: none.
        fed_forward: Share of the back-emf that is added to the voltage [-].
    """

    motor: Motor
    bandwidth: float
    every: float = 1e-4
    peak_current: float = math.inf
    slew: float = math.inf
    fed_forward: float = 1.0

    compute = _compute
    sample = _sample

    def __post_init__(self) -> None:
        faults = []
        if not (self.motor.inductance or 0.0) > 0.0:
            faults.append(
                Fault("SampledCurrentLoop.motor", "has no inductance in its catalogue row [H]", self.motor.key)
            )
        for name, unit in (("bandwidth", "rad/s"), ("every", "s")):
            if not 0.0 < getattr(self, name) < math.inf:
                problem = f"must be positive [{unit}]"
                faults.append(Fault(f"SampledCurrentLoop.{name}", problem, getattr(self, name)))
        for name, unit in (("peak_current", "A"), ("slew", "A/s")):
            if not getattr(self, name) > 0.0:
                problem = f"must be positive [{unit}]"
                faults.append(Fault(f"SampledCurrentLoop.{name}", problem, getattr(self, name)))
        if not faults and not self.bandwidth * self.every < 2.0:
            problem = "times the period must stay below 2: a faster loop diverges from sample to sample"
            faults.append(Fault("SampledCurrentLoop.bandwidth", problem, self.bandwidth * self.every))
        if faults:
            raise InputError(faults)

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

    def own(self, place: Place) -> Own:
        kp = (self.motor.inductance or math.nan) * self.bandwidth
        ki = self.motor.resistance * self.bandwidth * self.every
        return Own(kp, ki, self.peak_current, self.slew * self.every, self.fed_forward * self.motor.torque_constant)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        current = signals.get(f"{place.name}.{s.CURRENT.name}", 0.0)
        speed = signals.get(f"{place.name}.{s.MOTOR_SPEED.name}", 0.0)
        winding = signals.get(f"{place.name}.{s.WINDING_TEMPERATURE.name}", 0.0)
        warm = winding_resistance(self.motor, winding or self.motor.reference_temperature)
        drop, emf = float(warm) * current, self.motor.torque_constant * speed
        return drop + emf, drop + (1.0 - self.fed_forward) * emf, current

    def quasi_static(self) -> Effect:
        return CurrentLoop(self.motor, self.bandwidth, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("current sample", self.every),)
