"""A joint on a moving belt, held by a spring, sticks and slips; the period against its closed form."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import drivetrain as dt

STATIC, SLIDING, SPRING, BELT = 1.5, 1.0, 100.0, 0.01  # N m, N m, N m/rad, rad/s; an inertia of 1 kg m^2


def period() -> float:
    """Time stuck, and time slipping, of a joint with two levels of friction."""
    w = math.sqrt(SPRING)
    drop = (STATIC - SLIDING) / SPRING
    slip = (2.0 * math.pi - 2.0 * math.atan2(drop * w, BELT)) / w
    return 2.0 * drop / BELT + slip


def main(picture: Path) -> None:
    friction = dt.DryFriction(dt.Friction(coulomb=SLIDING, static=STATIC))
    scene = dt.joint_scene(dt.Inertia(1.0), [friction, dt.MovingBelt(BELT), dt.WallSpring(SPRING)], 10.0)
    run = dt.simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3)
    place, speed = run.series["joint.position"].values, run.series["joint.speed"].values
    stuck = speed == BELT
    loose = run.time[1:][stuck[:-1] & ~stuck[1:]]
    print(f"period {np.diff(loose).mean():.5f} s of {len(loose) - 1} turns, closed form {period():.5f} s")
    print(f"stuck {100.0 * stuck.mean():.0f} % of the time, then exactly as fast as the belt")
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(run.time, place)
    upper.axhline(STATIC / SPRING, color="0.5", linestyle=":")
    upper.set_ylabel("position [rad]")
    lower.plot(run.time, run.series["joint.joint_friction"].values)
    lower.set(ylabel="friction [N m]", xlabel="time [s]")
    figure.savefig(picture, dpi=120)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
