"""The torque of one motor in many arms as they may be built, and what depends on torque alone."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.tolerance import scatter_numbers as k
from drivetrain.sizing.tolerance.lanes import (
    Lanes,
    highest,
    magnitude,
    njit_lanes,
    power,
    put,
    root,
    row,
    spread,
    third_guess,
    where_less,
)
from drivetrain.sizing.tolerance.scatter_numbers import Memory, ScatterTask

TINY = 1e-250  # the cube root of less is none: its cube would be lost


@njit_lanes
def cube_root(x: Lanes) -> Lanes:
    """The cube root of what is not negative."""
    y = third_guess(x)
    for _ in range(3):
        cube = y * y * y
        y = y * ((cube + 2.0 * x) / (2.0 * cube + x))
    return where_less(x, TINY, 0.0, y)


@njit_lanes
def _worn(load: Lanes, exponent: float) -> Lanes:
    """A load to the power with which it wears."""
    cube = load * load * load
    if exponent == 3.0:
        return cube
    if exponent == 10.0 / 3.0:
        return cube * cube_root(load)
    return power(load, spread(exponent))


@njit_lanes
def _starting(task: ScatterTask, joint: int, t: int, force: Lanes, memory: Memory) -> tuple[Lanes, Lanes]:
    """What breaks a joint loose at a sample where it rests: torque of the motor without mesh loss, and of the load."""
    series, p, lane = task.series[joint], task.numbers[joint], memory.lane
    rubbing = row(lane, k.RUBBING)
    turning, returning, sign = p[k.SHAFT_BREAK], p[k.SHAFT_BREAK_BACK], 1.0
    if p[k.RATIO] < 0.0:
        turning, returning, sign = returning, turning, -1.0
    after = series[k.NEXT, t]
    idle = p[k.BREAK] if after > 0.0 else -p[k.BREAK_BACK] if after < 0.0 else 0.0
    shaft = turning if after > 0.0 else -returning if after < 0.0 else 0.0
    loose = where_less(0.0, force, p[k.BREAK], where_less(force, 0.0, -p[k.BREAK_BACK], idle))
    spun = where_less(0.0, force, turning, where_less(force, 0.0, -returning, shaft))
    push = magnitude(
        row(lane, k.DRIVING) * (force + rubbing * loose) + sign * rubbing * spun + series[k.ROTOR_TORQUE, t]
    )
    load = force + rubbing * series[k.JOINT_FRICTION, t]
    held = where_less(0.0, load, p[k.BREAK], where_less(load, 0.0, -p[k.BREAK_BACK], 0.0))
    return p[k.MOVES] * push, magnitude(load + p[k.MOVES] * rubbing * held)


# long kernel: one pass over the motion, so that every number is loaded once
@njit_lanes
def work(task: ScatterTask, joint: int, memory: Memory) -> None:
    """The motor's torque over the motion, with the peaks and means that it decides."""
    series, p, lane = task.series[joint], task.numbers[joint], memory.lane
    base, loss, way, friction = series[k.FORCE], series[k.LOSS_FRICTION], series[k.WAY], series[k.JOINT_FRICTION]
    rotor, shaft, travel, rest = series[k.ROTOR_TORQUE], series[k.SHAFT], series[k.TRAVEL], series[k.REST]
    rubbing, driving, driven, held = row(lane, k.RUBBING), row(lane, k.DRIVING), row(lane, k.DRIVEN), row(lane, k.HELD)
    wears = not (np.isnan(p[k.AVERAGE]) and np.isnan(p[k.LIFE_SHARE]))
    exponent, payloads = p[k.EXPONENT], task.payload[joint]
    largest = peak = square = wear = spread(0.0)
    for t in range(len(base)):
        force = spread(base[t])
        for q in range(len(payloads)):
            if payloads[q, t] != 0.0:
                force = force + row(memory.shares, q) * payloads[q, t]
        load = force + rubbing * loss[t]
        if way[t] == 0.0:
            factor = held
        elif way[t] > 0.0:
            factor = where_less(0.0, load, driving, driven)
        else:
            factor = where_less(load, 0.0, driving, driven)
        torque = factor * load + (rotor[t] + rubbing * shaft[t])
        put(memory.torque, t, torque)
        square = square + task.weight[t] * (torque * torque)
        size, size_of_load = magnitude(torque), magnitude(force + rubbing * friction[t])
        if wears and travel[t] > 0.0:
            wear = wear + travel[t] * _worn(size_of_load, exponent)
        if rest[t] != 0.0:
            push, loose = _starting(task, joint, t, force, memory)
            size, size_of_load = highest(size, push), highest(size_of_load, loose)
            put(memory.start, t, size)
        peak, largest = highest(peak, size), highest(largest, size_of_load)
    put(lane, k.LARGEST, largest)
    put(lane, k.PEAK, peak)
    put(lane, k.SQUARE, square)
    if wears:
        put(lane, k.WEAR, cube_root(wear) if exponent == 3.0 else power(wear, spread(1.0 / exponent)))


@njit_lanes
def _loaded(parts: Array, at: int, shares: Array) -> Lanes:
    """A load at a sample with the payloads drawn."""
    found = spread(parts[0, at])
    for q in range(len(shares)):
        found = found + row(shares, q) * parts[1 + q, at]
    return found


@njit_lanes
def masses(task: ScatterTask, joint: int, memory: Memory) -> None:
    """Largest loads on the output bearing and of the inertia, where the payload scatters."""
    limits, parts, lane = task.bearing_limits[joint], task.bearing[joint], memory.lane
    for group in range(3):
        if np.isnan(limits[group]):
            continue
        most, at = spread(0.0), (0, 2, 3)[group]
        for t in range(task.counts[joint, 0]):
            first = _loaded(parts[at], t, memory.shares)
            size = first * first
            if group != 1:
                second = _loaded(parts[at + 1], t, memory.shares)
                size = size + second * second
            most = highest(most, size)
        put(lane, k.TILT + group, root(most))
    most = spread(0.0)
    for t in range(task.counts[joint, 1]):
        most = highest(most, magnitude(_loaded(task.inertia[joint], t, memory.shares)))
    put(lane, k.MASSES, most)
