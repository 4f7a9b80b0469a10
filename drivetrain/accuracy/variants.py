"""A scene with some of its effects left out, and what its controllers feed forward found anew."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arm.with_rotors import at_level
from drivetrain.effects.effect import Effect, Place
from drivetrain.effects.given_current import GivenCurrent
from drivetrain.effects.rotor import ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.simulation.cost_results import Choice
from drivetrain.simulation.inverse import demanded
from drivetrain.simulation.mechanics import coupling_of, ratios_of
from drivetrain.simulation.plan import plan
from drivetrain.simulation.scene import WHOLE, Scene
from drivetrain.simulation.study_scene import with_feed_forward

LABELS = {
    "ViscousFriction": "viscous friction",
    "DryFriction": "dry friction",
    "LuGreFriction": "bristle friction",
    "MeshLoss": "mesh loss",
    "Cogging": "cogging",
    "Backlash": "backlash",
    "FlexibleJoint": "joint spring",
    "CurrentLoop": "inductance and current loop",
    "WindingHeat": "heat: R(T) and kt(T)",
    "FullRotor": "rotor as a body",
    "SampledCascade": "samples of position and speed loop",
    "SampledCurrentLoop": "samples of the current loop",
    "Encoder": "steps of the encoder",
}
"""Effects that may be left out; commands, loops, motors, supplies and contacts may not."""
PARTNERS = {"SampledCurrentLoop": "Winding"}  # whose stand-in holds what the partner does
SPRINGS = ("FlexibleJoint", "Backlash")


def choices(scene: Scene) -> tuple[Choice, ...]:
    """The effects of a scene that may be left out."""
    found = [
        Choice(type(effect).__name__, joint)
        for joint, effects in scene.effects.items()
        for effect in effects
        if type(effect).__name__ in LABELS and effect.quasi_static() != effect
    ]
    body = scene.body
    if isinstance(body, Arm) and body.level is RotorLevel.FULL and any(rotor is not None for rotor in body.rotors):
        found.append(Choice("FullRotor", WHOLE))
    return tuple(dict.fromkeys(found))


def without(scene: Scene, dropped: Collection[Choice]) -> Scene:
    """A scene without some of its effects, ready to run."""
    gone = set(dropped)
    body = scene.body
    if isinstance(body, Arm) and Choice("FullRotor", WHOLE) in gone:
        body = at_level(body, RotorLevel.REFLECTED)
    effects = {joint: left(joint, own, gone) for joint, own in scene.effects.items()}
    ratios = dict(zip(scene.joints, ratios_of(scene), strict=True))
    less = replace(scene, body=body, effects=effects)
    for joint, now in zip(scene.joints, _ratios(less), strict=True):
        if now != ratios[joint]:  # the effect that told the ratio is gone, the gear is not
            effects[joint] = (*effects[joint], ReflectedRotor(0.0, ratios[joint]))
    return fed_forward(replace(less, effects=effects))


def fed_forward(scene: Scene) -> Scene:
    """A scene with the currents that its command takes commanded along, where that can be known."""
    if any(isinstance(effect, GivenCurrent) for effects in scene.effects.values() for effect in effects):
        return scene
    try:
        return with_feed_forward(_settled(scene))
    except InputError:
        return scene


def _settled(scene: Scene) -> Scene:
    """With motors, not links, where the command begins: a spring that carries load is twisted from the start."""
    ready = plan(scene)
    if not ready.body.springs:
        return scene
    demand = demanded(ready, np.zeros(1))
    position = demand.position[0].copy()
    for joint, shape in ready.body.springs.items():
        if shape.deflection is not None:
            position[joint] -= shape.deflection(float(demand.mesh_torque[0, joint]))
    return replace(scene, position=position, speed=demand.speed[0])


def left(joint: str, effects: tuple[Effect, ...], gone: Collection[Choice]) -> tuple[Effect, ...]:
    """What is left of a joint's effects."""
    kept: list[Effect] = []
    for effect in effects:
        stays: Effect | None = effect
        kind = ""
        while stays is not None and type(stays).__name__ != kind and Choice(type(stays).__name__, joint) in gone:
            kind, stays = type(stays).__name__, stays.quasi_static()
        if any(Choice(owner, joint) in gone for owner, one in PARTNERS.items() if one == type(effect).__name__):
            stays = None
        if stays is not None:
            kept.append(stays)
    return tuple(kept)


def _ratios(scene: Scene) -> tuple[float, ...]:
    return tuple(ratios_of(scene))


def place_of(scene: Scene, joint: str) -> Place:
    """Where effects of a joint stand."""
    return Place(
        scene.joints.index(joint), joint, scene.joints, tuple(ratios_of(scene)), scene.turning, 0, coupling_of(scene)
    )
