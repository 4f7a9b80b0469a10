"""One step of any method from its tableau, and how long it may be: its error, the next one, when there is none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call_rates
from drivetrain.solvers.linear import factor, solve
from drivetrain.solvers.records import DONE, JUMP, RUNS_AWAY, TOO_SHORT

_EPSILON = float(np.finfo(np.float64).eps)
_TINY = 1e-100  # [s]
_SAFETY, _SHRINK, _GROW, _CAREFUL = 0.85, 0.1, 6.0, 2.0  # the last for a step after one refused
_SUSPECT, _OFTEN = 3, 10  # refusals in a row, and refusals at all, after which a jump is looked for
_NEAR, _MOST_JUMPS = 100.0, 12  # jumps found within so many steps of one another, and how many of them
_HALVINGS = 52
_SMOOTH = 0.05  # a change that has shrunk to this share shrinks with the interval: no jump
_ARRIVES = 1.1  # a step that would leave less than this much of itself is stretched to the end
_LAST: Any = np.uint64(0)  # the only row of a method's error


@law
def within(states: Any, share: float, point: Array) -> None:
    """What is asked for is the state at a share of the step, on its polynomial."""
    for i in range(len(states)):
        curve = states[i].curve
        point[i] = states[i].x + share * (curve[0] + share * (curve[1] + share * (curve[2] + share * curve[3])))


@law
def take_step(
    method: Any, run: Any, states: Any, point: Array, answer: Array, jacobian: Array, factors: Array, pivots: Any,
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
                point[i] = weighted(states[i].x, 1.0, method.a, s, states[i].stages, s)
            call_rates(run, t + method.times[s] * h, point, answer)
        if implicit:
            slope, over = h * method.gammas[s], 1.0 / h
            for i in range(len(states)):
                answer[i] = weighted(answer[i], over, method.c, s, states[i].stages, s) + slope * states[i].drift
            solve(factors, pivots, answer, point)
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


@law
def largest_error(run: Any, states: Any) -> float:
    """The largest error in units of its tolerance, 1 is just allowed; infinite when anything is no number.

    ``count.culprit`` is the state that has it.
    """
    worst = 0.0
    for i in range(len(states)):
        state = states[i]
        allowed = state.atol + run.settings.rtol * max(abs(state.x), abs(state.next))
        error = abs(state.error) / allowed
        if not (error < np.inf and np.isfinite(state.next)):
            run.count.culprit = i
            return np.inf
        if error > worst:
            worst = error
            run.count.culprit = i
    return worst


@law
def first_step(run: Any, states: Any, point: Array, answer: Array, end: float) -> float:
    """A first step for an adaptive method, in a segment that ends there [s].

    Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section II.4.
    """
    if run.settings.first_step > 0.0:
        return run.settings.first_step
    size, slope, curve = 0.0, 0.0, 0.0
    for i in range(len(states)):
        size = max(size, abs(states[i].x) / states[i].tolerance)
        slope = max(slope, abs(states[i].rates) / states[i].tolerance)
    h = 1e-6 if size < 1e-5 or slope < 1e-5 else 0.01 * size / slope
    h = min(h, run.settings.largest_step, end - run.clock.time)
    for i in range(len(states)):
        point[i] = states[i].x + h * states[i].rates
    call_rates(run, run.clock.time + h, point, answer)
    for i in range(len(states)):
        curve = max(curve, abs(answer[i] - states[i].rates) / states[i].tolerance / h)
    steepest = max(slope, curve)
    later = max(1e-6, 1e-3 * h) if not 1e-15 < steepest < np.inf else (0.01 / steepest) ** 0.25
    return min(100.0 * h, later)


@law
def choose(adaptive: int, run: Any, end: float) -> float:
    """The step to try, so that the end of the segment is met and no tiny step is left before it [s]."""
    clock, fixed = run.clock, run.settings.fixed_step
    left = end - clock.time
    if not adaptive:
        # Multiples of the step, not sums: a million additions lose five digits of the time.
        later = clock.origin + (run.count.strides + 1) * fixed
        return left if later >= end - 1e-9 * fixed else later - clock.time
    h = min(clock.step, run.settings.largest_step)
    if _ARRIVES * h >= left:
        return left
    return 0.5 * left if 2.0 * h > left else h


@law
def growing(jacobian: Array) -> float:
    """The longest step that sees a state grow by itself [s].

    An L-stable method damps what is stiff, also what truly runs away: its error is meaningless then.
    """
    fastest = 0.0
    for i in range(jacobian.shape[1]):
        fastest = max(fastest, jacobian[i, i])
    return 1.0 / fastest if fastest > 0.0 else np.inf


@law
def propose(order: float, run: Any, h: float, error: float) -> None:
    """The step proposed after one that was kept, with its error in units of what is allowed."""
    clock, power, small = run.clock, 1.0 / order, max(error, 1e-10)
    factor = _SAFETY / small**power
    if clock.last_step > 0.0:
        trend = (clock.last_error / (small * small)) ** power
        factor = min(factor, _SAFETY * (h / clock.last_step) * trend)
    factor = min(max(factor, 0.2), _CAREFUL if run.count.was_rejected else _GROW)
    # A step cut short by the end of a segment means little: keep what was proposed unless the error asks for less.
    clock.step = max(clock.step, h * factor) if h < clock.step and factor >= 1.0 else h * factor
    clock.last_step, clock.last_error = h, max(error, 1e-2)
    run.count.was_rejected, run.count.failures = 0, 0


@law
def refuse(run: Any, states: Any, point: Array, answer: Array, h: float, error: float) -> int:
    """A step is refused: propose a shorter one, or say why there can be none."""
    clock, count = run.clock, run.count
    count.rejected += 1
    count.failures += 1
    count.was_rejected = 1
    clock.step = h * (max(_SHRINK, _SAFETY / math.sqrt(math.sqrt(error))) if error < np.inf else _SHRINK)
    clock.refused = h
    ends = clock.step < max(run.settings.smallest_step, 4.0 * _EPSILON * abs(clock.time), _TINY)
    if error < np.inf:
        suspect = count.failures == _SUSPECT or count.rejected % _OFTEN == 0 or ends
        if suspect and _jump_stays(run, states, point, answer):
            return JUMP
        return TOO_SHORT if ends else DONE
    if ends:
        fastest = -1.0
        for i in range(len(states)):
            if abs(states[i].rates) / states[i].tolerance > fastest:
                fastest, count.culprit = abs(states[i].rates) / states[i].tolerance, i
        return RUNS_AWAY
    return DONE


@law
def _jump_stays(run: Any, states: Any, point: Array, answer: Array) -> bool:
    """Whether a rate jumps within the step just refused, and the state does not just pass the jump and leave it behind.

    Those that it passes are passed with short steps, if the problem allows it. Clock and count say which rate jumps,
    where and by how much.
    """
    clock, count = run.clock, run.count
    inexact = count.culprit
    if not _find_jump(run, states, point, answer):
        return False
    if run.settings.may_jump:
        count.jumps = count.jumps + 1 if clock.time - clock.last_jump <= _NEAR * clock.refused else 0
        clock.last_jump = clock.time
        if count.jumps <= _MOST_JUMPS:
            count.culprit = inexact
            return False
    return True


@law
def _find_jump(run: Any, states: Any, point: Array, answer: Array) -> bool:
    """Halve the interval in which a rate changes most until it is empty.

    A continuous rate, however steep, changes less and less; one that jumps does not.
    """
    clock, h, n = run.clock, run.clock.refused, len(states)
    _rates_between(run, states, 0.0, point, answer)
    for j in range(n):
        states[j].next_rates = answer[j]
    _rates_between(run, states, 1.0, point, answer)
    worst, i = 0.0, -1
    for j in range(n):
        change = h * abs(answer[j] - states[j].next_rates) / states[j].tolerance
        if change > worst:
            worst, i = change, j
    if i < 0 or not worst < np.inf:
        return False
    low, high, left, right = 0.0, 1.0, states[i].next_rates, answer[i]
    whole = abs(right - left)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        _rates_between(run, states, middle, point, answer)
        if abs(answer[i] - left) >= abs(right - answer[i]):
            high, right = middle, answer[i]
        else:
            low, left = middle, answer[i]
        if abs(right - left) < _SMOOTH * whole:
            return False
    run.count.culprit, run.count.argument = i, -1
    clock.before, clock.after, clock.jump_at = left, right, clock.time + high * h
    _rates_between(run, states, low, point, answer)
    before = answer[i]
    for j in range(n):
        kept = point[j]
        point[j] = states[j].x + high * (states[j].next - states[j].x)
        if point[j] != kept:
            call_rates(run, clock.time + low * h, point, answer)
            if abs(answer[i] - before) > 0.5 * abs(right - left):
                run.count.argument = j
                return True
        point[j] = kept
    return True


@law
def _rates_between(run: Any, states: Any, share: float, point: Array, answer: Array) -> None:
    """The rates at a share of the straight line from the state to the end of the step refused."""
    for j in range(len(states)):
        point[j] = states[j].x + share * (states[j].next - states[j].x)
    call_rates(run, run.clock.time + share * run.clock.refused, point, answer)
