"""How long an amplifier bears more than its continuous current: i2t with a peak time, or one time constant.

Both are periodic steady states: the answer holds for a cycle that repeats for ever.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import AmplifierSheet
from drivetrain.jit import law
from drivetrain.records import known


def overload(sheet: AmplifierSheet, current: Array, time: Array) -> float | None:
    """The largest share of its overload that an amplifier uses up in a cycle; above 1 it trips or folds back.

    With a peak time the integral of I^2 - I_c^2, never below zero, is held against (I_p^2 - I_c^2) t_p; with a time
    constant the first-order mean of I^2 against I_c^2. The current is constant from each sample to the next.

    Reference:
        The i2t monitor of servo drives: E' = I^2 - I_c^2 and theta' = (I^2/I_c^2 - theta)/tau.
    """
    if sheet.continuous_current is None:
        return None
    lacks = sheet.thermal_time_constant is None and (sheet.peak_current is None or sheet.peak_time is None)
    step = np.append(np.diff(np.asarray(time, dtype=np.float64)), 0.0)
    return None if lacks else float(overload_share(sheet, np.asarray(current, dtype=np.float64), 1.0, step))


@law
def overload_room(amplifier: Any) -> Any:
    """Where the overload trips: 1 of the first-order model, else ((I_p/I_c)^2 - 1) t_p [s]."""
    if known(amplifier.thermal_time_constant):
        return 1.0
    return ((amplifier.peak_current / amplifier.continuous_current) ** 2 - 1.0) * amplifier.peak_time


@law
def overload_after(amplifier: Any, held: Any, square: Any, step: Any) -> Any:
    """The overload after a step [s] of a current whose square over the continuous one's is told; - or [s]."""
    constant = amplifier.thermal_time_constant
    if known(constant):
        left = math.exp(-step / constant)
        return left * held + (1.0 - left) * square
    grown = held + (square - 1.0) * step
    return 0.5 * (grown + abs(grown))  # never below zero


@law
def overload_allows(amplifier: Any, held: Any, step: Any) -> Any:
    """Squared current over the continuous one's that just fills the overload in a step [s]; 1 where it is full."""
    constant = amplifier.thermal_time_constant
    if known(constant):
        left = math.exp(-step / constant)
        return (1.0 - left * held) / (1.0 - left)
    return 1.0 + (overload_room(amplifier) - held) / step


@law
def overload_share(amplifier: Any, series: Any, scale: Any, step: Any) -> Any:
    """``overload`` of a current that is a series times a scale [A], each sample for its step [s]."""
    steady, constant, total, length = amplifier.continuous_current, amplifier.thermal_time_constant, 0.0, 0.0
    most, held = 0.0, 0.0
    for t in range(len(step)):
        total += (series[t] * scale / steady) ** 2 * step[t]
        length += step[t]
    if known(constant):  # of the affine map of a round, the state that it leaves as it was
        for t in range(len(step)):
            held = overload_after(amplifier, held, (series[t] * scale / steady) ** 2, step[t])
        held = held / -math.expm1(-length / constant)
        most = held
        for t in range(len(step)):
            held = overload_after(amplifier, held, (series[t] * scale / steady) ** 2, step[t])
            most = max(most, held)
        return most
    if total > length * (1.0 + 1e-12):
        return math.inf
    room = overload_room(amplifier)
    for _ in range(2):  # from empty; what is left at the end of the first round is that of every round after it
        for t in range(len(step)):
            held = overload_after(amplifier, held, (series[t] * scale / steady) ** 2, step[t])
            most = max(most, held)
    if most == 0.0:
        return 0.0
    return most / room if room > 0.0 else math.inf


def peak_duration(sheet: AmplifierSheet, current: float) -> float | None:
    """How long an amplifier gives a current, from rest.

    Reference:
        tau ln(r^2/(r^2 - 1)), r = I/I_c, or (I_p^2 - I_c^2) t_p/(I^2 - I_c^2).
    """
    if sheet.continuous_current is None:
        return None
    square = (current / sheet.continuous_current) ** 2
    if square <= 1.0:
        return math.inf
    if sheet.thermal_time_constant is not None:
        return sheet.thermal_time_constant * math.log(square / (square - 1.0))
    if sheet.peak_current is None or sheet.peak_time is None:
        return None
    return ((sheet.peak_current / sheet.continuous_current) ** 2 - 1.0) * sheet.peak_time / (square - 1.0)
