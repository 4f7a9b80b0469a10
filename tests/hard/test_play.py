"""Play in a gear: flanks that meet, push, part, and come to rest."""

from __future__ import annotations

import math

import numpy as np
from hard_case import Figure, hard_case

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.gear.springs import Backlash
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene
from drivetrain.solvers.solver import Rodas4, Rodas5P, Solver

ROTOR, LOAD, RATIO, PLAY, DAMPING = 0.33, 0.5, 10.0, 2e-3, 50.0  # kg m^2, kg m^2, -, rad, N m s/rad


def gear(stiffness: float) -> Gear:
    """A gear with 1 mrad of play to either side."""
    return Gear("g", RATIO, stiffness_1=stiffness, backlash=PLAY)


def rattled(stiffness: float, solver: Engine | Solver, torque: float, interval: float) -> Recording:
    """The load is pushed one way for a tenth of a second and twice as hard the other; then nothing acts."""
    push = GivenTorque([0.0, 0.1, 0.1, 0.2, 0.2], torque * np.array([1.0, 1.0, -2.0, -2.0, 0.0]))
    effects = [ReflectedRotor(ROTOR / RATIO**2, RATIO), Backlash(gear(stiffness), DAMPING), push]
    return simulate(joint_scene(LOAD, effects, 1.0), solver=solver, interval=interval)


def kelvin_voigt(stiffness: float, torque: float, step: float, duration: float) -> tuple[float, float, float]:
    """Spring and damper where the flanks overlap at the end of a step, semi-implicit Euler.

    Returns:
        Hardest pull [N m], largest twist [rad], most energy that a step has gained over that of the motion [-].
    """
    link = shaft = twist = pull = largest = gained = before = 0.0
    for k in range(round(duration / step)):
        t = k * step
        deep = abs(twist) - 0.5 * PLAY
        push = (stiffness * deep + math.copysign(DAMPING, twist) * (shaft - link)) if deep > 0.0 else 0.0
        pull = max(pull, -push)
        force = math.copysign(push, twist)
        given = torque if t < 0.1 - 1e-9 else -2.0 * torque if t < 0.2 - 1e-9 else 0.0
        link += step * (given + force) / LOAD
        shaft -= step * force / ROTOR
        twist += step * (shaft - link)
        largest = max(largest, abs(twist))
        if not largest < 1e30:
            return math.inf, math.inf, math.inf
        energy = 0.5 * (LOAD * link**2 + ROTOR * shaft**2 + stiffness * max(abs(twist) - 0.5 * PLAY, 0.0) ** 2)
        if t > 0.2:
            gained = max(gained, (energy - before) / energy)
        before = energy
    return pull, largest, gained


@hard_case(
    "T20a",
    "Gear flanks rattle",
    setup=(
        "A backlash of ±1 mrad with flanks of 1e5 and 1e6 N m/rad and damping of 50 N m s/rad. A flank may "
        "push, never pull. E1 at 0.1 ms, and E2."
    ),
    naive="Kelvin-Voigt contact with semi-implicit Euler at 0.1 ms",
)
def test_rattling() -> list[Figure]:
    pull = rise = lost = 0.0
    for stiffness in (1e5, 1e6):
        for solver in (FixedStep(1e-4), Rodas5P(1e-8)):
            run = rattled(stiffness, solver, 10.0, 1e-3)
            late, torque = run.time > 0.201, run["joint.flank_torque"]
            assert np.count_nonzero(np.diff(np.sign(torque[late]))) > 5  # they do rattle
            assert (torque[np.abs(run["joint.deflection"]) < 0.5 * PLAY] == 0.0).all()
            pull = max(pull, float(-(torque * np.sign(run["joint.deflection"])).min()))
            momentum = LOAD * run["joint.speed"] + ROTOR / RATIO * run["joint.motor_speed"]
            lost = max(lost, float(np.abs(momentum[late] / -1.0 - 1.0).max()))
            energy = run["stored_energy"][late]
            rise = max(rise, float(np.diff(energy).max() / energy[0]))
    naive = [kelvin_voigt(stiffness, 10.0, 1e-4, 1.0) for stiffness in (1e5, 1e6)]
    return [
        Figure("largest pulling torque", pull, max(n[0] for n in naive), at_most=0.0, unit="N m"),
        Figure("relative energy gained", rise, max(n[2] for n in naive), at_most=0.0),
        Figure("relative error of the momentum", lost, at_most=1e-12),
    ]


@hard_case(
    "T20b",
    "Gear flanks come to rest under load",
    setup=(
        "2 N m press flanks of 1e6 N m/rad together while friction holds the motor; states after 3 s. E1 at 2 "
        "ms, and E2."
    ),
    naive="semi-implicit Euler at 2 ms",
)
def test_chatter_at_rest() -> list[Figure]:
    effects = [
        ReflectedRotor(ROTOR / RATIO**2, RATIO), Backlash(gear(1e6), DAMPING),
        DryFriction(Friction(coulomb=1.0), "motor"), DryFriction(Friction(coulomb=0.01)),
    ]  # fmt: skip
    scene = joint_scene(Inertia(LOAD, weight=2.0), effects, 5.0, speed=0.05)
    speed, change = 0.0, 0.0
    for solver in (FixedStep(2e-3), Rodas4(1e-6)):
        run = simulate(scene, solver=solver, interval=1e-3)
        late = run.time > 3.0
        speed = max(speed, float(np.abs(run["joint.speed"][late]).max()))
        change = max(change, float(np.ptp(run["joint.flank_torque"][late])))
        assert abs(run["joint.flank_torque"][-1] - 2.0) < 0.0101  # the load, but for what friction holds of it

    link, twist, fastest = 0.05, 1e-3 + 2e-6, 0.0
    for k in range(2500):
        deep = twist - 0.5 * PLAY
        push = max(1e6 * deep - DAMPING * link, 0.0) if deep > 0.0 else 0.0
        link += 2e-3 * (push - 2.0) / LOAD
        twist -= 2e-3 * link
        fastest = max(fastest, abs(link)) if k > 1500 else 0.0
    return [
        Figure("speed", speed, fastest, at_most=0.0, unit="rad/s"),
        Figure("change of the torque", change, at_most=0.0, unit="N m"),
    ]


@hard_case(
    "T21",
    "The backlash is crossed within a step",
    setup=(
        "80 kN m drive a rotor across a backlash of 2 mrad in 0.16 ms against flanks of 1e6 N m/rad. E1 at 1 ms "
        "is compared with E2 at 1e-9."
    ),
    naive="contact test at the ends of steps of 1 ms",
)
def test_gap_crossed_within_a_step() -> list[Figure]:
    run, exact = (rattled(1e6, solver, 4e4, 1e-4) for solver in (FixedStep(1e-3), Rodas4(1e-9)))
    wanted = float(np.abs(exact["joint.deflection"]).max())
    momentum = LOAD * run["joint.speed"] + ROTOR / RATIO * run["joint.motor_speed"]
    _, naive, _ = kelvin_voigt(1e6, 4e4, 1e-3, 1.0)
    return [
        Figure("largest wind-up relative to the reference", float(np.abs(run["joint.deflection"]).max()) / wanted,
               naive / wanted, at_most=1.05),
        Figure("relative error of the speeds at the end", abs(run["joint.speed"][-1] / exact["joint.speed"][-1] - 1.0),
               at_most=1e-3),
        Figure("relative error of the momentum", float(np.abs(momentum[run.time > 0.201] / -4e3 - 1.0).max()),
               at_most=1e-12),
    ]  # fmt: skip


def thrown(seed: int) -> tuple[Gear, float, float, float, float]:
    """A random gear with play, its rotor [kg m^2], load [kg m^2], speed of the load [rad/s] and step [s]."""
    rng = np.random.default_rng(seed)
    step, stiffness, rotor = 10 ** rng.uniform(-4.0, -2.7), 10 ** rng.uniform(3.0, 7.0), 10 ** rng.uniform(-7.0, -3.0)
    box = Gear(
        "g", float(rng.choice([1.0, 10.0, 100.0])), stiffness_1=stiffness, backlash=10 ** rng.uniform(-4.0, -2.0)
    )
    return box, rotor, 10 ** rng.uniform(-2.0, 1.0), 10 ** rng.uniform(-1.0, 1.5), step


def bounced(box: Gear, rotor: float, load: float, speed: float, step: float) -> tuple[float, float]:
    """Most energy that a step has gained over that of the motion, and deepest flank over what all energy can press."""
    kick = GivenTorque([0.0, 20 * step, 20 * step], np.array([1.0, 1.0, 0.0]) * load * speed / (20 * step))
    scene = joint_scene(load, [ReflectedRotor(rotor, box.ratio), Backlash(box), kick], 400 * step)
    run = simulate(scene, solver=FixedStep(step), interval=step)
    free = run.time > 21.5 * step
    energy, twist = run["stored_energy"][free], np.abs(run["joint.deflection"][free])
    pressed = math.sqrt(2.0 * energy[0] / (box.stiffness_1 or math.nan))
    return float(np.diff(energy).max() / energy[0]), float((twist.max() - 0.5 * (box.backlash or 0.0)) / pressed)


def stepped_over(box: Gear, rotor: float, load: float, speed: float, step: float) -> tuple[float, float]:
    """The same with semi-implicit Euler, contact looked for at the ends of steps."""
    stiffness, half, own = box.stiffness_1 or math.nan, 0.5 * (box.backlash or 0.0), rotor * box.ratio**2
    link, shaft, twist, gained, deepest = speed, 0.0, 0.0, 0.0, 0.0
    whole = before = 0.5 * load * link**2
    for _ in range(380):
        force = math.copysign(stiffness * max(abs(twist) - half, 0.0), twist)
        link += step * force / load
        shaft -= step * force / own
        twist += step * (shaft - link)
        deep = max(abs(twist) - half, 0.0)
        energy = 0.5 * (load * link**2 + own * shaft**2 + stiffness * deep**2)
        if not energy < 1e30 * whole:
            return math.inf, math.inf
        gained, deepest = max(gained, (energy - before) / whole), max(deepest, deep)
        before = energy
    return gained, deepest / math.sqrt(2.0 * whole / stiffness)


@hard_case(
    "T20c",
    "Impacts neither gain energy nor pass through a flank",
    setup="20 random gears with flanks of 1e3 to 1e7 N m/rad and rotors of 1e-7 to 1e-3 kg m². E1 at 0.1 to 2 ms.",
    naive="semi-implicit Euler that tests for contact at the ends of steps",
)
def test_impacts_gain_no_energy() -> list[Figure]:
    ours = [bounced(*thrown(seed)) for seed in range(20)]
    naive = [stepped_over(*thrown(seed)) for seed in range(20)]
    return [
        Figure("relative energy gained in a step", max(max(gain for gain, _ in ours), 0.0),
               max(gain for gain, _ in naive), at_most=1e-9),
        Figure("deepest penetration relative to that by all energy", max(deep for _, deep in ours),
               max(deep for _, deep in naive), at_most=1.0 + 1e-9),
    ]  # fmt: skip
