"""Motors that do not drive one joint each: differentials, belts over joints, motors on the base.

Each motor turns a shaft behind its gear. With the arm's ``coupling`` C, shaft speeds are ``C qd`` and rotor speeds are
``N qd`` with ``N = diag(ratio) C``. Torques follow from the same power: ``joint torques = C^T shaft torques = N^T motor
torques``. Without a coupling, C is the identity: shaft i is joint i. Rotor speeds are relative to the link that carries
the stator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arrays import Array, checked_array, checked_numbers, read_only
from drivetrain.errors import Fault, InputError

SINGULAR = 1e-9  # smallest over largest singular value, rows and columns scaled alike: the error of six digits


def with_coupling(arm: Arm, coupling: Any) -> Arm:
    """The arm with its motors coupled to its joints in this way, in place of any other.

    Args:
        arm: The arm, with or without rotors; the rotors' ratios remain those of the gears before the shafts.
        coupling: C, turns of shaft i per turn of joint j [-; rad/m or m/rad where one is prismatic], (n, n). None:
            every shaft is its joint.

    Returns:
        The arm.

    Raises:
        InputError: Wrong shape, not finite, or singular (the shafts would leave a joint free); two motors on one axis;
            in an arm with closed loops, coupled joints that are not in one chain.
    """
    refuse_loops(arm, closed=True)
    coupled = replace(arm, coupling=None if coupling is None else checked_coupling(coupling, arm.n))
    for group in coupled_groups(coupled) if arm.linkage is not None else ():
        assert arm.linkage is not None
        loops = arm.linkage.loops
        if not any({loops.driven[i] for i in group} <= {*path} for path in loops.paths):
            names = [arm.joint_names[i] for i in group]
            raise InputError(Fault("coupling", "couples joints that no chain of the linkages has together", names))
    return coupled


def checked_coupling(coupling: Any, n: int) -> Array | None:
    """An invertible coupling as a read-only array, (n, n); None if it is the identity."""
    matrix = checked_array(coupling, (n, n), "coupling").copy()
    if np.array_equal(matrix, np.eye(n)):
        return None
    scaled = matrix
    for axis in (1, 0):
        size = np.abs(scaled).max(axis=axis, keepdims=True)
        if not size.all():
            what = ("shaft", "that no joint turns") if axis else ("joint", "that turns no shaft")
            hint = f"{what[0]}s {what[1]}: {np.flatnonzero(size.ravel() == 0.0).tolist()}"
            raise InputError(Fault("coupling", "is singular: motors could not hold the joints", matrix.tolist(), hint))
        scaled = scaled / size
    values = np.linalg.svd(scaled, compute_uv=False)
    if values[-1] <= SINGULAR * values[0]:
        raise InputError(Fault("coupling", "is singular: motors could not hold the joints", matrix.tolist()))
    return np.asarray(read_only(matrix))


def rotor_turns(arm: Arm) -> Array:
    """N, the rotors' speeds for a unit speed of each joint.

    Args:
        arm: Arm with n joints, with or without rotors.

    Returns:
        N [-; rad/m where a joint is prismatic], (n, n): row i is ``ratio_i`` times that of the coupling.
    """
    ratios = np.array([1.0 if rotor is None else rotor.ratio for rotor in arm.rotors])
    return np.asarray(np.diag(ratios) if arm.coupling is None else ratios[:, None] * arm.coupling)


def shaft_turns(arm: Arm) -> Array:
    """C, turns of the shafts behind the gears per turn of each joint, (n, n)."""
    return np.eye(arm.n) if arm.coupling is None else arm.coupling


def joint_turns(arm: Arm) -> Array:
    """C^-1, turns of the joints per turn of each shaft, (n, n)."""
    return np.eye(arm.n) if arm.coupling is None else np.asarray(np.linalg.inv(arm.coupling))


def shaft_motion(arm: Arm, motion: Array) -> Array:
    """Motion of the shafts behind the gears, from that of the joints; same shape, last axis (n,)."""
    return motion if arm.coupling is None else np.asarray(motion @ arm.coupling.T)


def shaft_torques(arm: Arm, torque: Array) -> Array:
    """Shaft torques for given joint torques, ``C^-T`` times these [N m or N]; equal to them without a coupling."""
    return torque if arm.coupling is None else np.asarray(np.linalg.solve(arm.coupling.T, torque.T).T)


def coupled_groups(arm: Arm) -> list[tuple[int, ...]]:
    """Groups of joints whose shafts depend on each other; a joint with a shaft of its own is in no group."""
    if arm.coupling is None:
        return []
    linked = arm.coupling != 0.0
    linked = linked | linked.T | np.eye(arm.n, dtype=bool)
    reach = np.linalg.matrix_power(linked.astype(np.int64), arm.n) > 0
    groups = {tuple(np.flatnonzero(row).tolist()) for row in reach}
    return sorted(group for group in groups if len(group) > 1 or arm.coupling[group[0], group[0]] != 1.0)


def differential(first: float = 1.0, second: float = 1.0) -> Array:
    """The coupling of two shafts that turn one joint together and the next against each other.

    Args:
        first, second: Turns of a shaft per turn of the first joint, and per turn of the second [-].

    Returns:
        ``[[first, second], [first, -second]]`` [-], (2, 2).

    Raises:
        InputError: Values that are no finite numbers.

    Reference: ros_control, transmission_interface/DifferentialTransmission; the arguments are its joint reductions.
    """
    a, b = checked_numbers({"first": (first, "-"), "second": (second, "-")})
    return np.array([[a, b], [a, -b]])


def belts_over(passes: Sequence[float]) -> Array:
    """The coupling of shafts that all start before the first joint; each reaches its joint across all joints before.

    Each shaft drives a belt, or a tube with bevel gears, with a wheel that turns freely on every axis that it passes.
    The wheel on axis k turns relative to link k by its input angle minus the angle of joint k, and turns its output by
    ``passes[k]`` times that angle.

    Args:
        passes: Output over input turns of the wheels on the axes of all joints but the last [-]: 1 for wheels of equal
            size, -1 if the direction is reversed, another number for wheels of two sizes.

    Returns:
        Lower triangular, 1 on the diagonal: below it, entry i, j is the product of the passes from j to i - 1 [-],
        (k, k) for k - 1 passes. Whatever else is between a shaft and its joint belongs to its ratio.

    Raises:
        InputError: Values that are no finite numbers.
    """
    wheels = checked_array(passes, (None,), "passes")
    size = len(wheels) + 1
    result = np.eye(size)
    for i in range(1, size):
        result[i, :i] = wheels[i - 1] * result[i - 1, :i]
    return result


def placed(coupling: Array, joints: Sequence[int], n: int) -> Array:
    """The coupling of a whole arm, (n, n), from that of some of its joints; the identity for all others."""
    result = np.eye(n)
    result[np.ix_(joints, joints)] = coupling
    return result
