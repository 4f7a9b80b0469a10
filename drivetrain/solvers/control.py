"""How long a step may be: its error, the next one, the first one, and when there is none any more."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.jit import law
from drivetrain.solvers.records import DONE, RUNS_AWAY, SUSPECT, Run
from drivetrain.solvers.step import ask_rates

_EPSILON = float(np.finfo(np.float64).eps)
_TINY = 1e-100  # [s]
_SAFETY, _SHRINK, _GROW, _CAREFUL = 0.85, 0.1, 6.0, 2.0  # the last for a step after one refused
_SUSPECT, _OFTEN = 3, 10  # refusals in a row, and refusals at all, after which a jump is looked for
_ARRIVES = 1.1  # a step that would leave less than this much of itself is stretched to the end


@law
def largest_error(run: Run) -> float:
    """The largest error in units of its tolerance, 1 is just allowed; infinite when anything is no number.

    ``count.culprit`` is the state that has it.
    """
    worst = 0.0
    for i in range(len(run.states)):
        state = run.states[i]
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
def first_step(run: Run, end: float) -> float:
    """A first step for an adaptive method, in a segment that ends there [s].

    Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section II.4.
    """
    if run.settings.first_step > 0.0:
        return run.settings.first_step
    states, size, slope, curve = run.states, 0.0, 0.0, 0.0
    for i in range(len(states)):
        size = max(size, abs(states[i].x) / states[i].tolerance)
        slope = max(slope, abs(states[i].rates) / states[i].tolerance)
    h = 1e-6 if size < 1e-5 or slope < 1e-5 else 0.01 * size / slope
    h = min(h, run.settings.largest_step, end - run.clock.time)
    for i in range(len(states)):
        run.asked[i] = states[i].x + h * states[i].rates
    ask_rates(run, run.clock.time + h)
    for i in range(len(states)):
        curve = max(curve, abs(run.answer[i] - states[i].rates) / states[i].tolerance / h)
    steepest = max(slope, curve)
    later = max(1e-6, 1e-3 * h) if not 1e-15 < steepest < np.inf else (0.01 / steepest) ** 0.25
    return min(100.0 * h, later)


@law
def choose(adaptive: bool, run: Run, end: float) -> float:
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
def propose(order: float, run: Run, h: float, error: float) -> None:
    """The step proposed after one that was kept, with its error in units of what is allowed."""
    clock, power, small = run.clock, 1.0 / order, max(error, 1e-10)
    factor = _SAFETY / small**power
    if clock.last_step > 0.0:
        trend = (clock.last_error / (small * small)) ** power
        factor = min(factor, _SAFETY * (h / clock.last_step) * trend)
    factor = min(max(factor, 0.2), _CAREFUL if run.count.was_rejected else _GROW)
    # A step cut short by the end of a segment says little: keep what was proposed unless the error asks for less.
    clock.step = max(clock.step, h * factor) if h < clock.step and factor >= 1.0 else h * factor
    clock.last_step, clock.last_error = h, max(error, 1e-2)
    run.count.was_rejected, run.count.failures = 0, 0


@law
def refuse(run: Run, h: float, error: float) -> int:
    """A step is refused: propose a shorter one, or say why there can be none; SUSPECT: the rates may jump in it."""
    clock, count = run.clock, run.count
    count.rejected += 1
    count.failures += 1
    count.was_rejected = 1
    clock.step = h * (max(_SHRINK, _SAFETY / math.sqrt(math.sqrt(error))) if error < np.inf else _SHRINK)
    clock.refused = h
    ends = clock.step < max(run.settings.smallest_step, 4.0 * _EPSILON * abs(clock.time), _TINY)
    if error < np.inf:
        count.ends = ends
        return SUSPECT if count.failures == _SUSPECT or count.rejected % _OFTEN == 0 or ends else DONE
    if ends:
        fastest = -1.0
        for i in range(len(run.states)):
            if abs(run.states[i].rates) / run.states[i].tolerance > fastest:
                fastest, count.culprit = abs(run.states[i].rates) / run.states[i].tolerance, i
        return RUNS_AWAY
    return DONE
