"""Stiffness checks of the whole arm on the springs of its gears, against the limits of the study."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.coupling import joint_turns
from drivetrain.arm.kinematics import tip_jacobian
from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.spring import wind_up
from drivetrain.dynamics.closed import main_chain, whole_motion
from drivetrain.dynamics.flexibility import locked_frequencies, locked_mass
from drivetrain.sizing.judge.checks import ARM_CHECKS
from drivetrain.sizing.judge.judge import utilisation
from drivetrain.sizing.judge.missing import SPRINGS, lacking_joints
from drivetrain.sizing.judge.verdicts import judged
from drivetrain.study.model import Study
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.parts.verdicts import Check, Verdict

MOST_COMBINED = 12  # joints whose backlash is tried in every combination of signs; above, the sum is used as a bound


@dataclass(frozen=True)
class Extreme:
    """The worst value of a figure over the cycle and the index of its sample."""

    value: float
    sample: int


def arm_checks(study: Study, drives: Mapping[str, Drive], torque: Array) -> Iterator[Check]:
    """The checks of the arm's stiffness that the study requires."""
    for row in ARM_CHECKS:
        limit_name, stated = row.limit, getattr(study.stiffness, row.limit)
        if stated is None or study.arm is None:
            continue
        missing, source = lacking_joints(drives, SPRINGS[row.name]), f"wish of the study: stiffness.{limit_name}"
        if missing:
            remark = f"{SPRINGS[row.name]} is not in the catalogue row of the gear of {', '.join(missing)}"
            verdict = Verdict.NOT_CHECKED
            yield Check(row.name, None, stated, row.unit, None, verdict, None, source, remark, essential=True)
            continue
        extreme = FIGURES[limit_name](study, drives, torque)
        required, limit = (stated, extreme.value) if limit_name == "first_resonance" else (extreme.value, stated)
        used, remark = utilisation(required, limit), ""
        if limit_name != "lost_motion":
            remark = f"gears {100 * study.stiffness.scatter:g} % softer than printed"
        time = float(study.cycle.time[extreme.sample])
        verdict = judged(used, study.safety.reserve)
        yield Check(row.name, required, limit, row.unit, used, verdict, time, source, remark, True)


def unsprung(study: Study, drives: Mapping[str, Drive]) -> tuple[str, ...]:
    """Joints whose gear lacks a parameter that one of these checks needs."""
    needed = {SPRINGS[row.name] for row in ARM_CHECKS if getattr(study.stiffness, row.limit) is not None}
    return tuple(name for field in sorted(needed) for name in lacking_joints(drives, field))


def loaded_arms(study: Study, drives: Mapping[str, Drive]) -> list[tuple[Arm, Array]]:
    """The arm with its drives and each payload of the cycle, and the samples at which it carries that."""
    carried = study.cycle.payload
    return [(loaded_arm(study, drives, int(one)), carried == one) for one in np.unique(carried)]


def joint_travels(study: Study) -> Array:
    """Travel of each joint per radian of its gear's output [m or rad], (n,)."""
    return np.array([task.travel_per_turn or 1.0 for task in study.joints])


@lru_cache(maxsize=1)
def tip_levers(study: Study) -> Array:
    """Tip displacement per unit of each joint's motion, or of each shaft's where motors are coupled, (N, n, 3)."""
    arm = study.arm
    assert arm is not None
    refuse_loops(arm, shared=True, closed=True)
    q = study.cycle.position
    chain, position = main_chain(arm, q)
    shafts = joint_turns(arm)
    if arm.linkage is not None:
        shafts = (
            whole_motion(arm.linkage, q, 0.0 * q, 0.0 * q).turns[:, list(arm.linkage.loops.paths[0])]
            @ arm.linkage.loops.mean
        )
    return np.asarray(np.swapaxes(tip_jacobian(chain, position)[:, 3:] @ shafts, 1, 2))


def joint_twists(study: Study, drives: Mapping[str, Drive], torque: Array) -> Array:
    """Wind-up of each joint's gear spring [rad or m], (N, n); 0 if no stiffness is given."""
    twists = [wind_up(one.gear, series) for one, series in zip(drives.values(), torque.T, strict=True)]
    still = np.zeros(len(study.cycle.time))
    return joint_travels(study) * np.column_stack([still if one is None else one for one in twists])


def joint_plays(study: Study, drives: Mapping[str, Drive], torque: Array) -> Array:
    """Backlash of each joint [rad or m], (N, n); 0 if none is given or a preload closes it."""
    plays = joint_travels(study) * np.array([one.gear.backlash or 0.0 for one in drives.values()])
    found, names = np.tile(plays, (len(torque), 1)), list(drives)
    for one, other in {task.sharing for task in study.joints if task.sharing}:
        pair = [names.index(one), names.index(other)]
        found[np.ix_(torque[:, pair].prod(axis=1) < 0.0, pair)] = 0.0
    return found


def lost_motion(plays: Array) -> Array:
    """The largest distance between two positions of the tip that the backlash of the joints allows."""
    loose = plays[:, np.abs(plays).any(axis=(0, 2))]
    count = loose.shape[1]
    if count > MOST_COMBINED:
        return np.asarray(np.linalg.norm(loose, axis=2).sum(axis=1))
    largest = np.zeros(len(plays))
    for signs in itertools.product((1.0, -1.0), repeat=max(count - 1, 0)):
        # The first sign is fixed: reversing all signs gives the same distance.
        together = np.einsum("j,njc->nc", np.array([1.0, *signs][:count]), loose)
        largest = np.maximum(largest, np.linalg.norm(together, axis=1))
    return largest


def carried_stages(study: Study, drives: Mapping[str, Drive]) -> Array:
    """Inertia of the stages that each gear's spring carries, at the joint [kg m^2 or kg], (n,)."""
    return np.array([one.gear.stage_sprung for one in drives.values()]) / joint_travels(study) ** 2


def _resonance(study: Study, drives: Mapping[str, Drive], torque: Array) -> Extreme:
    """The lowest natural frequency over the cycle [Hz]; infinite if no joint has a spring."""
    first = [one.gear.stiffness_1 for one in drives.values()]
    springs = soft_springs(study, np.array([math.inf if one is None else one for one in first]))
    lowest = np.full(len(study.cycle.time), np.inf)
    staged = carried_stages(study, drives)
    for arm, chosen in loaded_arms(study, drives):
        found = locked_frequencies(arm, study.cycle.position[chosen], springs, added=staged)
        lowest[chosen] = found.min(axis=1, initial=np.inf)
    return Extreme(float(lowest.min()), int(np.argmin(lowest)))


def soft_springs(study: Study, stiffness: Array) -> Array:
    """Joint stiffnesses less the manufacturing scatter, where data sheets give them [N m/rad or N/m], (n,)."""
    return (1.0 - study.stiffness.scatter) * stiffness / joint_travels(study) ** 2


def shaft_inertia(study: Study, drives: Mapping[str, Drive], sample: int) -> Array:
    """The inertia that the springs of all joints carry at a sample, rotors held by their motors, (n, n)."""
    arm = loaded_arm(study, drives, int(study.cycle.payload[sample]))
    shafts = joint_turns(arm)
    return np.asarray(shafts.T @ locked_mass(arm, study.cycle.position[sample]) @ shafts)


def tip_deviation(study: Study, drives: Mapping[str, Drive], torque: Array) -> Array:
    """Displacement of the tip by wind-up [m], (N, 3)."""
    twist = joint_twists(study, drives, torque) / (1.0 - study.stiffness.scatter)
    return np.asarray(np.einsum("nj,njc->nc", twist, tip_levers(study)))


def _deviation(study: Study, drives: Mapping[str, Drive], torque: Array) -> Extreme:
    """The largest displacement of the tip by wind-up [m]."""
    size = np.linalg.norm(tip_deviation(study, drives, torque), axis=1)
    return Extreme(float(size.max()), int(np.argmax(size)))


def _play(study: Study, drives: Mapping[str, Drive], torque: Array) -> Extreme:
    """The largest displacement of the tip by backlash [m]."""
    size = lost_motion(joint_plays(study, drives, torque)[:, :, None] * tip_levers(study))
    return Extreme(float(size.max()), int(np.argmax(size)))


FIGURES = {"first_resonance": _resonance, "tip_deviation": _deviation, "lost_motion": _play}
