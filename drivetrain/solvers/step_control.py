"""How long a step may be: the error of one tried, the next one, the first one, and when there is none any more."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_guard import find_jump
from drivetrain.solvers.compiled_steps import rates
from drivetrain.solvers.layout import (
    CULPRIT,
    DONE,
    ERROR,
    F0,
    F1,
    FAILURES,
    FIRST,
    FIXED,
    JUMP,
    JUMPS,
    LARGEST,
    LAST_ERROR,
    LAST_JUMP,
    LAST_STEP,
    LIMIT,
    MAY_JUMP,
    NEXT,
    ORIGIN,
    REJECTED,
    RODAS4,
    RUNGE_KUTTA,
    RUNS_AWAY,
    SMALLEST,
    STAGE,
    STEP,
    STRIDES,
    TIME,
    TOLERANCE,
    TOO_SHORT,
    WAS_REJECTED,
    X,
)

_EPSILON = float(np.finfo(np.float64).eps)
_TINY = 1e-100  # [s]
_SAFETY, _SHRINK, _GROW, _CAREFUL = 0.85, 0.1, 6.0, 2.0  # the last for a step after one refused
_SUSPECT, _OFTEN = 3, 10  # refusals in a row, and refusals at all, after which a jump is looked for
_NEAR, _MOST_JUMPS = 100.0, 12  # jumps found within so many steps of one another, and how many of them
_ARRIVES = 1.1  # a step that would leave less than this much of itself is stretched to the end


@law
def largest_error(block: Array, atol: Array, rtol: float, count: Any) -> float:
    """The largest error in units of its tolerance; infinite when anything is no number.

    Args:
        rtol: Share of the state allowed [-].

    Returns:
        1 is just allowed; count[CULPRIT] is the state.
    """
    worst = 0.0
    for i in range(block.shape[1]):
        allowed = atol[i] + rtol * max(abs(block[X, i]), abs(block[NEXT, i]))
        error = abs(block[ERROR, i]) / allowed
        if not (error < np.inf and np.isfinite(block[NEXT, i])):
            count[CULPRIT] = i
            return np.inf
        if error > worst:
            worst = error
            count[CULPRIT] = i
    return worst


@law
def first_step(address: int, settings: Array, block: Array, end: float, data: Any, clock: Array, count: Any) -> float:
    """A first step for an adaptive method.

    Args:
        end: Of the segment [s].

    Returns:
        [s].
    Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section II.4.
    """
    if settings[FIRST] > 0.0:
        return settings[FIRST]
    n, t, state, slope, curve = block.shape[1], clock[TIME], 0.0, 0.0, 0.0
    for i in range(n):
        state = max(state, abs(block[X, i]) / block[TOLERANCE, i])
        slope = max(slope, abs(block[F0, i]) / block[TOLERANCE, i])
    h = 1e-6 if state < 1e-5 or slope < 1e-5 else 0.01 * state / slope
    h = min(h, settings[LARGEST], end - t)
    for i in range(n):
        block[STAGE, i] = block[X, i] + h * block[F0, i]
    rates(address, min(t + h, clock[LIMIT]), STAGE, F1, block, data, count)
    for i in range(n):
        curve = max(curve, abs(block[F1, i] - block[F0, i]) / block[TOLERANCE, i] / h)
    steepest = max(slope, curve)
    later = max(1e-6, 1e-3 * h) if not 1e-15 < steepest < np.inf else (0.01 / steepest) ** 0.25
    return min(100.0 * h, later)


@law
def choose(method: int, end: float, settings: Array, clock: Array, count: Any) -> float:
    """The step to try, so that the end of the segment is met and no tiny step is left before it.

    Args:
        end: Of the segment [s].

    Returns:
        [s].
    """
    left = end - clock[TIME]
    if method >= RUNGE_KUTTA:
        later = clock[ORIGIN] + (count[STRIDES] + 1) * settings[FIXED]
        # Multiples of the step, not sums: a million additions lose five digits of the time.
        return left if later >= end - 1e-9 * settings[FIXED] else later - clock[TIME]
    h = min(clock[STEP], settings[LARGEST])
    if _ARRIVES * h >= left:
        return left
    return 0.5 * left if 2.0 * h > left else h


@law
def _root_of(error: float, method: int) -> float:
    """How an error grows with the step, undone: the fourth root for RODAS, taken quickly; else the fifth."""
    return math.sqrt(math.sqrt(error)) if method == RODAS4 else error**0.2


@law
def next_step(method: int, h: float, error: float, clock: Array, count: Any) -> None:
    """The step proposed after one that was kept.

    Args:
        method: See ``layout``.
        h, error: The step [s], and its error in units of what is allowed.
        clock, count: See ``rosenbrock_kernel.advance``.
    """
    small = max(error, 1e-10)
    factor = _SAFETY / _root_of(small, method)
    if clock[LAST_STEP] > 0.0:
        factor = min(factor, _SAFETY * (h / clock[LAST_STEP]) * _root_of(clock[LAST_ERROR] / (small * small), method))
    factor = min(max(factor, 0.2), _GROW)
    if count[WAS_REJECTED]:
        factor = min(factor, _CAREFUL)
    proposed = h * factor
    # A step cut short by the end of a segment says little: keep what was proposed unless the error asks for less.
    clock[STEP] = max(clock[STEP], proposed) if h < clock[STEP] and factor >= 1.0 else proposed
    clock[LAST_STEP], clock[LAST_ERROR] = h, max(error, 1e-2)
    count[WAS_REJECTED] = count[FAILURES] = 0


@law
def _stays(h: float, settings: Array, clock: Array, count: Any) -> bool:
    """Whether a jump found is none that the state passes and leaves behind; those are passed with short steps."""
    if settings[MAY_JUMP] == 0.0:
        return True
    count[JUMPS] = count[JUMPS] + 1 if clock[TIME] - clock[LAST_JUMP] <= _NEAR * h else 0
    clock[LAST_JUMP] = clock[TIME]
    return count[JUMPS] > _MOST_JUMPS


@law
def refuse(
    address: int, h: float, error: float, settings: Array, block: Array, data: Any, clock: Array, count: Any
) -> int:
    """A step is refused: propose a shorter one, or say why there can be none.

    Args:
        h, error: The step [s], and its error in units of what is allowed.
    """
    count[REJECTED] += 1
    count[FAILURES] += 1
    count[WAS_REJECTED] = 1
    clock[STEP] = h * (max(_SHRINK, _SAFETY / math.sqrt(math.sqrt(error))) if error < np.inf else _SHRINK)
    culprit = count[CULPRIT]
    shortest = max(settings[SMALLEST], 4.0 * _EPSILON * abs(clock[TIME]), _TINY)
    ends = clock[STEP] < shortest
    if error < np.inf and (count[FAILURES] == _SUSPECT or count[REJECTED] % _OFTEN == 0 or ends):
        if find_jump(address, h, block, data, clock, count) and _stays(h, settings, clock, count):
            return JUMP
        count[CULPRIT] = culprit
    if ends and error < np.inf:
        return TOO_SHORT
    if ends:
        fastest = -1.0
        for i in range(block.shape[1]):
            if abs(block[F0, i]) / block[TOLERANCE, i] > fastest:
                fastest, count[CULPRIT] = abs(block[F0, i]) / block[TOLERANCE, i], i
        return RUNS_AWAY
    return DONE
