"""Prescribed motion of the base of an arm (on a ship, vehicle or gantry) over the arm's duty cycle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from drivetrain.arrays import Array
from drivetrain.motion.duty_cycle import Cycle, samples_between
from drivetrain.motion.motion import Motion
from drivetrain.units import Duration, Quantity

AXES = ("x", "y", "z", "yaw", "pitch", "roll")  # the order in which ``on_moving_base`` expects them
BASE_JOINTS = tuple(f"base_{axis}" for axis in AXES)
PIECES = 64  # smallest number of samples per period of a harmonic motion
ROUNDING = 1e-9  # instants closer than this share of the cycle's length count as one


@dataclass(frozen=True)
class Swing:
    """A harmonic motion along or about one axis.

    Attributes:
        amplitude: [m or rad].
        period: [s].
        phase: Phase at the start of the cycle [rad].
    """

    amplitude: float
    period: Duration
    phase: Annotated[float, Quantity("rad")] = 0.0


def harmonic_motion(swings: Mapping[str, Swing], time: Array) -> Motion:
    """Motion of the base that is harmonic along or about the given ``AXES`` and zero in the others."""
    states = np.zeros((3, len(time), len(AXES)))
    for axis, swing in swings.items():
        rate = math.tau / swing.period
        angle = rate * time + swing.phase
        at = AXES.index(axis)
        states[0, :, at] = swing.amplitude * np.sin(angle)
        states[1, :, at] = swing.amplitude * rate * np.cos(angle)
        states[2, :, at] = -swing.amplitude * rate**2 * np.sin(angle)
    return Motion("base", BASE_JOINTS, time, *states)


def harmonic_instants(swings: Mapping[str, Swing], duration: float) -> Array:
    """Equally spaced instants [s] from 0 to ``duration``, at least ``PIECES`` per period of the fastest swing."""
    shortest = min(swing.period for swing in swings.values())
    return np.linspace(0.0, duration, math.ceil(PIECES * duration / shortest) + 1)


def base_states(base: Motion, time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of the base at the instants ``time`` [s], (N, 6) each; the motion repeats."""
    end = base.time[-1]
    within = np.where(time > end, np.mod(time, end), time)
    found = [
        np.column_stack([np.interp(within, base.time, column) for column in rows.T])
        for rows in (base.position, base.velocity, base.acceleration)
    ]
    return found[0], found[1], found[2]


def with_base_samples(cycle: Cycle, motion: Motion) -> tuple[Cycle, Motion]:
    """The cycle with samples added at the instants of its base's motion, and that motion at all samples of the result.

    If the base's motion has two samples at one instant (a step of its acceleration), the first of them is moved earlier
    by ``ROUNDING``, so that interpolation keeps the step.
    """
    time = motion.time - motion.time[0]
    steps = np.flatnonzero(np.diff(time) <= 0.0)
    time[steps] -= ROUNDING * time[-1]
    motion = replace(motion, time=time)
    whole = with_instants(cycle, time)
    position, velocity, acceleration = base_states(motion, whole.time)
    return whole, replace(motion, time=whole.time, position=position, velocity=velocity, acceleration=acceleration)


def with_instants(cycle: Cycle, instants: Array) -> Cycle:
    """The cycle (not a mix) with samples at further instants, interpolated linearly between its own samples."""
    at, instants, between = samples_between(cycle.time, instants, 0.5 * ROUNDING * cycle.duration)
    torque, wrench = (None if values is None else between(values) for values in (cycle.torque, cycle.tip_wrench))
    return replace(
        cycle, time=np.insert(cycle.time, at, instants), parts=(), position=between(cycle.position),
        velocity=between(cycle.velocity), acceleration=between(cycle.acceleration), torque=torque,
        payload=np.insert(cycle.payload, at, cycle.payload[at]),
        segment=np.insert(cycle.segment, at, cycle.segment[at]), tip_wrench=wrench,
    )  # fmt: skip
