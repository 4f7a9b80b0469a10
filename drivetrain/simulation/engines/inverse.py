"""E0: the command taken as done, and asked what it takes by the laws of a scene's own effects; nothing solved in time.

Valid while nothing touches the arm and every motor can do what is asked. It refuses the rest: a command pressed into a
wall asks for torques that no motor will ever give.

With each link on its command its spring carries a torque T that is known, so the motor stands at q + twist(T) behind
the gear, and the rotor takes J d2 twist(T) / dt2 on top of what a rigid joint takes. That asks for a command whose jerk
does not jump: else the motor would have to be struck, so what the spring does is left out, and said.

Reference: Spong, Trans. ASME J. Dynamic Systems, Measurement and Control 109 (1987) 310, for the springs.
"""

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
from drivetrain.errors import Fault, raise_faults
from drivetrain.simulation.core import equations
from drivetrain.simulation.engines.engine import Engine, Outcome, RunOptions
from drivetrain.simulation.passive import recorded_times
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.plan import plan as planned
from drivetrain.simulation.planning.wiring import Instance, unit_at
from drivetrain.simulation.recording import Event, Series

MECHANICAL = {signal.name for signal in (*named.TAKEN, *named.SHAFT_TAKEN)}
COMMANDED = (named.COMMAND_POSITION.name, named.COMMAND_SPEED.name, named.COMMAND_ACCELERATION.name)
PAYLOAD = named.PAYLOAD_ENERGY.name.rpartition(".")[2]
COMMANDS = {*COMMANDED, *(signal.name for signal in named.SHAFT_COMMANDS)}


@dataclass(frozen=True, eq=False)
class Demand:
    """What a command takes; arrays (N, n). Where motors are coupled torques and friction are those of the shafts."""

    time: Array  # [s], (N,)
    # as commanded [rad or m, and per s, s^2]
    position: Array
    speed: Array
    acceleration: Array
    shaft_speed: Array  # of the shaft behind the gear, the joint's own where no motors are coupled
    mesh_torque: Array  # through the mesh, at the output [N m or N]
    joint_friction: Array  # dry friction at the joint [N m or N]
    motor_torque: Array  # electromagnetic [N m]
    # at the motor's terminals [A], [V]; NaN where no motor is known
    current: Array
    voltage: Array


def demanded(plan: Plan, times: Array) -> Demand:
    """What a scene's command takes, by the laws of its own effects."""
    _refuse(plan)
    passive = planned(replace(plan.scene, effects=_passive(plan)))
    demands = _demands(passive, times)
    slides = _directions(passive, demands)
    names, body, n = passive.scene.joints, passive.body, passive.body.n
    driven, acceleration = demands["command_speed"], demands["command_acceleration"]
    turned = np.einsum("kij,kj->ki", demands["turned"], acceleration) + demands["turned_bias"]
    whole = np.einsum("kij,kj->ki", demands["mass"], acceleration) + demands["bias_torque"]
    joint = np.where(slides > 0.0, demands["joint_slide_forward"], -demands["joint_slide_backward"]) * np.abs(slides)
    mesh = whole - turned - body.torques_of(demands["joint_torque"]) - demands["shaft_torque"] + joint
    way = slides * np.sign(body.ratios)
    shaft = np.where(way > 0.0, demands["motor_slide_forward"], -demands["motor_slide_backward"]) * np.abs(way)
    factor = np.where(mesh * slides > 0.0, 1.0 + demands["mesh_driving"], 1.0 - demands["mesh_driven"])
    holds = np.array([_holding_of(plan.scene.effects.get(name, ())) for name in names])
    room = np.where(holds > 0.0, demands["mesh_driving"], np.minimum(demands["mesh_driven"], 1.0))
    factor = np.where(slides == 0.0, 1.0 + holds * room, factor)
    motor = (factor * mesh + turned) / body.ratios + shaft - demands["motor_torque"]
    current, voltage = np.full_like(motor, np.nan), np.full_like(motor, np.nan)
    for i in range(n):
        sheet = motor_of(plan.scene.effects.get(names[i], ()))
        if sheet is not None:
            rest, speed = sheet.reference_temperature, driven[:, i] * body.ratios[i]
            current[:, i] = motor[:, i] / torque_constant(sheet, rest)
            voltage[:, i] = terminal_voltage(sheet, speed, current[:, i], 0.0, rest, rest)
    motion = (demands["command_position"], driven, acceleration)
    own = [body.joints_of(one) for one in motion]
    return Demand(times, own[0], own[1], own[2], driven, mesh, joint, motor, current, voltage)


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
    raise_faults(faults)


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


def _demands(passive: Plan, times: Array) -> dict[str, Array]:
    """All outputs of the passive effects and the mechanics along the command; commands are those of the coordinates."""
    joints, n, memory = passive.scene.joints, passive.body.n, passive.memory
    bound = () if passive.body.coupled is None else passive.body.coupled.shafts
    found: dict[str, Any] = {
        name: [memory.places.get(_coordinate(joint, name, i in bound), -1) for i, joint in enumerate(joints)]
        for name in (*COMMANDED, "bias_torque", *sorted(MECHANICAL))
    }
    found["turned_bias"] = memory.places_of("coordinates", "felt_bias")
    found |= {name: memory.places_of("pairs", field) for name, field in (("mass", "mass"), ("turned", "felt"))}
    moved = np.concatenate([memory.places_of("coordinates", name) for name in ("position", "speed")])
    commanded = np.array([*found["command_position"], *found["command_speed"]])
    wanted = np.concatenate(list(found.values())).astype(np.int64)
    rows = equations.evaluate_commanded(memory.numbers.copy(), times, moved, commanded, wanted)
    rows[:, wanted < 0] = 0.0  # what a joint does not have
    ends = np.cumsum([len(own) for own in found.values()])[:-1]
    demands = dict(zip(found, np.split(rows, ends, axis=1), strict=True))
    return demands | {name: demands[name].reshape(-1, n, n) for name in ("mass", "turned")}


def _coordinate(joint: str, name: str, bound: bool) -> str:
    """Name of the signals of a joint's coordinate: its shaft's where motors are coupled."""
    if name in COMMANDED:
        return f"{joint}.shaft_{name}" if bound else f"{joint}.{name}"
    return f"{joint}.{name}" if bound or not name.startswith("shaft_") else ""


def _directions(passive: Plan, demands: Mapping[str, Array]) -> Array:
    """Which way each joint slides: 1, -1, or 0 where it rests."""
    ways = np.zeros_like(demands["command_speed"])
    for i in range(passive.body.n):
        speed, acceleration = demands["command_speed"][:, i], demands["command_acceleration"][:, i]
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


APART = 2e-3  # s, between the instants of a difference, less noise than samples of 1 ms make; of a short run its share
SMOOTH = 0.1  # of the largest second derivative: what half the distance may change


def with_springs(plan: Plan, demand: Demand) -> tuple[Demand, tuple[Event, ...]]:
    """A rigid demand with what springs add to motor speed, torque, current and voltage; joints where that is left out.

    Friction and drag at the motor are those of its rigid speed.
    """
    springs = plan.body.springs
    if not springs:
        return demand, ()
    apart = APART * min(plan.scene.duration, 1.0)
    # A command that begins or ends under way goes on beyond the run; one at rest stays there.
    first, last = (apart if demand.speed[k].any() else 0.0 for k in (0, -1))
    time = np.clip(demand.time, first, plan.scene.duration - last)
    speed, ahead = _twisting(plan, time, apart)
    _, finer = _twisting(plan, time, 0.5 * apart)
    motor, current, voltage = demand.motor_torque.copy(), demand.current.copy(), demand.voltage.copy()
    events = []
    for i, shape in springs.items():
        name, ratio = plan.scene.joints[i], float(plan.body.ratios[i])
        largest = np.abs(ahead[:, i]).max()
        if shape.deflection is None or np.abs(finer[:, i] - ahead[:, i]).max() > SMOOTH * largest:
            why = "its command is not smooth enough: a jerk that jumps would strike the motor"
            events.append(Event(0.0, "rigid", f"{name}: what its spring asks of the motor is left out; {why}"))
            continue
        added = plan.body.rotors[i] * finer[:, i] / ratio
        motor[:, i] += added
        sheet = motor_of(plan.scene.effects.get(name, ()))
        if sheet is not None:
            rest = sheet.reference_temperature
            current[:, i] += added / torque_constant(sheet, rest)
            turning = (demand.shaft_speed[:, i] + speed[:, i]) * ratio
            voltage[:, i] = terminal_voltage(sheet, turning, current[:, i], 0.0, rest, rest)
    return replace(demand, motor_torque=motor, current=current, voltage=voltage), tuple(events)


def _twisting(plan: Plan, time: Array, apart: float) -> tuple[Array, Array]:
    """First and second derivative of the twists, by central differences, (N, n) each.

    Dry friction at the joint jumps as the joint turns round: its share of the torque is left out.
    """
    twists = []
    for shift in (-apart, 0.0, apart):
        demands = demanded(plan, time + shift)
        twist = np.zeros_like(demands.mesh_torque)
        for i, shape in plan.body.springs.items():
            if shape.deflection is not None:
                carried = demands.mesh_torque[:, i] - demands.joint_friction[:, i]
                twist[:, i] = [shape.deflection(float(load)) for load in carried]
        twists.append(twist)
    before, now, after = twists
    return (after - before) / (2.0 * apart), (after - 2.0 * now + before) / apart**2


@dataclass(frozen=True)
class Inverse(Engine):
    """The inverse engine.

    Attributes:
        share: Of a limit that a command may reach, 1 for all of it.
    """

    share: float = 1.0

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """What the command takes at the wanted instants."""
        times = recorded_times(plan.scene.duration, options.interval)
        demand, events = with_springs(plan, demanded(plan, times))
        raise_faults(
            fault for joint, name in enumerate(plan.scene.joints) for fault in self._limits(plan, demand, joint, name)
        )
        counters = {"instants": len(times), "steps": 0}
        return Outcome(np.empty((0, 0)), counters, events, series=_series(plan, demand), times=times)

    def _limits(self, plan: Plan, demand: Demand, joint: int, name: str) -> list[Fault]:
        """What the joint's motor cannot do."""
        effects = plan.scene.effects.get(name, ())
        faults = []
        for what, values, unit in (("peak_current", demand.current, "A"), ("voltage", demand.voltage, "V")):
            limit = min((float(getattr(effect, what, np.inf)) for effect in effects), default=np.inf)
            worst = int(np.argmax(np.abs(np.nan_to_num(values[:, joint]))))
            needed = abs(float(np.nan_to_num(values[worst, joint])))
            if needed > self.share * limit:
                problem = (
                    f"the command takes {needed:.4g} {unit} at {demand.time[worst]:.4g} s, more than {limit:.4g} {unit}"
                )
                faults.append(Fault(name, problem, needed, "simulate forward (FixedStep) to see what happens instead"))
        return faults


def _series(plan: Plan, demand: Demand) -> dict[str, Series]:
    series = {}
    columns: tuple[tuple[str, str, Any], ...] = (
        ("position", "rad", demand.position), ("speed", "rad/s", demand.speed),
        ("acceleration", "rad/s^2", demand.acceleration), ("mesh_torque", "N m", demand.mesh_torque),
        ("joint_friction", "N m", demand.joint_friction),
    )  # fmt: skip
    for i, name in enumerate(plan.scene.joints):
        for what, unit, values in columns:
            series[f"{name}.{what}"] = Series(unit_at(unit, plan.scene.turning[i]), values[:, i])
        series[f"{name}.motor_speed"] = Series("rad/s", demand.shaft_speed[:, i] * plan.body.ratios[i])
        series[f"{name}.electromagnetic_torque"] = Series("N m", demand.motor_torque[:, i])
        if np.isfinite(demand.current[:, i]).all():
            series[f"{name}.current"] = Series("A", demand.current[:, i])
            series[f"{name}.voltage"] = Series("V", demand.voltage[:, i])
        twist = plan.body.springs[i].deflection if i in plan.body.springs else None
        if twist is not None:
            series[f"{name}.deflection"] = Series("rad", np.array([twist(load) for load in demand.mesh_torque[:, i]]))
    return series
