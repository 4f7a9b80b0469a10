"""Arms with elastic joints and bending links: small motions about a posture.

The spring of a joint connects the rotor, referred to the joint by its ratio, with the link that it drives; for coupled
motors (``arm/coupling.py``), spring i connects rotor i and shaft i. Vibrations are those at a fixed posture, without
damping, the stiffness due to gravity, and velocity terms.

Reference: Modern Robotics, section 8.9.5, which names these effects without equations.
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
from drivetrain.arrays import Array, checked_array, finite_samples, real_array
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.mass import mass_matrices
from drivetrain.errors import LARGEST, Fault, InputError, raise_faults
from drivetrain.spatial.beams import Beam, beam_compliance
from drivetrain.spatial.poses import inverse_pose
from drivetrain.spatial.wrenches import like

# Share of an axis' inertia for the difference of its two motors: their mode against each other is then a thousand times
# faster than the others.
NEGLIGIBLE_INERTIA = 1e-6
RIGID = 1e6  # stiffness of a spring that is as good as rigid, over that of the others
NO_BEAMS: Mapping[int, Beam] = {}


def locked_frequencies(arm: Arm, q: Any, stiffness: Any, *, added: Any = None) -> Array:
    """The natural frequencies with all rotors locked to their stators, as with stiff control or a brake.

    Args:
        arm: With rotors or without; rotors count as mass of their carriers. Closed loops are allowed.
        q: Positions [rad or m], (n,) or (N, n).
        stiffness: Of the joint springs [N m/rad; N/m at a prismatic joint], (n,), or (N, n) for each sample. Infinite:
            a rigid joint, which does not vibrate.
        added: Inertia that each spring carries beside the arm, as of stages behind a gear [kg m^2 or kg], (n,).

    Returns:
        Frequencies [Hz], lowest first, one per elastic joint, (m,) or (N, m).

    Raises:
        InputError: Wrong shapes, stiffness not positive, or a joint that is elastic in some samples only.

    Reference: K v = w^2 M v, with M of the elastic joints.
    """
    positions, springs, sprung = _checked_input(arm, q, stiffness)
    masses = locked_mass(arm, positions)
    # Joint motions for a unit rotation of each elastic shaft, with the rigid ones at rest.
    motions = np.linalg.inv(shaft_turns(arm))[:, sprung]
    carried = motions.T @ masses @ motions
    if added is not None:
        carried = carried + np.diag(checked_array(added, (arm.n,), "added")[sprung])
    return like(_frequencies(carried, np.eye(motions.shape[1]), springs[:, sprung]), q)


def locked_mass(arm: Arm, q: Any) -> Array:
    """The mass matrix with all rotors locked to their stators, (n, n) or (N, n, n).

    Two motors on one axis share its inertia equally: their mean moves the arm, their difference a negligible inertia.
    """
    positions = np.atleast_2d(np.asarray(q, dtype=np.float64))
    if arm.linkage is not None:
        refuse_loops(arm, shared=True, closed=True)
        still, rest = replace(arm, level=RotorLevel.NONE, gravity=np.zeros(3)), np.zeros(positions.shape)
        columns = [inverse_dynamics(still, positions, rest, rest + unit) for unit in np.eye(arm.n)]
        alike = arm.linkage.loops.mean
        mass = alike.T @ np.stack(columns, axis=2) @ alike
        for pair in map(list, arm.linkage.loops.shared):
            mass[:, pair, pair] += NEGLIGIBLE_INERTIA * mass[:, pair, pair]
        return like(0.5 * (mass + np.swapaxes(mass, 1, 2)), q)
    return like(free_mass(arm, positions)[:, : arm.n, : arm.n], q)


def free_frequencies(arm: Arm, q: Any, stiffness: Any, *, added: Any = None) -> Array:
    """The natural frequencies with constant motor torques: links and rotors vibrate against each other.

    Args:
        arm: With rotors, counted at its level. An elastic joint without a rotor has its spring between the two links,
            as a bending link.
        q: Positions [rad or m], (n,) or (N, n).
        stiffness: Of the joint springs [N m/rad; N/m at a prismatic joint], (n,), or (N, n) for each sample. Infinite:
            a rigid joint, whose rotor follows the link.
        added: As for ``locked_frequencies``; the rotors are without it.

    Returns:
        Frequencies [Hz], lowest first, one per elastic joint, (m,) or (N, m), without the rigid-body modes.

    Raises:
        InputError: As for ``locked_frequencies``, or a rotor of an elastic joint without inertia.

    Reference: One joint: w^2 = K (1/I + 1/(G^2 J)), the torsional resonance of the drive-train.
    """
    positions, springs, sprung = _checked_input(arm, q, stiffness)
    _require_inertia(arm, sprung)
    masses = free_mass(arm, positions)
    if added is not None:
        carried = np.where(sprung, checked_array(added, (arm.n,), "added"), 0.0)
        masses[:, : arm.n, : arm.n] += shaft_turns(arm).T @ np.diag(carried) @ shaft_turns(arm)
    loose = sprung & np.array([rotor is not None for rotor in arm.rotors])
    # A rigid joint has one coordinate for link and rotor; its row of the second block is added to that of the first.
    links_part = np.vstack([np.eye(arm.n), (~sprung)[:, None] * shaft_turns(arm)])
    rotors_part = np.vstack([np.zeros((arm.n, arm.n)), np.eye(arm.n)])[:, loose]
    reduction = np.hstack([links_part, rotors_part])
    twists = np.hstack([shaft_turns(arm), -np.eye(arm.n)[:, loose]])[sprung]
    return like(_frequencies(reduction.T @ masses @ reduction, twists, springs[:, sprung]), q)


def free_mass(arm: Arm, q: Array) -> Array:
    """The mass matrix of joints and of independent rotors, whose angles are referred to the output of their gears.

    It is (N, 2 n, 2 n) for positions (N, n), zero in the rows of joints without a rotor. With its blocks
    ``[[M0, S], [S.T, B]]``, M0 + S C + C.T S.T + C.T B C is the matrix for rotors that follow by a coupling C.

    Reference: Modern Robotics, equation 8.111, split into its parts.
    """
    there = [i for i, rotor in enumerate(arm.rotors) if rotor is not None]
    moving = [*range(arm.n), *(arm.n + i for i in there)]
    result = np.zeros((len(q), 2 * arm.n, 2 * arm.n))
    wide = np.hstack([q, shaft_motion(arm, q)[:, there]])
    result[np.ix_(range(len(q)), moving, moving)] = mass_matrices(packed(arm, tuple(there)), wide)
    return result


def tip_compliance(arm: Arm, q: Any, stiffness: Any, *, beams: Mapping[int, Beam] = NO_BEAMS) -> Array:
    """Compliance of the tip: joint springs and bending links in series.

    Args:
        arm: The arm.
        q: Positions [rad or m], (n,) or (N, n).
        stiffness: Of the joint springs [N m/rad; N/m at a prismatic joint], (n,), or (N, n) for each sample; infinite:
            rigid.
        beams: Beam of each bending link, by link index, in the base frame with all joints at zero [m, N m^2].

    Returns:
        The matrix from a wrench on the tip (moment [N m], force [N]) to the tip's (rotation [rad], displacement [m]),
        about the tip, in axes of the base, (6, 6) or (N, 6, 6).

    Raises:
        InputError: Wrong shapes, stiffness not positive, or a beam of a link that the arm does not have.

    Reference: J K^-1 J^T (J C^-1 for J with a coupling C), plus the compliance of each beam transformed to the tip.
    """
    positions, springs, _ = _checked_input(arm, q, stiffness)
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
    """The matrices from a small motion of one point of a rigid body to that of another point, in the same axes.

    They act on (rotation [rad], displacement [m]), (N, 6, 6); their transposes transform wrenches in the other
    direction.
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


def _checked_input(arm: Arm, q: Any, stiffness: Any) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Checked positions (N, n), stiffness at every sample (N, n), and which joints are elastic (n,)."""
    (positions,) = finite_samples(arm.n, {"q": q})
    try:
        given = real_array(stiffness)
    except (TypeError, ValueError, OverflowError):
        raise InputError(Fault("stiffness", f"must be numbers of shape ({arm.n},) or that of q", stiffness)) from None
    if given.shape not in ((arm.n,), positions.shape):
        raise InputError(Fault("stiffness", f"must have shape ({arm.n},) or that of q", given.shape))
    springs = np.broadcast_to(given, positions.shape)
    if not (springs > 0.0).all():
        problem = "must be positive [N m/rad or N/m]; infinite where rigid"
        raise InputError(Fault("stiffness", problem, float(given.min())))
    finite = given[np.isfinite(given)]
    if (finite > LARGEST).any():
        hint = "infinite means that the joint is rigid"
        raise InputError(Fault("stiffness", "is too large to calculate with", float(finite.max()), hint))
    sprung = np.isfinite(given.reshape(-1, arm.n))
    changing = (sprung != sprung[:1]).any(axis=0)
    if changing.any():
        joint = arm.joint_names[int(np.argmax(changing))]
        raise InputError(Fault(f"stiffness of {joint}", "must be finite in every sample or in none"))
    return positions, springs, np.asarray(sprung.all(axis=0))


def _require_inertia(arm: Arm, sprung: NDArray[np.bool_]) -> None:
    """Raise ``InputError`` for an elastic joint whose rotor has no inertia."""
    faults = []
    for name, rotor, has_spring in zip(arm.joint_names, arm.rotors, sprung, strict=True):
        if has_spring and rotor is not None and (rotor.axial_inertia <= 0.0 or arm.level is RotorLevel.NONE):
            hint = "make the joint rigid (infinite stiffness), or ask for the locked frequencies"
            faults.append(Fault(f"rotor of {name}", "must have inertia to swing against its link", hint=hint))
    raise_faults(faults)


def _frequencies(masses: Array, twists: Array, springs: Array) -> Array:
    """Frequencies of springs with deflections ``twists @ x``, (N, m) [Hz], without modes that deflect no spring."""
    loose = twists @ np.linalg.solve(masses, np.broadcast_to(twists.T, (len(masses), *twists.T.shape)))
    root = np.sqrt(springs)
    squares = np.linalg.eigvalsh(root[:, :, None] * (0.5 * (loose + np.swapaxes(loose, 1, 2))) * root[:, None, :])
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))


def struck_torques(inertia: Array, stiffness: Array, speed: Array, excess: Array) -> Array:
    """Bound on the torques of springs between rotors and links if all rotors stop, each within any time [N m], (S, n).

    On rotors at rest, the links oscillate in modes. A rotor that slows excites them as the same change of its link's
    speed would, at whatever time, so the amplitudes of all changes add up at most. For one joint, this is the amplitude
    ``w sqrt(K J)`` of a link that is stopped at once, and that of a release from its load.

    ``inertia`` is that at the joints, (S, n, n); ``stiffness`` the largest one of each spring, infinite where rigid,
    NaN if unknown; ``speed`` and ``excess`` those before the stop, the torques less those at rest, (S, n). The bound is
    on what is added to the torques at rest: infinite for a rigid spring, and for all that the inertia couples to one
    of unknown stiffness, as both may be in resonance.

    Reference: modal superposition with ``y = sqrt(K) x`` for the wind-ups x: ``A y'' + y = 0``, A = inertia over the
    roots of the stiffnesses, with the eigenvalues 1/omega^2.
    """
    unknown, elastic = np.isnan(stiffness), np.isfinite(stiffness)
    rigid = RIGID * np.max(stiffness, initial=1.0, where=elastic)
    root = np.sqrt(np.where(elastic, stiffness, rigid))
    squares, modes = np.linalg.eigh(inertia / root / root[:, None])
    share, onto = np.abs(modes), np.abs(modes).swapaxes(1, 2)
    struck = np.sqrt(np.maximum(squares, 0.0))[..., None] * (onto @ np.abs(root * speed)[..., None])
    torque = root * (share @ (struck + onto @ np.abs(excess / root)[..., None]))[..., 0]
    coupled = np.linalg.matrix_power(inertia != 0.0, len(stiffness))  # also over other springs
    return np.where(~elastic | coupled[..., unknown].any(axis=-1), np.inf, torque)
