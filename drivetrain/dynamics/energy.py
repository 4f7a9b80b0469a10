"""Kinetic and potential energy, and the power balance of a motion.

Rotors are counted according to the arm's level, as everywhere: at NONE they are locked to their carriers, at REFLECTED
each adds the energy of its spin ``inertia (ratio qd)^2 / 2`` (or ``inertia (N qd)_i^2 / 2`` for coupled motors), at
FULL they are bodies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.kinematics import body_jacobian, displacements, screw_displacements
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arrays import Array, finite_samples
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.samples import run, tip_samples


@dataclass(frozen=True, eq=False)
class PowerBalance:
    """Power of the joints and its use: ``joints.sum() = kinetic + potential + tip``.

    Attributes:
        joints: Power of each joint's torque, ``qd_i tau_i`` [W], (n,) or (N, n); negative while it brakes.
        kinetic: Rate of the kinetic energy [W], () or (N,).
        potential: Rate of the potential energy [W], () or (N,).
        tip: Power that the end effector transfers to the environment [W], () or (N,).
    """

    joints: Array
    kinetic: Array
    potential: Array
    tip: Array


def kinetic_energy(arm: Arm, q: Any, qd: Any) -> Array:
    """The kinetic energy of all links and rotors.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        ``qd^T M(q) qd / 2`` [J], () or (N,).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.14.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    momentum = run(packed(arm), (positions, np.zeros(speeds.shape), speeds), gravity=np.zeros(3))
    energy = 0.5 * np.sum(speeds * momentum, axis=1)
    return energy if np.ndim(q) == 2 else energy[0]


def potential_energy(arm: Arm, q: Any) -> Array:
    """The potential energy of all links and rotors in the arm's gravity.

    It is zero if all centres of mass are in the plane through the origin of the base frame perpendicular to gravity.
    The base itself is not counted, but rotors that it carries are.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Energy [J], () or (N,).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, section 8.1.1, for any arm.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    moved = displacements(arm, positions)
    moment = np.einsum("i,nik->nk", arm.masses, (moved[:, 1:] @ arm.home)[..., :3, 3])
    spins = positions @ rotor_turns(arm).T if arm.level is RotorLevel.FULL else np.zeros(positions.shape)
    for rotor, spin in zip(arm.rotors, spins.T, strict=True):
        if rotor is not None:
            turned = screw_displacements(rotor.screw, spin) @ rotor.home
            moment += rotor.mass * (moved[:, rotor.carrier + 1] @ turned)[:, :3, 3]
    energy = -(moment @ arm.gravity)
    return energy if np.ndim(q) == 2 else energy[0]


def power_balance(arm: Arm, q: Any, qd: Any, qdd: Any, *, tip_wrench: Any = None) -> PowerBalance:
    """The power balance of a motion without losses.

    Args:
        arm: With rotors or without.
        q, qd, qdd: Positions, speeds and accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        The powers [W].

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.13 to 8.16: ``d(T + V)/dt = qd^T (tau - J^T F)``.
    """
    motion = finite_samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    model, (positions, speeds, _) = packed(arm), motion
    rest = np.zeros(positions.shape)
    tip = tip_samples(model, tip_wrench, len(positions))
    joints = speeds * run(model, motion, tip=tip)
    kinetic = np.sum(speeds * run(model, motion, gravity=np.zeros(3)), axis=1)
    potential = np.sum(speeds * run(model, (positions, rest, rest)), axis=1)
    given = np.zeros(len(positions))
    if tip_wrench is not None:
        twist = (body_jacobian(arm, positions) @ speeds[:, :, None])[..., 0]
        given = np.sum(twist * np.asarray(tip_wrench, dtype=np.float64), axis=1)
    parts = (joints, kinetic, potential, given)
    return PowerBalance(*parts) if np.ndim(q) == 2 else PowerBalance(*(part[0] for part in parts))
