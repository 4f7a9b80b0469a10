"""The current controller of a digital amplifier: at samples, its voltage held between them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.motor import Motor
from drivetrain.effects import signals as s
from drivetrain.effects.current_loop import CurrentLoop
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, State, TimeScale
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        volts, limit = x[words[row + 1]], signals[words[row + 7]]
        # The supply may have sunk since the sample.
        signals[words[row + 8]] = min(max(volts, -limit), limit)


@Compiled
def _sample(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        kp, ki, peak, slope = numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3]
        asked = min(max(signals[words[row + 4]], -peak), peak)
        # The amplifier lets the command rise no faster than this.
        reference = x[words[row + 3]]
        reference += min(max(asked - reference, -slope), slope)
        x[words[row + 3]] = reference
        error, limit = reference - signals[words[row + 5]], signals[words[row + 7]]
        grown = x[words[row + 2]] + ki * error
        wanted = kp * error + grown + numbers[at + 4] * signals[words[row + 6]]
        volts = min(max(wanted, -limit), limit)
        # Drawn back by what is asked in vain, so that the integrator does not wind up.
        x[words[row + 2]] = grown + (volts - wanted) * ki / kp
        x[words[row + 1]] = volts


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
            faults.append(Fault("SampledCurrentLoop.motor", "has no inductance on its sheet [H]", self.motor.key))
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

    def numbers(self, place: Place) -> Sequence[float]:
        kp = (self.motor.inductance or math.nan) * self.bandwidth
        ki = self.motor.resistance * self.bandwidth * self.every
        return kp, ki, self.peak_current, self.slew * self.every, self.fed_forward * self.motor.torque_constant

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        current = signals.get(f"{place.name}.{s.CURRENT.name}", 0.0)
        speed = signals.get(f"{place.name}.{s.MOTOR_SPEED.name}", 0.0)
        drop, emf = self.motor.resistance * current, self.motor.torque_constant * speed
        return drop + emf, drop + (1.0 - self.fed_forward) * emf, current

    def quasi_static(self) -> Effect:
        return CurrentLoop(self.motor, self.bandwidth, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("current sample", self.every),)
