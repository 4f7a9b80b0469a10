"""The periodic winding and housing temperature of a torque cycle or a mix of them, compiled.

The same laws as ``heat.py``, ``periodic_rise.py`` and ``mixed_heat.py`` on plain arrays, for those who ask for
thousands of motors; the step through an interval is shared with them. It is called by its address, so that those who
call it do not compile it again.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_kernels import cycle_map, cycle_trace
from drivetrain.drive.periodic_heat import GROWN_BEYOND, STEADY
from drivetrain.jit import callback, law

MAGNET_TOLERANCE = 1e-6  # K, as in heat.py
MOST_STEPS = 40

# Numbers of a motor in its mounting; the shares of the parts follow.
(
    RESISTANCE, SLOPE, CONSTANT, MAGNET, REFERENCE, AMBIENT, INNER, OUTER, WINDING_CAPACITY, HOUSING_CAPACITY, SHARES,
) = range(11)  # fmt: skip

# What comes out.
MAGNETS, RUNAWAY, MEAN_WINDING, MEAN_HOUSING, PEAK_WINDING, STATE = range(6)

# Rows of the series that go in, of the winding temperature that comes out, and of memory.
SQUARE, LOSS, STEP, WINDING, GROWTH, SOURCE, OUTSIDE, ROWS = range(8)


@law
def _capacity(motor: Array, length: float) -> float:
    """Of the housing [J/K]; of the whole motor where winding and housing are one."""
    if motor[INNER] == 0.0:
        return motor[WINDING_CAPACITY]
    if np.isnan(motor[HOUSING_CAPACITY]):
        return STEADY * length / motor[OUTER]
    return motor[HOUSING_CAPACITY]


@law
def _rates(motor: Array, housing: float, rates: Array) -> None:
    """Rates of heat flow as the kernels take them."""
    if motor[INNER] == 0.0:
        rates[0] = rates[3] = 1.0 / (motor[OUTER] * housing)
        rates[1] = rates[2] = 0.0
    else:
        exchange = 1.0 / motor[INNER]
        rates[0] = rates[1] = exchange / motor[WINDING_CAPACITY]
        rates[2], rates[3] = exchange / housing, (exchange + 1.0 / motor[OUTER]) / housing


@law
def _sources(motor: Array, series: Array, first: int, last: int, scale: float, housing: float, brought: float) -> None:
    """Growth and the two sources of each interval of a part, over the capacities."""
    winding, one = motor[WINDING_CAPACITY], motor[INNER] == 0.0
    copper, slope = scale * motor[RESISTANCE] / winding, scale * motor[SLOPE] / winding
    inside, outside = (1.0 / winding, 0.0) if one else (0.0, 1.0 / housing)
    for k in range(first, last):
        loss = series[LOSS, k] + brought
        series[GROWTH, k] = slope * series[SQUARE, k]
        series[SOURCE, k] = copper * series[SQUARE, k] + inside * loss
        series[OUTSIDE, k] = outside * loss


@law
def _part_means(series: Array, first: int, last: int, means: Array) -> None:
    """Length, mean square and mean loss of a part."""
    means[:] = 0.0
    for k in range(first, last):
        means[0] += series[STEP, k]
        means[1] += series[STEP, k] * series[SQUARE, k]
        means[2] += series[STEP, k] * series[LOSS, k]
    means[1] /= means[0]
    means[2] /= means[0]


@law
def _large(cycle: Array) -> bool:
    """Whether a map has grown beyond all bounds, or is no number."""
    for i in range(2):
        for j in range(6):
            if not abs(cycle[i, j]) < GROWN_BEYOND:
                return True
    return False


# long kernel: one part's answer and the balance of all parts share a dozen numbers
@law
def _rise(motor: Array, edges: Array, series: Array, magnets: float, moving: bool, states: Array) -> float:
    """Mean housing rise with magnets of a temperature, infinite in a runaway; states of the parts.

    A state is: start of winding and housing, mean of both, heat that the other parts bring, and for a mix the answer
    to a housing that rests at 0 and the change of it with each kelvin: (start, start, winding, brought) each.
    """
    constant = motor[CONSTANT] * (1.0 + motor[MAGNET] * (magnets - motor[REFERENCE])) if np.isfinite(magnets) else 0.0
    if not constant > 0.0:
        return np.inf
    scale = (motor[CONSTANT] / constant) ** 2
    parts, rates, means = len(edges) - 1, np.empty(4), np.empty(3)
    shared = parts > 1 and motor[INNER] != 0.0
    inner, outer = motor[INNER], motor[OUTER]
    hottest, needed, slope = -np.inf, 0.0, 0.0
    for i in range(parts):
        first, last, o = edges[i], edges[i + 1] - 1, states[i]
        _part_means(series, first, last, means)
        length, copper = means[0], scale * motor[RESISTANCE] * means[1]
        rise, loss = scale * motor[SLOPE] * means[1], means[2]
        o[4] = 0.0
        if not moving and shared:
            left = 1.0 - inner * rise
            if not left > 0.0:
                return np.inf
            o[5], o[6], o[7], o[8] = inner * copper / left, 0.0, inner * copper / left, -loss - copper / left
            o[9], o[10], o[11], o[12] = 1.0 / left, 1.0, 1.0 / left, 1.0 / outer - rise / left
        elif not moving:
            gain = rise * (inner + outer)
            if not gain < 1.0:
                return np.inf
            winding = (copper + rise * outer * loss) / (1.0 - gain)
            o[1] = o[3] = outer * (winding + loss)
            o[0] = o[2] = o[3] + inner * winding
        else:
            housing = _capacity(motor, length)
            _rates(motor, housing, rates)
            _sources(motor, series, first, last, scale, housing, 0.0)
            steps = series[STEP, first:last]
            cycle = cycle_map(
                steps, series[GROWTH, first:last], series[SOURCE, first:last], series[OUTSIDE, first:last], rates
            )
            if _large(cycle):
                return np.inf
            a, b, c, d = cycle[0, 0], cycle[0, 1], cycle[1, 0], cycle[1, 1]
            if not shared and not 0.5 * (a + d) + math.sqrt(max((0.5 * (a - d)) ** 2 + b * c, 0.0)) < 1.0:
                return np.inf
            determinant = (1.0 - a) * (1.0 - d) - b * c
            o[0] = ((1.0 - d) * cycle[0, 2] + b * cycle[1, 2]) / determinant
            o[1] = ((1.0 - a) * cycle[1, 2] + c * cycle[0, 2]) / determinant
            o[2] = (cycle[0, 3] * o[0] + cycle[0, 4] * o[1] + cycle[0, 5]) / length
            o[3] = (cycle[1, 3] * o[0] + cycle[1, 4] * o[1] + cycle[1, 5]) / length
            if inner == 0.0:
                o[3] = o[2]
            if shared:
                # What one watt into the housing adds; then as a function of the housing's mean.
                if not rise / motor[WINDING_CAPACITY] < rates[0]:
                    return np.inf
                for k in range(first, last):
                    series[SOURCE, k], series[OUTSIDE, k] = 0.0, 1.0 / housing
                pushed = cycle_map(
                    steps, series[GROWTH, first:last], series[SOURCE, first:last], series[OUTSIDE, first:last], rates
                )
                if _large(pushed):
                    return np.inf
                s0 = ((1.0 - d) * pushed[0, 2] + b * pushed[1, 2]) / determinant
                s1 = ((1.0 - a) * pushed[1, 2] + c * pushed[0, 2]) / determinant
                w = (cycle[0, 3] * s0 + cycle[0, 4] * s1 + pushed[0, 5]) / length
                h = (cycle[1, 3] * s0 + cycle[1, 4] * s1 + pushed[1, 5]) / length
                o[12], o[8] = 1.0 / h, -o[3] / h
                o[9], o[10], o[11] = s0 / h, s1 / h, w / h
                o[5], o[6], o[7] = o[0] + s0 * o[8], o[1] + s1 * o[8], o[2] + w * o[8]
        if shared:
            needed += motor[SHARES + i] * o[8]
            slope += motor[SHARES + i] * o[12]
        else:
            hottest = max(hottest, o[3])
    if not shared:
        return hottest
    if not slope > 0.0:
        return np.inf
    rise = -needed / slope
    for i in range(parts):
        o = states[i]
        o[0], o[1], o[2] = o[5] + rise * o[9], o[6] + rise * o[10], o[7] + rise * o[11]
        o[3], o[4] = rise, o[8] + rise * o[12]
    return rise


@law
def _settled(motor: Array, edges: Array, series: Array, moving: bool, start: float, states: Array) -> float:
    """The magnet temperature that the mean housing temperature confirms, as ``heat.settled`` finds it."""
    ambient, previous, reached, magnets = motor[AMBIENT], 0.0, 0.0, start
    for step in range(MOST_STEPS + 1):
        if not np.isfinite(magnets):
            return np.inf
        if step > 1 and abs(magnets - previous) <= MAGNET_TOLERANCE:
            return magnets
        found = ambient + _rise(motor, edges, series, magnets, moving, states)
        if step == 0:
            previous, reached, magnets = magnets, found, found
            if abs(magnets - previous) <= MAGNET_TOLERANCE:
                return magnets
            continue
        slope = (found - reached) / (magnets - previous)
        if slope >= 1.0:
            return np.inf
        previous, reached = magnets, found
        magnets = magnets + (found - magnets) / (1.0 - slope)
    return magnets


@law
def _state(motor: Array, edges: Array, series: Array, found: Array) -> None:
    """The whole answer; ``steady_state`` without pointers."""
    ambient, parts = motor[AMBIENT], len(edges) - 1
    states = np.zeros((parts, 13))
    moving, start = not np.isnan(motor[WINDING_CAPACITY]), ambient
    never = moving != moving  # numba would compile a callee again for a literal
    if parts == 1:
        guess = _settled(motor, edges, series, never, start, states)
        start = guess if np.isfinite(guess) else ambient
    magnets = _settled(motor, edges, series, moving, start, states)
    rise = _rise(motor, edges, series, magnets, moving, states)
    runaway = not np.isfinite(rise)
    found[MAGNETS], found[RUNAWAY] = magnets if np.isfinite(magnets) else ambient, 1.0 if runaway else 0.0
    found[MEAN_WINDING] = found[MEAN_HOUSING] = found[PEAK_WINDING] = np.inf
    if runaway:
        return
    scale = 1.0 / (1.0 + motor[MAGNET] * (magnets - motor[REFERENCE])) ** 2
    peak, rates = -np.inf, np.empty(4)
    found[MEAN_WINDING] = found[MEAN_HOUSING] = ambient
    for i in range(parts):
        first, last, o = edges[i], edges[i + 1] - 1, states[i]
        highest = o[2]
        if moving:
            length = 0.0
            for k in range(first, last):
                length += series[STEP, k]
            housing = _capacity(motor, length)
            _rates(motor, housing, rates)
            _sources(motor, series, first, last, scale, housing, o[4])
            rises, highest, _ = cycle_trace(
                series[STEP, first:last], series[GROWTH, first:last], series[SOURCE, first:last],
                series[OUTSIDE, first:last], rates, o[:2],
            )  # fmt: skip
            for k in range(first, last + 1):
                series[WINDING, k] = ambient + rises[k - first, 0]
        else:
            for k in range(first, last + 1):
                series[WINDING, k] = ambient + highest
        peak = max(peak, highest)
        found[MEAN_WINDING] += motor[SHARES + i] * o[2]
        found[MEAN_HOUSING] += motor[SHARES + i] * o[3]
    found[PEAK_WINDING] = ambient + peak


_POINTER = nb.types.CPointer(nb.float64)
_SIGNATURE = nb.void(nb.float64, _POINTER, _POINTER, _POINTER, nb.types.CPointer(nb.int64))


def _steady_state(t: float, x: Any, result: Any, numbers: Any, words: Any) -> None:
    """The temperatures of a torque cycle that repeats for ever, or of a mix of several; called by its address.

    Args:
        x: Numbers of the motor as above: resistance with the winding at ambient temperature [ohm] and its slope
            [ohm/K], both over the square of the torque constant at reference temperature; that constant [N m/A], its
            change [1/K] and its reference temperature [C]; ambient [C]; resistances from winding to housing and from
            there to ambient [K/W]; capacities [J/K], NaN where unknown; shares of the parts in the time of use.
        result: Takes magnet temperature [C], 1 for a runaway, mean winding, mean housing and peak winding temperature
            [C], (STATE,).
        numbers: Rows as above: mean square of the torque [N^2 m^2] and mean loss in the housing [W] from each sample
            to the next, and how long that is [s]; takes the winding temperatures [C], (ROWS, N).
    """
    samples, parts = words[0], words[1]
    edges = nb.carray(words, parts + 3)[2:]
    series = nb.carray(numbers, (ROWS, samples))
    _state(nb.carray(x, SHARES + parts), edges, series, nb.carray(result, STATE))


@lru_cache(maxsize=1)
def steady_state() -> Any:
    """The kernel, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        The compiled function, with ``.address``.
    """
    return callback(_SIGNATURE, _steady_state)
