"""The checks of ``judge.STAGES`` by number, and how compiled code holds a requirement against a limit."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_kernels import CHECKS
from drivetrain.sizing.judge.compiling import njit_leaf
from drivetrain.sizing.judge.packed_rows import (
    CONTINUOUS,
    DIRECT_DRIVE,
    MOMENTARY,
    PEAK_TORQUE,
    REPEATED,
    ROTOR,
    UNKNOWN,
)
from drivetrain.sizing.judge.packed_task import PEAK_FACTOR, Indices

# Checks in the order of ``judge.STAGES``.
(
    REPEATED_PEAK, MOMENTARY_PEAK, AVERAGE_TORQUE, MAXIMUM_INPUT, MEAN_INPUT_SPEED, GEAR_LIFE, TILTING_MOMENT,
    AXIAL_LOAD, RADIAL_LOAD, MOTOR_SPEED, INERTIA_RATIO, MOTOR_TORQUE, MOTOR_CURRENT, AMPLIFIER_CURRENT, VOLTAGE,
    RMS_CURRENT, TEMPERATURE, AMPLIFIER_RMS,
) = range(CHECKS)  # fmt: skip

NAMES = (
    "gear repeated peak torque", "gear momentary peak torque", "gear average torque", "gear maximum input speed",
    "gear mean input speed", "gear life L10", "output bearing tilting moment", "output bearing axial load",
    "output bearing radial load", "motor speed", "inertia ratio", "motor peak torque", "motor peak current",
    "amplifier peak current", "motor voltage", "motor RMS current", "winding temperature",
    "amplifier continuous current",
)  # fmt: skip
UNITS = ("N m", "N m", "N m", "rad/s", "rad/s", "h", "N m", "N", "N", "rad/s", "1", "N m", "A", "A", "V", "A", "C", "A")

CLOSE = 1e-9  # of a utilisation to 1: rounding, which the Python road decides
UNCHECKED = -1.0  # in place of a utilisation
REQUIRED, AVAILABLE, USED = 0, 1, 2


@njit_leaf
def held(row: Array, required: float, available: float) -> float:
    """A requirement held against a limit; it takes a row, as a number told would have it compiled again for each.

    Args:
        row: Of the check; takes required, available and utilisation, (3,).
        required: What the task asks; NaN where it could not be computed.
        available: What the part can do; NaN where nobody says.
    """
    row[REQUIRED], row[AVAILABLE] = required, available
    if np.isnan(required) or np.isnan(available):
        used = UNCHECKED
    elif available > 0.0:
        used = required / available
    else:
        used = 0.0 if required <= 0.0 else np.inf
    row[USED] = used
    return used


@njit_leaf
def essential_lack(m: Array, g: Array) -> int:
    """The first of the ESSENTIAL checks that cannot be made."""
    if g[DIRECT_DRIVE] == 0.0 and np.isnan(g[REPEATED]):
        return REPEATED_PEAK
    if g[UNKNOWN] != 0.0 or np.isnan(m[ROTOR]) or np.isnan(m[PEAK_TORQUE]):
        return MOTOR_TORQUE
    return RMS_CURRENT if np.isnan(m[CONTINUOUS]) else -1


@njit_leaf
def torque_unknown(m: Array, g: Array) -> bool:
    """Whether the sheets lack what the motor's torque is computed from."""
    return g[UNKNOWN] != 0.0 or np.isnan(m[ROTOR])


@njit_leaf
def gear_too_weak(
    pairs: Indices, gears: Array, offsets: Indices, tasks: Array, joint: int, pair: int, peak: float
) -> bool:
    """Whether the largest load torque alone is too much for a pair's gear; the first thing to look at.

    Args:
        peak: Largest load torque at least, without the joint's own drive [N m].
    """
    row, asked = pairs[pair, 1], tasks[joint, PEAK_FACTOR] * peak / (1.0 + CLOSE)
    if offsets[joint, joint] >= 0 or gears[row, DIRECT_DRIVE] != 0.0:
        return False
    return asked > gears[row, REPEATED] or asked > gears[row, MOMENTARY]
