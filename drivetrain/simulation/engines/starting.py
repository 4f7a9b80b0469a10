"""The initial state of a run: equilibrium, so that nothing moves that is not commanded to.

Springs have the wind-up of the load that they carry, and the motor currents hold the load: integrators of the loops are
set so that they command these currents; a loop without an integrator needs a position error, so its motor starts behind
its command. Dry friction carries no load in equilibrium, and meshes have no loss.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.motor import Motor, torque_constant
from drivetrain.effects import signals as s
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.simulation.core import equations
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event

PASSES = 60  # iterations of the equilibrium, at most, since initial states may depend on one another
CONVERGED = 1e-12  # change of all initial states in a pass, absolute and relative, at which the iteration ends
# Change of a joint's lag per change of the lag that it was found at, at most: at 1 there is no stable equilibrium.
STEEPEST = 0.95
NEGLIGIBLE = 1e-4  # relative difference of currents that is not reported
REST_ACCELERATION = 1e-6  # acceleration below which a joint counts as held by friction [rad/s^2 or m/s^2]


def initial_memory(plan: Plan, given: Mapping[str, float] | None = None) -> Array:
    """The memory of a run at its start: all states in equilibrium, except those that are given by name.

    Equilibrium is found by fixed-point iteration over the springs, the holding currents and the states of the effects;
    the lag of the joints, on which their load depends, by the secant method.
    """
    memory = plan.memory
    numbers = memory.numbers.copy()
    at, states = memory.view(numbers, "coordinates"), memory.view(numbers, "states")
    problem = "have no spring or play, which parts the two motors of an axis"
    raise_faults(
        Fault(f"effects[{plan.scene.joints[second]!r}]", problem)
        for _, second in plan.body.shared
        if second not in plan.body.springs
    )
    held, known = _holding_motors(plan), _Known(memory.places, numbers)
    _put_motion(plan, at, *_commanded(plan))
    for i in plan.body.springs:
        at["position"][plan.body.motors[i]] = plan.body.zeros[i]
    equations.evaluate_signals(numbers)
    for joint in held:  # at the commanded position, with empty integrators, the command is the feed-forward current
        known.read[f"{joint}.{s.FED_CURRENT}"] = known.get(f"{joint}.{s.CURRENT_COMMAND.name}", 0.0)
    position, speed = _motion(plan)
    _put_motion(plan, at, position, speed)
    for i in plan.body.springs:
        at["speed"][plan.body.motors[i]] = speed[i]
    with_states = [(one, [memory.states[name] for name in one.states]) for one in plan.instances if one.states]
    wind_up_of = {i: shape.deflection for i, shape in plan.body.springs.items() if shape.deflection is not None}
    lag = tried = needed = np.zeros(plan.body.n)  # of the joints behind their command [rad or m]
    for _ in range(PASSES if with_states or wind_up_of or held else 0):
        before = np.append(numbers[states["value"]], at["position"])
        equations.evaluate_signals(numbers)
        for i, deflection in wind_up_of.items():
            at["position"][plan.body.motors[i]] = deflection(_holding_torque(known, plan, i))
        for joint, motor in held.items():
            known.read[f"{joint}.{s.HOLDING_CURRENT}"] = _holding(known, plan, joint, motor)
        for one, places in with_states:
            numbers[states["value"][places]] = one.effect.start(one.place, known)
        if plan.scene.position is None:
            holds = _command_lag(plan, known, at)
            lag, tried, needed = _next_lag(tried, needed, lag, holds), lag, holds
            _put_motion(plan, at, position - lag, speed)
        if np.allclose(np.append(numbers[states["value"]], at["position"]), before, CONVERGED, CONVERGED):
            break
    _put_given(plan, numbers, given or {})
    # Contact modes found before the iteration has converged are discarded: at speed zero all coordinates start stuck.
    at["dry"]["mode"] = 0
    found = equations.evaluate_rates(numbers, numbers[states["value"][: memory.moving]])
    rate = found[plan.body.c : 2 * plan.body.c]
    at["last"] = np.where(np.isfinite(rate), rate, 0.0)
    return numbers


def _put_motion(plan: Plan, at: Any, position: Array, speed: Array) -> None:
    """Write positions and speeds of the joints, (n,), into the coordinates."""
    n = plan.body.n
    alone = plan.body.loads == np.arange(n)
    at["position"][:n][alone] = plan.body.coordinates_of(position)[alone]
    at["speed"][:n] = plan.body.coordinates_of(speed)


def _put_given(plan: Plan, numbers: Array, given: Mapping[str, float]) -> None:
    """Overwrite states with given values; InputError for names that are no states of the scene."""
    unknown = [name for name in given if name not in plan.memory.states]
    if unknown:
        faults = [Fault("start", f"the scene has no state {name}", None, nearest(name, list(plan.memory.states)))
                  for name in unknown]  # fmt: skip
        raise InputError(faults)
    states = plan.memory.view(numbers, "states")
    for name, value in given.items():
        numbers[states["value"][plan.memory.states[name]]] = checked_array(value, (), f"start[{name!r}]")


class _Known(Mapping[str, float]):
    """The signals of a run by name, read from its memory when asked for.

    An effect reads only a few of hundreds, so no dictionary of all is built. ``read`` adds signals that exist only
    during the start, such as the holding current.
    """

    def __init__(self, places: Mapping[str, int], values: Array) -> None:
        self._places, self._values = places, values
        self.read: dict[str, float] = {}

    def __getitem__(self, name: str) -> float:
        return self.read[name] if name in self.read else float(self._values[self._places[name]])

    def __iter__(self) -> Iterator[str]:
        return iter((*self._places, *self.read))

    def __len__(self) -> int:
        return len(self._places) + len(self.read)


def _commanded(plan: Plan) -> tuple[Array, Array]:
    """Positions and speeds of the joints at the beginning of their command, (n,) each; zero without a command."""
    position, speed = np.zeros(plan.body.n), np.zeros(plan.body.n)
    for one in plan.instances:
        begin = getattr(one.effect, "begins_at", None)
        if begin is not None:
            joints, where, fast = begin(one.place)
            position[joints], speed[joints] = where, fast
    return position, speed


def _motion(plan: Plan) -> tuple[Array, Array]:
    """Initial positions and speeds of the joints, (n,) each: those of the scene, else those of the command."""
    scene, n = plan.scene, plan.body.n
    position, speed = _commanded(plan)
    if scene.position is not None:
        position = np.asarray(scene.position)
        speed = np.zeros(n)
    if scene.speed is not None:
        speed = np.asarray(scene.speed)
    return position, speed


def _holding_motors(plan: Plan) -> dict[str, Motor]:
    """The motors of the joints that a current can hold, by joint; without coupled motors, which share their loads."""
    found = {}
    for one in plan.instances:
        sheet = getattr(one.effect, "motor", None)
        if isinstance(sheet, Motor) and one.place.joint >= 0 and not one.place.coupled:
            found[one.place.name] = sheet
    return found


def _holding_torque(known: Mapping[str, float], plan: Plan, i: int) -> float:
    """Torque that the drive of joint i must provide to keep the joint at constant speed [N m or N].

    Each of two motors on an axis provides half of it, and its preload.
    """
    pair = next((pair for pair in plan.body.shared if i in pair), (i,))
    load = known.get(f"{plan.scene.joints[i]}.{s.BIAS_TORQUE.name}", 0.0)
    given = [f"{plan.scene.joints[k]}.{torque.name}" for k in pair for torque in (s.JOINT_TORQUE, s.TIP_TORQUE)]
    load -= sum(known.get(name, 0.0) for name in given)
    return load if len(pair) == 1 else load / len(pair) + plan.body.preloads[i]


def _holding(known: Mapping[str, float], plan: Plan, joint: str, motor: Motor) -> float:
    """The motor current that holds this load, given the other torques at the motor's shaft [A]."""
    housing = known.get(f"{joint}.{s.HOUSING_TEMPERATURE.name}", 0.0)
    warmed = f"{joint}.{s.HOUSING_TEMPERATURE.name}" in plan.signals.providers
    constant = float(torque_constant(motor, housing if warmed else motor.reference_temperature))
    flows = known.get(f"{joint}.{s.CURRENT.name}", 0.0)
    others = known.get(f"{joint}.{s.MOTOR_TORQUE.name}", 0.0) - constant * flows
    i = plan.scene.joints.index(joint)
    return (_holding_torque(known, plan, i) / plan.body.ratios[i] - others) / constant


def _command_lag(plan: Plan, known: Mapping[str, float], at: Any) -> Array:
    """By how much each joint lags its command in equilibrium [rad or m], (n,).

    The wind-up of its spring, and the position error that a loop without an integrator needs to hold the load.
    """
    lag = np.zeros(plan.body.n)
    looped = {one.place.joint for one in plan.instances if hasattr(one.effect, "sag")}  # loops on the motor's position
    for i in looped & set(plan.body.springs):
        lag[i] = at["position"][plan.body.motors[i]] - plan.body.zeros[i]
    for one in plan.instances:
        sag = getattr(one.effect, "sag", None)
        if sag is not None and one.place.joint >= 0 and not one.place.coupled:
            lag[one.place.joint] += sag(one.place, known) / one.place.ratio
    return lag


def _next_lag(tried: Array, needed: Array, lag: Array, holds: Array) -> Array:
    """The next lag to try, by the secant method for each joint alone [rad or m], (n,).

    ``tried`` and ``lag`` are the last two that were tried; ``needed`` and ``holds`` those that hold the load there.
    """
    moved = lag - tried
    slope = np.divide(holds - needed, moved, out=np.zeros(len(lag)), where=moved != 0.0)
    return np.asarray(lag + (holds - lag) / (1.0 - np.minimum(slope, STEEPEST)))


def start_description(plan: Plan, row: Mapping[str, float], given: Mapping[str, float]) -> str:
    """A description of the initial state, for the recording."""
    currents = [(joint, row.get(f"{joint}.{s.CURRENT.name}", 0.0)) for joint in plan.scene.joints]
    holds = ", ".join(f"{joint} {value:.3g} A" for joint, value in currents if abs(value) > 0.0)
    text = "equilibrium" + (f", held by {holds}" if holds else "")
    return text + (f"; given: {', '.join(given)}" if given else "")


def yielding_joints(plan: Plan, row: Mapping[str, float]) -> tuple[Event, ...]:
    """Events for joints that yield to their load at the start though no motion is commanded.

    Their current is smaller than the holding current, because of a limit for example.
    """
    events = []
    for joint, motor in _holding_motors(plan).items():
        if f"{joint}.{s.COMMAND_SPEED.name}" not in row:
            continue
        moved = row[f"{joint}.{s.COMMAND_SPEED.name}"] or row[f"{joint}.{s.COMMAND_ACCELERATION.name}"]
        holding, flows = _holding(row, plan, joint, motor), row.get(f"{joint}.{s.CURRENT.name}", 0.0)
        i = plan.scene.joints.index(joint)
        moves = row[f"{joint}.{s.MOTOR_ACCELERATION.name}"] / plan.body.ratios[i]
        gives_way = moves * _holding_torque(row, plan, i) < 0.0 and abs(moves) > REST_ACCELERATION
        if not moved and gives_way and abs(holding) > (1.0 + NEGLIGIBLE) * abs(flows):
            detail = f"{joint} gives way though nothing is commanded: {holding:.3g} A would hold it, {flows:.3g} A flow"
            events.append(Event(0.0, "start", detail))
    return (*events, *_slipping_brakes(plan, row))


def _slipping_brakes(plan: Plan, row: Mapping[str, float]) -> Iterator[Event]:
    """Events for brakes that are engaged at the start and do not hold."""
    for one in plan.instances:
        if isinstance(one.effect, HoldingBrake) and one.effect.engaged_at_start:
            joint = one.place.name
            moves = abs(row[f"{joint}.{s.MOTOR_ACCELERATION.name}"] / one.place.ratio) > REST_ACCELERATION
            if row[f"{joint}.{s.MOTOR_SPEED.name}"] == 0.0 and moves:
                detail = f"{joint} slips in its engaged brake, whose {one.effect.holding:.4g} N m do not hold it"
                yield Event(0.0, "start", detail)
