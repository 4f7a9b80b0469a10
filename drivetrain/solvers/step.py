"""One step of a method given by its tableau, its error estimate, and the control of the step size."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call_rates
from drivetrain.solvers.linear import factor, solve
from drivetrain.solvers.records import DIVERGES, DONE, JUMP, STEP_TOO_SHORT

_EPSILON = float(np.finfo(np.float64).eps)
_SMALLEST_STEP = 1e-100  # smallest step near t = 0 [s]
# Safety factor, smallest and largest factor between two steps, largest factor after a rejected step.
_SAFETY, _MIN_FACTOR, _MAX_FACTOR, _MAX_AFTER_REJECTION = 0.85, 0.1, 6.0, 2.0
_SEEK_AFTER, _SEEK_EVERY = 3, 10  # rejections in a row, and in total, after which a discontinuity is sought
# Discontinuities closer together than this many rejected steps form a sequence; the run stops when it is longer than
# this, since the state then returns to the discontinuity again and again.
_SEQUENCE_STEPS, _LONGEST_SEQUENCE = 100.0, 12
_BISECTIONS = 52  # bisections of a step, down to rounding
_CONTINUOUS = 0.05  # a rate whose change falls below this share during the bisection is continuous
_STRETCH = 1.1  # if the rest of the segment is shorter than this many steps, one step goes to its end
_ERROR_ROW: Any = np.uint64(0)  # index of the only row of the error weights


@law
def dense_output(states: Any, share: float, point: Array) -> None:
    """Put the state at a share of the step, from 0 to 1, into ``point``: the dense output."""
    for i in range(len(states)):
        curve = states[i].curve
        point[i] = states[i].x + share * (curve[0] + share * (curve[1] + share * (curve[2] + share * curve[3])))


@law
def take_step(
    method: Any, run: Any, states: Any, point: Array, result: Array, jacobian: Array, factors: Array, pivots: Any,
    h: float,
) -> None:  # fmt: skip
    """Compute one step of length h [s] from the current state, its rates, their time derivative and the Jacobian.

    Fills ``next``, ``next_rates``, ``error``, ``stages`` and the dense output of each state; the current state stays.
    """
    t, implicit, count = run.clock.time, method.gamma > 0.0, method.stages
    if implicit:
        factor(jacobian, 1.0 / (h * method.gamma), factors, pivots)
        run.count.factorisations += 1
    for i in range(len(states)):
        result[i] = states[i].rates
    for s in range(count):
        if s > 0:
            for i in range(len(states)):
                point[i] = weighted_sum(states[i].x, 1.0, method.a, s, states[i].stages, s)
            call_rates(run, t + method.times[s] * h, point, result)
        if implicit:
            slope, over = h * method.gammas[s], 1.0 / h
            for i in range(len(states)):
                result[i] = (
                    weighted_sum(result[i], over, method.c, s, states[i].stages, s) + slope * states[i].time_derivative
                )
            solve(factors, pivots, result, point)
            for i in range(len(states)):
                states[i].stages[s] = result[i]
        else:
            for i in range(len(states)):
                states[i].stages[s], states[i].next_rates = h * result[i], result[i]
    for i in range(len(states)):
        state = states[i]
        state.next = weighted_sum(state.x, 1.0, method.a, count, state.stages, count)
        state.error = weighted_sum(0.0, 1.0, method.error, _ERROR_ROW, state.stages, count)
        rise = state.next - state.x
        for k in range(len(state.curve)):
            state.curve[k] = weighted_sum(rise if k == 0 else 0.0, 1.0, method.curve, k, state.stages, count)


@law
def weighted_sum(total: float, scale: float, table: Array, row: int, stages: Array, count: int) -> float:
    """``total`` plus the first ``count`` stages of one state, weighted with a scaled row of a tableau."""
    for s in range(count):
        total += (scale * table[row, s]) * stages[s]
    return total


@law
def largest_error(run: Any, states: Any) -> float:
    """The largest error of all states over its tolerance: at most 1 is acceptable, infinite when a value is not finite.

    ``count.fault_index`` is the index of that state.
    """
    worst = 0.0
    for i in range(len(states)):
        state = states[i]
        allowed = state.atol + run.settings.rtol * max(abs(state.x), abs(state.next))
        error = abs(state.error) / allowed
        if not (error < np.inf and np.isfinite(state.next)):
            run.count.fault_index = i
            return np.inf
        if error > worst:
            worst = error
            run.count.fault_index = i
    return worst


@law
def first_step(run: Any, states: Any, point: Array, result: Array, end: float) -> float:
    """Length of the first step of an adaptive method [s], in a segment that ends at ``end`` [s].

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
    call_rates(run, run.clock.time + h, point, result)
    for i in range(len(states)):
        curve = max(curve, abs(result[i] - states[i].rates) / states[i].tolerance / h)
    steepest = max(slope, curve)
    second = max(1e-6, 1e-3 * h) if not 1e-15 < steepest < np.inf else (0.01 / steepest) ** 0.25
    return min(100.0 * h, second)


@law
def choose_step(adaptive: int, run: Any, end: float) -> float:
    """Length of the next step to attempt [s]; the end of the segment is met without a tiny last step."""
    clock, fixed = run.clock, run.settings.fixed_step
    left = end - clock.time
    if not adaptive:
        # Times are multiples of the step, not sums: a million additions would lose five digits.
        t_next = clock.origin + (run.count.fixed_steps + 1) * fixed
        return left if t_next >= end - 1e-9 * fixed else t_next - clock.time
    h = min(clock.step, run.settings.largest_step)
    if _STRETCH * h >= left:
        return left
    return 0.5 * left if 2.0 * h > left else h


@law
def growth_limit(jacobian: Array) -> float:
    """Longest step that still resolves the fastest growing state [s], from the diagonal of the Jacobian.

    With longer steps an L-stable method damps a state that truly grows, just as it damps a stiff one, and its error
    estimate is meaningless.
    """
    fastest = 0.0
    for i in range(jacobian.shape[1]):
        fastest = max(fastest, jacobian[i, i])
    return 1.0 / fastest if fastest > 0.0 else np.inf


@law
def propose_step(order: float, run: Any, h: float, error: float) -> None:
    """After an accepted step of length h [s]: propose the next one, from the error over its tolerance.

    PI control: the factor also takes into account how the error has changed since the step before.
    """
    clock, power, small = run.clock, 1.0 / order, max(error, 1e-10)
    factor = _SAFETY / small**power
    if clock.last_step > 0.0:
        trend = (clock.last_error / (small * small)) ** power
        factor = min(factor, _SAFETY * (h / clock.last_step) * trend)
    factor = min(max(factor, 0.2), _MAX_AFTER_REJECTION if run.count.was_rejected else _MAX_FACTOR)
    # A step shortened by the end of the segment says little: keep the longer proposal unless the error was too large.
    clock.step = max(clock.step, h * factor) if h < clock.step and factor >= 1.0 else h * factor
    clock.last_step, clock.last_error = h, max(error, 1e-2)
    run.count.was_rejected, run.count.failures = 0, 0


@law
def reject_step(run: Any, states: Any, point: Array, result: Array, h: float, error: float) -> int:
    """After a rejected step of length h [s]: propose a shorter one, or return the code for why there is none.

    Repeated rejections may come from a discontinuity of the rates, which is then sought.
    """
    clock, count = run.clock, run.count
    count.rejected += 1
    count.failures += 1
    count.was_rejected = 1
    clock.step = h * (max(_MIN_FACTOR, _SAFETY / math.sqrt(math.sqrt(error))) if error < np.inf else _MIN_FACTOR)
    clock.rejected_step = h
    ends = clock.step < max(run.settings.smallest_step, 4.0 * _EPSILON * abs(clock.time), _SMALLEST_STEP)
    if error < np.inf:
        suspect = count.failures == _SEEK_AFTER or count.rejected % _SEEK_EVERY == 0 or ends
        if suspect and _jump_ends_run(run, states, point, result):
            return JUMP
        return STEP_TOO_SHORT if ends else DONE
    if ends:
        fastest = -1.0
        for i in range(len(states)):
            if abs(states[i].rates) / states[i].tolerance > fastest:
                fastest, count.fault_index = abs(states[i].rates) / states[i].tolerance, i
        return DIVERGES
    return DONE


@law
def _jump_ends_run(run: Any, states: Any, point: Array, result: Array) -> bool:
    """Whether a discontinuity of the rates within the rejected step must end the run.

    If the problem allows discontinuities, those that the state crosses and leaves behind are passed with short steps; a
    long sequence of them close together ends the run. Clock and count then say which rate jumps, where and by how much.
    """
    clock, count = run.clock, run.count
    inexact = count.fault_index
    if not _find_jump(run, states, point, result):
        return False
    if run.settings.may_jump:
        count.jumps = count.jumps + 1 if clock.time - clock.last_jump <= _SEQUENCE_STEPS * clock.rejected_step else 0
        clock.last_jump = clock.time
        if count.jumps <= _LONGEST_SEQUENCE:
            count.fault_index = inexact
            return False
    return True


@law
def _find_jump(run: Any, states: Any, point: Array, result: Array) -> bool:
    """Search the rejected step for a discontinuity: bisect the interval in which a rate changes most.

    The change of a continuous rate, however steep, shrinks with the interval; that of a discontinuous one does not.
    """
    clock, h, n = run.clock, run.clock.rejected_step, len(states)
    _rates_between(run, states, 0.0, point, result)
    for j in range(n):
        states[j].next_rates = result[j]
    _rates_between(run, states, 1.0, point, result)
    worst, i = 0.0, -1
    for j in range(n):
        change = h * abs(result[j] - states[j].next_rates) / states[j].tolerance
        if change > worst:
            worst, i = change, j
    if i < 0 or not worst < np.inf:
        return False
    low, high, left, right = 0.0, 1.0, states[i].next_rates, result[i]
    whole = abs(right - left)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        _rates_between(run, states, middle, point, result)
        if abs(result[i] - left) >= abs(right - result[i]):
            high, right = middle, result[i]
        else:
            low, left = middle, result[i]
        if abs(right - left) < _CONTINUOUS * whole:
            return False
    run.count.fault_index, run.count.jump_state = i, -1
    clock.before, clock.after, clock.jump_at = left, right, clock.time + high * h
    _rates_between(run, states, low, point, result)
    before = result[i]
    for j in range(n):
        kept = point[j]
        point[j] = states[j].x + high * (states[j].next - states[j].x)
        if point[j] != kept:
            call_rates(run, clock.time + low * h, point, result)
            if abs(result[i] - before) > 0.5 * abs(right - left):
                run.count.jump_state = j
                return True
        point[j] = kept
    return True


@law
def _rates_between(run: Any, states: Any, share: float, point: Array, result: Array) -> None:
    """Evaluate the rates at a share of the straight line from the current state to the end of the rejected step."""
    for j in range(len(states)):
        point[j] = states[j].x + share * (states[j].next - states[j].x)
    call_rates(run, run.clock.time + share * run.clock.rejected_step, point, result)
