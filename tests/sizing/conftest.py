"""Small studies built directly, without files: one axis from a table, and planar arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.model import DriveMass, JointTask, Mount, Payload, Safety, Stop, Study

MOTOR = Motor(
    "m1", resistance=0.3, torque_constant=0.05, inductance=2e-4, rotor_inertia=2e-5, mass=0.5, nominal_voltage=48.0,
    no_load_current=0.2, no_load_speed=950.0, nominal_current=6.0, peak_current=30.0, max_speed=1200.0,
    resistance_winding_housing=1.0, resistance_housing_ambient=4.0, winding_time_constant=20.0,
    housing_time_constant=800.0, max_winding_temperature=125.0, price=100.0,
)  # fmt: skip
GEAR = Gear(
    "g1", 50.0, kind="planetary", efficiency=0.8, inertia=1e-6, mass=0.4, continuous_torque=20.0,
    average_torque_limit=20.0, repeated_peak_torque=40.0, momentary_torque=80.0, max_input_speed=1000.0,
    average_input_speed_limit=600.0, rated_speed=300.0, rated_life=3.6e7, tilting_moment_limit=300.0,
    axial_load_limit=500.0, radial_load_limit=600.0, price=80.0,
)  # fmt: skip


def table_cycle(time: Any, torque: Any, speed: Any, acceleration: Any) -> Cycle:
    """A cycle of given torque and speed; (N,) for one joint or (N, n)."""
    columns = [np.asarray(x, dtype=float).reshape(len(time), -1) for x in (torque, speed, acceleration)]
    n = columns[0].shape[1]
    zeros = np.zeros(len(time), dtype=int)
    return Cycle(
        tuple(f"j{i + 1}" for i in range(n)), np.asarray(time, dtype=float), np.zeros((len(time), n)), columns[1],
        columns[2], columns[0], zeros - 1, (), zeros, ("table",),
    )  # fmt: skip


def arm_cycle(time: Any, q: Any, qd: Any, qdd: Any, payload: Any = None, names: Sequence[str] = ()) -> Cycle:
    """A cycle of positions, each (N, n)."""
    n = np.shape(q)[1]
    samples = len(time)
    carried = np.full(samples, -1) if payload is None else np.asarray(payload)
    return Cycle(
        tuple(f"j{i + 1}" for i in range(n)), np.asarray(time, dtype=float), np.asarray(q, dtype=float),
        np.asarray(qd, dtype=float), np.asarray(qdd, dtype=float), None, carried, tuple(names),
        np.zeros(samples, dtype=int), ("motion",),
    )  # fmt: skip


def sines(n: int, samples: int = 101, duration: float = 2.0, size: float = 1.0) -> Cycle:
    """A smooth closed motion of n joints, each with its own phase and size."""
    time = np.linspace(0.0, duration, samples)
    rate = 2.0 * np.pi / duration
    phase = np.arange(n)[np.newaxis, :] * 0.7
    amplitude = size / (1.0 + np.arange(n)[np.newaxis, :])
    angle = rate * time[:, np.newaxis] + phase
    return arm_cycle(
        time, amplitude * np.sin(angle), amplitude * rate * np.cos(angle), -amplitude * rate**2 * np.sin(angle)
    )


def planar_arm(lengths: Sequence[float], masses: Sequence[float], gravity: float = 9.81) -> Arm:
    """Revolute joints about y (gravity along -z) with point-like links at their ends, stretched along x at zero."""
    n = len(lengths)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    home, screws = np.tile(np.eye(4), (n, 1, 1)), np.zeros((n, 6))
    points = np.zeros((n, 3))
    for i in range(n):
        home[i, 0, 3] = starts[i + 1]
        points[i, 0] = starts[i]
        # Axis -y, so that positive angles lift the arm.
        screws[i] = [0.0, -1.0, 0.0, *np.cross(points[i], [0.0, -1.0, 0.0])]
    tip = np.eye(4)
    tip[0, 3] = starts[-1]
    return Arm.from_screws(
        home, screws, np.asarray(masses, dtype=float), np.tile(1e-4 * np.eye(3), (n, 1, 1)), tip=tip,
        gravity=(0.0, 0.0, -gravity), joint_points=points, joint_names=[f"j{i + 1}" for i in range(n)],
    )  # fmt: skip


def task(name: str = "j1", **changes: Any) -> JointTask:
    """A joint with the first motor and gear given."""
    plain = JointTask(
        name, ("m1", "g1"), (), (), Mount(), None, Friction(), None,
        Amplifier(peak_current=40.0, continuous_current=20.0), stop=Stop(ramp=1.0),
    )  # fmt: skip
    return replace(plain, **changes)


def study(cycle: Cycle, arm: Arm | None = None, **changes: Any) -> Study:
    """A study of a cycle, one task a joint, everything at its plainest."""
    plain = Study(
        name="test", description="", path="", digest="", arm=arm,
        drive_mass=None if arm is None else DriveMass.ADDED,
        payloads=(), cycle=cycle, joints=tuple(task(name) for name in cycle.joint_names),
        supply=Supply(48.0, peak_power=2000.0, mean_power=500.0, regenerated_power=500.0), ambient=25.0,
        safety=Safety(),
        gear_assumptions={}, motor_assumptions={},
        catalog=Catalog({"m1": MOTOR}, {"g1": GEAR}),
    )  # fmt: skip
    return replace(plain, **changes)


def payload(mass: float, name: str = "part") -> Payload:
    """A point at the tip."""
    return Payload(name, mass, np.zeros(3), np.zeros((3, 3)))


@pytest.fixture(scope="session")
def make() -> SimpleNamespace:
    """Everything above, for tests that cannot import this file."""
    return SimpleNamespace(
        motor=MOTOR, gear=GEAR, table_cycle=table_cycle, arm_cycle=arm_cycle, sines=sines, planar_arm=planar_arm,
        task=task, study=study, payload=payload,
    )  # fmt: skip
