"""Computed torque: the controller has a model of the arm and commands the torque of its equations of motion.

Continuous, and as a digital controller runs it: at samples, on measured angles, with a delay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.control.cascade import DELAY, MOST_DELAY, missing_current
from drivetrain.effects.effect import Effect, Place, Ports, Signal, State, TimeScale
from drivetrain.effects.fields import positive, ranges
from drivetrain.effects.laws import command_of, scene_law
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

MOST_JOINTS = 16  # of the arm of a sampled controller, which keeps what it measured


@dataclass
class Own:
    """What it keeps: gains [1/s^2], [1/s]; table rows: 1/(ratio kt) [A/(N m)], 1/ratio, coupled, a joint each."""

    stiffness: float
    damping: float


@law
def _pull(own: Any, wanted: Any, position: float, speed: float) -> float:
    """The commanded acceleration of a joint: the commanded one, and what its error asks for."""
    return wanted.acceleration + own.stiffness * (wanted.position - position) + own.damping * (wanted.speed - speed)


@scene_law(Own)
def _compute(t: Any, h: Any, own: Any, scene: Any) -> None:
    joints, mass, table = scene.joints, scene.mass, scene.table
    for i in range(len(joints)):
        torque = joints[i].bias_torque
        for k in range(len(joints)):
            coupled = int(table[k, 2])
            flange = joints[k].shaft if coupled else joints[k].load
            torque += mass[i, k] * _pull(own, command_of(joints[k], coupled), flange.position, flange.speed)
        pin, scale, turn = joints[i].pin, table[i, 0], table[i, 1]
        pin.command += torque * scale
        # Of the motor's own angle: the ratio is in the scale once more.
        pin.damping += mass[i, i] * own.damping * scale * turn
        pin.stiffness += mass[i, i] * own.stiffness * scale * turn


@dataclass(frozen=True)
class ComputedTorque(Effect):
    """Commands the torque ``M(q) (a + kd e' + kp e) + h(q, q')`` as current of each motor.

    Attributes:
        frequency: Of the error's decay, damped critically [rad/s]: kp is its square, kd twice it.
        torque_constants: By joint name [N m/A].
    """

    frequency: float
    torque_constants: tuple[tuple[str, float], ...]

    scope = "scene"
    limits = ranges(frequency=positive("rad/s"))
    compute = _compute

    def ports(self, place: Place) -> Ports:
        added = (s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS)
        at = [replace(place, joint=index) for index in range(len(place.joints))]
        read = [(*s.commanded(one), *s.motion(one), s.BIAS_TORQUE) for one in at]
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
    """As ``Own``, with period [s], delay, a joint each: angle at the last sample [rad], currents given out [A].

    And the currents that wait for their turn [A], a sample's joints one after another.
    """

    stiffness: float
    damping: float
    period: float
    delay: int
    last_measured_position: Annotated[Array, MOST_JOINTS]
    sampled_current: Annotated[Array, MOST_JOINTS] = field(default_factory=lambda: np.zeros(MOST_JOINTS))
    waiting_current: Annotated[Array, MOST_DELAY * MOST_JOINTS] = field(
        default_factory=lambda: np.zeros(MOST_DELAY * MOST_JOINTS)
    )


@scene_law(SampledOwn)
def _give_out(t: Any, h: Any, own: Any, scene: Any) -> None:
    for i in range(len(scene.joints)):
        scene.joints[i].pin.command += own.sampled_current[i]


@scene_law(SampledOwn)
def _sample(t: Any, h: Any, own: Any, scene: Any) -> None:
    joints, mass, table, waiting = scene.joints, scene.mass, scene.table, own.waiting_current
    for i in range(len(joints)):
        torque = joints[i].bias_torque
        for k in range(len(joints)):
            turn, measured = table[k, 1], joints[k].measured_position
            speed = (measured - own.last_measured_position[k]) / own.period
            torque += mass[i, k] * _pull(own, command_of(joints[k], int(table[k, 2])), measured * turn, speed * turn)
        # What is computed now is given out some samples later.
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
        every: Period [s].
        delay: Samples from measuring to giving out, 0 to 2.
    """

    every: float = 1e-3
    delay: int = 1

    limits = ranges(**ComputedTorque.limits, every=positive("s"), delay=DELAY)
    compute = _give_out
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
        at = [replace(place, joint=index, name=joint) for index, joint in enumerate(place.joints)]
        measured = [
            s.read(one, signals, s.MEASURED_POSITION) - self.every * s.read(one, signals, s.MOTOR_SPEED) for one in at
        ]
        demanded, none = [missing_current(one, signals) for one in at], [0.0] * len(at)
        return (*measured, *demanded * (1 + self.delay), *none * (MOST_DELAY - self.delay))

    def quasi_static(self) -> Effect | None:
        return ComputedTorque(self.frequency, self.torque_constants)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("servo sample", self.every),)
