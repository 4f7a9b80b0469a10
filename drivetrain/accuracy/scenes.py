"""The scene of a study with all effects for which there is data, and scenes with some of them left out."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level
from drivetrain.arm.rotors import RotorLevel
from drivetrain.drive.amplifier import Supply
from drivetrain.drive.drive import Drive
from drivetrain.drive.thermal.thermal_network import ThermalNetwork, thermal_network
from drivetrain.effects.control.cascade import PositionLoop, SampledCascade
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.effect import Effect
from drivetrain.effects.gear.springs import GearSpring
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop, SampledCurrentLoop
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply, SupplyBus
from drivetrain.effects.motor.winding import Winding
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.cost_results import Choice
from drivetrain.simulation.engines.inverse import demanded
from drivetrain.simulation.planning.mechanics import ratios_of
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import WHOLE, Scene
from drivetrain.simulation.study_scene import SceneOptions, scene_of, with_feed_forward
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.mounting import TWO_AS_ONE
from drivetrain.study.parts.simulation import KNOWN_EFFECTS, TWO_INTEGRATORS, AddedEffect, Control, Simulation

LABELS = {
    "ViscousFriction": "viscous friction",
    "DryFriction": "dry friction",
    "LuGreFriction": "bristle friction",
    "MeshLoss": "mesh loss",
    "GearDrag": "drag of the gear",
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
"""Effects that may be left out, with their names; commands, loops, motors, supplies and contacts may not."""
# Effects whose quasi-static substitute includes a partner effect, which is then left out as well.
PARTNERS = {"SampledCurrentLoop": "Winding"}
# Time constant of a thermal node of unknown capacity, in cycles: it stays at its mean, as in ``thermal/heat.py``.
SLOW_CYCLES = 1e4


def choices(scene: Scene) -> tuple[Choice, ...]:
    """The effects of a scene that may be left out, each at its joint."""
    body = scene.body
    loops = () if not isinstance(body, Arm) or body.linkage is None else body.linkage.loops.shared
    two_motor_joints = {scene.joints[i] for pair in loops for i in pair}  # axes with two motors: their springs stay
    found = [
        Choice(type(effect).__name__, joint)
        for joint, effects in scene.effects.items()
        for effect in effects
        if type(effect).__name__ in LABELS and effect.quasi_static() != effect
        and not (joint in two_motor_joints and isinstance(effect, GearSpring))
    ]  # fmt: skip
    if isinstance(body, Arm) and body.level is RotorLevel.FULL and any(rotor is not None for rotor in body.rotors):
        found.append(Choice("FullRotor", WHOLE))
    return tuple(dict.fromkeys(found))


def without(scene: Scene, dropped: Collection[Choice]) -> Scene:
    """A scene without some of its effects, with feed-forward currents, ready to run."""
    gone = set(dropped)
    body = scene.body
    if isinstance(body, Arm) and Choice("FullRotor", WHOLE) in gone:
        body = at_level(body, RotorLevel.REFLECTED)
    effects = {joint: remaining(joint, own, gone) for joint, own in scene.effects.items()}
    ratios = dict(zip(scene.joints, ratios_of(scene), strict=True))
    reduced = replace(scene, body=body, effects=effects)
    for joint, now in zip(scene.joints, ratios_of(reduced), strict=True):
        if now != ratios[joint]:  # the effect that defined the ratio was left out, but the gear is still there
            effects[joint] = (*effects[joint], ReflectedRotor(0.0, ratios[joint]))
    return fed_forward(replace(reduced, effects=effects))


def fed_forward(scene: Scene) -> Scene:
    """A scene with the currents that its command requires fed forward, where the inverse engine can compute them."""
    if any(isinstance(effect, GivenCurrent) for effects in scene.effects.values() for effect in effects):
        return scene
    try:
        return with_feed_forward(_at_equilibrium(scene))
    except InputError:
        return scene


def _at_equilibrium(scene: Scene) -> Scene:
    """The scene with initial positions for which the motors, not the links, are at the start of their command.

    The links are displaced by the wind-up of the springs under the initial load.
    """
    ready = plan(scene)
    if not ready.body.springs:
        return scene
    demand = demanded(ready, np.zeros(1))
    position = demand.position[0].copy()
    for joint, shape in ready.body.springs.items():
        if shape.deflection is not None and ready.body.loads[joint] == joint:
            wind_up = shape.deflection(float(demand.mesh_torque[0, joint]))
            position[joint] -= wind_up - ready.body.zeros[joint]
    return replace(scene, position=position, speed=demand.speed[0])


def remaining(joint: str, effects: tuple[Effect, ...], gone: Collection[Choice]) -> tuple[Effect, ...]:
    """The effects of a joint without those left out, each replaced by its quasi-static substitute if it has one."""
    kept: list[Effect] = []
    for effect in effects:
        left: Effect | None = effect
        kind = ""
        while left is not None and type(left).__name__ != kind and Choice(type(left).__name__, joint) in gone:
            kind, left = type(left).__name__, left.quasi_static()
        if any(Choice(owner, joint) in gone for owner, one in PARTNERS.items() if one == type(effect).__name__):
            left = None
        if left is not None:
            kept.append(left)
    return tuple(kept)


def full_scene(evaluation: Evaluation, options: Simulation | None = None) -> Scene:
    """The scene of evaluated drives with every effect for which the data sheets have values, without feed-forward."""
    study = evaluation.study
    settings = study.simulation if options is None else options
    built = scene_of(
        study, evaluation.mounted,
        options=SceneOptions(
            bandwidth=settings.bandwidth, feed_forward=False, heat=False, springs=True, damping=settings.damping,
            repetitions=settings.repetitions,
        ),
    )  # fmt: skip
    effects, ratios = dict(built.effects), dict(zip(built.joints, ratios_of(built), strict=True))
    for task in study.joints:
        joint = evaluation.joints[task.name]
        stated = task.axis_name  # what the study says of both motors of an axis
        control, teeth = settings.control.get(stated), settings.cogging.get(stated)
        if task.sharing and control is not None and control.integral_time is not None:
            place = f"simulation.control.{stated}.integral_time"
            raise InputError(Fault(place, TWO_INTEGRATORS, control.integral_time))
        own = [one for effect in effects[task.name] for one in _current_loop(effect, joint.drive, settings, control)]
        own = [one for effect in own for one in _sampled_cascade(effect, ratios[task.name], control)]
        motors = 2.0 if TWO_AS_ONE in joint.drive.assumptions else 1.0
        own += [Cogging((motors * teeth.amplitude,), (teeth.periods,))] if teeth is not None else []
        effects[task.name] = (*own, *_heat(study, task, joint))
    shares = {task.amplifier.modulation for task in study.joints}
    adds_bus = any(isinstance(one, SupplyBus) for one in effects[WHOLE])
    if not adds_bus and len(shares) == 1:
        effects[WHOLE] = (*effects[WHOLE], _supply(study.supply, shares.pop()))
    elif not adds_bus:
        gone = [Choice(kind, task.name) for task in study.joints for kind in ("SampledCurrentLoop", "CurrentLoop")]
        effects |= {name: remaining(name, effects[name], gone) for name in built.joints}
    return replace(built, effects=effects)


def _supply(supply: Supply, modulation: float) -> Effect:
    """The supply of all amplifiers: a bus if its capacitance is known."""
    if supply.capacity is None:
        return StiffSupply(supply.voltage, modulation)
    power, threshold, resistance = (one or math.inf for one in (supply.peak_power, supply.threshold, supply.resistance))
    return SupplyBus(supply.voltage, supply.capacity, power, threshold, resistance, modulation)


def wanted_scene(full: Scene, names: Iterable[str], added: Iterable[AddedEffect] = ()) -> Scene:
    """A full scene with only the effects that are named (keys of ``KNOWN_EFFECTS``) or added by the study."""
    kept = {KNOWN_EFFECTS[name] for name in names}
    own = {Choice(one.kind.__name__, one.joint or WHOLE) for one in added}
    gone = [one for one in choices(full) if one.kind not in kept and one not in own]
    if "CurrentLoop" not in kept:  # also where it replaces a sampled loop that was left out
        gone += [Choice("CurrentLoop", joint) for joint in full.joints]
    return without(full, gone)


def _current_loop(effect: Effect, drive: Drive, options: Simulation, control: Control | None) -> tuple[Effect, ...]:
    """Replace a motor without inductance by a current loop, if the data sheet gives the inductance.

    The loop is sampled where the study states the rate of the amplifier.
    """
    if not isinstance(effect, MotorCurrent) or not drive.motor.inductance:
        return (effect,)
    if control is None or control.amplifier_rate is None:
        return (CurrentLoop(drive.motor, options.current_bandwidth, effect.peak_current),)
    every = 1.0 / control.amplifier_rate
    loop = SampledCurrentLoop(drive.motor, options.current_bandwidth, every, effect.peak_current)
    return Winding(drive.motor), loop


def _sampled_cascade(effect: Effect, ratio: float, control: Control | None) -> tuple[Effect, ...]:
    """Replace the position loop by a sampled cascade and an encoder, where the study states one.

    Gains that the study does not state are those of the position loop: stiffness K and damping D at the joint
    correspond to a position gain K / D and a speed gain D / (ratio^2 kt) at the motor.
    """
    if control is None or not isinstance(effect, PositionLoop):
        return (effect,)
    position, speed = effect.stiffness / effect.damping, effect.damping / (ratio**2 * effect.torque_constant)
    cascade = SampledCascade(
        position if control.position_gain is None else control.position_gain,
        speed if control.speed_gain is None else control.speed_gain,
        math.inf if control.integral_time is None else control.integral_time,
        every=1.0 / control.rate, delay=control.delay,
    )  # fmt: skip
    return Encoder(None if control.encoder_bits is None else 2**control.encoder_bits), cascade


def _heat(study: Study, task: JointTask, joint: JointResult) -> tuple[Effect, ...]:
    """The heating of a joint's motor, starting in the periodic steady state of the evaluation; empty if unknown."""
    winding, housing = joint.series.winding_temperature, joint.series.housing_temperature
    network = thermal_network(joint.drive.motor, study.ambient, housing_to_ambient=task.housing_to_ambient)
    if network is None or winding is None or housing is None or not np.isfinite(winding).all():
        return ()
    slow, start = _with_slow_nodes(network, study.cycle.duration), (float(winding[0]), float(housing[0]))
    current = math.sqrt(np.average(np.square(joint.series.current), weights=study.cycle.weights))
    other = task.constant_loss(joint.drive.motor, joint.amplifier, current)
    return (WindingHeat(slow, *start, gear_heat=task.gear_heat, constant_loss=other),)


def _with_slow_nodes(network: ThermalNetwork, period: float) -> ThermalNetwork:
    """The network with capacities for nodes that have none, so large that they stay constant within a cycle."""
    longest = SLOW_CYCLES * period
    inner = network.resistance_winding_housing or network.resistance_housing_ambient
    return replace(
        network,
        winding_capacity=network.winding_capacity or longest / inner,
        housing_capacity=network.housing_capacity or longest / network.resistance_housing_ambient,
    )
