"""Laws of controllers and commands, called one by one, and where effects start: formulas written out."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from called_laws import COUPLED, PLACE, Called, joint_at, world_at
from numpy.polynomial import Polynomial
from scipy.interpolate import BPoly

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.effects import signals as s
from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque, SampledComputedTorque
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.effect import Effect, Place, Shape
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.laws import Whole
from drivetrain.effects.loads.payload_change import EMPTY, Body, PayloadChange
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.motor.current_loop import CurrentLoop, SampledCurrentLoop
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.supply_bus import SupplyBus
from drivetrain.effects.motor.winding import Winding
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion

RATIO, R, K, L = -40.0, 0.35, 0.041, 2.7e-4
MOTOR = Motor("m", R, K, inductance=L, magnet_coefficient=-0.0013, reference_temperature=22.0)
TWO = Place(-1, "scene", ("a", "b"), (-40.0, 60.0), (True, True), 2)
BENT = Gear("s", 50.0, stiffness_1=9e3, torque_1=4.5, stiffness_2=1.7e4, torque_2=13.0, stiffness_3=2.6e4)
# A command and a motor that lags it.
MOVED = {"command.position": 0.3, "command.speed": 1.1, "shaft_command.position": -0.2, "shaft_command.speed": -0.7,
         "motor.position": -11.0, "motor.speed": -41.0, "pin.command": 0.5, "pin.damping": 0.1,
         "pin.stiffness": 0.2}  # fmt: skip


@pytest.mark.parametrize("place", [PLACE, COUPLED])
def test_a_position_loop_is_a_spring_and_a_damper(place: Place) -> None:
    pin = Called(PositionLoop(900.0, 55.0, K), MOVED, place=place)("compute", 1e-3).joint.pin
    at, speed = (-0.2, -0.7) if place is COUPLED else (0.3, 1.1)
    scale = 1.0 / (K * RATIO**2)
    asked = scale * (900.0 * (RATIO * at + 11.0) + 55.0 * (RATIO * speed + 41.0))
    found = pin.command, pin.damping, pin.stiffness
    assert found == pytest.approx((0.5 + asked, 0.1 + 55.0 * scale, 0.2 + 900.0 * scale))


# Peak current, integrator, step: free, within the soft band and beyond it, and moving away from the limit.
CASCADES = {
    "free": (math.inf, 2.0, 0.0), "in a step": (99.0, 2.0, 4e-3), "at its limit": (3.0, 2.0, 4e-3),
    "at its lower limit": (3.0, -9.0, 0.0), "in the band": (3.119, -2.0, 0.0), "back": (3.0, -9.0, 4e-3),
}  # fmt: skip


@pytest.mark.parametrize("place", [PLACE, COUPLED])
@pytest.mark.parametrize("name", CASCADES)
def test_a_cascade_commands_within_its_limit(name: str, place: Place) -> None:
    peak, held, h = CASCADES[name]
    loop = CascadeLoop(25.0, 0.04, 0.03, peak)
    one = Called(loop, MOVED, {"integrated_current": held}, place)("compute", h)
    at, speed = (-0.2, -0.7) if place is COUPLED else (0.3, 1.1)
    error = RATIO * speed + 25.0 * (RATIO * at + 11.0) + 41.0
    rate = 0.04 / 0.03 * error
    demanded = 0.04 * error + held + 0.5 * h * rate
    free = abs(demanded) <= peak
    if not free and demanded * error > 0.0:
        rate *= max(1.0 - (abs(demanded) - peak) / (1e-3 * peak), 0.0)
    pin, slopes = one.joint.pin, (0.04, 1.0) if free else (0.0, 0.0)
    assert pin.command == pytest.approx(0.5 + min(max(demanded, -peak), peak))
    assert (pin.damping, pin.stiffness) == pytest.approx((0.1 + slopes[0], 0.2 + slopes[1]))
    assert one.own.integrated_current_rate == pytest.approx(rate, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("delay", [0, 1, 2])
@pytest.mark.parametrize("peak, notch", [(math.inf, 500.0), (1.3, 500.0), (math.inf, 0.0), (math.inf, 0.05)])
def test_a_sampled_cascade_is_its_recursion(delay: int, peak: float, notch: float) -> None:
    """Notch in its second direct form, integrator that stops at the limit, queue."""
    loop = SampledCascade(25.0, 0.04, 0.03, peak, 2e-3, delay, notch=notch, notch_zeros=0.2, notch_poles=0.8)
    assert loop.period == 2e-3
    one = Called(loop, {"command.position": 0.3, "command.speed": 1.1, "pin.command": 0.5}, place=PLACE)
    warped = 2.0 / 2e-3 * math.tan(0.5 * notch * 2e-3)
    c = 2.0 / 2e-3
    zeros, poles = (np.array([c * c + 2.0 * d * warped * c + warped**2, 2.0 * (warped**2 - c * c),
                              c * c - 2.0 * d * warped * c + warped**2]) for d in (0.2, 0.8))  # fmt: skip
    zeros, poles = zeros / poles[0], poles / poles[0]
    ins, outs, held, before, queue = [0.0] * 2, [0.0] * 2, 0.0, 0.0, [0.0] * delay
    limited = 0
    for k, measured in enumerate((-11.0, -11.4, -12.3, -12.2, -13.0, -12.4, -11.9, -12.0)):
        one.joint.measured_position = measured
        one("sample")("compute")
        raw = RATIO * 1.1 + 25.0 * (RATIO * 0.3 - measured) - (measured - before) / 2e-3
        error = zeros @ [raw, *ins] - poles[1:] @ outs
        ins, outs, before = [raw, ins[0]], [error, outs[0]], measured
        rate = 0.04 / 0.03 * error
        asked = 0.04 * error + held + 2e-3 * rate
        current = min(max(asked, -peak), peak)
        held += 2e-3 * rate * (current == asked or current * error < 0.0)
        limited += current != asked
        queue.append(current)
        given = queue.pop(0)
        assert one.joint.pin.command == pytest.approx(0.5 + given, rel=1e-9), k
        one.joint.pin.command = 0.5
    assert math.isinf(peak) or 0 < limited < 8


def test_an_encoder_counts_down_too() -> None:
    for angle, counted in ((0.31, 0.3), (-0.31, -0.4), (0.0, 0.0)):
        found = Called(Encoder(63), {"motor.position": angle * 2.0 * math.pi / 6.3})("compute").joint.measured_position
        assert found == pytest.approx(counted * 2.0 * math.pi / 6.3)
        assert Called(Encoder(), {"motor.position": angle})("compute").joint.measured_position == angle
    push = Called(Preload(MOTOR, 12.0), {"pin.command": 0.5})("compute")
    assert push.joint.pin.command == pytest.approx(0.5 - 12.0 / 40.0 / K)
    assert push.effect.shape(PLACE) == Shape(preload=12.0)


@pytest.mark.parametrize("shafts", [(), (1,), (0, 1)])
def test_computed_torque_of_two_joints(shafts: tuple[int, ...]) -> None:
    """M (a + kd e' + kp e) + h over ratio and torque constant; coupled motors by their shafts."""
    rng = np.random.default_rng(3)
    command, shaft_command, load, shaft = rng.normal(size=(4, 2, 3))
    joints = []
    for i in range(2):
        numbers = {"bias_torque": 3.0 - 5.0 * i, "pin.command": 0.5, "pin.damping": 0.1, "pin.stiffness": 0.2}
        for name, values in (("command", command), ("shaft_command", shaft_command), ("load", load), ("shaft", shaft)):
            numbers |= {f"{name}.{kind}": values[i, k] for k, kind in enumerate(("position", "speed", "acceleration"))}
        joints.append(joint_at(numbers))
    mass, constants, ratios = np.array([[2.0, 0.7], [0.7, 1.1]]), np.array([0.04, 0.05]), np.array([-40.0, 60.0])
    effect: Any = ComputedTorque(20.0, (("b", 0.05), ("a", 0.04)))
    table = effect.table(TWO)
    table[list(shafts), 2] = 1.0
    effect.compute(0.0, 0.0, effect.own(TWO), Whole(joints, world_at(), mass, table))
    at = np.array([shaft[i] if i in shafts else load[i] for i in range(2)])
    wanted = np.array([shaft_command[i] if i in shafts else command[i] for i in range(2)])
    asked = wanted[:, 2] + 400.0 * (wanted[:, 0] - at[:, 0]) + 40.0 * (wanted[:, 1] - at[:, 1])
    current = (mass @ asked + [3.0, -2.0]) / (ratios * constants)
    slope = np.diag(mass) / (ratios**2 * constants)
    for i in range(2):
        pin = joints[i].pin
        found = pin.command, pin.damping, pin.stiffness
        assert found == pytest.approx((0.5 + current[i], 0.1 + 40.0 * slope[i], 0.2 + 400.0 * slope[i]))
    coupled = replace(COUPLED, joint=-1, name="scene")
    np.testing.assert_allclose(effect.table(coupled), [[-0.625, -0.025, 1.0], [1.0 / 3.0, 1.0 / 60.0, 1.0]])
    with pytest.raises(InputError, match="must be positive for b"):
        ComputedTorque(20.0, (("a", 0.04), ("b", 0.0))).table(TWO)
    with pytest.raises(InputError, match="must be positive for b"):
        ComputedTorque(20.0, (("a", 0.04),)).table(TWO)


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_sampled_computed_torque_of_two_joints(delay: int) -> None:
    """Speeds are differences of the measured angles; each sample's currents wait for ``delay`` more."""
    effect: Any = SampledComputedTorque(20.0, (("a", 0.04), ("b", 0.05)), 5e-3, delay)
    assert effect.period == 5e-3
    joints = [joint_at({"bias_torque": 3.0 - 5.0 * i}) for i in range(2)]
    mass, constants, ratios = np.array([[2.0, 0.7], [0.7, 1.1]]), np.array([0.04, 0.05]), np.array([-40.0, 60.0])
    own, table, rng = effect.own(TWO), effect.table(TWO), np.random.default_rng(4)
    before, queue = np.zeros(2), [np.zeros(2)] * delay
    for k in range(6):
        command, measured = rng.normal(size=(2, 3)), rng.normal(size=2)
        for i, joint in enumerate(joints):
            joint.measured_position, joint.pin.command = measured[i], 0.5
            joint.command.position, joint.command.speed, joint.command.acceleration = command[i]
        scene = Whole(joints, world_at(), mass, table)
        effect.sample(5e-3 * k, 0.0, own, scene)
        effect.compute(5e-3 * k, 0.0, own, scene)
        asked = command[:, 2] + 400.0 * (command[:, 0] - measured / ratios)
        asked += 40.0 * (command[:, 1] - (measured - before) / 5e-3 / ratios)
        queue.append((mass @ asked + [3.0, -2.0]) / (ratios * constants))
        given, before = queue.pop(0), measured
        assert [joint.pin.command - 0.5 for joint in joints] == pytest.approx(given)


def test_a_sampled_current_loop_is_its_recursion() -> None:
    """Through both limits of the command, its slew and both limits of the voltage; the supply sinks in between."""
    effect = SampledCurrentLoop(MOTOR, 2600.0, 1e-4, 20.0, 4e4, 0.6)
    one = Called(effect, {"motor.speed": 25.0})
    kp, ki, held, followed = L * 2600.0, R * 2600.0 * 1e-4, 0.0, 0.0
    cut = 0
    for command, current, limit in ((50.0, 0.0, 3.0), (50.0, 2.0, 3.0), (3.0, 5.0, 4.0), (-50.0, 3.0, 4.0),
                                    (-50.0, -6.0, 1.0), (-50.0, 9.0, 1.0), (1.0, -5.0, 40.0)):  # fmt: skip
        pin = one.joint.pin
        pin.command, pin.current, pin.limit = command, current, limit
        one("sample")("compute")
        followed += min(max(min(max(command, -20.0), 20.0) - followed, -4.0), 4.0)
        held += ki * (followed - current)
        wanted = kp * (followed - current) + held + 0.6 * K * 25.0
        volts = min(max(wanted, -limit), limit)
        held += (volts - wanted) * ki / kp
        cut += volts != wanted
        assert pin.voltage == pytest.approx(volts)
        assert one.own.integrated_voltage == pytest.approx(held, abs=1e-12)
        pin.limit = 0.3 * limit
        assert one("compute").joint.pin.voltage == pytest.approx(min(max(volts, -0.3 * limit), 0.3 * limit))
    assert 1 < cut < 7
    assert effect.period == 1e-4 and effect.time_scales(PLACE)[0].seconds == 1e-4


# --- commanded motion

TIME = np.array([0.5, 0.7, 0.7, 1.3, 2.0])  # from 0.5 s on, with a jump of the acceleration
rng = np.random.default_rng(11)
PLACES, SPEEDS, PUSHES = rng.normal(size=(3, 5, 2))
PLACES[2], SPEEDS[2] = PLACES[1], SPEEDS[1]
MOTION = Motion("m", ("b", "a"), TIME, PLACES, SPEEDS, PUSHES)


def commanded(effect: CommandedMotion, t: float, place: Place = TWO) -> Any:
    law: Any = effect.compute
    joints = [joint_at({"command.speed": 7.0, "command.acceleration": 7.0}) for _ in place.joints]
    law(t, 0.0, effect.own(place), Whole(joints, world_at(), np.eye(2), effect.table(place)))
    return joints


@pytest.mark.parametrize("repetitions", [1, 2, 3])
def test_a_command_is_the_quintic_between_its_samples(repetitions: int) -> None:
    effect = CommandedMotion(MOTION, repetitions)
    for t in (0.0, 0.07, 0.2, 0.31, 0.79, 1.1, 1.49):
        for round_ in range(repetitions):
            joints = commanded(effect, t + 1.5 * round_)
            low = int(np.searchsorted(TIME - 0.5, t, side="right")) - 1
            for column, joint in ((1, joints[0]), (0, joints[1])):
                ends = [[one[k, column] for one in (PLACES, SPEEDS, PUSHES)] for k in (low, low + 1)]
                curve = BPoly.from_derivatives(TIME[[low, low + 1]] - 0.5, ends)
                command = joint.command
                found = command.position, command.speed, command.acceleration
                assert found == pytest.approx([float(curve(t, nu=k)) for k in range(3)], abs=1e-10)
    for column, joint in ((1, commanded(effect, 1.5 * repetitions)[0]), (0, commanded(effect, 1.5 * repetitions)[1])):
        command = joint.command  # at its end it still moves
        ends = [one[-1, column] for one in (PLACES, SPEEDS, PUSHES)]
        assert [command.position, command.speed, command.acceleration] == pytest.approx(ends, abs=1e-10)
    just_after = 1.5 * repetitions + 1e-14
    for t, row in ((just_after, -1), (9.0, -1), *([(-0.1, 0)] if repetitions == 1 else [])):
        for column, joint in ((1, commanded(effect, t)[0]), (0, commanded(effect, t)[1])):
            command = joint.command
            assert (command.position, command.speed, command.acceleration) == (PLACES[row, column], 0.0, 0.0)
    assert effect.breakpoints() == pytest.approx([0.2, 1.5, 1.7, 3.0, 3.2, 4.5][: 2 * repetitions])
    joints, where, fast = effect.begins_at(TWO)
    assert joints == [0, 1] and where.tolist() == [*PLACES[0, ::-1]] and fast.tolist() == [*SPEEDS[0, ::-1]]


def test_shafts_of_coupled_motors_are_commanded_as_they_turn() -> None:
    effect = CommandedMotion(MOTION)
    joints = commanded(effect, 0.31, COUPLED)
    turns = np.array(COUPLED.coupling)
    for kind in ("position", "speed", "acceleration"):
        of_joints = np.array([getattr(joint.command, kind) for joint in joints])
        assert [getattr(joint.shaft_command, kind) for joint in joints] == pytest.approx(turns @ of_joints)
    assert commanded(effect, 0.31)[0].shaft_command.position == 0.0


def test_commands_bend_where_their_jerk_jumps() -> None:
    """Polynomials of the fifth degree, to which cubes are added from 0.7 s and from 1.1 s on."""
    time = np.array([0.0, 0.1, 0.25, 0.7, 0.8, 1.1, 1.5, 1.6])
    rng, places = np.random.default_rng(5), []
    for begin, size in ((0.7, 0.4), (1.1, -0.02)):
        whole, cube = Polynomial(rng.normal(size=6)), Polynomial([0.0, 0.0, 0.0, size])
        places.append([whole.deriv(k)(time) + cube.deriv(k)(np.maximum(time - begin, 0.0)) for k in range(3)])
    motion = Motion("m", ("a", "b"), 3.0 + time, *np.transpose(places, (1, 2, 0)))
    once = np.array([0.0, 0.7, 1.1, 1.6])
    assert CommandedMotion(motion, 2).knots(1e-9) == pytest.approx([*once, *1.6 + once])
    assert CommandedMotion(motion).knots(0.9) == pytest.approx([0.0, 1.6])  # no jump is that large


# --- where effects start, and what else they tell


def test_loops_start_with_the_current_that_holds() -> None:
    def known(holding: float, fed: float, **more: float) -> dict[str, float]:
        named = {f"joint.{s.HOLDING_CURRENT}": holding, f"joint.{s.FED_CURRENT}": fed}
        return named | {f"joint.{name}": value for name, value in more.items()}

    integral, stiff = CascadeLoop(25.0, 0.04, 0.03, 3.0), CascadeLoop(25.0, 0.04)
    assert integral.start(PLACE, known(4.5, 2.0)) == (2.5,)
    assert integral.start(PLACE, known(9.0, 2.0)) == (3.0,) and integral.start(PLACE, known(-9.0, 2.0)) == (-3.0,)
    assert integral.start(PLACE, known(4.5, 2.0, command_acceleration=0.1)) == (0.0,)  # the feed-forward knows all
    assert integral.start(PLACE, known(2.5, 0.0, command_speed=0.1)) == (2.5,)
    assert integral.start(PLACE, known(4.5, 2.0, command_position=0.1)) == (2.5,)
    assert stiff.start(PLACE, known(4.5, 2.0)) == (0.0,)
    assert integral.sag(PLACE, known(4.5, 2.0)) == 0.0 and CascadeLoop(0.0, 0.04).sag(PLACE, known(4.5, 2.0)) == 0.0
    assert stiff.sag(PLACE, known(4.5, 2.0)) == pytest.approx(2.5)
    for stiffness in (900.0, 3.0):
        loop = PositionLoop(stiffness, 55.0, K)
        assert loop.sag(PLACE, known(4.5, 2.0)) == pytest.approx(2.5 / stiffness * K * RATIO**2)
    assert PositionLoop(0.0, 55.0, K).sag(PLACE, known(4.5, 2.0)) == 0.0
    sampled = SampledCascade(25.0, 0.04, 0.03, 3.0, 2e-3, 2)
    moving = known(4.5, 2.0, measured_position=-11.0, motor_speed=50.0)
    assert sampled.start(PLACE, moving) == pytest.approx((2.5, -11.1, 2.5, 2.5, 2.5, 0.0, 0.0, 0.0))
    assert replace(sampled, delay=0).start(PLACE, moving) == pytest.approx((2.5, -11.1, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0))
    two = {f"{name}.{signal}": value for name, of in (("a", (4.0, 1.0)), ("b", (-3.0, 2.0)))
           for signal, value in zip((s.HOLDING_CURRENT, s.MEASURED_POSITION.name), of, strict=True)}  # fmt: skip
    two["b.motor_speed"] = 10.0
    torque = SampledComputedTorque(20.0, (("a", 0.04), ("b", 0.05)), 5e-3, 1)
    assert torque.start(TWO, two) == pytest.approx((1.0, 1.95, 4.0, -3.0, 4.0, -3.0, 0.0, 0.0, 0.0, 0.0))
    assert len(torque.start(TWO, two)) == len(torque.ports(TWO).states)


def test_windings_start_with_the_current_that_flows() -> None:
    named = {"joint.current_command": 7.0, "joint.current": 7.0, "joint.motor_speed": -25.0}
    warm = {"joint.winding_temperature": 61.0, "joint.housing_temperature": 37.0}
    assert Winding(MOTOR).start(PLACE, named) == (7.0,) and Winding(MOTOR, -1.5).start(PLACE, named) == (-1.5,)
    hot = R * (1.0 + (61.0 - 22.0) / (1.0 / 0.0039 - 3.0))
    weak = K * (1.0 - 0.0013 * 15.0)
    loop = CurrentLoop(MOTOR, 2600.0, 30.0, 0.6)
    for more, r, k in (({}, R, K), (warm, hot, weak)):
        known = named | more
        assert loop.start(PLACE, known) == pytest.approx((7.0, r * 7.0 - (k - 0.6 * K) * 25.0))
        low = replace(loop, peak_current=5.0)
        assert low.start(PLACE, known)[0] == 5.0
        assert low.start(PLACE, known | {"joint.current_command": -7.0})[0] == -5.0
        for command, way in ((7.0, 1.0), (-7.0, -1.0)):
            bound = known | {"joint.voltage_limit": 0.9, "joint.current_command": command}
            current = (way * 0.9 + k * 25.0) / r
            current = min(current, 7.0) if way > 0.0 else max(current, -7.0)
            assert loop.start(PLACE, bound)[0] == pytest.approx(current)
    sampled = SampledCurrentLoop(MOTOR, 2600.0, 1e-4, 20.0, 4e4, 0.6)
    assert sampled.start(PLACE, named) == pytest.approx((R * 7.0 - K * 25.0, R * 7.0 - 0.4 * K * 25.0, 7.0))
    assert sampled.start(PLACE, named | warm)[0] == pytest.approx(hot * 7.0 - K * 25.0)
    bristles = LuGreFriction(2e3, 0.9, 1.4, 0.05)
    for speed in (0.03, -0.03, 0.0, 1e9):
        left = 0.9 + 0.5 * math.exp(-((min(abs(speed), 1.0) / 0.05) ** 2))
        expected = math.copysign(left, speed) / 2e3 if speed else 0.0
        assert bristles.start(PLACE, {"joint.speed": speed}) == pytest.approx((expected,))


def seconds(effect: Effect) -> dict[str, float]:
    return {one.name: one.seconds for one in effect.time_scales(PLACE)}


def test_time_scales() -> None:
    scales: tuple[tuple[Effect, dict[str, float]], ...] = (
        (PositionLoop(900.0, 55.0, K), {"error decays": 55.0 / 900.0}), (PositionLoop(0.0, 55.0, K), {}),
        (PositionLoop(0.02, 55.0, K), {"error decays": 2750.0}), (CascadeLoop(0.02, 0.04), {"position loop": 50.0}),
        (CascadeLoop(25.0, 0.04, 0.03), {"position loop": 0.04, "integral": 0.03}), (CascadeLoop(0.0, 0.04), {}),
        (SampledCascade(25.0, 0.04, every=2e-3), {"servo sample": 2e-3}),
        (SampledComputedTorque(20.0, (), 5e-3), {"servo sample": 5e-3}),
        (CurrentLoop(MOTOR, 2600.0), {"current loop": 1.0 / 2600.0, "winding": L / R}),
        (Winding(MOTOR), {"current follows": L / R}),
        (LuGreFriction(2e3, 0.9, 1.4, 0.05), {"bristles slip": 0.9 / 100.0}),
        (SupplyBus(48.0, 0.01, 200.0, 60.0, 4.0), {"brake resistor": 0.04, "source fills the bus": 11.52 / 200.0}),
        (SupplyBus(48.0, 0.01), {}),
    )  # fmt: skip
    for effect, expected in scales:
        assert seconds(effect) == pytest.approx(expected), effect


def test_what_stands_for_an_effect_that_is_left_out() -> None:
    stands: tuple[tuple[Effect, Effect | None], ...] = (
        (SampledCascade(25.0, 0.04, 0.03, 3.0, 2e-3), CascadeLoop(25.0, 0.04, 0.03, 3.0)), (Encoder(500), Encoder()),
        (SampledComputedTorque(20.0, (("a", 0.04),)), ComputedTorque(20.0, (("a", 0.04),))),
        (CurrentLoop(MOTOR, 2600.0, 30.0), MotorCurrent(MOTOR, 30.0)),
        (FullRotor(3e-5, 4.0), ReflectedRotor(3e-5, 4.0)),
        (SampledCurrentLoop(MOTOR, 2600.0, 1e-4, 20.0), CurrentLoop(MOTOR, 2600.0, 20.0)),
        (ReflectedRotor(3e-5, 4.0), None), (ViscousFriction(Friction(viscous=1.0)), None),
    )  # fmt: skip
    for effect, expected in stands:
        assert effect.quasi_static() == expected and type(effect.quasi_static()) is type(expected)


def test_shapes_of_springs_and_rotors() -> None:
    straight, loose = Gear("g", 50.0, stiffness_1=9e3), replace(BENT, backlash=1.2e-3, efficiency=0.8)
    sliding = replace(PLACE, turning=(False,))
    pieces = ((FlexibleJoint(straight), False), (FlexibleJoint(BENT), True), (Backlash(loose), True))
    for spring, piecewise in pieces:
        shape = spring.shape(PLACE)
        assert (shape.ratio, shape.flexible, spring.piecewise()) == (50.0, True, piecewise)
        assert spring.shape(sliding).ratio is None and shape.carried == 0.0
        twist: Any = shape.deflection
        play = 0.6e-3 if isinstance(spring, Backlash) else 0.0
        bent = 4.5 / 9e3 + 8.5 / 1.7e4 + 7.0 / 2.6e4 if spring.gear is not straight else 20.0 / 9e3
        assert (twist(20.0), twist(-20.0)) == pytest.approx((bent + play, -bent - play))
    assert TipContact((0.0,) * 3, (0.0, 0.0, 1.0), 1.0).piecewise() and not MotorCurrent(MOTOR).piecewise()
    assert MeshLoss(loose).shape(PLACE) == Shape(ratio=50.0) and MeshLoss(loose).shape(sliding).ratio is None
    assert FullRotor(3e-5, 4.0).shape(PLACE) == Shape(4.0, 3e-5, full=True)
    assert ReflectedRotor(3e-5, 4.0).shape(PLACE) == Shape(4.0, 3e-5, full=False)
    with pytest.raises(InputError, match="must not be zero"):
        FullRotor(3e-5, 0.0)


def test_a_payload_as_moments_of_its_mass() -> None:
    """Integrals of m, m x and m x x' over two balls, written out."""
    balls = ((1.5, np.array([0.1, 0.2, -0.3])), (0.7, np.array([-0.2, 0.4, 0.5])))
    mass = sum(m for m, _ in balls)
    com = sum(m * x for m, x in balls) / mass
    second = sum(m * np.outer(x, x) for m, x in balls)
    inertia = sum(m * ((x - com) @ (x - com) * np.eye(3) - np.outer(x - com, x - com)) for m, x in balls)
    time, moments = PayloadChange([0.2, 0.7], (EMPTY, Body(mass, com, inertia))).carried()
    assert time.tolist() == [0.2, 0.7] and not moments[0].any()
    np.testing.assert_allclose(moments[1], np.block([[second, mass * com[:, None]], [mass * com, mass]]), atol=1e-14)
