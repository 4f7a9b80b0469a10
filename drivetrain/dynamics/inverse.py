"""Inverse dynamics with drives: the torques for a motion, by the Newton-Euler recursion.

Rotors may be carried by any link and spin about any axis. The recursion is compiled, see ``core/recursion.py``: the
first call in a process takes some tenths of a second, the first on a machine some seconds. Torques due to one cause
(speeds, gravity, tip wrench) are computed without the other causes.

Reference: Modern Robotics (Lynch and Park), equations 8.103 to 8.111.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import shaft_torques
from drivetrain.arrays import Array, finite_samples, samples
from drivetrain.dynamics.closed import closed_loads
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.core.recursion import torque_alone
from drivetrain.dynamics.samples import TORQUE_ONLY, Outputs, is_one_sample, run, tip_samples


@dataclass(frozen=True, eq=False)
class DriveTorques:
    """Required torque of each drive without losses; one sample has no leading axis.

    Attributes:
        gear: Torque at the output of the gear, which is the joint or, for coupled motors, the shaft that the gear
            drives [N m; N at a prismatic joint], (N, n); equation 8.110.
        motor: Torque at the motor's shaft [N m; as gear if there is no rotor], (N, n); equation 8.111.
    """

    gear: Array
    motor: Array

    def __repr__(self) -> str:
        return f"DriveTorques(gear, motor: {' x '.join(map(str, self.gear.shape))} each)"


@dataclass(frozen=True, eq=False)
class JointLoads:
    """All loads of the joints in a motion; one sample has no leading axis.

    Attributes:
        torque: Generalised torque, rotors included [N m; N at a prismatic joint], (N, n).
        gear: At the output of the gear (joint or shaft, as in ``DriveTorques``), without losses [N m; N at a prismatic
            joint], (N, n).
        motor: At the motor's shaft, without losses [N m; as gear if there is no rotor], (N, n).
        wrench: Wrench that each joint exerts on the link after it, (moment [N m], force [N]), (N, n, 6), in the joint's
            frame: origin at the joint's point on its axis (``joint_points``), z along the axis; with all joints at zero
            the axes are those of the base, rotated by the smallest angle that takes z to the axis. The frame moves
            with the link after the joint.
        carrier_acceleration: Angular acceleration of the link before the joint, along the joint's axis [rad/s^2],
            (N, n).
    """

    torque: Array
    gear: Array
    motor: Array
    wrench: Array
    carrier_acceleration: Array


def inverse_dynamics(arm: Arm, q: Any, qd: Any, qdd: Any, *, tip_wrench: Any = None) -> Array:
    """The generalised joint torques of a motion, rotors included.

    Args:
        arm: With rotors or without.
        q, qd, qdd: Positions, speeds and accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Torque [N m; N at a prismatic joint], (n,) or (N, n): entry i is ``ratio_i`` times the torque of motor i, or
        for coupled motors (``arm/coupling.py``) entry i of ``N^T`` times the motor torques.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.103 to 8.111.
    """
    if arm.linkage is not None:
        return joint_loads(arm, q, qd, qdd, tip_wrench=tip_wrench).torque
    model = packed(arm)
    if model.spread is None and is_one_sample(arm.n, q, qd, qdd):
        torque = np.empty(arm.n)
        if torque_alone(model.arm, q, qd, qdd, tip_samples(model, tip_wrench, 1), torque) == 0.0:
            return torque
    motion = samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    torque = run(model, motion, tip=tip_samples(model, tip_wrench, len(motion[0])))
    return torque if np.ndim(q) == 2 else torque[0]


def drive_torques(arm: Arm, q: Any, qd: Any, qdd: Any, *, tip_wrench: Any = None) -> DriveTorques:
    """Torques of each drive for a motion, at the output of the gear and at the motor, without losses.

    Args:
        arm: With rotors or without; a joint without one is a direct drive, of ratio 1.
        q, qd, qdd: Positions, speeds and accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Torques of gears and motors [N m; N at a prismatic joint], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.110 and 8.111.
    """
    if arm.linkage is not None:
        loads = joint_loads(arm, q, qd, qdd, tip_wrench=tip_wrench)
        return DriveTorques(loads.gear, loads.motor)
    model = packed(arm)
    motion = samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    gear = np.empty(motion[0].shape)
    tip = tip_samples(model, tip_wrench, len(gear))
    torque = run(model, motion, tip=tip, outputs=TORQUE_ONLY._replace(gear=gear))
    gear, motor = shaft_torques(arm, gear), shaft_torques(arm, torque)
    motor /= model.ratios
    return DriveTorques(gear, motor) if np.ndim(q) == 2 else DriveTorques(gear[0], motor[0])


def joint_loads(arm: Arm, q: Any, qd: Any, qdd: Any, *, tip_wrench: Any = None) -> JointLoads:
    """All loads of the joints in a motion: torques, and the six-component wrench that loads the bearings.

    Args:
        arm: With rotors or without.
        q, qd, qdd: Positions, speeds and accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        The loads [N m, N, rad/s^2].

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.109 to 8.111.
    """
    if arm.linkage is not None:
        ratios = [1.0 if rotor is None else rotor.ratio for rotor in arm.rotors]
        closed = finite_samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
        torque, gear, wrench, axial = closed_loads(arm, closed, tip_wrench, joint_loads)
        loads = (torque, shaft_torques(arm, gear), shaft_torques(arm, torque) / ratios, wrench, axial)
        return JointLoads(*loads) if np.ndim(q) == 2 else JointLoads(*(load[0] for load in loads))
    model = packed(arm)
    motion = samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    shape = motion[0].shape
    outputs = Outputs(np.empty(shape), np.empty(shape), np.empty((*shape, 6)))
    torque = run(model, motion, tip=tip_samples(model, tip_wrench, len(motion[0])), outputs=outputs)
    gear, motor = shaft_torques(arm, outputs.gear), shaft_torques(arm, torque) / model.ratios
    loads = (torque, gear, motor, outputs.wrench, outputs.axial)
    return JointLoads(*loads) if np.ndim(q) == 2 else JointLoads(*(load[0] for load in loads))


def gravity_torque(arm: Arm, q: Any) -> Array:
    """The generalised torques that hold the arm at rest without a wrench at its tip.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Torque [N m; N at a prismatic joint], (n,) or (N, n).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.80.
    """
    return _torque(arm, {"q": q})


WEIGHTLESS = np.zeros(3)


def _torque(arm: Arm, given: dict[str, Any], *, gravity: Array | None = None, tip_wrench: Any = None) -> Array:
    """The torques of a motion whose speeds and accelerations are zero unless given."""
    motion = finite_samples(arm.n, given)
    rest = np.zeros(motion[0].shape)
    if arm.linkage is not None:
        arm = arm if gravity is None else replace(arm, gravity=gravity)
        torque = joint_loads(arm, *(*motion, rest, rest)[:3], tip_wrench=tip_wrench).torque
        return torque if np.ndim(given["q"]) == 2 else torque[0]
    model = packed(arm)
    tip = tip_samples(model, tip_wrench, len(rest))
    torque = run(model, (*motion, rest, rest)[:3], gravity=gravity, tip=tip)
    return torque if np.ndim(given["q"]) == 2 else torque[0]


def bias_torque(arm: Arm, q: Any, qd: Any, *, tip_wrench: Any = None) -> Array:
    """The torques h that keep the joints at constant speed: all terms of the equation of motion except ``M qdd``.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        h = c + g (+ J^T F) [N m; N at a prismatic joint], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.11.
    """
    return _torque(arm, {"q": q, "qd": qd}, tip_wrench=tip_wrench)


def velocity_torque(arm: Arm, q: Any, qd: Any) -> Array:
    """The Coriolis and centripetal torques c.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        c [N m; N at a prismatic joint], (n,) or (N, n); quadratic in qd.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.79.
    """
    return _torque(arm, {"q": q, "qd": qd}, gravity=WEIGHTLESS)


def tip_torque(arm: Arm, q: Any, tip_wrench: Any) -> Array:
    """The torques due to a wrench on the environment alone: ``J^T F``.

    Args:
        arm: With rotors or without; rotors at rest do not contribute.
        q: Positions [rad or m], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6).

    Returns:
        Torque [N m; N at a prismatic joint], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.77, last term.
    """
    return _torque(arm, {"q": q}, gravity=WEIGHTLESS, tip_wrench=tip_wrench)
