"""Periodic winding and housing temperature of a repeated torque cycle, or of a mix of several.

The resistance follows the winding temperature at every instant, the torque constant the mean housing temperature. The
periodic state of the two nodes is solved directly: a cycle of losses is an affine map of the two temperature rises.

For a mix it is unknown how long each part runs before the next one starts. The assumptions are conservative for the
winding:

- Parts alternate fast compared with the housing, so all of them share one mean housing temperature, which follows
  from the mean heat of the mix. (A part that runs for longer than the housing's time constant is a study of its own.)
- Parts alternate slowly compared with the winding, so in each part the winding reaches that part's own periodic state
  above the common housing. Faster alternation only averages its temperature.
- A motor with a single-node data sheet has no housing that averages the heat: each part reaches its own periodic
  state, and the hottest one counts.
- A part may follow any other. The largest temperature is that of parts that begin as warm as the warmest one leaves
  the winding; from there each part cools towards its own periodic state, unless that is as warm.

Each part of a mix is therefore a periodic cycle with a constant heat injected into its housing, such that the mean
housing temperature is the common one. Weighted by time, these heats cancel over the mix.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.linear_interval import mean_square
from drivetrain.drive.motor import copper_coefficient, winding_resistance
from drivetrain.drive.motor_limits import WINDING_SHARE, thermal_path
from drivetrain.drive.thermal.exponentials import first, second
from drivetrain.jit import FAST, law
from drivetrain.records import UNKNOWN, known, known_or, record_type
from drivetrain.vector import larger

STEADY = 1e4  # in cycles: time constant of a housing of unknown capacity, which then stays at its mean
GROWN_BEYOND = 1e100  # entries of a cycle's map above which the losses run away; their squares are still finite
MAGNET_TOLERANCE = 1e-6  # tolerance between assumed and resulting magnet temperature [K]
MOST_STEPS = 40
SAME = 1e-12  # share of a peak by which an earlier one may lie below it by rounding alone
SHORT = 0.2  # longest piece of an interval in which the largest rise is sought, in units of the shorter time constant
CHAIN = {"contract"}  # for loops in which each step waits for the one before: reordered sums would lengthen the wait
AT_ONCE = 128  # steps that are searched together for long ones
SMALL = 0.05  # product of rate and step below which seven terms of the exponential's series are exact to rounding


class Nodes(NamedTuple):
    """Thermal nodes of a motor in its mounting; NaN where unknown."""

    # Resistances from winding to housing (0 for a single node) and from housing to ambient [K/W].
    inner: float
    outer: float
    # Heat capacities [J/K]; the first is that of the whole motor for a single node.
    winding: float
    housing: float


class Copper(NamedTuple):
    """Copper loss of a torque: R(T) (torque / kt(T_magnets))^2."""

    resistance: float  # at ambient temperature [ohm]
    slope: float  # change with temperature [ohm/K]
    # Torque constant [N m/A], its change with magnet temperature [1/K], and its reference temperature [C].
    constant: float
    coefficient: float
    reference: float


class Steps(NamedTuple):
    """The exact step over an interval, an affine map of the two rises x; or those over some intervals, (M,) each."""

    # Change of x = [[ww, wh], [hw, hh]] x + [add_w, add_h]: small, and exact to its own rounding.
    ww: Any
    wh: Any
    hw: Any
    hh: Any
    add_w: Any
    add_h: Any
    # Integral of the winding's rise = sum_w x_w + sum_h x_h + sum_add.
    sum_w: Any
    sum_h: Any
    sum_add: Any


class Losses(NamedTuple):
    """Losses from each sample to the next, and memory for the solution; (N + 1,) each."""

    square: Array  # mean square of the torque [N^2 m^2]
    held: Array  # mean square torque of the most loaded phase above that of the winding, at rest [N^2 m^2]
    housing: Array  # mean loss in the housing [W]
    memory: Array  # a row for each field of ``Steps``, (9, N + 1); one array, as each costs time in every call
    # Temperatures at the samples, each part in its own periodic state [C].
    winding_at: Array
    housing_at: Array


def new_losses(samples: int) -> Losses:
    """Arrays for a number of samples."""
    row, rows = np.zeros(samples + 1), np.zeros((len(Steps._fields), samples + 1))
    return Losses(row, row.copy(), row.copy(), rows, row.copy(), row.copy())


class Periods(NamedTuple):
    """Use of a motor: one cycle, or a mix of parts that each repeat on their own."""

    edges: Any  # first sample of each part, and the one after the last, (P + 1,)
    shares: Array  # share of the operating time of each part; the sum is 1
    # time from each sample to the next of its part [s], 0 at its last; arbitrary in a part of one sample, (N,)
    step: Array


def periods_of(time: Array, parts: Sequence[slice], shares: Sequence[float]) -> Periods:
    """The periods of samples that repeat part by part."""
    steps = np.append(np.diff(time), 0.0)
    steps[[part.stop - 1 for part in parts]] = 0.0
    steps[[part.start for part in parts if part.stop == part.start + 1]] = 1.0  # arbitrary length
    edges = np.array([*(part.start for part in parts), len(time)], dtype=np.int64)
    return Periods(edges, np.array(shares, dtype=np.float64), steps)


@dataclass(frozen=True)
class PartHeat:
    """State of one part of the mix: rises over ambient [K] at a mean housing rise of 0, and their slopes over it."""

    length: float = 0.0  # duration of a period [s]
    # Mean square of the torque [N^2 m^2], mean loss in the housing [W].
    square: float = 0.0
    loss: float = 0.0
    # Rises at the start of a period, and mean rise of the winding [K].
    start_winding: float = 0.0
    start_housing: float = 0.0
    winding: float = 0.0
    injected: float = 0.0  # heat that the other parts inject into the housing [W]
    # Slopes of these values over the mean housing rise.
    start_winding_slope: float = 0.0
    start_housing_slope: float = 0.0
    winding_slope: float = 0.0
    injected_slope: float = 0.0
    housing: float = 0.0  # mean rise of the housing [K]


def new_parts(count: int) -> Any:
    """Records for a number of parts."""
    return np.zeros(count, record_type(PartHeat))


class Heat(NamedTuple):
    """The periodic state; infinite temperatures in a runaway: losses grow faster with temperature than cooling."""

    magnets: float  # temperature of the torque constant: the mean housing temperature [C]
    # Mean temperatures [C].
    winding: float
    housing: float
    peak: float  # largest winding temperature, also between samples [C]
    peak_time: float  # its time since the start of its part [s]
    peak_part: int  # part of the largest winding temperature
    converged: bool  # whether magnet and mean housing temperature could be matched
    # share of a small temperature disturbance that remains after a cycle; NaN for a mix or a constant load
    radius: float


@law
def thermal_nodes(motor: Any, mounting: Any) -> Any:
    """The thermal nodes of a motor, with the capacities of the data sheet C_w = t_w/R1 and C_h = t_h/R2.

    Another ``mounting`` [K/W] therefore changes the housing's time constant but not its capacity.
    """
    inner, outer = thermal_path(motor, mounting)
    if inner == 0.0:
        constant = known_or(motor.winding_time_constant, motor.housing_time_constant)
        return Nodes(0.0, outer, constant / outer, UNKNOWN)
    printed = thermal_path(motor, UNKNOWN)
    sheet = printed[1] if known(printed[0] + printed[1]) else outer
    return Nodes(inner, outer, motor.winding_time_constant / inner, motor.housing_time_constant / sheet)


@law
def copper_of(motor: Any, ambient: Any) -> Any:
    """The copper loss of a motor at an ambient temperature [C]."""
    slope = motor.resistance * copper_coefficient(motor.reference_temperature)
    cold = winding_resistance(motor, ambient)
    return Copper(cold, slope, motor.torque_constant, motor.magnet_coefficient, motor.reference_temperature)


@law
def per_torque(copper: Any, magnets: Any) -> Any:
    """Copper loss at ambient and its slope, over squared torque; infinite if the torque constant is not positive."""
    constant = copper.constant * (1.0 + copper.coefficient * (magnets - copper.reference))
    if not (constant > 0.0 and magnets < np.inf):
        return np.inf, np.inf
    return copper.resistance / constant**2, copper.slope / constant**2


@law(fastmath=FAST)
def interval_means(torque: Any, loss: Any, losses: Any) -> None:
    """Mean square torque and mean loss from each sample to the next, both linear between samples."""
    before, after, lost, loses = torque[:-1], torque[1:], loss[:-1], loss[1:]
    for t in range(len(before)):
        losses.square[t] = mean_square(before[t], after[t])
        losses.housing[t] = 0.5 * (lost[t] + loses[t])
    losses.square[len(before)], losses.housing[len(before)] = torque[-1] * torque[-1], loss[-1]


@law
def intervals(periods: Any, i: Any) -> Any:
    """First interval of a part, and the one after its last; a part of one sample is a constant load."""
    return periods.edges[i], max(periods.edges[i + 1] - 1, periods.edges[i] + 1)


@law(fastmath=FAST)
def part_means(periods: Any, losses: Any, parts: Any) -> None:
    """Duration, mean square torque and mean loss of each part."""
    for i in range(len(parts)):
        begin, end = intervals(periods, i)
        steps, squares, housing = periods.step[begin:end], losses.square[begin:end], losses.housing[begin:end]
        length, square, loss = 0.0, 0.0, 0.0
        for k in range(len(steps)):
            length += steps[k]
            square += steps[k] * squares[k]
            loss += steps[k] * housing[k]
        parts[i].length, parts[i].square, parts[i].loss = length, square / length, loss / length


# The exact step of two coupled nodes.
#
# On each interval the two rises x obey x' = M x + s, M = [[growth - a, b], [c, -d]] constant. Both exponentials follow
# from the two real eigenvalues of M, through functions that stay accurate where these nearly coincide or vanish, so
# that neither intervals of zero length nor a momentary balance of heating and cooling need a special case.


class Flow(NamedTuple):
    """Heat flow between the nodes in a part, and heating rates per kelvin, squared torque and watt."""

    # Rates of the matrix above, without the growth [1/s].
    a: float
    b: float
    c: float
    d: float
    # For a mean square torque of 1: growth rate [1/s] and heating rate [K/s].
    growth: float
    source: float
    # Heating rates of winding and housing per watt of loss in the housing [K/s].
    inside: float
    outside: float
    injected: float  # heating rate of the housing by the injected heat [K/s]


@law
def flow_of(nodes: Any, length: Any, cold: Any, slope: Any, injected: Any) -> Any:
    """The heat flow in a part of a given length, with injected heat [W] and copper losses as from ``per_torque``."""
    winding = 1.0 / nodes.winding
    if nodes.inner == 0.0:  # single node
        rate = winding / nodes.outer
        return Flow(rate, 0.0, 0.0, rate, slope * winding, cold * winding, winding, 0.0, 0.0)
    exchange, housing = 1.0 / nodes.inner, 1.0 / known_or(nodes.housing, STEADY * length / nodes.outer)
    return Flow(
        exchange * winding, exchange * winding, exchange * housing, (exchange + 1.0 / nodes.outer) * housing,
        slope * winding, cold * winding, 0.0, housing, injected * housing,
    )  # fmt: skip


@law
def _exact(step: Any, m00: Any, b: Any, c: Any, m11: Any) -> Any:
    """The integrals of one interval of any length: (p, q, u, v)."""
    mean = 0.5 * (m00 + m11)
    spread = math.sqrt(0.25 * (m00 - m11) ** 2 + b * c)
    x1 = (mean + spread) * step
    x2 = (mean - spread) * step
    f1, f2 = first(x1), first(x2)
    g1, g2 = second(x1, f1), second(x2, f2)
    inverse = 0.5 / spread if spread > 0.0 else 0.0
    square = step * step
    return 0.5 * step * (f1 + f2), step * (f1 - f2) * inverse, 0.5 * square * (g1 + g2), square * (g1 - g2) * inverse


@law(fastmath=FAST)
def step_of(flow: Any, m00: Any, square: Any, loss: Any, p: Any, q: Any, u: Any, v: Any) -> Any:
    """The exact step over an interval, in the order of ``Steps``, for S = p I + q (M - m I) and Q = u I + v (M - m I),
    with m the mean of M's diagonal; ``square``: mean square of the torque, ``loss``: mean loss in the housing.

    S is the integral of e^(M t) over the interval, Q the integral of S; e^(M t) - I = S M.
    """
    b, c, d, half = flow.b, flow.c, flow.d, 0.5 * (m00 + flow.d)
    s00, s01, s10, s11 = p + q * half, q * b, q * c, p - q * half
    h0, h1 = flow.source * square + flow.inside * loss, flow.outside * loss + flow.injected
    return Steps(
        s00 * m00 + s01 * c, s00 * b - s01 * d, s10 * m00 + s11 * c, s10 * b - s11 * d,
        s00 * h0 + s01 * h1, s10 * h0 + s11 * h1, s00, s01, (u + v * half) * h0 + v * b * h1,
    )  # fmt: skip


@law
def steps_within(losses: Any, begin: Any, end: Any) -> Any:
    """The steps over some intervals."""
    rows, some = losses.memory, slice(begin, end)
    return Steps(
        rows[0][some], rows[1][some], rows[2][some], rows[3][some], rows[4][some], rows[5][some], rows[6][some],
        rows[7][some], rows[8][some],
    )  # fmt: skip


@law(fastmath=FAST)
def set_steps(lengths: Any, losses: Any, begin: Any, end: Any, flow: Any) -> None:
    """Set the steps over some intervals.

    Intervals that are short compared with every time constant use truncated series, which vectorise; long ones (dwells)
    are computed again.
    """
    a, cross, d, growth = flow.a, flow.b * flow.c, flow.d, flow.growth
    lengths, squares, housing = lengths[begin:end], losses.square[begin:end], losses.housing[begin:end]
    ww, wh, hw, hh, add_w, add_h, sum_w, sum_h, sum_add = steps_within(losses, begin, end)
    slowest = 0.0
    for k in range(len(lengths)):
        h, m00 = lengths[k], growth * squares[k] - a
        y, half = 0.5 * h * (m00 - d), 0.5 * (m00 + d)
        z = h * h * (half * half + cross)
        # Even and odd parts of the powers of (y + w) and (y - w), w^2 = z, over the factorials.
        e2, o2 = y * y + z, y + y
        e3, o3 = y * e2 + z * o2, e2 + y * o2
        e4, o4 = y * e3 + z * o3, e3 + y * o3
        e5, o5 = y * e4 + z * o4, e4 + y * o4
        e6, o6 = y * e5 + z * o5, e5 + y * o5
        e7, o7 = y * e6 + z * o6, e6 + y * o6
        square = h * h
        p = h * (1.0 + y / 2.0 + e2 / 6.0 + e3 / 24.0 + e4 / 120.0 + e5 / 720.0 + e6 / 5040.0 + e7 / 40320.0)
        q = square * (0.5 + o2 / 6.0 + o3 / 24.0 + o4 / 120.0 + o5 / 720.0 + o6 / 5040.0 + o7 / 40320.0)
        u = square * (0.5 + y / 6.0 + e2 / 24.0 + e3 / 120.0 + e4 / 720.0 + e5 / 5040.0 + e6 / 40320.0)
        v = square * h * (1.0 / 6.0 + o2 / 24.0 + o3 / 120.0 + o4 / 720.0 + o5 / 5040.0 + o6 / 40320.0)
        ww[k], wh[k], hw[k], hh[k], add_w[k], add_h[k], sum_w[k], sum_h[k], sum_add[k] = step_of(
            flow, m00, squares[k], housing[k], p, q, u, v
        )
        slowest = larger(slowest, h * (flow.c + d + larger(a, m00) + flow.b))
    for k in range(len(lengths) if slowest >= SMALL else 0):
        m00 = growth * squares[k] - a
        if lengths[k] * (flow.c + d + larger(a, m00) + flow.b) >= SMALL:
            p, q, u, v = _exact(lengths[k], m00, flow.b, flow.c, -d)
            ww[k], wh[k], hw[k], hh[k], add_w[k], add_h[k], sum_w[k], sum_h[k], sum_add[k] = step_of(
                flow, m00, squares[k], housing[k], p, q, u, v
            )


class CycleMap(NamedTuple):
    """Affine map of the two rises x over one cycle, and of the winding's mean rise."""

    # Coefficients of x_end = [[ww, wh], [hw, hh]] x_start + [w, h].
    ww: float
    wh: float
    hw: float
    hh: float
    w: float
    h: float
    # Mean rise of the winding = mean_ww x_w + mean_wh x_h + mean_w.
    mean_ww: float
    mean_wh: float
    mean_w: float


@law(fastmath=CHAIN)
def cycle_map(lengths: Any, losses: Any, begin: Any, end: Any) -> Any:
    """The map of a cycle, from the steps in ``losses``."""
    a00, a01, a10, a11, r0, r1 = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    b0, b1, w0, length, lengths = 0.0, 0.0, 0.0, 0.0, lengths[begin:end]
    steps = steps_within(losses, begin, end)
    for k in range(len(lengths)):
        ww, wh, hw, hh = steps.ww[k], steps.wh[k], steps.hw[k], steps.hh[k]
        b0 += steps.sum_w[k] * a00 + steps.sum_h[k] * a10
        b1 += steps.sum_w[k] * a01 + steps.sum_h[k] * a11
        w0 += steps.sum_w[k] * r0 + steps.sum_h[k] * r1 + steps.sum_add[k]
        a00, a10 = (a00 + ww * a00) + wh * a10, (a10 + hh * a10) + hw * a00
        a01, a11 = (a01 + ww * a01) + wh * a11, (a11 + hh * a11) + hw * a01
        r0, r1 = (r0 + ww * r0) + (steps.add_w[k] + wh * r1), (r1 + hh * r1) + (steps.add_h[k] + hw * r0)
        length += lengths[k]
    return CycleMap(a00, a01, a10, a11, r0, r1, b0 / length, b1 / length, w0 / length)


@law(fastmath=CHAIN)
def cycle_trace(lengths: Any, losses: Any, begin: Any, end: Any, flow: Any, start: Any, ambient: Any) -> Any:
    """Set the temperatures at the ends of all intervals for initial rises; the winding's largest rise and its time.

    Uses the steps in ``losses``; within long intervals the largest rise is sought too.
    """
    x0, x1 = start
    lengths, squares, loss = lengths[begin:end], losses.square[begin:end], losses.housing[begin:end]
    winding, housing = losses.winding_at[begin : end + 1], losses.housing_at[begin : end + 1]
    steps, longest = steps_within(losses, begin, end), SHORT / (flow.a + flow.d)
    winding[0], housing[0] = ambient + x0, ambient + x1
    inside, inside_time, time = -np.inf, 0.0, 0.0
    for k in range(len(lengths)):
        if lengths[k] > longest:
            rise, at = _highest_within(flow, lengths[k], squares[k], loss[k], x0, x1)
            if rise > inside:
                inside, inside_time = rise, time + at
        x0, x1 = (
            (x0 + steps.ww[k] * x0) + (steps.add_w[k] + steps.wh[k] * x1),
            (x1 + steps.hh[k] * x1) + (steps.add_h[k] + steps.hw[k] * x0),
        )
        winding[k + 1], housing[k + 1] = ambient + x0, ambient + x1
        time += lengths[k]
    highest = -np.inf
    for k in range(len(winding)):
        highest = larger(highest, winding[k])
    peak, time, k = highest - ambient, 0.0, 0
    if inside > peak + SAME * abs(peak):
        return inside, inside_time
    while k < len(lengths) and winding[k] < highest - SAME * abs(peak):
        time += lengths[k]
        k += 1
    return peak, time


@law(fastmath=CHAIN)
def _highest_within(flow: Any, length: Any, square: Any, loss: Any, x0: Any, x1: Any) -> Any:
    """Largest rise of the winding at the ends of equal pieces of a long interval that begins with these rises, and its
    time in it.
    """
    pieces = 1 + int(min(511.0, length * (flow.a + flow.d) / SHORT))
    piece, m00, highest, at = length / pieces, flow.growth * square - flow.a, -np.inf, 0.0
    p, q, u, v = _exact(piece, m00, flow.b, flow.c, -flow.d)
    step = step_of(flow, m00, square, loss, p, q, u, v)
    for k in range(pieces):
        x0, x1 = x0 + step.ww * x0 + step.wh * x1 + step.add_w, x1 + step.hw * x0 + step.hh * x1 + step.add_h
        if x0 > highest:
            highest, at = x0, (k + 1) * piece
    return highest, at


# The periodic state of one part.


@law
def _still(nodes: Any, cold: Any, slope: Any, part: Any, shared: Any) -> Any:
    """State of a part with constant temperatures, for itself or as a linear function of the mean housing rise; and
    whether it exists.
    """
    rise = slope * part.square
    left = 1.0 - nodes.inner * rise
    copper = cold * part.square / left
    part.winding, part.winding_slope = nodes.inner * copper, 1.0 / left
    part.start_winding, part.start_winding_slope = part.winding, part.winding_slope
    part.start_housing, part.start_housing_slope = 0.0, 1.0
    part.injected, part.injected_slope = -part.loss - copper, 1.0 / nodes.outer - rise / left
    if not shared:
        _settled(part, -part.injected / part.injected_slope)
    return left > 0.0 and (shared or part.injected_slope > 0.0)


@law
def _start_of(cycle: Any, winding: Any, housing: Any) -> Any:
    """Initial rises that a cycle with these additions reproduces: (I - A) x = r."""
    determinant = (1.0 - cycle.ww) * (1.0 - cycle.hh) - cycle.wh * cycle.hw
    return (
        ((1.0 - cycle.hh) * winding + cycle.wh * housing) / determinant,
        ((1.0 - cycle.ww) * housing + cycle.hw * winding) / determinant,
    )


@law
def _means_of(nodes: Any, cycle: Any, winding: Any, housing: Any, loss: Any) -> Any:
    """Mean rises of a periodic cycle from its initial rises and the mean loss in the housing [W].

    That of the housing follows from its heat balance, (T_w - T_h)/R1 + P = T_h/R2; it is the winding's for one node.
    """
    mean = cycle.mean_ww * winding + cycle.mean_wh * housing + cycle.mean_w
    return mean, (mean + nodes.inner * loss) * nodes.outer / (nodes.inner + nodes.outer)


@law
def _radius(cycle: Any) -> Any:
    """Share of a small temperature disturbance that remains after a cycle; infinite if its losses run away at once.

    The coupling of the rises is never negative, so the larger eigenvalue is real and is the spectral radius.
    """
    if not abs(cycle.ww) + abs(cycle.hh) + abs(cycle.w) + abs(cycle.h) + abs(cycle.mean_w) < GROWN_BEYOND:
        return np.inf
    mean, half = 0.5 * (cycle.ww + cycle.hh), 0.5 * (cycle.ww - cycle.hh)
    return mean + math.sqrt(max(half * half + cycle.wh * cycle.hw, 0.0))  # rounding may give less than 0


@law
def _moving(nodes: Any, periods: Any, losses: Any, i: Any, cold: Any, slope: Any, part: Any, shared: Any) -> Any:
    """State of a part with varying temperatures, for itself or as a linear function of the mean housing rise; its
    spectral radius.

    Infinite in a runaway.
    """
    begin, end = intervals(periods, i)
    flow = flow_of(nodes, part.length, cold, slope, 0.0)
    set_steps(periods.step, losses, begin, end, flow)
    cycle = cycle_map(periods.step, losses, begin, end)
    radius = _radius(cycle)
    if shared and radius < np.inf:  # a housing cooled by the other parts stabilises what would run away alone
        radius = 0.0 if flow.growth * part.square < flow.a else np.inf
    if not radius < 1.0:
        return radius
    part.start_winding, part.start_housing = _start_of(cycle, cycle.w, cycle.h)
    part.winding, part.housing = _means_of(nodes, cycle, part.start_winding, part.start_housing, part.loss)
    part.injected = 0.0
    if shared:  # all values as linear functions of the mean housing rise
        one_watt = Flow(flow.a, flow.b, flow.c, flow.d, flow.growth, 0.0, 0.0, 0.0, flow.outside)
        set_steps(periods.step, losses, begin, end, one_watt)
        cycle = cycle_map(periods.step, losses, begin, end)
        winding, housing = _start_of(cycle, cycle.w, cycle.h)
        mean, warm = _means_of(nodes, cycle, winding, housing, 1.0)
        part.injected_slope, part.injected = 1.0 / warm, -part.housing / warm
        part.start_winding_slope, part.start_housing_slope, part.winding_slope = (
            winding / warm, housing / warm, mean / warm,
        )  # fmt: skip
        part.start_winding += winding * part.injected
        part.start_housing += housing * part.injected
        part.winding += mean * part.injected
    return radius


@law
def _settled(part: Any, rise: Any) -> None:
    """State of a part at a mean rise of the housing, from its linear functions."""
    part.start_winding += rise * part.start_winding_slope
    part.start_housing += rise * part.start_housing_slope
    part.winding += rise * part.winding_slope
    part.injected += rise * part.injected_slope
    part.housing = rise


# The periodic state of the mix.


@law
def _all_moving(nodes: Any, periods: Any, losses: Any, cold: Any, slope: Any, parts: Any, shared: Any) -> Any:
    """States of all parts with varying temperatures; spectral radius of the last, or of the first that runs away."""
    radius = np.inf
    for i in range(len(parts) if cold < np.inf else 0):
        radius = _moving(nodes, periods, losses, i, cold, slope, parts[i], shared)
        if not radius < 1.0:
            return radius
    return radius


@law
def _all_still(nodes: Any, cold: Any, slope: Any, parts: Any, shared: Any) -> Any:
    """States of all parts with constant temperatures; whether they exist."""
    for i in range(len(parts)):
        if not (cold < np.inf and _still(nodes, cold, slope, parts[i], shared)):
            return False
    return True


@law
def _mean_housing(shares: Any, parts: Any, shared: Any) -> Any:
    """Mean housing rise from the states of all parts; infinite if a warmer housing would not dissipate more heat."""
    hottest, needed, steep = -np.inf, 0.0, 0.0
    for i in range(len(parts)):
        needed += shares[i] * parts[i].injected
        steep += shares[i] * parts[i].injected_slope
        hottest = max(hottest, parts[i].housing)  # its magnets are the weakest, if each part is on its own
    if not shared:
        return hottest
    if not steep > 0.0:
        return np.inf
    for i in range(len(parts)):
        _settled(parts[i], -needed / steep)
    return -needed / steep


@law
def periodic_heat(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, ambient: Any) -> Any:
    """The temperatures of a use; ``square`` and ``housing`` of the losses are given.

    The magnets are at the resulting mean housing temperature. Weaker magnets heat more, at a rate that rises with their
    temperature: the fixed point of a convex map, on which the secant from the cold side never overshoots; a slope of 1
    or more means that there is none. The heat balance of the means is a close and cheap approximation for a single
    cycle, from which the search starts.
    """
    part_means(periods, losses, parts)
    moves, magnets, used, slope, rise, radius = known(nodes.winding), ambient, ambient, 0.0, 0.0, UNKNOWN
    shared, converged = len(parts) > 1 and nodes.inner != 0.0, False
    for state in (False, True):  # for a single cycle first its means, whose slope is close to that of its state
        if len(parts) > 1 and not state:
            continue
        reached = 0.0
        for step in range(MOST_STEPS):
            cold, warmer = per_torque(copper, magnets)
            if moves and state:
                radius = _all_moving(nodes, periods, losses, cold, warmer, parts, shared)
                exists = radius < 1.0
            else:
                exists = _all_still(nodes, cold, warmer, parts, shared)
            rise = _mean_housing(periods.shares, parts, shared) if exists else np.inf
            found = ambient + rise
            slope = (found - reached) / (magnets - used) if step > 0 else slope
            used, reached = magnets, found
            magnets = magnets + (found - magnets) / (1.0 - slope) if slope < 1.0 else np.inf
            converged = not (magnets < np.inf and abs(magnets - used) > MAGNET_TOLERANCE)
            if converged:
                break
        if not (state or magnets < np.inf):
            magnets, slope = ambient, 0.0
    if not magnets < np.inf:
        losses.winding_at[:], losses.housing_at[:] = np.inf, np.inf
        return Heat(ambient, np.inf, np.inf, np.inf, 0.0, 0, converged, np.inf)
    magnets = used  # those of the state
    winding, housing, start_winding, start_housing = ambient, ambient, -np.inf, -np.inf
    for i in range(len(parts)):
        winding += periods.shares[i] * parts[i].winding
        housing += periods.shares[i] * parts[i].housing
        start_winding = max(start_winding, parts[i].start_winding)
        start_housing = max(start_housing, parts[i].start_housing)
    peak, peak_time, peak_part = -np.inf, 0.0, 0
    for i in range(len(parts)):
        highest, at = _trace(nodes, copper, periods, losses, parts, i, magnets, ambient, start_winding, start_housing)
        if highest > peak:
            peak, peak_time, peak_part = highest, at, i
    radius = UNKNOWN if shared else radius
    return Heat(magnets, winding, housing, ambient + peak, peak_time, peak_part, converged, radius)


@law
def _trace(
    nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, i: Any, magnets: Any, ambient: Any,
    start_winding: Any, start_housing: Any,
) -> Any:  # fmt: skip
    """Set the temperatures at the samples of a part for initial rises; the winding's largest rise and its time.

    Without a time constant of the winding all temperatures are constant.
    """
    part, begin, end = parts[i], periods.edges[i], periods.edges[i + 1]
    if not known(nodes.winding):
        losses.winding_at[begin:end], losses.housing_at[begin:end] = ambient + part.winding, ambient + part.housing
        return part.winding, 0.0
    cold, slope = per_torque(copper, magnets)
    begin, end = intervals(periods, i)
    flow = flow_of(nodes, part.length, cold, slope, part.injected)
    if len(periods.shares) > 1:  # for a single cycle they are still set
        set_steps(periods.step, losses, begin, end, flow)
    found = cycle_trace(periods.step, losses, begin, end, flow, (start_winding, start_housing), ambient)
    if nodes.inner == 0.0:
        for t in range(begin, end + 1):
            losses.housing_at[t] = losses.winding_at[t]
    return found


@law
def trace_own_periods(
    nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, magnets: Any, ambient: Any
) -> None:
    """Set the temperatures at the samples of a mix to those of each part in its own periodic state.

    ``periodic_heat`` sets those of parts that follow a warmer one, from which ``hottest_phase`` starts.
    """
    if len(parts) == 1 or not losses.winding_at[0] < np.inf:
        return
    for i in range(len(parts)):
        own = parts[i]
        _trace(nodes, copper, periods, losses, parts, i, magnets, ambient, own.start_winding, own.start_housing)


# The most loaded phase at rest.
#
# While turning, all phases share the loss; at rest one of them may carry the amplitude and twice its share of the loss.
# The excess heats that phase alone, through its own share of the thermal path to the housing: the rise equals that
# which the loss of all phases causes in the winding.


@law(fastmath=FAST)
def shares_within(rate: Any, steps: Any, share: Any) -> None:
    """Share of its final value that a first-order response covers within each step: 1 - e^(-rate step).

    Truncated series, which vectorise; long steps (dwells) are computed again where some of AT_ONCE steps are long.
    """
    for start in range(0, len(steps), AT_ONCE):
        lengths, some, longest = steps[start : start + AT_ONCE], share[start : start + AT_ONCE], 0.0
        for k in range(len(lengths)):
            x = rate * lengths[k]
            inner = 1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0)))
            some[k] = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * inner))
            longest = larger(longest, x)
        for k in range(len(lengths) if longest >= SMALL else 0):
            if rate * lengths[k] >= SMALL:
                some[k] = -math.expm1(-rate * lengths[k])


@law(fastmath=FAST)
def mean_over(steps: Any, values: Any) -> Any:
    """Mean of values that are constant over each step."""
    total, length = 0.0, 0.0
    for k in range(len(steps)):
        total += steps[k] * values[k]
        length += steps[k]
    return total / length


class Responses(NamedTuple):
    """Largest values of the first-order responses to two series, and of their sum."""

    first: float
    second: float
    both: float


@law(fastmath=CHAIN)
def responses(periods: Any, rate: Any, first: Any, second: Any, memory: Any) -> Any:
    """First-order responses to two series that are constant from sample to sample; sets ``memory[0]`` to that of the
    first at the samples.

    Each part begins with the most that a part leaves of either when it is repeated: no order of the parts gives more.
    If the rate is NaN (unknown), each part has its means. What a part begins with decays and is added last, so that
    both responses of a part are computed in one pass.
    """
    one, two, decay = memory[0], memory[1], memory[2]
    most_one, most_two = -np.inf, -np.inf
    for i in range(len(periods.shares)):
        begin, end = intervals(periods, i)
        after, steps, wanted, other = periods.edges[i + 1], periods.step[begin:end], first[begin:end], second[begin:end]
        x, y, kept, length = 0.0, 0.0, 1.0, 0.0
        if known(rate):
            reached, reaches, share = one[begin:end], two[begin:end], decay[begin:end]
            shares_within(rate, steps, share)
            for k in range(len(steps)):
                gone, left = share[k], 1.0 - share[k]
                reached[k], reaches[k], share[k] = x, y, kept
                x, y, kept = x * left + wanted[k] * gone, y * left + other[k] * gone, kept * left
                length += steps[k]
            one[after - 1], two[after - 1], decay[after - 1] = x, y, kept
            covered = -math.expm1(-rate * length)
        else:
            x, y, covered = mean_over(steps, wanted), mean_over(steps, other), 1.0
            one[begin:after] = x
        most_one, most_two = max(most_one, x / covered), max(most_two, y / covered)
    largest_one, largest_two, largest = most_one, most_two, most_one + most_two
    for t in range(len(periods.step) if known(rate) else 0):
        x, y = one[t] + most_one * decay[t], two[t] + most_two * decay[t]
        one[t] = x
        largest_one, largest_two, largest = larger(largest_one, x), larger(largest_two, y), larger(largest, x + y)
    return Responses(largest_one, largest_two, largest)


@law(fastmath=FAST)
def hottest_phase(nodes: Any, copper: Any, periods: Any, losses: Any, heat: Any, ambient: Any) -> Any:
    """Largest temperature of the most loaded phase at rest; ``held`` is given.

    The excess over the winding temperature is computed with the resistance at its warmest instant, increased by the
    phase's own rise; infinite where that grows faster than the cooling.
    """
    peak = heat.peak
    cold, slope = per_torque(copper, heat.magnets)
    resistance = nodes.inner if nodes.inner > 0.0 else nodes.outer
    found = responses(periods, 1.0 / (resistance * nodes.winding), losses.held, losses.square, losses.memory)
    if not (found.first > 0.0 and peak < np.inf):
        return peak
    growth, rise = resistance * slope * found.both, losses.memory[0]
    if growth >= 1.0:
        return np.inf
    scale = resistance * (cold + slope * (heat.peak - ambient)) / (1.0 - growth)
    for t in range(len(periods.step)):
        peak = larger(peak, losses.winding_at[t] + scale * rise[t])
    return peak


@law
def quick_nodes(nodes: Any, time: Any) -> Any:
    """The nodes with another winding time constant [s]; a single node is split by the assumed share of the winding."""
    inner = nodes.inner if nodes.inner > 0.0 else WINDING_SHARE * nodes.outer
    housing = nodes.housing if nodes.inner > 0.0 else nodes.winding
    return Nodes(inner, nodes.inner + nodes.outer - inner, time / inner, housing)


@law
def hottest_bound(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, magnets: Any, ambient: Any) -> Any:
    """Upper bound of ``hottest_phase`` for a magnet temperature without solving the periodic state [C].

    It takes the resistance at the warmest instant for all times, and the housing temperature that results from it.
    """
    cold, slope = per_torque(copper, magnets)
    rate, own, square, lost = 1.0 / (nodes.outer * nodes.housing), 1.0 / (nodes.inner * nodes.winding), 0.0, 0.0
    for i in range(len(parts)):
        square += periods.shares[i] * parts[i].square
        lost += periods.shares[i] * parts[i].loss
    if known(rate):
        slow = responses(periods, rate, losses.square, losses.housing, losses.memory)
        square, lost = max(square, slow.first), max(lost, slow.second)
    # one part may leave the warmest winding, another one the warmest phase
    quick = responses(periods, own, losses.square, losses.held, losses.memory)
    heating = nodes.outer * square + nodes.inner * quick.both
    left = 1.0 - slope * heating
    return ambient + (nodes.outer * lost + cold * heating) / left if left > 0.0 else np.inf
