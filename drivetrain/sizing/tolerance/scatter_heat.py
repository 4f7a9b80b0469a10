"""Periodic winding temperature of one motor in many arms, carried over blocks of samples.

In a block that is short against the time constants, what the losses do to the two temperatures is told by their sum
and first moments about the block's middle: the exponent of Magnus to its third term, for blocks of 1.5 % of a time
constant good to about 1e-9 of the rise. A part of a mix is one affine map of its start and of the heat that the other
parts bring into the housing, see ``drive/mixed_heat.py``.
"""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.periodic_heat import STEADY
from drivetrain.sizing.tolerance import scatter_numbers as k
from drivetrain.sizing.tolerance.lanes import (
    Lanes,
    highest,
    largest_of,
    lowest,
    magnitude,
    njit_lanes,
    put,
    root,
    row,
    spread,
    where_less,
)
from drivetrain.sizing.tolerance.scatter_blocks import NO_HEAT, ONE_NODE, STEADY_HEAT
from drivetrain.sizing.tolerance.scatter_exponentials import exponential_shares, matrix_exponential
from drivetrain.sizing.tolerance.scatter_numbers import Memory, ScatterTask

MATCHED = 1e-4  # K between magnets put in and magnets that come out, before the last step of the secant
STILL = 1e-9  # K: magnets that move less are found
MOST_STEPS = 40
ENDLESS = 1e100  # K: warmer is a runaway
MEAN = -1.0  # a model whose temperatures do not move; a float like all kinds, so that nothing is compiled twice


@njit_lanes
def interval_square(memory: Memory, t: int) -> Lanes:
    """The mean square of a torque, linear from a sample to the next.

    Returns:
        [N^2 m^2].
    """
    left, right = row(memory.torque, t), row(memory.torque, t + 1)
    return (left * left + left * right + right * right) * (1.0 / 3.0)


@njit_lanes
def _moments(task: ScatterTask, joint: int, memory: Memory) -> None:
    """Moments of the squared torque in each block."""
    first, step = task.blocks.first[joint], task.blocks.step
    offset, second = task.blocks.offset[joint], task.blocks.spread[joint]
    for block in range(task.blocks.part[joint, -1]):
        m0 = m1 = m2 = apart = spread(0.0)
        for t in range(first[block], first[block + 1]):
            square, h = interval_square(memory, t), step[t]
            heat = h * square
            # Each interval's heat times that of those before it and how far apart they are; then within itself.
            apart = apart + square * (offset[t] * m0 - h * m1) + (h / 6.0) * (heat * heat)
            m0 = m0 + heat
            m1 = m1 + offset[t] * square
            m2 = m2 + second[t] * square
        put(memory.moments, 4 * block, m0)
        put(memory.moments, 4 * block + 1, m1)
        put(memory.moments, 4 * block + 2, 0.5 * m2)
        put(memory.moments, 4 * block + 3, 0.5 * apart - task.blocks.length[joint, block] / 12.0 * (m0 * m0))


@njit_lanes
def _of_part(task: ScatterTask, joint: int, part: int, memory: Memory) -> tuple[float, float, Lanes]:
    """Length [s], mean loss in the housing [W] and mean squared torque of a part."""
    length, lost, total = 0.0, 0.0, spread(0.0)
    for block in range(task.blocks.part[joint, part], task.blocks.part[joint, part + 1]):
        length += task.blocks.length[joint, block]
        lost += task.loss[joint, block, 0]
        total = total + row(memory.moments, 4 * block)
    return length, lost / length, total / length


@njit_lanes
def _copper(p: Array, magnets: Lanes, lane: Array) -> tuple[Lanes, Lanes]:
    """Copper loss at ambient temperature and its slope a squared torque; endless where no torque constant is left."""
    constant = row(lane, k.TORQUE_CONSTANT) * (1.0 + p[k.MAGNET] * (magnets - p[k.REFERENCE]))
    scale = where_less(0.0, constant, 1.0 / (constant * constant), ENDLESS)
    return scale * row(lane, k.OHMS), scale * row(lane, k.SLOPE)


# long kernel: the parts of a mix are summed up and then told apart
@njit_lanes
def _mean(task: ScatterTask, joint: int, magnets: Lanes, memory: Memory) -> Lanes:
    """Mean housing rise with temperatures that do not move; those of the windings are left as states at the start."""
    p, lane, heat = task.numbers[joint], memory.lane, memory.heat
    inner, outer = p[k.INNER] * row(lane, k.THERMAL), p[k.OUTER] * row(lane, k.THERMAL)
    ohms, slope = _copper(p, magnets, lane)
    rubbing, parts = row(lane, k.RUBBING), len(task.share)
    needed = gained = hottest = spread(0.0)
    for part in range(parts):
        _, lost, square = _of_part(task, joint, part, memory)
        copper, grown, loss = ohms * square, slope * square, rubbing * lost
        left = 1.0 - inner * grown
        if p[k.INNER] == 0.0:
            alone = 1.0 - outer * grown
            rise = where_less(0.0, alone, outer * (copper + loss) / alone, np.inf)
            hottest = highest(hottest, rise)
            put(heat, k.HEAT_ROWS * part + k.X0, rise)
            continue
        needed = where_less(0.0, left, needed + task.share[part] * (loss + copper / left), np.inf)
        gained = where_less(0.0, left, gained + task.share[part] * (1.0 / outer - grown / left), -np.inf)
    if p[k.INNER] == 0.0:
        return hottest
    housing = where_less(0.0, gained, needed / gained, np.inf)
    for part in range(parts):
        _, _, square = _of_part(task, joint, part, memory)
        put(heat, k.HEAT_ROWS * part + k.X0, (inner * ohms * square + housing) / (1.0 - inner * slope * square))
    return housing


# long kernel: one pass over the motion with the map of the start carried beside
@njit_lanes
def _one_node(task: ScatterTask, joint: int, magnets: Lanes, memory: Memory) -> Lanes:
    """Hottest mean rise of the parts of a motor of one node, interval by interval; states at the start of each."""
    p, lane, step = task.numbers[joint], memory.lane, task.blocks.step
    ohms, slope = _copper(p, magnets, lane)
    capacity, loss = p[k.WINDING_CAPACITY], task.series[joint, k.LOSS]
    source, growth, lost = ohms * (1.0 / capacity), slope * (1.0 / capacity), row(lane, k.RUBBING) * (1.0 / capacity)
    cooling, hottest = 1.0 / (p[k.OUTER] * capacity * row(lane, k.THERMAL)), spread(0.0)
    for part in range(len(task.share)):
        first, last = task.blocks.part[joint, part], task.blocks.part[joint, part + 1]
        x, sum_x, sum_grown, length = spread(0.0), spread(0.0), spread(0.0), 0.0
        grown = spread(1.0)
        for t in range(task.blocks.first[joint, first], task.blocks.first[joint, last]):
            h, square = step[t], interval_square(memory, t)
            rate = growth * square - cooling
            f, s = exponential_shares(rate * h)
            push, push_grown = rate * x + (source * square + lost * loss[t]), rate * grown
            sum_x = sum_x + h * (x + h * (push * s))
            sum_grown = sum_grown + h * (grown + h * (push_grown * s))
            x, grown = x + h * (push * f), grown + h * (push_grown * f)
            length += h
        start = where_less(grown, 1.0, x / (1.0 - grown), np.inf)
        hottest = where_less(
            start, ENDLESS, highest(hottest, (sum_x + start * sum_grown) / length), np.inf
        )  # fmt: skip
        at = k.HEAT_ROWS * part
        put(memory.heat, at + k.X0, start)
        put(memory.heat, at + k.A, cooling)
        put(memory.heat, at + k.D, cooling)
        put(memory.heat, at + k.SOURCE, source)
        put(memory.heat, at + k.GROWTH, growth)
        put(memory.heat, at + k.LOSS_IN, lost)
    return hottest


@njit_lanes
def _block(task: ScatterTask, joint: int, block: int, at: int, memory: Memory, unit: Lanes) -> tuple[
    Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes
]:  # fmt: skip
    """What a block does to the rises of winding and housing; last two: what a watt in the housing adds."""
    heat, h = memory.heat, task.blocks.length[joint, block]
    a, b, c, d = row(heat, at + k.A), row(heat, at + k.B), row(heat, at + k.C), row(heat, at + k.D)
    rho, gamma, eta = row(heat, at + k.SOURCE), row(heat, at + k.GROWTH), row(heat, at + k.LOSS_OUT)
    m0, m1 = row(memory.moments, 4 * block), row(memory.moments, 4 * block + 1)
    m2, twice = row(memory.moments, 4 * block + 2), gamma * row(memory.moments, 4 * block + 3)
    n0, n1, bc = eta * task.loss[joint, block, 0], eta * task.loss[joint, block, 1], b * c
    skew, bent = m2 * (a - d), gamma * m2 * b
    return matrix_exponential(
        gamma * (m0 + 2.0 * (m2 * bc)) - a * h,
        b * (h + gamma * (m1 + skew - twice)),
        c * (h - gamma * (m1 - skew + twice)),
        -d * h - 2.0 * (gamma * (m2 * bc)),
        rho * (m0 + (m1 - twice) * a + m2 * (a * a + bc)) - n1 * b + bent * n0 * (1.0 / h if h > 0.0 else 0.0),
        n0 + n1 * d - rho * c * (m1 + m2 * (a + d) + twice),
        bent * unit,
        unit * h,
    )


# long kernel: map, integral of the housing and what the others bring are carried together
@njit_lanes
def _part(task: ScatterTask, joint: int, part: int, memory: Memory, unit: Lanes) -> tuple[Lanes, Lanes, Lanes]:
    """Determinant, and the mean housing rise times it without and with a watt brought; the map goes to memory."""
    heat, at, mixed = memory.heat, k.HEAT_ROWS * part, len(task.share) > 1
    c, d, eta = row(heat, at + k.C), row(heat, at + k.D), row(heat, at + k.LOSS_OUT)
    a00 = a11 = spread(1.0)
    a01 = a10 = w0 = w1 = g0 = g1 = i0 = i1 = iw = ig = spread(0.0)
    length = 0.0
    for block in range(task.blocks.part[joint, part], task.blocks.part[joint, part + 1]):
        h = task.blocks.length[joint, block]
        e00, e01, e10, e11, v0, v1, u0, u1 = _block(task, joint, block, at, memory, unit)
        mean, bend = 0.5 * h, h * h / 12.0
        y0, y1 = e00 * a00 + e01 * a10, e10 * a00 + e11 * a10
        i0 = i0 + (mean * (a10 + y1) + bend * (c * (a00 - y0) - d * (a10 - y1)))
        a00, a10 = y0, y1
        y0, y1 = e00 * a01 + e01 * a11, e10 * a01 + e11 * a11
        i1 = i1 + (mean * (a11 + y1) + bend * (c * (a01 - y0) - d * (a11 - y1)))
        a01, a11 = y0, y1
        y0, y1 = e00 * w0 + e01 * w1 + v0, e10 * w0 + e11 * w1 + v1
        iw = iw + (mean * (w1 + y1) + bend * (c * (w0 - y0) - d * (w1 - y1)) - eta * task.loss[joint, block, 1])
        w0, w1 = y0, y1
        if mixed:
            y0, y1 = e00 * g0 + e01 * g1 + u0, e10 * g0 + e11 * g1 + u1
            ig = ig + (mean * (g1 + y1) + bend * (c * (g0 - y0) - d * (g1 - y1)))
            g0, g1 = y0, y1
        length += h
    size = magnitude(a00) + magnitude(a01) + magnitude(a10) + magnitude(a11) + magnitude(w0) + magnitude(w1)
    middle, off = 0.5 * (a00 + a11), 0.5 * (a00 - a11)
    radius = middle + root(highest(off * off + a01 * a10, 0.0))
    det = (1.0 - a00) * (1.0 - a11) - a01 * a10
    det = where_less(size, ENDLESS, det if mixed else where_less(radius, 1.0, det, 0.0), 0.0)
    x0, x1 = (1.0 - a11) * w0 + a01 * w1, (1.0 - a00) * w1 + a10 * w0
    z0, z1 = (1.0 - a11) * g0 + a01 * g1, (1.0 - a00) * g1 + a10 * g0
    for i, value in enumerate((x0, x1, z0, z1)):
        put(memory.map, 4 * part + i, value)
    return det, (i0 * x0 + i1 * x1 + iw * det) / length, (i0 * z0 + i1 * z1 + ig * det) / length


# long kernel: rates, maps and balance of all parts share their numbers
@njit_lanes
def _two_nodes(task: ScatterTask, joint: int, magnets: Lanes, memory: Memory) -> Lanes:
    """Mean housing rise of the periodic state; states at the start of each part, and what others bring."""
    p, lane, heat, parts = task.numbers[joint], memory.lane, memory.heat, len(task.share)
    ohms, slope = _copper(p, magnets, lane)
    inner, outer = p[k.INNER] * row(lane, k.THERMAL), p[k.OUTER] * row(lane, k.THERMAL)
    inward, winding = 1.0 / inner, 1.0 / p[k.WINDING_CAPACITY]
    needed = gained = spread(0.0)
    stable = spread(1.0)
    for part in range(parts):
        length, _, square = _of_part(task, joint, part, memory)
        unit = spread(1.0 / p[k.HOUSING_CAPACITY])
        if np.isnan(p[k.HOUSING_CAPACITY]):
            unit = outer * (1.0 / (STEADY * length))
        at = k.HEAT_ROWS * part
        put(heat, at + k.A, inward * winding)
        put(heat, at + k.B, inward * winding)
        put(heat, at + k.C, inward * unit)
        put(heat, at + k.D, (inward + 1.0 / outer) * unit)
        put(heat, at + k.SOURCE, ohms * winding)
        put(heat, at + k.GROWTH, slope * winding)
        put(heat, at + k.LOSS_OUT, row(lane, k.RUBBING) * unit)
        put(heat, at + k.UNIT, unit)
        det, mean, more = _part(task, joint, part, memory, unit)
        if parts == 1:
            put(heat, at + k.X0, row(memory.map, 0) / det)
            put(heat, at + k.X1, row(memory.map, 1) / det)
            return where_less(magnitude(det), 1e-300, np.inf, mean / det)
        stable = where_less(slope * square, inward, where_less(magnitude(det), 1e-300, 0.0, stable), 0.0)
        put(heat, at + k.X0, det)
        put(heat, at + k.BROUGHT, -mean / more)
        put(heat, at + k.X1, det / more)
        needed = needed + task.share[part] * (mean / more)
        gained = gained + task.share[part] * (det / more)
    housing = where_less(0.0, lowest(gained, stable - 0.5), needed / gained, np.inf)
    for part in range(parts):
        at = k.HEAT_ROWS * part
        brought, det = row(heat, at + k.BROUGHT) + housing * row(heat, at + k.X1), row(heat, at + k.X0)
        put(heat, at + k.BROUGHT, brought)
        put(heat, at + k.X0, (row(memory.map, 4 * part) + row(memory.map, 4 * part + 2) * brought) / det)
        put(heat, at + k.X1, (row(memory.map, 4 * part + 1) + row(memory.map, 4 * part + 3) * brought) / det)
    return housing


@njit_lanes
def _reached(kind: float, task: ScatterTask, joint: int, magnets: Lanes, memory: Memory) -> Lanes:
    """Mean housing temperature that magnets of a temperature make; infinite in a runaway."""
    if kind == ONE_NODE:
        rise = _one_node(task, joint, magnets, memory)
    elif kind == MEAN:
        rise = _mean(task, joint, magnets, memory)
    else:
        rise = _two_nodes(task, joint, magnets, memory)
    return where_less(rise, ENDLESS, row(memory.lane, k.AMBIENT) + rise, np.inf)


# long kernel: the secant of many arms, each of which stops by itself
@njit_lanes
def _settled(
    kind: float, task: ScatterTask, joint: int, start: Lanes, slope: Lanes, near: Lanes, memory: Memory
) -> Lanes:
    """Magnet temperature that the mean housing temperature confirms, infinite where there is none.

    ``near``: how far what comes out may be from what was put in for the last step, in which the slope is right.
    """
    previous, reached = start, _reached(kind, task, joint, start, memory)
    runs = where_less(reached, np.inf, 0.0, 1.0)
    reached = where_less(runs, 0.5, reached, previous)
    magnets = previous + (reached - previous) / (1.0 - slope)
    done = runs
    for _ in range(MOST_STEPS):
        done = where_less(magnitude(magnets - previous), STILL, 1.0, done)
        if largest_of(-1.0 * done) == -1.0:
            break
        found = _reached(kind, task, joint, magnets, memory)
        grown = (found - reached) / (magnets - previous)
        over = where_less(found, np.inf, where_less(grown, 1.0, 0.0, 1.0), 1.0)
        close = where_less(magnitude(found - magnets), near * (1.0 - slope), 1.0, 0.0)
        over = where_less(close, 0.5, over, 0.0)
        runs = where_less(done, 0.5, over, runs)
        slope = where_less(close, 0.5, grown, slope)
        moved = magnets + (found - magnets) / (1.0 - slope)
        going = where_less(done, 0.5, 1.0 - over, 0.0)
        previous = where_less(0.5, going, magnets, previous)
        reached = where_less(0.5, going, found, reached)
        magnets = where_less(0.5, going, moved, magnets)
        done = highest(done, highest(close, runs))
    return where_less(runs, 0.5, magnets, np.inf)


# long kernel: guess, settling and what is left for those that run away are one chain
@njit_lanes
def settle(task: ScatterTask, joint: int, memory: Memory) -> None:
    """The periodic state of one motor."""
    p, lane, heat = task.numbers[joint], memory.lane, memory.heat
    kind, ambient = p[k.KIND], row(lane, k.AMBIENT)
    for i in range(len(heat)):
        put(heat, i, spread(0.0))
    magnets, runs = ambient, spread(1.0)
    if kind != NO_HEAT:
        _moments(task, joint, memory)
        magnets = _settled(MEAN, task, joint, ambient, spread(0.0), spread(0.0), memory)
        if kind != STEADY_HEAT:
            known = where_less(magnets, np.inf, 1.0, 0.0)
            start = where_less(0.5, known, magnets, ambient)
            nudged = _mean(task, joint, start + 1.0, memory) - _mean(task, joint, start, memory)
            slope = where_less(0.5, known, lowest(nudged, 0.99), 0.0)
            magnets = _settled(kind, task, joint, start, slope, MATCHED * known, memory)
        runs = where_less(magnets, np.inf, 0.0, 1.0)
        magnets = where_less(runs, 0.5, magnets, ambient)
        if kind == STEADY_HEAT:
            _mean(task, joint, magnets, memory)
        else:
            _reached(kind, task, joint, magnets, memory)
    put(lane, k.MAGNETS, magnets)
    put(lane, k.RUNS_AWAY, runs)
    hot = spread(0.0) if np.isnan(p[k.HOTTEST]) else p[k.HOTTEST] - ambient
    for part in range(len(task.share)):
        for i in range(k.HEAT_ROWS):
            at = k.HEAT_ROWS * part + i
            put(heat, at, where_less(runs, 0.5, row(heat, at), hot if i == k.X0 else spread(0.0)))
