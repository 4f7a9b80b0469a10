"""The Jacobian, the arm's part analytic, against central differences of every state alone, over random scenes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from random_arms import EVERY_JOINT, random_arm, rotors_of

import drivetrain as dt
from drivetrain.accuracy.scenes import full_scene
from drivetrain.arm.closures import with_second_motors
from drivetrain.arm.coupling import belts_over, differential, placed, with_coupling
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.payload_change import Body, PayloadChange
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop, SampledCurrentLoop
from drivetrain.effects.motor.given import GivenCurrent, GivenVoltage
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply, SupplyBus
from drivetrain.effects.motor.winding import Winding
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.motion.motion import Motion
from drivetrain.simulation.core import equations, jacobian
from drivetrain.simulation.core.jacobian import sparsity_pattern
from drivetrain.simulation.core.records import AT, parts_of
from drivetrain.simulation.engines import adaptive_step
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.starting import initial_memory
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import WHOLE, Inertia, Scene
from drivetrain.solvers.compiled_function import evaluate
from drivetrain.solvers.solver import Rodas4

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MOTOR = Motor("m", 0.299, 0.0302, inductance=82e-6)
GEAR = Gear(
    "g", 100.0, kind="strain_wave", efficiency=0.8, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4, backlash=1e-3
)
DRAGGED = Gear(
    "d", 100.0, mesh_efficiency=0.9, drag_torque=0.02, drag_speed=200.0, drag_speed_exponent=0.72,
    drag_temperature_1=0.04, drag_temperature_2=4e-4, seal_drag_torque=0.01, starting_torque=0.03,
)  # fmt: skip
LAW = Friction(coulomb=0.7, static=1.0, stribeck_speed=0.1, viscous=0.2)
NETWORK = ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0)
TIME = np.linspace(0.0, 1.0, 11)
TABLE = np.sin(5.0 * TIME)
CASCADE: dict[str, Any] = {"position_gain": 20.0, "speed_gain": 0.05, "integral_time": 0.1, "peak_current": 20.0}
ROTORS = (FullRotor(3e-5, 100.0), ReflectedRotor(3e-5, 100.0))
GEARS: tuple[tuple[Effect, ...], ...] = ((), (FlexibleJoint(GEAR, 4.0),), (Backlash(GEAR, 2.0),))
ELECTRIC: tuple[tuple[Effect, ...], ...] = (
    (MotorCurrent(MOTOR, 20.0), GivenCurrent(TIME, TABLE)),
    (Winding(MOTOR, 1.0), GivenVoltage(TIME, TABLE)),
    (CurrentLoop(MOTOR, 3000.0, 20.0), PositionLoop(100.0, 10.0, 0.0302)),
    (CurrentLoop(MOTOR, 3000.0, 20.0, 1.0), CascadeLoop(**CASCADE)),
    (MotorCurrent(MOTOR, 20.0), SampledCascade(**CASCADE, every=1e-3, delay=1), Encoder(4096)),
    (Winding(MOTOR), SampledCurrentLoop(MOTOR, 3000.0, 1e-4, 20.0), GivenCurrent(TIME, TABLE)),
    (GivenTorque(TIME, TABLE, "motor"),),
)
MORE: tuple[Effect, ...] = (
    MeshLoss(GEAR), DryFriction(LAW, "joint"), ViscousFriction(LAW, "motor"), WallSpring(100.0, 1.0, rest=0.1),
    LuGreFriction(1e5, 0.7, 1.0, 0.01, 10.0, 0.1, "joint"), Cogging((0.01, 0.002), (12, 24), (0.0, 0.5)),
    GivenTorque(TIME, TABLE, "joint"), MovingBelt(0.1), HoldingBrake(1.0, 0.5, (0.3,), (0.1,)),
    WindingHeat(NETWORK, 40.0, 30.0, gear_heat=0.6), GearDrag(DRAGGED),
)  # fmt: skip


def random_scene(rng: np.random.Generator) -> Scene:
    """A UR5, a Panda or one joint, every joint with effects of its own."""
    body: Any = (dt.load_arm("ur5"), dt.load_arm("panda"), Inertia(1.2, weight=3.0))[rng.integers(3)]
    names = tuple(body.joint_names) if isinstance(body, dt.Arm) else ("joint",)
    effects: dict[str, tuple[Effect, ...]] = {}
    for name in names:
        own = [ROTORS[rng.integers(2)], *GEARS[rng.integers(3)], *ELECTRIC[rng.integers(len(ELECTRIC))]]
        own += [effect for effect in MORE if rng.random() < 0.35]
        if any(isinstance(one, MovingBelt) for one in own):
            rigid = not any(isinstance(one, FlexibleJoint | Backlash) for one in own)
            left_out = (LuGreFriction, *((MeshLoss, HoldingBrake, GearDrag) if rigid else ()))
            own = [one for one in own if not isinstance(one, left_out)] + [DryFriction(LAW, "joint")]
        effects[name] = tuple({type(one): one for one in own}.values())
    count, whole = len(names), [(StiffSupply(48.0), SupplyBus(48.0, 0.01, 500.0))[rng.integers(2)]]
    places = np.column_stack([np.sin(3.0 * TIME + i) for i in range(count)])
    rates = np.column_stack([3.0 * np.cos(3.0 * TIME + i) for i in range(count)])
    whole.append(CommandedMotion(Motion("m", names, TIME, places, rates, -9.0 * places)))
    if isinstance(body, dt.Arm):
        whole += [TipContact((0.0, 0.0, 5.0), (0.0, 0.0, 1.0), 1e4, 10.0)] if rng.random() < 0.3 else []
        load = Body(2.0, np.array([0.0, 0.0, 0.05]), 1e-3 * np.eye(3))
        whole += [PayloadChange(np.array([0.05]), (load,))] if rng.random() < 0.3 else []
        constants = tuple((name, 0.0302) for name in names)
        whole += [ComputedTorque(20.0, constants)] if rng.random() < 0.3 else []
    return Scene(body, {**effects, WHOLE: tuple(whole)}, 1.0, np.zeros(count), np.zeros(count))


def coupled_scene() -> Scene:
    """A wrist differential, and belts over the second and third joint."""
    coupling = placed(differential(1.0, 0.8), (3, 4), 6) @ placed(belts_over([1.0]), (1, 2), 6)
    body = with_coupling(dt.load_arm("ur5"), coupling)
    own = (FullRotor(3e-5, 100.0), CurrentLoop(MOTOR, 3000.0, 20.0), PositionLoop(100.0, 10.0, 0.0302), MeshLoss(GEAR))
    places = np.column_stack([np.sin(3.0 * TIME + i) for i in range(6)])
    rates = np.column_stack([3.0 * np.cos(3.0 * TIME + i) for i in range(6)])
    whole = (StiffSupply(48.0), CommandedMotion(Motion("m", body.joint_names, TIME, places, rates, -9.0 * places)))
    effects = {name: own for name in body.joint_names}
    return Scene(body, {**effects, WHOLE: whole}, 1.0, np.zeros(6), np.zeros(6))


def shared_scene() -> Scene:
    """Two motors that push against each other at the second joint, each behind a spring and play."""
    body = with_second_motors(dt.load_arm("ur5"), [1])
    own = (CurrentLoop(MOTOR, 3000.0, 20.0), PositionLoop(100.0, 10.0, 0.0302), MeshLoss(GEAR), WindingHeat(NETWORK))
    effects = {name: (*own, *ROTORS[:1]) for name in body.joint_names}
    for k, push in ((1, 20.0), (2, -20.0)):
        name = body.joint_names[k]
        effects[name] = (*effects[name], Backlash(GEAR, 2.0), Preload(MOTOR, push))
    places, rest = np.zeros((11, 7)), np.zeros((11, 7))
    whole = (StiffSupply(48.0), CommandedMotion(Motion("m", body.joint_names, TIME, places, rest, rest)))
    return Scene(body, {**effects, WHOLE: whole}, 1.0, np.zeros(7), np.zeros(7))


def local_scene(seed: int, kind: str) -> Scene:
    """An arm with joints and rotors of all kinds, some behind springs; every effect acts on its own joint only.

    So all joints are perturbed together, and what the arm needs meanwhile is known from its derivatives alone.
    """
    rng, body = np.random.default_rng(seed), random_arm(seed, EVERY_JOINT)
    body = dt.with_rotors(body, rotors_of(seed, "mixed" if kind == "coupled" else kind, body.n))
    if kind == "coupled":
        body = with_coupling(body, placed(differential(1.0, 0.8), (3, 4), 6) @ placed(belts_over([1.0]), (0, 1), 6))
    effects: dict[str, tuple[Effect, ...]] = {}
    for i, (name, rotor) in enumerate(zip(body.joint_names, body.rotors, strict=True)):
        own: list[Effect] = [ViscousFriction(LAW, "motor" if rotor else "joint")]
        if rotor is not None:
            gear = replace(GEAR, ratio=rotor.ratio)
            own += [CurrentLoop(MOTOR, 3000.0, 20.0), PositionLoop(100.0, 10.0, 0.0302), MeshLoss(gear)]
            own += [DryFriction(LAW, "motor")] if i % 2 else [HoldingBrake(100.0, engaged=i == 4)]
            if rng.random() < 0.5 and not (kind == "coupled" and i in (0, 1, 3, 4)):
                own += [GEARS[1 + i % 2][0]]
                own[-1] = replace(own[-1], gear=gear)
        effects[name] = tuple(own)
    load = Body(2.0, np.array([0.0, 0.0, 0.05]), 1e-3 * np.eye(3))
    places = np.column_stack([np.sin(3.0 * TIME + i) for i in range(body.n)])
    rates = np.column_stack([3.0 * np.cos(3.0 * TIME + i) for i in range(body.n)])
    moved = CommandedMotion(Motion("m", body.joint_names, TIME, places, rates, -9.0 * places))
    whole = (StiffSupply(48.0), moved, PayloadChange(np.array([0.05]), (load,)))
    return Scene(body, {**effects, WHOLE: whole}, 1.0, rng.uniform(-1.0, 1.0, body.n), np.zeros(body.n))


def puma_scene() -> Scene:
    """The PUMA 560 of the examples, rigid with dry friction."""
    return full_scene(dt.evaluate(dt.load_study(EXAMPLES / "puma560" / "study.yaml")))


def ready(scene: Scene, rng: np.random.Generator, resting: tuple[int, ...] = ()) -> tuple[Plan, Any, Any, float]:
    """A plan, the memory of its adaptive run, a state at random with friction's modes as they are there, an instant."""
    done = plan(scene)
    sparsity = sparsity_pattern(done)[: done.memory.moving, : done.memory.moving]
    numbers = adaptive_step._with_engine_sections(done, initial_memory(done), sparsity)
    sizes = np.maximum(done.memory.atol[: done.memory.moving] / adaptive_step.REFERENCE_RTOL, 1e-3)
    values = done.memory.view(numbers, "states")["value"][: done.memory.moving]
    state = numbers[values] + 0.3 * sizes * rng.normal(size=done.memory.moving)
    state[[done.body.c + i for i in resting]] = 0.0
    engine = done.memory.view(numbers, "engine")[0]
    engine["modes_fixed"] = 0
    equations.evaluate_rates(numbers, state, 0.1)
    engine["modes_fixed"] = 1
    return done, numbers, state, 0.1


def central(state: Any, t: float, numbers: Any, sizes: Any) -> Any:
    """Every state moved alone, to both sides."""
    found, both = np.empty((len(state), len(state))), np.empty((2, len(state)))
    for j, size in enumerate(sizes):
        step = 1e-6 * max(abs(state[j]), size)
        for k, way in enumerate((1.0, -1.0)):
            moved = state.copy()
            moved[j] += way * step
            both[k] = equations.evaluate_rates(numbers, moved, t)
        found[:, j] = (both[0] - both[1]) / (2.0 * step)
    return found


def small_scene() -> Scene:
    """Two joints, of which one sticks, with a spring and current loops."""
    body, gear = dt.load_arm("planar-2r"), replace(GEAR, ratio=10.0)  # that of its rotors
    own = (CurrentLoop(MOTOR, 3000.0, 20.0), PositionLoop(100.0, 10.0, 0.0302), MeshLoss(gear), WindingHeat(NETWORK))
    effects: dict[str, tuple[Effect, ...]] = {name: (*own, DryFriction(LAW, "motor")) for name in body.joint_names}
    effects[body.joint_names[0]] += (FlexibleJoint(gear, 4.0),)
    places = np.column_stack([np.sin(3.0 * TIME + i) for i in range(2)])
    rates = np.column_stack([3.0 * np.cos(3.0 * TIME + i) for i in range(2)])
    whole = (StiffSupply(48.0), CommandedMotion(Motion("m", body.joint_names, TIME, places, rates, -9.0 * places)))
    return Scene(body, {**effects, WHOLE: whole}, 1.0, np.zeros(2), np.zeros(2))


SCENES = {0: small_scene, 41: shared_scene, 42: coupled_scene}


def differences_off(scene: Scene, rng: np.random.Generator, bound: float, resting: tuple[int, ...] = ()) -> int:
    """Compare the Jacobian with central differences; returns the number of groups of states perturbed together."""
    done, numbers, state, t = ready(scene, rng, resting)
    m = len(state)
    columns = np.zeros((m + 1, m))
    evaluate(equations.right_side(jacobian.jacobian).address, t, state, columns, np.zeros(1), parts_of(numbers))
    found = columns[:m].T
    sizes = done.memory.atol[:m] / adaptive_step.REFERENCE_RTOL
    wanted = central(state, t, numbers, sizes)
    found_rates = equations.evaluate_rates(numbers, state, t)
    scale = np.maximum(np.abs(state), sizes)
    # Rounding of the rates over a move of 1.5e-8, beside what moves the rate most.
    most = np.abs(wanted * scale).max(axis=1, keepdims=True) + np.abs(found_rates)[:, None] + 1e-9
    off = np.abs(found - wanted) * scale / most
    i, j = np.unravel_index(int(off.argmax()), off.shape)
    names = list(done.memory.states)
    assert off.max() < bound, (names[i], names[j], found[i, j], wanted[i, j])
    return int(done.memory.view(numbers, "sections")["count"][AT.groups]) - 1


@pytest.mark.parametrize("seed", range(43))
def test_few_differences_give_what_all_give(seed: int) -> None:
    rng = np.random.default_rng(seed)
    differences_off(SCENES[seed]() if seed in SCENES else random_scene(rng), rng, 1e-5)


@pytest.mark.parametrize("kind", ["coaxial", "balanced", "unbalanced", "mixed", "coupled"])
@pytest.mark.parametrize("seed", range(3))
def test_arm_is_not_perturbed(seed: int, kind: str) -> None:
    """Position, speed, two of a rotor behind a spring, two of the loops: so many groups, however many joints."""
    groups = differences_off(local_scene(seed, kind), np.random.default_rng(seed), 1e-5, (4,))
    assert groups <= (14 if kind == "coupled" else 6)  # shafts of coupled motors share torques


def test_arm_of_an_example_is_not_perturbed() -> None:
    assert differences_off(puma_scene(), np.random.default_rng(0), 1e-6) == 2


def whole_arm(duration: float = 0.5) -> Scene:
    """A UR5 with springs, lossy meshes, current loops and heat in all joints, moved and held."""
    names = dt.load_arm("ur5").joint_names
    u = np.linspace(0.0, 1.0, 101)[:, None]
    far = np.array([0.4, -0.3, 0.5, 0.2, -0.3, 0.4])
    place = np.array([0.2, -1.2, 1.0, 0.3, 0.5, 0.1]) + far * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    speed = far * 30.0 * u**2 * (1.0 - u) ** 2 / (0.8 * duration)
    turn = far * 60.0 * u * (1.0 - 3.0 * u + 2.0 * u**2) / (0.8 * duration) ** 2
    motion = Motion("m", names, 0.8 * duration * u[:, 0], place, speed, turn)
    motor = Motor("m", 0.3, 0.09, inductance=3e-4)
    loops = [(3000.0, 90.0), (6000.0, 180.0), (3000.0, 90.0), (600.0, 15.0), (600.0, 15.0), (300.0, 8.0)]
    effects: dict[str, tuple[Effect, ...]] = {
        name: (
            FullRotor(5e-5, 100.0), FlexibleJoint(GEAR, 4.0), MeshLoss(GEAR), CurrentLoop(motor, 3000.0, 40.0),
            PositionLoop(stiffness, damping, 0.09), WindingHeat(NETWORK, gear_heat=1.0),
        )
        for name, (stiffness, damping) in zip(names, loops, strict=True)
    }  # fmt: skip
    effects[WHOLE] = (StiffSupply(48.0), CommandedMotion(motion))
    return Scene(dt.load_arm("ur5"), effects, duration, place[0], np.zeros(6))


def test_differences_are_counted() -> None:
    scene = whole_arm(0.05)
    done = plan(scene)
    run = simulate(scene, solver=AdaptiveStep(Rodas4(1e-5)))
    counts = run.counters
    m = done.memory.moving
    assert (len(done.memory.states), m) == (66, 48)
    groups = len(jacobian.column_groups(sparsity_pattern(done)[:m, :m], m)[0]) - 1
    assert groups == 8  # states of a joint; those of all joints go together
    stages = 5 * counts["factorisations"]
    fresh = counts["rates"] - stages - (groups + 2) * counts["jacobians"]
    assert counts["jacobians"] <= fresh <= counts["jacobians"] + counts["rejected"] + 300  # one a step, and to look


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4, 1e-5])
def test_a_whole_arm_comes_to_its_end_at_every_tolerance(rtol: float) -> None:
    """At rest, where meshes stick and motors are about to turn, steps that are long see no way out; shorter ones do."""
    scene = whole_arm()
    run = simulate(scene, solver=AdaptiveStep(Rodas4(rtol)), interval=0.01)
    assert run.stopped_by is None
    assert run.counters["steps"] < 1500 and run.counters["rejected"] < 1500
    best = simulate(scene, solver=AdaptiveStep(Rodas4(1e-7)), interval=0.01)
    for name in scene.joints:
        off = np.abs(run[f"{name}.current"] - best[f"{name}.current"]).max()
        assert off < 30.0 * rtol * np.abs(best[f"{name}.current"]).max()
