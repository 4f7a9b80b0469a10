"""Checks of sampled motions: faults where no drive can follow, warnings where the data are implausible."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array, Mask
from drivetrain.errors import Fault, Faults
from drivetrain.motion.duty_cycle import Cycle, shown_unit
from drivetrain.motion.motion import Motion
from drivetrain.motion.smoothing import UNIFORM, is_uniform
from drivetrain.units import factor, from_si

SHORTEST = 1e-12  # [s] smallest time step: rates over shorter steps are rounding, and their squares overflow
FAULTS_SHOWN = 5  # largest number of faults of one kind reported for a column
GAP_IN_TIME = 5.0  # steps longer than this multiple of the median step are reported
# A step between samples is a jump when it is this many times the third largest of the eight steps around it: a motion
# that starts from rest has at least three large steps after the first; a glitch consists of two, out and back.
JUMP = 8.0
AROUND = 4  # neighbours on each side
SPIKE = 5.0  # the same ratio for accelerations
SPIKE_SHARE = 0.5  # a spike also reaches this share of the joint's largest acceleration
SMALLEST_JUMP = 1e-4  # [rad or m]
MISMATCH_FAULT = 0.15  # largest accepted difference between values and integrated rates, as a share of the span
MISMATCH_WARNING = 0.03  # the same ratio, above which there is a warning
PLAUSIBLE_ANGLE = 4.0 * math.pi  # [rad] joints of arms seldom make more than two turns either way
PLAUSIBLE_SPEED = 30.0  # [rad/s] joints of arms seldom turn faster than 290 rpm
SMALL_IN_DEGREES = 2.0 * math.pi  # a file in degrees with no larger value may be in radians
# Steps [s] and length [s] from which a sampled motion is implausibly slow: one in milliseconds at 1 kHz, over 1 s.
SLOW_STEP, LONG = 1.0, 1000.0
ALIKE = 0.99  # correlation of values and integrated rates that differ by a factor only
KNOWN_MISTAKES = (  # ratios of values to integrated rates that point to a known mistake
    (math.pi / 180.0, "the rates look like degrees, not radians"),
    (180.0 / math.pi, "the values look like degrees, not radians"),
    (2.0 * math.pi / 60.0, "the rates look like rpm, not rad/s"),
    (2.0 * math.pi, "the rates look like turns, not radians"),
    (60.0, "the rates look like those of a minute"),
    (1000.0, "the rates look a thousand times too small"),
    (0.001, "the rates look a thousand times too large"),
    (-1.0, "the sign is turned"),
)


class Series(NamedTuple):
    """One column of a file, as the checks need it."""

    name: str  # header of the column in the file
    values: Array  # in SI, (N,)
    rows: tuple[int, ...]  # line number in the file of every sample
    file: str  # path of the file, used in messages
    unit: str = ""  # unit in the file, used in messages


def time_faults(time: Series, *, pairs: bool) -> list[Fault]:
    """Faults where time does not increase; with ``pairs``, two samples (not more) may share an instant."""
    step = np.diff(time.values)
    wrong = (step < 0.0 if pairs else step <= 0.0) | ((step > 0.0) & (step < SHORTEST))
    if pairs:
        wrong[1:] |= (step[1:] == 0.0) & (step[:-1] == 0.0)
    rule = "must not go back, and at most two samples may share an instant" if pairs else "must increase"
    if np.any((step > 0.0) & (step < SHORTEST)):
        rule += f", by at least {SHORTEST:g} s"
    faults = Faults(time.file)
    for i in np.flatnonzero(wrong)[:FAULTS_SHOWN]:
        faults.add(_place(time, i + 1), f"time {rule}", float(time.values[i + 1]))
    if wrong.sum() > FAULTS_SHOWN:
        faults.add(f"column {time.name}", f"{wrong.sum() - FAULTS_SHOWN} more rows like this")
    if not faults.found and time.values[-1] <= time.values[0]:
        faults.add(f"column {time.name}", "time must go on")
    return faults.found


def sampling_notes(time: Array, positions: list[Array]) -> list[str]:
    """Notes on non-uniform sampling; a gap gives a warning only if a joint moves during it."""
    distinct = np.unique(time)
    if len(distinct) < 3 or is_uniform(distinct):
        return []
    step = np.diff(distinct)
    usual = float(np.median(step))
    text = f"sampling is not uniform to {100 * UNIFORM:g} %: steps of {step.min():.4g} to {step.max():.4g} s"
    moving = np.any([np.diff(position) != 0.0 for position in positions], axis=0)
    gaps = np.flatnonzero(moving & (np.diff(time) > GAP_IN_TIME * usual))
    if len(gaps):
        return [f"warning: {text}; something moves in the gap after t = {time[gaps[0]]:.4g} s"]
    return [text]


def jump_faults(time: Array, series: Series, resolution: float, *, turns: bool) -> list[Fault]:
    """Faults where a position jumps, or has a spike of one sample.

    Jumps of up to 20 steps of the ``resolution`` [SI] are accepted. Where a joint turns, a jump of 360 degrees is a
    wrapped angle.
    """
    length, scale = np.diff(time), factor(series.unit)
    step = np.abs(np.diff(series.values))
    faults = Faults(series.file)
    for i in np.flatnonzero((length == 0.0) & (step > SMALLEST_JUMP))[:FAULTS_SHOWN]:
        faults.add(_place(series, i + 1), f"position steps at t = {time[i]:.6g} s", float(series.values[i + 1] / scale))
    moving = np.flatnonzero(length > 0.0)
    rate = step[moving] / length[moving]
    sudden = moving[isolated(rate, JUMP) & (step[moving] > max(SMALLEST_JUMP, 20.0 * resolution))]
    groups = np.split(sudden, np.flatnonzero(np.diff(sudden) > 1) + 1) if len(sudden) else []
    for group in groups[:FAULTS_SHOWN]:
        first, size = int(group[0]), float(series.values[group[0] + 1] - series.values[group[0]])
        what = "jumps" if len(group) == 1 else "has a spike"
        what = f"position {what} by {size / scale:.4g} {series.unit} at t = {time[first + 1]:.6g} s"
        turned = turns and abs(abs(size) - 2.0 * math.pi) < 0.2 * math.pi
        hint = "the angle is wrapped: unwrap it" if turned else "no drive can follow; if it is meant, sample it finer"
        faults.add(_place(series, first + 1), what, float(series.values[first + 1] / scale), hint)
    if len(groups) > FAULTS_SHOWN:
        faults.add(f"column {series.name}", f"{len(groups) - FAULTS_SHOWN} more jumps like this")
    return faults.found


def isolated(sizes: Array, times_larger: float) -> NDArray[np.bool_]:
    """Which values exceed ``times_larger`` times the third largest of their eight neighbours, (N,)."""
    if len(sizes) < 2 * AROUND + 2:
        return np.zeros(len(sizes), dtype=np.bool_)
    padded = np.pad(sizes, AROUND, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1)
    around = np.delete(windows, AROUND, axis=1)
    third = np.partition(around, -3, axis=1)[:, -3]
    return np.asarray((sizes > times_larger * third) & (sizes > 0.0))


def spike_warnings(time: Array, acceleration: Array, joint: str, unit: str) -> Iterator[str]:
    """Warning about the largest spike of acceleration that lasts one or two samples, in the unit of the positions."""
    size = np.abs(acceleration)
    spikes = np.flatnonzero(isolated(size, SPIKE) & (size > SPIKE_SHARE * size.max()))
    if len(spikes):
        worst = int(spikes[size[spikes].argmax()])
        text = f"acceleration of {joint} has a spike of {acceleration[worst] / factor(unit):.4g} {unit}/s^2"
        yield f"warning: {text} at t = {time[worst]:.6g} s: peak torque will be that of the spike"


def rate_mismatch(time: Array, values: Series, rates: Series, smallest: float) -> tuple[list[Fault], list[str]]:
    """Faults and warnings where the integrated rates differ from the given values.

    Differences up to ``smallest`` [SI] are ignored, unless a known mistake explains them.
    """
    travel = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (rates.values[1:] + rates.values[:-1]))])
    wanted, travel = values.values - values.values.mean(), travel - travel.mean()
    span = max(float(np.ptp(wanted)), float(np.ptp(travel)))
    off = np.abs(wanted - travel)
    worst = int(off.argmax())
    if span == 0.0 or off[worst] <= MISMATCH_WARNING * span:
        return [], []
    hint, alike = _known_mistake(wanted, travel)
    if off[worst] <= smallest and not (hint and alike):
        return [], []
    share = float(off[worst]) / span
    problem = f"is not the derivative of {values.name}: integrated, it misses by {100 * share:.3g} % of the span"
    if share > MISMATCH_FAULT:
        return [Fault(f"column {rates.name}", problem, None, hint, rates.file)], []
    return [], [f"warning: column {rates.name} {problem}" + (f"; {hint}" if hint else "")]


def unit_warnings(column: str, unit: str, position: Array, joint: str) -> Iterator[str]:
    """Warning if positions in radians are so large that they may be degrees."""
    largest = float(np.abs(position).max())
    if unit.casefold().startswith("rad") and largest > PLAUSIBLE_ANGLE:
        turns = largest / (2.0 * math.pi)
        yield f"warning: column {column}: {joint} reaches {largest:.4g} rad, {turns:.3g} turns: are these degrees?"


def small_angle_warnings(columns: list[str], positions: list[Array]) -> Iterator[str]:
    """Warning if no position in degrees exceeds 6.3 degrees, so that the values may be radians."""
    largest = max((float(np.abs(from_si(position, "rad", "deg")).max()) for position in positions), default=0.0)
    if 0.0 < largest <= SMALL_IN_DEGREES:
        yield f"warning: no angle of {', '.join(columns)} exceeds {largest:.3g} deg: are these radians?"


def speed_warnings(column: str, speed: Array, joint: str) -> Iterator[str]:
    """Warning if joint speeds in rad/s are so large that they may be deg/s, rpm or motor speeds."""
    largest = float(np.abs(speed).max())
    if largest > PLAUSIBLE_SPEED:
        yield f"warning: column {column}: {joint} reaches {largest:.4g} rad/s: is this deg/s, rpm or a motor's speed?"


def slow_warnings(time: Array) -> Iterator[str]:
    """Warning if samples are so far apart, and last so long, that the times may be milliseconds."""
    step, whole = float(np.median(np.diff(time))), float(time[-1] - time[0])
    if step >= SLOW_STEP and whole >= LONG:
        yield f"warning: samples {step:.4g} s apart, {whole:.4g} s in all: are the times milliseconds?"


def _known_mistake(wanted: Array, travel: Array) -> tuple[str, bool]:
    """Message of the known mistake whose factor explains wanted = factor x travel, empty if there is none, and whether
    nothing but a factor distinguishes them.
    """
    power = float(travel @ travel)
    if power == 0.0:
        return "the rates are zero", False
    factor = float(wanted @ travel) / power
    alike = abs(float(wanted @ travel)) > ALIKE * math.sqrt(power * float(wanted @ wanted))
    for known, words in KNOWN_MISTAKES:
        if abs(factor / known - 1.0) < 0.02:
            return words, alike
    return "", alike


def _place(series: Series, index: int) -> str:
    return f"row {series.rows[index]}, column {series.name}"


# ---------------------------------------------------------------- ranges of joints

ROUNDING = 1e-6  # [rad or m] positions may exceed a limit by the rounding of numbers in files


class LimitNotes(NamedTuple):
    """Faults, which make the motion invalid, and warnings, which the report shows."""

    faults: tuple[Fault, ...]
    warnings: tuple[str, ...]


def limit_notes(
    motion: Motion | Cycle,
    lower: Array,
    upper: Array,
    speed_limits: Array,
    *,
    name: str = "motion",
    slides: Mask | None = None,
) -> LimitNotes:
    """Faults where a motion leaves the joints' ranges, and warnings where it exceeds the arm's speed limits.

    Exceeding a speed limit is only a warning, because the limit in a robot file is that of the drives to be replaced.
    Messages call the motion ``name``, and use m and deg if ``slides`` says which joints are prismatic, (n,).
    """
    faults: list[Fault] = []
    warnings: list[str] = []
    sides = (
        ("above the upper limit", motion.position - upper, upper),
        ("below the lower limit", lower - motion.position, lower),
    )
    outside = np.maximum(sides[0][1], sides[1][1]).max(axis=0) > ROUNDING
    for joint in map(int, np.flatnonzero(outside)):
        unit, factor = shown_unit(slides, joint)
        problem, found = "", math.nan  # one fault for both sides: a wrong unit leaves the range on either
        for side, beyond, limit in sides:
            worst = int(beyond[:, joint].argmax())
            if not beyond[worst, joint] > ROUNDING:
                continue
            value, bound = factor * float(motion.position[worst, joint]), factor * float(limit[joint])
            where = f"{side} of {bound:.6g} {unit} at t = {motion.time[worst]:.4g} s"
            problem = f"{problem}, and to {value:.6g}, {where}" if problem else f"goes {where}"
            found = value if math.isnan(found) else found
        faults.append(Fault(f"{name}, joint {motion.joint_names[joint]}", problem, float(f"{found:.6g}")))
    speed = np.abs(motion.velocity)
    for joint in map(int, np.flatnonzero(speed.max(axis=0) > np.asarray(speed_limits) * (1.0 + ROUNDING))):
        worst, (unit, factor) = int(speed[:, joint].argmax()), shown_unit(slides, joint)
        rate = unit.replace(" or", "/s or") + "/s"
        warnings.append(
            f"warning: {name}: joint {motion.joint_names[joint]} reaches {factor * speed[worst, joint]:.4g} at "
            f"t = {motion.time[worst]:.4g} s, above the arm's speed limit {factor * speed_limits[joint]:.4g} [{rate}]"
        )
    return LimitNotes(tuple(faults), tuple(warnings))
