"""What a command takes, by the laws of a scene's own effects: joints rigid, each instant by itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import loss_speed, resting
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, terminal_voltage, torque_constant
from drivetrain.effects import signals as named
from drivetrain.effects.effect import Effect
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.core import equations
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.plan import plan as planned
from drivetrain.simulation.planning.wiring import Instance

MECHANICAL = {signal.name for signal in (*named.TAKEN, *named.SHAFT_TAKEN)}
ASKED = (named.COMMAND_POSITION.name, named.COMMAND_SPEED.name, named.COMMAND_ACCELERATION.name)
PAYLOAD = named.PAYLOAD_ENERGY.name.rpartition(".")[2]
COMMANDS = {*ASKED, *(signal.name for signal in named.SHAFT_COMMANDS)}


@dataclass(frozen=True, eq=False)
class Demand:
    """What a command takes; arrays (N, n). Where motors are coupled torques and friction are those of the shafts.

    Attributes:
        time: [s], (N,).
        position, speed, acceleration: As commanded [rad or m, and per s, s^2].
        shaft_speed, shaft_acceleration: Of the shaft behind the gear, the joint's own where no motors are coupled.
        mesh_torque: Through the mesh, at the output [N m or N].
        joint_friction: Dry friction at the joint [N m or N].
        motor_torque: Electromagnetic [N m].
        current, voltage: At the motor's terminals [A], [V]; NaN where no motor is known.
    """

    time: Array
    position: Array
    speed: Array
    acceleration: Array
    shaft_speed: Array
    shaft_acceleration: Array
    mesh_torque: Array
    joint_friction: Array
    motor_torque: Array
    current: Array
    voltage: Array


def demanded(plan: Plan, times: Array) -> Demand:
    """What a scene's command takes, by the laws of its own effects."""
    _refuse(plan)
    passive = planned(replace(plan.scene, effects=_passive(plan)))
    told = _asked(passive, times)
    slides = _ways(passive, told)
    names, body, n = passive.scene.joints, passive.body, passive.body.n
    driven, acceleration = told["command_speed"], told["command_acceleration"]
    turned = np.einsum("kij,kj->ki", told["turned"], acceleration) + told["turned_bias"]
    whole = np.einsum("kij,kj->ki", told["mass"], acceleration) + told["bias_torque"]
    joint = np.where(slides > 0.0, told["joint_slide_forward"], -told["joint_slide_backward"]) * np.abs(slides)
    mesh = whole - turned - body.torques_of(told["joint_torque"]) - told["shaft_torque"] + joint
    way = slides * np.sign(body.ratios)
    shaft = np.where(way > 0.0, told["motor_slide_forward"], -told["motor_slide_backward"]) * np.abs(way)
    factor = np.where(mesh * slides > 0.0, 1.0 + told["mesh_driving"], 1.0 - told["mesh_driven"])
    holds = np.array([_holding_of(plan.scene.effects.get(name, ())) for name in names])
    room = np.where(holds > 0.0, told["mesh_driving"], np.minimum(told["mesh_driven"], 1.0))
    factor = np.where(slides == 0.0, 1.0 + holds * room, factor)
    motor = (factor * mesh + turned) / body.ratios + shaft - told["motor_torque"]
    current, voltage = np.full_like(motor, np.nan), np.full_like(motor, np.nan)
    for i in range(n):
        sheet = motor_of(plan.scene.effects.get(names[i], ()))
        if sheet is not None:
            rest, speed = sheet.reference_temperature, driven[:, i] * body.ratios[i]
            current[:, i] = motor[:, i] / torque_constant(sheet, rest)
            voltage[:, i] = terminal_voltage(sheet, speed, current[:, i], 0.0, rest, rest)
    motion = (told["command_position"], driven, acceleration)
    own = [body.joints_of(one) for one in motion]
    return Demand(times, own[0], own[1], own[2], driven, acceleration, mesh, joint, motor, current, voltage)


def _refuse(plan: Plan) -> None:
    """No command, or something in the way."""
    given = plan.signals.givers
    faults = [
        Fault(
            joint, "is not commanded, so there is nothing to invert", None, "add a CommandedMotion, or simulate forward"
        )
        for joint in plan.scene.joints
        if f"{joint}.{named.COMMAND_ACCELERATION.name}" not in given
        and f"{joint}.{named.SHAFT_COMMAND_ACCELERATION.name}" not in given
    ]
    touching = sorted({who for signal in named.TIP_TAKEN for who in plan.signals.adders.get(signal.name, ())})
    touching += [
        one.title for one in plan.instances if getattr(one.effect, "contact", False) and one.title not in touching
    ]
    hint = "simulate forward (FixedStep): whether the command can be followed is what contact decides"
    faults += [Fault(who, "touches what it moves against: the inverse engine does not know by how much", hint=hint)
               for who in touching]  # fmt: skip
    if faults:
        raise InputError(faults)


def _passive(plan: Plan) -> dict[str, tuple[Effect, ...]]:
    """The effects without motors and controllers, each with states replaced by what stands in for it."""
    kept: dict[str, list[Effect]] = {}
    for one in plan.instances:
        effect: Effect | None = one.effect
        if any(not state.memory for state in one.ports.states):
            effect = one.effect.quasi_static()
        if effect is not None and _mechanical(one) and not effect.shape(one.place).flexible:
            kept.setdefault(one.place.name, []).append(effect)
    return {name: tuple(effects) for name, effects in kept.items()}


def _mechanical(one: Instance) -> bool:
    """Whether an effect only makes torques, bounds and commands, out of motion and commands."""
    out = {name.rpartition(".")[2] for name in (*one.provides, *one.contributes)}
    electrical = any(name.rpartition(".")[2].startswith(("current", "voltage")) for name in one.needs)
    return out <= MECHANICAL | COMMANDS | {PAYLOAD} and not electrical and (bool(out) or not one.needs)


def _asked(passive: Plan, times: Array) -> dict[str, Array]:
    """All that the passive effects and the mechanics tell along the command; commands are those of the coordinates."""
    joints, n, memory = passive.scene.joints, passive.body.n, passive.memory
    bound = () if passive.body.coupled is None else passive.body.coupled.shafts
    found: dict[str, Any] = {
        name: [memory.places.get(_coordinate(joint, name, i in bound), -1) for i, joint in enumerate(joints)]
        for name in (*ASKED, "bias_torque", *sorted(MECHANICAL))
    }
    found["turned_bias"] = memory.places_of("coordinates", "felt_bias")
    found |= {name: memory.places_of("pairs", field) for name, field in (("mass", "mass"), ("turned", "felt"))}
    moved = np.concatenate([memory.places_of("coordinates", name) for name in ("position", "speed")])
    commanded = np.array([*found["command_position"], *found["command_speed"]])
    wanted = np.concatenate(list(found.values())).astype(np.int64)
    rows = equations.evaluate_commanded(memory.numbers.copy(), times, moved, commanded, wanted)
    rows[:, wanted < 0] = 0.0  # what a joint does not have
    ends = np.cumsum([len(own) for own in found.values()])[:-1]
    told = dict(zip(found, np.split(rows, ends, axis=1), strict=True))
    return told | {name: told[name].reshape(-1, n, n) for name in ("mass", "turned")}


def _coordinate(joint: str, name: str, bound: bool) -> str:
    """Name of what a joint's coordinate is told or tells: its shaft's where motors are coupled."""
    if name in ASKED:
        return f"{joint}.shaft_{name}" if bound else f"{joint}.{name}"
    return f"{joint}.{name}" if bound or not name.startswith("shaft_") else ""


def _ways(passive: Plan, told: Mapping[str, Array]) -> Array:
    """Which way each joint slides: 1, -1, or 0 where it rests."""
    ways = np.zeros_like(told["command_speed"])
    for i in range(passive.body.n):
        speed, acceleration = told["command_speed"][:, i], told["command_acceleration"][:, i]
        ways[:, i] = np.sign(loss_speed(speed, acceleration, resting(speed)))
    return ways


def motor_of(effects: tuple[Effect, ...]) -> Motor | None:
    """The sheet of a joint's motor."""
    sheets = [getattr(effect, "motor", None) for effect in effects]
    return next((sheet for sheet in sheets if isinstance(sheet, Motor)), None)


def _holding_of(effects: tuple[Effect, ...]) -> float:
    """Which of the torques that hold a load at rest counts, see ``Gear.holding``."""
    sheets = [getattr(effect, "gear", None) for effect in effects]
    return next((sheet.holding for sheet in sheets if isinstance(sheet, Gear)), 0.0)
