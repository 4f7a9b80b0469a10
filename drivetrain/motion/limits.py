"""Does the motion stay inside the ranges of the arm's joints?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.motion.motion import Motion

ROUNDING = 1e-6  # [rad or m] a limit may be passed by what a file's rounding leaves


class LimitNotes(NamedTuple):
    """What was found: faults that forbid the motion, warnings to show in the report."""

    faults: tuple[Fault, ...]
    warnings: tuple[str, ...]


def limit_notes(
    motion: Motion | Cycle,
    lower: Array,
    upper: Array,
    speed_limits: Array,
    *,
    name: str = "motion",
    file: str = "",
    slides: Sequence[bool] | None = None,
) -> LimitNotes:
    """Where a motion leaves the joints' ranges (faults), and where it is quicker than they are said to be (warnings).

    A speed limit is only doubted: in a robot file it is that of the drives to be replaced.
    """
    faults: list[Fault] = []
    warnings: list[str] = []
    sides = (
        ("above the upper limit", motion.position - upper, upper),
        ("below the lower limit", lower - motion.position, lower),
    )
    for side, beyond, limit in sides:
        for joint in np.flatnonzero(beyond.max(axis=0) > ROUNDING):
            worst = int(beyond[:, joint].argmax())
            unit, factor = _unit(slides, int(joint))
            value, bound = factor * float(motion.position[worst, joint]), factor * float(limit[joint])
            problem = f"goes {side} {bound:.6g} at t = {motion.time[worst]:.4g} s [{unit}]"
            faults.append(Fault(f"{name}, joint {motion.joint_names[joint]}", problem, value, "", file))
    speed = np.abs(motion.velocity)
    for joint in np.flatnonzero(speed.max(axis=0) > np.asarray(speed_limits) * (1.0 + ROUNDING)):
        worst, (unit, factor) = int(speed[:, joint].argmax()), _unit(slides, int(joint))
        rate = unit.replace(" or ", "/s or ") + "/s"
        warnings.append(
            f"warning: {name}: joint {motion.joint_names[joint]} reaches {factor * speed[worst, joint]:.4g} at "
            f"t = {motion.time[worst]:.4g} s, above the arm's speed limit {factor * speed_limits[joint]:.4g} [{rate}]"
        )
    return LimitNotes(tuple(faults), tuple(warnings))


def _unit(slides: Sequence[bool] | None, joint: int) -> tuple[str, float]:
    """The unit in which a joint is told of, and what it counts of an SI unit."""
    if slides is None:
        return "rad or m", 1.0
    return ("m", 1.0) if slides[joint] else ("deg", math.degrees(1.0))
