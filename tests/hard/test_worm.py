"""A worm that locks: refused where its equations have no or two solutions, else held by its mesh, and released."""

from __future__ import annotations

import math

import numpy as np
from hard_case import Figure, hard_case

from drivetrain.drive.gear import Gear
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.errors import InputError
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.solvers.solver import Rodas4

WEIGHT, LOAD, RATIO = 10.0, 1.0, 50.0


def worm(efficiency: float, rotor: float, torque: float = 0.0, duration: float = 60.0) -> Scene:
    """A load that hangs on a worm of a given efficiency when driving, its motor pushed with a torque."""
    gear = Gear("worm", RATIO, kind="spur", efficiency=efficiency)
    effects = [MeshLoss(gear), FullRotor(rotor, RATIO), GivenTorque([0.0], [torque], "motor")]
    return joint_scene(Inertia(LOAD, weight=WEIGHT), effects, duration)


def refused(scene: Scene) -> bool:
    """Whether the scene is refused because its mesh jams."""
    try:
        plan(scene)
    except InputError as error:
        return "jams" in str(error)
    return False


@hard_case(
    "T07",
    "A self-locking worm gear",
    setup=(
        "Of 200 worm gears with mu from 0.2 to 4, those with mu above 1 + J G²/I have no unique motion and must "
        "be refused; the closest is 1e-9 away from this limit. In 40 runs a gear holds a load for 60 s. E1 and "
        "E2."
    ),
    naive="driving torque = efficiency · load torque while the load drives, however small the efficiency, for 1 s",
)
def test_worm() -> list[Figure]:
    rng, wrong, drift, stuck = np.random.default_rng(7), 0, 0.0, 0
    for count in range(200):
        mu = rng.uniform(0.2, 4.0)
        limit = mu * (1.0 + (-1.0) ** count * 10.0 ** rng.uniform(-9, 0) / 2.0) if mu > 1.0 else rng.uniform(1.0, 5.0)
        if limit <= 1.0:
            continue
        scene = worm(1.0 / (1.0 + mu), (limit - 1.0) * LOAD / RATIO**2)
        # The limit as the numbers of the scene make it, for cases that rounding decides.
        exact = 1.0 + (limit - 1.0) * LOAD / RATIO**2 * RATIO**2 / LOAD
        wrong += refused(scene) != (mu >= exact)
    for mu in np.linspace(1.02, 3.0, 20):
        rotor = mu * LOAD / RATIO**2
        needed = (mu - 1.0) * WEIGHT / RATIO
        for solver in (None, Rodas4()):
            held = simulate(worm(1.0 / (1.0 + mu), rotor, -0.999 * needed), solver=solver, interval=1.0)
            drift = max(drift, float(np.abs(held["joint.position"]).max() + np.abs(held["joint.speed"]).max()))
            freed = simulate(worm(1.0 / (1.0 + mu), rotor, -1.001 * needed, 0.5), solver=solver)
            stuck += int(not freed["joint.position"][-1] < 0.0)
    # As many programs have it: what the load gives back is eta of it, and that is not zero.
    speed = angle = 0.0
    for _ in range(1000):
        speed -= 1e-3 * 0.45 * WEIGHT * math.cos(angle) / (LOAD + 1.25 * LOAD)
        angle += 1e-3 * speed
    return [
        Figure("scenes judged incorrectly", float(wrong), at_most=0.0),
        Figure("drift while the load is held", drift, abs(angle), at_most=0.0, unit="rad"),
        Figure("scenes in which 0.1 % more motor torque does not release the load", float(stuck), at_most=0.0),
    ]
