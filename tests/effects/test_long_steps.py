"""What is linear follows the midpoint rule exactly, however long the fixed step: slopes and crosswise ones are whole.

    x' - x = h (v + v') / 2,    M (v' - v) = h (f - K (x + x') / 2 - D (v + v') / 2)

A slope that is missing, or stands in the wrong place, leaves a residual here; at short steps nobody would see it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene

H, RATIO, KT, ROTOR = 0.02, -50.0, 0.03, 3e-5
M = 0.5 + ROTOR * RATIO**2
HOLD = CommandedMotion(Motion("hold", ("joint",), np.array([0.0, 2.0]), np.full((2, 1), 0.2), *np.zeros((2, 2, 1))))
MOTOR = MotorCurrent(Motor("m", 0.3, KT))
WALL = np.array([-2.0, 1.0, 0.5]) / 5.25**0.5


def link(*effects: Any) -> Any:
    return joint_scene(Inertia(0.5), [ReflectedRotor(ROTOR, RATIO), *effects], 1.0, position=0.3, speed=-0.7)


def sliders() -> Any:
    """Masses of 1, 2 and 3 kg, one on another, that slide along x, y and z; the last presses into a skew wall."""
    home, screws = np.tile(np.eye(4), (3, 1, 1)), np.hstack([np.zeros((3, 3)), np.eye(3)])
    arm = dt.Arm.from_screws(
        home, screws, [1.0, 2.0, 3.0], [np.eye(3) * 1e-3] * 3, tip=np.eye(4), gravity=(0.0, 0.0, 0.0)
    )
    pushes = {name: (GivenTorque([0.0], [400.0 * way]),) for name, way in zip(arm.joint_names, -WALL, strict=True)}
    wall = TipContact((0.0, 0.0, 0.0), tuple(WALL), 6e4, 80.0)
    return Scene(arm, pushes | {"scene": (wall,)}, 1.0, position=tuple(-0.01 * WALL))


# Scene, mass, damping, stiffness, and the force as a function of time.
CASES = {
    "walls and friction": (
        link(
            WallSpring(3e4, 40.0, 0.1, -0.2), ViscousFriction(Friction(viscous=9.0)),
            ViscousFriction(Friction(viscous=2e-3), "motor"), GivenTorque([0.0, 1.0], [2.0, 5.0]),
            GivenTorque([0.0, 1.0], [0.3, 0.1], "motor"),
        ),
        M, 49.0 + 2e-3 * RATIO**2, 3e4,
        lambda t: 3e4 * (0.1 - 0.2 * t) - 40.0 * 0.2 + 2.0 + 3.0 * t + RATIO * (0.3 - 0.2 * t),
    ),
    "position loop": (
        link(MOTOR, HOLD, PositionLoop(2e4, 60.0, KT)), M, 60.0, 2e4, lambda t: 2e4 * 0.2,
    ),
    "computed torque": (
        link(MOTOR, HOLD, ComputedTorque(90.0, (("joint", KT),))), 1.0, 180.0, 90.0**2, lambda t: 90.0**2 * 0.2,
    ),
    "skew wall": (
        sliders(), np.diag([6.0, 5.0, 3.0]), 80.0 * np.outer(WALL, WALL), 6e4 * np.outer(WALL, WALL),
        lambda t: -400.0 * WALL,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_step_is_the_midpoint_rule(name: str) -> None:
    scene, mass, damping, stiffness, force = CASES[name]
    run = simulate(scene, solver=FixedStep(H), interval=H)
    assert len(run.time) == 51
    x, v = (np.stack([run[f"{joint}.{what}"] for joint in scene.joints], axis=1) for what in ("position", "speed"))
    residual(run.time, x, v, mass, damping, stiffness, force)


def residual(time: Any, x: Any, v: Any, mass: Any, damping: Any, stiffness: Any, force: Any) -> None:
    x_mid, v_mid, t_mid = (0.5 * (one[1:-1] + one[2:]) for one in (x, v, time))  # not the first step, which calms
    n = x.shape[1]
    f = np.array([np.broadcast_to(force(t), n) for t in t_mid])
    mass, damping, stiffness = (one * np.eye(n) if np.ndim(one) == 0 else one for one in (mass, damping, stiffness))
    asked = f - x_mid @ stiffness.T - v_mid @ damping.T
    np.testing.assert_allclose(np.diff(x[1:], axis=0), H * v_mid, rtol=0.0, atol=1e-12 * np.abs(x).max())
    scale = np.abs(f).max() + np.abs(x_mid @ stiffness.T).max() + np.abs(v_mid @ damping.T).max()
    np.testing.assert_allclose(np.diff(v[1:], axis=0) @ mass.T / H, asked, rtol=0.0, atol=1e-10 * scale)
