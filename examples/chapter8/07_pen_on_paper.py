"""Section 8.7: a pen on paper. A UR5 draws a circle and presses with 3 N; the paper is a constraint without work."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.constrained import figure_held_arm

import drivetrain as dt
from drivetrain.arm.kinematics import tip_pose
from drivetrain.dynamics.constrained import constrained_inverse_dynamics, constraint_projectors
from drivetrain.dynamics.constraints import Attachment, Plane, PointOnSurface
from drivetrain.dynamics.task_space import TipVelocity
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.simulation.constrained import simulate_constrained
from drivetrain.solvers.solver import RungeKutta4
from drivetrain.spatial.rotations import log_rotation

RADIUS, DURATION, PRESS = 0.12, 2.0, 3.0  # m, s, N
START = np.radians([10.0, -60.0, 90.0, -120.0, -90.0, 0.0])
STIFFNESS, DAMPING = 400.0, 40.0  # 1/s^2, 1/s


def main(picture: Path) -> None:
    """Draw the circle by inverse dynamics under the constraint, and the picture of it."""
    arm, task = dt.load_arm("ur5-corrected"), TipVelocity()
    home = tip_pose(arm, START)
    paper = PointOnSurface(Attachment.tip(arm), Plane([0.0, 0.0, 1.0], home[:3, 3]))

    def torque(t: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        s = min(t / DURATION, 1.0)
        turn = 2.0 * np.pi * (10 * s**3 - 15 * s**4 + 6 * s**5)
        rate = 2.0 * np.pi * (30 * s**2 - 60 * s**3 + 30 * s**4) / DURATION
        rise = 2.0 * np.pi * (60 * s - 180 * s**2 + 120 * s**3) / DURATION**2
        out, along = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
        pose, jacobian = tip_pose(arm, q), task.jacobian(arm, q[None])[0]
        speed = jacobian @ qd
        wanted = RADIUS * (rise * along - rate**2 * out)
        place = home[:3, 3] + RADIUS * (out - [1.0, 0.0, 0.0])
        wanted = wanted + STIFFNESS * (place - pose[:3, 3]) + DAMPING * (RADIUS * rate * along - speed[3:])
        level = STIFFNESS * log_rotation(home[:3, :3] @ pose[:3, :3].T) - DAMPING * speed[:3]
        drift = task.jacobian_rate(arm, q[None], qd[None])[0] @ qd
        qdd = np.linalg.solve(jacobian, np.concatenate([level, wanted]) - drift)
        return constrained_inverse_dynamics(arm, paper, q, qd, qdd, multipliers=[-PRESS]).torque

    run = simulate_constrained(arm, paper, START, np.zeros(6), DURATION, torque=torque, solver=RungeKutta4(0.005))
    force = run["constraint_1.multiplier_1"]
    rank = np.linalg.matrix_rank(constraint_projectors(arm, paper, START).torque, tol=1e-6)
    print(f"force on the paper: {-force.min():.9f} N at most, {-force.max():.9f} N at least (asked: {PRESS:g} N)")
    print(f"height above the paper: {run['constraint_error'].max():.1e} m at most; rank of P: {rank} of {arm.n}")
    print(f"work of the motors less energy of the arm: {np.abs(run['energy_error']).max():.1e} J")
    with house_style("pen"):
        picture.write_bytes(png_bytes(figure_held_arm(arm, run)))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
