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


class Losses(NamedTuple):
    """Losses from each sample to the next, and memory for the solution; (N + 1,) each."""

    square: Array  # mean square of the torque [N^2 m^2]
    held: Array  # mean square torque of the most loaded phase above that of the winding, at rest [N^2 m^2]
    housing: Array  # mean loss in the housing [W]
    integrals: Array  # memory, (4, N + 1), see ``integrals_of``
    # Temperatures at the samples, each part in its own periodic state [C].
    winding_at: Array
    housing_at: Array


def new_losses(samples: int) -> Losses:
    """Arrays for a number of samples."""
    row, rows = np.zeros(samples + 1), np.zeros((4, samples + 1))
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
    """The periodic state; infinite temperatures in a runaway, where losses grow faster with temperature than the
    cooling.
    """

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
    """Copper loss at ambient temperature and its slope, over squared torque; infinite if the torque constant is not
    positive.
    """
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
def integrals_of(steps: Any, losses: Any, begin: Any, end: Any, flow: Any) -> None:
    """For each interval (p, q, u, v) in S = p I + q (M - m I) and Q = u I + v (M - m I), with m the mean of M's
    diagonal.

    S is the integral of e^(M t) over the step, Q the integral of S. Intervals that are short compared with every time
    constant use truncated series, which vectorise; long ones (dwells) are computed again.
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
    """Affine map of the two rises x over one cycle, and of their means over it."""

    # Coefficients of x_end = [[ww, wh], [hw, hh]] x_start + [w, h].
    ww: float
    wh: float
    hw: float
    hh: float
    w: float
    h: float
    # The same for the mean over the cycle.
    mean_ww: float
    mean_wh: float
    mean_hw: float
    mean_hh: float
    mean_w: float
    mean_h: float
    # Effect of one watt injected into the housing on both.
    watt_w: float
    watt_h: float
    mean_watt_w: float
    mean_watt_h: float


@law
def cycle_map(steps: Any, losses: Any, begin: Any, end: Any, flow: Any) -> Any:
    """The map of a cycle, from the integrals in ``losses``."""
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
    """Set the temperatures at the ends of all intervals for initial rises; the winding's largest rise and its time.

    Uses the integrals in ``losses``; long intervals are subdivided for the largest rise.
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
def _means_of(cycle: Any, winding: Any, housing: Any, mean_winding: Any, mean_housing: Any) -> Any:
    """Mean rises of a cycle from its initial rises and the additions."""
    return (
        cycle.mean_ww * winding + cycle.mean_wh * housing + mean_winding,
        cycle.mean_hw * winding + cycle.mean_hh * housing + mean_housing,
    )


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
    integrals_of(periods.step, losses, begin, end, flow)
    cycle = cycle_map(periods.step, losses, begin, end, flow)
    radius = _radius(cycle)
    if shared and radius < np.inf:  # a housing cooled by the other parts stabilises what would run away alone
        radius = 0.0 if flow.growth * part.square < flow.a else np.inf
    if not radius < 1.0:
        return radius
    part.start_winding, part.start_housing = _start_of(cycle, cycle.w, cycle.h)
    part.winding, part.housing = _means_of(cycle, part.start_winding, part.start_housing, cycle.mean_w, cycle.mean_h)
    part.injected = 0.0
    if nodes.inner == 0.0:
        part.housing = part.winding
    if shared:  # all values as linear functions of the mean housing rise
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
    """State of a part at a mean rise of the housing, from its linear functions."""
    part.start_winding += rise * part.start_winding_slope
    part.start_housing += rise * part.start_housing_slope
    part.winding += rise * part.winding_slope
    part.injected += rise * part.injected_slope
    part.housing = rise


# The periodic state of the mix.


@law
def _mean_housing(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, magnets: Any, moves: Any) -> Any:
    """Mean housing rise for a magnet temperature, infinite in a runaway, and the spectral radius of one cycle."""
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
        hottest = max(hottest, part.housing)  # its magnets are the weakest, if each part is on its own
    if not shared:
        return hottest, radius
    if not steep > 0.0:  # a warmer housing would not dissipate more heat: it grows without bound
        return np.inf, UNKNOWN
    for i in range(len(parts)):
        _settled(parts[i], -needed / steep)
    return -needed / steep, UNKNOWN


@law
def periodic_heat(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, ambient: Any) -> Any:
    """The temperatures of a use; ``square`` and ``housing`` of the losses are given.

    The magnets are at the resulting mean housing temperature. Weaker magnets heat more, at a rate that rises with their
    temperature: the fixed point of a convex map, on which the secant from the cold side never overshoots; a slope of 1
    or more means that there is none. The heat balance of the means is a close and cheap approximation for a single
    cycle, from which the search starts.
    """
    part_means(periods, losses, parts)
    moves, magnets, used, slope, rise, radius = known(nodes.winding), ambient, ambient, 0.0, 0.0, 0.0
    converged = False
    for state in (False, True):  # for a single cycle first its means, whose slope is close to that of its state
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
    cold, slope = per_torque(copper, magnets)
    for i in range(len(parts)):
        part = parts[i]
        if known(nodes.winding):  # ``hottest_phase`` uses the integrals as memory
            begin, end = intervals(periods, i)
            flow = flow_of(nodes, part.length, cold, slope, part.injected)
            integrals_of(periods.step, losses, begin, end, flow)
        _trace(nodes, copper, periods, losses, parts, i, magnets, ambient, part.start_winding, part.start_housing)


# The most loaded phase at rest.
#
# While turning, all phases share the loss; at rest one of them may carry the amplitude and twice its share of the loss.
# The excess heats that phase alone, through its own share of the thermal path to the housing: the rise equals that
# which the loss of all phases causes in the winding.


@law(fastmath=FAST)
def shares_within(rate: Any, steps: Any, share: Any) -> None:
    """Share of its final value that a first-order response covers within each step: 1 - e^(-rate step).

    Truncated series, which vectorise; long steps (dwells) are computed again.
    """
    for k in range(len(steps)):
        x = rate * steps[k]
        inner = 1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0)))
        share[k] = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * inner))
    for k in range(len(steps)):
        if rate * steps[k] >= SMALL:
            share[k] = -math.expm1(-rate * steps[k])


@law(fastmath=FAST)
def most_left(periods: Any, rate: Any, values: Any, share: Any) -> Any:
    """Largest first-order response that a part leaves when it is repeated; ``share`` is set to ``shares_within``.

    If the rate is NaN (unknown), each part has its mean.
    """
    most = -np.inf
    for i in range(len(periods.shares)):
        begin, end = intervals(periods, i)
        steps, value, left, length = periods.step[begin:end], values[begin:end], 0.0, 0.0
        for k in range(len(steps)):
            left += value[k] * steps[k]
            length += steps[k]
        left /= length
        if known(rate):
            covered, left = share[begin:end], 0.0
            shares_within(rate, steps, covered)
            for k in range(len(steps)):
                left = left * (1.0 - covered[k]) + value[k] * covered[k]
            left /= -math.expm1(-rate * length)
        else:
            share[begin:end] = left
        most = max(most, left)
    return most


@law(fastmath=FAST)
def highest_response(periods: Any, rate: Any, values: Any, out: Any, start: Any) -> Any:
    """Set the first-order response to values that are constant from sample to sample, after ``most_left``; its largest
    value.

    Each part begins with ``start``, at least the most that a part leaves: no order of the parts gives more.
    """
    largest = start
    for i in range(len(periods.shares)):
        begin, end = intervals(periods, i)
        value, share, answer = values[begin:end], out[begin:end], start
        for k in range(len(value) if known(rate) else 0):
            gone, share[k] = share[k], answer
            answer = answer * (1.0 - gone) + value[k] * gone
            largest = larger(largest, answer)
        out[periods.edges[i + 1] - 1] = answer if known(rate) else out[begin]
    return largest


@law
def hottest_phase(nodes: Any, copper: Any, periods: Any, losses: Any, heat: Any, ambient: Any) -> Any:
    """Largest temperature of the most loaded phase at rest; ``held`` is given.

    The excess over the winding temperature is computed with the resistance at its warmest instant, increased by the
    phase's own rise; infinite where that grows faster than the cooling.
    """
    peak = heat.peak
    cold, slope = per_torque(copper, heat.magnets)
    resistance, rise, total = (
        nodes.inner if nodes.inner > 0.0 else nodes.outer,
        losses.integrals[0],
        losses.integrals[1],
    )
    rate = 1.0 / (resistance * nodes.winding)
    held = most_left(periods, rate, losses.held, rise)
    if not highest_response(periods, rate, losses.held, rise, held) > 0.0:
        return peak
    for k in range(len(total)):
        total[k] = losses.square[k] + losses.held[k]
    start = held + most_left(periods, rate, losses.square, losses.integrals[2])
    largest = highest_response(periods, rate, total, losses.integrals[2], start)
    if resistance * slope * largest >= 1.0:
        return np.inf
    scale = resistance * (cold + slope * (heat.peak - ambient)) / (1.0 - resistance * slope * largest)
    for i in range(len(periods.shares)):
        for k in range(periods.edges[i], periods.edges[i + 1]):
            peak = max(peak, losses.winding_at[k] + scale * rise[k])
    return peak


@law
def quick_nodes(nodes: Any, time: Any) -> Any:
    """The nodes with another time constant of the winding [s]; a single node is split by the assumed share of the
    winding.
    """
    inner = nodes.inner if nodes.inner > 0.0 else WINDING_SHARE * nodes.outer
    housing = nodes.housing if nodes.inner > 0.0 else nodes.winding
    return Nodes(inner, nodes.inner + nodes.outer - inner, time / inner, housing)


@law
def hottest_bound(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, magnets: Any, ambient: Any) -> Any:
    """Upper bound of ``hottest_phase`` for a magnet temperature without solving the periodic state [C].

    It takes the resistance at the warmest instant for all times, and the housing temperature that results from it.
    """
    cold, slope = per_torque(copper, magnets)
    rate, own = 1.0 / (nodes.outer * nodes.housing), 1.0 / (nodes.inner * nodes.winding)
    total, memory, square, lost = losses.integrals[1], losses.integrals[2], 0.0, 0.0
    for i in range(len(parts)):
        square += periods.shares[i] * parts[i].square
        lost += periods.shares[i] * parts[i].loss
    for k in range(len(total)):
        total[k] = losses.square[k] + losses.held[k]
    if known(rate):
        most = most_left(periods, rate, losses.square, memory)
        square = max(square, highest_response(periods, rate, losses.square, memory, most))
        most = most_left(periods, rate, losses.housing, memory)
        lost = max(lost, highest_response(periods, rate, losses.housing, memory, most))
    start = most_left(periods, own, losses.square, memory) + most_left(periods, own, losses.held, memory)
    heating = nodes.outer * square + nodes.inner * highest_response(periods, own, total, memory, start)
    left = 1.0 - slope * heating
    return ambient + (nodes.outer * lost + cold * heating) / left if left > 0.0 else np.inf
