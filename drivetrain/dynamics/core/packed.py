"""An arm in the form that the kernels use: frames on the joint axes, bodies as ten numbers, rotors included in links.

A rotor that is balanced and axisymmetric acts on its carrier like a body fixed to it, except for the couple
``J ratio (qdd z + w x z qd)``, and needs the motor torque ``J (ratio qdd + z . dw)``, with w and dw of the carrier. So
its mass and inertia are added to the carrier's, and the rest costs a few operations. Any other rotor is a separate
body.

A rotor that follows several joints (``arm/coupling.py``) follows a substitute joint: a joint at the end of the chain
that moves no link and has no mass, whose position is the rotor's angle. ``samples.py`` computes its motion and
transforms its torque back to the joints, so the recursion is independent of couplings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.rotors import MountedRotor, RotorLevel
from drivetrain.arrays import Array
from drivetrain.dynamics.core.records import LINK, ROTOR
from drivetrain.spatial.rotations import frame_along

# Tolerance of angles, of lengths relative to the arm's and of inertias relative to the rotor's: above rounding, far
# below manufacturing tolerances.
BALANCED = 1e-12
ROTATION = "rxx rxy rxz ryx ryy ryz rzx rzy rzz"


@dataclass(frozen=True, eq=False)
class Packed:
    """An arm in the form that the kernels use."""

    # constants of the n links, including substitute joints, then of the m rotors with an own record, records LINK,
    # (n + m,)
    links: np.ndarray
    rotors: np.ndarray  # joint, carrier, and 1 if balanced, of those rotors, records ROTOR, (m,)
    gravity: Array  # in the frame of the base [m/s^2], (3,)
    tip: Array  # from row vectors of wrenches in the tip frame to the last link's frame, (6, 6)
    ratios: Array  # of the gears, 1 without a rotor [- or rad/m], one per joint of the arm
    # from motions of the arm's joints to those of all n, (n, joints of the arm) [- or rad/m]; None without substitute
    # joints
    spread: Array | None
    chained: bool  # whether every rotor follows one joint, and is carried by the base or a link adjacent to that joint

    @property
    def arm(self) -> tuple[np.ndarray, np.ndarray, Array]:
        """Links, rotors and gravity as one argument, which makes calls of kernels faster than three."""
        return self.links, self.rotors, self.gravity


@lru_cache(maxsize=64)
def packed(arm: Arm, free: tuple[int, ...] = ()) -> Packed:
    """The arm for the kernels, cached by the identity of the arm; ``free``: rotors with a coordinate of their own."""
    refuse_loops(arm)
    frames = link_frames(arm)
    ratios = [1.0 if rotor is None else rotor.ratio for rotor in arm.rotors]
    inverse = inverse_poses(frames)
    bodies = carried_moments(inverse[1:] @ arm.home, arm.masses, arm.inertias)
    apart = sorted({*followers(arm), *free})
    links = np.zeros(arm.n + len(apart), LINK)
    for name in ("cos_own", "rxx", "ryy", "rzz"):  # substitute joints: no rotation, no translation
        links[name] = 1.0
    _joints(links[: arm.n], arm, frames)
    _place(links[: arm.n], inverse[:-1] @ frames[1:])
    extra, rotors = _mount(arm, inverse, links, bodies, {i: ratios[i] if i in free else 1.0 for i in apart})
    write_bodies(links[: arm.n], bodies)
    return Packed(
        # Exactly the type LINK: for an equal but different type the dispatch of kernels is slower.
        np.concatenate([links, *extra]).view(LINK),
        np.array(rotors, ROTOR),
        frames[0, :3, :3].T @ arm.gravity,
        _wrench_map(inverse[-1] @ arm.tip),
        np.array(ratios),
        _spread(arm, apart) if apart and not free else None,
        not apart and all(carrier in (-1, joint - 1, joint) for joint, carrier, _ in rotors),
    )


def _set(links: np.ndarray, names: str, values: Array) -> None:
    """Write columns of values to fields of records."""
    for name, value in zip(names.split(), np.moveaxis(np.asarray(values), -1, 0), strict=True):
        links[name] = value


def _spread(arm: Arm, apart: list[int]) -> Array:
    return np.vstack([np.eye(arm.n), rotor_turns(arm)[apart]])


def followers(arm: Arm) -> list[int]:
    """Indices of the rotors with mass or inertia that follow several joints, or another joint than their own."""
    if arm.coupling is None or arm.level is RotorLevel.NONE:
        return []
    apart = (arm.coupling != np.eye(arm.n)).any(axis=1)
    return [i for i, r in enumerate(arm.rotors) if r is not None and apart[i] and (r.mass or r.inertia.any())]


def link_frames(arm: Arm) -> Array:
    """Frames of the base and of the links as the recursion uses them, with all joints at zero, (n + 1, 4, 4).

    The origin of link i is the point of joint axis i nearest to ``joint_points[i]``, its z axis is the joint's, and its
    x axis is also perpendicular to the next joint's axis. The base has the frame of link 0.
    """
    axes, turning = arm.axes, ~np.array(arm.slides)[:, None]
    on_axis = np.cross(arm.screws[:, :3], arm.screws[:, 3:])
    along = np.sum(axes * (arm.joint_points - on_axis), axis=1, keepdims=True)
    frames = np.zeros((arm.n + 1, 4, 4))
    frames[1:, :3, 3] = np.where(turning, on_axis + axes * along, arm.joint_points)
    frames[:, 3, 3] = 1.0
    x = np.zeros((arm.n, 3))
    x[:-1] = np.cross(axes[:-1], axes[1:])
    for i in np.flatnonzero(~x.any(axis=1)):
        x[i] = frame_along(axes[i])[:, 0]
    x /= np.sqrt(np.sum(x * x, axis=1, keepdims=True))
    # A small cross product has rounding errors; make it exactly perpendicular to z.
    x -= axes * np.sum(axes * x, axis=1, keepdims=True)
    x /= np.sqrt(np.sum(x * x, axis=1, keepdims=True))
    frames[1:, :3, 0], frames[1:, :3, 1], frames[1:, :3, 2] = x, np.cross(axes, x), axes
    frames[0] = frames[1]
    return frames


def inverse_poses(poses: Array) -> Array:
    result = np.zeros_like(poses)
    turned = np.swapaxes(poses[..., :3, :3], -1, -2)
    result[..., :3, :3] = turned
    result[..., :3, 3] = -(turned @ poses[..., :3, 3, None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def carried_moments(poses: Array, masses: Array, inertias: Array) -> Array:
    """Second moments, first moments and mass, [[S, h], [h, m]], of bodies with centre-of-mass frames ``poses``."""
    traces = np.trace(inertias, axis1=-2, axis2=-1)[..., None, None]
    central = np.zeros((*np.shape(masses), 4, 4))
    central[..., :3, :3] = 0.5 * traces * np.eye(3) - inertias
    central[..., 3, 3] = masses
    return np.asarray(poses @ central @ np.swapaxes(poses, -1, -2))


def _place(links: np.ndarray, steps: Array) -> None:
    """Places of the joints in the previous frames: the rotation is ``Rx(alpha) Rz(turn q + offset)``."""
    rotation = steps[:, :3, :3]
    tilt = np.hypot(rotation[:, 1, 2], rotation[:, 2, 2])
    cosine, sine = rotation[:, 2, 2] / tilt, -rotation[:, 1, 2] / tilt
    zero, one = np.zeros(len(links)), np.ones(len(links))
    _set(links, "px py pz", steps[:, :3, 3])
    _set(links, ROTATION, np.stack([one, zero, zero, zero, cosine, -sine, zero, sine, cosine], axis=1))
    links["offset"] = np.arctan2(-rotation[:, 0, 1], rotation[:, 0, 0])


def _pose(links: np.ndarray, poses: Array) -> None:
    _set(links, "px py pz", poses[:, :3, 3])
    _set(links, ROTATION, poses[:, :3, :3].reshape(-1, 9))


def _joints(links: np.ndarray, arm: Arm, frames: Array) -> None:
    """Kinds of motion of the joints, and the rotation of their own frames relative to the recursion's."""
    links["turn"] = ~np.array(arm.slides)
    links["slide"] = np.where(arm.slides, 1.0, arm.pitches)
    own = [frame[:, :2].T @ frame_along(frame[:, 2])[:, 0] for frame in frames[1:, :3, :3]]
    _set(links, "cos_own sin_own", np.array(own))


def _revolute(links: np.ndarray) -> np.ndarray:
    return np.asarray((links["turn"] == 1.0) & (links["slide"] == 0.0))


def write_bodies(links: np.ndarray, bodies: Array) -> None:
    """Write mass, first and second moments to their fields."""
    links["mass"] = bodies[..., 3, 3]
    _set(links, "hx hy hz", bodies[..., :3, 3])
    _set(links, "sxx syy szz", np.diagonal(bodies, axis1=-2, axis2=-1)[..., :3])
    _set(links, "sxy sxz syz", bodies[..., [0, 0, 1], [1, 2, 2]])


def _mount(
    arm: Arm, inverse: Array, links: np.ndarray, bodies: Array, apart: dict[int, float]
) -> tuple[list[np.ndarray], list[tuple[int, int, int]]]:
    """Include the rotors in the links and their bodies; returns the records of those that cannot be included.

    ``apart`` maps rotors that follow substitute joints, in their order, to the factor of their motion.
    """
    extra, rotors, assumed_limits = [], [], list(apart)
    for i, rotor in enumerate(arm.rotors):
        if rotor is None:
            continue
        joint, ratio = (arm.n + assumed_limits.index(i), apart[i]) if i in apart else (i, rotor.ratio)
        own = _own_pass(rotor, arm.level, (joint, ratio), inverse, links, bodies)
        if own is not None:
            extra.append(own[0])
            rotors.append((joint, rotor.carrier, own[1]))
    # First those that the recursion computes together with their joint.
    simple = _revolute(links)
    later = [not (balanced and carrier == joint - 1 and simple[joint]) for joint, carrier, balanced in rotors]
    order = sorted(range(len(rotors)), key=later.__getitem__)
    return [extra[r] for r in order], [rotors[r] for r in order]


def _own_pass(
    rotor: MountedRotor, level: RotorLevel, follows: tuple[int, float], inverse: Array, links: np.ndarray, bodies: Array
) -> tuple[np.ndarray, int] | None:
    """The constants of a rotor with an own record, and whether it is balanced; None if it is included in a link.

    ``follows`` is the joint that the rotor follows and the factor of its motion.
    """
    joint, ratio = follows
    spin = spin_frame(rotor)
    whole = carried_moments(inverse_poses(spin) @ rotor.home, np.asarray(rotor.mass), rotor.inertia)
    balanced = _is_balanced(whole, float(np.abs(spin[:3, 3]).max()))
    if level is RotorLevel.FULL and not balanced:
        return _spinning_body(inverse[rotor.carrier + 1] @ spin, whole, ratio), 0
    if rotor.carrier >= 0:
        in_carrier = inverse[rotor.carrier + 1] @ rotor.home
        bodies[rotor.carrier] += carried_moments(in_carrier, np.asarray(rotor.mass), rotor.inertia)
    if level is RotorLevel.NONE:
        return None
    axial = float(whole[0, 0] + whole[1, 1])
    links["rotor_inertia"][joint] += axial * ratio**2
    if level is RotorLevel.REFLECTED or rotor.carrier < 0 or axial == 0.0:
        return None
    direction = inverse[rotor.carrier + 1, :3, :3] @ spin[:3, 2]
    return _coupled(links, joint, rotor.carrier, axial * ratio * direction)


def _coupled(links: np.ndarray, joint: int, carrier: int, spin: Array) -> tuple[np.ndarray, int] | None:
    """Store a balanced rotor's momentum per unit joint rate, in its carrier's frame, where it costs least.

    This is the joint's link if it is along its axis, and otherwise an own record, which is returned.
    """
    link = links[joint]
    axis = np.array([link["rxz"], link["ryz"], link["rzz"]])
    along = float(axis @ spin)
    revolute = _revolute(links)[joint]
    if carrier == joint - 1 and revolute and np.linalg.norm(spin - along * axis) <= BALANCED * abs(along):
        link["spin"] = along
        return None
    own = np.zeros(1, LINK)
    _set(own, "px py pz", spin[None])
    return own, 1


def spin_frame(rotor: MountedRotor) -> Array:
    """Frame with z along the spin axis and origin nearest to the centre of mass; base frame, joints at zero, (4, 4)."""
    direction = rotor.screw[:3]
    (x, y, z), (u, v, w) = direction, rotor.screw[3:]
    # np.cross would take longer than the rest of this function.
    on_axis = np.array([y * w - z * v, z * u - x * w, x * v - y * u])
    frame = np.eye(4)
    frame[:3, :3] = frame_along(direction)
    frame[:3, 3] = on_axis + direction * float(direction @ (rotor.home[:3, 3] - on_axis))
    return frame


def _is_balanced(whole: Array, size: float) -> bool:
    """Whether a body, given in a frame on its spin axis, is balanced and axisymmetric about z."""
    off_axis = np.abs(whole[:2, 3]).max() > BALANCED * whole[3, 3] * max(1.0, size)
    uneven = max(abs(whole[0, 1]), abs(whole[0, 2]), abs(whole[1, 2]), abs(whole[0, 0] - whole[1, 1]))
    return not (off_axis or uneven > BALANCED * np.abs(whole[:3, :3]).max())


def _spinning_body(place: Array, whole: Array, ratio: float) -> np.ndarray:
    """The constants of a rotor that is not balanced."""
    own = np.zeros(1, LINK)
    _pose(own, place[None])
    own["turn"] = ratio
    write_bodies(own, whole[None])
    return own


def _wrench_map(tip: Array) -> Array:
    """The matrix from row vectors (moment, force) in the tip frame to the last link's frame, (6, 6)."""
    rotation, (x, y, z) = tip[:3, :3], tip[:3, 3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation.T
    result[3:, :3] = (np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ rotation).T
    return result
