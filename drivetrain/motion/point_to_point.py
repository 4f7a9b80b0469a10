"""Motions through waypoints, at rest at each waypoint."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array, checked_number, real_array
from drivetrain.errors import LARGEST, Fault, Faults, InputError, raise_faults
from drivetrain.motion.motion import Motion
from drivetrain.motion.profiles import Law, PathLimits, Profile

TOO_SHORT = 1.0 - 1e-9  # a duration that is shorter than the minimum by rounding only is accepted

SHORTEST_MOVE = 1e-9  # [s] a shorter move is an impulse
MOST_SAMPLES = 1e7  # largest number for one move
SMALLEST_DISTANCE = 1e-12  # [rad or m] a smaller distance between two points is rounding, not a move


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Limits of each joint; a number applies to all joints, infinity means no limit.

    Attributes:
        speed: [rad/s or m/s], number or (n,).
        acceleration: [rad/s^2 or m/s^2], number or (n,).
        jerk: [rad/s^3 or m/s^3], number or (n,).
    """

    speed: Any = math.inf
    acceleration: Any = math.inf
    jerk: Any = math.inf


def waypoint_motion(
    name: str,
    joint_names: tuple[str, ...],
    points: Any,
    *,
    profile: Profile,
    durations: Any = None,
    limits: MotionLimits | None = None,
    dwell: Any = None,
    sample_time: float = 0.002,
) -> Motion:
    """The motion through the points, at rest at each; all joints start and stop together.

    A move needs a duration or limits. With both, the fastest profile within the limits is stretched to the duration. A
    move of zero length takes no time if only limits are given; with a duration it is a dwell.

    Args:
        name: Name of the motion.
        joint_names: (n,).
        points: Positions [rad or m], (k, n).
        profile: Such as ``Quintic()``, ``Trapezoid()`` or ``SCurve()``.
        durations: Duration of each move [s], (k - 1,).
        limits: Limits of speed, acceleration and jerk of each joint.
        dwell: Time at rest at each point after reaching it [s], (k,).
        sample_time: Largest time between samples [s].

    Returns:
        The motion, starting at time 0.

    Raises:
        InputError: Wrong shapes, negative or missing times, limits that are not positive, or a duration that is too
            short for its move; all of them listed.
    """
    place = f"motion {name}"
    if not hasattr(profile, "over"):
        raise InputError(Fault(f"{place}: profile", "must be a profile", profile, "such as Quintic()"))
    points = checked_array(points, (None, len(joint_names)), f"{place}: points")
    if len(points) == 0:
        raise InputError(Fault(place, "needs at least one point"))
    waits = np.zeros(len(points)) if dwell is None else checked_array(dwell, (len(points),), f"{place}: dwell")
    times = None if durations is None else checked_array(durations, (len(points) - 1,), f"{place}: durations")
    bounds = None if limits is None else limit_rows(limits, len(joint_names), place)
    _check_times(times, waits, sample_time, place)
    blocks, faults = [rest(points[0], 0.0, float(waits[0]))], []
    for index, (start, end) in enumerate(itertools.pairwise(points)):
        duration = None if times is None else float(times[index])
        try:
            block = joint_move(start, end, profile, duration, bounds, sample_time)
        except InputError as error:
            here = f"{place}: point {index + 1} to point {index + 2}"
            faults += [Fault(here, fault.problem, fault.value, fault.hint) for fault in error.faults]
            continue
        blocks += [block, rest(end, 0.0, float(waits[index + 1]))]
    raise_faults(faults)
    return joined(name, joint_names, blocks, f"{len(points)} waypoints, {type(profile).__name__} profile")


waypoints = waypoint_motion  # the name that studies and the guide use


def limit_rows(limits: MotionLimits, n: int, place: str) -> Array:
    """Speed, acceleration and jerk limits of every joint, (3, n)."""
    rows, faults = np.empty((3, n)), []
    for row, what in zip(rows, ("speed", "acceleration", "jerk"), strict=True):
        given = getattr(limits, what)
        try:
            value = real_array(given)
        except (TypeError, ValueError, OverflowError):
            value = np.full(1, np.nan)
        reachable = value.shape in ((), (n,)) and bool(((value > 0.0) & ((value <= LARGEST) | np.isinf(value))).all())
        if reachable:
            row[:] = value
        else:
            problem = f"must be above zero, one number or {n}; infinite where free"
            faults.append(Fault(f"{place}: {what} limit", problem, given))
    raise_faults(faults)
    return rows


def _check_times(times: Array | None, waits: Array, sample_time: float, place: str) -> None:
    faults = Faults()
    for what, values in (("dwell", waits), ("durations", np.empty(0) if times is None else times)):
        for i, value in enumerate(values):
            if value < 0:
                faults.add(f"{place}: {what}[{i}]", "must not be negative", float(value))
    faults.attempt(checked_number, sample_time, f"{place}: sample time", "s", above=0.0)
    faults.raise_any()


def _law(distance: Array, profile: Profile, duration: float | None, bounds: Array | None) -> Law | None:
    """The path law s(t) of one move over ``distance`` [rad or m], (n,); None if no joint moves."""
    moving = distance > SMALLEST_DISTANCE
    if not moving.any():
        return None
    if duration is not None and duration < SHORTEST_MOVE:
        raise InputError(Fault("", "moves in zero time: an impulse, which no drive can give", duration))
    if bounds is None:
        if duration is None:
            raise InputError(Fault("", "needs a duration, or limits of speed and acceleration"))
        return profile.over(duration)
    quickest = profile.fastest(PathLimits(*(float(v) for v in (bounds[:, moving] / distance[moving]).min(axis=1))))
    if duration is None:
        return quickest
    if duration < quickest.duration * TOO_SHORT:
        least = f"within the limits it takes at least {quickest.duration:.4g} s"
        raise InputError(Fault("", f"the duration is too short: {least}", duration))
    return quickest.stretched(duration)


def joint_move(
    start: Array, end: Array, profile: Profile, duration: float | None, bounds: Array | None, sample_time: float
) -> Array:
    """Samples of one move: time, then position, velocity and acceleration of every joint, (N, 1 + 3 n)."""
    law = _law(np.abs(end - start), profile, duration, bounds)
    if law is None:
        return rest(end, 0.0, duration or 0.0)
    time, along, rate, second = sampled_law(law, sample_time).T[:, :, np.newaxis]
    step = end - start
    position = start + along * step
    position[-1] = end
    return np.hstack([time, position, rate * step, second * step])


def sampled_law(law: Law, sample_time: float) -> Array:
    if not law.duration / sample_time <= MOST_SAMPLES:
        problem = f"takes {law.duration:.3g} s, more than {MOST_SAMPLES:g} samples"
        raise InputError(Fault("", problem, None, "check distances, limits and sample time"))
    return law.sampled(sample_time)


def rest(point: Array, start: float, length: float) -> Array:
    """Samples at rest at ``point`` for ``length`` [s] from ``start`` [s], in the columns of ``joint_move``."""
    times = np.array([[start], [start + length]]) if length > 0.0 else np.array([[start]])
    return np.hstack([times, np.tile(point, (len(times), 1)), np.zeros((len(times), 2 * point.size))])


def joined(name: str, joint_names: tuple[str, ...], blocks: list[Array], how: str) -> Motion:
    """Join blocks of samples into a motion, without repeated samples; a step of acceleration keeps its two samples."""
    begin = 0.0
    for block in blocks:
        block[:, 0] += begin
        begin = block[-1, 0]
    samples = np.concatenate(blocks)
    if begin <= 0.0:
        raise InputError(Fault(f"motion {name}", "takes no time: no two points differ, and there is no dwell"))
    # A block of one sample is a dwell of zero length between two moves: it adds no sample. Nor does a repeated sample.
    lone = [len(block) == 1 for block in blocks]
    keep = np.concatenate([np.full(len(block), not single) for block, single in zip(blocks, lone, strict=True)])
    samples = samples[keep]
    samples = samples[np.r_[True, np.any(samples[1:] != samples[:-1], axis=1)]]
    n = len(joint_names)
    time, position, velocity, acceleration = np.split(samples, [1, 1 + n, 1 + 2 * n], axis=1)
    notes = (f"{name}: {how}, {begin:.4g} s",)
    return Motion(name, joint_names, time[:, 0], position, velocity, acceleration, notes)
