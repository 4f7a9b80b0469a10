"""The Lagrangian of the book's 2R arm: equation 8.9 by hand, in letters and by recursion; energies; figure 8.2."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.mass_matrix import figure_velocity_accelerations

import drivetrain as dt
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm, planar_2r_torque
from drivetrain.dynamics.book.symbolic import symbolic_dynamics
from drivetrain.dynamics.derivatives import christoffel_symbols, coriolis_matrix
from drivetrain.dynamics.energy import kinetic_energy, potential_energy, power_balance
from drivetrain.report.charts.plotting import house_style, png_bytes


def main(picture: Path) -> None:
    """Print what the Lagrangian gives, and draw the accelerations of figure 8.2."""
    chain = Planar2R(masses=(1.0, 1.0), lengths=(1.0, 1.0))
    arm = planar_2r_arm(chain)
    letters = symbolic_dynamics(arm)
    print("The equations of the 2R arm by Euler and Lagrange, SI units:")
    print(letters.text())

    rng = np.random.default_rng(8)
    q, qd, qdd = rng.uniform(-3.0, 3.0, (3, 1000, 2))
    by_recursion = dt.inverse_dynamics(arm, q, qd, qdd)
    for name, torque in (
        ("equation 8.9 by hand", planar_2r_torque(chain, q, qd, qdd)),
        ("the letters above", letters.torque_function()(q, qd, qdd)),
    ):
        print(f"largest difference of {name} from Newton and Euler: {np.abs(torque - by_recursion).max():.1e} N m")

    upright = np.array([0.0, np.pi / 2])
    symbols = christoffel_symbols(arm, upright)
    print(f"at (0, 90 deg): Gamma_122 = {symbols[0, 1, 1]:.3g}, Gamma_211 = {symbols[1, 0, 0]:.3g} kg m^2")
    rate = 2e-6  # s, for a central difference
    after, before = (dt.mass_matrix(arm, q + step * qd) for step in (rate / 2, -rate / 2))
    skew = (after - before) / rate - 2.0 * coriolis_matrix(arm, q, qd)
    print(f"dM/dt - 2 C is skew to {np.abs(skew + np.swapaxes(skew, 1, 2)).max():.0e} kg m^2/s")

    time = np.linspace(0.0, 1.0, 1001)
    phase, swing = np.pi * time[:, None], np.array([0.8, -1.2])
    path, speed = swing * (1.0 - np.cos(phase)), swing * np.pi * np.sin(phase)
    acceleration = swing * np.pi**2 * np.cos(phase)
    power = power_balance(arm, path, speed, acceleration)
    energy = kinetic_energy(arm, path, speed) + potential_energy(arm, path)
    work = np.trapezoid(power.joints.sum(axis=1), time)
    print(f"over a swing of 1 s the joints put in {work:.6f} J, and its energy rises by {energy[-1] - energy[0]:.6f} J")

    with house_style("lagrangian"):
        picture.write_bytes(png_bytes(figure_velocity_accelerations(arm, upright, [1.0, 1.0])))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
