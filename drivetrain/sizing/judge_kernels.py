"""One pair of motor and gear at one joint, judged by compiled code with the numbers of ``judge.py``.

Order of use: ``load_joint`` sums up once what drives after a joint make of its work; ``judge_exact`` then judges any
pair of the joint against it. While the drives after it are open, ``bound_joint`` takes the interval of torque that
they leave, and ``may_hold`` rules out the pairs that no torque within it lets hold.
"""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_state import MAGNETS
from drivetrain.sizing.bound_kernels import least_energy, may_hold
from drivetrain.sizing.check_kernels import (
    CLOSE,
    MOTOR_TORQUE,
    REPEATED_PEAK,
    UNCHECKED,
    USED,
    VOLTAGE,
    current_checks,
    electric_checks,
    essential_lack,
    gear_checks,
    held,
    holds_speed,
    new_state,
    speed_checks,
    torque_check,
    torque_unknown,
    warm_up,
)
from drivetrain.sizing.load_kernels import (
    CHECKS,
    FORCE,
    PEAK_LOAD,
    JointBounds,
    JointLoad,
    bound_joint,
    compiled,
    fast,
    load_force,
    load_joint,
    new_bounds,
    new_load,
    sum_up,
)
from drivetrain.sizing.packed_rows import DIRECT_DRIVE, INNER, MAGNET, MOMENTARY, RATIO, REPEATED
from drivetrain.sizing.packed_task import AMBIENT, PEAK_FACTOR, SPEED, VOLTAGE_FACTOR, VOLTS, WEIGHT, PackedTask
from drivetrain.sizing.torque_kernels import TOTAL, WINDING, constant_at, pair_torque, resistance, voltage_peak

__all__ = [
    "ASK", "FALLS", "HOLDS", "JointBounds", "JointLoad", "bound_joint", "figures", "holds_speed", "judge_exact",
    "least_energy", "load_force", "load_joint", "may_hold", "new_bounds", "new_load", "pair_power",
]  # fmt: skip

HOLDS, FALLS, ASK = 0, 1, 2  # ASK: too close to a limit for rounding to decide; the Python road is the authority
LACKS = 100  # added to the number of a check that could not be made


@compiled
def _felled(used: float) -> bool:
    """Whether a utilisation is above 1 beyond rounding, or not a number."""
    return not used <= 1.0 + CLOSE


@compiled
def _worst(load: JointLoad, first: int, last: int) -> int:
    """The check of largest utilisation among some."""
    found = first
    for check in range(first, last):
        if load.checks[check, USED] > load.checks[found, USED]:
            found = check
    return found


@compiled
def own_load(task: PackedTask, joint: int, pair: int, load: JointLoad) -> None:
    """Add what the joint's own drive asks of it, where it rides on the link that it moves.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: From ``load_joint``.
    """
    if task.offsets[joint, joint] >= 0:
        load.drives[joint] = task.numbers[pair]
        load_force(task, joint, load.drives, load.series[FORCE])
        sum_up(task, joint, load)


@compiled
def judge_exact(task: PackedTask, joint: int, pair: int, load: JointLoad) -> tuple[int, int, float]:
    """Whether a pair holds at a joint: every check of ``judge.py`` until one fails.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: From ``load_joint``.

    Returns:
        HOLDS, FALLS or ASK; the check that felled it (LACKS more where it could not be made), that is too close, or
        that binds; its utilisation.
    """
    row, which = task.pairs[pair, 1], task.exponent_of[task.pairs[pair, 1]]
    m, g, limits = task.motors[joint, task.pairs[pair, 0]], task.gears[row], task.tasks[joint]
    lack = essential_lack(m, g)
    if lack >= 0:
        return FALLS, lack + LACKS, np.inf
    own_load(task, joint, pair, load)
    if g[DIRECT_DRIVE] == 0.0:
        peak = limits[PEAK_FACTOR] * load.numbers[PEAK_LOAD]
        if peak > g[REPEATED] * (1.0 + CLOSE) or peak > g[MOMENTARY] * (1.0 + CLOSE):
            return FALLS, REPEATED_PEAK, peak / g[REPEATED]
    load.checks[:, USED] = UNCHECKED
    if _felled(speed_checks(task, joint, m, g, load)) or _felled(gear_checks(task, joint, g, which, load)):
        found = _worst(load, 0, MOTOR_TORQUE)
        return FALLS, found, load.checks[found, USED]
    largest, square = pair_torque(task, joint, m, g, load)
    peak, count, used = torque_check(task, joint, m, g, load, largest)
    ambient = limits[AMBIENT]
    cold = constant_at(m, ambient)
    # Warm magnets only add to the current, so what is too much for cold ones is known before the heat is.
    if m[MAGNET] <= 0.0 or np.isnan(m[INNER]):
        used = max(used, current_checks(task, joint, m, load, peak, square, cold))
    if not _felled(used):
        volts = limits[VOLTAGE_FACTOR] * voltage_peak(task, joint, m, g, load, 0.0, cold)
        used = max(used, held(load.checks, VOLTAGE, volts, limits[VOLTS]))
    if not _felled(used):
        used = electric_checks(task, joint, m, g, load, (peak, square, count), new_state())
    found = _worst(load, 0, CHECKS)
    worst = load.checks[found, USED]
    if _felled(used):
        return FALLS, found, max(used, worst)
    return (ASK if worst > 1.0 - CLOSE else HOLDS), found, worst


@compiled
def figures(task: PackedTask, joint: int, pair: int, load: JointLoad, full: bool) -> int:
    """Every check of a pair with its numbers, stage by stage as ``judge.py`` makes them.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: From ``load_joint``; takes the figures in ``checks``.
        full: Make every check, also after one has failed.

    Returns:
        The failed check of highest utilisation in the stage where the first failed; a check that could not be made
        but must be, LACKS more; -1 for a pair that holds.
    """
    row, which = task.pairs[pair, 1], task.exponent_of[task.pairs[pair, 1]]
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[row]
    own_load(task, joint, pair, load)
    load.checks[:] = np.nan
    load.checks[:, USED] = UNCHECKED
    felled = -1
    if not gear_checks(task, joint, g, which, load) <= 1.0:
        felled = _worst(load, 0, MOTOR_TORQUE)
        if not full:
            return felled
    if not speed_checks(task, joint, m, g, load) <= 1.0 and felled < 0:
        felled = _worst(load, 0, MOTOR_TORQUE)
        if not full:
            return felled
    if not torque_unknown(m, g):
        largest, square = pair_torque(task, joint, m, g, load)
        peak, count, used = torque_check(task, joint, m, g, load, largest)
        if not used <= 1.0 and felled < 0:
            felled = MOTOR_TORQUE
            if not full:
                return felled
        if not electric_checks(task, joint, m, g, load, (peak, square, count), new_state()) <= 1.0 and felled < 0:
            felled = _worst(load, MOTOR_TORQUE + 1, CHECKS)
    lack = essential_lack(m, g)
    return felled if felled >= 0 else (lack + LACKS if lack >= 0 else -1)


@fast
def pair_power(task: PackedTask, joint: int, pair: int, load: JointLoad, power: Array) -> float:
    """Electrical power of a pair at work.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``; its torque can be computed.
        load: From ``load_joint``.
        power: Takes it at each sample, negative when regenerating [W], (N,).

    Returns:
        Energy over the cycle, what goes back credited [J].
    """
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    own_load(task, joint, pair, load)
    pair_torque(task, joint, m, g, load)
    state = new_state()
    warm_up(task, joint, m, g, load, state)
    constant = constant_at(m, state[MAGNETS])
    speed, weight = task.series[joint, SPEED], task.series[joint, WEIGHT]
    total, winding = load.scratch[TOTAL], load.scratch[WINDING]
    energy, square = 0.0, 1.0 / (constant * constant)
    zero, gain = resistance(m, 0.0), resistance(m, 1.0) - resistance(m, 0.0)
    for t in range(len(power)):
        power[t] = total[t] * (g[RATIO] * speed[t]) + (zero + gain * winding[t]) * total[t] * total[t] * square
        energy += weight[t] * power[t]
    return energy
