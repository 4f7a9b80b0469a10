"""Section 8.7: a robot holds the handle of a door. The hinge is five constraints; the one freedom left swings."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.constrained import figure_held_arm

import drivetrain as dt
from drivetrain.arm.bodies import with_body
from drivetrain.arm.kinematics import body_jacobian, tip_pose
from drivetrain.dynamics.constrained import constrained_forward_dynamics
from drivetrain.dynamics.constraints import Attachment, ClosingJoint, LoopClosure
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.simulation.constrained import simulate_constrained
from drivetrain.spatial.inertia import cuboid

GRASP = np.radians([-30.0, -40.0, 60.0, -110.0, -90.0, 0.0])
WIDTH, HEIGHT, MASS, PULL = 0.7, 1.8, 20.0, 12.0  # m, m, kg, N


def main(picture: Path) -> None:
    """Pull the door open with 12 N at the handle, and draw how it goes."""
    arm = dt.load_arm("ur5-corrected")
    handle = tip_pose(arm, GRASP)
    hinge = np.eye(4)  # upright, a door's width beside the handle
    hinge[:3, 3] = handle[:3, 3] + [0.0, WIDTH, 0.0]
    door = LoopClosure(Attachment.at(arm, 5, GRASP, hinge), Attachment.base(hinge), ClosingJoint.HINGE)
    # The door is a body of the last link; where its middle is when the arm's joints are at zero:
    middle = np.eye(4)
    middle[:3, 3] = handle[:3, 3] + [0.0, 0.5 * WIDTH, 0.0]
    board = cuboid(MASS, 0.04, WIDTH, HEIGHT).seen_from(Attachment.at(arm, 5, GRASP, middle).pose)
    held = with_body(arm, 5, MASS, board.com, board.inertia)

    def torque(t: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        pull = np.concatenate([np.zeros(3), tip_pose(arm, q)[:3, :3].T @ [-PULL, 0.0, 0.0]])
        return dt.gravity_torque(arm, q) + body_jacobian(arm, q).T @ pull  # the arm carries itself, not the door

    start = constrained_forward_dynamics(held, door, GRASP, np.zeros(6), torque(0.0, GRASP, np.zeros(6)))
    print(f"rank of the five rows: {start.rank}, freedoms left: {arm.n - start.rank}, condition {start.condition:.0f}")
    print("what the hinge carries at the start: forces", np.round(start.multipliers[:3], 1), "N,", end=" ")
    print("moments", np.round(start.multipliers[3:], 1), f"N m (the door weighs {MASS * 9.81:.0f} N)")
    run = simulate_constrained(held, door, GRASP, np.zeros(6), 1.2, torque=torque)
    end = tip_pose(arm, np.array([values[-1] for values in run.ending("position").values()]))[:3, 3] - hinge[:3, 3]
    swung = np.degrees(np.arctan2(-end[0], -end[1]))
    print(f"after {run.time[-1]:g} s the door stands open by {swung:.1f} degrees; hinge kept to", end=" ")
    print(f"{run['constraint_error'].max():.0e} m, energy to {np.abs(run['energy_error']).max():.0e} J", end=" ")
    print(f"of {run['work'][-1]:.2f} J put in")
    with house_style("door"):
        picture.write_bytes(png_bytes(figure_held_arm(held, run, hinge=hinge[:3, 3])))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
