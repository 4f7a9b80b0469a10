"""The Jacobian and the systems of equations that a step solves with it.

A right-hand side brings its own Jacobian, or it is found by differences. It is kept column by column,
``jacobian[state, rate]``, with the derivatives by time behind the last.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call, call_rates, load

_DIAGONAL = 10.0  # so many times smaller than another entry a diagonal may be and stay the pivot
# Indices without a sign: numba asks of others whether they count from the end.
_ONE: Any = np.uint64(1)
_SMALL = float(np.sqrt(np.finfo(np.float64).eps))
_LOOK = 16  # every so many Jacobians one column that looks too steep is looked at again
_MATTERS = 1e3  # a jump within a step matters when it moves a state by so many tolerances


@law
def fill_jacobian(run: Any, states: Any, point: Array, answer: Array, jacobian: Array, h: float) -> bool:
    """Fill the Jacobian and df/dt at the state, for a step; False when the rates jump there."""
    run.count.jacobians += 1
    load(states, point)
    if run.calls.jacobian:
        call(run, run.calls.jacobian, run.clock.time, point, jacobian)
        for i in range(len(states)):
            states[i].drift = jacobian[len(states), i]
        if not run.settings.differences:
            return True
        run.count.rates += run.settings.differences - 1
    # df/dt, by a difference that stays within the step
    t = run.clock.time
    later = min(t + min(h, _SMALL * max(abs(t), h)), run.clock.limit)
    call_rates(run, later, point, answer)
    for i in range(len(states)):
        states[i].drift = (answer[i] - states[i].rates) / (later - t) if later > t else 0.0
    if run.calls.jacobian:
        return True
    return _by_differences(run, states, point, answer, jacobian, h)


@law
def _by_differences(run: Any, states: Any, point: Array, answer: Array, jacobian: Array, h: float) -> bool:
    """Fill the Jacobian by differences; False when the rates jump at this very state."""
    for j in range(len(states)):
        state = states[j]
        size, floor = max(abs(state.x), h * abs(state.rates)), state.atol / run.settings.rtol
        size = max(size, floor if floor < np.inf else 1e-3)
        move = _SMALL * size if state.rates >= 0.0 else -_SMALL * size  # in the direction in which it goes
        state.move = (state.x + move) - state.x
        point[j] = state.x + state.move
        call_rates(run, run.clock.time, point, answer)
        point[j] = state.x
        inverse, worst, culprit = 1.0 / state.move, 0.0, 0
        for i in range(len(states)):
            change = answer[i] - states[i].rates
            jacobian[j, i] = change * inverse
            if abs(change) * h > worst * states[i].tolerance:
                worst, culprit = abs(change) * h / states[i].tolerance, i
        if run.count.jacobians % _LOOK == 1 and worst > _MATTERS and _jumps(run, states, point, answer, j, culprit):
            return False
    return True


@law
def _jumps(run: Any, states: Any, point: Array, answer: Array, j: int, i: int) -> bool:
    """Whether rate i changes by the same, however little state j is moved."""
    x, rate, moved_rate = states[j].x, states[i].rates, answer[i]
    change = moved_rate - rate
    for part in (16.0, 256.0):
        point[j] = x + states[j].move / part
        call_rates(run, run.clock.time, point, answer)
        moved = point[j] != x
        point[j] = x
        if not (moved and abs(answer[i] - rate - change) < 0.1 * abs(change)):
            return False
    run.count.culprit, run.count.argument = i, j
    run.clock.before, run.clock.after = rate, moved_rate
    return True


@law
def factor(jacobian: Array, diagonal: float, factors: Array, pivots: Any) -> None:
    """Lower times upper triangle of a number on the diagonal less the Jacobian, a row exchanged where a pivot is small.

    Both are kept column by column, ``factors[column, row]``, with inverse pivots on the diagonal.
    """
    n = np.uint64(len(pivots))
    for j in range(n):
        pivots[j] = j
        for i in range(n):
            factors[j, i] = -jacobian[j, i]
        factors[j, j] += diagonal
    for k in range(n):
        best, pivot = _DIAGONAL * abs(factors[k, k]), k
        for i in range(k + _ONE, n):
            if abs(factors[k, i]) > best:
                best, pivot = abs(factors[k, i]), i
        if pivot != k:
            pivots[k], pivots[pivot] = pivots[pivot], pivots[k]
            for j in range(n):
                factors[j, k], factors[j, pivot] = factors[j, pivot], factors[j, k]
        factors[k, k] = inverse = 1.0 / factors[k, k]
        for i in range(k + _ONE, n):
            factors[k, i] *= inverse
        for j in range(k + _ONE, n):
            share = factors[j, k]
            if share != 0.0:
                for i in range(k + _ONE, n):
                    factors[j, i] -= factors[k, i] * share


@law
def solve(factors: Array, pivots: Any, goal: Array, room: Array) -> None:
    """Solve with the factors, in place."""
    n = np.uint64(len(pivots))
    for i in range(n):
        room[i] = goal[pivots[i]]
    for j in range(n):
        value = room[j]
        for i in range(j + _ONE, n):
            room[i] -= factors[j, i] * value
    for back in range(n):
        j = n - _ONE - back
        goal[j] = value = room[j] * factors[j, j]
        for i in range(j):
            room[i] -= factors[j, i] * value
