"""Section 8.11 under its own names; and exercise 8.14: torques from positions only, with the noise told."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from figures.readings import figure_torque_from_positions
from numpy.linalg import norm

import drivetrain.modern_robotics as mr
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.lists import book_lists
from drivetrain.dynamics.from_positions import torque_from_positions
from drivetrain.report.charts.plotting import house_style, png_bytes


def main(picture: Path) -> None:
    """Print the book's functions at work, and draw torques from a 12-bit encoder."""
    arm = load_arm("ur5")
    lists, g, none = book_lists(arm), np.array([0.0, 0.0, -9.81]), np.zeros(6)
    rng = np.random.default_rng(8)
    q, qd, qdd = rng.uniform(-2.0, 2.0, (3, 6))
    tau = mr.InverseDynamics(q, qd, qdd, g, none, *lists)
    parts = mr.MassMatrix(q, *lists) @ qdd + mr.VelQuadraticForces(q, qd, *lists) + mr.GravityForces(q, g, *lists)
    text = np.array2string(tau, precision=3, suppress_small=True)
    print(f"tau = {text} N m; M qdd + c + g is the same to {np.abs(parts - tau).max():.0e} N m")
    back = mr.ForwardDynamics(q, qd, tau, g, none, *lists)
    print(f"and ForwardDynamics gives qdd back to {np.abs(back - qdd).max():.0e} rad/s^2")

    time, turn = 1e-3 * np.arange(2000), np.pi * (1.0 + 0.3 * np.arange(6))  # s, rad/s
    x, y = turn * time[:, None] + np.arange(6), 3.0 * turn * time[:, None]
    path, speed = 0.8 * np.sin(x) + 0.1 * np.sin(y), turn * (0.8 * np.cos(x) + 0.3 * np.cos(y))
    acceleration = -(turn**2) * (0.8 * np.sin(x) + 0.9 * np.sin(y))
    start = perf_counter()
    exact = mr.InverseDynamicsTrajectory(path, speed, acceleration, g, 0, *lists)
    print(f"InverseDynamicsTrajectory: {(perf_counter() - start) / len(time) * 1e6:.2f} us a sample")

    print("exercise 8.14, an encoder read at 1 kHz: by how much torques come out wrong, worst joint [%]")
    for bits in (20, 16, 14, 12):
        step = 2.0 * np.pi / 2**bits
        read = np.round(path / step) * step
        rough, found = (torque_from_positions(arm, time, read, resolution=way) for way in (0.0, None))
        for name, torque in (("differenced", rough.torque), ("smoothed", found.torque)):
            rms, peak = (np.abs(norm(torque, k, 0) / norm(exact, k, 0) - 1.0).max() * 100.0 for k in (2, np.inf))
            print(f"{bits} bit, {name:11s}: RMS {rms:6.1f}, peak {peak:7.1f}", end="; ")
        inner = slice(100, -100)  # the ends rest on one side only
        share = norm((found.torque - exact)[inner]) / norm(found.deviation[inner])
        worst = np.abs(found.torque - exact).max()
        print(f"error {share:.1f} of the deviation told, but for 0.1 s at each end (up to {worst:.2g} N m off there)")
    with house_style("book names"):
        figure = figure_torque_from_positions(time, found, 1, differenced=rough.torque, exact=exact)
        picture.write_bytes(png_bytes(figure))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
