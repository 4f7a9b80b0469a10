"""Newton and Euler in closed form: A, G, W and L of a geared PUMA 560, and what follows from them."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from figures.closed_form import figure_stacked

import drivetrain as dt
from drivetrain.dynamics.book.closed_form import closed_form, closed_form_torque, mass_matrix_rate, stacked
from drivetrain.dynamics.inverse import bias_torque, tip_torque, velocity_torque
from drivetrain.report.charts.plotting import house_style, png_bytes


def main(picture: Path) -> None:
    """Print how far the closed form and the recursion agree, and draw the matrices."""
    arm = dt.load_arm("puma560")
    rng = np.random.default_rng(8)
    q, qd, qdd, tip = *rng.uniform(-2.0, 2.0, (3, 200, 6)), rng.normal(size=(200, 6)) * 20.0
    m = stacked(arm, q[0])
    print(f"{arm.n} joints, {len(m.carriers)} bodies with the rotors: A {m.A.shape}, G {m.G.shape}, W {m.W.shape}")
    deep = next(k for k in range(1, 99) if not np.linalg.matrix_power(m.W, k).any())
    print(f"W is nilpotent of order {deep}; L is 1 + W + ... + W^{deep - 1}")

    terms, tau = closed_form(arm, q, qd), dt.inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    for name, closed, recursive, unit in (
        ("M (8.78), composite bodies", terms.mass, dt.mass_matrix(arm, q), "kg m^2"),
        ("c (8.79), no gravity, no qdd", terms.velocity, velocity_torque(arm, q, qd), "N m"),
        ("g (8.80), at rest", terms.gravity, dt.gravity_torque(arm, q), "N m"),
        ("h (exercise 8.11), no qdd", terms.velocity + terms.gravity, bias_torque(arm, q, qd), "N m"),
        ("J^T F (8.77), F alone", np.einsum("kji,kj->ki", terms.tip_jacobian, tip), tip_torque(arm, q, tip), "N m"),
        ("all of 8.77, recursion", closed_form_torque(arm, q, qd, qdd, tip_wrench=tip), tau, "N m"),
    ):
        print(f"{name:30s} differ by {np.abs(closed - recursive).max():.0e} {unit}")

    step = 1e-5  # s, central differences along the motion
    ahead, behind = (dt.mass_matrix(arm, q + way * step * qd) for way in (0.5, -0.5))
    rate, coriolis = mass_matrix_rate(arm, q, qd), dt.coriolis_matrix(arm, q, qd)
    off = np.abs(rate - (ahead - behind) / step).max()
    passive = np.abs(rate - coriolis - np.swapaxes(coriolis, 1, 2)).max()
    print(f"dM/dt (exercise 8.7) is that of differences to {off:.0e}, C + C^T to {passive:.0e} kg m^2/s")

    many, start = rng.uniform(-2.0, 2.0, (20000, 6)), perf_counter()
    closed_form(arm, q, qd)
    middle = perf_counter()
    dt.mass_matrix(arm, many)
    end = perf_counter()
    print(f"closed forms take {(middle - start) / len(q) * 1e6:.0f} us a posture, ", end="")
    print(f"M by composite bodies (exercise 8.13) {(end - middle) / len(many) * 1e6:.2f} us")
    with house_style("stacked"):
        picture.write_bytes(png_bytes(figure_stacked(arm, q[0])))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
