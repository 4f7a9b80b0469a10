"""One step of any method from its tableau, with its error and the polynomial between its ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import ask_rates
from drivetrain.solvers.linear import factor, solve

_LAST: Any = np.uint64(0)  # the only row of a method's error


@law
def within(states: Any, share: float, asked: Array) -> None:
    """What is asked for is the state at a share of the step, on its polynomial."""
    for i in range(len(states)):
        curve = states[i].curve
        asked[i] = states[i].x + share * (curve[0] + share * (curve[1] + share * (curve[2] + share * curve[3])))


@law
def take_step(
    method: Any, run: Any, states: Any, asked: Array, answer: Array, jacobian: Array, factors: Array, pivots: Any,
    h: float,
) -> None:  # fmt: skip
    """A step from the state with its rates, their drift and the Jacobian; fills next, error, stages and curve."""
    t, implicit, count = run.clock.time, method.gamma > 0.0, method.stages
    if implicit:
        factor(jacobian, 1.0 / (h * method.gamma), factors, pivots)
        run.count.factorisations += 1
    for i in range(len(states)):
        answer[i] = states[i].rates
    for s in range(count):
        if s > 0:
            for i in range(len(states)):
                asked[i] = weighted(states[i].x, 1.0, method.a, s, states[i].stages, s)
            ask_rates(run, t + method.times[s] * h, asked, answer)
        if implicit:
            slope, over = h * method.gammas[s], 1.0 / h
            for i in range(len(states)):
                answer[i] = weighted(answer[i], over, method.c, s, states[i].stages, s) + slope * states[i].drift
            solve(factors, pivots, answer, asked)
            for i in range(len(states)):
                states[i].stages[s] = answer[i]
        else:
            for i in range(len(states)):
                states[i].stages[s], states[i].next_rates = h * answer[i], answer[i]
    for i in range(len(states)):
        state = states[i]
        state.next = weighted(state.x, 1.0, method.a, count, state.stages, count)
        state.error = weighted(0.0, 1.0, method.error, _LAST, state.stages, count)
        rise = state.next - state.x
        for k in range(len(state.curve)):
            state.curve[k] = weighted(rise if k == 0 else 0.0, 1.0, method.curve, k, state.stages, count)


@law
def weighted(total: float, scale: float, table: Array, row: int, stages: Array, count: int) -> float:
    """A number and the first stages of one state, with the scaled weights in a row of a table."""
    for s in range(count):
        total += (scale * table[row, s]) * stages[s]
    return total
