"""Two motors on one axis: a second one behind some joints, each with half of the load, plus or minus a preload.

Master and slave push against each other by the preload, so that the teeth of neither gear leave their flank while the
axis asks for less than twice that. To all that judges drives the second motor is a joint like any other, with the same
motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.closures import second_motor, with_second_motors
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.model import JointTask


def with_sharing(
    arm: Arm | None, cycle: Cycle, joints: Sequence[JointTask]
) -> tuple[Arm | None, Cycle, tuple[JointTask, ...]]:
    """Arm, cycle and joints with the second motors behind the first; as they are where every motor has its axis."""
    pairs = [i for i, task in enumerate(joints) if task.preload is not None]
    if not pairs:
        return arm, cycle, tuple(joints)
    names = [task.name for task in joints]
    taken = {second_motor(names[i]) for i in pairs} & {*names}
    if taken:
        raise InputError([Fault("joints", "has the name that the second motor of an axis gets", one) for one in taken])
    found = [one for task in joints for one in ([task] if task.preload is None else _both(task, task.preload))]
    rows = np.repeat(np.arange(len(joints)), [1 if task.preload is None else 2 for task in joints])
    shares = np.array([1.0 if task.preload is None else 0.5 for task in found])
    series = {name: getattr(cycle, name)[:, rows] for name in ("position", "velocity", "acceleration")}
    torque = None if cycle.torque is None else cycle.torque[:, rows] * shares
    cycle = replace(cycle, joint_names=tuple(task.name for task in found), torque=torque, **series)
    return None if arm is None else with_second_motors(arm, pairs), cycle, tuple(found)


def _both(task: JointTask, preload: float) -> tuple[JointTask, JointTask]:
    """The two motors of an axis."""
    sharing, inertia = (task.name, second_motor(task.name)), task.load_inertia
    half = replace(
        task, friction=_half(task.friction), load_inertia=None if inertia is None else 0.5 * inertia, sharing=sharing
    )
    own = tuple(
        replace(
            one, stiffness=0.5 * one.stiffness, gas_force=0.5 * one.gas_force, torque=0.5 * one.torque, mass=0.0,
            torques=tuple(0.5 * torque for torque in one.torques),
        )
        for one in task.counterbalances if one.stiffness or one.gas_force or one.torque or one.torques
    )  # fmt: skip
    first, second = (
        replace(half, name=name, preload=sign * preload, counterbalances=own + _pushing(-sign * preload, task))
        for name, sign in zip(sharing, (1.0, -1.0), strict=True)
    )
    return first, replace(second, contained=None)  # what the links hold is taken out once


def _pushing(torque: float, task: JointTask) -> tuple[Counterbalance, ...]:
    """A torque on the joint's link that always is there, in the joint's own coordinate."""
    return (Counterbalance(torque=torque / (task.travel_per_turn or 1.0)),) if torque else ()


def _half(friction: Friction) -> Friction:
    """Half of a joint's friction."""
    names = ("coulomb", "coulomb_negative", "viscous", "viscous_negative", "static")
    known = {name: value for name in names if (value := getattr(friction, name)) is not None}
    return replace(friction, **{name: 0.5 * value for name, value in known.items()})
