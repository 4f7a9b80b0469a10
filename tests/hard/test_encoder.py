"""Torques from an encoder's readings, differentiated twice (exercise 8.14)."""

from __future__ import annotations

import numpy as np
from hard_case import Figure, hard_case

from drivetrain.arm.files.load import load_arm
from drivetrain.dynamics.from_positions import torque_from_positions
from drivetrain.dynamics.inverse import inverse_dynamics

ARM = load_arm("ur5")
TIME = 1e-3 * np.arange(2000)
BITS = range(12, 25)


def wave() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two frequencies a joint, other ones for each."""
    w = np.pi * (1.0 + 0.3 * np.arange(6))
    a = np.array([1.2, 0.5, 0.7, 1.0, 0.8, 1.5])
    x, y = w * TIME[:, None] + 0.7 * np.arange(6), 3.0 * w * TIME[:, None]
    q = a * np.sin(x) + 0.15 * np.sin(y)
    return q, w * (a * np.cos(x) + 0.45 * np.cos(y)), -w * w * (a * np.sin(x) + 1.35 * np.sin(y))


def off(found: np.ndarray, wanted: np.ndarray) -> tuple[float, float]:
    """Errors of RMS and of peak, of the worst joint [%]."""
    rms = [np.sqrt((values**2).mean(axis=0)) for values in (found, wanted)]
    peak = [np.abs(values).max(axis=0) for values in (found, wanted)]
    return float(100.0 * np.abs(rms[0] / rms[1] - 1.0).max()), float(100.0 * np.abs(peak[0] / peak[1] - 1.0).max())


@hard_case(
    "T40",
    "Torques from encoder positions",
    setup="A UR5 sampled at 1 kHz with encoders of 12 to 24 bit per turn; the worst joint and resolution.",
    naive="second differences",
)
def test_encoder() -> list[Figure]:
    q, qd, qdd = wave()
    wanted = inverse_dynamics(ARM, q, qd, qdd)
    ours, naive = [], []
    for bits in BITS:
        step = 2.0 * np.pi / 2**bits
        read = np.round(q / step) * step
        ours.append(off(torque_from_positions(ARM, TIME, read, resolution=step).torque, wanted))
        ours.append(off(torque_from_positions(ARM, TIME, read).torque, wanted))  # the resolution found by itself
        second = np.diff(read, 2, axis=0) / 1e-6
        differences = inverse_dynamics(ARM, read[1:-1], np.gradient(read, TIME, axis=0)[1:-1], second)
        naive.append(off(differences, wanted[1:-1]))
    (rms, peak), (naive_rms, naive_peak) = np.max(ours, axis=0), np.max(naive, axis=0)
    return [
        Figure("error of the RMS torque", rms, naive_rms, at_most=3.0, unit="%"),
        Figure("error of the peak torque", peak, naive_peak, at_most=5.0, unit="%"),
    ]
