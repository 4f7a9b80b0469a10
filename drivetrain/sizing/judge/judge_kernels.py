"""One pair of motor and gear at one joint, judged by compiled code with the numbers of ``judge.py``.

Order of use: ``load_joint`` sums up once what drives after a joint make of its work; ``judge_exact`` then judges any
pair of the joint against it. While the drives after it are open, ``bound_joint`` takes the interval of torque that
they leave, and ``may_hold`` rules out the pairs that no torque within it lets hold.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_state import MAGNETS
from drivetrain.sizing.demand.load_kernels import (
    CHECKS,
    PEAK_LOAD,
    JointBounds,
    JointLoad,
    bound_joint,
    load_force,
    load_joint,
    load_unit,
    new_bounds,
    new_load,
    own_load,
)
from drivetrain.sizing.judge.check_kernels import (
    current_checks,
    electric_checks,
    gear_checks,
    holds_speed,
    speed_checks,
    torque_check,
    warm_up,
)
from drivetrain.sizing.judge.check_numbers import (
    CLOSE,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    REPEATED_PEAK,
    UNCHECKED,
    USED,
    VOLTAGE,
    essential_lack,
    gear_too_weak,
    held,
    torque_unknown,
)
from drivetrain.sizing.judge.compiling import njit_entry, njit_face, njit_leaf, njit_part, njit_unit
from drivetrain.sizing.judge.packed_rows import DIRECT_DRIVE, INNER, MAGNET, MOMENTARY, PEAK_TORQUE, RATIO, REPEATED
from drivetrain.sizing.judge.packed_task import (
    AMBIENT,
    CURVED,
    PEAK_FACTOR,
    VOLTAGE_FACTOR,
    VOLTS,
    Indices,
    PackedTask,
    empty_task,
)
from drivetrain.sizing.judge.torque_kernels import constant_at, electrical_power, first_look, resistance, voltage_peak
from drivetrain.sizing.judge.units import address_of_unit, call_judge, call_load
from drivetrain.sizing.search.bound_kernels import least_energy, may_hold

__all__ = [
    "ASK", "ASKED", "FALLS", "HELD", "HOLDS", "LACKS", "JointBounds", "JointLoad", "bound_joint", "figures",
    "holds_speed", "judge_all", "judge_exact", "judge_units", "least_energy", "load_force", "load_joint", "may_hold",
    "new_bounds", "new_load", "pair_power",
]  # fmt: skip


HOLDS, FALLS, ASK = 0, 1, 2  # ASK: too close to a limit for rounding to decide; the Python road is the authority
LACKS = 100  # added to the number of a check that could not be made
EXACT, STAGES, FULL = 0, 1, 2
JUDGE, POWER, LOAD = range(3)
HELD, ASKED = -1, -2  # of ``judge_all``: pairs that hold, and those that the Python road is asked about


@njit_leaf
def _worst(checks: Array, first: int, last: int) -> int:
    """The check of largest utilisation among some."""
    found = first
    for check in range(first, last):
        if checks[check, USED] > checks[found, USED]:
            found = check
    return found


@njit_part
def _fails_at_once(task: PackedTask, joint: int, pair: int, load: JointLoad) -> int:
    """The check that a look at a few samples fells a pair by; -1 where it does not."""
    gear, at, over = task.pairs[pair, 1], task.offsets[joint, joint], 1.0 + CLOSE
    m, g, limits, row = task.motors[joint, task.pairs[pair, 0]], task.gears[gear], task.tasks[joint], task.series[joint]
    least = min(g[REPEATED], g[MOMENTARY]) if g[MOMENTARY] > 0.0 else g[REPEATED]
    strong = np.inf if g[DIRECT_DRIVE] != 0.0 else least * over / limits[PEAK_FACTOR]
    curved, enough, base = limits[CURVED] != 0.0, m[PEAK_TORQUE] * over / limits[PEAK_FACTOR], load.base[0]
    for samples in (load.instants, task.sharp[joint]):
        asked = first_look(row, m, g, curved, base, base, task.force, at, task.numbers, pair, samples)
        if asked[0] > strong:
            return REPEATED_PEAK
        if asked[1] > enough:
            return MOTOR_TORQUE
    return -1


@njit_unit
def _judge(task: PackedTask, joint: int, pair: int, load: JointLoad, mode: int) -> tuple[int, int, float]:
    """Both ways of judging; see ``judge_exact`` (EXACT) and ``figures`` (STAGES, FULL)."""
    peak = load.numbers[PEAK_LOAD]
    if mode == EXACT and gear_too_weak(task.pairs, task.gears, task.offsets, task.tasks, joint, pair, peak):
        return FALLS, REPEATED_PEAK, np.inf
    gear = task.pairs[pair, 1]
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[gear]
    limits, checks = task.tasks[joint], load.checks
    lack, quick = essential_lack(m, g), mode == EXACT
    if quick and lack >= 0:
        return FALLS, lack + LACKS, np.inf
    if quick:
        felled = _fails_at_once(task, joint, pair, load)
        if felled >= 0:
            return FALLS, felled, np.inf
    own_load(task, joint, pair, load)
    for check in range(CHECKS):
        checks[check, 0], checks[check, 1], checks[check, USED] = np.nan, np.nan, UNCHECKED
    over = 1.0 + CLOSE if quick else 1.0
    felled, used = -1, 0.0
    for stage in range(4):
        if stage == 0:
            used, last = gear_checks(task, joint, pair, load, mode == FULL), MOTOR_SPEED
        elif stage == 1:
            used, last = speed_checks(task, joint, pair, load), MOTOR_TORQUE
        elif torque_unknown(m, g):
            break
        elif stage == 2:
            torque = torque_check(task, joint, m, g, load)
            used, last = torque[2], MOTOR_TORQUE + 1
            cold = constant_at(m, limits[AMBIENT])
            # Warm magnets only add to the current, so what is too much for cold ones is known before the heat is.
            if quick and (m[MAGNET] <= 0.0 or np.isnan(m[INNER])):
                used = max(used, current_checks(task, joint, m, load, torque[0], torque[1], cold))
            if quick and used <= over:
                ohms = resistance(m, limits[AMBIENT])
                volts = voltage_peak(task.series[joint], m, g[RATIO], load.scratch, 0.0, cold, ohms)
                used = max(used, held(checks[VOLTAGE], limits[VOLTAGE_FACTOR] * volts, limits[VOLTS]))
        else:
            used, last = electric_checks(task, joint, m, g, load, torque), CHECKS
        if not used <= over and felled < 0:
            felled = _worst(checks, 0, CHECKS if quick else last)
            if mode != FULL:
                return FALLS, felled, checks[felled, USED]
    if felled >= 0:
        return FALLS, felled, checks[felled, USED]
    if lack >= 0:
        return FALLS, lack + LACKS, np.inf
    found = _worst(checks, 0, CHECKS)
    worst = checks[found, USED]
    return (ASK if quick and worst > 1.0 - CLOSE else HOLDS), found, worst


@njit_face
def judge_exact(task: PackedTask, joint: int, pair: int, load: JointLoad) -> tuple[int, int, float]:
    """Whether a pair holds at a joint: every check of ``judge.py`` until one fails.

    Returns:
        HOLDS, FALLS or ASK; the check that felled it (LACKS more where it could not be made), that is too close, or
        that binds; its utilisation, infinite where a part of the cycle or the lack of data told enough.
    """
    return _judge(task, joint, pair, load, np.int64(EXACT))


@njit_face
def figures(task: PackedTask, joint: int, pair: int, load: JointLoad, full: bool) -> tuple[int, int, float]:
    """Every check of a pair with its numbers, stage by stage as ``judge.py`` makes them."""
    return _judge(task, joint, pair, load, np.int64(FULL if full else STAGES))


def judge_units(task: PackedTask, load: JointLoad) -> Indices:
    """Addresses of the kernels that judge, by JUDGE, POWER and LOAD.

    Returns:
        Good for this process, (3,).
    """
    found = np.zeros(3, dtype=np.int64)
    for which in (LOAD, POWER, JUDGE):  # a helper may be at the dearest meanwhile
        found[which] = _unit(which, task, load)
    return found


def _unit(which: int, task: PackedTask, load: JointLoad) -> int:
    """The address of one of them."""
    if which == LOAD:
        return address_of_unit(f"{__name__}:compile_load", load_unit, task, 0, load.drives, load)
    if which == POWER:
        return address_of_unit(f"{__name__}:compile_power", _pair_power, task, 0, 0, load, load.base[0])
    return address_of_unit(f"{__name__}:compile_judge", _judge, task, 0, 0, load, 0)


def compile_load() -> None:
    """Have the summing up compiled, if it is not in the disk cache."""
    task = empty_task()
    _unit(LOAD, task, new_load(task))


def compile_power() -> None:
    """Have the electrical power compiled, if it is not in the disk cache."""
    task = empty_task()
    _unit(POWER, task, new_load(task))


def compile_judge() -> None:
    """Have the judge compiled, if it is not in the disk cache."""
    task = empty_task()
    _unit(JUDGE, task, new_load(task))


def judge_all(
    task: PackedTask, joint: int, pairs: Indices, drives: Array, load: JointLoad, codes: Indices, numbers: Array
) -> None:
    """Many pairs of one joint beside the same drives, with the figures that ``Judgement.fallen`` tells.

    Args:
        pairs: Indices into ``task.pairs``, (K,).
        drives: Numbers of the drives after it, as for ``load_joint``, (n, NUMBERS).
        codes: Takes the check that felled each pair, LACKS more where it could not be made, HELD, or ASKED where a
            check is too close to its limit, (K,).
        numbers: Takes required, available and utilisation of that check, or of the one that binds, (K, 3).
    """
    _judge_all(judge_units(task, load), task, joint, pairs, drives, load, codes, numbers)


def compile_judge_all() -> None:
    """Have the judging of many pairs compiled, if it is not in the disk cache."""
    task = empty_task()
    load, whole = new_load(task), np.zeros(1, dtype=np.int64)
    given = (whole, task, 0, whole, load.drives, load, whole, load.drives)
    _judge_all.compile(tuple(nb.typeof(one) for one in given))


@njit_entry
def _judge_all(
    units: Indices, task: PackedTask, joint: int, pairs: Indices, drives: Array, load: JointLoad, codes: Indices,
    numbers: Array,
) -> None:  # fmt: skip
    """``judge_all``."""
    call_load(units[LOAD], task, joint, drives, load)
    checks = load.checks
    for i in range(len(pairs)):
        verdict, check, _ = call_judge(units[JUDGE], task, joint, pairs[i], load, STAGES)
        codes[i] = HELD if verdict == HOLDS else check
        row = check - LACKS if check >= LACKS else check
        for column in range(3):
            numbers[i, column] = checks[row, column]
        for one in range(CHECKS):
            if abs(checks[one, USED] - 1.0) <= CLOSE:
                codes[i] = ASKED


@njit_unit
def _pair_power(task: PackedTask, joint: int, pair: int, load: JointLoad, power: Array) -> float:
    """``pair_power``."""
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    own_load(task, joint, pair, load)
    torque_check(task, joint, m, g, load)
    warm_up(task, joint, m, g, load)
    return electrical_power(task.series[joint], m, g[RATIO], load.scratch, constant_at(m, load.heat[MAGNETS]), power)


@njit_face
def pair_power(task: PackedTask, joint: int, pair: int, load: JointLoad, power: Array) -> float:
    """Electrical power of a pair at work.

    Args:
        power: Takes it at each sample, negative when regenerating [W], (N,).

    Returns:
        Energy over the cycle, what goes back credited [J].
    """
    return _pair_power(task, joint, pair, load, power)
