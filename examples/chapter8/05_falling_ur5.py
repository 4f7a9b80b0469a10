"""Exercise 8.15: the UR5 falls for 3 s from its zero position. What Euler's method makes of it, and what it costs."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.steps import figure_step_study, step_study

import drivetrain as dt
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.solvers.solver import DormandPrince853, Euler, RungeKutta4, SemiImplicitEuler

DURATION = 3.0  # s
STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4)  # s; 100 Hz is what the exercise asks for
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)


def main(picture: Path) -> None:
    """Print error, energy and work of each method, and draw them against each other."""
    arm = dt.load_arm("ur5")  # gravity 9.81 m/s^2 along -z; inertias of the file, wrists and all, as in the book
    rest = np.zeros(arm.n)
    methods = {
        "Euler": [Euler(step) for step in STEPS],
        "semi-implicit Euler": [SemiImplicitEuler(step) for step in STEPS],
        "Runge-Kutta 4": [RungeKutta4(step) for step in STEPS],
        "Dormand-Prince 8(5,3)": [DormandPrince853(rtol, 1e-2 * rtol) for rtol in TOLERANCES],
    }
    studies = {name: step_study(arm, rest, rest, DURATION, solvers) for name, solvers in methods.items()}
    print(f"{arm.name} after {DURATION:g} s of falling from its zero position, joint torques zero:")
    print(f"{'method':22} {'step or rtol':>12} {'evaluations':>11} {'error [rad]':>12} {'energy [J]':>12}")
    for name, results in studies.items():
        for result in results:
            end, solver = result.recording, result.solver
            setting = solver.rtol if isinstance(solver, DormandPrince853) else solver.step
            gained = end["energy_error"][-1]
            print(f"{name:22} {setting:12g} {end.counters['rates']:11} {result.error[-1]:12.3g} {gained:12.3g}")
    euler = studies["Euler"][0]
    last = np.abs(euler.recording["energy_error"])[-1]
    print(f"Euler at 100 Hz ends {euler.error[-1]:.2f} rad off, and has made {last:.1f} J out of nothing.")
    with house_style("falling"):
        picture.write_bytes(png_bytes(figure_step_study(studies, name="falling")))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
