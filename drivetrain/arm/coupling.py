"""Motors that do not drive one joint each: differentials, belts over joints, motors on the base.

Behind its gear every motor turns a shaft; the shafts turn with the joints as ``shaft speeds = C qd``, C the arm's
``coupling``, and the rotors as ``rotor speeds = N qd`` with ``N = diag(ratio) C``. So gears and ratios stay what they
are, and torques go the other way: ``joint torques = C^T shaft torques = N^T motor torques``. Without a coupling C is
the identity: shaft i is joint i. Rotor speeds are those seen from the link that carries the stator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arrays import Array, checked_array, checked_numbers, read_only
from drivetrain.errors import Fault, InputError

SINGULAR = 1e-9  # of the largest singular value, rows and columns scaled alike: what six printed digits leave


def with_coupling(arm: Arm, coupling: Any) -> Arm:
    """The arm with its motors coupled to its joints in this way, in place of any other.

    Args:
        arm: With rotors or without; their ratios stay those of the gears before the shafts.
        coupling: C, turns of shaft i a turn of joint j [-; rad/m or m/rad where one is prismatic], (n, n). None: every
            shaft is its joint.

    Returns:
        The arm.

    Raises:
        InputError: Another shape, not finite, or singular: shafts that leave a joint free. Two motors on an axis; of an
            arm with closed loops, joints coupled that stand in no chain together.
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
    """A coupling that can be inverted, read-only, (n, n); None when it is the identity."""
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
        arm: With n joints, geared or not.

    Returns:
        N [-; rad/m where a joint is prismatic], (n, n): row i is ``ratio_i`` times that of the coupling.
    """
    ratios = np.array([1.0 if rotor is None else rotor.ratio for rotor in arm.rotors])
    return np.asarray(np.diag(ratios) if arm.coupling is None else ratios[:, None] * arm.coupling)


def shaft_turns(arm: Arm) -> Array:
    """C, turns of the shafts behind the gears a turn of each joint, (n, n)."""
    return np.eye(arm.n) if arm.coupling is None else arm.coupling


def joint_turns(arm: Arm) -> Array:
    """C^-1, turns of the joints for a turn of each shaft, (n, n)."""
    return np.eye(arm.n) if arm.coupling is None else np.asarray(np.linalg.inv(arm.coupling))


def shaft_motion(arm: Arm, motion: Array) -> Array:
    """What the shafts behind the gears do in a motion of the joints."""
    return motion if arm.coupling is None else np.asarray(motion @ arm.coupling.T)


def shaft_torques(arm: Arm, torque: Array) -> Array:
    """Torques of the shafts that make torques at the joints, ``C^-T`` times these [N m or N]; the same uncoupled."""
    return torque if arm.coupling is None else np.asarray(np.linalg.solve(arm.coupling.T, torque.T).T)


def coupled_groups(arm: Arm) -> list[tuple[int, ...]]:
    """The joints whose shafts depend on each other; a joint with a shaft of its own stands in none."""
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
        first, second: Turns of a shaft a turn of the first joint, and of the second [-].

    Returns:
        ``[[first, second], [first, -second]]`` [-], (2, 2).

    Raises:
        InputError: Values that are no finite numbers.

    Reference: ros_control, transmission_interface/DifferentialTransmission, with these as the joints' reductions.
    """
    a, b = checked_numbers({"first": (first, "-"), "second": (second, "-")})
    return np.array([[a, b], [a, -b]])


def belts_over(passes: Sequence[float]) -> Array:
    """The coupling of shafts that all start before the first joint and reach their own over every joint between.

    Each is a belt, or a tube with bevel gears, with a wheel that turns freely on every axis that it passes. Wheel k
    turns against link k by what comes in less the turn of joint k, and drives what goes on ``passes[k]`` times as far.

    Args:
        passes: Of the wheels on the axes of all joints but the last [-]: 1 for wheels of one size, -1 where the way on
            turns the other way round, another number for wheels of two sizes.

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
