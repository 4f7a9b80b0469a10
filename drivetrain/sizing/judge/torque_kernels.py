"""The motor's torque, heat and voltage for one pair at one joint's load, as ``operation.py`` has them."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive import heat_state
from drivetrain.sizing.demand.load_loops import DRIVEN_LOAD, DRIVING_LOAD, HELD_LOAD, START_LOAD, START_WAY
from drivetrain.sizing.judge.compiling import njit_leaf, njit_loop
from drivetrain.sizing.judge.packed_rows import (
    CONSTANT,
    COPPER,
    COULOMB,
    COULOMB_BACK,
    DRIVEN,
    DRIVING,
    HOUSING_CAPACITY,
    INDUCTANCE,
    INNER,
    INPUT_INERTIA,
    MAGNET,
    NO_LOAD,
    OUTER,
    RATIO,
    REFERENCE,
    RESISTANCE,
    ROTOR,
    SHAPE,
    STATIC,
    STRIBECK,
    VISCOUS,
    VISCOUS_BACK,
    WINDING_CAPACITY,
)
from drivetrain.sizing.judge.packed_task import (
    ACCELERATION,
    CARRIER,
    FRICTION,
    LOSS_FRICTION,
    LOSS_SPEED,
    RATE_AFTER,
    RATE_AT,
    RATE_BEFORE,
    SPEED,
    STEP,
    WAY,
    WEIGHT,
    Indices,
)
from drivetrain.sizing.judge.vector_max import larger

# Rows of a load's scratch; those of heat lie as ``heat_state`` wants them.
TOTAL, START, SLOPE, HEAT, ROWS = 0, 1, 2, 3, 3 + heat_state.ROWS
WINDING = HEAT + heat_state.WINDING


@njit_leaf
def resistance(m: Array, temperature: float) -> float:
    """``winding_resistance``.

    Args:
        temperature: Of the winding [C].

    Returns:
        [ohm].
    """
    return m[RESISTANCE] * (1.0 + m[COPPER] * (temperature - m[REFERENCE]))


@njit_leaf
def constant_at(m: Array, temperature: float) -> float:
    """``torque_constant``.

    Args:
        temperature: Of the magnets [C].

    Returns:
        [N m/A].
    """
    return m[CONSTANT] * (1.0 + m[MAGNET] * (temperature - m[REFERENCE]))


@njit_leaf
def breakaway(m: Array, way: float) -> float:
    """``breakaway_torque`` of a motor's shaft.

    Returns:
        [N m].
    """
    forward = m[COULOMB] if np.isnan(m[STATIC]) else m[STATIC]
    back = m[COULOMB_BACK] if np.isnan(m[STATIC]) else m[STATIC]
    return forward if way > 0.0 else (-back if way < 0.0 else 0.0)


@njit_loop
def curved_friction(m: Array, ratio: float, speed: Array, out: Array) -> None:
    """``friction_torque`` of a motor's shaft, added to what is there.

    Args:
        speed: Of the gear's output [rad/s], (N,).
        out: Takes the sum [N m], (N,).
    """
    for t in range(len(speed)):
        turning = ratio * speed[t]
        magnitude, backward = abs(turning), turning < 0.0
        sliding = m[COULOMB_BACK] if backward else m[COULOMB]
        viscous = m[VISCOUS_BACK] if backward else m[VISCOUS]
        if not (np.isnan(m[STATIC]) or np.isnan(m[STRIBECK])):
            sliding += (m[STATIC] - sliding) * math.exp(-((magnitude / m[STRIBECK]) ** m[SHAPE]))
        if magnitude > 0.0:
            out[t] += math.copysign(sliding + viscous * magnitude, turning)


@njit_loop
def pair_torque(row: Array, m: Array, g: Array, curved: bool, series: Array, total: Array) -> None:
    """The motor's torque at every sample.

    Args:
        row: The joint's series, (SERIES, N).
        series: The load's, (LOAD_SERIES, N).
        total: Takes it [N m], (N,).
    """
    ratio, inertia = g[RATIO], m[ROTOR] + g[INPUT_INERTIA]
    sign = 1.0 if ratio > 0.0 else -1.0
    a, b, geared = g[DRIVING] / ratio, g[DRIVEN] / ratio, inertia * ratio
    constant = sign * (g[NO_LOAD] if curved else m[COULOMB] + g[NO_LOAD])
    viscous = 0.0 if curved else m[VISCOUS] * ratio
    driving, held = series[DRIVING_LOAD], series[HELD_LOAD if g[DRIVEN] >= 0.0 else DRIVEN_LOAD]
    acceleration, carrier, way, slow = row[ACCELERATION], row[CARRIER], row[WAY], row[LOSS_SPEED]
    for t in range(len(total)):
        total[t] = (
            a * driving[t] + b * held[t] + (geared * acceleration[t] + inertia * carrier[t])
            + (constant * way[t] + viscous * slow[t])
        )  # fmt: skip


@njit_leaf
def first_look(
    row: Array, m: Array, g: Array, curved: bool, low: Array, high: Array, rows: Array, at: int, numbers: Array,
    pair: int, instants: Indices,
) -> tuple[float, float]:  # fmt: skip
    """What some samples ask of a pair at least, those at rest left out for the motor.

    Args:
        row: The joint's series, (SERIES, N).
        low, high: Torque at the gear's output [N m], (N,); both the same for one history.
        rows: What a unit of each number of each drive adds to it, (R, N).
        numbers: Of all pairs, (P, NUMBERS).

    Returns:
        Load torque and motor torque [N m].
    """
    ratio, inertia, gear, motor = g[RATIO], m[ROTOR] + g[INPUT_INERTIA], 0.0, 0.0
    sign = 1.0 if ratio > 0.0 else -1.0
    for t in instants:
        a, b = low[t], high[t]
        if at >= 0:
            added = 0.0
            for i in range(5):
                added += numbers[pair, i] * rows[at + i, t]
            a, b = a + added, b + added
        shown = row[FRICTION, t]
        gear = max(gear, a + shown, -(b + shown))
        way = row[WAY, t]
        if way != 0.0:
            a, b = a + row[LOSS_FRICTION, t], b + row[LOSS_FRICTION, t]
            first = (g[DRIVING] if a * way > 0.0 else g[DRIVEN]) * a / ratio
            second = (g[DRIVING] if b * way > 0.0 else g[DRIVEN]) * b / ratio
            bend = 0.0 if a < 0.0 < b else first
            shaft = inertia * (ratio * row[ACCELERATION, t] + row[CARRIER, t])
            shaft += sign * way * (g[NO_LOAD] + m[COULOMB]) + m[VISCOUS] * ratio * row[LOSS_SPEED, t]
            motor = max(motor, min(first, second, bend) + shaft, -(max(first, second, bend) + shaft))
    return gear, 0.0 if curved else motor


@njit_loop
def peak_and_square(weight: Array, total: Array) -> tuple[float, float]:
    """Largest magnitude, and sum of weight times square.

    Args:
        weight: Time each sample stands for [s], (N,).
        total: Torque [N m], (N,).

    Returns:
        [N m], [N^2 m^2 s].
    """
    peak, square = 0.0, 0.0
    for t in range(len(total)):
        peak = larger(peak, abs(total[t]))
        square += weight[t] * total[t] * total[t]
    return peak, square


@njit_leaf
def start_torque(row: Array, rests: Indices, m: Array, g: Array, series: Array, scratch: Array) -> float:
    """The torque to start at the samples at rest, or that of the motion where it is larger: magnitudes into START.

    Args:
        row: The joint's series, (SERIES, N).
        rests: Samples at rest, -1 after the last, (N,).
        series: The load's, (LOAD_SERIES, N).

    Returns:
        The largest [N m].
    """
    ratio, inertia, peak = g[RATIO], m[ROTOR] + g[INPUT_INERTIA], 0.0
    sign = 1.0 if ratio > 0.0 else -1.0
    for i in range(len(rests)):
        t = rests[i]
        if t < 0:
            break
        way = sign * series[START_WAY, i]
        start = g[DRIVING] * series[START_LOAD, i] / ratio + breakaway(m, way) + g[NO_LOAD] * way
        start += inertia * (ratio * row[ACCELERATION, t] + row[CARRIER, t])
        scratch[START, i] = max(abs(start), abs(scratch[TOTAL, t]))
        peak = max(peak, scratch[START, i])
    return peak


@njit_loop
def heat_losses(row: Array, m: Array, ratio: float, curved: bool, scratch: Array) -> None:
    """Mean square of the torque and mean loss in the housing from each sample to the next, as ``heat_state`` wants.

    Args:
        row: The joint's series, (SERIES, N).
        curved: Whether the shaft's friction stands in GROWTH already [N m].
    """
    total, square, loss = scratch[TOTAL], scratch[HEAT + heat_state.SQUARE], scratch[HEAT + heat_state.LOSS]
    each, steps, speed = scratch[HEAT + heat_state.GROWTH], scratch[HEAT + heat_state.STEP], row[SPEED]
    here, after, squares, given = total[:-1], total[1:], square[:-1], row[STEP]
    for t in range(len(squares)):
        squares[t] = (here[t] * here[t] + here[t] * after[t] + after[t] * after[t]) * (1.0 / 3.0)
    for t in range(len(total)):
        steps[t] = given[t]
        turning = abs(ratio * speed[t])
        each[t] = abs(each[t]) * turning if curved else (m[COULOMB] + m[VISCOUS] * turning) * turning
    first, second, losses = each[:-1], each[1:], loss[:-1]
    for t in range(len(losses)):
        losses[t] = 0.5 * (first[t] + second[t])


@njit_leaf
def heat_numbers(m: Array, ambient: float, shares: Array, x: Array) -> None:
    """What ``heat_state`` asks of a motor.

    Args:
        ambient: Air temperature [C].
        x: Takes them in its order, (SHARES + parts,).
    """
    square = m[CONSTANT] * m[CONSTANT]
    x[heat_state.RESISTANCE] = resistance(m, ambient) / square
    x[heat_state.SLOPE] = m[RESISTANCE] * m[COPPER] / square
    x[heat_state.CONSTANT], x[heat_state.MAGNET], x[heat_state.REFERENCE] = m[CONSTANT], m[MAGNET], m[REFERENCE]
    x[heat_state.AMBIENT], x[heat_state.INNER], x[heat_state.OUTER] = ambient, m[INNER], m[OUTER]
    x[heat_state.WINDING_CAPACITY], x[heat_state.HOUSING_CAPACITY] = m[WINDING_CAPACITY], m[HOUSING_CAPACITY]
    for i in range(len(shares)):
        x[heat_state.SHARES + i] = shares[i]


@njit_loop
def voltage_peak(row: Array, m: Array, ratio: float, scratch: Array, warm: float, cold: float, ohms: float) -> float:
    """The largest voltage while running, cold, and warm with the temperatures in WINDING.

    Args:
        row: The joint's series, (SERIES, N).
        warm: Torque constant of the warm motor [N m/A]; 0: the cold motor alone is asked.
        cold: Torque constant at ambient temperature [N m/A].

    Returns:
        [V].
    """
    total, winding, slope, speed = scratch[TOTAL], scratch[WINDING], scratch[SLOPE], row[SPEED]
    behind, at, ahead, inductance = row[RATE_BEFORE], row[RATE_AT], row[RATE_AFTER], m[INDUCTANCE]
    for t in range(len(total)):
        slope[t] = inductance * at[t] * total[t]
    if inductance > 0.0:
        neighbour, factor, rate = total[:-1], behind[1:], slope[1:]
        for t in range(len(rate)):
            rate[t] += inductance * factor[t] * neighbour[t]
        neighbour, factor, rate = total[1:], ahead[:-1], slope[:-1]
        for t in range(len(rate)):
            rate[t] += inductance * factor[t] * neighbour[t]
    peak, turning, inverse = 0.0, cold * ratio, 1.0 / cold
    for t in range(len(total)):
        peak = larger(peak, abs(turning * speed[t] + inverse * (ohms * total[t] + slope[t])))
    if warm != 0.0:
        gain, turning, inverse = m[RESISTANCE] * m[COPPER], warm * ratio, 1.0 / warm
        zero = m[RESISTANCE] - gain * m[REFERENCE]
        for t in range(len(total)):
            volts = turning * speed[t] + inverse * ((zero + gain * winding[t]) * total[t] + slope[t])
            peak = larger(peak, abs(volts))
    return peak


@njit_leaf
def start_voltage(rests: Indices, m: Array, scratch: Array, warm: float, moves: bool) -> float:
    """The largest voltage to start from rest.

    Args:
        rests: Samples at rest, -1 after the last, (N,).
        warm: Torque constant of the warm motor [N m/A].

    Returns:
        [V].
    """
    peak = 0.0
    for i in range(len(rests)):
        t = rests[i]
        if t < 0:
            break
        torque = scratch[START, i] if moves else abs(scratch[TOTAL, t])
        peak = max(peak, abs(resistance(m, scratch[WINDING, t]) * torque / warm))
    return peak


@njit_loop
def electrical_power(row: Array, m: Array, ratio: float, scratch: Array, warm: float, power: Array) -> float:
    """Electrical power at every sample, inductance left out.

    Args:
        row: The joint's series, (SERIES, N).
        warm: Torque constant of the warm motor [N m/A].
        power: Takes it, negative when regenerating [W], (N,).

    Returns:
        Energy over the cycle [J].
    """
    total, winding, speed, weight = scratch[TOTAL], scratch[WINDING], row[SPEED], row[WEIGHT]
    energy, inverse, gain = 0.0, 1.0 / (warm * warm), m[RESISTANCE] * m[COPPER]
    zero = m[RESISTANCE] - gain * m[REFERENCE]
    for t in range(len(power)):
        drawn = total[t] * (ratio * speed[t] + (zero + gain * winding[t]) * total[t] * inverse)
        power[t] = drawn
        energy += weight[t] * drawn
    return energy
