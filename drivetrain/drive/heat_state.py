"""The periodic winding and housing temperature of a torque cycle or a mix of them, compiled.

The same laws as ``heat.py``, ``periodic_rise.py`` and ``mixed_heat.py`` on plain arrays, for those who ask for
thousands of motors; the step through an interval is shared with them.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_kernels import cycle_map, cycle_trace
from drivetrain.drive.periodic_rise import GROWN_BEYOND, STEADY

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {"heat_kernels.py": 0, "periodic_rise.py": 0}

MAGNET_TOLERANCE = 1e-6  # K, as in heat.py
MOST_STEPS = 40

# Numbers of a motor in its mounting.
(
    RESISTANCE, SLOPE, CONSTANT, MAGNET, REFERENCE, AMBIENT, INNER, OUTER, WINDING, HOUSING, NUMBERS,
) = range(11)  # fmt: skip

# What comes out.
MAGNETS, RUNAWAY, MEAN_WINDING, MEAN_HOUSING, PEAK_WINDING, STATE = range(6)

_compiled = nb.njit(cache=True, error_model="numpy", nogil=True)


@_compiled
def _scale(motor: Array, magnets: float) -> float:
    """Square of cold over warm torque constant; infinite where nothing is left of it."""
    constant = motor[CONSTANT] * (1.0 + motor[MAGNET] * (magnets - motor[REFERENCE])) if np.isfinite(magnets) else 0.0
    return (motor[CONSTANT] / constant) ** 2 if constant > 0.0 else np.inf


@_compiled
def _rates(motor: Array, length: float) -> tuple[Array, float, float]:
    """Rates of heat flow as the kernels take them, and the capacities of winding and housing."""
    inner, outer, capacity = motor[INNER], motor[OUTER], motor[WINDING]
    rates = np.zeros(4)
    if inner == 0.0:
        rates[0] = rates[3] = 1.0 / (outer * capacity)
        return rates, capacity, capacity
    housing = motor[HOUSING]
    if np.isnan(housing):
        housing = STEADY * length / outer
    exchange = 1.0 / inner
    rates[0] = rates[1] = exchange / capacity
    rates[2], rates[3] = exchange / housing, (exchange + 1.0 / outer) / housing
    return rates, capacity, housing


@_compiled
def _sources(
    motor: Array, square: Array, loss: Array, scale: float, capacities: tuple[float, float], to: Array
) -> None:
    """Growth and the two sources of each interval, over the capacities."""
    winding, housing = capacities
    growth, source, outer = to[0], to[1], to[2]
    copper, slope = scale * motor[RESISTANCE] / winding, scale * motor[SLOPE] / winding
    one = motor[INNER] == 0.0
    for k in range(len(square)):
        growth[k] = slope * square[k]
        source[k] = copper * square[k] + (loss[k] / winding if one else 0.0)
        outer[k] = 0.0 if one else loss[k] / housing


@_compiled
def _mean(motor: Array, square: float, loss: float, scale: float) -> tuple[float, float]:
    """Rises of temperatures that do not move; infinite in a runaway."""
    inner, outer = motor[INNER], motor[OUTER]
    copper, slope = scale * motor[RESISTANCE] * square, scale * motor[SLOPE] * square
    gain = slope * (inner + outer)
    if not gain < 1.0:
        return np.inf, np.inf
    winding = (copper + slope * outer * loss) / (1.0 - gain)
    housing = outer * (winding + loss)
    return housing + inner * winding, housing


@_compiled
def _periodic(motor: Array, steps: Array, square: Array, loss: Array, scale: float, to: Array, state: Array) -> None:
    """Rises at the start and over the cycle into a row (start, start, mean, mean)."""
    state[:4] = np.inf
    length = steps.sum()
    rates, winding, housing = _rates(motor, length)
    _sources(motor, square, loss, scale, (winding, housing), to)
    cycle = cycle_map(steps, to[0], to[1], to[2], rates)
    for value in cycle.flat:
        if not abs(value) < GROWN_BEYOND:
            return
    a, b, c, d = cycle[0, 0], cycle[0, 1], cycle[1, 0], cycle[1, 1]
    radius = 0.5 * (a + d) + math.sqrt((0.5 * (a - d)) ** 2 + b * c)
    if not radius < 1.0:
        return
    determinant = (1.0 - a) * (1.0 - d) - b * c
    state[0] = ((1.0 - d) * cycle[0, 2] + b * cycle[1, 2]) / determinant
    state[1] = ((1.0 - a) * cycle[1, 2] + c * cycle[0, 2]) / determinant
    for i in range(2):
        state[2 + i] = (cycle[i, 3] * state[0] + cycle[i, 4] * state[1] + cycle[i, 5]) / length
    if motor[INNER] == 0.0:
        state[3] = state[2]


@_compiled
def _rise(
    motor: Array, edges: Array, shares: Array, steps: Array, square: Array, loss: Array, magnets: float,
    moving: bool, to: Array, states: Array,
) -> float:  # fmt: skip
    """Mean housing rise of a cycle or a mix with magnets of a temperature; the parts' states; infinite: runaway."""
    scale = _scale(motor, magnets)
    if scale == np.inf:
        states[:] = np.inf
        return np.inf
    many, hottest = len(shares) > 1, -np.inf
    if many and motor[INNER] != 0.0:
        return _mixed(motor, edges, shares, steps, square, loss, scale, to, states)
    for i in range(len(shares)):
        first, last = edges[i], edges[i + 1] - 1
        state = states[i]
        part = steps[first:last]
        if moving:
            _periodic(motor, part, square[first:last], loss[first:last], scale, to[:, first:last], state)
        else:
            length = part.sum()
            whole = np.dot(part, square[first:last]) / length, np.dot(part, loss[first:last]) / length
            state[2], state[3] = _mean(motor, whole[0], whole[1], scale)
            state[0], state[1] = state[2], state[3]
        if not state[2] < np.inf:
            return np.inf
        hottest = max(hottest, state[3])
    return hottest


# long kernel: the parts' linear answers and their balance share a dozen numbers
@_compiled
def _mixed(
    motor: Array, edges: Array, shares: Array, steps: Array, square: Array, loss: Array, scale: float,
    to: Array, states: Array,
) -> float:  # fmt: skip
    """Mean housing rise of a mix: one housing for all parts, each part's winding in its own periodic state."""
    inner, outer = motor[INNER], motor[OUTER]
    answers = np.empty((len(shares), 8))
    needed, slope = 0.0, 0.0
    for i in range(len(shares)):
        first, last = edges[i], edges[i + 1] - 1
        part, own, heat = steps[first:last], square[first:last], loss[first:last]
        length = part.sum()
        o = answers[i]
        if np.isnan(motor[WINDING]):
            mean, lost = np.dot(part, own) / length, np.dot(part, heat) / length
            copper, rise = scale * motor[RESISTANCE] * mean, scale * motor[SLOPE] * mean
            left = 1.0 - inner * rise
            if not left > 0.0:
                states[:] = np.inf
                return np.inf
            o[0], o[1], o[2], o[3] = inner * copper / left, 1.0 / left, 0.0, 1.0
            o[4], o[5], o[6], o[7] = o[0], o[1], -lost - copper / left, 1.0 / outer - rise / left
        else:
            rates, winding, housing = _rates(motor, length)
            work = to[:, first:last]
            _sources(motor, own, heat, scale, (winding, housing), work)
            cycle = cycle_map(part, work[0], work[1], work[2], rates)
            grows = np.dot(part, work[0])
            work[1, :] = 0.0
            work[2, :] = 1.0 / housing
            pushed = cycle_map(part, work[0], work[1], work[2], rates)
            largest = max(np.abs(cycle).max(), np.abs(pushed).max())
            if not (grows < rates[0] * length and largest < GROWN_BEYOND):
                states[:] = np.inf
                return np.inf
            matrix, right = np.eye(3), np.zeros((3, 2))
            matrix[:2, :2] -= cycle[:, :2]
            matrix[:2, 2] = -pushed[:, 2]
            matrix[2, 0], matrix[2, 1], matrix[2, 2] = cycle[1, 3] / length, cycle[1, 4] / length, pushed[1, 5] / length
            right[0, 0], right[1, 0], right[2, 0], right[2, 1] = cycle[0, 2], cycle[1, 2], -cycle[1, 5] / length, 1.0
            solved = np.linalg.solve(matrix, right)
            for j in range(2):
                o[j], o[2 + j], o[6 + j] = solved[0, j], solved[1, j], solved[2, j]
                mean = cycle[0, 3] * solved[0, j] + cycle[0, 4] * solved[1, j] + pushed[0, 5] * solved[2, j]
                o[4 + j] = mean / length
            o[4] += cycle[0, 5] / length
        needed += shares[i] * o[6]
        slope += shares[i] * o[7]
    if not slope > 0.0:
        states[:] = np.inf
        return np.inf
    rise = -needed / slope
    for i in range(len(shares)):
        o = answers[i]
        states[i, 0], states[i, 1] = o[0] + rise * o[1], o[2] + rise * o[3]
        states[i, 2], states[i, 3], states[i, 4] = o[4] + rise * o[5], rise, o[6] + rise * o[7]
    return rise


@_compiled
def _settled(
    motor: Array, edges: Array, shares: Array, steps: Array, square: Array, loss: Array, moving: bool,
    start: float, to: Array, states: Array,
) -> float:  # fmt: skip
    """The magnet temperature that the mean housing temperature confirms, as ``heat.settled`` finds it."""
    ambient = motor[AMBIENT]
    previous = start
    reached = ambient + _rise(motor, edges, shares, steps, square, loss, previous, moving, to, states)
    magnets = reached
    for _ in range(MOST_STEPS):
        if not np.isfinite(magnets):
            return np.inf
        if abs(magnets - previous) <= MAGNET_TOLERANCE:
            return magnets
        found = ambient + _rise(motor, edges, shares, steps, square, loss, magnets, moving, to, states)
        slope = (found - reached) / (magnets - previous)
        if slope >= 1.0:
            return np.inf
        previous, reached = magnets, found
        magnets = magnets + (found - magnets) / (1.0 - slope)
    return magnets


@_compiled
def steady_state(
    motor: Array, edges: Array, shares: Array, steps: Array, square: Array, loss: Array, to: Array, winding: Array,
    found: Array,
) -> None:  # fmt: skip
    """The temperatures of a torque cycle that repeats for ever, or of a mix of several.

    Args:
        motor: Its numbers as above: resistance with the winding at ambient temperature [ohm] and its slope [ohm/K],
            both over the square of the torque constant at reference temperature; that constant [N m/A], its change
            [1/K] and reference temperature [C]; ambient [C]; resistances from winding to housing and to ambient
            [K/W]; capacities [J/K], NaN where unknown, (NUMBERS,).
        edges: First sample of each part, and the number of samples, (P + 1,).
        shares: Of the parts in the time of use, (P,).
        steps: From each sample to the next [s], (N,).
        square: Mean of the square of the torque from each sample to the next [N^2 m^2], (N,).
        loss: Mean loss in the housing from each sample to the next [W], (N,).
        to: Memory, (3, N).
        winding: Takes the winding temperature at each sample [C], (N,).
        found: Takes magnet, mean winding, mean housing and peak winding temperature [C] and 1 for a runaway, (STATE,).
    """
    ambient = motor[AMBIENT]
    states = np.zeros((len(shares), 5))
    moving = not np.isnan(motor[WINDING])
    start = ambient
    if len(shares) == 1:
        guess = _settled(motor, edges, shares, steps, square, loss, False, start, to, states)
        start = guess if np.isfinite(guess) else ambient
    magnets = _settled(motor, edges, shares, steps, square, loss, moving, start, to, states)
    rise = _rise(motor, edges, shares, steps, square, loss, magnets, moving, to, states)
    found[MAGNETS], found[RUNAWAY] = magnets if np.isfinite(magnets) else ambient, 0.0
    if not np.isfinite(rise):
        found[RUNAWAY], found[MEAN_WINDING], found[MEAN_HOUSING], found[PEAK_WINDING] = 1.0, np.inf, np.inf, np.inf
        return
    _trace(motor, edges, shares, steps, square, loss, _scale(motor, magnets), to, states, winding, found)


@_compiled
def _trace(
    motor: Array, edges: Array, shares: Array, steps: Array, square: Array, loss: Array, scale: float, to: Array,
    states: Array, winding: Array, found: Array,
) -> None:  # fmt: skip
    """Winding temperatures of all samples, their means and their peak."""
    ambient, peak = motor[AMBIENT], -np.inf
    found[MEAN_WINDING] = found[MEAN_HOUSING] = ambient
    for i in range(len(shares)):
        first, last = edges[i], edges[i + 1] - 1
        state, highest = states[i], states[i, 2]
        winding[first : last + 1] = ambient + highest
        if not np.isnan(motor[WINDING]):
            work, part = to[:, first:last], steps[first:last]
            rates, capacity, housing = _rates(motor, part.sum())
            _sources(motor, square[first:last], loss[first:last] + state[4], scale, (capacity, housing), work)
            rises, highest, _ = cycle_trace(part, work[0], work[1], work[2], rates, state[:2])
            winding[first : last + 1] = ambient + rises[:, 0]
        peak = max(peak, highest)
        found[MEAN_WINDING] += shares[i] * state[2]
        found[MEAN_HOUSING] += shares[i] * state[3]
    found[PEAK_WINDING] = ambient + peak
