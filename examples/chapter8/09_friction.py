"""Modern Robotics 8.9.4: the six friction curves of figure 8.13, and what they ask at the start and at a creep."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.friction import figure_friction

from drivetrain.drive.friction import book_curves, breakaway_torque, friction_torque

NAMES = {
    "a": "(a) viscous",
    "b": "(b) Coulomb",
    "c": "(c) static and viscous",
    "d": "(d) static and kinetic",
    "e": "(e) static, kinetic, viscous",
    "f": "(f) Stribeck",
}


def main(picture: Path) -> None:
    # A robot joint: 3 N m to start, 1.8 N m while sliding, and 0.4 N m more for every rad/s.
    laws = book_curves(static=3.0, kinetic=1.8, viscous=0.4, stribeck_speed=0.5)
    print(f"{'law of figure 8.13':30s} {'to start':>9s} {'0.01':>7s} {'0.5':>7s} {'4 rad/s':>8s}")
    for letter, law in laws.items():
        start = float(breakaway_torque(law, np.array(1.0)))
        torques = friction_torque(law, np.array([0.01, 0.5, 4.0]))
        print(f"{NAMES[letter]:30s} {start:7.2f} N m" + "".join(f"{torque:7.2f}" for torque in torques) + " N m")

    stribeck = laws["f"]
    speeds = np.linspace(1e-4, 4.0, 100_000)
    torque = friction_torque(stribeck, speeds)
    slowest = speeds[np.argmin(torque)]
    print(f"\n(f) falls until {slowest:.3f} rad/s: below that speed, friction that falls with speed makes a joint jerk")
    worst = np.diff(torque).min() / np.diff(speeds)[0]
    print(f"    its steepest fall is {-worst:.2f} N m s/rad: damping by less than that lets it jerk")
    figure = figure_friction({NAMES[letter]: law for letter, law in laws.items()}, top_speed=4.0)
    figure.savefig(picture, dpi=150, facecolor="white")
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
