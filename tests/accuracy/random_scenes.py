"""Random scenes with drives of every effect: of one joint, and of an arm of two."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import drivetrain as dt
from drivetrain.accuracy.auto import Estimate, estimates
from drivetrain.accuracy.costs import run_to_end
from drivetrain.accuracy.decision import Basis, basis_of, change, decision
from drivetrain.accuracy.scenes import without
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import WHOLE, Inertia, Scene

MATTERS, TIP_MATTERS = 2e-3, 1e-3  # of a quantity, and rad or m: no decision rests on less
FINE = 1e-4  # s, of the runs that measure
QUANTITIES = ("peak current", "RMS current", "RMS torque", "winding temperature rise", "tip")

Rng = np.random.Generator


def there_and_back(rng: Rng, length: float, joints: tuple[str, ...]) -> Motion:
    """Every joint goes, rests, comes back and rests; smooth, or with jumps of acceleration."""
    rest = float(rng.uniform(0.1, 0.6))
    if rng.random() < 0.5:
        u = np.linspace(0.0, 1.0, 101)
        way = (10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 - 60 * u**3 + 30 * u**4, 60 * u - 180 * u**2 + 120 * u**3)
    else:
        u = np.array([0, 1, 1, 2, 2, 3]) / 3.0
        way = (
            np.array([0.0, 0.25, 0.25, 0.75, 0.75, 1.0]), np.array([0.0, 1.5, 1.5, 1.5, 1.5, 0.0]),
            np.array([4.5, 4.5, 0.0, 0.0, -4.5, -4.5]),
        )  # fmt: skip
    far = rng.choice([-1.0, 1.0], len(joints)) * rng.uniform(0.3, 1.2, len(joints))
    time = np.concatenate([length * u, [length, length + rest], length + rest + length * u])
    time = np.maximum.accumulate(np.concatenate([time, [2 * length + rest, 2 * length + 2 * rest]]))
    q, v, a = (part / length**k for k, part in enumerate(way))
    still = np.zeros(2)
    rows = [np.concatenate(parts) for parts in ((q, still + 1.0, 1.0 - q, still), (v, still, -v, still),
                                                (a, still, -a, still))]  # fmt: skip
    return Motion("there and back", joints, time, *(np.outer(row, far) for row in rows))


def drive(rng: Rng, load: float, torque: float, length: float) -> tuple[list[Effect], float, float]:
    """Effects of a joint that moves a load with some torque; its ratio and rotor."""
    ratio = float(rng.choice([50.0, 100.0, 160.0]))
    rotor = load * 10 ** rng.uniform(-1.3, 0.2) / ratio**2
    constant, resistance = rng.uniform(0.03, 0.12), rng.uniform(0.3, 2.0)
    motor = Motor("m", resistance, constant, inductance=resistance * 10 ** rng.uniform(-4.0, -3.2), rotor_inertia=rotor)
    stiffness = load * (rng.uniform(40.0, 300.0) / length) ** 2
    gear = Gear("g", ratio, efficiency=rng.uniform(0.6, 0.97), stiffness_1=stiffness)
    law = Friction(coulomb=torque / ratio * rng.uniform(1e-3, 0.1), viscous=torque * length / ratio**2 * 0.01)
    outer = 0.0005 * 0.7 / (0.0039 * resistance * (torque / ratio / constant) ** 2) * rng.uniform(10.0, 200.0)
    network = ThermalNetwork(0.4 * outer, outer, 1e6 / outer, 1e7 / outer, 25.0)
    wanted, whole = rng.uniform(20.0, 50.0), load + rotor * ratio**2
    return [
        PositionLoop(whole * wanted**2, 2.0 * whole * wanted, constant),
        CurrentLoop(motor, rng.uniform(2e3, 1e4)),
        MeshLoss(gear), DryFriction(law, "motor"), ViscousFriction(law, "motor"),
        FlexibleJoint(gear, 0.04 * math.sqrt(stiffness * load)), WindingHeat(network),
    ], ratio, rotor  # fmt: skip


def single(seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    load, length = 10 ** rng.uniform(-1.0, 1.0), 10 ** rng.uniform(-0.4, 0.3)
    weight = load * rng.uniform(0.0, 9.0)
    torque = 6.0 * load / length**2 + weight
    effects, ratio, rotor = drive(rng, load, torque, length)
    teeth = Cogging((torque / ratio * rng.uniform(1e-3, 0.03),), (int(rng.choice([12, 24, 84])),))
    motion = there_and_back(rng, length, ("joint",))
    named = {
        "joint": (*effects, teeth, ReflectedRotor(rotor, ratio)),
        WHOLE: (CommandedMotion(motion), StiffSupply(1e6)),
    }
    return warmed(Scene(Inertia(load, weight, rng.uniform(-1.0, 1.0)), named, float(motion.time[-1])))


def pair(seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    arm, length = dt.load_arm("planar-2r"), 10 ** rng.uniform(-0.3, 0.3)
    loads = np.diag(dt.mass_matrix(arm, np.zeros(2)))
    torques = 6.0 * loads / length**2 + np.abs(dt.gravity_torque(arm, np.zeros(2)))
    built = [drive(rng, float(load), float(torque), length) for load, torque in zip(loads, torques, strict=True)]
    geared = dt.with_rotors(arm, [dt.Rotor(ratio, rotor) for _, ratio, rotor in built])
    motion = there_and_back(rng, length, arm.joint_names)
    named = {name: tuple(own) for name, (own, _, _) in zip(arm.joint_names, built, strict=True)}
    return warmed(Scene(geared, named | {WHOLE: (CommandedMotion(motion), StiffSupply(1e6))}, float(motion.time[-1])))


def warmed(scene: Scene) -> Scene:
    """Heat that starts in the periodic state, as that of studies does."""
    full, basis = without(scene, ()), basis_of(scene)
    found, effects = decision(run_to_end(plan(full), FixedStep(1e-3)), full, basis), dict(scene.effects)
    for name, told in found.joints.items():
        effects[name] = tuple(_warm(e, told.rise) if isinstance(e, WindingHeat) else e for e in effects[name])
    return replace(scene, effects=effects)


def _warm(heat: WindingHeat, rise: float) -> WindingHeat:
    net = heat.network
    outer = net.resistance_housing_ambient / (net.resistance_winding_housing + net.resistance_housing_ambient)
    return replace(heat, winding=net.ambient + rise, housing=net.ambient + outer * rise)


Row = tuple[Estimate, str, str, float, float]


def estimated_and_measured(scene: Scene, basis: Basis, step: float = FINE) -> list[Row]:
    """Of every effect at every joint: what it is, joint, quantity, estimate, and what finer runs measure."""
    full, rows = without(scene, ()), []
    base = decision(run_to_end(plan(full), FixedStep(step)), full, basis)
    for told in estimates(scene, basis):
        less = without(scene, [told.choice])
        found = change(decision(run_to_end(plan(less), FixedStep(step)), less, basis), base)
        for joint, guess in told.bound.items():
            pairs = zip(QUANTITIES, (*guess.shares, guess.tip), (*found[joint].shares, found[joint].tip), strict=True)
            rows += [(told, joint, what, one, abs(other)) for what, one, other in pairs if not math.isnan(other)]
    return rows


def follows(scene: Scene) -> bool:
    """Whether every joint stays near its command: a loop that swings up without end decides nothing."""
    full = without(scene, ())
    joints = decision(run_to_end(plan(full), FixedStep(1e-3)), full, basis_of(scene)).joints
    return all(one.deviation < 0.1 for one in joints.values())


def ratio(row: Row) -> float:
    """Estimate over measurement, both at least what matters."""
    least = TIP_MATTERS if row[2] == "tip" else MATTERS
    return max(row[3], least) / max(row[4], least)
