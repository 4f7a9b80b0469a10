"""Coupled motors in scenes: shafts, not joints, are what motors, meshes, friction and loops know."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drivetrain as dt
from drivetrain.accuracy.auto import choose_effects
from drivetrain.accuracy.decision import basis_of
from drivetrain.accuracy.scenes import full_scene
from drivetrain.arm.coupling import belts_over, differential, placed, rotor_turns, with_coupling
from drivetrain.arm.rotors import RotorLevel
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import PositionLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse, demanded
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import WHOLE, Scene
from drivetrain.simulation.study_scene import scene_of, with_feed_forward
from drivetrain.solvers.solver import Rodas4

RATIOS = np.array([80.0, 100.0, 60.0, 50.0, -50.0, 70.0])
COUPLED = (3, 4)  # a differential; and belts over the second and third joint
MOTOR = Motor("m", 0.6, 0.07, inductance=6e-4, rotor_inertia=2e-5)
START = np.array([0.1, -1.2, 1.0, 0.3, 0.5, 0.2])


def coupling() -> np.ndarray:
    return placed(differential(1.0, 0.8), COUPLED, 6) @ placed(belts_over([1.0]), (1, 2), 6)


def arm(level: RotorLevel = RotorLevel.FULL) -> dt.Arm:
    rotors = [dt.Rotor(ratio, 2e-5, mass=0.3, carrier=max(i - 2, -1)) for i, ratio in enumerate(RATIOS)]
    return dt.with_rotors(dt.load_arm("ur5"), rotors, level=level, coupling=coupling())


def move(body: dt.Arm, length: float = 0.6) -> Motion:
    u = np.linspace(0.0, 1.0, 121)
    far = np.array([0.8, -0.5, 0.7, 0.6, -0.4, 0.9])
    q, v, a = (np.outer(row, far) for row in (
        10 * u**3 - 15 * u**4 + 6 * u**5, (30 * u**2 - 60 * u**3 + 30 * u**4) / length,
        (60 * u - 180 * u**2 + 120 * u**3) / length**2,
    ))  # fmt: skip
    return Motion("move", body.joint_names, length * u, START + q, v, a)


def pushed(body: dt.Arm, torques: np.ndarray, duration: float = 0.4, **more: tuple[Effect, ...]) -> Scene:
    effects = {
        name: (GivenTorque([0.0], [torque], "motor"), *more.get(name, ()))
        for name, torque in zip(body.joint_names, torques, strict=True)
    }
    return Scene(body, effects, duration, START, np.array([0.2, -0.3, 0.4, 0.5, -0.6, 0.7]))


@pytest.mark.parametrize("level", list(RotorLevel))
def test_motion_is_that_of_forward_dynamics(level: RotorLevel) -> None:
    body, torques = arm(level), np.array([0.1, -0.5, 0.3, 0.1, 0.05, 0.02])
    scene = pushed(body, torques)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[6:], dt.forward_dynamics(body, y[:6], y[6:], rotor_turns(body).T @ torques)])

    exact = solve_ivp(rates, (0.0, 0.4), np.concatenate([START, scene.speed]), "DOP853", rtol=1e-11, atol=1e-11)
    wanted = exact.y[:, -1]
    for solver, close in ((FixedStep(1e-4), 2e-6), (Rodas4(1e-8), 1e-7)):
        run = simulate(scene, solver=solver)
        found = [run[f"{name}.{what}"][-1] for what in ("position", "speed") for name in body.joint_names]
        np.testing.assert_allclose(found, wanted, atol=100 * close)
        np.testing.assert_allclose(found[:6], wanted[:6], atol=close)
        motors = np.array([run[f"{name}.motor_speed"][-1] for name in body.joint_names])
        np.testing.assert_allclose(motors, rotor_turns(body) @ found[6:], rtol=1e-12)


def test_rotors_of_effects_are_those_of_the_arm() -> None:
    torques = np.array([0.1, -0.5, 0.3, 0.1, 0.05, 0.02])
    bare = with_coupling(dt.load_arm("ur5"), coupling())
    for kind, level, where in ((FullRotor, RotorLevel.FULL, None), (ReflectedRotor, RotorLevel.REFLECTED, -1)):
        own = dt.with_rotors(bare, [dt.Rotor(ratio, 2e-5, carrier=where) for ratio in RATIOS], level=level)
        one = simulate(pushed(own, torques))
        effects = {name: (kind(2e-5, ratio),) for name, ratio in zip(bare.joint_names, RATIOS, strict=True)}
        other = simulate(pushed(bare, torques, **effects))
        for name in bare.joint_names:
            np.testing.assert_allclose(one[f"{name}.position"], other[f"{name}.position"], atol=1e-12)


def losses(name: str, index: int) -> tuple[Effect, ...]:
    gear = Gear("g", float(RATIOS[index]), efficiency=0.8)
    side = "shaft" if index in (1, 2, 3, 4) else "joint"
    law = Friction(coulomb=1.5, static=2.0, viscous=0.3)
    joint = (ViscousFriction(Friction(viscous=0.2)),) if side == "shaft" else ()
    return (
        MeshLoss(gear), DryFriction(law, side), ViscousFriction(law, side), *joint,
        DryFriction(Friction(coulomb=0.01), "motor"), ViscousFriction(Friction(viscous=1e-4), "motor"),
    )  # fmt: skip


def driven(body: dt.Arm, *, electrical: str = "quick", losing: bool = True, **kinds: bool) -> Scene:
    """The whole chain: command, loops, motors, losses, heat."""
    network = ThermalNetwork(0.5, 3.0, 20.0, 200.0, 25.0)
    effects: dict[str, tuple[Effect, ...]] = {}
    for i, name in enumerate(body.joint_names):
        inertia = 2.0 if i < 3 else 0.5
        own: list[Effect] = list(losses(name, i)) if losing else []
        if kinds.get("sampled"):
            own += [Encoder(2**16), SampledCascade(20.0, 40.0 * inertia / abs(RATIOS[i]) ** 2 / 0.07)]
        else:
            own.append(PositionLoop(inertia * 40.0**2, 80.0 * inertia, 0.07))
        own.append(CurrentLoop(MOTOR, 4000.0) if electrical == "loop" else MotorCurrent(MOTOR, 200.0))
        own.append(WindingHeat(network))
        effects[name] = tuple(own)
    motion = move(body)
    whole = (CommandedMotion(motion), *((StiffSupply(400.0),) if electrical == "loop" else ()))
    return Scene(body, effects | {WHOLE: whole}, 0.8)


def test_the_inverse_engine_is_inverse_dynamics_and_drive_torques() -> None:
    body = arm()
    scene = driven(body, losing=False)
    times = np.linspace(0.0, 0.6, 41)
    demand = demanded(plan(scene), times)
    motion = move(body)
    q, v, a = demand.position, demand.speed, demand.acceleration
    np.testing.assert_allclose(q[::8], motion.position[::24], atol=1e-12)
    np.testing.assert_allclose(demand.motor_speed, v @ rotor_turns(body).T, atol=1e-10)
    wanted = dt.drive_torques(body, q, v, a)
    np.testing.assert_allclose(demand.mesh_torque, wanted.gear, atol=1e-9)
    np.testing.assert_allclose(demand.motor_torque, wanted.motor, atol=1e-10)
    torque = dt.inverse_dynamics(body, q, v, a)
    np.testing.assert_allclose(demand.motor_torque @ rotor_turns(body), torque, atol=1e-9)
    run = simulate(scene, solver=Inverse(), interval=0.1)
    assert run["shoulder_pan_joint.current"].shape == run.time.shape


@pytest.mark.parametrize("electrical", ["quick", "loop"])
def test_the_whole_chain_follows_and_balances(electrical: str) -> None:
    body = arm()
    scene = with_feed_forward(driven(body, electrical=electrical))
    errors = []
    for step in (4e-4, 2e-4):
        run = simulate(scene, solver=FixedStep(step), interval=step)
        passed = run["stored_energy"].max() - run["stored_energy"].min() + 1.0
        errors.append(float(np.abs(run["energy_error"] - run["energy_error"][0]).max() / passed))
        for name in body.joint_names:
            away = np.abs(run[f"{name}.position"] - run[f"{name}.command_position"])
            assert away.max() < 0.02
    assert max(errors) < 2e-4
    # What motors give less their losses is what comes out: powers by name, at every shaft.
    names = [name for name in run.series if name.endswith("_power")]
    assert any("mesh_power" in name for name in names) and any("shaft_viscous_power" in name for name in names)


def test_both_engines_agree_with_every_loss() -> None:
    body = arm()
    scene = replace(with_feed_forward(driven(body)), duration=0.5)
    fine, exact = (simulate(scene, solver=solver, interval=0.05) for solver in (FixedStep(5e-5), Rodas4(1e-6)))
    for name in body.joint_names:
        np.testing.assert_allclose(fine[f"{name}.position"], exact[f"{name}.position"], atol=2e-5)
        np.testing.assert_allclose(fine[f"{name}.shaft_speed"] if f"{name}.shaft_speed" in fine.series else 0.0,
                                   exact[f"{name}.shaft_speed"] if f"{name}.shaft_speed" in exact.series else 0.0,
                                   atol=2e-3)  # fmt: skip


def test_inverse_currents_are_those_of_the_forward_run() -> None:
    body = arm()
    scene = with_feed_forward(driven(body))
    run, demand = simulate(scene, solver=FixedStep(1e-4), interval=0.01), None
    demand = demanded(plan(scene), run.time)
    moving = (run.time > 0.1) & (run.time < 0.5)
    for i, name in enumerate(body.joint_names):
        apart = np.abs(run[f"{name}.current"] - demand.current[:, i])[moving].max()
        assert apart < 0.02 * np.abs(demand.current[:, i]).max()


def test_a_shaft_that_sticks_sticks_exactly() -> None:
    """One shaft of a differential is held by friction, the other is pulled: the joints move as the free one turns."""
    body = with_coupling(dt.load_arm("planar-2r"), differential())
    body = dt.with_rotors(replace(body, gravity=np.zeros(3)), [dt.Rotor(50.0, 1e-5)] * 2)
    first, second = body.joint_names
    held = DryFriction(Friction(coulomb=50.0), "shaft")
    scene = Scene(body, {first: (held,), second: (GivenTorque([0.0], [2.0], "shaft"),)}, 1.0, np.zeros(2))
    for solver in (FixedStep(1e-3), Rodas4(1e-6)):
        run = simulate(scene, solver=solver, interval=0.01)
        assert (run[f"{first}.shaft_speed"] == 0.0).all() and (run[f"{first}.shaft_position"] == 0.0).all()
        assert abs(run[f"{second}.shaft_position"][-1]) > 0.1
        np.testing.assert_allclose(run[f"{first}.position"], -run[f"{second}.position"], atol=1e-15)


def test_brakes_and_locking_hold_an_hour_without_drift() -> None:
    body, torques = arm(), np.zeros(6)
    locked = {name: (DryFriction(Friction(coulomb=10.0), "motor"),) for name in body.joint_names}
    scene = replace(pushed(body, torques, 100.0, **locked), speed=np.zeros(6))
    run = simulate(scene, solver=FixedStep(0.01), interval=1.0)
    for i, name in enumerate(body.joint_names):
        assert len(np.unique(run[f"{name}.position"])) == 1
        assert run[f"{name}.position"][0] == pytest.approx(START[i], abs=1e-15)


def test_sampled_loops_and_encoders_count_the_motors_turns() -> None:
    body = arm()
    run = simulate(driven(body, sampled=True, losing=False), solver=FixedStep(5e-4), interval=5e-4)
    for i, name in enumerate(body.joint_names):
        counts = run[f"{name}.measured_position"] / (2 * math.pi / 2**16)
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        turned = np.column_stack([run[f"{one}.position"] for one in body.joint_names]) @ rotor_turns(body)[i]
        np.testing.assert_allclose(run[f"{name}.motor_position"], turned, atol=1e-9)


def test_computed_torque_decouples_coupled_motors() -> None:
    body = arm()
    constants = tuple((name, 0.07) for name in body.joint_names)
    effects: dict[str, tuple[Effect, ...]] = {name: (MotorCurrent(MOTOR),) for name in body.joint_names}
    whole = (CommandedMotion(move(body)), ComputedTorque(40.0, constants))
    away = START + np.array([0.02, 0.0, -0.01, 0.03, 0.0, 0.02])
    scene = Scene(body, effects | {WHOLE: whole}, 0.6, away, np.zeros(6))
    run = simulate(scene, solver=FixedStep(1e-4), interval=1e-2)
    error = np.column_stack([run[f"{name}.position"] - run[f"{name}.command_position"] for name in body.joint_names])
    fall = (1.0 + 40.0 * run.time) * np.exp(-40.0 * run.time)
    np.testing.assert_allclose(error, np.outer(fall, error[0]), atol=2e-4)


def test_the_tip_feels_a_wall_through_coupled_joints() -> None:
    body = arm()
    wall = (TipContact((0.0, 0.0, -0.1), (0.0, 0.0, 1.0), 1e4, 20.0),)
    scene = replace(pushed(body, np.zeros(6), 1.0), speed=np.zeros(6))
    scene = replace(scene, effects=scene.effects | {WHOLE: wall})
    run = simulate(scene, solver=FixedStep(2e-4), interval=1e-2)
    assert run["scene.contact_force"].max() > 10.0
    assert np.abs(run["energy_error"] - run["energy_error"][0]).max() < 2e-3 * run["stored_energy"].max()
    exact = simulate(scene, solver=Rodas4(1e-7), interval=1e-2)
    early = run.time < 0.6
    np.testing.assert_allclose(run["elbow_joint.position"][early], exact["elbow_joint.position"][early], atol=2e-3)


def test_what_cannot_be_right_behind_a_coupling_is_refused() -> None:
    body = arm()
    name = body.joint_names[3]
    for effect, said in (
        (FlexibleJoint(Gear("g", 50.0, stiffness_1=1e4)), "behind coupled motors"),
        (DryFriction(Friction(coulomb=1.0)), "coupled to others"),
        (MovingBelt(0.1), "coupled to others"),
    ):
        with pytest.raises(InputError, match=said):
            plan(pushed(body, np.zeros(6), **{name: (effect,)}))
    # A spring at a joint with a motor of its own stays possible beside them.
    ready = plan(pushed(body, np.zeros(6), **{body.joint_names[0]: (FlexibleJoint(Gear("g", 80.0, stiffness_1=1e4)),)}))
    assert ready.body.c == 7


def test_a_spring_beside_coupled_motors_tends_to_rigid() -> None:
    body = arm()
    first = body.joint_names[0]
    rigid = simulate(pushed(body, np.zeros(6), 0.2), solver=FixedStep(1e-4))
    spring = FlexibleJoint(Gear("g", 80.0, stiffness_1=1e8), 1e3)
    soft = simulate(pushed(body, np.zeros(6), 0.2, **{first: (spring,)}), solver=FixedStep(1e-4))
    for name in body.joint_names:
        np.testing.assert_allclose(soft[f"{name}.position"], rigid[f"{name}.position"], atol=1e-5)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> dt.Study:
    """The PUMA as a study file whose wrist is driven through tubes, and whose shoulder by a differential."""
    folder = tmp_path_factory.mktemp("coupled") / "puma560"
    shutil.copytree(Path(__file__).resolve().parents[2] / "examples" / "puma560", folder)
    with (folder / "study.yaml").open("a", encoding="utf-8") as file:
        file.write(
            "\ncoupling:\n  - {joints: [joint_4, joint_5, joint_6], type: belt, passes: [1, -1]}\n"
            "  - {joints: [joint_2, joint_3], type: differential}\n"
        )
    return dt.load_study(folder / "study.yaml")


def test_a_study_with_couplings_takes_what_sizing_computes(study: dt.Study) -> None:
    evaluation = dt.evaluate(study)
    scene = scene_of(study, {name: joint.drive for name, joint in evaluation.joints.items()})
    times = evaluation.joints[scene.joints[0]].series.time
    twice = times[1:][np.diff(times) == 0.0]
    alone = times[~np.isin(times, twice)]
    demand = demanded(plan(scene), alone)
    for i, name in enumerate(scene.joints):
        wanted = evaluation.joints[name].series.motor_torque[np.isin(times, alone)]
        np.testing.assert_allclose(demand.motor_torque[:, i], wanted, atol=1e-9 * np.abs(wanted).max())
    run = simulate(scene, solver=FixedStep(5e-4), interval=5e-3)
    assert run.stopped_by is None
    for name in scene.joints:
        assert np.abs(run[f"{name}.position"] - run[f"{name}.command_position"]).max() < 1e-5
        peak = np.abs(evaluation.joints[name].series.current).max()
        assert np.abs(run[f"{name}.current"]).max() == pytest.approx(peak, rel=0.03)
    assert np.ptp(run["energy_error"]) < 1e-4 * np.ptp(run["stored_energy"])


def test_effects_are_chosen_behind_couplings_too(study: dt.Study) -> None:
    evaluation = dt.evaluate(study)
    full = full_scene(evaluation)
    sprung = {name for name in full.joints if any(isinstance(one, FlexibleJoint) for one in full.effects[name])}
    assert sprung <= {"joint_1"}
    found = choose_effects(full, basis_of(full, evaluation), tolerance=0.05, step=1e-3)
    assert found.proof is None or found.proof.proven
