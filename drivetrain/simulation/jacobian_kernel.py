"""The Jacobian of a scene, by few differences: states whose torques do not meet are moved together.

Accelerations hang together through the inertia, so in the Jacobian of an arm hardly a state can be moved together with
another. The torques behind them do not: inertia times accelerations tells which came from which state, and the factors
of the inertia, left behind by the undisturbed rates, spread each over all accelerations again. Of what changes the
inertia itself every state is moved alone. Friction keeps its modes while this is done.

Behind the words that the adaptive engine has put at the end lie: number of groups; where each begins, their states,
where the rates of each state begin, those rates. At the end of its numbers: size of each state, and room.

Reference: Curtis, Powell, Reid, J. Inst. Maths Applics 13 (1974) 117, for the groups.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_one, shifted
from drivetrain.solvers.compiled_function import compiled

AT_GROUPS, AT_SIZES = 0, 1  # words behind those of the plan: where the words and the numbers of this file begin
MOVE = 1.4901161193847656e-08  # of its size: how far a state is moved, the root of the resolution
ROWS = 3  # vectors of the length of the state behind the sizes: rates, disturbed rates, state


@part
def _rates_at(t: float, n: Any, w: Any, state: int, to: int) -> None:
    """Rates at a state among the numbers; NaN where there is no answer."""
    states, at = w[f.MOVING], w[f.AT_STATE]
    for k in range(states):
        n[at + k] = n[state + k]
        n[to + k] = 0.0
    call_one(w[f.MOTION], t, 0.0, shifted(n, to), n, w, 0)
    w[f.RATES_CALLS] += 1
    if w[f.SOLVED] < 0:
        for k in range(states):
            n[to + k] = math.nan


@part
def _keep_factors(n: Any, w: Any, to: int) -> int:
    """Keep the factors of the inertia of what slides, and which coordinates that are; how many."""
    c, count, source = w[f.COORDINATES], 0, w[f.AT_REDUCED]
    for i in range(c):
        if w[w[f.AT_MODES] + i] != 0:
            n[to + c * c + count] = i
            count += 1
    for k in range(count * c):
        n[to + k] = n[source + k]
    return count


@part
def _to_torques(n: Any, factors: int, c: int, count: int, vector: int) -> None:
    """Inertia times accelerations, in place, from its factors."""
    for a in range(count):
        row, value = factors + a * c, 0.0
        for b in range(a + 1, count):
            value += n[row + b] * n[vector + b]
        n[vector + a] = n[vector + a] / n[row + a] + value
    for b in range(count - 1, -1, -1):
        row = factors + b * c
        for a in range(b):
            n[vector + b] += n[row + a] * n[factors + a * c + a] * n[vector + a]


@part
def _to_accelerations(n: Any, factors: int, c: int, count: int, vector: int) -> None:
    """Accelerations under torques, in place, with the factors."""
    for b in range(count):
        row = factors + b * c
        for a in range(b):
            n[vector + b] -= n[row + a] * n[factors + a * c + a] * n[vector + a]
    for a in range(count - 1, -1, -1):
        row = factors + a * c
        for b in range(a + 1, count):
            n[vector + a] -= n[row + b] * n[vector + b]
        n[vector + a] *= n[row + a]


# long kernel: groups of states, states of a group, rates of a state
def _jacobian(t: Any, x: Any, columns: Any, n: Any, w: Any) -> None:
    states, c, at = w[f.MOVING], w[f.COORDINATES], w[w[f.WORDS] + AT_GROUPS]
    sizes = w[w[f.WORDS] + AT_SIZES]
    rates, later, moved = sizes + states, sizes + 2 * states, sizes + 3 * states
    factors = moved + states
    torques = factors + c * c + c
    own = torques + c
    groups, starts = w[at], at + 1
    members = starts + groups + 1
    row_starts = members + states
    rows = row_starts + states + 1
    for k in range(states * states):
        columns[k] = 0.0
    for k in range(states):
        n[moved + k] = x[k]
    _rates_at(t, n, w, moved, rates)
    count = _keep_factors(n, w, factors)
    for group in range(groups):
        first, last = w[starts + group], w[starts + group + 1]
        for e in range(first, last):
            j = w[members + e]
            step = MOVE * max(abs(x[j]), n[sizes + j])
            n[moved + j] = x[j] + (step if n[rates + j] >= 0.0 else -step)
        _rates_at(t, n, w, moved, later)
        if last - first == 1:
            j = w[members + first]
            inverse = 1.0 / (n[moved + j] - x[j])
            for i in range(states):
                columns[j * states + i] = (n[later + i] - n[rates + i]) * inverse
            n[moved + j] = x[j]
            continue
        for a in range(count):
            i = c + int(n[factors + c * c + a])
            n[torques + a] = n[later + i] - n[rates + i]
        _to_torques(n, factors, c, count, torques)
        for e in range(first, last):
            j = w[members + e]
            inverse = 1.0 / (n[moved + j] - x[j])
            for a in range(count):
                n[own + a] = 0.0
            for r in range(w[row_starts + j], w[row_starts + j + 1]):
                i = w[rows + r]
                if i < c or i >= 2 * c:
                    columns[j * states + i] = (n[later + i] - n[rates + i]) * inverse
                    continue
                for a in range(count):
                    if int(n[factors + c * c + a]) == i - c:
                        n[own + a] = n[torques + a] * inverse
            _to_accelerations(n, factors, c, count, own)
            for a in range(count):
                columns[j * states + c + int(n[factors + c * c + a])] = n[own + a]
            n[moved + j] = x[j]


def room(states: int, c: int) -> int:
    """How many numbers it needs.

    Args:
        states, c: Numbers of states and of coordinates [-].

    Returns:
        [-].
    """
    return (1 + ROWS) * states + c * c + 3 * c


@lru_cache(maxsize=1)
def jacobian() -> Any:
    """The Jacobian (t, x, columns, numbers, words), compiled at the first call or taken from the disk cache."""
    return compiled(_jacobian)
