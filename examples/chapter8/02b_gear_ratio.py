"""Gears make the mass matrix diagonal: section 8.9.2 with the book's 2R arm, and a UR5, over the gear ratio."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.mass_matrix import figure_ratio_sweep

import drivetrain as dt
from drivetrain.dynamics.book.ratio_sweep import sweep_ratio, with_ratio
from drivetrain.dynamics.book.symbolic import symbolic_dynamics
from drivetrain.report.charts.plotting import house_style, png_bytes


def main(picture: Path) -> None:
    """Print the book's two mass matrices exactly, and draw coupling and variation over the ratio."""
    planar = dt.load_arm("planar-2r")
    for ratio in (10.0, 100.0):
        print(f"ratio {ratio:.0f}: M = {symbolic_dynamics(with_ratio(planar, ratio)).M.tolist()} kg m^2")
    print("  9/8 = 1.125, which the book prints as 1.13")

    # Rotor inertias of the UR5 are not published; these are of motors that an arm of this size has.
    ur5 = dt.with_rotors(dt.load_arm("ur5"), [dt.Rotor(100.0, 1e-4)] * 3 + [dt.Rotor(100.0, 2e-5)] * 3)
    ratios = np.geomspace(1.0, 1000.0, 61)
    elbows = np.column_stack([np.zeros(37), np.linspace(0.0, np.pi, 37)])
    anywhere = np.random.default_rng(8).uniform(-np.pi, np.pi, (200, 6))
    sweeps = {"planar-2r": sweep_ratio(planar, elbows, ratios), "ur5": sweep_ratio(ur5, anywhere, ratios)}
    for name, sweep in sweeps.items():
        for ratio in (1.0, 10.0, 100.0, 1000.0):
            row = int(np.argmin(np.abs(np.log(ratios / ratio))))
            coupled, swing = sweep.coupling[row].max(), sweep.variation[row].max()
            print(f"{name}, ratio {ratio:.0f}: joints coupled by up to {coupled:.1%}, inertia swings by {swing:.1%}")
    with house_style("gear ratio"):
        picture.write_bytes(png_bytes(figure_ratio_sweep(sweeps, planar, elbows[::6])))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
