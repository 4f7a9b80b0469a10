"""Loads of stops on a ramp: from states along the cycle, the joint speeds fall linearly to 0.

As in the cycle, the loads are linear in the load parameters of the drives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arrays import Array, Indices
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.demand.load_basis import JointBasis, load_basis
from drivetrain.study.model import Study

STARTS = 400  # evenly spaced samples at which a stop begins, besides the fastest of each joint
STAGES = 2  # intervals of the longest ramp; torques are computed at their ends


@dataclass(frozen=True, eq=False)
class StopBasis:
    """States and loads of all stops; M states, n joints."""

    first: Any  # sample of the cycle from which each stop starts, (M,), integers
    after: Array  # time since the start of each stop [s], (M,)
    # Speeds and accelerations [rad/s or m/s], [rad/s^2 or m/s^2], (M, n).
    velocity: Array
    acceleration: Array
    joints: tuple[JointBasis, ...]  # loads by joint, without wrenches and inertias


def stop_starts(cycle: Cycle, among: Indices) -> Indices:
    """Samples at which stops begin: STARTS of some samples, evenly spaced, and those at which a joint is fastest."""
    allowed, chosen = np.zeros((2, len(cycle.time)), dtype=np.bool_)
    allowed[among] = True
    chosen[among[:: max(1, -(-len(among) // STARTS))]] = True
    chosen[np.abs(cycle.velocity).argmax(axis=0)] = True
    return np.flatnonzero(allowed & chosen)


@lru_cache(maxsize=2)
def stop_basis(study: Study) -> StopBasis | None:
    """Loads of the stops of a study; None if no joint has a ramp, nothing moves, or there is no arm."""
    ramps = np.array([np.nan if task.stop.ramp is None else task.stop.ramp for task in study.joints])
    cycle = study.cycle
    moving = stop_starts(cycle, np.flatnonzero(cycle.velocity.any(axis=1)))
    if study.arm is None or np.isnan(ramps).all() or not len(moving):
        return None
    longest = np.nanmax(ramps)
    times = np.unique([*np.linspace(0.0, longest, STAGES + 1), *ramps[~np.isnan(ramps)]])
    first, after = np.repeat(moving, len(times)), np.tile(times, len(moving))
    speed, left = cycle.velocity[first], np.minimum(after[:, np.newaxis], ramps)
    left = np.where(np.isnan(left), after[:, np.newaxis], left)  # a joint without a ramp keeps its speed
    slowing = np.where(np.isnan(ramps) | (after[:, np.newaxis] > ramps), 0.0, -1.0 / ramps)
    share = np.where(np.isnan(ramps), 0.0, 1.0 / ramps)
    position = cycle.position[first] + speed * left * (1.0 - 0.5 * left * share)
    velocity, acceleration = speed * (1.0 - left * share), speed * slowing
    states = replace(
        cycle.at(first), time=cycle.time[first] + after, position=position, velocity=velocity, acceleration=acceleration
    )
    try:
        loads = load_basis(study, states, torques_only=True)
    except InputError as error:
        if study.arm.linkage is None:
            raise
        problem = f"leads the linkage where it cannot go: {error.faults[0].problem}"
        hint = "state a shorter ramp, or a motion that is slower near the end of the linkage's reach"
        raise InputError(Fault("stop.ramp", problem, f"{longest:g} s", hint)) from None
    return StopBasis(first, after, velocity, acceleration, loads)
