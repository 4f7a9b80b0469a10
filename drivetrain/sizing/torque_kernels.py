"""The motor's torque, heat and voltage for one pair at one joint's load, as ``operation.py`` has them."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive import heat_state
from drivetrain.drive.heat_state import steady_state
from drivetrain.sizing.load_kernels import (
    DRIVEN_LOAD,
    DRIVING_LOAD,
    HELD_LOAD,
    START_LOAD,
    START_WAY,
    JointLoad,
    compiled,
    fast,
)
from drivetrain.sizing.packed_rows import (
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
from drivetrain.sizing.packed_task import (
    ACCELERATION,
    AMBIENT,
    CARRIER,
    CURVED,
    LOSS_SPEED,
    RATE_AFTER,
    RATE_AT,
    RATE_BEFORE,
    SPEED,
    STEP,
    WAY,
    WEIGHT,
    PackedTask,
)
from drivetrain.sizing.vector_max import larger

# Rows of a load's scratch.
TOTAL, LOSS, SQUARE, WINDING, HEAT, START, STARTED = 0, 1, 2, 3, 4, 7, 8  # HEAT has three


@compiled
def shaft_friction(m: Array, speed: float) -> float:
    """``friction_torque`` of a motor's shaft.

    Args:
        m: The motor's row.
        speed: Of the shaft [rad/s].

    Returns:
        [N m].
    """
    if speed == 0.0:
        return 0.0
    magnitude = abs(speed)
    sliding, viscous = (m[COULOMB_BACK], m[VISCOUS_BACK]) if speed < 0.0 else (m[COULOMB], m[VISCOUS])
    if not np.isnan(m[STATIC]) and not np.isnan(m[STRIBECK]):
        sliding += (m[STATIC] - sliding) * math.exp(-((magnitude / m[STRIBECK]) ** m[SHAPE]))
    return math.copysign(sliding + viscous * magnitude, speed)


@compiled
def breakaway(m: Array, way: float) -> float:
    """``breakaway_torque`` of a motor's shaft.

    Args:
        m: The motor's row.
        way: Its sign is that of the motion that would follow.

    Returns:
        [N m].
    """
    if way == 0.0:
        return 0.0
    if not np.isnan(m[STATIC]):
        return math.copysign(m[STATIC], way)
    return m[COULOMB] if way > 0.0 else -m[COULOMB_BACK]


@fast
def pair_torque(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad) -> tuple[float, float]:
    """The motor's torque at every sample, into TOTAL.

    Args:
        task: The packed study.
        joint: Index of the joint.
        m, g: Rows of motor and gear.
        load: The joint's.

    Returns:
        Largest magnitude [N m], and the sum over the samples of weight times square [N^2 m^2 s].
    """
    row, ratio = task.series[joint], g[RATIO]
    sign = 1.0 if ratio > 0.0 else -1.0
    inertia = m[ROTOR] + g[INPUT_INERTIA]
    curved = task.tasks[joint, CURVED] != 0.0
    a, b, geared = g[DRIVING] / ratio, g[DRIVEN] / ratio, inertia * ratio
    constant = sign * (g[NO_LOAD] if curved else m[COULOMB] + g[NO_LOAD])
    viscous = 0.0 if curved else m[VISCOUS] * ratio
    driving, held = load.series[DRIVING_LOAD], load.series[HELD_LOAD if g[DRIVEN] >= 0.0 else DRIVEN_LOAD]
    acceleration, carrier, way, slow = row[ACCELERATION], row[CARRIER], row[WAY], row[LOSS_SPEED]
    weight, total = row[WEIGHT], load.scratch[TOTAL]
    for t in range(len(total)):
        total[t] = (
            a * driving[t] + b * held[t] + (geared * acceleration[t] + inertia * carrier[t])
            + (constant * way[t] + viscous * slow[t])
        )  # fmt: skip
    if curved:
        for t in range(len(total)):
            total[t] += shaft_friction(m, ratio * slow[t])
    peak, square = 0.0, 0.0
    for t in range(len(total)):
        peak = larger(peak, abs(total[t]))
        square += weight[t] * total[t] * total[t]
    return peak, square


@compiled
def start_torque(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad) -> tuple[float, int]:
    """The torque to start at the samples at rest, or that of the motion where it is larger, magnitudes into START.

    Args:
        task: The packed study.
        joint: Index of the joint, one that moves.
        m, g: Rows of motor and gear.
        load: The joint's, TOTAL filled.

    Returns:
        The largest [N m], and at how many samples.
    """
    row, rests, ratio = task.series[joint], task.rests[joint], g[RATIO]
    sign = 1.0 if ratio > 0.0 else -1.0
    inertia, count, peak = m[ROTOR] + g[INPUT_INERTIA], 0, 0.0
    total, found = load.scratch[TOTAL], load.scratch[START]
    for i in range(len(rests)):
        t = rests[i]
        if t < 0:
            break
        way = sign * load.series[START_WAY, i]
        start = g[DRIVING] * load.series[START_LOAD, i] / ratio + breakaway(m, way) + g[NO_LOAD] * way
        start += inertia * (ratio * row[ACCELERATION, t] + row[CARRIER, t])
        found[i] = max(abs(start), abs(total[t]))
        peak = max(peak, found[i])
        count += 1
    return peak, count


@fast
def heat_losses(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad) -> None:
    """Mean square of the torque and mean loss in the housing from each sample to the next, into SQUARE and LOSS.

    Args:
        task: The packed study.
        joint: Index of the joint.
        m, g: Rows of motor and gear.
        load: The joint's, TOTAL filled.
    """
    speed, ratio = task.series[joint, SPEED], g[RATIO]
    total, square, loss = load.scratch[TOTAL], load.scratch[SQUARE], load.scratch[LOSS]
    samples = len(total)
    here, after, squares = total[:-1], total[1:], square[:-1]
    for t in range(samples - 1):
        squares[t] = (here[t] * here[t] + here[t] * after[t] + after[t] * after[t]) / 3.0
    each = load.scratch[HEAT]
    if task.tasks[joint, CURVED] != 0.0:
        for t in range(samples):
            each[t] = shaft_friction(m, ratio * speed[t]) * (ratio * speed[t])
    else:
        for t in range(samples):
            turning = abs(ratio * speed[t])
            each[t] = (m[COULOMB] + m[VISCOUS] * turning) * turning
    first, second, losses = each[:-1], each[1:], loss[:-1]
    for t in range(samples - 1):
        losses[t] = 0.5 * (first[t] + second[t])


@compiled
def pair_heat(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad, found: Array) -> None:
    """The temperatures of a pair at work, winding temperatures into WINDING.

    Args:
        task: The packed study.
        joint: Index of the joint.
        m, g: Rows of motor and gear; the motor's thermal resistances are known.
        load: The joint's, TOTAL filled.
        found: Takes the STATE of ``heat_state``.
    """
    heat_losses(task, joint, m, g, load)
    ambient, reference = task.tasks[joint, AMBIENT], m[CONSTANT] * m[CONSTANT]
    motor = np.empty(heat_state.NUMBERS)
    motor[heat_state.RESISTANCE] = resistance(m, ambient) / reference
    motor[heat_state.SLOPE] = m[RESISTANCE] * m[COPPER] / reference
    motor[heat_state.CONSTANT], motor[heat_state.MAGNET] = m[CONSTANT], m[MAGNET]
    motor[heat_state.REFERENCE], motor[heat_state.AMBIENT] = m[REFERENCE], ambient
    motor[heat_state.INNER], motor[heat_state.OUTER] = m[INNER], m[OUTER]
    motor[heat_state.WINDING], motor[heat_state.HOUSING] = m[WINDING_CAPACITY], m[HOUSING_CAPACITY]
    scratch = load.scratch
    steady_state(
        motor, task.edges, task.shares, task.series[joint, STEP], scratch[SQUARE], scratch[LOSS],
        scratch[HEAT : HEAT + 3], scratch[WINDING], found,
    )  # fmt: skip


@compiled
def resistance(m: Array, temperature: float) -> float:
    """``winding_resistance``.

    Args:
        m: The motor's row.
        temperature: Of the winding [C].

    Returns:
        [ohm].
    """
    return float(m[RESISTANCE] * (1.0 + m[COPPER] * (temperature - m[REFERENCE])))


@compiled
def constant_at(m: Array, temperature: float) -> float:
    """``torque_constant``.

    Args:
        m: The motor's row.
        temperature: Of the magnets [C].

    Returns:
        [N m/A].
    """
    return float(m[CONSTANT] * (1.0 + m[MAGNET] * (temperature - m[REFERENCE])))


@fast
def voltage_peak(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad, warm: float, cold: float) -> float:
    """The largest voltage while running, warm with the temperatures in WINDING, or cold.

    Args:
        task: The packed study.
        joint: Index of the joint.
        m, g: Rows of motor and gear.
        load: The joint's, TOTAL and WINDING filled.
        warm: Torque constant of the warm motor [N m/A]; 0: the cold motor alone is asked.
        cold: Torque constant at ambient temperature [N m/A].

    Returns:
        [V].
    """
    row, total, winding, slope = task.series[joint], load.scratch[TOTAL], load.scratch[WINDING], load.scratch[HEAT]
    samples, speed = len(total), row[SPEED]
    slope[:] = 0.0
    if m[INDUCTANCE] > 0.0:
        behind, at, ahead = row[RATE_BEFORE], row[RATE_AT], row[RATE_AFTER]
        for t in range(samples):
            slope[t] = m[INDUCTANCE] * at[t] * total[t]
        left, factor, rate = total[:-1], behind[1:], slope[1:]
        for t in range(samples - 1):
            rate[t] += m[INDUCTANCE] * factor[t] * left[t]
        right, factor, rate = total[1:], ahead[:-1], slope[:-1]
        for t in range(samples - 1):
            rate[t] += m[INDUCTANCE] * factor[t] * right[t]
    peak = 0.0
    ohms, turning, inverse = resistance(m, task.tasks[joint, AMBIENT]), cold * g[RATIO], 1.0 / cold
    for t in range(samples):
        peak = larger(peak, abs(turning * speed[t] + inverse * (ohms * total[t] + slope[t])))
    if warm != 0.0:
        zero = m[RESISTANCE] * (1.0 - m[COPPER] * m[REFERENCE])
        gain, turning, inverse = m[RESISTANCE] * m[COPPER], warm * g[RATIO], 1.0 / warm
        for t in range(samples):
            volts = turning * speed[t] + inverse * ((zero + gain * winding[t]) * total[t] + slope[t])
            peak = larger(peak, abs(volts))
    return peak


@compiled
def start_voltage(task: PackedTask, joint: int, m: Array, load: JointLoad, warm: float, count: int) -> float:
    """The largest voltage to start from rest.

    Args:
        task: The packed study.
        joint: Index of the joint.
        m: The motor's row.
        load: The joint's, TOTAL, START and WINDING filled.
        warm: Torque constant of the warm motor [N m/A].
        count: Of the samples in START; 0: the joint never starts, TOTAL counts.

    Returns:
        [V].
    """
    peak, rests = 0.0, task.rests[joint]
    for i in range(len(rests)):
        t = rests[i]
        if t < 0:
            break
        torque = load.scratch[START, i] if count > 0 else abs(load.scratch[TOTAL, t])
        peak = max(peak, abs(resistance(m, load.scratch[WINDING, t]) * torque / warm))
    return peak
