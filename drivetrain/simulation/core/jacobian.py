"""The Jacobian of a scene, by few differences: states whose torques do not meet are moved together.

Which rates hang on which states follows from what the effects of a plan say they read and write. Accelerations all hang
together through the inertia, so in the Jacobian of an arm hardly a state can be moved together with another. The
torques behind them do not: a current moves its own motor, a twist its own link and motor. So the rows of accelerations
stand here for those of the torques: inertia times accelerations gives which came from which state, and the factors of
the inertia, left behind by the undisturbed rates, spread each over all accelerations again. Of what changes the inertia
itself every state is moved alone. Friction keeps its modes while this is done.

Reference: Curtis, Powell, Reid, J. Inst. Maths Applics 13 (1974) 117, for the groups.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.effects import signals as named
from drivetrain.simulation.core import equations
from drivetrain.simulation.core.equations import put_states, rates_at
from drivetrain.simulation.core.records import (
    AT,
    Run,
    coordinates_of,
    engine_of,
    memory_of,
    numbers_of,
    pairs_of,
    part,
    rows_of,
    states_of,
    words_of,
    world_of,
)
from drivetrain.simulation.planning.plan import Plan

TIP = tuple(signal.name for signal in named.TIP_TAKEN)
BEHIND_POWERS = {
    named.MOTOR_FRICTION_POWER.name: (named.MOTOR_SLIDE_FORWARD, named.MOTOR_SLIDE_BACKWARD),
    named.MESH_POWER.name: (named.GEAR_TORQUE, named.MESH_DRIVING, named.MESH_DRIVEN),
}
PROBES = 2  # postures


def dependence(plan: Plan) -> NDArray[np.bool_]:
    """Where a rate's derivative by a state can differ from zero; of a torque, where the rate is an acceleration."""
    states, c = plan.memory.states, plan.body.c
    known = _motion(plan)
    places, speeds = (1 << c) - 1, ((1 << 2 * c) - 1) ^ ((1 << c) - 1)
    rows = [0] * len(states)
    for _ in range(3):  # what one effect adds after another of its kind has read
        for one in plan.instances:
            read = 0
            for name in one.needs:
                read |= known.get(name, 0)
                joint, _, kind = name.rpartition(".")
                for behind in BEHIND_POWERS.get(kind, ()):
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
    tip = 0
    for name in TIP:
        tip |= known.get(name, 0)
    inertial = _inertial(plan, places | speeds)
    for k in range(c):
        rows[k] = 1 << c + k
        rows[c + k] |= tip | inertial
    for i in plan.body.springs:
        rows[int(plan.body.motors[i])] |= 1 << c + i
    found = np.array([[row >> k & 1 for k in range(len(states))] for row in rows], dtype=bool)
    if not inertial:
        for coordinates in _coordinates(plan):
            found[np.ix_([c + k for k in coordinates], coordinates)] = True  # weights of joints without an arm
    return found


def _coordinates(plan: Plan) -> list[list[int]]:
    """Coordinates on which torques of a joint act: its own and its motor's, and those of shafts coupled to it."""
    n = plan.body.n
    together = [] if plan.body.coupled is None else list(plan.body.coupled.shafts)
    found = []
    for i in range(n):
        joints = together if i in together else [i]
        found.append(sorted({*joints, *(int(plan.body.motors[k]) for k in joints)}))
    return found


def _motion(plan: Plan) -> dict[str, int]:
    """States behind each signal that is known before any law, one bit a state."""
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
    for i, joint in enumerate(plan.scene.joints):  # of the evaluation before, if a law reads them at all
        for signal in named.AFTER:
            known[f"{joint}.{signal.name}"] = every
        # Sliding, dry friction at a motor takes its bound, a mesh behind a spring a share of what that carries; stuck,
        # no power.
        known[f"{joint}.{named.MOTOR_FRICTION_POWER.name}"] = known[f"{joint}.{named.MOTOR_SPEED.name}"]
        if i in plan.body.springs:
            own = known[f"{joint}.{named.DEFLECTION.name}"] | known[f"{joint}.{named.DEFLECTION_SPEED.name}"]
            known[f"{joint}.{named.MESH_POWER.name}"] = own
    return known


def _inertial(plan: Plan, moving: int) -> int:
    """States on which inertia or bias of an arm hang, one bit a state; 0 where the inertia is constant."""
    memory, c = plan.memory, plan.body.c
    if plan.body.arm is None:
        return 0
    numbers = memory.numbers.copy()
    pairs, at = memory.view(numbers, "pairs"), memory.view(numbers, "coordinates")

    def mechanics(state: Any) -> NDArray[np.float64]:
        equations.evaluate_rates(numbers, state)
        return np.append(pairs["mass"], at["bias"])

    found, rng = 0, np.random.default_rng(1)
    for _ in range(PROBES):
        state = np.zeros(memory.moving)
        state[: 2 * c] = rng.uniform(-1.0, 1.0, 2 * c)
        first = mechanics(state)
        for k in range(2 * c):
            moved = state.copy()
            moved[k] += rng.uniform(0.1, 1.0)
            if not found >> k & 1 and not np.array_equal(first, mechanics(moved)):
                found |= 1 << k
    return found & moving


MOVE = 1.4901161193847656e-08  # of its size: how far a state is moved, the root of the resolution


@part
def _rates_at(run: Run, t: float, moved: Any, to: Any) -> None:
    states, memory = states_of(run), memory_of(run)
    put_states(run, moved)
    rates_at(run, t)
    for k in range(len(moved)):
        to[k] = memory[states[k].rate] if engine_of(run).solved >= 0 else math.nan


@part
def _keep_factors(run: Run, factors: Any, slid: Any) -> int:
    """Keep the factors of the inertia of what slides, and which coordinates that are; how many."""
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
    """Inertia times accelerations, in place, from its factors."""
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
    """Accelerations under torques, in place, with the factors."""
    for b in range(count):
        for a in range(b):
            vector[b] -= factors[b, a] * factors[a, a] * vector[a]
    for a in range(count - 1, -1, -1):
        for b in range(a + 1, count):
            vector[a] -= factors[a, b] * vector[b]
        vector[a] *= factors[a, a]


def jacobian(t: Any, x: Any, columns: Any, numbers: Any, run: Any) -> None:
    """The derivatives of all rates by all states, by columns."""
    sizes, found, later = numbers_of(run, AT.sizes), numbers_of(run, AT.found), numbers_of(run, AT.later)
    moved, torques, own = numbers_of(run, AT.moved), numbers_of(run, AT.torques), numbers_of(run, AT.own)
    slid, groups, members = words_of(run, AT.slid), words_of(run, AT.groups), words_of(run, AT.members)
    row_starts, rows = words_of(run, AT.row_starts), words_of(run, AT.rows)
    m, c = len(sizes), world_of(run).coordinates
    factors = rows_of(run, AT.factors, c, c)
    for k in range(m * m):
        columns[k] = 0.0
    for k in range(m):
        moved[k] = x[k]
    _rates_at(run, t, moved, found)
    count = _keep_factors(run, factors, slid)
    for group in range(len(groups) - 1):
        first, last = groups[group], groups[group + 1]
        for e in range(first, last):
            j = members[e]
            step = MOVE * max(abs(x[j]), sizes[j])
            moved[j] = x[j] + (step if found[j] >= 0.0 else -step)
        _rates_at(run, t, moved, later)
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
            inverse = 1.0 / (moved[j] - x[j])
            for a in range(count):
                own[a] = 0.0
            for r in range(row_starts[j], row_starts[j + 1]):
                i = rows[r]
                if i < c or i >= 2 * c:
                    columns[j * m + i] = (later[i] - found[i]) * inverse
                    continue
                for a in range(count):
                    if slid[a] == i - c:
                        own[a] = torques[a] * inverse
            _to_accelerations(factors, count, own)
            for a in range(count):
                columns[j * m + c + slid[a]] = own[a]
            moved[j] = x[j]


def room(sizes: Array, c: int, hangs: Any) -> Mapping[str, Any]:
    """What it needs of a run's memory: its sections, by name."""
    m = len(sizes)
    groups, members, row_starts, rows = column_groups(hangs, m)
    return {
        "sizes": sizes, "found": np.zeros(m), "later": np.zeros(m), "moved": np.zeros(m), "factors": np.zeros(c * c),
        "slid": np.zeros(c, dtype=np.int64), "torques": np.zeros(c), "own": np.zeros(c), "groups": groups,
        "members": members, "row_starts": row_starts, "rows": rows,
    }  # fmt: skip


def column_groups(sparsity: Any, size: int) -> tuple[Any, Any, Any, Any]:
    """Groups of columns that share no row, so that one difference serves them all."""
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
