"""Every sum that effects make at an instant, from what a run records and formulas written out: two engines, one joint.

The rates that engines follow are these sums, so nothing here rests on how a step is made.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene

ENGINES = [AdaptiveStep(), FixedStep(1e-3)]
MOTOR = Motor("m", 0.3, 0.03, magnet_coefficient=-0.002, reference_temperature=25.0)
GEAR = Gear(
    "d", 50.0, mesh_efficiency=1.0, drag_torque=0.01, drag_speed=200.0, drag_speed_exponent=0.7,
    drag_temperature_1=0.04, drag_temperature_2=4e-4, seal_drag_torque=0.004, starting_torque=0.03,
)  # fmt: skip
NETWORK = ThermalNetwork(1.5, 0.5, 4.0, 6.0, 25.0)
DURATION = 0.1
TIME = np.linspace(0.0, DURATION, 51)
CURRENT, GIVEN = 20.0 * np.cos(2.0 * np.pi * TIME / DURATION), 0.6 * np.cos(90.0 * TIME)
JOINT = Friction(
    coulomb=0.7, coulomb_negative=0.5, viscous=0.2, viscous_negative=0.3, static=1.1, stribeck_speed=0.4
)  # fmt: skip
SHAFT = Friction(coulomb=0.01, viscous=1e-5, static=0.02, stribeck_speed=30.0, stribeck_exponent=1.4)
SMOOTH = Friction(coulomb=0.4, viscous=0.1, coulomb_negative=0.6, viscous_negative=0.15, tanh_speed=0.05)
BELT, WALL = 0.3, WallSpring(30.0, 1.3, rest=0.05, speed=-0.4)
COGS = np.array([(0.01, 12, 0.3), (0.004, 24, -0.5)])
LEVERS = Counterbalance(800.0, 0.1, lever_carrier=0.2, lever_link=0.15, dead_centre=0.3, torque=0.7)
CABLES = Counterbalance(angles=(-0.5, 0.0, 0.4), torques=(-1.0, 0.2, 0.5))


def run_of(engine: Any, *effects: Any) -> Any:
    motor = (ReflectedRotor(3e-5, 50.0), MotorCurrent(MOTOR), GivenCurrent(TIME, CURRENT))
    found = simulate(joint_scene(Inertia(0.3, weight=2.0), [*motor, *effects], DURATION), solver=engine, interval=2e-3)
    assert (found["joint.speed"] > 0.1).any() and (found["joint.speed"] < -0.1).any()
    return found


def told(run: Any, *names: str) -> list[np.ndarray]:
    return [np.asarray(run[f"joint.{name}"]) for name in names]


def holds(found: np.ndarray, expected: Any, rtol: float = 1e-10) -> None:
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=rtol * np.abs(expected).max() + 1e-12)


def dry(law: Friction, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds forward and backward: static at rest and against the motion, else what is left of it."""
    back, static, fall = law.coulomb_negative or law.coulomb, law.static, law.stribeck_speed
    left = np.exp(-(np.abs(speed / fall) ** law.stribeck_exponent))
    forward = np.where(speed > 0.0, law.coulomb + (static - law.coulomb) * left, static)
    return forward, np.where(speed < 0.0, back + (static - back) * left, static)


@pytest.mark.parametrize("engine", ENGINES)
def test_what_resists_and_pulls_the_link(engine: Any) -> None:
    run = run_of(engine, DryFriction(JOINT), ViscousFriction(JOINT), MovingBelt(BELT), WALL)
    t, q, v = run.time, *told(run, "position", "speed")
    sticks = run["joint.joint_friction"]
    viscous = np.where(v >= 0.0, 0.2, 0.3)
    stretch, parting = q - 0.05 + 0.4 * t, v + 0.4
    holds(run["joint.joint_torque"], -viscous * v - 30.0 * stretch - 1.3 * parting)
    holds(run["joint.joint_damping"], viscous + 1.3)
    holds(run["joint.joint_stiffness"], np.full(len(t), 30.0))
    holds(run["joint.joint_viscous_power"], viscous * v * v)
    holds(run["joint.wall_spring_energy"], 15.0 * stretch**2)
    holds(run["joint.wall_damping_power"], 1.3 * parting**2)
    holds(run["joint.wall_power"], 0.4 * (30.0 * stretch + 1.3 * parting))
    holds(run["joint.belt_power"], -BELT * sticks)
    forward, backward = dry(JOINT, v - BELT)
    holds(run["joint.joint_slide_forward"], forward)
    holds(run["joint.joint_slide_backward"], backward)
    sliding = np.abs(v - BELT) > 1e-6
    holds(sticks[sliding], np.where(v > BELT, forward, -backward)[sliding])


@pytest.mark.parametrize("engine", ENGINES)
def test_what_resists_and_pulls_the_shaft(engine: Any) -> None:
    run = run_of(
        engine, WALL, DryFriction(SHAFT, "motor"), ViscousFriction(SHAFT, "motor"), Cogging(*map(tuple, COGS.T)),
        GivenTorque(TIME, GIVEN, "motor"), GearDrag(GEAR), WindingHeat(NETWORK, 30.0, 28.0, every=1e-3, gear_heat=0.6),
    )  # fmt: skip
    t, turned, spin = run.time, *told(run, "motor_position", "motor_speed")
    current, housing, winding = told(run, "current", "housing_temperature", "winding_temperature")
    late = 1e-10 if isinstance(engine, AdaptiveStep) else 1e-4  # of fixed steps the temperatures' are longer
    constant = 0.03 * (1.0 - 0.002 * (housing - 25.0))
    size, order, phase = COGS[:, :1], COGS[:, 1:2], COGS[:, 2:]
    angle, push = order * turned + phase, np.interp(t, TIME, GIVEN)
    cogs = (size * np.sin(angle)).sum(axis=0)
    holds(run["joint.motor_torque"], constant * current - 1e-5 * spin - cogs + push, late)
    holds(run["joint.motor_stiffness"], np.maximum(size * order * np.cos(angle), 0.0).sum(axis=0))
    holds(run["joint.cogging_energy"], (size / order * (1.0 - np.cos(angle))).sum(axis=0))
    holds(run["joint.given_motor_power"], push * spin)
    holds(run["joint.motor_viscous_power"], 1e-5 * spin * spin)
    holds(run["joint.copper_loss"], 0.3 * (1.0 + 0.0039 * (winding - 25.0)) * current**2, late)

    above = np.clip(housing, -10.0, 40.0) - 20.0
    drag = 0.01 * (np.abs(spin) / 200.0) ** 0.7 * np.exp((4e-4 * above - 0.04) * above) + 0.004
    forward, backward = dry(SHAFT, spin)
    turning = np.abs(spin) > 1e-6
    holds(run["joint.motor_slide_forward"][turning], (forward + drag)[turning], late)
    holds(run["joint.motor_slide_backward"][turning], (backward + drag)[turning], late)
    holds(run["joint.motor_hold_forward"], np.full(len(t), 0.02 + 0.03))
    holds(run["joint.motor_hold_backward"], np.full(len(t), 0.02 + 0.03))
    holds(run["joint.gear_drag_power"][turning], (drag * np.abs(spin))[turning], late)


@pytest.mark.parametrize("engine", ENGINES)
def test_smooth_friction_bristles_and_counterbalances(engine: Any) -> None:
    run = run_of(
        engine, ViscousFriction(SMOOTH), LuGreFriction(2e3, 0.02, 0.03, 20.0, 0.05, 1e-4, "motor"),
        CounterbalanceTorque(LEVERS, 1), CounterbalanceTorque(CABLES, 2), GivenTorque(TIME, GIVEN),
    )  # fmt: skip
    t, q, v, spin, current = run.time, *told(run, "position", "speed", "motor_speed", "current")
    ahead = v >= 0.0
    coulomb, viscous = np.where(ahead, 0.4, 0.6), np.where(ahead, 0.1, 0.15)
    friction = coulomb * np.tanh(v / 0.05) + viscous * v
    length = np.sqrt(0.2**2 + 0.15**2 - 2.0 * 0.2 * 0.15 * np.cos(q - 0.3))
    levers = 0.7 - 800.0 * (length - 0.1) * 0.2 * 0.15 * np.sin(q - 0.3) / length
    cables, push = np.interp(q, CABLES.angles, CABLES.torques), np.interp(t, TIME, GIVEN)
    holds(run["joint.joint_torque"], levers + cables + push - friction)
    holds(run["joint.joint_damping"], viscous + coulomb / 0.05 / np.cosh(np.minimum(np.abs(v) / 0.05, 300.0)) ** 2)
    holds(run["joint.joint_viscous_power"], friction * v)
    holds(run["joint.counterbalance_1_power"], levers * v)
    holds(run["joint.counterbalance_2_power"], cables * v)
    holds(run["joint.given_joint_power"], push * v)

    bend = run["joint.motor_bristle_bend"]
    rate = spin - 2e3 * np.abs(spin) * bend / (0.02 + 0.01 * np.exp(-((spin / 20.0) ** 2)))
    torque = 2e3 * bend + 0.05 * rate + 1e-4 * spin
    scale = 0.05 * np.abs(spin).max()  # the rate is a small difference of large numbers
    np.testing.assert_allclose(run["joint.motor_torque"], 0.03 * current - torque, rtol=0.0, atol=1e-10 * scale + 1e-12)
    np.testing.assert_allclose(run["joint.motor_lugre_torque"], torque, rtol=0.0, atol=1e-10 * scale + 1e-12)
    lost = torque * spin - 2e3 * bend * rate
    np.testing.assert_allclose(run["joint.motor_lugre_power"], lost, rtol=1e-9, atol=1e-9 * np.abs(lost).max())
    holds(run["joint.motor_bristle_energy"], 1e3 * bend**2)


@pytest.mark.parametrize("engine", ENGINES)
def test_heat_that_comes_is_kept_or_leaves(engine: Any) -> None:
    """dT = (what came - what left)/C at both nodes, from the losses that are recorded; one node where both are one."""
    brush = ViscousFriction(SHAFT, "motor")
    for inner, more in ((1.5, ()), (0.0, ()), (1.5, (GearDrag(GEAR),))):
        run = run_of(
            engine, brush, *more, WindingHeat(ThermalNetwork(inner, 0.5, 4.0, 6.0, 25.0), 30.0, 30.0, 1e-3, 0.6)
        )
        t, copper, winding, housing = run.time, *told(run, "copper_loss", "winding_temperature", "housing_temperature")
        friction = run["joint.motor_viscous_power"] + (0.6 * run["joint.gear_drag_power"] if more else 0.0)

        def passed(power: np.ndarray, t: np.ndarray = t) -> float:
            return float(np.trapezoid(power, t))

        out, through = passed(housing - 25.0) / 0.5, passed(winding - housing) / inner if inner else 0.0
        # Rectangles of the recorded 10 ms; fixed steps of the temperatures are 1 ms.
        if inner:
            assert 4.0 * np.ptp(winding[[0, -1]]) == pytest.approx(abs(passed(copper) - through), rel=5e-3)
            assert 6.0 * (housing[-1] - housing[0]) == pytest.approx(passed(friction) + through - out, rel=0, abs=5e-3)
        else:
            assert winding == pytest.approx(housing)
            gained = 4.0 * (winding[-1] - winding[0])
            assert gained == pytest.approx(passed(copper) + passed(friction) - out, rel=5e-3)


def test_a_rigid_joint_on_a_belt_has_no_friction_behind_its_gear() -> None:
    """Its motor would be braked along with the belt, and driven where that runs ahead of it."""
    scene = joint_scene(Inertia(0.3), [ReflectedRotor(3e-5, 50.0), MovingBelt(BELT), DryFriction(SHAFT, "motor")], 1.0)
    with pytest.raises(InputError, match="rubs behind the gear of a rigid joint"):
        simulate(scene)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_brake_bounds_while_it_is_engaged(engine: Any) -> None:
    run = run_of(engine, WALL, HoldingBrake(0.04, None, (0.2, 0.7), (0.5,), 0.05, 0.1))
    t = run.time
    engaged = ((t > 0.25) & (t < 0.6)) | (t > 0.75)
    apart = np.abs(t[:, None] - [0.25, 0.6, 0.75]).min(axis=1) > 1e-6
    for bound, size in (("hold", 0.04), ("slide", 0.03)):
        for way in ("forward", "backward"):
            holds(run[f"joint.motor_{bound}_{way}"][apart], size * engaged[apart])
