"""What the task asks of one joint's gear over the cycle, whatever drive will be behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, resting
from drivetrain.drive.friction import Friction, friction_torque
from drivetrain.drive.gear import average_torque
from drivetrain.dynamics.newton_euler import inverse_dynamics, joint_loads
from drivetrain.motion.duty_cycle import Indices, sample_weights
from drivetrain.sizing.mounting import arm_with_drives, carrying
from drivetrain.study.study import Study


@dataclass(frozen=True, eq=False)
class JointDemand:
    """What one joint's drive must do, at the gear's output; all (N,).

    Attributes:
        time: [s].
        weights: Time each sample stands for in integrals over the cycle [s].
        position: Of the joint [rad or m].
        speed: Of the gear's output [rad/s].
        acceleration: Of the gear's output [rad/s^2].
        carrier_acceleration: Angular acceleration of the stator's link along the rotor's axis [rad/s^2].
        gear_torque: What the gear's output must give to the link, equation 8.110 of Modern Robotics [N m].
        friction: At the joint, outside the gear's mesh.
        payload: Index of what the tip carries, -1 for nothing.
        wrench: Six components (moment [N m], force [N]) that the joint passes on, joint frame, (N, 6); None without
            an arm or where the joint slides (its guide carries them).
        load_inertia: What the gear's output accelerates, own rotor excluded [kg m^2]; None without an arm.
    """

    time: Array
    weights: Array
    position: Array
    speed: Array
    acceleration: Array
    carrier_acceleration: Array
    gear_torque: Array
    friction: Friction
    payload: Indices
    wrench: Array | None
    load_inertia: Array | None

    @cached_property
    def load_torque(self) -> Array:
        """At the gear's output with the joint's friction [N m], (N,)."""
        return np.asarray(self.gear_torque + friction_torque(self.friction, self.speed))

    @cached_property
    def at_rest(self) -> Array:
        """Where the joint stands still, (N,)."""
        return resting(self.speed)

    @cached_property
    def moves(self) -> bool:
        """Whether the joint moves at all."""
        return bool(np.any(self.speed != 0.0))

    @cached_property
    def mean_speed(self) -> float:
        """Mean magnitude of the speed over the whole cycle, rests included [rad/s]."""
        return self.mean(np.abs(self.speed))

    @cached_property
    def _averages(self) -> dict[float, float]:
        return {}

    def average_torque(self, exponent: float) -> float:
        """The average of the load torque as wear sees it.

        Args:
            exponent: Of torque.

        Returns:
            [N m].
        """
        if exponent not in self._averages:
            self._averages[exponent] = average_torque(exponent, self.load_torque, self.speed, self.weights)
        return self._averages[exponent]

    def mean(self, values: Array) -> float:
        """The mean over the cycle.

        Args:
            values: At each sample, (N,), in any unit.

        Returns:
            In the unit of the values.
        """
        total = float(self.weights.sum())
        return float(values @ self.weights) / total if total > 0.0 else float(np.mean(values))


def joint_demand(study: Study, drives: Mapping[int, Drive], joint: int) -> JointDemand:
    """What the task asks of one joint, with the drives that load it in place.

    Args:
        study: The task.
        drives: Of any joints, by index; only those that load this joint are looked at (see ``loading``).
        joint: Index of the joint.

    Returns:
        The demand over the whole cycle, at the gear's output also where the joint slides.
    """
    cycle, task = study.cycle, study.joints[joint]
    weights = sample_weights(cycle.time)
    speed, acceleration = cycle.velocity[:, joint], cycle.acceleration[:, joint]
    if study.arm is None:
        given = np.zeros_like(speed) if cycle.torque is None else cycle.torque[:, joint]
        nothing = np.zeros_like(speed)
        return JointDemand(
            cycle.time, weights, cycle.position[:, joint], speed, acceleration, nothing, given, task.friction,
            cycle.payload, None, None,
        )  # fmt: skip
    load = _load(study, loading(study, drives, joint), joint)
    travel = task.travel_per_turn or 1.0
    carrier = load.carrier_acceleration
    if task.mount.carrier == "base":
        carrier = np.zeros_like(carrier)
    elif task.mount.carrier == "child" and not load.slides:
        carrier = carrier + acceleration
    return JointDemand(
        cycle.time, weights, cycle.position[:, joint], speed / travel, acceleration / travel, carrier,
        load.force * travel, task.friction, cycle.payload, None if load.slides else load.wrench,
        load.inertia * travel**2,
    )  # fmt: skip


def loading(study: Study, drives: Mapping[int, Drive], joint: int) -> dict[int, Drive]:
    """The drives that load a joint: those of the joints after it, and its own where it rides on the moved link.

    Args:
        study: Of which the mounts are taken.
        drives: By joint index.
        joint: Index of the joint.

    Returns:
        By joint index, from the tip to the base.
    """
    first = joint if study.joints[joint].mount.carrier == "child" else joint + 1
    return {index: drives[index] for index in sorted(drives, reverse=True) if index >= first}


@dataclass(frozen=True, eq=False)
class _Load:
    """What the arm asks at one joint, in the joint's own coordinate: force [N m or N], inertia [kg m^2 or kg]."""

    force: Array
    wrench: Array
    carrier_acceleration: Array
    inertia: Array
    slides: bool


def _load(study: Study, drives: Mapping[int, Drive], joint: int) -> _Load:
    """The arm's load on one joint, payload by payload."""
    cycle = study.cycle
    bare = arm_with_drives(study, drives)
    samples = len(cycle.time)
    found = _Load(
        np.empty(samples), np.empty((samples, 6)), np.empty(samples), np.empty(samples),
        slides=not bare.screws[joint, :3].any(),
    )  # fmt: skip
    for payload in np.unique(cycle.payload):
        chosen = cycle.payload == payload
        arm = carrying(study, bare, int(payload))
        loads = joint_loads(arm, cycle.position[chosen], cycle.velocity[chosen], cycle.acceleration[chosen])
        found.force[chosen] = loads.gear[:, joint]
        found.wrench[chosen] = loads.wrench[:, joint]
        found.carrier_acceleration[chosen] = loads.carrier_acceleration[:, joint]
        found.inertia[chosen] = _inertia(arm, cycle.position[chosen], joint)
    return found


def _inertia(arm: Arm, position: Array, joint: int) -> Array:
    """The joint's diagonal entry of the mass matrix without its own rotor: the torque of a unit acceleration."""
    others = tuple(None if index == joint else rotor for index, rotor in enumerate(arm.rotors))
    floating = replace(arm, gravity=np.zeros(3), rotors=others)
    unit = np.zeros_like(position)
    unit[:, joint] = 1.0
    return inverse_dynamics(floating, position, np.zeros_like(position), unit)[:, joint]
