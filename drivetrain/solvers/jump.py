"""Is a right-hand side that resists every step discontinuous? A search along the step answers with certainty."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law
from drivetrain.solvers.compiled_function import call
from drivetrain.solvers.records import Run

_NEAR, _MOST_JUMPS = 100.0, 12  # jumps found within so many steps of one another, and how many of them
_HALVINGS = 52
_SMOOTH = 0.05  # a change that has shrunk to this share shrinks with the interval: no jump


def jump_stays(run: Run, numbers: Array, words: Any) -> bool:
    """Whether a rate jumps within the step just refused, and the state does not just pass the jump and leave it behind.

    Those that it passes are passed with short steps, if the problem allows it. Clock and count say which rate jumps,
    where and by how much.
    """
    clock, count = run.clock[0], run.count[0]
    line = _Line(run.states["x"].copy(), run.states["next"].copy(), clock.time, clock.refused, clock.limit)
    if not np.isfinite(line.end).all():
        return False
    found = _search(run.calls[0].rates, line, run.states["tolerance"].copy(), numbers, words)
    count.rates += found.asked
    if found.rate < 0:
        return False
    if run.settings[0].may_jump:
        count.jumps = count.jumps + 1 if clock.time - clock.last_jump <= _NEAR * clock.refused else 0
        clock.last_jump = clock.time
        if count.jumps <= _MOST_JUMPS:
            return False
    count.culprit, count.argument = found.rate, found.argument
    clock.before, clock.after, clock.jump_at = found.before, found.after, found.at
    return True


class _Line(NamedTuple):
    """From the state to the end of the step tried: both, the instant, the step, and the last instant to be seen [s]."""

    x: Array
    end: Array
    t: float
    h: float
    limit: float


class _Jump(NamedTuple):
    """Which rate jumps, -1: none; from what to what, when [s]; which state makes it, -1: none, it is time; the cost."""

    rate: int
    before: float
    after: float
    at: float
    argument: int
    asked: int


@law
def _ask(address: int, line: _Line, share: float, asked: Array, result: Array, numbers: Array, words: Any) -> None:
    """The rates at a share of the step."""
    for j in range(len(asked)):
        asked[j] = line.x[j] + share * (line.end[j] - line.x[j])
    call(address, min(line.t + share * line.h, line.limit), asked, result, numbers, words)


@kernel
def _search(address: int, line: _Line, tolerance: Array, numbers: Array, words: Any) -> _Jump:
    """Halve the interval in which a rate changes most until it is empty.

    A continuous rate, however steep, changes less and less; one that jumps does not.
    """
    n, count = len(line.x), 2
    asked, first, last = np.empty(n), np.empty(n), np.empty(n)
    _ask(address, line, 0.0, asked, first, numbers, words)
    _ask(address, line, 1.0, asked, last, numbers, words)
    worst, i = 0.0, -1
    for j in range(n):
        change = line.h * abs(last[j] - first[j]) / tolerance[j]
        if change > worst:
            worst, i = change, j
    if i < 0 or not worst < np.inf:
        return _Jump(-1, 0.0, 0.0, 0.0, -1, count)
    low, high, left, right = 0.0, 1.0, first[i], last[i]
    whole = abs(right - left)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        _ask(address, line, middle, asked, first, numbers, words)
        count += 1
        if abs(first[i] - left) >= abs(right - first[i]):
            high, right = middle, first[i]
        else:
            low, left = middle, first[i]
        if abs(right - left) < _SMOOTH * whole:
            return _Jump(-1, 0.0, 0.0, 0.0, -1, count)
    _ask(address, line, low, asked, first, numbers, words)
    count += 1
    for j in range(n):
        kept = asked[j]
        asked[j] = line.x[j] + high * (line.end[j] - line.x[j])
        if asked[j] != kept:
            call(address, min(line.t + low * line.h, line.limit), asked, last, numbers, words)
            count += 1
            if abs(last[i] - first[i]) > 0.5 * abs(right - left):
                return _Jump(i, left, right, line.t + high * line.h, j, count)
        asked[j] = kept
    return _Jump(i, left, right, line.t + high * line.h, -1, count)
