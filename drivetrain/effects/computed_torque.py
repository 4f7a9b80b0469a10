"""Computed torque: the controller knows the arm, and asks for the torque that its own equations of motion tell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Signal
from drivetrain.effects.laws import command_of, scene_law
from drivetrain.errors import Fault, InputError


@dataclass
class Own:
    """What it keeps: gains [1/s^2], [1/s]; table rows: 1/(ratio kt) [A/(N m)], 1/ratio, coupled, a joint each."""

    stiffness: float
    damping: float


@scene_law(Own)
def _compute(t: Any, h: Any, own: Any, scene: Any) -> None:
    joints, mass, table = scene.joints, scene.mass, scene.table
    for i in range(len(joints)):
        torque = joints[i].bias_torque
        for k in range(len(joints)):
            coupled = int(table[k, 2])
            wanted = command_of(joints[k], coupled)
            flange = joints[k].shaft if coupled else joints[k].load
            pull = wanted.acceleration
            pull += own.stiffness * (wanted.position - flange.position)
            pull += own.damping * (wanted.speed - flange.speed)
            torque += mass[i, k] * pull
        pin, scale, turn = joints[i].pin, table[i, 0], table[i, 1]
        pin.command += torque * scale
        # Of the motor's own angle: the ratio is in the scale once more.
        pin.damping += mass[i, i] * own.damping * scale * turn
        pin.stiffness += mass[i, i] * own.stiffness * scale * turn


@dataclass(frozen=True)
class ComputedTorque(Effect):
    """Asks for ``M(q) (a + kd e' + kp e) + h(q, q')``, as current of each motor.

    Attributes:
        frequency: Of the error's decay, damped critically [rad/s]: kp is its square, kd twice it.
        torque_constants: By joint name [N m/A].
    """

    frequency: float
    torque_constants: tuple[tuple[str, float], ...]

    scope = "scene"
    compute = _compute

    def __post_init__(self) -> None:
        if not 0.0 < self.frequency < float("inf"):
            raise InputError(Fault("ComputedTorque.frequency", "must be positive [rad/s]", self.frequency))

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

    def own(self, place: Place) -> Own:
        return Own(self.frequency**2, 2.0 * self.frequency)

    def table(self, place: Place) -> Array:
        known = dict(self.torque_constants)
        missing = [joint for joint in place.joints if not known.get(joint, 0.0) > 0.0]
        if missing:
            raise InputError(Fault("ComputedTorque.torque_constants", f"must be positive for {', '.join(missing)}"))
        rows = zip(place.joints, place.ratios, strict=True)
        return np.array(
            [(1.0 / (ratio * known[joint]), 1.0 / ratio, k in place.shafts) for k, (joint, ratio) in enumerate(rows)],
            dtype=np.float64,
        )
