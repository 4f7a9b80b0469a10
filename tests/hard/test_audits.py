"""Engines and estimates held to account: energy, what is left out, halved steps, commands that have no inverse."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from hard_case import Figure, hard_case
from scipy.integrate import solve_ivp

from drivetrain.accuracy.auto import estimates
from drivetrain.accuracy.costs import run_to_end
from drivetrain.accuracy.decision import basis_of, change, decision
from drivetrain.accuracy.scenes import without
from drivetrain.arm.arm import Arm
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
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.solvers.solver import Rodas4, Solver

MOTOR = Motor("typical", 0.299, 0.0302, inductance=82e-6)
GEAR = Gear("g", 100.0, kind="strain_wave", efficiency=0.8, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4)
WAVE = np.linspace(0.0, 1.0, 201)
SOME: tuple[Effect, ...] = (
    DryFriction(Friction(coulomb=0.015, static=0.025, stribeck_speed=5.0), "motor"),
    DryFriction(Friction(coulomb=0.7)),
    ViscousFriction(Friction(viscous=0.2, viscous_negative=0.3)),
    MeshLoss(GEAR),
    FlexibleJoint(GEAR, 4.0),
    WallSpring(30.0, 0.5, rest=0.1),
    WindingHeat(ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0)),
    CurrentLoop(MOTOR, 6283.0),
)


def subset(number: int) -> Scene:
    """A joint with rotor, motor and a wave of current, and those effects whose bit is set."""
    chosen = [effect for k, effect in enumerate(SOME) if number >> k & 1]
    motor = [] if number >> 7 & 1 else [MotorCurrent(MOTOR)]
    always = [FullRotor(3e-5, 100.0), GivenCurrent(WAVE, 4.0 * np.sin(2.0 * np.pi * WAVE)), StiffSupply(48.0)]
    return joint_scene(Inertia(1.2, weight=3.0), [*always, *motor, *chosen], 1.0)


def unaccounted(solver: Engine | Solver, numbers: range) -> float:
    """Largest energy that is there and should not be, over what went through."""
    worst = 0.0
    for number in numbers:
        run = simulate(subset(number), solver=solver, interval=0.05)
        through = max(np.abs(run["joint.electrical_energy"]).max(), np.ptp(run["stored_energy"]))
        worst = max(worst, float(np.abs(run["energy_error"]).max() / through))
    return worst


def euler_audit() -> float:
    """The same of the plain joint, friction and rotor by semi-implicit Euler at 1 ms."""
    q = v = put_in = lost = worst = through = 0.0
    for k in range(1000):
        torque = 4.0 * math.sin(2.0 * math.pi * k / 1000.0) * 3.02
        drag = 0.7 * math.tanh(v / 0.01)
        before = v
        v += 1e-3 * (torque - drag - 3.0 * math.cos(q)) / 1.5
        q += 1e-3 * v
        put_in += 1e-3 * torque * before
        lost += 1e-3 * drag * before
        through = max(through, put_in)
        worst = max(worst, abs(0.75 * v * v + 3.0 * math.sin(q) - put_in + lost))
    return worst / through


@hard_case(
    "T43",
    "Energy balance with any combination of effects",
    setup=(
        "All 256 subsets of 8 effects. E1 at 80 µs with a winding and at 1 ms without, E2 at 1e-7 for every "
        "third subset."
    ),
    naive="one of them by semi-implicit Euler at 1 ms",
)
def test_energy_of_every_subset() -> list[Figure]:
    return [
        Figure(
            "relative energy unaccounted for (E1 with a winding)",
            unaccounted(FixedStep(8e-5), range(128, 256)),
            euler_audit(),
            at_most=1e-6,
        ),
        Figure("the same (E1 without a winding)", unaccounted(FixedStep(1e-3), range(128)), at_most=1e-6),
        Figure("the same (E2)", unaccounted(Rodas4(1e-7), range(0, 256, 3)), at_most=1e-6),
    ]


def move(duration: float) -> CommandedMotion:
    """A radian of fifth order, and a rest."""
    u = np.linspace(0.0, 1.0, 101)
    time = np.append(u * duration, duration + 0.2)
    parts = (
        np.append(u**3 * (10 - 15 * u + 6 * u * u), 1.0), np.append(30 * u**2 * (1 - u) ** 2, 0.0) / duration,
        np.append(60 * u * (1 - u) * (1 - 2 * u), 0.0) / duration**2,
    )  # fmt: skip
    return CommandedMotion(Motion("move", ("joint",), time, *(part[:, None] for part in parts)))


def moved(duration: float, weight: float, *more: Effect) -> Scene:
    """A servo behind 100:1 on that move, with or without winding and spring."""
    drive = [ReflectedRotor(3.3e-5, 100.0), PositionLoop(2080.0, 104.0, 0.0302), *more]
    if not any(isinstance(effect, CurrentLoop) for effect in more):
        drive.append(MotorCurrent(MOTOR))
    effects = {"joint": tuple(drive), "scene": (move(duration), StiffSupply(500.0))}
    return Scene(Inertia(1.0, weight=weight), effects, duration + 0.2, position=[0.0], speed=[0.0])


@hard_case(
    "T44",
    "Estimated influence of the winding and the spring",
    setup=(
        "40 pairs of scenes: moves of 0.2 to 4 s with and without 19.6 N m, current loops of 1500 and 6283 "
        "rad/s, springs of 1e4 to 1e6 N m/rad."
    ),
    naive="the estimate (L/R) / (duration of the move) for the peak current",
)
def test_estimates() -> list[Figure]:
    fine, small, ratios, naive = FixedStep(2e-4), 1e-3, [], []
    for duration in (0.2, 0.35, 1.0, 4.0):
        for weight in (0.0, 19.6):
            effects = [CurrentLoop(MOTOR, bandwidth) for bandwidth in (1500.0, 6283.0)]
            effects += [FlexibleJoint(Gear("g", 100.0, stiffness_1=k), 0.04 * math.sqrt(k)) for k in (1e4, 1e5, 1e6)]
            for effect in effects:
                scene = moved(duration, weight, effect)
                basis = basis_of(scene)
                (told,) = [one for one in estimates(scene, basis) if one.choice.kind == type(effect).__name__]
                both = [without(scene, gone) for gone in ((), [told.choice])]
                full, less = (decision(run_to_end(plan(one), fine), one, basis) for one in both)
                guess, found = told.changes["joint"], change(less, full)["joint"]
                pairs = zip((*guess.shares[:3], guess.tip), (*found.shares[:3], found.tip), strict=True)
                ratios += [max(one, small) / max(abs(other), small) for one, other in pairs]
                if isinstance(effect, CurrentLoop):
                    naive.append(max(82e-6 / 0.299 / duration, small) / max(abs(found.peak_current), small))
    said = f"{min(naive):.2g} to {max(naive):.2g}"
    return [
        Figure("smallest ratio of estimate to measured change", min(ratios), min(naive), naive_says=said, at_least=0.8),
        Figure("largest ratio of estimate to measured change", max(ratios), max(naive), naive_says=said, at_most=1.5),
    ]


def springy() -> Scene:
    """Spring, mesh, dry friction at both shafts, and a torque that jumps."""
    gear = Gear("hd", 100.0, kind="spur", efficiency=0.8, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4)
    push = GivenTorque([0.0, 0.1, 0.1, 0.4, 0.6], [0.3, 0.6, -0.2, 0.4, 0.0], "motor")
    effects = [
        FlexibleJoint(gear, 20.0), FullRotor(3e-5, 100.0), MeshLoss(gear), push,
        DryFriction(Friction(coulomb=1.0, static=2.0)), DryFriction(Friction(coulomb=0.01, static=0.02), "motor"),
    ]  # fmt: skip
    return joint_scene(Inertia(1.0, weight=15.0), effects, 0.6)


def bang_bang(rtol: float) -> float:
    """scipy on two segments of 5 ms [rad]."""

    def push(t: float) -> float:
        return 840.0 if 0.5 <= t < 0.505 else -840.0 if 0.505 <= t < 0.51 else 0.0

    return float(solve_ivp(lambda t, y: [y[1], push(t)], (0.0, 4.0), [0.0, 0.0], method="BDF", rtol=rtol).y[0, -1])


@hard_case(
    "T45",
    "Refinement reduces the error, and shows its size",
    setup=(
        "A scene with a spring, mesh friction, friction at both shafts, and a torque step. Steps of E1 from 1 "
        "to 0.06 ms, tolerances of E2 from 1e-4 to 1e-8."
    ),
    naive="scipy's BDF on two pulses of 5 ms with tolerances from 1e-4 to 1e-8",
)
def test_refinement() -> list[Figure]:
    scene, figures = springy(), []
    exact = simulate(scene, solver=Rodas4(1e-11), interval=0.01)["joint.position"]
    ladders: tuple[tuple[str, list[Engine | Solver]], ...] = (
        ("E1", [FixedStep(1e-3 / 2**k) for k in range(5)]), ("E2", [Rodas4(10.0**-k) for k in range(4, 9)]),
    )  # fmt: skip
    for name, solvers in ladders:
        runs = [simulate(scene, solver=solver, interval=0.01)["joint.position"] for solver in solvers]
        errors = [float(np.abs(run - exact).max()) for run in runs]
        told = [float(np.abs(a - b).max()) for a, b in pairwise(runs)]
        grows = max(error / min(errors[:k]) for k, error in enumerate(errors) if k)
        off = max(max(error / said, said / error) for error, said in zip(errors, told, strict=False))
        if name == "E1":
            rough = [bang_bang(10.0**-k) for k in (4, 6, 8)]
            naive = abs(rough[0] - 0.021) / max(abs(rough[0] - rough[1]), 1e-30)
            said = f"{abs(rough[0] - 0.021):.2g} rad off, {abs(rough[0] - rough[1]):.1g} rad between two runs"
        figures += [
            # Where friction changes its mode within a step, the error of E1 scatters; that of E2 falls strictly.
            Figure(f"error relative to the smallest one before it ({name})", grows,
                   at_most=10.0 if name == "E1" else 1.0),
            Figure("ratio of the error to the difference of two successive runs, or its inverse", off,
                   naive if name == "E1" else None, naive_says=said, at_most=10.0),
        ]  # fmt: skip
    return figures


def slider(wall: bool, peak: float = math.inf) -> Scene:
    """A mass of 2 kg that is commanded 0.2 m along x, with a wall at 0.1 m or without."""
    home, screws = np.eye(4)[None], np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
    arm = Arm.from_screws(
        home, screws, [2.0], np.eye(3)[None] * 1e-3, tip=np.eye(4), gravity=(0.0, 0.0, 0.0), joint_names=["joint"]
    )
    u = np.linspace(0.0, 1.0, 51)
    parts = (u**3 * (10 - 15 * u + 6 * u * u), 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u))
    motion = CommandedMotion(Motion("in", ("joint",), u, *(0.2 * part[:, None] for part in parts)))
    touch = (TipContact((0.1, 0.0, 0.0), (-1.0, 0.0, 0.0), 5e4, 100.0),) if wall else ()
    drive = (
        ReflectedRotor(1e-5, 200.0), PositionLoop(4000.0, 200.0, 0.05), MotorCurrent(Motor("m", 0.5, 0.05), peak),
    )  # fmt: skip
    return Scene(arm, {"joint": drive, "scene": (motion, *touch)}, 1.0)


@hard_case(
    "T46",
    "A command that presses into a wall, in the inverse engine",
    setup=(
        "0.2 m are commanded with a wall of 5e4 N/m at 0.1 m; and a move needs more than the peak current. Both "
        "must be refused."
    ),
    naive="torques of the commanded motion with the wall force at the commanded position",
)
def test_no_inverse_in_contact() -> list[Figure]:
    refused = 0
    for scene, word in ((slider(True), "touches"), (slider(False, 0.05), "more than")):
        try:
            simulate(scene, solver=Inverse())
        except InputError as error:
            refused += word in str(error)
    assert simulate(slider(False), solver=Inverse())["joint.current"].size  # it does what it can
    felt = float(np.abs(simulate(slider(True))["joint.current"]).max())
    pressed = 5e4 * 0.1 / (200.0 * 0.05)
    said = f"0, and {pressed / felt:.1f} times the current"
    return [Figure("scenes refused, of 2", float(refused), 0.0, naive_says=said, at_least=2.0)]
