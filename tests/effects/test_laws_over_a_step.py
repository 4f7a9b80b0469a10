"""Laws in a fixed step, called one by one: means over the step by scipy, energy, and slopes by differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from called_laws import COUPLED, PLACE, Called, world_at
from scipy.integrate import quad, solve_ivp
from scipy.linalg import expm

from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop
from drivetrain.effects.effect import Effect, Place, Role
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenVoltage
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.winding import Winding
from drivetrain.effects.motor.winding_heat import WindingHeat

R, K, L, AIR = 0.35, 0.041, 2.7e-4, 22.0
MOTOR = Motor("m", R, K, inductance=L, magnet_coefficient=-0.0013, reference_temperature=AIR)
WARM = {"heat.winding": 61.0, "heat.housing": 37.0}
HOT_R = R * (1.0 + (61.0 - AIR) / (1.0 / 0.0039 + AIR - 25.0))
WARM_K = K * (1.0 - 0.0013 * (37.0 - AIR))
BENT = Gear("s", 50.0, stiffness_1=9e3, torque_1=4.5, stiffness_2=1.7e4, torque_2=13.0, stiffness_3=2.6e4)
LOOSE = Gear("b", 50.0, stiffness_1=9e3, torque_1=4.5, stiffness_2=1.7e4, backlash=1.2e-3)
BRISTLES: dict[str, Any] = {"stiffness": 2e3, "coulomb": 0.9, "static": 1.4, "stribeck_speed": 0.05, "damping": 3.0,
                            "viscous": 0.2}  # fmt: skip
SMOOTH = Friction(coulomb=0.4, viscous=0.1, coulomb_negative=0.6, viscous_negative=0.15, tanh_speed=0.05)
LEVERS = Counterbalance(800.0, 0.1, lever_carrier=0.2, lever_link=0.15, dead_centre=0.3, torque=0.7)
WALL = TipContact((0.1, 0.3, -0.2), (-2.0, 1.0, 0.5), 5e3, 130.0)
NORMAL = np.array([-2.0, 1.0, 0.5]) / math.sqrt(5.25)
PUSH = (np.array([0.0, 0.3, 0.5]), np.array([1.7, 1.7, -0.4]))


def at_depth(depth: float, rate: float) -> Any:
    """The tip so deep in the wall [m], moving on into it and along it [m/s]."""
    along = np.array([0.1, 0.2, 0.0])
    return world_at(np.array([0.1, 0.3, -0.2]) - depth * NORMAL + along - NORMAL * (along @ NORMAL), along / 3.0 - (
        rate + along @ NORMAL / 3.0) * NORMAL)  # fmt: skip


# --- what is put in is lost, stored or done

# An effect, its joint in the middle of the step, its states before it, the step.
KEPT: dict[str, tuple[Effect, dict[str, float], dict[str, Any], float]] = {
    "bristles": (LuGreFriction(**BRISTLES), {"load.speed": 0.08}, {"bend": -2e-4}, 2e-3),
    "bristles that slip": (LuGreFriction(**BRISTLES), {"load.speed": -0.9}, {"bend": 3e-4}, 2e-2),
    "bristles of a motor": (LuGreFriction(**BRISTLES, side="motor"), {"motor.speed": 0.4}, {"bend": 1e-4}, 1e-3),
    "smooth friction": (ViscousFriction(SMOOTH), {"load.speed": -0.07}, {}, 1e-2),
    "viscous friction": (ViscousFriction(Friction(viscous=0.3), "motor"), {"motor.speed": 5.0}, {}, 1e-2),
    "a bent spring": (FlexibleJoint(BENT, 2.5), {"spring.wind_up": 6e-4, "spring.speed": 0.3}, {}, 1e-3),
    "a spring": (FlexibleJoint(Gear("s", 50.0, stiffness_1=9e3), 2.5), {"spring.wind_up": 6e-4, "spring.speed": 0.3},
                 {}, 1e-3),
    "flanks that meet": (Backlash(LOOSE, 7.0), {"spring.wind_up": 6.2e-4, "spring.speed": 0.4}, {}, 1e-3),
    "flanks that part": (Backlash(LOOSE, 7.0), {"spring.wind_up": -6.3e-4, "spring.speed": 0.4}, {}, 1e-3),
    "flanks pressed": (Backlash(LOOSE, 7.0), {"spring.wind_up": 1.3e-3, "spring.speed": -0.4}, {}, 1e-3),
    "a moving wall": (WallSpring(30.0, 1.3, 0.05, -0.4), {"load.position": 0.2, "load.speed": 0.7}, {}, 1e-2),
    "teeth": (Cogging((0.02, 0.007), (12, 24), (0.3, -0.5)), {"motor.position": 0.4, "motor.speed": 60.0}, {}, 2e-3),
    "levers": (CounterbalanceTorque(LEVERS), {"load.position": 0.8, "load.speed": -0.6}, {}, 1e-3),
    "a push": (GivenTorque(*PUSH), {"load.speed": 0.7}, {}, 1e-3),
    "a push at the motor": (GivenTorque(*PUSH, "motor"), {"motor.speed": -7.0}, {}, 1e-3),
    "a motor": (MotorCurrent(MOTOR), {**WARM, "pin.command": 6.0, "pin.limit": math.inf, "motor.speed": 31.0}, {},
                1e-3),
    "a winding": (Winding(MOTOR), {**WARM, "pin.voltage": 7.0, "motor.speed": 55.0}, {"current": -3.0}, 4e-4),
    "a loop": (CurrentLoop(MOTOR, 2600.0), {**WARM, "pin.command": 6.0, "pin.limit": 40.0, "motor.speed": 55.0},
               {"current": 1.0, "integrated_voltage": 0.4}, 8e-4),
    "a loop at its voltage": (CurrentLoop(MOTOR, 2600.0), {**WARM, "pin.command": -16.0, "pin.limit": 4.0,
                              "motor.speed": 25.0}, {"current": 1.0, "integrated_voltage": -0.4}, 8e-4),
    "the tip in a wall": (WALL, {}, {"depth": 3e-3, "rate": 0.2}, 1e-3),
    "the tip that enters a wall": (WALL, {}, {"depth": 3e-5, "rate": 0.7}, 1e-3),
    "the tip that leaves a wall": (WALL, {}, {"depth": 3e-5, "rate": -0.7}, 1e-3),
}  # fmt: skip


@pytest.mark.parametrize("name", KEPT)
def test_what_is_put_in_is_lost_stored_or_done(name: str) -> None:
    """Power from outside less losses is the work done on the mechanics and the growth of what is stored."""
    effect, numbers, states, h = KEPT[name]
    middle = 0.37

    def called(share: float) -> Called:
        """That far from the middle of the step, in steps."""
        moved = dict(numbers)
        for flange in ("load.position", "motor.position", "spring.wind_up"):
            speed = flange.replace("position", "speed").replace("wind_up", "speed")
            if speed in numbers:
                moved[flange] = numbers.get(flange, 0.0) + share * h * numbers[speed]
        if effect is WALL:
            return Called(effect, {}, {}, world=at_depth(states["depth"] + share * h * states["rate"], states["rate"]))
        return Called(effect, moved, states)

    step = called(0.0)
    step("compute", h, middle)("account", h, middle)
    joint, tip = step.joint, step.world.tip
    done = joint.load.torque * joint.load.speed + joint.motor.torque * joint.motor.speed
    done += float(tip.force @ tip.speed) - joint.spring.torque * joint.spring.speed
    before, after = called(-0.5)("account", 0.0, middle - 0.5 * h), called(0.5)
    for state in effect.ports(PLACE).states:
        path = state.path or state.name
        begun, rate = getattr(step.own, path), getattr(step.own, f"{path}_rate")
        setattr(after.own, path, begun + h * rate)
    grown = after("account", 0.0, middle + 0.5 * h).total(Role.STORE) - before.total(Role.STORE)
    put_in, lost = step.total(Role.SOURCE), step.total(Role.LOSS)
    size = abs(put_in) + abs(lost) + abs(done) + abs(grown / h)
    assert size > 1e-3 and put_in - lost == pytest.approx(done + grown / h, abs=2e-9 * size)
    assert lost >= 0.0


# --- means over a step


@pytest.mark.parametrize("h", [2e-5, 4e-4, 2e-2])
@pytest.mark.parametrize("begun, volts, speed", [(3.0, 7.0, 55.0), (-2.0, 0.0, -90.0)])
def test_a_winding_in_a_step_and_after_it(begun: float, volts: float, speed: float, h: float) -> None:
    one = Called(Winding(MOTOR), {**WARM, "pin.voltage": volts, "motor.speed": speed}, {"current": begun})
    for winding, length in ((61.0, h), (90.0, h), (90.0, 0.7 * h)):
        one.joint.heat.winding, one.own.current, one.joint.motor.torque, one.joint.motor.damping = winding, begun, 0, 0
        r = R * (1.0 + (winding - AIR) / (1.0 / 0.0039 + AIR - 25.0))
        level, lag = (volts - WARM_K * speed) / r, L / r

        def flow(t: float, level: float = level, lag: float = lag) -> float:
            return level + (begun - level) * math.exp(-t / lag)

        means = [quad(lambda t, n=n: flow(t) ** n, 0.0, length, epsrel=1e-12, limit=200)[0] / length for n in (1, 2)]
        one("compute", length)("account", length)
        own, pin, motor = one.own, one.joint.pin, one.joint.motor
        gone = 1.0 - math.exp(-length / lag)
        end, mean = gone / r, (1.0 - gone * lag / length) / r
        assert begun + length * own.current_rate == pytest.approx(flow(length), rel=1e-9)
        assert motor.torque == pytest.approx(WARM_K * means[0], rel=1e-9)
        assert motor.damping == pytest.approx(WARM_K**2 * mean, rel=1e-9)
        assert one.joint.heat.copper_loss == pytest.approx(r * means[1], rel=1e-7)
        assert pin.power == pytest.approx(volts * means[0], rel=1e-9)
        assert pin.magnetic_energy == pytest.approx(0.5 * L * begun**2, rel=1e-12)
    # At the end of the step the motor has another speed: the current has followed that of the middle.
    own.current, motor.speed, motor.torque = flow(length), 1.2 * speed, 0.0
    now = own.current + (end - 2.0 * mean) * WARM_K * 0.2 * speed
    one("compute")("account")
    assert motor.torque == pytest.approx(WARM_K * now, rel=1e-8)
    assert own.current_rate == pytest.approx((volts - WARM_K * motor.speed - r * now) / L, rel=1e-7)
    assert pin.current == pytest.approx(now, rel=1e-8) and pin.power == pytest.approx(volts * now, rel=1e-8)
    assert one.joint.heat.copper_loss == pytest.approx(r * now**2, rel=1e-8)


BAND, FED = 2600.0, 0.6
KP, KI = L * BAND, R * BAND


def controlled(
    states: Mapping[str, float], h: float, volts: float, command: float, speed: float, r: float = HOT_R
) -> np.ndarray:
    """Current and integrator after a step, and means of current, its square and the power drawn, by scipy."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        asks = KP * (command - y[0]) + y[1] + FED * K * speed
        given = min(max(asks, -volts), volts)
        flow = (given - r * y[0] - WARM_K * speed) / L
        return [flow, KI * (command - y[0]) + (given - asks) * KI / KP, y[0], y[0] ** 2, given * y[0]]

    begin = [states["current"], states["integrated_voltage"], 0.0, 0.0, 0.0]
    end = solve_ivp(rates, (0.0, h), begin, "DOP853", rtol=1e-11, atol=1e-12, max_step=h / 100).y[:, -1]
    return end * np.array([1.0, 1.0, 1.0 / h, 1.0 / h, 1.0 / h])


# Command, peak, largest voltage, speed, current and integrator before the step, its length, and how exact the end is
# (changes of a limit are found to a 512th of the step).
LOOPS = {
    "free": (6.0, 30.0, 60.0, 55.0, 1.0, 0.4, 6e-4, 1e-8),
    "unlimited": (6.0, math.inf, math.inf, -55.0, 1.0, 0.4, 6e-4, 1e-8),
    "at its peak": (-40.0, 9.0, 60.0, 55.0, -7.0, 0.4, 6e-4, 1e-8),
    "at its voltage": (30.0, 40.0, 4.0, 55.0, 1.0, 0.4, 6e-4, 1e-8),
    "at its lower voltage": (-30.0, 20.0, 4.0, 55.0, 1.0, 0.4, 6e-4, 1e-8),
    "leaves its voltage": (9.0, 30.0, 6.5, 25.0, 2.0, 0.4, 6e-4, 3e-3),
    "comes to its voltage": (12.0, 30.0, 5.2, -20.0, 11.9, 5.0, 6e-4, 3e-3),
    "comes to its lower voltage": (-12.0, 30.0, 5.2, 20.0, -11.9, -5.0, 6e-4, 3e-3),
    "at its voltage in between": (8.7, 30.0, 3.47, -2.5, 20.0, 11.04, 2.5e-3, 3e-5),
}


@pytest.mark.parametrize("name", LOOPS)
def test_a_current_loop_in_a_step(name: str) -> None:
    command, peak, volts, speed, current, held, h, close = LOOPS[name]
    begun = {"current": current, "integrated_voltage": held}
    effect = CurrentLoop(MOTOR, BAND, peak, FED)

    def called(spin: float = 0.0, turn: float = 0.0) -> Called:
        slopes = {"pin.damping": 0.02, "pin.stiffness": 1.7}
        asked = {"pin.command": command - 0.02 * spin - 1.7 * turn, "pin.limit": volts, **slopes}
        return Called(effect, {**WARM, **asked, "motor.speed": speed + spin, "motor.position": 0.4 + turn}, begun)

    one = called()("compute", h)
    own, pin, motor = one.own, one.joint.pin, one.joint.motor
    demanded = min(max(command, -peak), peak)
    end, drawn, mean, square, power = controlled(begun, h, volts, demanded, speed)
    size = abs(current) + abs(end) + abs(mean)
    assert motor.torque == pytest.approx(WARM_K * mean, abs=close * WARM_K * size)
    wanted = HOT_R * mean + WARM_K * speed + L * (end - current) / h
    assert pin.voltage == pytest.approx(wanted, abs=close * (abs(wanted) + L * size / h))
    one("account", h)
    assert current + h * own.current_rate == pytest.approx(end, abs=close * size)
    assert held + h * own.integrated_voltage_rate == pytest.approx(drawn, abs=close * (abs(drawn) + KP * size))
    assert one.joint.heat.copper_loss == pytest.approx(HOT_R * square, abs=close * HOT_R * size**2)
    assert pin.power == pytest.approx(power, abs=close * (abs(power) + volts * size if volts < 1e9 else abs(power)))
    assert pin.magnetic_energy == pytest.approx(0.5 * L * current**2)
    # The solution moves on from the guess, and the command with it where it is free.
    motor.speed, motor.position = speed + 3.0, 0.4 + 0.11
    one("account", h)
    free = demanded == command and close < 1e-6 and "voltage" not in name
    moved = demanded - (0.02 * 3.0 + 1.7 * 0.11 if free else 0.0)
    if close < 1e-6:
        end, *_ = controlled(begun, h, volts, moved, speed + 3.0)
        assert current + h * own.current_rate == pytest.approx(end, abs=close * size)
        wanted = HOT_R * _[1] + WARM_K * (speed + 3.0) + L * (end - current) / h
        assert pin.voltage == pytest.approx(wanted, abs=close * (abs(wanted) + L * size / h))
        # Slopes: exact, since all of it is linear within the limits.
        by_spin, by_turn = (
            (called(*way)("compute", h).joint.motor.torque - called(*back)("compute", h).joint.motor.torque) / 2.0
            for way, back in (((1.0, 0.0), (-1.0, 0.0)), ((0.0, 0.01), (0.0, -0.01)))
        )
        assert motor.damping == pytest.approx(-by_spin, rel=1e-6, abs=1e-9)
        assert motor.stiffness == pytest.approx(-by_turn / 0.01, rel=1e-6, abs=1e-9)
    if name == "free":  # of another resistance, and of another step, the matrices are others
        for winding, length in ((90.0, h), (90.0, 0.6 * h)):
            one.joint.heat.winding, motor.speed, motor.position = winding, speed, 0.4
            one("compute", length)("account", length)
            r = R * (1.0 + (winding - AIR) / (1.0 / 0.0039 + AIR - 25.0))
            end, *_ = controlled(begun, length, volts, demanded, speed, r)
            assert current + length * own.current_rate == pytest.approx(end, rel=1e-8)


@pytest.mark.parametrize("name", LOOPS)
def test_a_current_loop_at_an_instant(name: str) -> None:
    command, peak, volts, speed, current, held, *_ = LOOPS[name]
    begun = {"current": current, "integrated_voltage": held}
    numbers = {**WARM, "pin.command": command, "pin.limit": volts, "motor.speed": speed}
    one = Called(CurrentLoop(MOTOR, BAND, peak, FED), numbers, begun)("compute")("account")
    error = min(max(command, -peak), peak) - current
    asks = KP * error + held + FED * K * speed
    given = min(max(asks, -volts), volts)
    assert one.joint.pin.voltage == pytest.approx(given)
    assert one.own.current_rate == pytest.approx((given - HOT_R * current - WARM_K * speed) / L)
    assert one.own.integrated_voltage_rate == pytest.approx(KI * error + (given - asks) * R / L)
    assert one.joint.motor.torque == pytest.approx(WARM_K * current)
    assert one.joint.pin.power == pytest.approx(given * current)
    assert one.joint.heat.copper_loss == pytest.approx(HOT_R * current**2)


# Command, largest current and voltage, speed; the current that flows, and the slopes of its command that are left.
INSTANT_MOTORS = {
    "free": (6.0, 30.0, 60.0, 55.0, 6.0, (0.02, 1.7)),
    "at its peak": (40.0, 9.0, 60.0, 55.0, 9.0, (0.0, 0.0)),
    "at its lower peak": (-40.0, 9.0, math.inf, 55.0, -9.0, (0.0, 0.0)),
    "at its voltage": (30.0, 40.0, 4.0, 55.0, (4.0 - WARM_K * 55.0) / HOT_R, (WARM_K / HOT_R, 0.0)),
    "at its lower voltage": (-30.0, 40.0, 4.0, 55.0, (-4.0 - WARM_K * 55.0) / HOT_R, (WARM_K / HOT_R, 0.0)),
}


@pytest.mark.parametrize("name", INSTANT_MOTORS)
def test_a_motor_without_inductance(name: str) -> None:
    command, peak, volts, speed, flows, (damping, stiffness) = INSTANT_MOTORS[name]
    asked = {"pin.command": command, "pin.damping": 0.02, "pin.stiffness": 1.7, "pin.limit": volts}
    one = Called(MotorCurrent(MOTOR, peak), {**WARM, **asked, "motor.speed": speed})("compute", 1e-3)("account", 1e-3)
    pin, motor = one.joint.pin, one.joint.motor
    assert pin.current == pytest.approx(flows) and motor.torque == pytest.approx(WARM_K * flows)
    assert pin.voltage == pytest.approx(WARM_K * speed + HOT_R * flows)
    assert (motor.damping, motor.stiffness) == pytest.approx((WARM_K * damping, WARM_K * stiffness))
    assert one.joint.heat.copper_loss == pytest.approx(HOT_R * flows**2)
    assert pin.power == pytest.approx(pin.voltage * flows)


@pytest.mark.parametrize("speed, surface", [(0.3, 0.1), (-0.02, 0.0), (0.1, 0.13), (0.05, 0.05)])
@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize("side", ["joint", "motor", "shaft"])
@pytest.mark.parametrize("h", [1e-4, 2e-2])
def test_bristles_in_a_step(side: Any, size: float, speed: float, surface: float, h: float) -> None:
    flange = {"joint": "load", "motor": "motor", "shaft": "shaft"}[side]
    numbers = {f"{flange}.speed": speed, ("motor" if side == "motor" else "load") + ".surface_speed": surface}
    sized = {name: value * (1.0 if name == "stribeck_speed" else size) for name, value in BRISTLES.items()}
    effect = LuGreFriction(**sized, side=side)
    one = Called(effect, numbers, {"bend": -2e-4}, COUPLED)
    slip = speed - surface
    law = 0.9 + 0.5 * math.exp(-((slip / 0.05) ** 2))

    def rates(t: float, z: np.ndarray) -> list[float]:
        return [slip - 2e3 * abs(slip) * z[0] / law, z[0]]

    end, area = solve_ivp(rates, (0.0, h), [-2e-4, 0.0], "DOP853", rtol=1e-11, atol=1e-16, max_step=h / 20).y[:, -1]
    one("compute", h)("account", h)
    found = getattr(one.joint, flange)
    torque = size * (2e3 * area / h + 3.0 * (end + 2e-4) / h + 0.2 * slip)
    assert -2e-4 + h * one.own.bend_rate == pytest.approx(end, rel=1e-8, abs=1e-15)
    assert (found.torque, one.own.torque) == pytest.approx((-torque, torque), rel=1e-8)
    stored = size * 1e3 * (end**2 - 4e-8) / h
    assert one.own.power == pytest.approx(torque * slip - stored, rel=1e-7, abs=1e-12)

    # The slope, where it is one, to the rounding of a difference over a small part of the Stribeck speed.
    small = 1e-6 * 0.05 * (1.0 if slip >= 0.0 else -1.0)
    beside = Called(effect, {**numbers, f"{flange}.speed": speed + small}, {"bend": -2e-4}, COUPLED)("compute", h)
    steep = -(getattr(beside.joint, flange).torque - found.torque) / small
    assert found.damping == pytest.approx(max(steep, 0.0), rel=1e-5, abs=1e-5 * size)

    now = Called(effect, numbers, {"bend": -2e-4}, COUPLED)("compute")("account")
    rate, _ = rates(0.0, np.array([-2e-4, 0.0]))
    torque = size * (3.0 * rate + 0.2 * slip - 0.4)
    assert now.own.bend_rate == pytest.approx(rate) and now.own.torque == pytest.approx(torque)
    assert getattr(now.joint, flange).torque == pytest.approx(-torque) and getattr(now.joint, flange).damping == 0.0
    assert now.own.power == pytest.approx(torque * slip + size * 0.4 * rate, rel=1e-9)
    assert now.own.energy == pytest.approx(size * 1e3 * 4e-8)


FLANKED: dict[str, tuple[Effect, Callable[[Any], Any], float]] = {
    "spring": (FlexibleJoint(BENT, 2.5), lambda x: x, 1.0),
    "play": (Backlash(LOOSE, 7.0), lambda x: np.sign(x) * np.maximum(np.abs(x) - 6e-4, 0.0), 0.0),
}


@pytest.mark.parametrize(
    "twist, rate, h", [(5e-4, 0.3, 1e-3), (7.8e-4, -0.5, 6e-3), (-1.3e-3, 0.2, 2e-3), (2e-3, 0.1, 1e-4)]
)
@pytest.mark.parametrize("name", FLANKED)
def test_springs_in_a_step(name: str, twist: float, rate: float, h: float) -> None:
    """Means along the twist of the step, as sums of very many parts."""
    effect, deep, everywhere = FLANKED[name]
    torques, gear = ([0.0, 4.5, 13.0], BENT) if name == "spring" else ([0.0, 4.5, 1e3], LOOSE)
    slopes = [9e3, 1.7e4, gear.stiffness_3 or 1.7e4]
    knots = np.cumsum([0.0, *(np.diff(torques) / slopes[:2])])
    x = twist + rate * h * (np.arange(200001) + 0.5 - 100000.5) / 200001
    size = np.abs(deep(x))
    plain = np.interp(size, knots, torques) + slopes[2] * np.maximum(size - knots[-1], 0.0)
    signed = np.copysign(plain, x)
    whole = signed + effect.damping * rate * np.where(everywhere or size > 0.0, 1.0, 0.0)  # type: ignore[attr-defined]
    pushing = whole if everywhere else np.where(whole * x > 0.0, whole, 0.0)
    one = Called(effect, {"spring.wind_up": twist, "spring.speed": rate})("compute", h)("account", h)
    found = one.joint.spring
    assert found.torque == pytest.approx(pushing.mean(), abs=1e-4 * np.abs(pushing).max())
    lost = (pushing - signed).mean() * rate
    assert one.own.power == pytest.approx(lost, abs=1e-3 * abs(lost) + 1e-4 * np.abs(pushing * rate).max())
    here = float(np.abs(deep(twist)))
    lower = [slopes[k] * np.minimum(max(here - knots[k], 0.0), knots[k + 1] - knots[k]) ** 2 / 2.0 for k in range(2)]
    up = [torques[k] * np.minimum(max(here - knots[k], 0.0), knots[k + 1] - knots[k]) for k in range(2)]
    beyond = max(here - knots[2], 0.0)
    energy = sum(lower) + sum(up) + torques[2] * beyond + slopes[2] * beyond**2 / 2.0
    assert one.own.energy == pytest.approx(energy, rel=1e-9, abs=1e-12)
    if name == "play":
        assert one.own.torque == pytest.approx(found.torque)


@pytest.mark.parametrize("speed", [1e-4, 8e-3, 3.0, 700.0, -260.0])
def test_teeth_in_a_step(speed: float) -> None:
    """The mean of each sine over the rotation; of slopes those that pull back."""
    cogs, h, place = ((0.02, 12, 0.3), (0.007, 24, -0.5)), 2e-3, 0.4
    effect = Cogging(*(tuple(column) for column in zip(*cogs, strict=True)))
    one = Called(effect, {"motor.position": place, "motor.speed": speed})("compute", h)("account", h)
    torque = stiffness = energy = 0.0
    for size, order, phase in cogs:
        shares = [quad(lambda s, f=f, k=order, p=phase: f(k * (place + s * h * speed) + p), -0.5, 0.5, limit=200)[0]
                  for f in (np.sin, np.cos)]  # fmt: skip
        torque -= size * shares[0]
        stiffness += max(size * order * shares[1], 0.0)
        energy += size / order * (1.0 - math.cos(order * place + phase))
    assert one.joint.motor.torque == pytest.approx(torque, rel=1e-11)
    assert one.joint.motor.stiffness == pytest.approx(stiffness, rel=1e-11, abs=1e-12)
    assert one.own.energy == pytest.approx(energy)
    assert Cogging((0.02, 0.007), (12, 24)).table(PLACE).tolist() == [[0.02, 12.0, 0.0], [0.007, 24.0, 0.0]]


@pytest.mark.parametrize("inner, capacities", [(1.4, (7.0, 31.0)), (0.0, (38.0, None)), (1.4, (7.0, None))])
@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
def test_heat_of_steps(inner: float, capacities: tuple[float, float | None], share: float) -> None:
    """Losses that are summed up over steps, against the exponential of the network with their mean."""
    outer, ambient = 2.3, 21.0
    effect = WindingHeat(ThermalNetwork(inner, outer, *capacities, ambient), 71.0, 48.0, every=0.11, gear_heat=share)
    losses = {"heat.copper_loss": 9.0, "motor.friction_power": 3.0, "heat.viscous_power": 1.1, "heat.drag_power": 2.0,
              "mesh.power": 1.7, "heat.housing": 45.0}  # fmt: skip
    first = effect.start(PLACE, {})
    assert tuple(first) == (71.0, 48.0, 0.0, 0.0, 0.0)
    start = {"winding_temperature": 71.0, "housing_temperature": 48.0 if inner else 71.0}
    one = Called(effect, losses, start)
    own, heat = one.own, one.joint.heat
    housed = 3.0 + 1.1 - (1.0 - share) * 2.0 + share * 1.7
    if inner == 0.0:
        flow = np.array([[-1.0 / (outer * 38.0)]])
        gain, now = np.array([(9.0 + housed + ambient / outer) / 38.0]), np.array([71.0])
    else:
        cold = 0.0 if capacities[1] is None else 1.0 / capacities[1]
        flow = np.array([[-1.0 / 7.0 / inner, 1.0 / 7.0 / inner], [cold / inner, -cold / inner - cold / outer]])
        gain, now = np.array([9.0 / 7.0, cold * (housed + ambient / outer)]), np.array([71.0, 48.0])
    rate = flow @ now + gain
    one("compute")("account")
    found = own.winding_temperature_rate, own.housing_temperature_rate
    assert found == pytest.approx((rate[0], rate[-1]), rel=1e-9, abs=1e-12)
    assert (heat.winding, heat.housing) == pytest.approx((now[0], now[-1]))
    assert heat.gear == (45.0 if share > 0.0 else 0.0)  # the housing's, where the gear heats it
    # Three steps of 0.04 s: the clock of the temperatures goes on after the third.
    size = len(now)
    whole = expm(np.block([[flow, gain[:, None]], [np.zeros((1, size + 1))]]) * 0.12)
    half = expm(np.block([[flow, gain[:, None]], [np.zeros((1, size + 1))]]) * 0.08)
    for _ in range(2):
        one("accept", 0.04)
        assert (own.winding_temperature, own.housing_temperature) == (71.0, start["housing_temperature"])
        assert own.winding_temperature_rate == own.housing_temperature_rate == 0.0
    one("account")
    later = half[:size] @ [*now, 1.0]
    assert (heat.winding, heat.housing) == pytest.approx((later[0], later[-1]), rel=1e-9)
    one("accept", 0.04)
    later = whole[:size] @ [*now, 1.0]
    found = own.winding_temperature, own.housing_temperature
    assert found == pytest.approx((later[0], later[-1]), rel=1e-9)
    assert own.clock == own.copper == own.iron == 0.0
    heat.winding, heat.housing = -1.0, -2.0
    one("account", 0.04)
    assert (heat.winding, heat.housing) == (-1.0, -2.0)  # in a step they stand


@pytest.mark.parametrize("hot", ["heat.copper_loss", "motor.friction_power"])
def test_much_heat_makes_the_step_of_temperatures_shorter(hot: str) -> None:
    """A fifth of a kelvin at either node, however long the clock's own step is: 7 and 31 J/K, 100 W, 0.01 s each."""
    one = Called(WindingHeat(ThermalNetwork(1.4, 2.3, 7.0, 31.0, 21.0), every=9.0), {hot: 100.0})
    one.own.winding_temperature = one.own.housing_temperature = 21.0
    steps = 0
    while one.own.winding_temperature == one.own.housing_temperature == 21.0:
        one("accept", 0.01)
        steps += 1
    assert steps == (2 if hot == "heat.copper_loss" else 7)
    alone = Called(WindingHeat(ThermalNetwork(0.0, 2.3, 7.0, None, 21.0), every=9.0), {hot: 100.0})
    assert alone.own.most_copper == alone.own.most_iron == pytest.approx(1.4)
    assert alone.effect.time_scales(PLACE)[0].seconds == pytest.approx(16.1)
    usual = Called(WindingHeat(ThermalNetwork(1.4, 2.3, 7.0, 31.0, 21.0)), {})
    assert usual.own.period == pytest.approx(9.8 / 200.0)
    assert usual.effect.start(PLACE, {}) == (21.0, 21.0, 0.0, 0.0, 0.0)


# --- slopes

SLOPED: dict[str, tuple[Effect, dict[str, float], str]] = {
    "viscous": (ViscousFriction(Friction(viscous=0.3, viscous_negative=0.7)), {"load.speed": 0.4}, "load"),
    "viscous backward": (ViscousFriction(Friction(viscous=0.3, viscous_negative=0.7)), {"load.speed": -0.4}, "load"),
    "smooth": (ViscousFriction(SMOOTH, "motor"), {"motor.speed": 0.06}, "motor"),
    "smooth backward": (ViscousFriction(SMOOTH), {"load.speed": -0.03}, "load"),
    "wall": (WallSpring(30.0, 1.3, 0.05, -0.4), {"load.position": 0.2, "load.speed": 0.7}, "load"),
    "spring": (FlexibleJoint(BENT, 2.5), {"spring.wind_up": 6e-4, "spring.speed": 0.01}, "spring"),
    "flanks": (Backlash(LOOSE, 7.0), {"spring.wind_up": 9e-4, "spring.speed": -0.01}, "spring"),
    "position loop": (PositionLoop(2e4, 60.0, K), {"motor.position": 0.3, "motor.speed": 2.0}, "pin"),
    "cascade": (CascadeLoop(25.0, 0.4), {"motor.position": 0.3, "motor.speed": 2.0}, "pin"),
}


@pytest.mark.parametrize("h", [0.0, 2e-3])
@pytest.mark.parametrize("name", SLOPED)
def test_slopes_are_those_of_the_law(name: str, h: float) -> None:
    """At an instant by speed and by place; in a step by the speed in its middle, with which the place moves."""
    effect, numbers, where = SLOPED[name]
    flange = "motor" if where == "pin" else where
    place = f"{flange}.wind_up" if flange == "spring" else f"{flange}.position"

    def found(spin: float, turn: float) -> Any:
        moved = dict(numbers)
        moved[f"{flange}.speed"] = numbers[f"{flange}.speed"] + spin
        moved[place] = numbers.get(place, 0.0) + turn
        return getattr(Called(effect, moved)("compute", h, 0.2).joint, where)

    def value(of: Any) -> float:
        return float(of.command if where == "pin" else -of.torque if where == "spring" else of.torque)

    here, small = found(0.0, 0.0), 1e-6
    by_spin = (value(found(small, 0.5 * h * small)) - value(found(-small, -0.5 * h * small))) / (2.0 * small)
    assert here.damping + 0.5 * h * here.stiffness == pytest.approx(-by_spin, rel=1e-6, abs=1e-9)
    if h == 0.0:
        by_turn = (value(found(0.0, small)) - value(found(0.0, -small))) / (2.0 * small)
        assert here.stiffness == pytest.approx(-by_turn, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("depth, rate, h", [(3e-3, 0.2, 0.0), (3e-3, 0.2, 1e-3), (3e-4, 1.1, 1e-3), (-3e-3, 0.2, 1e-3),
                                            (1e-3, -0.9, 1e-3)])  # fmt: skip
def test_the_force_of_a_wall_is_along_its_normal_and_so_are_its_slopes(depth: float, rate: float, h: float) -> None:
    one = Called(WALL, {}, world=at_depth(depth, rate))("compute", h)("account", h)
    x = depth + rate * h * (np.arange(200001) + 0.5 - 100000.5) / 200001
    pushes = np.where(x > 0.0, np.maximum(5e3 * x + 130.0 * rate, 0.0), 0.0)
    tip, force = one.world.tip, pushes.mean()
    np.testing.assert_allclose(tip.force, force * NORMAL, rtol=1e-4, atol=1e-6)
    assert one.own.force == pytest.approx(float(tip.force @ NORMAL), rel=1e-12)
    assert one.own.energy == pytest.approx(2.5e3 * max(depth, 0.0) ** 2, rel=1e-9, abs=1e-15)

    def at(more: float) -> float:
        moved = at_depth(depth + 0.5 * h * more, rate + more)
        return float(NORMAL @ Called(WALL, {}, world=moved)("compute", h).world.tip.force)

    steep = (at(1e-6) - at(-1e-6)) / 2e-6
    outer = [NORMAL[i] * NORMAL[j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
    np.testing.assert_allclose(tip.damping + 0.5 * h * tip.stiffness, steep * np.array(outer), rtol=1e-6, atol=1e-7)
    if h == 0.0:
        np.testing.assert_allclose(tip.stiffness, 5e3 * np.array(outer), rtol=1e-12)


# --- bounds of dry friction


@pytest.mark.parametrize("speed", [0.0, 0.2, -0.3])
@pytest.mark.parametrize("side", ["joint", "motor", "shaft"])
def test_bounds_of_dry_friction(side: Any, speed: float) -> None:
    law = Friction(coulomb=0.7, coulomb_negative=0.5, static=1.1, stribeck_speed=0.4, stribeck_exponent=1.5)
    flange, bounded = {"joint": ("load",) * 2, "motor": ("motor",) * 2, "shaft": ("shaft", "load")}[side]
    before = {"slide_forward": 2.0, "slide_backward": 3.0, "hold_forward": 4.0, "hold_backward": 5.0}
    moving = {f"{flange}.speed": speed + 0.1, f"{bounded}.surface_speed": 0.1}
    moving |= {f"{bounded}.{name}": value for name, value in before.items()}
    found = getattr(Called(DryFriction(law, side), moving, place=COUPLED)("compute").joint, bounded)
    left = math.exp(-((abs(speed) / 0.4) ** 1.5))
    slid = 0.7 + 0.4 * left if speed > 0.0 else 1.1, 0.5 + 0.6 * left if speed < 0.0 else 1.1
    assert (found.slide_forward, found.slide_backward) == pytest.approx((2.0 + slid[0], 3.0 + slid[1]))
    assert (found.hold_forward, found.hold_backward) == pytest.approx((5.1, 6.1))
    plain = Called(DryFriction(Friction(coulomb=0.7, static=1.1), side), moving, place=COUPLED)("compute")
    assert getattr(plain.joint, bounded).slide_forward == pytest.approx(2.7)


def test_a_brake_is_engaged_from_its_command_and_delay_on() -> None:
    brake = HoldingBrake(0.8, None, (0.3, 0.9), (0.6,), 0.05, 0.02, True)
    assert list(brake.breakpoints()) == pytest.approx([0.35, 0.62, 0.95])
    for t, engaged in ((0.0, True), (0.34, True), (0.61, True), (0.63, False), (0.94, False), (0.96, True)):
        motor = Called(brake, {"motor.hold_forward": 0.1, "motor.slide_backward": 0.1})("compute", 0.0, t).joint.motor
        held = (motor.hold_forward, motor.hold_backward, motor.slide_forward, motor.slide_backward)
        on = 1.0 if engaged else 0.0
        assert held == pytest.approx((0.1 + 0.8 * on, 0.8 * on, 0.6 * on, 0.1 + 0.6 * on)), t
    assert Called(HoldingBrake(0.8, 0.5), {}).own.sliding == 0.5


def test_drag_of_a_gear() -> None:
    gear = Gear(
        "d", 50.0, mesh_efficiency=0.8, drag_torque=0.01, drag_speed=200.0, drag_speed_exponent=0.7,
        drag_temperature_1=0.04, drag_temperature_2=4e-4, seal_drag_torque=0.004, starting_torque=0.03,
    )  # fmt: skip
    for effect, warm in ((GearDrag(gear), 33.0), (GearDrag(gear, 5.0, False), 5.0)):
        for speed in (130.0, -130.0):
            known = {"motor.speed": speed, "motor.hold_forward": 0.1, "motor.slide_backward": 0.2, "heat.gear": 33.0}
            one = Called(effect, known)("compute", 1e-3)
            drag = 0.01 * 0.65**0.7 * math.exp((4e-4 * (warm - 20.0) - 0.04) * (warm - 20.0)) + 0.004
            motor = one.joint.motor
            assert (motor.slide_forward, motor.slide_backward) == pytest.approx((drag, 0.2 + drag))
            assert (motor.hold_forward, motor.hold_backward) == pytest.approx((0.13, 0.03))
            # No more than all dry friction there, which is less where the motor comes to rest within the step.
            for friction, share in ((9.0, 130.0 * drag), (0.5, 0.5), (-0.5, 0.0)):
                motor.friction_power = friction
                assert one("account", 1e-3).joint.heat.drag_power == pytest.approx(share)
    easy = replace(gear, drag_speed_exponent=0.0, seal_drag_torque=None, starting_torque=None)
    free = Called(GearDrag(easy), {"heat.gear": 20.0})
    assert free("compute").joint.motor.hold_forward == pytest.approx(0.01)
    loss = Called(MeshLoss(gear), {"mesh.driving": 0.1, "mesh.driven": 0.2})("compute").joint.mesh
    assert (loss.driving, loss.driven) == pytest.approx((0.1 + 0.25, 0.2 + 1.0 - (2.0 - 1.0 / 0.8)))


def test_levers_and_their_table() -> None:
    both = replace(LEVERS, angles=(-0.5, 0.0, 0.9), torques=(-1.0, 0.2, 0.5))
    for angle in (-0.3, 0.6):
        one = Called(CounterbalanceTorque(both), {"load.position": angle, "load.speed": 2.0, "load.torque": 1.0})
        length = math.sqrt(0.2**2 + 0.15**2 - 0.06 * math.cos(angle - 0.3))
        torque = 0.7 - 800.0 * (length - 0.1) * 0.03 * math.sin(angle - 0.3) / length
        torque += 0.2 + (1.2 / 0.5 if angle < 0.0 else 0.3 / 0.9) * angle
        one("compute")("account")
        assert one.joint.load.torque == pytest.approx(1.0 + torque) and one.own.power == pytest.approx(2.0 * torque)


def test_belts_pushes_and_voltages() -> None:
    belt = Called(MovingBelt(-0.3), {"load.surface_speed": 0.1, "load.friction": 4.0})("compute")("account")
    assert belt.joint.load.surface_speed == pytest.approx(-0.2) and belt.own.power == pytest.approx(1.2)
    push = GivenTorque(np.array([0.0, 0.4, 0.4, 0.9]), np.array([1.0, 2.0, -3.0, -1.0]), "shaft")
    assert list(push.breakpoints()) == [0.0, 0.4, 0.9]
    given = GivenVoltage(push.time, push.torque)
    for t, value in ((-1.0, 1.0), (0.1, 1.25), (0.4, -3.0), (0.65, -2.0), (7.0, -1.0)):
        on = Called(push, {"shaft.torque": 0.5, "shaft.speed": 3.0}, place=COUPLED)("compute", t=t)("account", t=t)
        assert on.joint.shaft.torque == pytest.approx(0.5 + value) and on.own.power == pytest.approx(3.0 * value)
        assert Called(given, {"pin.voltage": 9.0})("compute", 0.0, t).joint.pin.voltage == pytest.approx(value)
    assert list(given.breakpoints()) == [0.0, 0.4, 0.9]
    assert Place(0, "a", ("a",), (3.0,), (True,)).coupled is False
