"""Section 8.7: a four-bar loop closed by a pin. Five rows of which two count, and three ways to keep it closed."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.constrained import figure_drift

import drivetrain as dt
from drivetrain.dynamics.constrained import closed_position, constrained_forward_dynamics, constraint_projectors
from drivetrain.dynamics.constraints import Attachment, ClosingJoint, LoopClosure
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.simulation.constrained import Baumgarte, Drifting, Projection, simulate_constrained
from drivetrain.solvers.solver import RungeKutta4, SemiImplicitEuler
from drivetrain.spatial.poses import pose

LENGTHS, MASSES = np.array([0.4, 1.0, 0.8]), np.array([1.0, 2.0, 1.5])  # crank, coupler, rocker [m], [kg]
GROUND, STEP, DURATION = 0.9, 1e-3, 10.0  # m, s, s


def chain() -> dt.Arm:
    """Three uniform rods, end to end along x, in the x-y plane; gravity along -y."""
    ends = np.concatenate([[0.0], np.cumsum(LENGTHS)])
    homes = [pose(point=[x, 0.0, 0.0]) for x in 0.5 * (ends[1:] + ends[:-1])]
    screws = [[0.0, 0.0, 1.0, 0.0, -x, 0.0] for x in ends[:-1]]
    tip = pose(point=[ends[-1], 0.0, 0.0])
    moments = [np.diag([0.0, m, m]) for m in MASSES * LENGTHS**2 / 12.0]
    return dt.Arm.from_screws(homes, screws, MASSES, moments, tip, (0.0, -9.81, 0.0), name="four-bar")


def main(picture: Path) -> None:
    """Close the loop, let it fall, and draw how far each way lets it open again."""
    arm, pin = chain(), Attachment.base(pose(point=[GROUND, 0.0, 0.0]))
    loop = LoopClosure(Attachment.tip(arm), pin, ClosingJoint.HINGE)
    q, still = closed_position(arm, loop, [1.2, -0.9, -1.5]), np.zeros(3)
    fall = constrained_forward_dynamics(arm, loop, q, still, still)
    print("closed at", np.degrees(q).round(2), "degrees")
    print(f"{loop.count} rows of rank {fall.rank}; multipliers of least norm:", fall.multipliers.round(3), "N, N m")
    print("P =\n", constraint_projectors(arm, loop, q).torque.round(4))
    ways = {
        "nothing done, semi-implicit Euler": (Drifting(), SemiImplicitEuler(STEP)),
        "nothing done, Runge-Kutta 4": (Drifting(), RungeKutta4(STEP)),
        "Baumgarte 10 /s, Runge-Kutta 4": (Baumgarte(10.0), RungeKutta4(STEP)),
        "projection, Runge-Kutta 4": (Projection(), RungeKutta4(STEP)),
    }
    runs = {}
    for title, (how, solver) in ways.items():
        run = runs[title] = simulate_constrained(arm, loop, q, still, DURATION, solver=solver, stabilisation=how)
        energy = np.abs(run["energy_error"]).max()
        print(f"{title:34} open by {run['constraint_error'].max():.1e} m, energy off by {energy:.1e} J")
    with house_style("four-bar"):
        picture.write_bytes(png_bytes(figure_drift(runs)))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
