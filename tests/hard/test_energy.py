"""Energy that nobody put in: what a method adds to an arm without friction."""

from __future__ import annotations

import numpy as np
from hard_case import Figure, hard_case

from drivetrain.arm.arm import Arm
from drivetrain.simulation.passive import simulate_passive
from drivetrain.simulation.recording import Recording
from drivetrain.solvers.solver import DormandPrince853, Euler, RungeKutta4


def double_pendulum() -> Arm:
    """Two rods of 1 m and 1 kg, turning about y."""
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, 0, 3] = [0.5, 1.5]
    screws = [[0, 1, 0, 0, 0, 0], [0, 1, 0, 0, 0, 1]]
    return Arm.from_screws(home, screws, [1.0, 1.0], [np.diag([0.0, 1 / 12, 1 / 12])] * 2, gravity=[0, 0, -9.81])


def drift(run: Recording, scale: float) -> float:
    return float(np.abs(run["energy_error"]).max()) / scale


@hard_case(
    "T28",
    "Energy of a frictionless 2R arm over 100 s",
    setup="Two rods of 1 m fall from 90° and 0°. RK4 at 2 ms and DOP853 with a tolerance of 1e-9.",
    naive="explicit Euler at 2 ms",
)
def test_energy() -> list[Figure]:
    arm, start = double_pendulum(), ([0.0, 0.3], [0.0, 0.0])
    scale = 9.81 * 2.0  # J, from horizontal to hanging
    euler = simulate_passive(arm, *start, 100.0, solver=Euler(2e-3), interval=0.1)
    fixed = simulate_passive(arm, *start, 100.0, solver=RungeKutta4(2e-3), interval=0.1)
    # The motion is chaotic: at the default tolerance of 1e-8 the error is 0.6 to 1.4e-6, as rounding has it.
    adaptive = simulate_passive(arm, *start, 100.0, solver=DormandPrince853(1e-9), interval=0.1)
    naive = drift(euler, scale)
    return [
        Figure("energy error relative to the energy of the fall (RK4)", drift(fixed, scale), naive, at_most=1e-6),
        Figure("the same (DOP853)", drift(adaptive, scale), naive, at_most=1e-6),
    ]
