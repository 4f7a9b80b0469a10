"""The Jacobian, and LU factorisation and solution of the linear systems of an implicit step.

A problem provides its own Jacobian, or the Jacobian is computed by finite differences. It is stored column by column,
``jacobian[state, rate]``, (n + 1, n), with the derivatives by time in the last column.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call, call_rates, load_state

_PIVOT_THRESHOLD = 10.0  # rows are exchanged only for an entry this many times larger than the diagonal
# Unsigned indices: for signed ones numba generates a test whether they count from the end.
_ONE: Any = np.uint64(1)
_SQRT_EPSILON = float(np.sqrt(np.finfo(np.float64).eps))  # relative increment of finite differences
_JUMP_TEST_EVERY = 16  # in one of this many Jacobians suspiciously steep columns are tested for a discontinuity
_STEEP = 1e3  # change of a state within a step, in tolerances, above which a column counts as steep


@law
def fill_jacobian(run: Any, states: Any, point: Array, result: Array, jacobian: Array, h: float) -> bool:
    """Compute the Jacobian and df/dt at the current state, for a step of length h [s].

    Returns False when the rates are found to be discontinuous there; count and clock then say which rate and state.
    """
    run.count.jacobians += 1
    load_state(states, point)
    if run.calls.jacobian:
        call(run, run.calls.jacobian, run.clock.time, point, jacobian)
        for i in range(len(states)):
            states[i].time_derivative = jacobian[len(states), i]
        if not run.settings.differences:
            return True
        run.count.rates += run.settings.differences - 1
    # df/dt by a forward difference that stays within the step and the segment
    t = run.clock.time
    t_next = min(t + min(h, _SQRT_EPSILON * max(abs(t), h)), run.clock.limit)
    call_rates(run, t_next, point, result)
    for i in range(len(states)):
        states[i].time_derivative = (result[i] - states[i].rates) / (t_next - t) if t_next > t else 0.0
    if run.calls.jacobian:
        return True
    return _finite_differences(run, states, point, result, jacobian, h)


@law
def _finite_differences(run: Any, states: Any, point: Array, result: Array, jacobian: Array, h: float) -> bool:
    """Compute the Jacobian by forward differences; False when the rates are discontinuous at this state."""
    for j in range(len(states)):
        state = states[j]
        size, floor = max(abs(state.x), h * abs(state.rates)), state.atol / run.settings.rtol
        size = max(size, floor if floor < np.inf else 1e-3)
        # in the direction in which the state moves
        increment = _SQRT_EPSILON * size if state.rates >= 0.0 else -_SQRT_EPSILON * size
        state.increment = (state.x + increment) - state.x
        point[j] = state.x + state.increment
        call_rates(run, run.clock.time, point, result)
        point[j] = state.x
        inverse, worst, steepest = 1.0 / state.increment, 0.0, 0
        for i in range(len(states)):
            change = result[i] - states[i].rates
            jacobian[j, i] = change * inverse
            if abs(change) * h > worst * states[i].tolerance:
                worst, steepest = abs(change) * h / states[i].tolerance, i
        if (
            run.count.jacobians % _JUMP_TEST_EVERY == 1
            and worst > _STEEP
            and _is_discontinuous(run, states, point, result, j, steepest)
        ):
            return False
    return True


@law
def _is_discontinuous(run: Any, states: Any, point: Array, result: Array, j: int, i: int) -> bool:
    """Whether rate i is discontinuous in state j: its change stays the same when the increment gets smaller."""
    x, rate, moved_rate = states[j].x, states[i].rates, result[i]
    change = moved_rate - rate
    for part in (16.0, 256.0):
        point[j] = x + states[j].increment / part
        call_rates(run, run.clock.time, point, result)
        moved = point[j] != x
        point[j] = x
        if not (moved and abs(result[i] - rate - change) < 0.1 * abs(change)):
            return False
    run.count.fault_index, run.count.jump_state = i, j
    run.clock.before, run.clock.after = rate, moved_rate
    return True


@law
def factor(jacobian: Array, diagonal: float, factors: Array, pivots: Any) -> None:
    """LU factorisation of ``diagonal`` times the identity minus the Jacobian, with threshold row pivoting.

    Both triangles are stored column by column in ``factors[column, row]``, (n, n), with inverse pivots on the diagonal;
    ``pivots`` is the row permutation, (n,).
    """
    n = np.uint64(len(pivots))
    for j in range(n):
        pivots[j] = j
        for i in range(n):
            factors[j, i] = -jacobian[j, i]
        factors[j, j] += diagonal
    for k in range(n):
        best, pivot = _PIVOT_THRESHOLD * abs(factors[k, k]), k
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
def solve(factors: Array, pivots: Any, rhs: Array, scratch: Array) -> None:
    """Solve the factorised system in place: ``rhs`` holds the right-hand side, then the solution, (n,)."""
    n = np.uint64(len(pivots))
    for i in range(n):
        scratch[i] = rhs[pivots[i]]
    for j in range(n):
        value = scratch[j]
        for i in range(j + _ONE, n):
            scratch[i] -= factors[j, i] * value
    for back in range(n):
        j = n - _ONE - back
        rhs[j] = value = scratch[j] * factors[j, j]
        for i in range(j):
            scratch[i] -= factors[j, i] * value
