"""The Jacobian of a scene: the arm's part analytic, that of the effects by grouped finite differences.

Which rates depend on which states follows from the signals that the effects of a plan declare to read and write. All
accelerations are coupled by the inertia, so hardly any two columns of an arm's Jacobian would be disjoint. The torques
of the effects behind them are sparse: a current acts on its own motor, a wind-up on its own link and motor. So the
sparsity pattern is that of these torques, and states with disjoint columns are perturbed together. The mass matrix
times the differences of the accelerations gives those of the torques. Without those that the arm needs (by the
analytic derivatives of the inverse dynamics) they can be assigned to the states of a group; the factors of the mass
matrix, from the evaluation at the unperturbed state, then give the accelerations. Of an arm with closed loops every
position and speed is perturbed alone. Contact modes are fixed meanwhile.

Reference: Curtis, Powell, Reid, J. Inst. Maths Applics 13 (1974) 117, for the groups.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.effects import signals as named
from drivetrain.simulation.core.arm_derivatives import fill_arm_derivatives
from drivetrain.simulation.core.equations import rates_of
from drivetrain.simulation.core.records import (
    AT,
    Run,
    coordinates_of,
    engine_of,
    numbers_of,
    pairs_of,
    part,
    rows_of,
    words_of,
    world_of,
)
from drivetrain.simulation.planning.plan import Plan

TIP = tuple(signal.name for signal in named.TIP_TAKEN)
# Signals on which a power of the mechanics depends, besides the motion.
POWER_INPUTS = {
    named.MOTOR_FRICTION_POWER.name: (named.MOTOR_SLIDE_FORWARD, named.MOTOR_SLIDE_BACKWARD),
    named.MESH_POWER.name: (named.GEAR_TORQUE, named.MESH_DRIVING, named.MESH_DRIVEN),
}


def sparsity_pattern(plan: Plan) -> NDArray[np.bool_]:
    """The sparsity pattern of the Jacobian, (rates, states): True where a derivative may differ from zero.

    Rows of accelerations hold the pattern of the torques behind them, without those whose derivatives are analytic.
    """
    states, c = plan.memory.states, plan.body.c
    known = _motion(plan)
    rows = [0] * len(states)
    for _ in range(3):  # repeated, since an effect may contribute after another of its kind has read the sum
        for one in plan.instances:
            read = 0
            for name in one.needs:
                read |= known.get(name, 0)
                joint, _, kind = name.rpartition(".")
                for behind in POWER_INPUTS.get(kind, ()):
                    read |= known.get(f"{joint}.{behind.name}", 0)
            for name in one.states:
                read |= 1 << states[name]
            for name in (*one.provides, *one.contributes, *one.outputs):
                known[name] = known.get(name, 0) | read
            for name, state in zip(one.states, one.ports.states, strict=True):
                rows[states[name]] = 0 if state.memory else read
    for i, coordinates in enumerate(_coordinates(plan)):
        joint, own = plan.scene.joints[i], 0
        for signal in (*named.TAKEN, *named.SHAFT_TAKEN):
            own |= known.get(f"{joint}.{signal.name}", 0)
        for k in coordinates:
            rows[c + k] |= own
    every = 0 if plan.body.loops is None else (1 << 2 * c) - 1
    for name in TIP:
        every |= known.get(name, 0)
    for k in range(c):
        rows[k] = 1 << c + k
        rows[c + k] |= every | 1 << k  # its own position always, so that each belongs to a group
    for i in plan.body.springs:
        rows[int(plan.body.motors[i])] |= 1 << c + int(plan.body.loads[i])
    return np.array([[row >> k & 1 for k in range(len(states))] for row in rows], dtype=bool)


def _coordinates(plan: Plan) -> list[list[int]]:
    """For each joint, the coordinates on which its torques act: its own, its motor's, and those of coupled shafts."""
    n, together, found = plan.body.n, plan.body.shafts, []
    for i in range(n):
        joints = together if i in together else (i,)
        found.append(sorted({int(one[k]) for k in joints for one in (plan.body.loads, plan.body.motors)}))
    return found


def _motion(plan: Plan) -> dict[str, int]:
    """For each signal that the mechanics provide, the states on which it depends, as a bit mask."""
    c, states = plan.body.c, plan.memory.states
    known = {name: 1 << k for name, k in states.items()}
    everything = (1 << 2 * c) - 1
    for i, coordinates in enumerate(_coordinates(plan)):
        joint = plan.scene.joints[i]
        where = sum(1 << k for k in coordinates)
        for signal in (*named.BEFORE, *named.SHAFT_GIVEN):
            known[f"{joint}.{signal.name}"] = where << c if "speed" in signal.name else where
        known[f"{joint}.{named.BIAS_TORQUE.name}"] = everything
    for name in ("scene.mass_matrix", *(signal.name for signal in named.TIP_GIVEN)):
        known[name] = everything
    every = (1 << len(states)) - 1
    for i, joint in enumerate(plan.scene.joints):  # known after the solution only; they may depend on everything
        for signal in named.AFTER:
            known[f"{joint}.{signal.name}"] = every
        # While slipping, dry friction at a motor is at its bound, and the loss of a mesh behind a spring is a share of
        # the spring's torque; while sticking, there is no power.
        known[f"{joint}.{named.MOTOR_FRICTION_POWER.name}"] = known[f"{joint}.{named.MOTOR_SPEED.name}"]
        if i in plan.body.springs:
            own = known[f"{joint}.{named.DEFLECTION.name}"] | known[f"{joint}.{named.DEFLECTION_SPEED.name}"]
            known[f"{joint}.{named.MESH_POWER.name}"] = own
    return known


RELATIVE_STEP = 1.4901161193847656e-08  # relative perturbation of a state: the square root of the machine precision


@part
def _save_factors(run: Run, factors: Any, slid: Any) -> int:
    """Save the factors of the mass matrix of the slipping coordinates, and their indices; returns their number."""
    coordinates, pairs, count = coordinates_of(run), pairs_of(run), 0
    for i in range(len(coordinates)):
        if coordinates[i].dry.mode != 0:
            slid[count] = i
            count += 1
    for a in range(count):
        for b in range(count):
            factors[a, b] = pairs[a, b].reduced
    return count


@part
def _to_torques(factors: Any, count: int, vector: Any) -> None:
    """Multiply accelerations by the mass matrix, given by its factors, in place."""
    for a in range(count):
        value = 0.0
        for b in range(a + 1, count):
            value += factors[a, b] * vector[b]
        vector[a] = vector[a] / factors[a, a] + value
    for b in range(count - 1, -1, -1):
        for a in range(b):
            vector[b] += factors[b, a] * factors[a, a] * vector[a]


@part
def _to_accelerations(factors: Any, count: int, vector: Any) -> None:
    """Solve the factorised mass matrix for the accelerations under torques, in place."""
    for b in range(count):
        for a in range(b):
            vector[b] -= factors[b, a] * factors[a, a] * vector[a]
    for a in range(count - 1, -1, -1):
        for b in range(a + 1, count):
            vector[a] -= factors[a, b] * vector[b]
        vector[a] *= factors[a, a]


def jacobian(t: Any, x: Any, columns: Any, numbers: Any, run: Any) -> None:
    """The Jacobian for solvers: derivatives of all rates by all states, column by column, at time t [s] and state x."""
    sizes, found, later = numbers_of(run, AT.sizes), numbers_of(run, AT.found), numbers_of(run, AT.later)
    moved, torques, own = numbers_of(run, AT.moved), numbers_of(run, AT.torques), numbers_of(run, AT.own)
    slid, groups, members = words_of(run, AT.slid), words_of(run, AT.groups), words_of(run, AT.members)
    row_starts, rows = words_of(run, AT.row_starts), words_of(run, AT.rows)
    m, c = len(sizes), world_of(run).coordinates
    factors, arm = rows_of(run, AT.factors, c, c), rows_of(run, AT.arm_torques, c, m)
    for k in range(m * m):
        columns[k] = 0.0
    for k in range(m):
        moved[k] = x[k]
    rates_of(run, t, moved, found)
    count = _save_factors(run, factors, slid)
    if engine_of(run).arm and not engine_of(run).looped:
        arm[:, :] = 0.0
        fill_arm_derivatives(run, arm)
    for group in range(len(groups) - 1):
        first, last = groups[group], groups[group + 1]
        for e in range(first, last):
            j = members[e]
            step = RELATIVE_STEP * max(abs(x[j]), sizes[j])
            moved[j] = x[j] + (step if found[j] >= 0.0 else -step)
        rates_of(run, t, moved, later)
        if last - first == 1:
            j = members[first]
            inverse = 1.0 / (moved[j] - x[j])
            for i in range(m):
                columns[j * m + i] = (later[i] - found[i]) * inverse
            moved[j] = x[j]
            continue
        for a in range(count):
            torques[a] = later[c + slid[a]] - found[c + slid[a]]
        _to_torques(factors, count, torques)
        for e in range(first, last):
            j = members[e]
            for a in range(count):
                torques[a] += arm[slid[a], j] * (moved[j] - x[j])
        for e in range(first, last):
            j = members[e]
            inverse = 1.0 / (moved[j] - x[j])
            for a in range(count):
                own[a] = -arm[slid[a], j]
            for r in range(row_starts[j], row_starts[j + 1]):
                i = rows[r]
                if i < c or i >= 2 * c:
                    columns[j * m + i] = (later[i] - found[i]) * inverse
                    continue
                for a in range(count):
                    if slid[a] == i - c:
                        own[a] += torques[a] * inverse
            _to_accelerations(factors, count, own)
            for a in range(count):
                columns[j * m + c + slid[a]] = own[a]
            moved[j] = x[j]


def memory_sections(sizes: Array, c: int, sparsity: Any) -> Mapping[str, Any]:
    """The sections of a run's memory that the Jacobian needs, by name.

    ``sizes`` are the magnitudes of the states below which the perturbation is no longer reduced, (m,).
    """
    m = len(sizes)
    groups, members, row_starts, rows = column_groups(sparsity, m)
    return {
        "sizes": sizes, "found": np.zeros(m), "later": np.zeros(m), "moved": np.zeros(m), "factors": np.zeros(c * c),
        "slid": np.zeros(c, dtype=np.int64), "torques": np.zeros(c), "own": np.zeros(c),
        "arm_torques": np.zeros(c * m), "groups": groups, "members": members, "row_starts": row_starts, "rows": rows,
    }  # fmt: skip


def column_groups(sparsity: Any, size: int) -> tuple[Any, Any, Any, Any]:
    """Groups of columns that share no row, so that one evaluation of the rates serves all columns of a group.

    Returns the start of each group in the list of columns, that list, the start of each column in the list of rows, and
    that list.
    """
    full = np.asarray(sparsity, dtype=bool)
    groups: list[list[int]] = []
    taken: list[Any] = []
    for j in sorted(range(size), key=lambda j: -int(full[:, j].sum())):
        fits = [k for k, rows in enumerate(taken) if not (rows & full[:, j]).any()]
        if not full[:, j].any():
            continue
        if fits:
            groups[fits[0]].append(j)
            taken[fits[0]] = taken[fits[0]] | full[:, j]
        else:
            groups.append([j])
            taken.append(full[:, j].copy())
    rows = [np.flatnonzero(full[:, j]) for j in range(size)]
    return (
        np.cumsum([0, *(len(group) for group in groups)], dtype=np.int64),
        np.array([j for group in groups for j in group], dtype=np.int64),
        np.cumsum([0, *(len(r) for r in rows)], dtype=np.int64),
        np.concatenate(rows).astype(np.int64),
    )
