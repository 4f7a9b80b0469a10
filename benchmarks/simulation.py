"""What a simulated second costs: a six-axis arm with all its effects, one flexible joint, and each effect alone.

    python benchmarks/simulation.py [--picture out/simulation_cost.png] [--check]

Seconds are those of this process alone, the best of several runs, at fixed steps of a millisecond.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.motion.motion import Motion
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene, joint_scene

DURATION = 10.0  # s
RUNS = 7
TARGET = 500.0  # simulated seconds a second, with all effects
RATIOS = (100.0, 100.0, 100.0, 80.0, 80.0, 80.0)
ROTORS = (6e-5, 6e-5, 4e-5, 8e-6, 8e-6, 8e-6)  # kg m^2
CONSTANTS = (0.12, 0.12, 0.12, 0.08, 0.08, 0.08)  # N m/A
NETWORK = ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0)


def motion(arm: dt.Arm) -> Motion:
    """Sines from rest to rest."""
    t = np.linspace(0.0, DURATION, 1001)
    middle = np.array([0.0, -1.2, 1.0, 0.3, 0.5, 0.0])
    swing, turn = np.array([0.6, 0.4, 0.5, 0.7, 0.6, 0.8]), 2 * np.pi * np.array([0.1, 0.2, 0.1, 0.3, 0.2, 0.3])
    angle = turn * t[:, None]
    q = middle + 0.5 * swing * (1.0 - np.cos(angle))
    return Motion(
        "sines", arm.joint_names, t, q, 0.5 * swing * turn * np.sin(angle), 0.5 * swing * turn**2 * np.cos(angle)
    )


def joint_effects(i: int) -> dict[str, Effect]:
    """What a joint may have, by name."""
    law = Friction(coulomb=0.02, static=0.03, stribeck_speed=5.0, viscous=1e-5)
    return {
        "sticking friction": DryFriction(law, "motor"),
        "mesh loss": MeshLoss(Gear("g", RATIOS[i], kind="strain_wave", efficiency=0.8)),
        "viscous friction": ViscousFriction(law, "motor"),
        "heat": WindingHeat(NETWORK),
    }


def six_axes(kept: Iterable[str]) -> Scene:
    """A geared UR5 under computed torque, with some effects."""
    arm = dt.load_arm("ur5")
    effects: dict[str, tuple[Effect, ...]] = {}
    for i, name in enumerate(arm.joint_names):
        some = joint_effects(i)
        always = (FullRotor(ROTORS[i], RATIOS[i]), MotorCurrent(Motor("m", 0.5, CONSTANTS[i]), 30.0))
        effects[name] = (*always, *(some[one] for one in kept))
    servo = ComputedTorque(30.0, tuple(zip(arm.joint_names, CONSTANTS, strict=True)))
    effects["scene"] = (CommandedMotion(motion(arm)), servo)
    return Scene(arm, effects, DURATION)


def one_joint(flexible: bool) -> Scene:
    """A motor, a gear and a load, driven by a current."""
    gear = Gear("g", 100.0, kind="strain_wave", efficiency=0.8, stiffness_1=2e4)
    t = np.linspace(0.0, DURATION, 41)
    effects: list[Effect] = [
        FullRotor(3.3e-5, 100.0), MotorCurrent(Motor("m", 0.299, 0.0302)), GivenCurrent(t, 3.0 * np.sin(2.0 * t)),
        DryFriction(Friction(coulomb=0.015, static=0.025, stribeck_speed=5.0), "motor"), MeshLoss(gear),
    ]  # fmt: skip
    return joint_scene(1.2, [*effects, *([FlexibleJoint(gear, 4.0)] if flexible else [])], DURATION)


def microseconds(scene: Scene) -> tuple[float, Recording]:
    """Time of a step, the best of several runs, and what the last one left."""
    ready, best = plan(scene), math.inf
    run = simulate(ready, duration=0.01)
    for _ in range(RUNS):
        begin = time.process_time()
        run = simulate(ready, interval=0.5, checked=False)
        best = min(best, time.process_time() - begin)
    return 1e6 * best / run.counters["steps"], run


def main(arguments: list[str] | None = None) -> int:
    """Print the tables, draw the picture; with --check the exit code says whether the target is met."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--picture", type=Path, default=Path("out/simulation_cost.png"), help="where the picture goes")
    parser.add_argument("--check", action="store_true", help=f"exit 1 below {TARGET:g} simulated seconds a second")
    options = parser.parse_args(arguments)
    names, costs = list(joint_effects(0)), []
    print("UR5 with full rotors, computed torque; effects added one after another, in all six joints")
    print(f"{'':28}{'us a step':>10}{'added':>8}{'s a second':>12}")
    for count in range(len(names) + 1):
        cost, run = microseconds(six_axes(names[:count]))
        label = f"+ {names[count - 1]}" if count else "rotors and servo"
        print(f"{label:28}{cost:10.2f}{cost - costs[-1] if count else 0.0:8.2f}{1e3 / cost:12.0f}")
        costs.append(cost)
        assert run.stopped_by is None
    print("\nOne joint with sticking friction and mesh loss")
    for flexible in (False, True):
        cost, _ = microseconds(one_joint(flexible))
        print(f"{'flexible' if flexible else 'rigid':28}{cost:10.2f}{'':8}{1e3 / cost:12.0f}")
    draw(["rotors and servo", *(f"+ {name}" for name in names)], costs, options.picture)
    print(f"\n{options.picture}")
    return 0 if 1e3 / costs[-1] >= TARGET or not options.check else 1


def draw(labels: list[str], costs: list[float], picture: Path) -> None:
    """Time of a step against the number of effects; what is absent costs nothing."""
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    ax = figure.subplots()
    ax.barh(labels, costs, color="C0", label="all effects down to here")
    ax.axvline(1e3 / TARGET, color="C3", ls="--", label=f"{TARGET:g} simulated seconds a second")
    for row, cost in enumerate(costs):
        ax.text(cost, row, f" {cost:.2f} us, {1e3 / cost:.0f} s a second", va="center")
    ax.invert_yaxis()
    ax.set_xlabel("time of a step of 1 ms, UR5, effects in all six joints [us]")
    figure.legend(loc="outside upper center", ncols=2)
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    sys.exit(main())
