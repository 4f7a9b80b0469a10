"""The Jacobian of a scene, by few differences: states whose torques do not meet are moved together.

Accelerations hang together through the inertia, so in the Jacobian of an arm hardly a state can be moved together with
another. The torques behind them do not: inertia times accelerations tells which came from which state, and the factors
of the inertia, left behind by the undisturbed rates, spread each over all accelerations again. Of what changes the
inertia itself every state is moved alone. Friction keeps its modes while this is done.

Reference: Curtis, Powell, Reid, J. Inst. Maths Applics 13 (1974) 117, for the groups.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import callback
from drivetrain.simulation.rates import RIGHT_SIDE, put_states, solve_at
from drivetrain.simulation.records import (
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
from drivetrain.solvers.compiled_problem import column_groups

MOVE = 1.4901161193847656e-08  # of its size: how far a state is moved, the root of the resolution


@part
def _rates_at(run: Run, t: float, moved: Any, to: Any) -> None:
    """Rates at a state; NaN where there is no answer."""
    states, memory = states_of(run), memory_of(run)
    put_states(run, moved)
    solve_at(run, t)
    engine_of(run).rates_calls += 1
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


def _jacobian(t: Any, x: Any, columns: Any, numbers: Any, run: Any) -> None:
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
    """What it needs of a run's memory: its sections, by name.

    Args:
        sizes: Of the states [their units], (m,).
        c: Coordinates [-].
        hangs: Where a rate can hang on a state, of an acceleration its torque, (m, m).
    """
    m = len(sizes)
    groups, members, row_starts, rows = column_groups(hangs, m)
    return {
        "sizes": sizes, "found": np.zeros(m), "later": np.zeros(m), "moved": np.zeros(m), "factors": np.zeros(c * c),
        "slid": np.zeros(c, dtype=np.int64), "torques": np.zeros(c), "own": np.zeros(c), "groups": groups,
        "members": members, "row_starts": row_starts, "rows": rows,
    }  # fmt: skip


@lru_cache(maxsize=1)
def jacobian() -> Any:
    """The Jacobian (t, x, columns, numbers, run), compiled at the first call or taken from the disk cache."""
    return callback(RIGHT_SIDE, _jacobian)
