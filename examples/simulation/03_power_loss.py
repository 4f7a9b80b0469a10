"""The power goes off: how far a 2R arm sags before its brakes close, by their delay and by what its gears hold."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import drivetrain as dt

RATIO, ROTOR = 100.0, 3.3e-5  # -, kg m^2
DELAYS = (0.02, 0.06, 0.12)  # s
START = np.array([0.4, -0.3])  # rad


def falling(arm: dt.Arm, delay: float | None, *, friction: bool) -> dt.Recording:
    """The arm from rest without current, its brakes told to close at once; None: it has none."""
    gear = dt.Gear(key="1:100", ratio=RATIO, efficiency=0.75, kind="strain_wave")
    drag = dt.DryFriction(dt.Friction(coulomb=0.03, static=0.04, stribeck_speed=5.0), side="motor")
    joint = (dt.FullRotor(ROTOR, RATIO), *((dt.MeshLoss(gear), drag) if friction else ()))
    brake = () if delay is None else (dt.HoldingBrake(1.5, engages=(0.0,), closing=delay),)
    effects = {name: (*joint, *brake) for name in arm.joint_names}
    scene = dt.Scene(arm, effects, 0.4, position=START, speed=np.zeros(2))
    return dt.simulate(scene, solver=dt.FixedStep(2e-4), interval=1e-3)


def main(picture: Path) -> None:
    arm = dt.with_rotors(dt.load_arm("planar-2r"), [None, None])
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for friction, style in ((True, "-"), (False, "--")):
        for delay, colour in zip((*DELAYS, None), ("C0", "C1", "C2", "C3"), strict=True):
            run = falling(arm, delay, friction=friction)
            first = run.series[f"{arm.joint_names[0]}.position"].values
            what = "no brake" if delay is None else f"brake after {1e3 * delay:.0f} ms"
            gears = "gears with friction" if friction else "gears without friction"
            print(f"{gears}, {what}: {arm.joint_names[0]} sags {np.degrees(first[0] - first[-1]):.3f} degrees")
            axes.plot(run.time, np.degrees(first - first[0]), style, color=colour, label=f"{what}, {gears}")
            if delay is not None:
                late = first[run.time > 0.35]
                print(f"    and then stands: it moves {np.ptp(late):.0e} rad in the last {0.05:g} s")
    axes.set(xlabel="time since the power went off [s]", ylabel="first joint [degrees]")
    axes.legend(fontsize=8)
    figure.savefig(picture, dpi=120)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
