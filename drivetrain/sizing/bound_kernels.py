"""What a pair at one joint must at least bear while the torque of the joint lies in an interval at every sample.

The motor's torque is a function of the gear's torque at each sample: two straight lines that meet where the power
through the mesh turns. Its range over an interval is therefore that of the ends, and of the bend where it lies between
them, whether the mesh locks itself or not. Every figure is bounded sample by sample; that the samples belong to one
history is not used, so a pair that holds with some history is never ruled out.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.check_kernels import CLOSE, essential_lack, holds_speed, life
from drivetrain.sizing.load_kernels import (
    PEAK_LOAD,
    JointBounds,
    bound_joint,
    compiled,
    fast,
    least_average,
)
from drivetrain.sizing.packed_rows import (
    AVERAGE,
    CONTINUOUS,
    COULOMB,
    DIRECT_DRIVE,
    DRIVEN,
    DRIVING,
    INDUCTANCE,
    INNER,
    INPUT_INERTIA,
    MAGNET,
    MAX_WINDING,
    MOMENTARY,
    NO_LOAD,
    OUTER,
    PEAK_CURRENT,
    PEAK_TORQUE,
    RATED_LIFE,
    RATED_SPEED,
    RATED_TORQUE,
    RATIO,
    REPEATED,
    ROTOR,
    VISCOUS,
)
from drivetrain.sizing.packed_task import (
    ACCELERATION,
    AMBIENT,
    AMPLIFIER_CONTINUOUS,
    AMPLIFIER_PEAK,
    BREAK_BACK,
    BREAK_FORWARD,
    CARRIER,
    CURVED,
    DURATION,
    LIFE,
    LOSS_FRICTION,
    LOSS_SPEED,
    MOVES,
    PEAK_FACTOR,
    RATE_AFTER,
    RATE_AT,
    RATE_BEFORE,
    RMS_FACTOR,
    SPEED,
    STEP_SHARE,
    STEP_SPEED,
    STEP_SQUARE,
    TEMPERATURE_MARGIN,
    VOLTAGE_FACTOR,
    VOLTS,
    WAY,
    WEIGHT,
    PackedTask,
)
from drivetrain.sizing.torque_kernels import breakaway, constant_at, resistance, shaft_friction
from drivetrain.sizing.vector_max import larger, smaller

# Rows of the scratch of bounds.
LOW, HIGH, OWN_LOW, OWN_HIGH = 1, 2, 3, 4
OVER = 1.0 + CLOSE


@fast
def own_bounds(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> None:
    """Move the interval by what the joint's own drive asks of it, where it rides on the link that it moves.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        bounds: From ``bound_joint``; the interval is kept in its scratch.
    """
    row, own = task.offsets[joint, joint], task.numbers[pair]
    low, high = bounds.scratch[OWN_LOW], bounds.scratch[OWN_HIGH]
    for t in range(len(low)):
        added = 0.0
        for i in range(5):
            added += own[i] * task.force[row + i, t]
        low[t] += added
        high[t] += added


@compiled
def torque_bounds(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> None:
    """The interval of the motor's torque at every sample, into LOW and HIGH.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        bounds: From ``bound_joint``.
    """
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    row = task.series[joint]
    least, most = bounds.scratch[LOW], bounds.scratch[HIGH]
    _mesh_bounds(row, g, bounds.low, bounds.high, least, most)
    curved = task.tasks[joint, CURVED] != 0.0
    _add_shaft(row, m, g, curved, least, most)
    if curved:
        for t in range(len(least)):
            friction = shaft_friction(m, g[RATIO] * row[LOSS_SPEED, t])
            least[t] += friction
            most[t] += friction


@fast
def _mesh_bounds(row: Array, g: Array, low: Array, high: Array, least: Array, most: Array) -> None:
    """Through the mesh."""
    way, friction = row[WAY], row[LOSS_FRICTION]
    inverse = 1.0 / g[RATIO]
    driving, driven = g[DRIVING] * inverse, g[DRIVEN] * inverse
    hold = max(g[DRIVEN], 0.0) * inverse
    for t in range(len(low)):
        # Factors of a positive and of a negative load.
        up = driving if way[t] > 0.0 else (driven if way[t] < 0.0 else hold)
        down = driven if way[t] > 0.0 else (driving if way[t] < 0.0 else hold)
        a, b = low[t] + friction[t], high[t] + friction[t]
        first = up * larger(a, 0.0) + down * smaller(a, 0.0)
        second = up * larger(b, 0.0) + down * smaller(b, 0.0)
        bend = 0.0 if (a < 0.0) & (b > 0.0) else first
        least[t] = smaller(smaller(first, second), bend)
        most[t] = larger(larger(first, second), bend)


@fast
def _add_shaft(row: Array, m: Array, g: Array, curved: bool, least: Array, most: Array) -> None:
    """Rotor and straight friction."""
    ratio, inertia = g[RATIO], m[ROTOR] + g[INPUT_INERTIA]
    sign = 1.0 if ratio > 0.0 else -1.0
    constant = sign * (g[NO_LOAD] if curved else m[COULOMB] + g[NO_LOAD])
    viscous = 0.0 if curved else m[VISCOUS] * ratio
    acceleration, carrier, way, slow = row[ACCELERATION], row[CARRIER], row[WAY], row[LOSS_SPEED]
    for t in range(len(least)):
        shaft = inertia * (ratio * acceleration[t] + carrier[t]) + constant * way[t] + viscous * slow[t]
        least[t] += shaft
        most[t] += shaft


@fast
def _least(task: PackedTask, joint: int, least: Array, most: Array) -> tuple[float, float, float]:
    """Largest magnitude, sum of weight times square, and mean square between samples that cannot be undercut."""
    weight, share = task.series[joint, WEIGHT], task.series[joint, STEP_SHARE]
    samples = len(least)
    peak, square, between = 0.0, 0.0, 0.0
    for t in range(samples):
        magnitude = larger(larger(least[t], -most[t]), 0.0)
        peak = larger(peak, magnitude)
        square += weight[t] * magnitude * magnitude
    low, high, low_after, high_after = least[:-1], most[:-1], least[1:], most[1:]
    for t in range(samples - 1):
        a = larger(low[t], 0.0) + smaller(high[t], 0.0)
        b = larger(low_after[t], 0.0) + smaller(high_after[t], 0.0)
        same = (a * a + a * b + b * b) / 3.0
        turned = 0.25 * larger(a * a, b * b)  # the least of the same sum over one of the two
        between += share[t] * (same if a * b > 0.0 else turned)
    return peak, square, between


@compiled
def _least_start(task: PackedTask, joint: int, m: Array, g: Array, bounds: JointBounds) -> float:
    """The torque to start at the samples at rest that cannot be undercut."""
    row, rests, ratio = task.series[joint], task.rests[joint], g[RATIO]
    sign, inertia, peak = np.sign(ratio), m[ROTOR] + g[INPUT_INERTIA], 0.0
    forward, back = task.tasks[joint, BREAK_FORWARD], task.tasks[joint, BREAK_BACK]
    for i in range(len(rests)):
        t = rests[i]
        if t < 0:
            break
        low, high = bounds.low[t], bounds.high[t]
        if low > 0.0:
            way, loose = 1.0, forward
        elif high < 0.0:
            way, loose = -1.0, -back
        else:
            continue
        shaft = breakaway(m, sign * way) + g[NO_LOAD] * sign * way
        shaft += inertia * (ratio * row[ACCELERATION, t] + row[CARRIER, t])
        first, second = g[DRIVING] * (low + loose) / ratio + shaft, g[DRIVING] * (high + loose) / ratio + shaft
        if first * second > 0.0:
            peak = max(peak, min(abs(first), abs(second)))
    return peak


@fast
def _least_voltage(
    task: PackedTask, joint: int, m: Array, g: Array, ohms: float, constant: float, bounds: JointBounds
) -> float:
    """The voltage at fixed temperatures that cannot be undercut."""
    row, least, most = task.series[joint], bounds.scratch[LOW], bounds.scratch[HIGH]
    speed, behind, at, ahead = row[SPEED], row[RATE_BEFORE], row[RATE_AT], row[RATE_AFTER]
    samples, peak = len(least), 0.0
    turning, inverse = constant * g[RATIO], 1.0 / constant
    inductance = m[INDUCTANCE]
    for t in range(0, samples, max(samples - 1, 1)):  # the first and the last have one neighbour
        own = inverse * (ohms + inductance * at[t])
        low, high = min(own * least[t], own * most[t]), max(own * least[t], own * most[t])
        for other, factor in ((t - 1, behind[t]), (t + 1, ahead[t])):
            if 0 <= other < samples:
                a, b = inverse * inductance * factor * least[other], inverse * inductance * factor * most[other]
                low, high = low + min(a, b), high + max(a, b)
        peak = max(peak, turning * speed[t] + low, -(turning * speed[t] + high))
    if samples < 3:
        return peak
    l0, l1, l2, h0, h1, h2 = least[:-2], least[1:-1], least[2:], most[:-2], most[1:-1], most[2:]
    s, r0, r1, r2 = speed[1:-1], behind[1:-1], at[1:-1], ahead[1:-1]
    for t in range(samples - 2):
        own, before, after = ohms + inductance * r1[t], inductance * r0[t], inductance * r2[t]
        low = smaller(own * l1[t], own * h1[t]) + smaller(before * l0[t], before * h0[t])
        high = larger(own * l1[t], own * h1[t]) + larger(before * l0[t], before * h0[t])
        low += smaller(after * l2[t], after * h2[t])
        high += larger(after * l2[t], after * h2[t])
        emf = turning * s[t]
        peak = larger(peak, larger(emf + inverse * low, -(emf + inverse * high)))
    return peak


@compiled
def _gear_may_hold(task: PackedTask, joint: int, gear: int, bounds: JointBounds) -> bool:
    """The gear's limits of torque and life."""
    g, limits = task.gears[gear], task.tasks[joint]
    peak = limits[PEAK_FACTOR] * bounds.numbers[PEAK_LOAD]
    if peak > g[REPEATED] * OVER or peak > g[MOMENTARY] * OVER:
        return False
    lives = not (np.isnan(g[RATED_LIFE]) or np.isnan(g[RATED_SPEED]) or np.isnan(g[RATED_TORQUE]))
    lives = lives and not np.isnan(limits[LIFE])
    if lives or not np.isnan(g[AVERAGE]):
        mean = least_average(task, joint, task.exponent_of[gear], bounds)
        if mean > g[AVERAGE] * OVER:
            return False
        if lives and limits[LIFE] > life(limits, g, mean) * OVER:
            return False
    return True


@compiled
def _motor_may_hold(task: PackedTask, joint: int, m: Array, g: Array, bounds: JointBounds) -> bool:
    """The motor's and the amplifier's limits, LOW and HIGH filled."""
    limits = task.tasks[joint]
    peak, square, between = _least(task, joint, bounds.scratch[LOW], bounds.scratch[HIGH])
    if limits[MOVES] != 0.0:
        peak = max(peak, _least_start(task, joint, m, g, bounds))
    if limits[PEAK_FACTOR] * peak > m[PEAK_TORQUE] * OVER:
        return False
    ambient, heated = limits[AMBIENT], not np.isnan(m[INNER])
    constant, ohms = constant_at(m, ambient), resistance(m, ambient)
    if m[MAGNET] <= 0.0 or not heated:
        current = limits[PEAK_FACTOR] * peak / constant
        rms = limits[RMS_FACTOR] * math.sqrt(square / limits[DURATION]) / constant
        if current > m[PEAK_CURRENT] * OVER or current > limits[AMPLIFIER_PEAK] * OVER:
            return False
        if rms > m[CONTINUOUS] * OVER or rms > limits[AMPLIFIER_CONTINUOUS] * OVER:
            return False
        if heated:
            copper = ohms * between / (constant * constant)
            loss = 0.0
            if limits[CURVED] == 0.0:
                turning = abs(g[RATIO])
                loss = turning * (m[COULOMB] * limits[STEP_SPEED] + m[VISCOUS] * turning * limits[STEP_SQUARE])
            rise = m[INNER] * copper + m[OUTER] * (copper + loss)
            if rise > (m[MAX_WINDING] - limits[TEMPERATURE_MARGIN] - ambient) * OVER:
                return False
    room = limits[VOLTS] * OVER / limits[VOLTAGE_FACTOR]
    if _least_voltage(task, joint, m, g, ohms, constant, bounds) > room:
        return False
    if heated or np.isnan(m[MAX_WINDING]):
        return True
    return _least_voltage(task, joint, m, g, resistance(m, m[MAX_WINDING]), constant, bounds) <= room


@compiled
def may_hold(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """Whether a pair may hold with some torque history within bounds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        bounds: From ``bound_joint``.

    Returns:
        False only if no history with ``low <= torque <= high`` at each sample lets every check hold.
    """
    gear = task.pairs[pair, 1]
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[gear]
    if essential_lack(m, g) >= 0 or not holds_speed(task, joint, pair):
        return False
    if task.offsets[joint, joint] >= 0:
        return _may_hold_own(task, joint, pair, bounds)
    if g[DIRECT_DRIVE] == 0.0 and not _gear_may_hold(task, joint, gear, bounds):
        return False
    torque_bounds(task, joint, pair, bounds)
    return _motor_may_hold(task, joint, m, g, bounds)


@compiled
def _own_interval(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> JointBounds:
    """The bounds with what the pair's own drive asks, in memory of their own."""
    low, high = bounds.scratch[OWN_LOW], bounds.scratch[OWN_HIGH]
    low[:], high[:] = bounds.low, bounds.high
    own_bounds(task, joint, pair, bounds)
    own = JointBounds(np.empty_like(low), np.empty_like(high), np.empty_like(bounds.numbers), bounds.scratch)
    bound_joint(task, joint, low, high, own)
    return own


@compiled
def _may_hold_own(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """The same where the joint's own drive loads it."""
    gear = task.pairs[pair, 1]
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[gear]
    own = _own_interval(task, joint, pair, bounds)
    if g[DIRECT_DRIVE] == 0.0 and not _gear_may_hold(task, joint, gear, own):
        return False
    torque_bounds(task, joint, pair, own)
    return _motor_may_hold(task, joint, m, g, own)


@compiled
def least_energy(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> float:
    """A lower bound of a pair's electrical energy over the cycle with any torque history within bounds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``; its torque can be computed.
        bounds: From ``bound_joint``.

    Returns:
        [J].
    """
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    if task.offsets[joint, joint] >= 0:
        torque_bounds(task, joint, pair, _own_interval(task, joint, pair, bounds))
    else:
        torque_bounds(task, joint, pair, bounds)
    ambient, heated = task.tasks[joint, AMBIENT], not np.isnan(m[INNER])
    coolest = ambient if np.isnan(m[MAX_WINDING]) else min(ambient, m[MAX_WINDING])
    if not heated and not np.isnan(m[MAX_WINDING]):
        coolest = m[MAX_WINDING]
    constant = constant_at(m, ambient)
    loss = resistance(m, coolest) / (constant * constant)
    if heated and m[MAGNET] > 0.0:
        loss = 0.0  # warm magnets may be stronger without bound
    return _least_sum(task, joint, g[RATIO], loss, bounds.scratch[LOW], bounds.scratch[HIGH])


@fast
def _least_sum(task: PackedTask, joint: int, ratio: float, loss: float, least: Array, most: Array) -> float:
    """The least integral of torque times speed plus loss times torque squared."""
    speed, weight = task.series[joint, SPEED], task.series[joint, WEIGHT]
    total, inverse = 0.0, -0.5 / loss if loss > 0.0 else 0.0
    for t in range(len(least)):
        turning = ratio * speed[t]
        best = inverse * turning if loss > 0.0 else (least[t] if turning > 0.0 else most[t])
        torque = larger(least[t], smaller(most[t], best))
        total += weight[t] * torque * (turning + loss * torque)
    return total
