"""Motor torques of a measured robot: a KUKA KR300 on a 10 s recording, against our rotors, friction and dynamics.

The bounds are what a rigid model with the published parameters reaches: friction that depends on load and temperature,
and the flexibility of the joints, are not in it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import savgol_filter

import drivetrain as dt

RECORDING = Path(__file__).with_name("data") / "kr300_recording_a.npz"
OFFSET = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])  # from the recording's zero to the table's zero
SMOOTHING = {"window_length": 15, "polyorder": 3, "delta": 0.004, "axis": 0}  # 60 ms at 250 Hz, well below the motion


def counterbalance(q2: np.ndarray) -> np.ndarray:
    """Torque of the hydraulic spring on axis 2 [N m], with the geometry and gas published beside the recording."""
    far, near = 0.8, 0.2
    delta = q2 + np.deg2rad(95.0)
    length = np.sqrt(far**2 + near**2 - 2 * far * near * np.cos(delta))
    area = np.pi * (0.055**2 - 0.030**2) / 4
    pressure = 1.01 * 296.8 * 328 * 2 * 0.0795 / (2 * 0.00048 - (length - (far - near)) * area)
    return np.sin(delta) * far * near / length * pressure * area


def friction(recording: dict[str, np.ndarray], qd: np.ndarray) -> np.ndarray:
    """The published joint-side friction law [N m]."""
    r = recording
    steady = r["f_asym"] + r["f_vis"] * qd + r["f_coul"] * np.tanh(100 * qd)
    return steady + r["f_a"] * np.tanh(r["f_b"] * qd)


@pytest.fixture(scope="module")
def torques() -> tuple[np.ndarray, np.ndarray]:
    recording = dict(np.load(RECORDING))
    measured_q = recording["q_motor_side_rad"] + OFFSET
    q, qd, qdd = (savgol_filter(measured_q, deriv=k, **SMOOTHING) for k in range(3))
    arm = dt.load_arm("kr300")
    joint_side = friction(recording, qd)
    joint_side[:, 1] += counterbalance(q[:, 1])
    predicted = dt.drive_torques(arm, q, qd, qdd).motor + joint_side / recording["gear_ratio"]
    return predicted, recording["motor_torque_Nm"]


def test_predicted_motor_torque_follows_the_recorded_one(torques: tuple[np.ndarray, np.ndarray]) -> None:
    predicted, measured = torques
    correlation = [np.corrcoef(predicted[:, i], measured[:, i])[0, 1] for i in range(6)]
    assert np.all(np.array(correlation) > [0.95, 0.93, 0.89, 0.84, 0.96, 0.96]), correlation


def test_rotors_are_needed_to_explain_the_recording(torques: tuple[np.ndarray, np.ndarray]) -> None:
    """Without the rotors' inertia the same model follows axis 5 less well, where the motor mostly turns itself."""
    predicted, measured = torques
    recording = dict(np.load(RECORDING))
    acceleration = savgol_filter(recording["q_motor_side_rad"], deriv=2, **SMOOTHING)
    without = predicted[:, 4] - 0.00173 * recording["gear_ratio"][4] * acceleration[:, 4]

    def misfit(torque: np.ndarray) -> float:
        return float(np.sqrt(np.mean((torque - measured[:, 4]) ** 2)) / measured[:, 4].std())

    assert misfit(predicted[:, 4]) < 0.35
    assert misfit(without) > 1.1 * misfit(predicted[:, 4])
