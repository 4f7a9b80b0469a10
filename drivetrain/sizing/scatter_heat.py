"""Periodic winding temperature of one motor with many losses, carried over blocks of samples.

In a block that is short against the time constants, what the losses do to the two temperatures is told by their sum
and their first and second moment about the block's middle: the exponent of Magnus with the moments that it names,
exact to the fifth order of the block's length (about 1e-8 of the rise for blocks of 1.5 % of a time constant). Inside
a block the steps from sample to sample are taken only where an instant is asked for.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drivetrain.arrays import Array
from drivetrain.drive.exponentials import first, second
from drivetrain.drive.periodic_rise import STEADY
from drivetrain.sizing.scatter_blocks import ONE_NODE, STEADY_HEAT, Blocks, HeatMemory

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "drive/exponentials.py": 4137605713,
    "drive/periodic_rise.py": 2837073585,
    "sizing/scatter_blocks.py": 4073483484,
}

SMALL = 0.1  # norm of an exponent that is summed up as a series
QUICK = 1e-3  # norm of a step that two orders carry, to 1e-10 of the rise
MATCHED = 1e-4  # K between magnets put in and magnets that come out, before the last step of the secant
MOST_STEPS = 40

# Where the rates stand that a trace needs.
A, B, C, D, SOURCE, GROWTH, LOSS_SHARE, KIND_OF = range(8)

Motor = tuple[float, float, float, float, float, float, float, float, float, float]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _moments(blocks: Blocks, square: Array, moments: Array) -> float:
    """Moments of the squared torque in each block; their sum."""
    total = 0.0
    for k in range(len(moments)):
        begin, end = blocks.first[k], blocks.first[k + 1]
        values, step = square[begin:end], blocks.step[begin:end]
        offset, spread = blocks.offset[begin:end], blocks.spread[begin:end]
        m0, m1, m2 = 0.0, 0.0, 0.0
        for i in range(len(values)):
            m0 += step[i] * values[i]
            m1 += offset[i] * values[i]
            m2 += spread[i] * values[i]
        moments[k, 0], moments[k, 1], moments[k, 2] = m0, m1, m2
        total += m0
    return total


@njit(cache=True, error_model="numpy")
def _exponential(l00: float, l01: float, l10: float, l11: float, v0: float, v1: float, out: Array) -> None:
    """e^L - and what a source v within it ends as - for a matrix with real eigenvalues, halved until it is small."""
    norm = max(abs(l00), abs(l11)) + max(abs(l01), abs(l10))
    halves = 0
    while norm > SMALL:
        norm *= 0.5
        halves += 1
    scale = 0.5**halves
    l00, l01, l10, l11, v0, v1 = l00 * scale, l01 * scale, l10 * scale, l11 * scale, v0 * scale, v1 * scale
    m = 0.5 * (l00 + l11)
    half = 0.5 * (l00 - l11)
    d = half * half + l01 * l10
    # (e^x - 1)/x and its derivatives at m; even and odd part at m +- sqrt(d).
    f0 = 1.0 + m * (1 / 2 + m * (1 / 6 + m * (1 / 24 + m * (1 / 120 + m * (1 / 720 + m / 5040)))))
    f1 = 1 / 2 + m * (1 / 3 + m * (1 / 8 + m * (1 / 30 + m * (1 / 144 + m / 840))))
    f2 = 1 / 3 + m * (1 / 4 + m * (1 / 10 + m * (1 / 36 + m / 168)))
    f3 = 1 / 4 + m * (1 / 5 + m * (1 / 12 + m / 42))
    f4 = 1 / 5 + m * (1 / 6 + m / 14)
    f5 = 1 / 6 + m / 7
    p = f0 + d * (f2 / 2 + d * f4 / 24)
    q = f1 + d * (f3 / 6 + d * f5 / 120)
    s00, s01, s10, s11 = p + q * half, q * l01, q * l10, p - q * half
    e00, e01 = 1.0 + s00 * l00 + s01 * l10, s00 * l01 + s01 * l11
    e10, e11 = s10 * l00 + s11 * l10, 1.0 + s10 * l01 + s11 * l11
    r0, r1 = s00 * v0 + s01 * v1, s10 * v0 + s11 * v1
    for _ in range(halves):
        r0, r1 = e00 * r0 + e01 * r1 + r0, e10 * r0 + e11 * r1 + r1
        trace = e00 + e11
        cross = e01 * e10
        e00, e01, e10, e11 = e00 * e00 + cross, e01 * trace, e10 * trace, e11 * e11 + cross
    out[0], out[1], out[2], out[3], out[4], out[5] = e00, e01, e10, e11, r0, r1


# long kernel: exponents, their composition and the way back through them share one set of rates
@njit(cache=True, error_model="numpy")
def _two_nodes(blocks: Blocks, heat: HeatMemory, loss: Array) -> float:
    """Mean housing rise of the periodic state with the rates in ``heat``; states at the edges of blocks."""
    r = heat.rates
    a, b, c, d, rho, gamma, eta = r[A], r[B], r[C], r[D], r[SOURCE], r[GROWTH], r[LOSS_SHARE]
    a00, a01, a10, a11, w0, w1 = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    count = len(blocks.length)
    for k in range(count):
        h = blocks.length[k]
        m0, m1, m2 = heat.moments[k, 0], heat.moments[k, 1], 0.5 * heat.moments[k, 2]
        n0, n1 = eta * loss[k, 0], eta * loss[k, 1]
        l00 = -a * h + gamma * (m0 + 2.0 * m2 * b * c)
        l01 = b * h + gamma * (m1 * b + m2 * (a - d) * b)
        l10 = c * h - gamma * (m1 * c - m2 * (a - d) * c)
        l11 = -d * h - 2.0 * m2 * b * c * gamma
        v0 = rho * (m0 + m1 * a + m2 * (a * a + b * c)) - n1 * b
        v1 = n0 + n1 * d - rho * (m1 * c + m2 * (a + d) * c)
        e = heat.maps[k]
        _exponential(l00, l01, l10, l11, v0, v1, e)
        w0, w1 = e[0] * w0 + e[1] * w1 + e[4], e[2] * w0 + e[3] * w1 + e[5]
        a00, a10 = e[0] * a00 + e[1] * a10, e[2] * a00 + e[3] * a10
        a01, a11 = e[0] * a01 + e[1] * a11, e[2] * a01 + e[3] * a11
    if not abs(a00) + abs(a01) + abs(a10) + abs(a11) + abs(w0) + abs(w1) < 1e100:
        return np.inf
    middle = 0.5 * (a00 + a11)
    if not middle + math.sqrt((0.5 * (a00 - a11)) ** 2 + a01 * a10) < 1.0:
        return np.inf
    left = (1.0 - a00) * (1.0 - a11) - a01 * a10
    x0, x1 = ((1.0 - a11) * w0 + a01 * w1) / left, ((1.0 - a00) * w1 + a10 * w0) / left
    total, length = 0.0, 0.0
    heat.state[0, 0], heat.state[0, 1] = x0, x1
    for k in range(count):
        e, h = heat.maps[k], blocks.length[k]
        y0, y1 = e[0] * x0 + e[1] * x1 + e[4], e[2] * x0 + e[3] * x1 + e[5]
        bend = h * h / 12.0 * (c * (x0 - y0) - d * (x1 - y1))
        total += 0.5 * h * (x1 + y1) + bend - eta * loss[k, 1]
        length += h
        x0, x1 = y0, y1
        heat.state[k + 1, 0], heat.state[k + 1, 1] = x0, x1
    return total / length


@njit(cache=True, error_model="numpy")
def _one_node(blocks: Blocks, heat: HeatMemory, square: Array) -> float:
    """The same for one node, sample by sample; rises at all samples."""
    r, rise = heat.rates, heat.rise
    x, grown = 0.0, 1.0
    for turn in range(2):
        total, length = 0.0, 0.0
        for k in range(len(square) - 1):
            step = blocks.step[k]
            rate = r[GROWTH] * square[k] - r[A]
            source = r[SOURCE] * square[k] + r[LOSS_SHARE] * heat.loss[k]
            share = first(rate * step)
            push = rate * x + source
            if turn == 0:
                grown *= 1.0 + rate * step * share
            else:
                rise[k] = x
                total += step * (x + step * push * second(rate * step, share))
                length += step
            x += step * push * share
        if turn == 0:
            if not (abs(x) < 1e100 and grown < 1.0):
                return np.inf
            x /= 1.0 - grown
    rise[len(square) - 1] = x
    return total / length


@njit(cache=True, error_model="numpy")
def _mean(motor: Motor, scale: float, square: float, loss: float) -> tuple[float, float]:
    """Mean rises of winding and housing with temperatures that do not move; infinite in a runaway."""
    inner, outer = motor[0], motor[1]
    copper, slope = scale * motor[4] * square, scale * motor[5] * square
    gain = slope * (inner + outer)
    if not gain < 1.0:
        return np.inf, np.inf
    winding = (copper + slope * outer * loss) / (1.0 - gain)
    housing = outer * (winding + loss)
    return housing + inner * winding, housing


@njit(cache=True, error_model="numpy")
def _scale(motor: Motor, magnets: float) -> float:
    """One over the square of the torque constant; 0 where nothing is left of it."""
    constant = motor[6] * (1.0 + motor[7] * (magnets - motor[8])) if np.isfinite(magnets) else 0.0
    return 1.0 / (constant * constant) if constant > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _mean_magnets(motor: Motor, square: float, loss: float) -> float:
    """Magnet temperature of temperatures that do not move, as ``heat.settled`` finds it."""
    ambient = motor[9]
    previous = ambient
    scale = _scale(motor, previous)
    reached = ambient + _mean(motor, scale, square, loss)[1] if scale > 0.0 else np.inf
    magnets = reached
    for _ in range(MOST_STEPS):
        if not np.isfinite(magnets):
            return np.inf
        if abs(magnets - previous) <= 1e-9:
            return magnets
        scale = _scale(motor, magnets)
        found = ambient + _mean(motor, scale, square, loss)[1] if scale > 0.0 else np.inf
        slope = (found - reached) / (magnets - previous)
        if slope >= 1.0:
            return np.inf
        previous, reached = magnets, found
        magnets = magnets + (found - magnets) / (1.0 - slope)
    return magnets


@njit(cache=True, error_model="numpy")
def _rates(kind: int, motor: Motor, length: float, rubbing: float, heat: HeatMemory) -> None:
    """Rates of heat flow that do not change with the magnets."""
    inner, outer, winding, housing, r = motor[0], motor[1], motor[2], motor[3], heat.rates
    r[KIND_OF] = kind
    if kind == ONE_NODE:
        r[A], r[B], r[C], r[D] = 1.0 / (outer * winding), 0.0, 0.0, 0.0
        r[LOSS_SHARE] = rubbing / winding
    else:
        if np.isnan(housing):
            housing = STEADY * length / outer
        r[A] = r[B] = 1.0 / (inner * winding)
        r[C], r[D] = 1.0 / (inner * housing), (1.0 / inner + 1.0 / outer) / housing
        r[LOSS_SHARE] = rubbing / housing


@njit(cache=True, error_model="numpy")
def _housing(
    kind: int, motor: Motor, magnets: float, square: Array, blocks: Blocks, heat: HeatMemory, loss: Array
) -> float:
    """Mean housing temperature with magnets of a temperature."""
    scale = _scale(motor, magnets)
    if scale == 0.0:
        return np.inf
    heat.rates[SOURCE], heat.rates[GROWTH] = scale * motor[4] / motor[2], scale * motor[5] / motor[2]
    if kind == ONE_NODE:
        return motor[9] + _one_node(blocks, heat, square)
    return motor[9] + _two_nodes(blocks, heat, loss)


@njit(cache=True, error_model="numpy")
def settle(
    kind: int, motor: Motor, loss: tuple[Array, Array], rubbing: float, square: Array, blocks: Blocks,
    heat: HeatMemory,
) -> tuple[float, float, float]:  # fmt: skip
    """The periodic state of one motor.

    Args:
        kind: Of its thermal nodes, not NO_HEAT.
        motor: Resistances inside and outside [K/W], capacities of winding and housing [J/K] (NaN: unknown), resistance
            with the winding at ambient temperature [ohm] and its slope [ohm/K], torque constant at reference
            temperature [N m/A], its change [1/K], that temperature [C], ambient temperature [C].
        loss: In the housing from each sample to the next [W], (M,), and its moments in the blocks, (K, 2).
        rubbing: Factor on it.
        square: Squared torque from each sample to the next [N^2 m^2], (M,).
        blocks: Of samples.
        heat: Takes states, bounds and rates.

    Returns:
        Magnet temperature [C], largest rise of the winding [K], infinite when it runs away, and its mean.
    """
    total = _moments(blocks, square, heat.moments)
    length, lost = 0.0, 0.0
    for k in range(len(blocks.length)):
        length += blocks.length[k]
        lost += loss[1][k, 0]
    mean_square, mean_loss = total / length, rubbing * lost / length
    guess = _mean_magnets(motor, mean_square, mean_loss)
    if kind == STEADY_HEAT:
        if not np.isfinite(guess):
            return motor[9], np.inf, np.inf
        winding = _mean(motor, _scale(motor, guess), mean_square, mean_loss)[0]
        return guess, winding, winding
    _rates(kind, motor, length, rubbing, heat)
    if kind == ONE_NODE:
        for k in range(len(square)):
            heat.loss[k] = loss[0][k]
    else:
        heat.loss[:] = loss[0]
    magnets = guess if np.isfinite(guess) else motor[9]
    found = _housing(kind, motor, magnets, square, blocks, heat, loss[1])
    if not np.isfinite(found):
        return motor[9], np.inf, np.inf
    slope = 0.0
    if np.isfinite(guess):  # of the mean, which is nearly that of the cycle
        nudged = _mean(motor, _scale(motor, magnets + 1.0), mean_square, mean_loss)[1]
        slope = min(nudged - _mean(motor, _scale(motor, magnets), mean_square, mean_loss)[1], 0.99)
    previous, reached = magnets, found
    magnets = magnets + (found - magnets) / (1.0 - slope)
    for _ in range(MOST_STEPS):
        if abs(magnets - previous) < 1e-9:
            break
        found = _housing(kind, motor, magnets, square, blocks, heat, loss[1])
        if not np.isfinite(found):
            return motor[9], np.inf, np.inf
        if abs(found - magnets) <= MATCHED * (1.0 - slope) and np.isfinite(guess):
            magnets = magnets + (found - magnets) / (1.0 - slope)
            break
        slope = (found - reached) / (magnets - previous)
        if slope >= 1.0:
            return motor[9], np.inf, np.inf
        previous, reached = magnets, found
        magnets = magnets + (found - magnets) / (1.0 - slope)
    return magnets, _peak(kind, blocks, heat, square), 0.0


@njit(cache=True, error_model="numpy")
def _peak(kind: int, blocks: Blocks, heat: HeatMemory, square: Array) -> float:
    """The largest rise of the winding; bounds of it in each block."""
    peak, r, count = 0.0, heat.rates, len(blocks.length)
    if kind == ONE_NODE:
        for k in range(count):
            low, high = np.inf, 0.0
            for t in range(blocks.first[k], blocks.first[k + 1] + 1):
                low, high = min(low, heat.rise[t]), max(high, heat.rise[t])
            heat.low[k], heat.high[k] = low, high
            peak = max(peak, high)
        return peak
    for k in range(count + 1):
        peak = max(peak, heat.state[k, 0])
    for k in range(count):
        x0, x1 = heat.state[k, 0], heat.state[k + 1, 0]
        fall = max(r[A] * blocks.length[k], 0.0)
        gained = heat.moments[k, 0] * (r[SOURCE] + r[GROWTH] * peak * 1.1)
        # Back from the end a winding cools at most; forward from the start it takes all of the block's heat.
        warmest = min(x1 * math.exp(min(fall, 50.0)), x0 + gained + fall * max(heat.state[k, 1], 0.0) * 1.01)
        heat.high[k] = max(max(x0, x1), warmest)
        heat.low[k] = min(x0, x1) * math.exp(-min(fall, 50.0))
    for k in range(count):
        if heat.high[k] > peak:
            peak = max(peak, _trace(blocks, heat, square, k, blocks.first[k + 1]))
    return peak


@njit(cache=True, error_model="numpy")
def _trace(blocks: Blocks, heat: HeatMemory, square: Array, block: int, until: int) -> float:
    """The largest rise in a block up to a sample; the rises at samples on the way."""
    r = heat.rates
    a, b, c, d = r[A], r[B], r[C], r[D]
    x0, x1 = heat.state[block, 0], heat.state[block, 1]
    peak = x0
    for k in range(blocks.first[block], until):
        heat.rise[k] = x0
        step = blocks.step[k]
        if step == 0.0:
            continue
        rate = r[GROWTH] * square[k] - a
        s0, s1 = r[SOURCE] * square[k], r[LOSS_SHARE] * heat.loss[k]
        if step * (abs(rate) + b + c + d) < QUICK:
            f0, f1 = rate * x0 + b * x1 + s0, c * x0 - d * x1 + s1
            x0 += step * (f0 + 0.5 * step * (rate * f0 + b * f1))
            x1 += step * (f1 + 0.5 * step * (c * f0 - d * f1))
            peak = max(peak, x0)
            continue
        pieces = 1 + int(min(511.0, 5.0 * step * (a + d)))
        times = 1 + int(step / pieces * (abs(rate) + b + c + d) / SMALL)
        part = step / (pieces * times)
        for _ in range(pieces):
            for _ in range(times):
                f0, f1 = rate * x0 + b * x1 + s0, c * x0 - d * x1 + s1
                g0, g1, factor = f0, f1, part
                for order in range(2, 9):
                    x0, x1 = x0 + factor * g0, x1 + factor * g1
                    factor *= part / order
                    if factor * max(abs(g0), abs(g1)) == 0.0 or (part * (abs(rate) + b) < 1e-3 and order > 4):
                        break
                    g0, g1 = rate * g0 + b * g1, c * g0 - d * g1
            peak = max(peak, x0)
    heat.rise[until] = x0
    return peak


@njit(cache=True, error_model="numpy")
def temperature_in(blocks: Blocks, heat: HeatMemory, square: Array, sample: int) -> float:
    """The rise of the winding at a sample, from the start of its block.

    Args:
        blocks: Of samples.
        heat: From ``settle``.
        square: Squared torque from each sample to the next [N^2 m^2], (M,).
        sample: Index; -1: all of them, into ``heat.rise``.

    Returns:
        [K].
    """
    if heat.rates[KIND_OF] == ONE_NODE:
        return heat.rise[max(sample, 0)]
    if sample < 0:
        for k in range(len(blocks.length)):
            _trace(blocks, heat, square, k, blocks.first[k + 1])
        return 0.0
    _trace(blocks, heat, square, blocks.of[sample], sample)
    return heat.rise[sample]
