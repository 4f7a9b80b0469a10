"""The torques as a matrix (regressor) times the parameters of the bodies, for identification.

Every body, link or rotor, has ten parameters in its own frame, in this order, the same as pinocchio's:

    mass [kg], first moments x, y, z [kg m], inertia about the frame's origin xx, xy, yy, xz, yz, zz [kg m^2].

The frame of a link has its origin at its joint's point (``arm.joint_points``) and, with all joints at zero, the axes of
the base. That of a rotor has its origin on its spin axis, at the foot of the perpendicular from its centre of mass, and
z along that axis.
Force and moment of a body are linear in them: ``f = m a + dw x h + w x (w x h)``, ``n = h x a + I dw + w x I w``.

Reference: C. Atkeson, C. An, J. Hollerbach, Estimation of inertial parameters of manipulator loads and links,
    International Journal of Robotics Research 5 (1986) 101-119.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.kinematics import displacements, screw_columns, screw_displacements
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arrays import Array, finite_samples
from drivetrain.dynamics.core.packed import carried_moments, inverse_poses, spin_frame
from drivetrain.dynamics.mass import CHUNK

BODY_PARAMETERS = ("mass", "hx", "hy", "hz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
BODY_UNITS = ("kg", *["kg m"] * 3, *["kg m^2"] * 6)
FRICTION_UNITS = (("viscous", "N m s/rad"), ("coulomb", "N m"))  # at a revolute joint
ROW, COLUMN = np.array([[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]])  # of the entries xx, xy, yy, xz, yz, zz


def torque_regressor(arm: Arm, q: Any, qd: Any, qdd: Any, *, friction: bool = False) -> Array:
    """The matrix Y in ``torque = Y(q, qd, qdd) p`` with the parameters p of links and rotors (``torque_parameters``).

    Args:
        arm: With rotors or without, at any level, coupled or not; of its bodies only the frames are used.
        q, qd, qdd: Positions, speeds and accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        friction: Whether to append columns of joint friction: viscous of all joints, qd, then Coulomb of all joints,
            the sign of qd (0 at rest).

    Returns:
        Y, (n, p) or (N, n, p), [N m or N, per unit of the parameter]: ten columns per link, then ten per rotor (none
        for joints without one), then friction; each ten in the order mass, first moments, inertia xx, xy, yy, xz, yz,
        zz, in the frames described at ``torque_parameters``.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.
    """
    motion = finite_samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    rotors = [i for i, rotor in enumerate(arm.rotors) if rotor is not None]
    bodies = 10 * (arm.n + len(rotors))
    result = np.zeros((len(motion[0]), arm.n, bodies + 2 * arm.n * friction))
    for first in range(0, len(result), CHUNK):
        some = slice(first, first + CHUNK)
        _fill(arm, rotors, [values[some] for values in motion], result[some])
    if friction:
        joint = np.arange(arm.n)
        result[:, joint, bodies + joint] = motion[1]
        result[:, joint, bodies + arm.n + joint] = np.sign(motion[1])
    return result if np.ndim(q) == 2 else result[0]


def torque_parameters(arm: Arm) -> Array:
    """The parameters of an arm's bodies, in the order of the columns of ``torque_regressor`` without friction.

    Args:
        arm: With rotors or without.

    Returns:
        Ten per link, then ten per rotor: mass [kg], first moments [kg m], inertia about the origin [kg m^2] xx, xy, yy,
        xz, yz, zz. Frame of a link: its origin is the joint's point (``arm.joint_points``), and with all joints at zero
        its axes are the base's. Frame of a rotor: its origin is the point of the spin axis nearest to the centre of
        mass, z is along the axis, x and y are the base's rotated by the smallest angle that takes z to the axis.
    """
    refuse_loops(arm)
    frames, home, masses, inertias = link_parameter_frames(arm), arm.home, arm.masses, arm.inertias
    rotors = [rotor for rotor in arm.rotors if rotor is not None]
    if rotors:
        frames = np.concatenate([frames, [spin_frame(rotor) for rotor in rotors]])
        home = np.concatenate([home, [rotor.home for rotor in rotors]])
        masses = np.concatenate([masses, [rotor.mass for rotor in rotors]])
        inertias = np.concatenate([inertias, [rotor.inertia for rotor in rotors]])
    return ten_parameters(carried_moments(inverse_poses(frames) @ home, masses, inertias))


def ten_parameters(pseudo: Array) -> Array:
    """Ten parameters of each body from the pseudo-inertias, (b, 4, 4) to (10 b,)."""
    second = pseudo[:, :3, :3]
    tensor = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return np.concatenate([pseudo[:, 3:, 3], pseudo[:, :3, 3], tensor[:, ROW, COLUMN]], axis=1).ravel()


def parameter_names(arm: Arm, *, friction: bool = False) -> list[str]:
    """Names of the parameters of ``torque_regressor``'s columns.

    Args:
        arm: With rotors or without.
        friction: As in ``torque_regressor``.

    Returns:
        Names such as ``forearm.hx [kg m]`` or ``rotor elbow.Izz [kg m^2]``, one per column.
    """
    rotors = [f"rotor {name}" for name, r in zip(arm.joint_names, arm.rotors, strict=True) if r is not None]
    units = tuple(zip(BODY_PARAMETERS, BODY_UNITS, strict=True))
    names = [f"{body}.{name} [{unit}]" for body in (*arm.link_names, *rotors) for name, unit in units]
    for law, force in FRICTION_UNITS if friction else ():
        for joint, screw in zip(arm.joint_names, arm.screws, strict=True):
            names.append(
                f"{joint}.{law} [{force if screw[:3].any() else force.replace('N m', 'N').replace('rad', 'm')}]"
            )
    return names


def link_parameter_frames(arm: Arm) -> Array:
    """The frames of the links' parameters with all joints at zero: origin at the joint, base axes, (n, 4, 4)."""
    frames = np.tile(np.eye(4), (arm.n, 1, 1))
    frames[:, :3, 3] = arm.joint_points
    return frames


def _fill(arm: Arm, rotors: list[int], motion: list[Array], result: Array) -> None:
    q, qd, qdd = motion
    moved = displacements(arm, q)
    screws = np.swapaxes(screw_columns(moved[:, :-1], arm.screws), 1, 2)  # (N, n, 6)
    velocity = np.zeros((len(q), arm.n + 1, 6))  # of the base and the links, at the base's origin
    velocity[:, 1:] = np.cumsum(screws * qd[..., None], axis=1)
    acceleration = np.zeros_like(velocity)
    change = _bracket(velocity[:, :-1], screws) * qd[..., None]
    acceleration[:, 1:] = np.cumsum(screws * qdd[..., None] + change, axis=1)
    acceleration[..., 3:] -= arm.gravity
    frames = moved[:, 1:] @ link_parameter_frames(arm)
    for i in range(arm.n):
        columns = _columns(frames[:, i], velocity[:, i + 1], acceleration[:, i + 1], screws[:, : i + 1])
        result[:, : i + 1, 10 * i : 10 * i + 10] = columns
    turns, full = rotor_turns(arm), arm.level is RotorLevel.FULL
    for place, i in enumerate(rotors):
        rotor, some = arm.rotors[i], slice(10 * (arm.n + place), 10 * (arm.n + place) + 10)
        assert rotor is not None
        on, spin = rotor.carrier + 1, spin_frame(rotor)
        v, a, before = velocity[:, on], acceleration[:, on], screws[:, :on]
        frame = moved[:, on] @ spin
        if full:
            own = screw_columns(moved[:, on : on + 1], rotor.screw[None])[..., 0]
            angle, rate, rise = (x @ turns[i] for x in (q, qd, qdd))
            frame = frame @ screw_displacements(np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), angle)
            a = a + own * rise[:, None] + _bracket(v, own) * rate[:, None]
            v = v + own * rate[:, None]
            columns = _columns(frame, v, a, np.concatenate([before, own[:, None]], axis=1))
            result[:, :, some] += turns[i][:, None] * columns[:, -1:]
            result[:, :on, some] += columns[:, :-1]
        else:
            result[:, :on, some] = _columns(frame, v, a, before)
        if arm.level is RotorLevel.REFLECTED:
            result[:, :, some.stop - 1] += np.outer(qdd @ turns[i], turns[i])


def _bracket(v: Array, s: Array) -> Array:
    """Rate of change of a screw that moves with a twist, both (..., 6): ``ad_v s``."""
    angular = np.cross(v[..., :3], s[..., :3])
    return np.concatenate([angular, np.cross(v[..., :3], s[..., 3:]) + np.cross(v[..., 3:], s[..., :3])], axis=-1)


def _columns(frame: Array, velocity: Array, acceleration: Array, screws: Array) -> Array:
    """Torques at the joints that carry a body per unit of its ten parameters in a frame (N, 4, 4), (N, j, 10)."""
    turn, origin = frame[:, :3, :3], frame[:, None, :3, 3]
    w, dw = (x[:, None, :3] @ turn for x in (velocity, acceleration))  # in the body's axes, (N, 1, 3)
    at_origin = velocity[:, None, 3:] + np.cross(velocity[:, None, :3], origin)
    push = acceleration[:, None, 3:] + np.cross(acceleration[:, None, :3], origin)
    a = (push + np.cross(velocity[:, None, :3], at_origin)) @ turn
    angular = screws[..., :3] @ turn
    linear = (screws[..., 3:] + np.cross(screws[..., :3], origin)) @ turn
    result = np.empty((*screws.shape[:2], 10))
    result[..., 0] = np.sum(linear * a, axis=-1)
    result[..., 1:4] = np.cross(linear, dw) + np.cross(np.cross(linear, w), w) + np.cross(a, angular)
    product = angular[..., :, None] * dw[..., None, :] + np.cross(angular, w)[..., :, None] * w[..., None, :]
    result[..., 4:] = product[..., ROW, COLUMN] + np.where(ROW == COLUMN, 0.0, product[..., COLUMN, ROW])
    return result
