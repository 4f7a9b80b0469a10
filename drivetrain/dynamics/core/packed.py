"""An arm as the kernels take it: frames on the joint axes, bodies as ten numbers, rotors folded in.

A rotor that is balanced and axisymmetric moves its carrier as a body fixed to it would, but for the couple
``J ratio (qdd z + w x z qd)``, and asks its motor for ``J (ratio qdd + z . dw)``, w and dw those of the carrier. So its
mass and inertia join the carrier's, and the rest costs a few operations. Any other rotor is a body of its own.

A rotor that follows several joints (``arm/coupling.py``) follows a stand-in: a joint at the end of the chain that moves
nothing and weighs nothing, whose position is the rotor's angle. ``samples.py`` gives it that motion and takes its
torque back to the joints, so the recursion is independent of couplings.
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

# On angles, on lengths over the arm's, on inertias over the rotor's: above rounding, far below any workshop.
BALANCED = 1e-12
ROTATION = "rxx rxy rxz ryx ryy ryz rzx rzy rzz"


@dataclass(frozen=True, eq=False)
class Packed:
    """An arm as the kernels take it."""

    # constants of the n links, stand-ins among them, then of the m rotors that need a pass of their own, records
    # LINK, (n + m,)
    links: np.ndarray
    rotors: np.ndarray  # joint, carrier, and 1 if balanced, of those rotors, records ROTOR, (m,)
    gravity: Array  # in the frame of the base [m/s^2], (3,)
    tip: Array  # takes a wrench in the tip frame to one in the last link's frame, row by row from the right, (6, 6)
    ratios: Array  # of the gears, 1 where there is no rotor [- or rad/m], one a joint of the arm
    # takes motions of the arm's joints to those of all n, (n, joints of the arm) [- or rad/m]; None where there are
    # no stand-ins
    spread: Array | None
    chained: bool  # whether every rotor follows a joint of the arm, from the base or from a link beside that joint

    @property
    def arm(self) -> tuple[np.ndarray, np.ndarray, Array]:
        """Links, rotors and gravity in one argument, which a call takes in quicker than three."""
        return self.links, self.rotors, self.gravity


@lru_cache(maxsize=64)
def packed(arm: Arm, free: tuple[int, ...] = ()) -> Packed:
    """The arm for the kernels, remembered by the identity of the arm."""
    refuse_loops(arm)
    frames = link_frames(arm)
    ratios = [1.0 if rotor is None else rotor.ratio for rotor in arm.rotors]
    inverse = inverse_poses(frames)
    bodies = carried_moments(inverse[1:] @ arm.home, arm.masses, arm.inertias)
    apart = sorted({*followers(arm), *free})
    links = np.zeros(arm.n + len(apart), LINK)
    for name in ("cos_own", "rxx", "ryy", "rzz"):  # stand-ins: no turn, no shift
        links[name] = 1.0
    _joints(links[: arm.n], arm, frames)
    _place(links[: arm.n], inverse[:-1] @ frames[1:])
    extra, rotors = _mount(arm, inverse, links, bodies, {i: ratios[i] if i in free else 1.0 for i in apart})
    _bodies(links[: arm.n], bodies)
    return Packed(
        np.concatenate([links, *extra]).view(LINK),  # not an equal type: kernels know this one at sight
        np.array(rotors, ROTOR),
        frames[0, :3, :3].T @ arm.gravity,
        _wrench_map(inverse[-1] @ arm.tip),
        np.array(ratios),
        _spread(arm, apart) if apart and not free else None,
        not apart and all(carrier in (-1, joint - 1, joint) for joint, carrier, _ in rotors),
    )


def _set(links: np.ndarray, names: str, values: Array) -> None:
    """Values side by side into fields of records."""
    for name, value in zip(names.split(), np.moveaxis(np.asarray(values), -1, 0), strict=True):
        links[name] = value


def _spread(arm: Arm, apart: list[int]) -> Array:
    return np.vstack([np.eye(arm.n), rotor_turns(arm)[apart]])


def followers(arm: Arm) -> list[int]:
    """The rotors that spin, weigh anything, and follow other joints than their own."""
    if arm.coupling is None or arm.level is RotorLevel.NONE:
        return []
    apart = (arm.coupling != np.eye(arm.n)).any(axis=1)
    return [i for i, r in enumerate(arm.rotors) if r is not None and apart[i] and (r.mass or r.inertia.any())]


def link_frames(arm: Arm) -> Array:
    """Frames of the base and of the links as the recursion takes them, with every joint at zero.

    The origin of link i is the point of joint axis i nearest to ``joint_points[i]``, its z axis is the joint's, its x
    axis is at right angles to the next joint's too. The base has the frame of link 0.
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
    # A short cross product is inexact; what it must be is exactly at right angles to z.
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
    """Second moments, first moments and mass, as [[S, h], [h, m]], of bodies whose centre frames have these poses."""
    traces = np.trace(inertias, axis1=-2, axis2=-1)[..., None, None]
    central = np.zeros((*np.shape(masses), 4, 4))
    central[..., :3, :3] = 0.5 * traces * np.eye(3) - inertias
    central[..., 3, 3] = masses
    return np.asarray(poses @ central @ np.swapaxes(poses, -1, -2))


def _place(links: np.ndarray, steps: Array) -> None:
    """Where the joints stand in the frames before; a revolute joint turns there by ``Rx(alpha) Rz(q + offset)``."""
    _pose(links, steps)
    simple, rotation = _revolute(links), steps[:, :3, :3]
    tilt = np.hypot(rotation[:, 1, 2], rotation[:, 2, 2])
    cosine, sine = rotation[:, 2, 2] / tilt, -rotation[:, 1, 2] / tilt
    zero, one = np.zeros(len(links)), np.ones(len(links))
    tilted = np.stack([one, zero, zero, zero, cosine, -sine, zero, sine, cosine], axis=1)
    _set(links, ROTATION, np.where(simple[:, None], tilted, rotation.reshape(-1, 9)))
    links["offset"] = np.where(simple, np.arctan2(-rotation[:, 0, 1], rotation[:, 0, 0]), 0.0)


def _pose(links: np.ndarray, poses: Array) -> None:
    _set(links, "px py pz", poses[:, :3, 3])
    _set(links, ROTATION, poses[:, :3, :3].reshape(-1, 9))


def _joints(links: np.ndarray, arm: Arm, frames: Array) -> None:
    """How the joints move, and how far their own frames are turned from the recursion's."""
    links["turn"] = ~np.array(arm.slides)
    links["slide"] = np.where(arm.slides, 1.0, arm.pitches)
    own = [frame[:, :2].T @ frame_along(frame[:, 2])[:, 0] for frame in frames[1:, :3, :3]]
    _set(links, "cos_own sin_own", np.array(own))


def _revolute(links: np.ndarray) -> np.ndarray:
    return np.asarray((links["turn"] == 1.0) & (links["slide"] == 0.0))


def _bodies(links: np.ndarray, bodies: Array) -> None:
    """Mass, first and second moments into their fields."""
    links["mass"] = bodies[..., 3, 3]
    _set(links, "hx hy hz", bodies[..., :3, 3])
    _set(links, "sxx syy szz", np.diagonal(bodies, axis1=-2, axis2=-1)[..., :3])
    _set(links, "sxy sxz syz", bodies[..., [0, 0, 1], [1, 2, 2]])


def _mount(
    arm: Arm, inverse: Array, links: np.ndarray, bodies: Array, apart: dict[int, float]
) -> tuple[list[np.ndarray], list[tuple[int, int, int]]]:
    """Fold the rotors into the links and their bodies; give back those that need a pass of their own.

    Rotors apart follow stand-ins, in their order, so many times as far.
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
    return extra, rotors


def _own_pass(
    rotor: MountedRotor, level: RotorLevel, follows: tuple[int, float], inverse: Array, links: np.ndarray, bodies: Array
) -> tuple[np.ndarray, int] | None:
    """The constants of a rotor that needs a pass of its own, and whether it is balanced; None when it is folded in.

    The rotor follows a joint, so many times as far.
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
    """Put a balanced rotor's momentum for a unit joint rate, in its carrier's frame, where it is cheapest.

    That is the joint's link if it lies along its axis, and else a record of its own, which is given back.
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
    """Frame on the spin axis, z along it, abreast of the centre of mass; base frame, all joints zero, (4, 4)."""
    direction = rotor.screw[:3]
    (x, y, z), (u, v, w) = direction, rotor.screw[3:]
    on_axis = np.array([y * w - z * v, z * u - x * w, x * v - y * u])  # np.cross takes longer than all the rest
    frame = np.eye(4)
    frame[:3, :3] = frame_along(direction)
    frame[:3, 3] = on_axis + direction * float(direction @ (rotor.home[:3, 3] - on_axis))
    return frame


def _is_balanced(whole: Array, size: float) -> bool:
    """Whether a body seen from a frame on its spin axis is balanced and axisymmetric about z."""
    off_axis = np.abs(whole[:2, 3]).max() > BALANCED * whole[3, 3] * max(1.0, size)
    uneven = max(abs(whole[0, 1]), abs(whole[0, 2]), abs(whole[1, 2]), abs(whole[0, 0] - whole[1, 1]))
    return not (off_axis or uneven > BALANCED * np.abs(whole[:3, :3]).max())


def _spinning_body(place: Array, whole: Array, ratio: float) -> np.ndarray:
    """The constants of a rotor that is a body of its own."""
    own = np.zeros(1, LINK)
    _pose(own, place[None])
    own["turn"] = ratio
    _bodies(own, whole[None])
    return own


def _wrench_map(tip: Array) -> Array:
    """Takes rows (moment, force) in the tip frame to the last link's frame."""
    rotation, (x, y, z) = tip[:3, :3], tip[:3, 3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation.T
    result[3:, :3] = (np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ rotation).T
    return result
