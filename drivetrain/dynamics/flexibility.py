"""Arms with springs in their joints and links that bend: small motions about a posture.

The spring of a joint lies between the rotor, seen through its ratio, and the link that it drives; where motors are
coupled (``arm/coupling.py``), spring i lies between rotor i and shaft i. Vibrations are those of the frozen posture,
without damping, gravity's own small stiffness and the terms of speed.

Reference: Modern Robotics, section 8.9.5, which names these effects and leaves their equations to the reader.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.coupling import shaft_motion, shaft_turns
from drivetrain.arm.kinematics import link_poses, tip_jacobian, tip_pose
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arrays import Array, finite_samples, real_array
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.mass import mass_matrices
from drivetrain.errors import LARGEST, Fault, InputError, raise_faults
from drivetrain.spatial.beams import Beam, beam_compliance
from drivetrain.spatial.poses import inverse_pose
from drivetrain.spatial.wrenches import like

NEXT_TO_NOTHING = (
    1e-6  # of an axis' inertia: what winds its two gears against each other swings a thousand times faster
)
NO_BEAMS: Mapping[int, Beam] = {}


def locked_frequencies(arm: Arm, q: Any, stiffness: Any) -> Array:
    """The natural frequencies with every motor holding its rotor still against its stator: stiff control, or a brake.

    Args:
        arm: With rotors or without; rotors ride along as dead weight. Loops may close.
        q: Positions [rad or m], (n,) or (N, n).
        stiffness: Of the joint springs [N m/rad; N/m at a prismatic joint], (n,), or (N, n) of each sample. Infinite:
            a rigid joint, which does not vibrate.

    Returns:
        [Hz], lowest first, one a sprung joint, (m,) or (N, m).

    Raises:
        InputError: Wrong shapes, stiffness not positive, or a joint sprung in some samples only.

    Reference: K v = w^2 M v, with M of the sprung joints.
    """
    positions, springs, sprung = _door(arm, q, stiffness)
    masses = locked_mass(arm, positions)
    # Joint motions of a unit twist of each sprung shaft, the rigid ones still.
    motions = np.linalg.inv(shaft_turns(arm))[:, sprung]
    return like(_frequencies(motions.T @ masses @ motions, np.eye(motions.shape[1]), springs[:, sprung]), q)


def locked_mass(arm: Arm, q: Any) -> Array:
    """The mass matrix with every rotor held still against its stator, (n, n) or (N, n, n).

    Of two motors on an axis each has half of it: their mean moves the arm, and their difference next to nothing.
    """
    positions = np.atleast_2d(np.asarray(q, dtype=np.float64))
    if arm.linkage is not None:
        refuse_loops(arm, shared=True, closed=True)
        still, rest = replace(arm, level=RotorLevel.NONE, gravity=np.zeros(3)), np.zeros(positions.shape)
        columns = [inverse_dynamics(still, positions, rest, rest + unit) for unit in np.eye(arm.n)]
        alike = arm.linkage.loops.mean
        mass = alike.T @ np.stack(columns, axis=2) @ alike
        for pair in map(list, arm.linkage.loops.shared):
            mass[:, pair, pair] += NEXT_TO_NOTHING * mass[:, pair, pair]
        return like(0.5 * (mass + np.swapaxes(mass, 1, 2)), q)
    return like(free_mass(arm, positions)[:, : arm.n, : arm.n], q)


def free_frequencies(arm: Arm, q: Any, stiffness: Any) -> Array:
    """The natural frequencies with every motor's torque constant: links swing against rotors, two masses a spring.

    Args:
        arm: With rotors, counted at its level. A sprung joint without a rotor has its spring between the two links, as
            a link that bends has.
        q: Positions [rad or m], (n,) or (N, n).
        stiffness: Of the joint springs [N m/rad; N/m at a prismatic joint], (n,), or (N, n) of each sample. Infinite:
            a rigid joint, whose rotor follows the link.

    Returns:
        [Hz], lowest first, one a sprung joint, (m,) or (N, m); the motions without any twist, of frequency 0, left out.

    Raises:
        InputError: As ``locked_frequencies``; or the rotor of a sprung joint has no inertia.

    Reference: One joint: w^2 = K (1/I + 1/(G^2 J)), the torsional resonance of the drive-train.
    """
    positions, springs, sprung = _door(arm, q, stiffness)
    _demand_inertia(arm, sprung)
    masses = free_mass(arm, positions)
    loose = sprung & np.array([rotor is not None for rotor in arm.rotors])
    # A rigid joint has one coordinate for link and rotor; its row of the second block joins that of the first.
    links_part = np.vstack([np.eye(arm.n), (~sprung)[:, None] * shaft_turns(arm)])
    rotors_part = np.vstack([np.zeros((arm.n, arm.n)), np.eye(arm.n)])[:, loose]
    reduction = np.hstack([links_part, rotors_part])
    twists = np.hstack([shaft_turns(arm), -np.eye(arm.n)[:, loose]])[sprung]
    return like(_frequencies(reduction.T @ masses @ reduction, twists, springs[:, sprung]), q)


def free_mass(arm: Arm, q: Array) -> Array:
    """The mass matrix of joints, and of rotors that move on their own, each angle counted behind its gear.

    (N, 2 n, 2 n) for positions (N, n), rotors where these have brought them; zero where a joint has no rotor. With it
    as ``[[M0, S], [S.T, B]]``, M0 + S C + C.T S.T + C.T B C is that of rotors bound to their joints by a coupling C.

    Reference: Modern Robotics, equation 8.111, taken apart.
    """
    there = [i for i, rotor in enumerate(arm.rotors) if rotor is not None]
    moving = [*range(arm.n), *(arm.n + i for i in there)]
    result = np.zeros((len(q), 2 * arm.n, 2 * arm.n))
    wide = np.hstack([q, shaft_motion(arm, q)[:, there]])
    result[np.ix_(range(len(q)), moving, moving)] = mass_matrices(packed(arm, tuple(there)), wide)
    return result


def tip_compliance(arm: Arm, q: Any, stiffness: Any, *, beams: Mapping[int, Beam] = NO_BEAMS) -> Array:
    """How the tip gives way to a wrench on it: joint springs and bending links in series.

    Args:
        arm: The arm.
        q: Positions [rad or m], (n,) or (N, n).
        stiffness: Of the joint springs [N m/rad; N/m at a prismatic joint], (n,), or (N, n) of each sample; infinite:
            rigid.
        beams: The part of a link that bends, by link index, in the base frame with every joint at zero [m, N m^2].

    Returns:
        The matrix that takes a wrench on the tip (moment [N m], force [N]) to the tip's (rotation [rad], displacement
        [m]), all about the tip in axes of the base, (6, 6) or (N, 6, 6).

    Raises:
        InputError: Wrong shapes, stiffness not positive, or a beam of a link that the arm does not have.

    Reference: J K^-1 J^T (J C^-1 for J with a coupling C), plus every beam's own compliance carried to the tip.
    """
    positions, springs, _ = _door(arm, q, stiffness)
    check_beams(arm, beams)
    tips = tip_pose(arm, positions)
    jacobian = tip_jacobian(arm, positions) @ np.linalg.inv(shaft_turns(arm))
    result = np.asarray((jacobian / springs[:, None, :]) @ np.swapaxes(jacobian, 1, 2))
    moved = link_poses(arm, positions) @ np.array([inverse_pose(home) for home in arm.home])
    for link, beam in beams.items():
        turn = np.zeros((len(positions), 6, 6))
        turn[:, :3, :3] = turn[:, 3:, 3:] = moved[:, link, :3, :3] @ beam.axes
        end = moved[:, link, :3, :3] @ beam.end + moved[:, link, :3, 3]
        carry = carried_to(tips[:, :3, 3] - end) @ turn
        result += carry @ beam_compliance(beam.section, beam.length) @ np.swapaxes(carry, 1, 2)
    return result if np.ndim(q) == 2 else result[0]


def carried_to(levers: Array) -> Array:
    """The matrices that carry a small motion of one point of a rigid body to another point of it, same axes.

    They act on (rotation [rad], displacement [m]), (N, 6, 6); their transposes carry wrenches back.
    """
    x, y, z = np.asarray(levers).T
    result = np.tile(np.eye(6), (len(x), 1, 1))
    result[:, 3, 1], result[:, 3, 2] = z, -y
    result[:, 4, 0], result[:, 4, 2] = -z, x
    result[:, 5, 0], result[:, 5, 1] = y, -x
    return result


def check_beams(arm: Arm, beams: Mapping[int, Beam]) -> None:
    raise_faults(
        Fault(f"beams[{link}]", f"is no link of the arm: 0 to {arm.n - 1}", link)
        for link in beams
        if not 0 <= link < arm.n
    )


def _door(arm: Arm, q: Any, stiffness: Any) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Positions (N, n), spring stiffness of every sample (N, n), and which joints are sprung (n,)."""
    (positions,) = finite_samples(arm.n, {"q": q})
    try:
        given = real_array(stiffness)
    except (TypeError, ValueError, OverflowError):
        raise InputError(Fault("stiffness", f"must be numbers of shape ({arm.n},) or that of q", stiffness)) from None
    if given.shape not in ((arm.n,), positions.shape):
        raise InputError(Fault("stiffness", f"must have shape ({arm.n},) or that of q", f"shape {given.shape}"))
    springs = np.broadcast_to(given, positions.shape)
    if not (springs > 0.0).all():
        problem = "must be positive [N m/rad or N/m]; infinite where rigid"
        raise InputError(Fault("stiffness", problem, float(given.min())))
    sprung = np.isfinite(springs)
    if (springs[sprung] > LARGEST).any():
        hint = "infinite means that the joint is rigid"
        raise InputError(Fault("stiffness", "is too large to calculate with", float(springs[sprung].max()), hint))
    if (sprung.any(axis=0) != sprung.all(axis=0)).any():
        joint = int(np.argmax(sprung.any(axis=0) != sprung.all(axis=0)))
        raise InputError(Fault(f"stiffness of {arm.joint_names[joint]}", "must be finite in every sample or in none"))
    return positions, springs, np.asarray(sprung.all(axis=0))


def _demand_inertia(arm: Arm, sprung: NDArray[np.bool_]) -> None:
    """A spring behind a rotor needs a mass on either side."""
    faults = []
    for name, rotor, has_spring in zip(arm.joint_names, arm.rotors, sprung, strict=True):
        if has_spring and rotor is not None and (rotor.axial_inertia <= 0.0 or arm.level is RotorLevel.NONE):
            hint = "make the joint rigid (infinite stiffness), or ask for the locked frequencies"
            faults.append(Fault(f"rotor of {name}", "must have inertia to swing against its link", hint=hint))
    raise_faults(faults)


def _frequencies(masses: Array, twists: Array, springs: Array) -> Array:
    """Those of springs that feel ``twists @ x``, without the motions that wind none of them up, (N, m) [Hz]."""
    loose = twists @ np.linalg.solve(masses, np.broadcast_to(twists.T, (len(masses), *twists.T.shape)))
    root = np.sqrt(springs)
    squares = np.linalg.eigvalsh(root[:, :, None] * (0.5 * (loose + np.swapaxes(loose, 1, 2))) * root[:, None, :])
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))
