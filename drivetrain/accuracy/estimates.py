"""Every effect's estimate at every joint that it reaches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.accuracy.conditions import Task
from drivetrain.accuracy.variants import SPRINGS, choices, place_of
from drivetrain.arm.arm import Arm
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arm.with_rotors import at_level
from drivetrain.effects.backlash import Backlash
from drivetrain.effects.bounds import OVERSHOOT, bounded, rms_of
from drivetrain.effects.effect import Effect
from drivetrain.effects.estimate import Estimate
from drivetrain.effects.flexible_joint import FlexibleJoint
from drivetrain.simulation.cost_results import Change, Choice
from drivetrain.simulation.inverse import demanded
from drivetrain.simulation.plan import plan
from drivetrain.simulation.scene import WHOLE, Scene

COSTS = {
    "FlexibleJoint": 6.0, "Backlash": 6.0, "MeshLoss": 3.0, "LuGreFriction": 3.0, "CurrentLoop": 2.0,
    "SampledCurrentLoop": 8.0, "SampledCascade": 2.0, "Encoder": 0.5,
    "DryFriction": 2.0, "ViscousFriction": 1.0, "Cogging": 1.0, "WindingHeat": 0.5, "FullRotor": 0.5,
}  # fmt: skip
"""What keeping an effect is thought to cost, relative to others: states and coordinates more, bounds to be solved."""


@dataclass(frozen=True)
class Told:
    """What leaving one effect out is thought to change.

    Attributes:
        choice: The effect.
        changes: Bounds by joint; the tip's stands at the effect's own joint.
        valid: Whether the derivation holds here.
        why: The derivation, or what it lacks.
    """

    choice: Choice
    changes: Mapping[str, Change]
    valid: bool
    why: str


def estimates(scene: Scene, task: Task) -> tuple[Told, ...]:
    """The estimate of every effect that may be left out."""
    found = []
    for choice in choices(scene):
        if choice.kind == "FullRotor":
            found.append(_rotors(scene, task, choice))
            continue
        effects = [one for one in scene.effects[choice.joint] if type(one).__name__ == choice.kind]
        found.append(_own(scene, task, choice, effects))
    return tuple(found)


def _own(scene: Scene, task: Task, choice: Choice, effects: list[Effect]) -> Told:
    """Of the effects of one kind at one joint, added up."""
    conditions = task.conditions.get(choice.joint)
    if conditions is None:
        why = task.why or "no motor is known there"
        return Told(choice, {}, False, f"the command cannot be inverted: {why}")
    place = place_of(scene, choice.joint)
    told = [effect.estimate(place, conditions) for effect in effects]
    lever = float(task.levers[place.joint])
    own = _sum([_changed(one, lever) for one in told])
    changes = {choice.joint: own}
    if choice.kind in SPRINGS:
        swing = sum(one.swing(conditions) for one in effects if isinstance(one, FlexibleJoint | Backlash))
        twist = sum(one.deviation for one in told)
        changes |= _elsewhere(scene, task, place.joint, np.asarray(swing), float(twist))
    valid = all(one.valid for one in told) and not any(math.isnan(share) for share in own.shares[:3])
    return Told(choice, changes, valid, "; ".join(dict.fromkeys(one.why for one in told)))


def _elsewhere(scene: Scene, task: Task, joint: int, swing: np.ndarray, twist: float) -> dict[str, Change]:
    """What the swing and the twist of one joint do to the others, through the mass matrix."""
    found = {}
    for i, name in enumerate(scene.joints):
        conditions = task.conditions.get(name)
        if i == joint or conditions is None or conditions.series is None:
            continue
        torque = task.couplings[i, joint] * swing + twist * conditions.peak_torque
        error = torque * conditions.mesh_share / (abs(task.plan.body.ratios[i]) * conditions.torque_constant)
        found[name] = _changed(bounded(conditions, error, ""), 0.0)
    return found


def _rotors(scene: Scene, task: Task, choice: Choice) -> Told:
    """The inverse run with rotors as bodies, less that with rotors reflected: exact while the command is followed."""
    demand = task.demand
    if demand is None or not isinstance(scene.body, Arm):
        return Told(choice, {}, False, "without an arm, or a command that can be inverted, it is kept")
    if choice.joint != WHOLE:
        return Told(choice, {}, False, "a rotor of its own at one joint: keep it")
    other = Scene(
        at_level(scene.body, RotorLevel.REFLECTED), scene.effects, scene.duration, scene.position, scene.speed
    )
    less = demanded(plan(other), demand.time)
    slack = SWUNG if task.plan.body.springs else BESIDE
    changes, away = {}, 0.0
    for i, name in enumerate(scene.joints):
        conditions = task.conditions.get(name)
        if conditions is None:
            return Told(choice, {}, False, "a joint has no motor: keep it")
        error = np.abs(less.current[:, i] - demand.current[:, i])
        torque = float(error.max()) * conditions.torque_constant * abs(task.plan.body.ratios[i])
        turned = float(torque / conditions.loop_stiffness)
        away += turned * float(task.levers[i])
        told = _changed(bounded(conditions, slack * error, "", deviation=turned), 0.0)
        carried = np.abs(less.mesh_torque[:, i] - demand.mesh_torque[:, i])
        share = slack * rms_of(carried, demand.time) / conditions.rms_torque if conditions.rms_torque else 0.0
        changes[name] = replace(told, rms_torque=max(told.rms_torque, share))
    first = scene.joints[0]
    changes[first] = Change(*changes[first].shares, float(away))
    return Told(choice, changes, True, "the inverse run both ways")


BESIDE = 1.25  # the simulated motion lies beside the commanded one, on which the inverse run stands
SWUNG = 2.0 * OVERSHOOT * BESIDE  # a step of torque swings a spring to twice its size, and the loop answers that


def _changed(estimate: Estimate, lever: float) -> Change:
    """An estimate as a change, its turned joint as a way of the tip."""
    return Change(estimate.current, estimate.torque, estimate.torque, estimate.temperature, estimate.deviation * lever)


def _sum(parts: list[Change]) -> Change:
    """Bounds add."""
    return Change(
        sum(part.peak_current for part in parts),
        sum(part.rms_current for part in parts),
        sum(part.rms_torque for part in parts),
        sum(part.temperature for part in parts),
        sum(part.tip for part in parts),
    )


def added(parts: list[Mapping[str, Change]], joints: tuple[str, ...]) -> dict[str, Change]:
    """Bounds of several effects together, the tip's those of all joints."""
    tip = sum(change.tip for part in parts for change in part.values())
    sums = {name: _sum([part[name] for part in parts if name in part]) for name in joints}
    return {name: Change(*own.shares, tip) for name, own in sums.items()}
