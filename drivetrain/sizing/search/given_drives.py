"""Drives that a study gives although their sheets lack data: a search takes them as they are, and chooses the others.

What cannot be checked of them counts for nothing in the search, and ``evaluate`` then says that the set is not proven
to fit. Compiled code gets rows in which the limits that nobody states are out of reach.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.judge.check_numbers import essential_lack, torque_unknown
from drivetrain.sizing.judge.missing import massless
from drivetrain.sizing.judge.packed_rows import (
    CONTINUOUS,
    HOUSING_CAPACITY,
    INDUCTANCE,
    INNER,
    MAX_WINDING,
    OUTER,
    PEAK_CURRENT,
    PEAK_TORQUE,
    REPEATED,
    ROTOR,
    UNKNOWN,
    WINDING_CAPACITY,
)
from drivetrain.sizing.judge.packed_task import AMPLIFIER_CONTINUOUS, AMPLIFIER_PEAK, RATIO_LIMIT, VOLTS, Packed
from drivetrain.sizing.results import Evaluation
from drivetrain.study.verdicts import Verdict

OUT_OF_REACH = 1e30  # SI, of any limit


def as_given(packed: Packed) -> Packed:
    """A packed study in which a given drive is held only against what its sheets state."""
    for joint, task in enumerate(packed.study.joints):
        if task.drive is not None:
            packed = _excused(packed, joint)
    return packed


def stands(evaluation: Evaluation) -> bool:
    """Whether a set holds as far as the drives that were to be chosen go."""
    if evaluation.feasible:
        return True
    given = {task.name for task in evaluation.study.joints if task.drive is not None}
    lacking = {name for name, joint in evaluation.joints.items() if joint.lacking}
    lacking |= set(massless(evaluation.study, evaluation.joints))
    return evaluation.verdict is not Verdict.FAIL and lacking <= given


def _excused(packed: Packed, joint: int) -> Packed:
    """The same with the given drive of one joint held against nothing that is not known."""
    task, pair = packed.task, int(packed.task.first[joint])
    motor, gear = task.pairs[pair]
    m, g = task.motors[joint, motor].copy(), task.gears[gear].copy()
    if essential_lack(m, g) < 0:
        return packed
    motors, tasks, pairs = task.motors.copy(), task.tasks.copy(), task.pairs.copy()
    if np.isnan(g[REPEATED]):
        g[REPEATED] = OUT_OF_REACH
    unknown = torque_unknown(m, g)
    if unknown:
        _without_motor(m, g, tasks[joint])
    for column in (PEAK_TORQUE, CONTINUOUS):
        if np.isnan(m[column]):
            m[column] = OUT_OF_REACH
    motors[joint, motor], pairs[pair, 1] = m, len(task.gears)
    given = task._replace(
        motors=motors, tasks=tasks, pairs=pairs, gears=np.vstack([task.gears, g]),
        exponent_of=np.append(task.exponent_of, task.exponent_of[gear]),
    )  # fmt: skip
    known = packed.power_known and not unknown
    return replace(packed, task=given, gears=(*packed.gears, packed.gears[gear]), power_known=known)


def _without_motor(m: Array, g: Array, limits: Array) -> None:
    """Nothing that needs the motor's torque is judged, as in an evaluation; its energy is counted as far as known."""
    if np.isnan(m[ROTOR]):
        limits[RATIO_LIMIT] = math.nan
    m[ROTOR], g[UNKNOWN] = np.nan_to_num(m[ROTOR]), 0.0
    m[PEAK_TORQUE] = m[CONTINUOUS] = limits[VOLTS] = OUT_OF_REACH
    for column in (PEAK_CURRENT, MAX_WINDING, INNER, OUTER, WINDING_CAPACITY, HOUSING_CAPACITY):
        m[column] = math.nan
    m[INDUCTANCE] = 0.0
    limits[AMPLIFIER_PEAK] = limits[AMPLIFIER_CONTINUOUS] = math.nan
