"""Torque, voltage and power of one motor of one arm as it is built: the loops over the samples of the motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drivetrain.arrays import Array
from drivetrain.sizing.vector_max import larger

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {"sizing/vector_max.py": 2907682659}

# Rows of a joint's series.
(FORCE, JOINT_FRICTION, LOSS_FRICTION, WAY, ROTOR_TORQUE, SHAFT, SPEED, TRAVEL, BEHIND, AT, AHEAD, LOSS, REST, NEXT,
 SERIES) = range(15)  # fmt: skip

# Numbers of a joint.
(
    RATIO, EFFICIENCY, BACK, LOSSLESS, NO_LOAD, RATED, CONSTANT, RESISTANCE, COPPER, REFERENCE, MAGNET, INDUCTANCE,
    INNER, OUTER, WINDING_CAPACITY, HOUSING_CAPACITY, KIND, HOTTEST, MARGIN, PRINTED, RESTS, MOVES, BREAK, BREAK_BACK,
    SHAFT_BREAK, SHAFT_BREAK_BACK, REPEATED, MOMENTARY, AVERAGE, EXPONENT, LIFE_SHARE, PEAK_TORQUE, PEAK_CURRENT,
    STALL_VOLTAGE, VOLTS, AMPLIFIER_PEAK, AMPLIFIER_MEAN, PEAK_FACTOR, RMS_FACTOR, VOLTAGE_FACTOR, NUMBERS,
) = range(41)  # fmt: skip

# Where a check stands; the order of ``judge.STAGES``.
(
    REPEATED_PEAK, MOMENTARY_PEAK, AVERAGE_TORQUE, MAXIMUM_INPUT, MEAN_INPUT, LIFE, TILTING, AXIAL, RADIAL,
    MOTOR_SPEED, INERTIA, MOTOR_TORQUE, MOTOR_CURRENT, AMPLIFIER_CURRENT, VOLTAGE, RMS_CURRENT, TEMPERATURE,
    AMPLIFIER_RMS, CHECKS,
) = range(19)  # fmt: skip
NAMES = (
    "gear repeated peak torque", "gear momentary peak torque", "gear average torque", "gear maximum input speed",
    "gear mean input speed", "gear life L10", "output bearing tilting moment", "output bearing axial load",
    "output bearing radial load", "motor speed", "inertia ratio", "motor peak torque", "motor peak current",
    "amplifier peak current", "motor voltage", "motor RMS current", "winding temperature",
    "amplifier continuous current",
)  # fmt: skip
SUPPLY_PEAK, SUPPLY_MEAN, SUPPLY_BACK, SUPPLY = range(4)

SHEET_AMBIENT = 25.0  # C, at which makers print continuous values


class ScatterTask(NamedTuple):
    """A set of drives at its work, for compiled code; n joints, N samples, P payloads.

    Attributes:
        series: Rows as above, SI, (n, SERIES, N).
        numbers: Columns as above, SI, (n, NUMBERS).
        weight: Time each sample stands for, as a share of the whole, (N,).
        loss: Moments of the loss in the housing in each block, (n, K, 2).
        payload: What the whole of each payload asks of each gear [N m], (n, P, N).
        bearing: Tilting moment's two, axial and radial force's two components, each followed by what the payloads add,
            (n, 5, 1 + P, samples); empty where the payload does not scatter or no bearing is judged.
        inertia: Inertia over that of the rotor and what the payloads add, over the limit, (n, 1 + P, samples).
        bearing_limits: Of tilting moment, axial and radial load over the factor on peaks, NaN where unknown, (n, 3).
        fixed: Utilisations that do not scatter, NaN for the rest and for what is not checked, (n, CHECKS).
        supply: Limits of peak, mean and regenerated power [W], NaN where there is none, (3,).
    """

    series: Array
    numbers: Array
    weight: Array
    loss: Array
    payload: Array
    bearing: Array
    inertia: Array
    bearing_limits: Array
    fixed: Array
    supply: Array


class Memory(NamedTuple):
    """What one thread writes into, again and again.

    Attributes:
        force: Torque at the gear with the payload drawn [N m], (N,).
        torque: Of one motor [N m], (N,).
        square: Mean square of it from each sample to the next [N^2 m^2], (N,).
        power: Electrical, of all joints [W], (N,).
        volts: The most that the warm motor can need [V], (N,).
        fixed: What of it does not depend on the resistance [V], (N,).
        start: Size of the torque that starts the joint, 0 where it moves [N m], (N,).
    """

    force: Array
    torque: Array
    square: Array
    power: Array
    volts: Array
    fixed: Array
    start: Array


@njit(cache=True, error_model="numpy")
def used_of(required: float, available: float) -> float:
    """A requirement over a limit.

    Args:
        required: What is asked, in any unit.
        available: What there is, in that unit; NaN where nobody says.

    Returns:
        1 at the limit; NaN where it is not known.
    """
    if np.isnan(available):
        return np.nan
    if available > 0.0:
        return required / available
    return 0.0 if required <= 0.0 else np.inf


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def torques(
    row: Array, mesh: tuple[float, float, float], ratio: float, rubbing: float, memory: Memory
) -> tuple[float, float]:
    """The motor's torque at every sample and its mean square to the next.

    Args:
        row: The joint's series.
        mesh: Factors of a driving, a driven and a resting mesh.
        ratio: Of the gear.
        rubbing: Factor on all friction.
        memory: Its force is read; takes torque and square.

    Returns:
        Largest load torque and largest motor torque [N m], what breaks the joint loose left out.
    """
    force, torque, square = memory.force, memory.torque, memory.square
    loss, way, rotor, shaft, friction = row[LOSS_FRICTION], row[WAY], row[ROTOR_TORQUE], row[SHAFT], row[JOINT_FRICTION]
    driving, driven, held = mesh[0] / ratio, mesh[1] / ratio, mesh[2] / ratio
    most_load, most = 0.0, 0.0
    for t in range(len(torque)):
        load = force[t] + rubbing * loss[t]
        crossing = load * way[t]
        factor = driving if crossing > 0.0 else driven
        factor = held if way[t] == 0.0 else factor
        torque[t] = factor * load + rotor[t] + rubbing * shaft[t]
    for t in range(len(torque)):
        most = larger(most, abs(torque[t]))
        most_load = larger(most_load, abs(force[t] + rubbing * friction[t]))
    left, right = torque[:-1], torque[1:]
    for t in range(len(right)):
        square[t] = (left[t] * left[t] + left[t] * right[t] + right[t] * right[t]) * (1.0 / 3.0)
    square[len(right)] = 0.0
    return most_load, most


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def mean_square(weight: Array, torque: Array) -> float:
    """The mean square over the task.

    Args:
        weight: Share of each sample, (N,).
        torque: [N m], (N,).

    Returns:
        [N^2 m^2].
    """
    total = 0.0
    for t in range(len(torque)):
        total += weight[t] * torque[t] * torque[t]
    return total


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def average_load(row: Array, force: Array, rubbing: float, exponent: float) -> float:
    """The average load torque as wear sees it.

    Args:
        row: The joint's series.
        force: At the gear [N m], (N,).
        rubbing: Factor on friction.
        exponent: Of torque.

    Returns:
        [N m].
    """
    travel, loss, total = row[TRAVEL], row[JOINT_FRICTION], 0.0
    if exponent == 3.0:
        for t in range(len(force)):
            load = abs(force[t] + rubbing * loss[t])
            total += travel[t] * load * load * load
    else:
        for t in range(len(force)):
            if travel[t] > 0.0:
                total += travel[t] * abs(force[t] + rubbing * loss[t]) ** exponent
    return total ** (1.0 / exponent)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def with_payload(base: Array, payload: Array, shares: Array, force: Array) -> None:
    """The torque at the gear with the payload drawn.

    Args:
        base: With nominal payloads [N m], (N,).
        payload: What the whole of each asks [N m], (P, N).
        shares: Of each that is there, (P,).
        force: Takes it [N m], (N,).
    """
    if len(shares) == 1:
        first, share = payload[0], shares[0] - 1.0
        for t in range(len(force)):
            force[t] = base[t] + share * first[t]
        return
    for t in range(len(force)):
        force[t] = base[t]
    for p in range(len(shares)):
        share, one = shares[p] - 1.0, payload[p]
        if share != 0.0:
            for t in range(len(force)):
                force[t] += share * one[t]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def add_power(row: Array, memory: Memory, zero: float, gain: float, winding: Array) -> None:
    """Electrical power of one motor, added to that of the others.

    Args:
        row: The joint's series.
        memory: Its torque is read; its power takes the sum [W].
        zero: Resistance at ambient temperature over the square of the torque constant.
        gain: Its change a kelvin.
        winding: Rise of the winding [K], (N,).
    """
    torque, power, speed = memory.torque, memory.power, row[SPEED]
    for t in range(len(torque)):
        power[t] += torque[t] * speed[t] + (zero + gain * winding[t]) * torque[t] * torque[t]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def at_rest(row: Array, p: Array, memory: Memory, driving: float, rubbing: float) -> tuple[float, float]:
    """What it takes to start from rest.

    Args:
        row: The joint's series.
        p: Its numbers.
        memory: Force and torque are read; its start takes the size of the torque at rest [N m].
        driving: Factor of a driving mesh.
        rubbing: Factor on all friction.

    Returns:
        Largest load torque and largest motor torque at rest [N m].
    """
    force, start, torque, still, after = memory.force, memory.start, memory.torque, row[REST], row[NEXT]
    friction, rotor = row[JOINT_FRICTION], row[ROTOR_TORQUE]
    forth, back = rubbing * p[BREAK], rubbing * p[BREAK_BACK]
    turning, returning = rubbing * p[SHAFT_BREAK], rubbing * p[SHAFT_BREAK_BACK]
    if p[RATIO] < 0.0:
        turning, returning = returning, turning
    lever, sign = driving / p[RATIO], 1.0 if p[RATIO] > 0.0 else -1.0
    load_peak, peak = 0.0, 0.0
    for t in range(len(force)):
        way = force[t] if force[t] != 0.0 else after[t]
        loose = forth if way > 0.0 else -back
        shaft = turning if way > 0.0 else -returning
        loose, shaft = (loose, shaft) if way != 0.0 else (0.0, 0.0)
        push = p[MOVES] * abs(lever * (force[t] + loose) + sign * shaft + rotor[t])
        start[t] = still[t] * larger(push, abs(torque[t]))
        load = force[t] + rubbing * friction[t]
        held = forth if load > 0.0 else -back
        held = p[MOVES] * held if load != 0.0 else 0.0
        load_peak = larger(load_peak, still[t] * abs(load + held))
        peak = larger(peak, start[t])
    return load_peak, peak


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def voltages(row: Array, p: Array, memory: Memory, ohms: tuple[float, float, float], warm: float, cold: float) -> float:
    """The voltage of the cold motor, and at each sample the most that the warm one can need.

    Args:
        row: The joint's series.
        p: Its numbers.
        memory: Torque and start are read; takes volts and fixed.
        ohms: Resistance at ambient temperature, and with the winding as cold and as hot as it gets [ohm].
        warm: Torque constant of the warm motor [N m/A].
        cold: At ambient temperature [N m/A].

    Returns:
        The largest of the cold motor [V].
    """
    torque, volts, fixed, speed, start = memory.torque, memory.volts, memory.fixed, row[SPEED], memory.start
    inverse, peak, inductance = 1.0 / cold, 0.0, p[INDUCTANCE]
    fixed[:] = 0.0
    if inductance > 0.0:
        behind, at, ahead = row[BEHIND], row[AT], row[AHEAD]
        fixed[0] = inductance * (at[0] * torque[0] + ahead[0] * torque[1])
        last = len(torque) - 1
        fixed[last] = inductance * (behind[last] * torque[last - 1] + at[last] * torque[last])
        inside, b1, a1, c1 = fixed[1:-1], behind[1:-1], at[1:-1], ahead[1:-1]
        left, middle, right = torque[:-2], torque[1:-1], torque[2:]
        for t in range(len(inside)):
            inside[t] = inductance * (b1[t] * left[t] + a1[t] * middle[t] + c1[t] * right[t])
    for t in range(len(torque)):
        peak = larger(peak, abs(cold * speed[t] + inverse * (ohms[0] * torque[t] + fixed[t])))
    inverse = 1.0 / warm
    for t in range(len(torque)):
        fixed[t] = warm * speed[t] + inverse * fixed[t]
    least, most = ohms[1] * inverse, ohms[2] * inverse
    for t in range(len(torque)):
        running = larger(abs(fixed[t] + least * torque[t]), abs(fixed[t] + most * torque[t]))
        volts[t] = larger(running, most * start[t])
    return peak


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def largest_of(values: Array) -> float:
    """The largest of some magnitudes.

    Args:
        values: In any unit, (N,).

    Returns:
        In that unit.
    """
    most = 0.0
    for t in range(len(values)):
        most = larger(most, values[t])
    return most


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def bearing_load(parts: Array, shares: Array, out: Array) -> None:
    """A load with the payloads drawn.

    Args:
        parts: The nominal one and what the whole of each payload adds, (1 + P, M).
        shares: Of each payload that is there, (P,).
        out: Takes it, (M,) at least.
    """
    nominal = parts[0]
    for t in range(len(nominal)):
        out[t] = nominal[t]
    for q in range(len(shares)):
        share, added = shares[q] - 1.0, parts[1 + q]
        for t in range(len(nominal)):
            out[t] += share * added[t]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def largest_pair(first: Array, second: Array, count: int) -> float:
    """The largest magnitude of a load with two components.

    Args:
        first, second: The components, (count,) at least.
        count: How many samples.

    Returns:
        In the unit of the components.
    """
    most = 0.0
    for t in range(count):
        most = larger(most, first[t] * first[t] + second[t] * second[t])
    return math.sqrt(most)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def supply_use(task: ScatterTask, power: Array, used: Array) -> None:
    """What all joints together ask of the supply.

    Args:
        task: Weights and limits.
        power: Of all joints [W], (N,).
        used: Takes the utilisations, (3,).
    """
    peak, drawn, back = 0.0, 0.0, 0.0
    weight = task.weight
    for t in range(len(power)):
        peak = larger(peak, power[t])
    for t in range(len(power)):
        forth = max(power[t], 0.0)
        drawn += weight[t] * forth
        back += weight[t] * (forth - power[t])
    used[SUPPLY_PEAK] = used_of(peak, task.supply[0])
    used[SUPPLY_MEAN] = used_of(drawn, task.supply[1])
    used[SUPPLY_BACK] = used_of(back, task.supply[2])
