"""Winding and housing temperature of a torque cycle that repeats for ever, or of a mix of several: the law, once.

The resistance follows the winding at every instant, the torque constant the mean housing temperature. The periodic
state of the two nodes is solved directly: a cycle of losses is an affine map of the two temperature rises.

Of a mix it is not known how long each part is run before the next one takes over. Assumed is, on the safe side for the
winding:

- Parts alternate fast against the housing, so all of them share one mean housing temperature, that of the mean heat
  of the mix. (A part that is run for longer than the housing's time constant is a task of its own: judge it alone.)
- Parts alternate slowly against the winding, so in each part the winding comes to that part's own periodic state
  above the common housing. Faster alternation only evens its temperature out.
- A motor whose data sheet gives a single node has no housing that evens heat out: each part comes to its own periodic
  state, and the hottest counts.

So each part of a mix is a periodic cycle with a constant heat injected into its housing, such that the mean housing
temperature is the common one; over the mix, by shares of time, these heats cancel.
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

STEADY = 1e4  # cycles that a housing of unknown capacity outlasts: it rests at its mean
GROWN_BEYOND = 1e100  # a map of a cycle whose losses run away at once; squares of less are still numbers
MAGNET_TOLERANCE = 1e-6  # K, between the magnet temperature put in and the one that comes out
MOST_STEPS = 40
SMALL = 0.05  # rate times step below which seven terms of the exponential's series are exact to rounding


class Nodes(NamedTuple):
    """The thermal nodes of a motor in its mounting; NaN where unknown."""

    # resistance from winding to housing, 0 where they are one node, and from there to ambient [K/W]
    inner: float
    outer: float
    # capacities [J/K]; the first of the whole motor when it is one node
    winding: float
    housing: float


class Copper(NamedTuple):
    """The copper loss of a torque: R(T) (torque / kt(T_magnets))^2."""

    resistance: float  # with the winding at ambient temperature [ohm]
    slope: float  # with its temperature [ohm/K]
    # torque constant [N m/A], its change with magnet temperature [1/K], and the temperature at which it holds [C]
    constant: float
    coefficient: float
    reference: float


class Losses(NamedTuple):
    """The losses from each sample to the next, and memory to solve for their temperatures; (N + 1,) each."""

    square: Array  # mean square of the torque [N^2 m^2]
    held: Array  # the same of what one phase may have above its share while the motor stands still [N^2 m^2]
    housing: Array  # mean loss in the housing [W]
    integrals: Array  # memory, (4, N + 1), see ``integrals_of``
    # take the temperatures at the samples [C]
    winding_at: Array
    housing_at: Array


def new_losses(samples: int) -> Losses:
    """Memory for a number of samples."""
    row, rows = np.zeros(samples + 1), np.zeros((4, samples + 1))
    return Losses(row, row.copy(), row.copy(), rows, row.copy(), row.copy())


class Periods(NamedTuple):
    """How a motor is used: one cycle, or a mix of parts that repeat by themselves."""

    edges: Any  # first sample of each part, and the one after the last, (P + 1,)
    shares: Array  # of the time of use, one a part, together 1
    step: Array  # from each sample to the next of its part [s], 0 at its last; of a part of one sample anything, (N,)


def periods_of(time: Array, parts: Sequence[slice], shares: Sequence[float]) -> Periods:
    """Samples that repeat part by part."""
    steps = np.append(np.diff(time), 0.0)
    steps[[part.stop - 1 for part in parts]] = 0.0
    steps[[part.start for part in parts if part.stop == part.start + 1]] = 1.0  # any length will do
    edges = np.array([*(part.start for part in parts), len(time)], dtype=np.int64)
    return Periods(edges, np.array(shares, dtype=np.float64), steps)


@dataclass(frozen=True)
class PartHeat:
    """What one part of the mix comes to: rises over ambient [K], at a mean housing rise of 0 and each kelvin of it."""

    length: float = 0.0  # of a period [s]
    # mean square of the torque [N^2 m^2], mean loss in the housing [W]
    square: float = 0.0
    loss: float = 0.0
    # at the start of a period, and the winding's mean
    start_winding: float = 0.0
    start_housing: float = 0.0
    winding: float = 0.0
    injected: float = 0.0  # heat that the other parts bring into the housing [W]
    # of these with the mean housing rise
    start_winding_slope: float = 0.0
    start_housing_slope: float = 0.0
    winding_slope: float = 0.0
    injected_slope: float = 0.0
    housing: float = 0.0  # mean rise of the housing


def new_parts(count: int) -> Any:
    """Memory for a number of parts."""
    return np.zeros(count, record_type(PartHeat))


class Heat(NamedTuple):
    """The periodic state; infinite temperatures in a runaway: losses grow faster with temperature than cooling."""

    magnets: float  # at which the torque constant was taken: the mean housing temperature [C]
    # mean temperatures [C]
    winding: float
    housing: float
    peak: float  # largest of the winding, also between samples [C]
    peak_time: float  # of it, from the start of its part [s]
    peak_part: int  # in which it lies
    converged: bool  # whether magnet and mean housing temperature could be matched
    radius: float  # share of a small extra rise that is left after a cycle; NaN for a mix and where nothing moves


@law
def thermal_nodes(motor: Any, mounting: Any) -> Any:
    """The nodes of a motor. Capacities are time constants over resistances of the sheet: C_w = t_w/R1, C_h = t_h/R2.

    So another ``mounting`` [K/W] changes the housing's time constant and not its capacity.
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
    """The copper loss of a motor in air of a temperature [C]."""
    slope = motor.resistance * copper_coefficient(motor.reference_temperature)
    cold = winding_resistance(motor, ambient)
    return Copper(cold, slope, motor.torque_constant, motor.magnet_coefficient, motor.reference_temperature)


@law
def per_torque(copper: Any, magnets: Any) -> Any:
    """Copper loss at ambient temperature and its slope, over squared torque; infinite where nothing is left of kt."""
    constant = copper.constant * (1.0 + copper.coefficient * (magnets - copper.reference))
    if not (constant > 0.0 and magnets < np.inf):
        return np.inf, np.inf
    return copper.resistance / constant**2, copper.slope / constant**2


@law(fastmath=FAST)
def interval_means(torque: Any, loss: Any, losses: Any) -> None:
    """Mean square of the torque and mean loss from each sample to the next, both linear between them."""
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
    """Length, mean square and mean loss of each part."""
    for i in range(len(parts)):
        begin, end = intervals(periods, i)
        steps, squares, housing = periods.step[begin:end], losses.square[begin:end], losses.housing[begin:end]
        length, square, loss = 0.0, 0.0, 0.0
        for k in range(len(steps)):
            length += steps[k]
            square += steps[k] * squares[k]
            loss += steps[k] * housing[k]
        parts[i].length, parts[i].square, parts[i].loss = length, square / length, loss / length


# The exact step of two coupled nodes
#
# On each interval the two rises x obey x' = M x + s, M = [[growth - a, b], [c, -d]] constant. Both exponentials come
# from the two real eigenvalues of M, through functions that stay exact where they nearly meet or nearly vanish, so that
# neither zero-length intervals nor a momentary balance of heating and cooling need a case.


class Flow(NamedTuple):
    """How heat flows between the nodes of a part, and what comes in: per kelvin, torque squared and watt."""

    # rates of the matrix above, without the growth [1/s]
    a: float
    b: float
    c: float
    d: float
    # of an interval with a torque's mean square of 1: rates of growth [1/s] and of heating [K/s]
    growth: float
    source: float
    # rates of heating by a watt of loss in the housing, of the winding and of the housing [K/s]
    inside: float
    outside: float
    injected: float  # rate of heating of the housing by what is injected [K/s]


@law
def flow_of(nodes: Any, length: Any, cold: Any, slope: Any, injected: Any) -> Any:
    """The flow in a part of a length; of an injected heat [W], and copper losses as ``per_torque`` has them."""
    winding = 1.0 / nodes.winding
    if nodes.inner == 0.0:  # one node
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
def integrals_of(steps: Any, losses: Any, begin: Any, end: Any, flow: Any) -> None:
    """Of each interval (p, q, u, v): S = p I + q (M - m I) and Q = u I + v (M - m I), m the mean of M's diagonal.

    S is the integral of e^(M t) over the step, Q the integral of S. Intervals that are short against every rate are
    straight-line series, which vectorise; long ones, of a dwell, are solved anew.
    """
    a, cross, d, growth = flow.a, flow.b * flow.c, flow.d, flow.growth
    steps, squares = steps[begin:end], losses.square[begin:end]
    p, q, u, v = losses.integrals[:, begin:end]
    for k in range(len(steps)):
        h, m00 = steps[k], growth * squares[k] - a
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
        p[k] = h * (1.0 + y / 2.0 + e2 / 6.0 + e3 / 24.0 + e4 / 120.0 + e5 / 720.0 + e6 / 5040.0 + e7 / 40320.0)
        q[k] = square * (0.5 + o2 / 6.0 + o3 / 24.0 + o4 / 120.0 + o5 / 720.0 + o6 / 5040.0 + o7 / 40320.0)
        u[k] = square * (0.5 + y / 6.0 + e2 / 24.0 + e3 / 120.0 + e4 / 720.0 + e5 / 5040.0 + e6 / 40320.0)
        v[k] = square * h * (1.0 / 6.0 + o2 / 24.0 + o3 / 120.0 + o4 / 720.0 + o5 / 5040.0 + o6 / 40320.0)
    for k in range(len(steps)):
        rate = growth * squares[k] - a
        if steps[k] * (flow.c + d + larger(a, rate) + flow.b) >= SMALL:
            p[k], q[k], u[k], v[k] = _exact(steps[k], rate, flow.b, flow.c, -d)


class CycleMap(NamedTuple):
    """What one cycle does to the two rises x, as an affine map, and to their integral over it."""

    # of x_end = [[ww, wh], [hw, hh]] x_start + [w, h]
    ww: float
    wh: float
    hw: float
    hh: float
    w: float
    h: float
    # the same of the mean over the cycle
    mean_ww: float
    mean_wh: float
    mean_hw: float
    mean_hh: float
    mean_w: float
    mean_h: float
    # what a watt that is injected into the housing adds to both
    watt_w: float
    watt_h: float
    mean_watt_w: float
    mean_watt_h: float


@law
def cycle_map(steps: Any, losses: Any, begin: Any, end: Any, flow: Any) -> Any:
    """The map of a cycle, with the integrals that are there."""
    b, c, d = flow.b, flow.c, flow.d
    a00, a01, a10, a11, r0, r1 = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    b00, b01, b10, b11, w0, w1, length = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    u0, u1, z0, z1, unit = 0.0, 0.0, 0.0, 0.0, flow.outside
    p_of, q_of, u_of, v_of = losses.integrals
    for k in range(begin, end):
        m00 = flow.growth * losses.square[k] - flow.a
        half = 0.5 * (m00 + d)
        p, q, u, v = p_of[k], q_of[k], u_of[k], v_of[k]
        s00, s01, s10, s11 = p + q * half, q * b, q * c, p - q * half
        q00, q01, q10, q11 = u + v * half, v * b, v * c, u - v * half
        h0 = flow.source * losses.square[k] + flow.inside * losses.housing[k]
        h1 = flow.outside * losses.housing[k] + flow.injected
        b00, b01 = b00 + s00 * a00 + s01 * a10, b01 + s00 * a01 + s01 * a11
        b10, b11 = b10 + s10 * a00 + s11 * a10, b11 + s10 * a01 + s11 * a11
        w0 += s00 * r0 + s01 * r1 + q00 * h0 + q01 * h1
        w1 += s10 * r0 + s11 * r1 + q10 * h0 + q11 * h1
        z0 += s00 * u0 + s01 * u1 + q01 * unit
        z1 += s10 * u0 + s11 * u1 + q11 * unit
        # e^(M t) = I + S M
        e00, e01 = 1.0 + s00 * m00 + s01 * c, s00 * b - s01 * d
        e10, e11 = s10 * m00 + s11 * c, 1.0 + s10 * b - s11 * d
        a00, a10 = e00 * a00 + e01 * a10, e10 * a00 + e11 * a10
        a01, a11 = e00 * a01 + e01 * a11, e10 * a01 + e11 * a11
        r0, r1 = e00 * r0 + e01 * r1 + s00 * h0 + s01 * h1, e10 * r0 + e11 * r1 + s10 * h0 + s11 * h1
        u0, u1 = e00 * u0 + e01 * u1 + s01 * unit, e10 * u0 + e11 * u1 + s11 * unit
        length += steps[k]
    inverse = 1.0 / length
    return CycleMap(
        a00, a01, a10, a11, r0, r1, b00 * inverse, b01 * inverse, b10 * inverse, b11 * inverse, w0 * inverse,
        w1 * inverse, u0, u1, z0 * inverse, z1 * inverse,
    )  # fmt: skip


@law
def cycle_trace(steps: Any, losses: Any, begin: Any, end: Any, flow: Any, start: Any, ambient: Any) -> Any:
    """The temperatures at the ends of all intervals from a start, in rises; the winding's largest rise and its time.

    With the integrals that are there; inside long intervals finer steps are taken, which count.
    """
    b, c, d, winding, housing = flow.b, flow.c, flow.d, losses.winding_at, losses.housing_at
    x0, x1 = start
    winding[begin], housing[begin] = ambient + x0, ambient + x1
    peak, peak_time, time = x0, 0.0, 0.0
    for k in range(begin, end):
        m00 = flow.growth * losses.square[k] - flow.a
        half = 0.5 * (m00 + d)
        h0 = flow.source * losses.square[k] + flow.inside * losses.housing[k]
        h1 = flow.outside * losses.housing[k] + flow.injected
        pieces = 1 + int(min(511.0, 5.0 * steps[k] * (flow.a + d)))  # a fifth of the shorter time constant
        step, p, q = steps[k], losses.integrals[0, k], losses.integrals[1, k]
        if pieces > 1:
            step = steps[k] / pieces
            p, q, _, _ = _exact(step, m00, b, c, -d)
        s00, s01, s10, s11 = p + q * half, q * b, q * c, p - q * half
        for _ in range(pieces):
            f0 = m00 * x0 + b * x1 + h0
            f1 = c * x0 - d * x1 + h1
            x0, x1 = x0 + s00 * f0 + s01 * f1, x1 + s10 * f0 + s11 * f1
            time += step
            if x0 > peak:
                peak, peak_time = x0, time
        winding[k + 1], housing[k + 1] = ambient + x0, ambient + x1
    return peak, peak_time


# The periodic state of one part


@law
def _still(nodes: Any, cold: Any, slope: Any, part: Any, shared: Any) -> Any:
    """A part whose temperatures rest, by itself or as a line over the housing's mean rise; whether there is one."""
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
    """The rises that a cycle adding these brings back to themselves: (I - A) x = r."""
    determinant = (1.0 - cycle.ww) * (1.0 - cycle.hh) - cycle.wh * cycle.hw
    return (
        ((1.0 - cycle.hh) * winding + cycle.wh * housing) / determinant,
        ((1.0 - cycle.ww) * housing + cycle.hw * winding) / determinant,
    )


@law
def _means_of(cycle: Any, winding: Any, housing: Any, mean_winding: Any, mean_housing: Any) -> Any:
    """Mean rises of a cycle from a start, with what is added to them."""
    return (
        cycle.mean_ww * winding + cycle.mean_wh * housing + mean_winding,
        cycle.mean_hw * winding + cycle.mean_hh * housing + mean_housing,
    )


@law
def _radius(cycle: Any) -> Any:
    """The share of a small extra rise that is left after a cycle, infinite where its losses run away at once.

    Both rises only ever warm each other, so the larger eigenvalue is real and the spectral radius.
    """
    if not abs(cycle.ww) + abs(cycle.hh) + abs(cycle.w) + abs(cycle.h) + abs(cycle.mean_w) < GROWN_BEYOND:
        return np.inf
    mean, half = 0.5 * (cycle.ww + cycle.hh), 0.5 * (cycle.ww - cycle.hh)
    return mean + math.sqrt(max(half * half + cycle.wh * cycle.hw, 0.0))  # rounding may leave less than nothing


@law
def _moving(nodes: Any, periods: Any, losses: Any, i: Any, cold: Any, slope: Any, part: Any, shared: Any) -> Any:
    """A part whose temperatures move, by itself or as a line over the housing's mean rise; its spectral radius.

    Infinite where it runs away.
    """
    begin, end = intervals(periods, i)
    flow = flow_of(nodes, part.length, cold, slope, 0.0)
    integrals_of(periods.step, losses, begin, end, flow)
    cycle = cycle_map(periods.step, losses, begin, end, flow)
    radius = _radius(cycle)
    if shared and radius < np.inf:  # a housing that the other parts cool holds what would run away alone
        radius = 0.0 if flow.growth * part.square < flow.a else np.inf
    if not radius < 1.0:
        return radius
    part.start_winding, part.start_housing = _start_of(cycle, cycle.w, cycle.h)
    part.winding, part.housing = _means_of(cycle, part.start_winding, part.start_housing, cycle.mean_w, cycle.mean_h)
    part.injected = 0.0
    if nodes.inner == 0.0:
        part.housing = part.winding
    if shared:  # all of it as lines over the housing's mean rise
        winding, housing = _start_of(cycle, cycle.watt_w, cycle.watt_h)
        mean, warm = _means_of(cycle, winding, housing, cycle.mean_watt_w, cycle.mean_watt_h)
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
    """A part at a mean rise of the housing, from its lines."""
    part.start_winding += rise * part.start_winding_slope
    part.start_housing += rise * part.start_housing_slope
    part.winding += rise * part.winding_slope
    part.injected += rise * part.injected_slope
    part.housing = rise


# The periodic state of the use


@law
def _mean_housing(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, magnets: Any, moves: Any) -> Any:
    """Mean housing rise with magnets of a temperature, infinite in a runaway, and the spectral radius of one cycle."""
    cold, slope = per_torque(copper, magnets)
    if cold == np.inf:
        return np.inf, np.inf
    shared, radius = len(parts) > 1 and nodes.inner != 0.0, UNKNOWN
    hottest, needed, steep = -np.inf, 0.0, 0.0
    for i in range(len(parts)):
        part = parts[i]
        if moves:
            radius = _moving(nodes, periods, losses, i, cold, slope, part, shared)
        if not (radius < 1.0 if moves else _still(nodes, cold, slope, part, shared)):
            return np.inf, radius
        needed += periods.shares[i] * part.injected
        steep += periods.shares[i] * part.injected_slope
        hottest = max(hottest, part.housing)  # whose magnets are the weakest, where each stands alone
    if not shared:
        return hottest, radius
    if not steep > 0.0:  # a warmer housing would need no more heat: it grows for ever
        return np.inf, UNKNOWN
    for i in range(len(parts)):
        _settled(parts[i], -needed / steep)
    return -needed / steep, UNKNOWN


@law
def periodic_heat(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, ambient: Any) -> Any:
    """The temperatures of a use: ``square`` and ``housing`` of the losses are given.

    The magnets are as warm as the mean housing that they make. Weaker magnets heat more, and the more the warmer they
    are: a convex map, on which the secant from the cold side never passes the answer; a slope of 1 or more means there
    is none. The balance of means of a single cycle is near, and costs nothing: from there the search begins.
    """
    part_means(periods, losses, parts)
    moves, magnets, used, slope, rise, radius = known(nodes.winding), ambient, ambient, 0.0, 0.0, 0.0
    converged = False
    for state in (False, True):  # of a single cycle first its means, whose slope is near that of its state
        if len(parts) > 1 and not state:
            continue
        reached = 0.0
        for step in range(MOST_STEPS):
            rise, radius = _mean_housing(nodes, copper, periods, losses, parts, magnets, moves and state)
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
    magnets = used  # of which the state is
    cold, slope = per_torque(copper, magnets)
    winding, housing, peak, peak_time, peak_part = ambient, ambient, -np.inf, 0.0, 0
    for i in range(len(parts)):
        part, begin, end = parts[i], periods.edges[i], periods.edges[i + 1]
        highest, at = part.winding, 0.0
        if moves:
            highest, at = _traced(nodes, periods, losses, i, cold, slope, part, ambient)
        else:
            losses.winding_at[begin:end], losses.housing_at[begin:end] = ambient + part.winding, ambient + part.housing
        if highest > peak:
            peak, peak_time, peak_part = highest, at, i
        winding += periods.shares[i] * part.winding
        housing += periods.shares[i] * part.housing
    return Heat(magnets, winding, housing, ambient + peak, peak_time, peak_part, converged, radius)


@law
def _traced(nodes: Any, periods: Any, losses: Any, i: Any, cold: Any, slope: Any, part: Any, ambient: Any) -> Any:
    """The temperatures of a part over its period; the winding's largest rise and its time."""
    begin, end = intervals(periods, i)
    flow = flow_of(nodes, part.length, cold, slope, part.injected)
    found = cycle_trace(
        periods.step, losses, begin, end, flow, (part.start_winding, part.start_housing), ambient,
    )  # fmt: skip
    if nodes.inner == 0.0:
        for t in range(begin, end + 1):
            losses.housing_at[t] = losses.winding_at[t]
    return found


# The phase that stands still under load
#
# Turning, all phases share the loss; at rest one may carry the amplitude, and twice its share of the loss. What it has
# above that warms it alone, through its own part of the way to the housing: as the loss of all warms them, once more.


@law(fastmath=FAST)
def shares_within(rate: Any, steps: Any, share: Any) -> None:
    """How much of its way a response of first order goes within each step: 1 - e^(-rate step).

    A series, which vectorises; long steps, of a dwell, are taken anew.
    """
    for k in range(len(steps)):
        x = rate * steps[k]
        inner = 1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0)))
        share[k] = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * inner))
    for k in range(len(steps)):
        if rate * steps[k] >= SMALL:
            share[k] = -math.expm1(-rate * steps[k])


@law(fastmath=FAST)
def settled(periods: Any, i: Any, rate: Any, values: Any, out: Any) -> Any:
    """The response of first order to values from sample to sample of a part that repeats, at its samples; its largest.

    A rate of NaN is unknown: the mean is returned.
    """
    begin, end = intervals(periods, i)
    last = periods.edges[i + 1] - 1
    steps, values, share = periods.step[begin:end], values[begin:end], out[begin:end]
    answer, length = 0.0, 0.0
    for k in range(len(steps)):
        answer += values[k] * steps[k]
        length += steps[k]
    if not known(rate):
        out[begin : last + 1] = answer / length
        return answer / length
    shares_within(rate, steps, share)
    answer = 0.0
    for k in range(len(steps)):
        answer = answer * (1.0 - share[k]) + values[k] * share[k]
    answer = answer / -math.expm1(-rate * length)
    most = answer
    for k in range(len(steps)):
        gone, share[k] = share[k], answer
        answer = answer * (1.0 - gone) + values[k] * gone
        most = larger(most, answer)
    out[last] = answer
    return most


@law
def hottest_phase(nodes: Any, copper: Any, periods: Any, losses: Any, heat: Any, ambient: Any) -> Any:
    """Largest temperature of the phase that carries most at rest; ``held`` is given.

    What it is warmer than the winding by has the resistance of its warmest instant, and more of it by all of the
    phase's loss; infinite where that grows faster than the cooling.
    """
    peak = heat.peak
    cold, slope = per_torque(copper, heat.magnets)
    way, rise, every = nodes.inner if nodes.inner > 0.0 else nodes.outer, losses.integrals[0], losses.integrals[1]
    rate, extra, most = 1.0 / (way * nodes.winding), 0.0, 0.0
    for i in range(len(periods.shares)):
        extra = max(extra, settled(periods, i, rate, losses.held, rise))
    if extra == 0.0:
        return peak
    for k in range(len(every)):
        every[k] = losses.square[k] + losses.held[k]
    for i in range(len(periods.shares)):
        most = max(most, settled(periods, i, rate, every, losses.integrals[2]))
    if way * slope * most >= 1.0:
        return np.inf
    scale = way * (cold + slope * (heat.peak - ambient)) / (1.0 - way * slope * most)
    for i in range(len(periods.shares)):
        for k in range(periods.edges[i], periods.edges[i + 1]):
            peak = max(peak, losses.winding_at[k] + scale * rise[k])
    return peak


@law
def quick_nodes(nodes: Any, time: Any) -> Any:
    """The nodes with a winding of another time constant [s]; of one node a share of the way is the winding's."""
    inner = nodes.inner if nodes.inner > 0.0 else WINDING_SHARE * nodes.outer
    housing = nodes.housing if nodes.inner > 0.0 else nodes.winding
    return Nodes(inner, nodes.inner + nodes.outer - inner, time / inner, housing)


@law
def hottest_bound(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, magnets: Any, ambient: Any) -> Any:
    """What ``hottest_phase`` does not exceed with magnets of a temperature, without the state being solved [C].

    As if the resistance were that of its warmest instant all the time, and the housing as warm as that makes it.
    """
    cold, slope = per_torque(copper, magnets)
    rate, own = 1.0 / (nodes.outer * nodes.housing), 1.0 / (nodes.inner * nodes.winding)
    every, memory, peak, even, loss = losses.integrals[1], losses.integrals[2], ambient, 0.0, 0.0
    for i in range(len(parts)):
        even += periods.shares[i] * parts[i].square
        loss += periods.shares[i] * parts[i].loss
    for k in range(len(every)):
        every[k] = losses.square[k] + losses.held[k]
    for i in range(len(parts)):
        square, lost = even, loss
        if known(rate):
            square = max(square, settled(periods, i, rate, losses.square, memory))
            lost = max(lost, settled(periods, i, rate, losses.housing, memory))
        heating = nodes.outer * square + nodes.inner * settled(periods, i, own, every, memory)
        left = 1.0 - slope * heating
        peak = max(peak, ambient + (nodes.outer * lost + cold * heating) / left if left > 0.0 else np.inf)
    return peak
