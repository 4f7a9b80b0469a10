"""One step of any method from its tableau, with its error and the polynomial between its ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.call_address import call_address
from drivetrain.jit import law
from drivetrain.solvers.records import Linear, Run
from drivetrain.solvers.tableaux import Tableau

# Indices without a sign: numba asks of others whether they count from the end.
_NONE: Any = np.uint64(0)
_ONE: Any = np.uint64(1)
_DIAGONAL = 10.0  # so many times smaller than another entry a diagonal may be and stay the pivot


@law
def ask(run: Run, function: int, t: float, result: Array) -> None:
    """Call a function of the problem at an instant and the state ``asked``."""
    calls = run.calls
    call_address(function, (t, run.asked.ctypes.data, result.ctypes.data, calls.numbers, calls.words))


@law
def ask_rates(run: Run, t: float) -> None:
    """The right-hand side at the state ``asked``, counted; never beyond what the segment may see."""
    ask(run, run.calls.rates, min(t, run.clock.limit), run.answer)
    run.count.rates += 1


@law
def ask_here(run: Run, function: int, result: Array) -> None:
    """Call a function of the problem here and now; it may change the state."""
    load(run)
    ask(run, function, run.clock.time, result)
    for i in range(len(run.asked)):
        run.states[i].x = run.asked[i]


@law
def load(run: Run) -> None:
    """What is asked for is the state now."""
    for i in range(len(run.asked)):
        run.asked[i] = run.states[i].x


@law
def within(run: Run, share: float) -> None:
    """What is asked for is the state at a share of the step, on its polynomial."""
    curve = run.curve
    for i in range(len(run.asked)):
        bend = curve[i, 1] + share * (curve[i, 2] + share * curve[i, 3])
        run.asked[i] = run.states[i].x + share * (curve[i, 0] + share * bend)


@law
def take_step(tableau: Tableau, run: Run, linear: Linear, h: float) -> None:
    """A step from the state with its rates, their drift and the Jacobian; fills next, error, stages and curve."""
    t, states, stages, asked, answer = run.clock.time, run.states, run.stages, run.asked, run.answer
    matrix, rows, places, lower, filled = linear.factors, linear.rows, linear.places, linear.lower, linear.filled
    solved, order, implicit = linear.solved, linear.order, tableau.gamma > 0.0
    n, count = np.uint64(len(asked)), np.uint64(len(tableau.times))
    if implicit:
        factor(linear.jacobian, 1.0 / (h * tableau.gamma), matrix, rows, places, lower, filled, order)
        run.count.factorisations += 1
    for i in range(n):
        answer[i] = states[i].rates
    for s in range(count):
        if s > 0:
            for i in range(n):
                asked[i] = weighted(states[i].x, 1.0, tableau.a, s, stages, i, s)
            ask_rates(run, t + tableau.times[s] * h)
        if implicit:
            slope, over = h * tableau.gammas[s], 1.0 / h
            for i in range(n):
                answer[i] = weighted(answer[i], over, tableau.c, s, stages, i, s) + slope * states[i].drift
            solve(matrix, rows, places, lower, filled, order, solved, answer)
            for i in range(n):
                stages[i, s] = answer[i]
        else:
            for i in range(n):
                stages[i, s], states[i].next_rates = h * answer[i], answer[i]
    for i in range(n):
        states[i].next = weighted(states[i].x, 1.0, tableau.a, count, stages, i, count)
        states[i].error = weighted(0.0, 1.0, tableau.error, _NONE, stages, i, count)
        rise = states[i].next - states[i].x
        for k in range(np.uint64(4)):
            run.curve[i, k] = weighted(rise if k == _NONE else 0.0, 1.0, tableau.curve, k, stages, i, count)


@law
def weighted(total: float, scale: float, table: Array, row: int, stages: Array, i: int, count: int) -> float:
    """A number and the first stages of one state, with the scaled weights in a row of a table."""
    for s in range(count):
        total += (scale * table[row, s]) * stages[i, s]
    return total


@law
def factor(
    jacobian: Array, diagonal: float, matrix: Array, rows: Any, places: Any, lower: Any, filled: Any, order: Any
) -> None:
    """Lower times upper triangle of a number on the diagonal less the Jacobian, a row exchanged where a pivot is small.

    The order of elimination leaves most entries zero: what is not is listed, a row of places after the other.
    """
    n = np.uint64(len(rows))
    for i in range(n):
        rows[i] = order[i]
        for j in range(n):
            matrix[i, j] = -jacobian[i, j]
        matrix[i, i] += diagonal
    for k in range(n):
        best, pivot = _DIAGONAL * abs(matrix[k, k]), k
        for i in range(k + _ONE, n):
            if abs(matrix[i, k]) > best:
                best, pivot = abs(matrix[i, k]), i
        if pivot != k:
            rows[k], rows[pivot] = rows[pivot], rows[k]
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        matrix[k, k] = 1.0 / matrix[k, k]
        for i in range(k + _ONE, n):
            if matrix[i, k] != 0.0:
                share = matrix[i, k] * matrix[k, k]
                matrix[i, k] = share
                for j in range(k + _ONE, n):
                    matrix[i, j] -= share * matrix[k, j]
    for i in range(n):
        found = _NONE
        for j in range(n):
            if j == i:
                lower[i] = found
            elif matrix[i, j] != 0.0:
                places[i, found] = j
                found += _ONE
        filled[i] = found


@law
def solve(
    matrix: Array, rows: Any, places: Any, lower: Any, filled: Any, order: Any, solved: Array, goal: Array
) -> None:
    """Solve with the factors, in place."""
    n = np.uint64(len(goal))
    for i in range(n):
        value = goal[rows[i]]
        for e in range(lower[i]):
            j = places[i, e]
            value -= matrix[i, j] * solved[j]
        solved[i] = value
    for back in range(n):
        i = n - _ONE - back
        value = solved[i]
        for e in range(lower[i], filled[i]):
            j = places[i, filled[i] + lower[i] - _ONE - e]
            value -= matrix[i, j] * solved[j]
        solved[i] = value * matrix[i, i]
    for i in range(n):
        goal[order[i]] = solved[i]
