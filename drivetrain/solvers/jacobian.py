"""The Jacobian of a compiled right-hand side: its own, or by differences in groups of columns that share no row."""

from __future__ import annotations

import numpy as np

from drivetrain.jit import law
from drivetrain.solvers.records import Linear, Run
from drivetrain.solvers.step import ask, ask_rates, load

_SMALL = float(np.sqrt(np.finfo(np.float64).eps))
_LOOK = 16  # every so many Jacobians one column that looks too steep is looked at again
_MATTERS = 1e3  # a jump within a step matters when it moves a state by so many tolerances


@law
def fill_jacobian(run: Run, linear: Linear, h: float) -> bool:
    """Fill the Jacobian and df/dt at the state, for a step; False when the rates jump there."""
    states, order, exact = run.states, linear.order, linear.exact
    run.count.jacobians += 1
    load(run)
    if run.calls.jacobian:
        ask(run, run.calls.jacobian, run.clock.time, exact)
        for i in range(len(states)):
            states[i].drift = exact[len(states), i]
            for j in range(len(states)):
                linear.jacobian[i, j] = exact[order[j], order[i]]
        if not run.settings.differences:
            return True
        run.count.rates += run.settings.differences - 1
    # df/dt, by a difference that stays within the step
    t = run.clock.time
    later = min(t + min(h, _SMALL * max(abs(t), h)), run.clock.limit)
    ask_rates(run, later)
    for i in range(len(states)):
        states[i].drift = (run.answer[i] - states[i].rates) / (later - t) if later > t else 0.0
    return run.calls.jacobian != 0 or _by_differences(run, linear, h)


@law
def _by_differences(run: Run, linear: Linear, h: float) -> bool:
    """Fill the Jacobian by differences; False when the rates jump at this very state."""
    states, columns, asked = run.states, linear.columns, run.asked
    for i in range(len(states)):
        size, floor = max(abs(states[i].x), h * abs(states[i].rates)), states[i].atol / run.settings.rtol
        size = max(size, floor if floor < np.inf else 1e-3)
        move = _SMALL * size if states[i].rates >= 0.0 else -_SMALL * size  # in the direction in which it goes
        states[i].move = (states[i].x + move) - states[i].x
    for group in range(len(linear.starts) - 1):
        first, last, worst, steep, culprit = linear.starts[group], linear.starts[group + 1], 0.0, 0, 0
        for k in range(first, last):
            asked[columns[k]] = states[columns[k]].x + states[columns[k]].move
        ask_rates(run, run.clock.time)
        for k in range(first, last):
            j = columns[k]
            inverse = 1.0 / states[j].move
            asked[j] = states[j].x
            for e in range(linear.row_starts[j], linear.row_starts[j + 1]):
                i = linear.row_indices[e]
                change = run.answer[i] - states[i].rates
                linear.jacobian[linear.ranks[i], linear.ranks[j]] = change * inverse
                if abs(change) * h > worst * states[i].tolerance:
                    worst, steep, culprit = abs(change) * h / states[i].tolerance, j, i
        if run.count.jacobians % _LOOK == 1 and worst > _MATTERS and _jumps(run, steep, culprit):
            return False
    return True


@law
def _jumps(run: Run, j: int, i: int) -> bool:
    """Whether rate i changes by the same, however little state j is moved."""
    x, rate, moved_rate = run.states[j].x, run.states[i].rates, run.answer[i]
    change = moved_rate - rate
    for part in (16.0, 256.0):
        run.asked[j] = x + run.states[j].move / part
        ask_rates(run, run.clock.time)
        moved = run.asked[j] != x
        run.asked[j] = x
        if not (moved and abs(run.answer[i] - rate - change) < 0.1 * abs(change)):
            return False
    run.count.culprit, run.count.argument = i, j
    run.clock.before, run.clock.after = rate, moved_rate
    return True
