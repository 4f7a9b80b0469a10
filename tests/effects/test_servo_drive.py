"""A servo drive against its equations written out: cascade, current loop, voltage, gear spring, wall and heat."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import CascadeLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene
from drivetrain.solvers.solver import Rodas5P

R, L, K, RATIO, ROTOR, LOAD, WEIGHT = 0.4, 3e-4, 0.05, -30.0, 4e-5, 0.05, 1.5
OUTER, INNER, INTEGRAL, PEAK, BAND, FED = 40.0, 0.3, 0.02, 12.0, 1500.0, 0.6
STIFF, DAMPED, SHAFT, WALL, AIR = 4000.0, 2.0, 3e-5, 60.0, 20.0
END = 0.03
NETWORK = ThermalNetwork(1.5, 3.0, 0.4, 2.0, AIR)
MOTOR = Motor("m", R, K, inductance=L, magnet_coefficient=-0.002, reference_temperature=AIR)
TIME = np.linspace(0.0, END, 31)
U, WAY = TIME / END, 0.08


def wanted(t: float) -> tuple[float, float]:
    u = t / END
    return WAY * u * u * (3.0 - 2.0 * u), WAY * 6.0 * u * (1.0 - u) / END


COMMAND = Motion(
    "m", ("joint",), TIME, *(np.array(x)[:, np.newaxis] for x in (
        WAY * U**2 * (3.0 - 2.0 * U), WAY * 6.0 * U * (1.0 - U) / END, WAY * (6.0 - 12.0 * U) / END**2
    ))
)  # fmt: skip


def written_out(volts: float, first: dict[str, float], times: np.ndarray) -> np.ndarray:
    """Position and speed of link and motor, current, both integrators, winding and housing."""

    def rates(t: float, y: Any) -> list[float]:
        q, v, turn, spin, current, asked, held, winding, housing = y
        place, speed = wanted(t)
        error = RATIO * speed + OUTER * RATIO * place - OUTER * RATIO * turn - RATIO * spin
        asked_rate = INNER * error / INTEGRAL
        demanded = INNER * error + asked
        beyond = abs(demanded) - PEAK
        if beyond > 0.0:
            demanded = math.copysign(PEAK, demanded)
            if demanded * error > 0.0:
                asked_rate *= max(1.0 - beyond / (1e-3 * PEAK), 0.0)
        kp, ki, fast = L * BAND, R * BAND, RATIO * spin
        asks = kp * (demanded - current) + held + FED * K * fast
        given = min(max(asks, -volts), volts)
        r = R * (1.0 + 0.0039 / (1.0 + 0.0039 * (AIR - 25.0)) * (winding - AIR))
        k = K * (1.0 - 0.002 * (housing - AIR))
        current_rate = (given - r * current - k * fast) / L
        held_rate = ki * (demanded - current) + (given - asks) * ki / kp
        carried = STIFF * (turn - q) + DAMPED * (spin - v)
        link = carried - WEIGHT * math.cos(q) - WALL * (q - 0.01)
        shaft = RATIO * (k * current - SHAFT * fast) - carried
        through, out = (winding - housing) / 1.5, (housing - AIR) / 3.0
        return [
            v, link / LOAD, spin, shaft / (RATIO**2 * ROTOR), current_rate, asked_rate, held_rate,
            (r * current**2 - through) / 0.4, (through - out + SHAFT * fast**2) / 2.0,
        ]  # fmt: skip

    begin = [
        first["position"], 0.0, first["position"] + first["deflection"], 0.0, first["current"],
        first["integrated_current"], first["integrated_voltage"], first["winding_temperature"],
        first["housing_temperature"],
    ]  # fmt: skip
    return solve_ivp(rates, (0.0, END), begin, method="LSODA", t_eval=times, rtol=1e-10, atol=1e-12, max_step=1e-4).y


@pytest.mark.parametrize("volts", [60.0, 6.0], ids=["free", "at its voltage"])
def test_a_servo_drive_is_its_equations(volts: float) -> None:
    effects = [
        FullRotor(ROTOR, RATIO), CurrentLoop(MOTOR, BAND, fed_forward=FED), StiffSupply(1.25 * volts, 0.8),
        CommandedMotion(COMMAND), CascadeLoop(OUTER, INNER, INTEGRAL, PEAK), WallSpring(WALL, rest=0.01),
        FlexibleJoint(Gear("g", RATIO, stiffness_1=STIFF), DAMPED), ViscousFriction(Friction(viscous=SHAFT), "motor"),
        WindingHeat(NETWORK, 60.0, 35.0, 1e-3, 1.0),
    ]  # fmt: skip
    scene = joint_scene(Inertia(LOAD, weight=WEIGHT), effects, END)
    engines = AdaptiveStep(Rodas5P(1e-7)), FixedStep(1e-4)
    for engine, allowed in zip(engines, (1e-6, 1e-3), strict=True):
        run = simulate(scene, solver=engine, interval=1e-3)
        told = {name.removeprefix("joint."): one.values for name, one in run.series.items() if name[:6] == "joint."}
        exact = written_out(volts, {name: float(one[0]) for name, one in told.items()}, run.time)
        found = (
            told["position"], told["speed"], told["position"] + told["deflection"], told["motor_speed"] / RATIO,
            told["current"], told["integrated_current"], told["integrated_voltage"], told["winding_temperature"],
            told["housing_temperature"],
        )  # fmt: skip
        for name, one, other in zip("q v turn spin i asked held winding housing".split(), found, exact, strict=True):
            # A fixed step is of first order where an integrator comes to its limit.
            most = 20.0 * allowed if name == "asked" else allowed
            assert np.abs(one - other).max() < most * np.ptp(other), (engine, name)
    assert np.abs(told["current"]).max() > 0.8 * PEAK
    assert (np.abs(told["voltage"]) > 0.99 * volts).any() == (volts < 20.0)
