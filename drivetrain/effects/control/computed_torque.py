"""Computed torque control: the controller evaluates the arm's equations of motion and commands the resulting torque.

Continuous, and sampled as in a digital controller: from measured angles, with a delay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.control.cascade import DELAY, MOST_DELAY, loop_holding_current
from drivetrain.effects.effect import Effect, Place, Ports, Signal, State, TimeScale
from drivetrain.effects.fields import positive, ranges
from drivetrain.effects.laws import command_of, scene_law
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

MOST_JOINTS = 16  # of a sampled controller, whose record has a fixed number of entries per joint


@dataclass
class Own:
    """Record of the effect; one table row per joint: 1/(ratio kt) [A/(N m)], 1/ratio, whether its motor is coupled."""

    stiffness: float  # kp [1/s^2]
    damping: float  # kd [1/s]


@law
def _required_acceleration(own: Any, command: Any, position: float, speed: float) -> float:
    """Acceleration that the controller requires of a joint: the commanded one plus the PD terms of the error."""
    return command.acceleration + own.stiffness * (command.position - position) + own.damping * (command.speed - speed)


@scene_law(Own)
def _compute(t: Any, h: Any, own: Any, scene: Any) -> None:
    """Contribute the current of every motor from the equations of motion, with its derivatives by the joint's error."""
    joints, mass, table = scene.joints, scene.mass, scene.table
    for i in range(len(joints)):
        torque = joints[i].bias_torque
        for k in range(len(joints)):
            coupled = int(table[k, 2])
            flange = joints[k].shaft if coupled else joints[k].load
            command = command_of(joints[k], coupled)
            torque += mass[i, k] * _required_acceleration(own, command, flange.position, flange.speed)
        pin, scale, turn = joints[i].pin, table[i, 0], table[i, 1]
        pin.command += torque * scale
        # Derivatives by the motor's angle, so they contain 1/ratio once more.
        pin.damping += mass[i, i] * own.damping * scale * turn
        pin.stiffness += mass[i, i] * own.stiffness * scale * turn


@dataclass(frozen=True)
class ComputedTorque(Effect):
    """Commands the torque ``M(q) (a + kd e' + kp e) + h(q, q')`` as current of each motor.

    Attributes:
        frequency: Natural frequency of the critically damped error dynamics [rad/s]: kp is its square, kd twice it.
        torque_constants: Torque constants that the controller assumes, by joint name [N m/A].
    """

    frequency: float
    torque_constants: tuple[tuple[str, float], ...]

    scope = "scene"
    limits = ranges(frequency=positive("rad/s"))
    compute = _compute

    def ports(self, place: Place) -> Ports:
        added = (s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS)
        places = [replace(place, joint=index) for index in range(len(place.joints))]
        read = [(*s.commanded(one), *s.motion(one), s.BIAS_TORQUE) for one in places]
        own = tuple(
            Signal(f"{joint}:{signal.name}", signal.unit)
            for joint, signals in zip(place.joints, read, strict=True)
            for signal in signals
        )
        out = tuple(Signal(f"{joint}:{signal.name}", signal.unit) for joint in place.joints for signal in added)
        return Ports(needs=(Signal("scene.mass_matrix", "kg m^2"), *own), contributes=out)

    def own(self, place: Place) -> Any:
        return Own(self.frequency**2, 2.0 * self.frequency)

    def table(self, place: Place) -> Array:
        known = dict(self.torque_constants)
        missing = [joint for joint in place.joints if not known.get(joint, 0.0) > 0.0]
        if missing:
            name = f"{type(self).__name__}.torque_constants"
            raise InputError(Fault(name, f"must be positive for {', '.join(missing)}"))
        rows = zip(place.joints, place.ratios, strict=True)
        return np.array(
            [(1.0 / (ratio * known[joint]), 1.0 / ratio, k in place.shafts) for k, (joint, ratio) in enumerate(rows)],
            dtype=np.float64,
        )


@dataclass
class SampledOwn:
    """Record of the effect; its table is that of ``Own``."""

    stiffness: float  # kp [1/s^2]
    damping: float  # kd [1/s]
    period: float  # sampling period [s]
    delay: int  # samples from measuring to output
    last_measured_position: Annotated[Array, MOST_JOINTS]  # motor angles at the last sample [rad]
    # outputs [A]
    sampled_current: Annotated[Array, MOST_JOINTS] = field(default_factory=lambda: np.zeros(MOST_JOINTS))
    # delayed outputs, sample by sample [A]
    waiting_current: Annotated[Array, MOST_DELAY * MOST_JOINTS] = field(
        default_factory=lambda: np.zeros(MOST_DELAY * MOST_JOINTS)
    )


@scene_law(SampledOwn)
def _output(t: Any, h: Any, own: Any, scene: Any) -> None:
    """Contribute the currents of the last sample."""
    for i in range(len(scene.joints)):
        scene.joints[i].pin.command += own.sampled_current[i]


@scene_law(SampledOwn)
def _sample(t: Any, h: Any, own: Any, scene: Any) -> None:
    """One sample of the controller: speeds from measured angles, torques from the equations of motion, delay."""
    joints, mass, table, waiting = scene.joints, scene.mass, scene.table, own.waiting_current
    for i in range(len(joints)):
        torque = joints[i].bias_torque
        for k in range(len(joints)):
            turn, measured = table[k, 1], joints[k].measured_position
            speed = (measured - own.last_measured_position[k]) / own.period
            command = command_of(joints[k], int(table[k, 2]))
            torque += mass[i, k] * _required_acceleration(own, command, measured * turn, speed * turn)
        # The computed current is output after the delay.
        waiting[own.delay * MOST_JOINTS + i] = torque * table[i, 0]
        own.sampled_current[i] = waiting[i]
        for k in range(own.delay):
            waiting[k * MOST_JOINTS + i] = waiting[(k + 1) * MOST_JOINTS + i]
    for i in range(len(joints)):
        own.last_measured_position[i] = joints[i].measured_position


@dataclass(frozen=True)
class SampledComputedTorque(ComputedTorque):
    """Sampled ``ComputedTorque``: angles from the motors' encoders, speeds as their differences over the period.

    Attributes:
        every: Sampling period [s].
        delay: Number of samples from measuring to output, 0 to 2.
    """

    every: float = 1e-3
    delay: int = 1

    limits = ranges(**ComputedTorque.limits, every=positive("s"), delay=DELAY)
    compute = _output
    sample = _sample

    @property
    def period(self) -> float:
        return self.every

    def ports(self, place: Place) -> Ports:
        if len(place.joints) > MOST_JOINTS:
            raise InputError(Fault("SampledComputedTorque", f"takes at most {MOST_JOINTS} joints", len(place.joints)))
        read = [
            Signal(f"{joint}:{signal.name}", signal.unit)
            for index, joint in enumerate(place.joints)
            for signal in (*s.commanded(replace(place, joint=index)), s.BIAS_TORQUE, s.MEASURED_POSITION)
        ]
        kept = [("last_measured_position", "rad", 0), ("sampled_current", "A", 0)]
        kept += [("waiting_current", "A", MOST_JOINTS * k) for k in range(MOST_DELAY)]
        states = tuple(
            State(f"{name}_{first + k}", unit, memory=True, path=f"{name}.{first + k}")
            for name, unit, first in kept
            for k in range(len(place.joints))
        )
        out = tuple(Signal(f"{joint}:{s.CURRENT_COMMAND.name}", s.CURRENT_COMMAND.unit) for joint in place.joints)
        return Ports(states=states, needs=(Signal("scene.mass_matrix", "kg m^2"), *read), contributes=out)

    def own(self, place: Place) -> Any:
        rest = np.zeros(MOST_JOINTS)
        return SampledOwn(self.frequency**2, 2.0 * self.frequency, self.every, self.delay, rest)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        places = [replace(place, joint=index, name=joint) for index, joint in enumerate(place.joints)]
        measured = [
            s.read(one, signals, s.MEASURED_POSITION) - self.every * s.read(one, signals, s.MOTOR_SPEED)
            for one in places
        ]
        demanded, none = [loop_holding_current(one, signals) for one in places], [0.0] * len(places)
        return (*measured, *demanded * (1 + self.delay), *none * (MOST_DELAY - self.delay))

    def quasi_static(self) -> Effect | None:
        return ComputedTorque(self.frequency, self.torque_constants)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("servo sample", self.every),)
