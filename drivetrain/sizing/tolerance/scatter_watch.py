"""Winding temperature, voltage and power of one motor in many arms, sample by sample from the periodic state."""

from __future__ import annotations

from drivetrain.sizing.tolerance import scatter_numbers as k
from drivetrain.sizing.tolerance.lanes import (
    Lanes,
    floor,
    highest,
    largest_of,
    lowest,
    magnitude,
    njit_lanes,
    put,
    row,
    spread,
    where_less,
)
from drivetrain.sizing.tolerance.scatter_blocks import ONE_NODE
from drivetrain.sizing.tolerance.scatter_exponentials import matrix_exponential
from drivetrain.sizing.tolerance.scatter_heat import interval_square
from drivetrain.sizing.tolerance.scatter_numbers import Memory, ScatterTask


@njit_lanes
def _long(
    step: float, rate: Lanes, b: Lanes, c: Lanes, d: Lanes, cooling: Lanes, s0: Lanes, s1: Lanes, x0: Lanes, x1: Lanes
) -> tuple[Lanes, Lanes, Lanes]:
    """The rises after an interval that is not short, and the winding's largest, looked for as ``cycle_trace`` does."""
    pieces = 1.0 + floor(lowest(5.0 * step * (cooling + d), 511.0))
    h, none, peak = step / pieces, spread(0.0), spread(0.0)
    e00, e01, e10, e11, v0, v1, _, _ = matrix_exponential(
        rate * h, b * h, c * h, -1.0 * (d * h), s0 * h, s1 * h, none, none
    )
    for piece in range(int(largest_of(pieces))):
        y0, y1, here = e00 * x0 + e01 * x1 + v0, e10 * x0 + e11 * x1 + v1, spread(float(piece))
        x0, x1 = where_less(here, pieces, y0, x0), where_less(here, pieces, y1, x1)
        peak = highest(peak, x0)
    return x0, x1, peak


# long kernel: the step is taken with numbers that the caller's loop also holds
@njit_lanes
def _stepped(
    task: ScatterTask, joint: int, t: int, at: int, x0: Lanes, x1: Lanes, peak: Lanes, pushed: Lanes, memory: Memory
) -> tuple[Lanes, Lanes, Lanes]:
    """Rises of winding and housing at the next sample, and the largest of the winding's so far."""
    heat, h, loss = memory.heat, task.blocks.step[t], task.series[joint, k.LOSS, t]
    b, c, d = row(heat, at + k.B), row(heat, at + k.C), row(heat, at + k.D)
    square = interval_square(memory, t)
    rate = row(heat, at + k.GROWTH) * square - row(heat, at + k.A)
    s0 = row(heat, at + k.SOURCE) * square + row(heat, at + k.LOSS_IN) * loss
    s1 = row(heat, at + k.LOSS_OUT) * loss + pushed
    if task.blocks.long[joint, t]:
        x0, x1, found = _long(h, rate, b, c, d, row(heat, at + k.A), s0, s1, x0, x1)
        return x0, x1, highest(peak, found)
    f0, f1 = h * (rate * x0 + b * x1 + s0), h * (c * x0 - d * x1 + s1)
    x0, x1 = x0 + f0, x1 + f1
    for order in range(2, 5):
        f0, f1 = (h / order) * (rate * f0 + b * f1), (h / order) * (c * f0 - d * f1)
        x0, x1 = x0 + f0, x1 + f1
    return x0, x1, highest(peak, x0)


# long kernel: one pass over the motion, so that every number is loaded once
@njit_lanes
def watch(task: ScatterTask, joint: int, powered: bool, memory: Memory) -> None:
    """The largest rise and voltage over the motion, and the electrical power."""
    p, lane, series, torques = task.numbers[joint], memory.lane, task.series[joint], memory.torque
    speed, behind, at_it, ahead, rest = series[k.SPEED], series[k.BEHIND], series[k.AT], series[k.AHEAD], series[k.REST]
    ohms, slope, cold, inductance = row(lane, k.OHMS), row(lane, k.SLOPE), row(lane, k.COLD), p[k.INDUCTANCE]
    warm = row(lane, k.TORQUE_CONSTANT) * (1.0 + p[k.MAGNET] * (row(lane, k.MAGNETS) - p[k.REFERENCE]))
    by_cold, by_warm, moving = 1.0 / cold, 1.0 / warm, p[k.KIND] >= ONE_NODE
    zero, gain = ohms * (by_warm * by_warm), slope * (by_warm * by_warm)
    peak = terminal = spread(0.0)
    parts, samples = len(task.share), len(speed)
    for part in range(parts):
        at = k.HEAT_ROWS * part
        x0, x1 = row(memory.heat, at + k.X0), row(memory.heat, at + k.X1)
        pushed = row(memory.heat, at + k.BROUGHT) * 0.0
        if moving and parts > 1:
            pushed = row(memory.heat, at + k.BROUGHT) * row(memory.heat, at + k.UNIT)
        peak = highest(peak, x0)
        begin, end = task.blocks.sample[part], task.blocks.sample[part + 1]
        for t in range(begin, end):
            torque, hot = row(torques, t), ohms + slope * x0
            changing = spread(0.0)
            if inductance > 0.0:
                before, after = row(torques, max(t - 1, 0)), row(torques, min(t + 1, samples - 1))
                changing = inductance * (behind[t] * before + at_it[t] * torque + ahead[t] * after)
            terminal = highest(terminal, magnitude(cold * speed[t] + by_cold * (ohms * torque + changing)))
            terminal = highest(terminal, magnitude(warm * speed[t] + by_warm * (hot * torque + changing)))
            if rest[t] != 0.0:
                terminal = highest(terminal, by_warm * hot * row(memory.start, t))
            if powered:
                used = torque * speed[t] + (zero + gain * x0) * (torque * torque)
                put(memory.power, t, row(memory.power, t) + used)
            if moving and t + 1 < end:
                x0, x1, peak = _stepped(task, joint, t, at, x0, x1, peak, pushed, memory)
    put(lane, k.WARM, warm)
    put(lane, k.RISE, peak)
    put(lane, k.TERMINAL, terminal)
