"""The given motion of what carries an arm: a ship, a vehicle, a gantry, along the cycle of the arm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from drivetrain.arrays import Array
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.motion.motion import Motion
from drivetrain.units import Duration, Quantity

AXES = ("x", "y", "z", "yaw", "pitch", "roll")  # in the order of ``on_moving_base``
BASE_JOINTS = tuple(f"base_{axis}" for axis in AXES)
PIECES = 64  # into which a period of a swing is cut at least
ROUNDING = 1e-9  # of the length of a cycle: nearer instants are one


@dataclass(frozen=True)
class Swing:
    """A harmonic motion along or about one axis.

    Attributes:
        amplitude: [m or rad].
        period: [s].
        phase: As the cycle begins [rad].
    """

    amplitude: float
    period: Duration
    phase: Annotated[float, Quantity("rad")] = 0.0


def swinging(swings: Mapping[str, Swing], time: Array) -> Motion:
    """The base's motion where it swings along or about some of ``AXES``."""
    states = np.zeros((3, len(time), len(AXES)))
    for axis, swing in swings.items():
        rate = math.tau / swing.period
        angle = rate * time + swing.phase
        at = AXES.index(axis)
        states[0, :, at] = swing.amplitude * np.sin(angle)
        states[1, :, at] = swing.amplitude * rate * np.cos(angle)
        states[2, :, at] = -swing.amplitude * rate**2 * np.sin(angle)
    return Motion("base", BASE_JOINTS, time, *states)


def swing_instants(swings: Mapping[str, Swing], duration: float) -> Array:
    """Instants [s] that are dense enough for the quickest of some swings."""
    shortest = min(swing.period for swing in swings.values())
    return np.linspace(0.0, duration, math.ceil(PIECES * duration / shortest) + 1)


def base_states(base: Motion, time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of the base at instants [s], (N, 6) each; after its end it begins again."""
    end = base.time[-1]
    within = np.where(time > end, np.mod(time, end), time)
    found = [
        np.column_stack([np.interp(within, base.time, column) for column in rows.T])
        for rows in (base.position, base.velocity, base.acceleration)
    ]
    return found[0], found[1], found[2]


def along(cycle: Cycle, motion: Motion) -> tuple[Cycle, Motion]:
    """A cycle with samples at the instants of its base's motion too, and that motion at its samples.

    Of two samples of the base at one instant the first is taken a moment earlier, so that a step of its acceleration
    stays one.
    """
    time = motion.time - motion.time[0]
    steps = np.flatnonzero(np.diff(time) <= 0.0)
    time[steps] -= ROUNDING * time[-1]
    motion = replace(motion, time=time)
    whole = with_instants(cycle, time)
    position, velocity, acceleration = base_states(motion, whole.time)
    return whole, replace(motion, time=whole.time, position=position, velocity=velocity, acceleration=acceleration)


def with_instants(cycle: Cycle, instants: Array) -> Cycle:
    """A cycle of one part with samples at further instants, on the straight lines between its own."""
    time, near = cycle.time, 0.5 * ROUNDING * cycle.duration
    after = np.searchsorted(time, instants, side="right").clip(1, len(time) - 1)
    new = (np.abs(time[after] - instants) > near) & (np.abs(time[after - 1] - instants) > near)
    at, instants = after[new], instants[new]
    share = ((instants - time[at - 1]) / (time[at] - time[at - 1]))[:, np.newaxis]

    def between(values: Array) -> Array:
        return np.insert(values, at, values[at - 1] + share * (values[at] - values[at - 1]), axis=0)

    torque = None if cycle.torque is None else between(cycle.torque)
    return replace(
        cycle, time=np.insert(time, at, instants), position=between(cycle.position), velocity=between(cycle.velocity),
        acceleration=between(cycle.acceleration), torque=torque, parts=(),
        payload=np.insert(cycle.payload, at, cycle.payload[at]),
        segment=np.insert(cycle.segment, at, cycle.segment[at]),
    )  # fmt: skip
