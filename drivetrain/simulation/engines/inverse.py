"""E0: inverse simulation. The commanded motion is assumed to happen, and the laws of the scene's own effects give the
torques and currents that it requires; nothing is integrated in time.

Valid while the arm touches nothing and every motor can provide what is required; other scenes are refused, since a
command into a wall, for example, would require torques without limit.

With each link on its command the torque T in its spring is known, so the motor is at q + windup(T), seen at the output
of the gear, and the rotor requires J d2 windup(T) / dt2 in addition to the torque of a rigid joint. This needs a
command with a continuous jerk, and a spring that does not bend at the loads that it passes; otherwise the torque would
be impulsive, so the contribution of the spring is left out and an event reports that.

Reference: Spong, Trans. ASME J. Dynamic Systems, Measurement and Control 109 (1987) 310, for the springs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arrays import Array, checked_number
from drivetrain.drive.drive import loss_speed, resting
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, terminal_voltage, torque_constant
from drivetrain.dynamics.closed import main_chain
from drivetrain.dynamics.inverse import tip_torque
from drivetrain.effects import signals as named
from drivetrain.effects.effect import Effect
from drivetrain.effects.loads.tip_force import TipForce
from drivetrain.errors import Fault, raise_faults
from drivetrain.simulation.core import equations
from drivetrain.simulation.engines.engine import Engine, Outcome, RunOptions
from drivetrain.simulation.passive import recorded_times
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.plan import plan as planned
from drivetrain.simulation.planning.wiring import Instance, unit_at
from drivetrain.simulation.recording import Event, Series
from drivetrain.spatial.wrenches import turned

MECHANICAL = {signal.name for signal in (*named.TAKEN, *named.SHAFT_TAKEN)}
COMMANDED = (named.COMMAND_POSITION.name, named.COMMAND_SPEED.name, named.COMMAND_ACCELERATION.name)
PAYLOAD = named.PAYLOAD_ENERGY.name.rpartition(".")[2]
COMMANDS = {*COMMANDED, *(signal.name for signal in named.SHAFT_COMMANDS)}


@dataclass(frozen=True, eq=False)
class Demand:
    """What a command requires, (N, n) each. Where motors are coupled, torques and friction are those of the shafts."""

    time: Array  # [s], (N,)
    # of the joint, as commanded [rad or m, and per s, s^2]
    position: Array
    speed: Array
    acceleration: Array
    motor_speed: Array  # of the rotor relative to its stator [rad/s]
    mesh_torque: Array  # transmitted by the mesh, at the gear's output [N m or N]
    joint_friction: Array  # dry friction at the joint [N m or N]
    motor_torque: Array  # electromagnetic [N m]
    # of the equivalent DC machine [A], [V]; NaN where the motor's data sheet is unknown
    current: Array
    voltage: Array


def demanded(plan: Plan, times: Array) -> Demand:
    """Torques, currents and voltages that a scene's command requires at times [s], (N,), with all springs rigid;
    InputError for joints without a command, and for contacts.
    """
    _refuse_unsupported(plan)
    passive = planned(replace(plan.scene, effects=_passive_effects(plan)))
    demands = _signals_along_command(passive, times)
    slides = _directions(passive, demands)
    names, body, n = passive.scene.joints, passive.body, passive.body.n
    driven, acceleration = demands["command_speed"], demands["command_acceleration"]
    turned = np.einsum("kij,kj->ki", demands["turned"], acceleration) + demands["turned_bias"]
    turned -= plan.body.carried * acceleration  # stages behind a spring are not the rotor's
    whole = np.einsum("kij,kj->ki", demands["mass"], acceleration) + demands["bias_torque"]
    joint = np.where(slides > 0.0, demands["joint_slide_forward"], -demands["joint_slide_backward"]) * np.abs(slides)
    given = demands["joint_torque"] + _tip_torques(plan, times, body.joints_of(demands["command_position"]))
    mesh = whole - turned - body.torques_of(given) - demands["shaft_torque"] + joint
    mesh = plan.body.halved(mesh) if plan.body.shared else mesh
    turns = slides * np.sign(body.ratios)  # direction in which the motor turns
    shaft = np.where(turns > 0.0, demands["motor_slide_forward"], -demands["motor_slide_backward"]) * np.abs(turns)
    factor = np.where(mesh * slides > 0.0, 1.0 + demands["mesh_driving"], 1.0 - demands["mesh_driven"])
    holds = np.array([_holding_share(plan.scene.effects.get(name, ())) for name in names])
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
    return Demand(times, own[0], own[1], own[2], driven * body.ratios, mesh, joint, motor, current, voltage)


def _refuse_unsupported(plan: Plan) -> None:
    """Raise InputError for joints without a command, and for contacts."""
    given = plan.signals.providers
    faults = [
        Fault(
            joint, "is not commanded, so there is nothing to invert", None, "add a CommandedMotion, or simulate forward"
        )
        for joint in plan.scene.joints
        if f"{joint}.{named.COMMAND_ACCELERATION.name}" not in given
        and f"{joint}.{named.SHAFT_COMMAND_ACCELERATION.name}" not in given
    ]
    tip = {signal.name for signal in named.TIP_TAKEN}
    touching = [
        one.title
        for one in plan.instances
        if getattr(one.effect, "contact", False) or (tip & {*one.contributes} and not isinstance(one.effect, TipForce))
    ]
    hint = "simulate forward (FixedStep): whether the command can be followed is what contact decides"
    faults += [Fault(who, "touches what it moves against: the inverse engine does not know by how much", hint=hint)
               for who in touching]  # fmt: skip
    raise_faults(faults)


def _tip_torques(plan: Plan, times: Array, position: Array) -> Array:
    """Torques on the joints by given forces on the tip, at positions of the joints [N m or N], (N, n)."""
    torque, arm = np.zeros_like(position), plan.scene.body
    for one in plan.instances:
        if isinstance(one.effect, TipForce) and isinstance(arm, Arm):
            rotation = tip_pose(*main_chain(arm, position))[:, :3, :3]
            wrench = turned(np.swapaxes(rotation, 1, 2), one.effect.at(times))
            torque += tip_torque(arm, position, wrench)  # J^T F
    return torque


def _passive_effects(plan: Plan) -> dict[str, tuple[Effect, ...]]:
    """The passive mechanical effects by place: without motors, controllers and springs.

    An effect with states is replaced by its quasi-static substitute.
    """
    kept: dict[str, list[Effect]] = {}
    for one in plan.instances:
        effect: Effect | None = one.effect
        if any(not state.memory for state in one.ports.states):
            effect = one.effect.quasi_static()
        if effect is not None and _mechanical(one) and not effect.shape(one.place).flexible:
            kept.setdefault(one.place.name, []).append(effect)
    return {name: tuple(effects) for name, effects in kept.items()}


def _mechanical(one: Instance) -> bool:
    """Whether an effect computes only torques, friction bounds and commands, from nothing electrical."""
    out = {name.rpartition(".")[2] for name in (*one.provides, *one.contributes)}
    electrical = any(name.rpartition(".")[2].startswith(("current", "voltage")) for name in one.needs)
    return out <= MECHANICAL | COMMANDS | {PAYLOAD} and not electrical and (bool(out) or not one.needs)


def _signals_along_command(passive: Plan, times: Array) -> dict[str, Array]:
    """Outputs of the passive effects and of the mechanics along the command, by name.

    (N, n) each, commands those of the coordinates; ``mass`` and ``turned`` (the rotors' part of it) are (N, n, n).
    """
    joints, n, memory, bound = passive.scene.joints, passive.body.n, passive.memory, passive.body.shafts
    found: dict[str, Any] = {
        name: [memory.places.get(_coordinate(joint, name, i in bound), -1) for i, joint in enumerate(joints)]
        for name in (*COMMANDED, "bias_torque", *sorted(MECHANICAL))
    }
    found["turned_bias"] = memory.places_of("coordinates", "rotor_bias")
    found |= {name: memory.places_of("pairs", field) for name, field in (("mass", "mass"), ("turned", "rotor_mass"))}
    moved = np.concatenate([memory.places_of("coordinates", name) for name in ("position", "speed")])
    commanded = np.array([*found["command_position"], *found["command_speed"]])
    wanted = np.concatenate(list(found.values())).astype(np.int64)
    rows = equations.evaluate_commanded(memory.numbers.copy(), times, moved, commanded, wanted)
    rows[:, wanted < 0] = 0.0  # signals that a joint does not have
    ends = np.cumsum([len(own) for own in found.values()])[:-1]
    demands = dict(zip(found, np.split(rows, ends, axis=1), strict=True))
    return demands | {name: demands[name].reshape(-1, n, n) for name in ("mass", "turned")}


def _coordinate(joint: str, name: str, bound: bool) -> str:
    """Full name of a signal of a joint's coordinate, which is its shaft where motors are coupled; empty if none."""
    if name in COMMANDED:
        return f"{joint}.shaft_{name}" if bound else f"{joint}.{name}"
    return f"{joint}.{name}" if bound or not name.startswith("shaft_") else ""


def _directions(passive: Plan, demands: Mapping[str, Array]) -> Array:
    """Direction in which each joint slips: 1, -1, or 0 at rest, (N, n)."""
    directions = np.zeros_like(demands["command_speed"])
    for i in range(passive.body.n):
        speed, acceleration = demands["command_speed"][:, i], demands["command_acceleration"][:, i]
        directions[:, i] = np.sign(loss_speed(speed, acceleration, resting(speed)))
    return directions


def motor_of(effects: tuple[Effect, ...]) -> Motor | None:
    """The data sheet of a joint's motor; None if no effect has one."""
    sheets = [getattr(effect, "motor", None) for effect in effects]
    return next((sheet for sheet in sheets if isinstance(sheet, Motor)), None)


def _holding_share(effects: tuple[Effect, ...]) -> float:
    """Which of the motor torques that hold a load at rest is assumed, see ``Gear.holding``."""
    sheets = [getattr(effect, "gear", None) for effect in effects]
    return next((sheet.holding for sheet in sheets if isinstance(sheet, Gear)), 0.0)


# Step of the finite differences [s], in runs shorter than 1 s the same share of the duration; a shorter one shows the
# noise of commands that are sampled every millisecond.
DIFFERENCE_STEP = 2e-3
SMOOTH = 0.1  # change of the second derivative with half the step, over its maximum, up to which a command is smooth


def with_springs(plan: Plan, demand: Demand) -> tuple[Demand, tuple[Event, ...]]:
    """Add the contribution of springs to speed, torque, current and voltage of the motors of a rigid demand.

    Also returns an event for each joint where the contribution is left out, because its wind-up is not smooth enough.
    Friction and drag at the motor stay those at its rigid speed.
    """
    springs = plan.body.springs
    if not springs:
        return demand, ()
    step = DIFFERENCE_STEP * min(plan.scene.duration, 1.0)
    # Where a command begins or ends in motion, the differences are taken inside the run, before the last instant, at
    # which a command is at rest again; one at rest stays at rest.
    first, last = (0.0 if resting(demand.speed)[k].all() else 1.001 * step for k in (0, -1))
    time = np.clip(demand.time, first, plan.scene.duration - last)
    speed, ahead = _wind_up_derivatives(plan, time, step)
    _, finer = _wind_up_derivatives(plan, time, 0.5 * step)
    turning, motor = demand.motor_speed.copy(), demand.motor_torque.copy()
    current, voltage = demand.current.copy(), demand.voltage.copy()
    events = []
    for i, shape in springs.items():
        name, ratio = plan.scene.joints[i], float(plan.body.ratios[i])
        largest = np.abs(ahead[:, i]).max()
        if shape.deflection is None or np.abs(finer[:, i] - ahead[:, i]).max() > SMOOTH * largest:
            why = (
                "its wind-up is not smooth enough: a jerk of the command that jumps, or a bend or the play of the "
                "spring, would strike the motor"
            )
            events.append(Event(0.0, "rigid", f"{name}: the motor torque that winds up its spring is neglected; {why}"))
            continue
        added = plan.body.rotors[i] * finer[:, i] / ratio
        motor[:, i] += added
        turning[:, i] += speed[:, i] * ratio
        sheet = motor_of(plan.scene.effects.get(name, ()))
        if sheet is not None:
            rest = sheet.reference_temperature
            current[:, i] += added / torque_constant(sheet, rest)
            voltage[:, i] = terminal_voltage(sheet, turning[:, i], current[:, i], 0.0, rest, rest)
    return replace(demand, motor_speed=turning, motor_torque=motor, current=current, voltage=voltage), tuple(events)


def _wind_up_derivatives(plan: Plan, time: Array, step: float) -> tuple[Array, Array]:
    """First and second derivative of the wind-ups [rad/s, rad/s^2], by central differences, (N, n) each.

    Dry friction at the joint jumps where the motion reverses, so its share of the torque is left out.
    """
    wind_ups = []
    for shift in (-step, 0.0, step):
        demands = demanded(plan, time + shift)
        wind_up = np.zeros_like(demands.mesh_torque)
        for i, shape in plan.body.springs.items():
            if shape.deflection is not None:
                carried = demands.mesh_torque[:, i] - demands.joint_friction[:, i]
                wind_up[:, i] = [shape.deflection(float(load)) for load in carried]
        wind_ups.append(wind_up)
    before, now, after = wind_ups
    return (after - before) / (2.0 * step), (after - 2.0 * now + before) / step**2


@dataclass(frozen=True)
class Inverse(Engine):
    """The inverse engine: torques and currents that the commanded motion requires.

    Attributes:
        share: Share of a limit of current or voltage that the command may use [-].
    """

    share: float = 1.0

    def __post_init__(self) -> None:
        checked_number(self.share, "Inverse.share", "-", above=0.0)

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Compute what the command requires at the output times.

        Raises:
            InputError: A motor that would exceed its current or voltage, given initial states or an earlier run to
                continue, besides what ``demanded`` refuses.
        """
        hint = "simulate forward (FixedStep) from there"
        raise_faults(
            Fault(name, "does not go with Inverse, whose motion is the commanded one", hint=hint)
            for name, given in (("start", options.start), ("resume", options.resume))
            if given
        )
        times = recorded_times(plan.scene.duration, options.interval)
        demand, events = with_springs(plan, demanded(plan, times))
        raise_faults(
            fault for joint, name in enumerate(plan.scene.joints) for fault in self._limits(plan, demand, joint, name)
        )
        counters = {"instants": len(times), "steps": 0}
        return Outcome(np.empty((0, 0)), counters, events, series=_series(plan, demand), times=times)

    def _limits(self, plan: Plan, demand: Demand, joint: int, name: str) -> list[Fault]:
        """Faults for a joint whose motor would exceed its peak current or its voltage."""
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
        series[f"{name}.motor_speed"] = Series("rad/s", demand.motor_speed[:, i])
        series[f"{name}.electromagnetic_torque"] = Series("N m", demand.motor_torque[:, i])
        if np.isfinite(demand.current[:, i]).all():
            series[f"{name}.current"] = Series("A", demand.current[:, i])
            series[f"{name}.voltage"] = Series("V", demand.voltage[:, i])
        wind_up = plan.body.springs[i].deflection if i in plan.body.springs else None
        if wind_up is not None:
            angle = np.array([wind_up(load) for load in demand.mesh_torque[:, i]])
            series[f"{name}.deflection"] = Series(unit_at("rad", plan.scene.turning[i]), angle)
    return series
