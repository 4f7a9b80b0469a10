"""Scenes of studies: the inverse engine and the forward one agree with what sizing computes by another road."""

from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.motor import torque_constant
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse, demanded
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene, joint_scene
from drivetrain.simulation.study_scene import SceneOptions, scene_of, with_feed_forward
from drivetrain.sizing.results import Evaluation

STUDY = Path(__file__).resolve().parents[2] / "examples" / "puma560" / "study.yaml"


@pytest.fixture(scope="module")
def evaluation() -> Evaluation:
    return dt.evaluate(dt.load_study(STUDY))


@pytest.fixture(scope="module")
def scene(evaluation: Evaluation) -> Scene:
    return scene_of(dt.load_study(STUDY), {name: joint.drive for name, joint in evaluation.joints.items()})


def test_inverse_engine_gives_the_motor_torques_of_sizing(evaluation: Evaluation, scene: Scene) -> None:
    times = evaluation.joints[scene.joints[0]].series.time
    alone = times[np.isin(times, times[1:][np.diff(times) > 0.0]) & ~np.isin(times, times[1:][np.diff(times) == 0.0])]
    demand = demanded(plan(scene), alone)
    for i, name in enumerate(scene.joints):
        series = evaluation.joints[name].series
        wanted = series.motor_torque[np.isin(times, alone)]
        # Where the mesh torque passes through zero within rounding the direction of power is anybody's.
        np.testing.assert_allclose(demand.motor_torque[:, i], wanted, atol=1e-9 * np.abs(wanted).max())


def test_forward_with_feed_forward_draws_the_currents_of_the_inverse_road(scene: Scene) -> None:
    inverse = simulate(scene, solver=Inverse(), interval=0.013)
    forward = simulate(scene, solver=FixedStep(5e-4), interval=0.013)
    assert forward.stopped_by is None
    for name in scene.joints:
        error = forward[f"{name}.position"] - forward[f"{name}.command_position"]
        assert np.abs(error).max() < 1e-5
        peak = np.abs(inverse[f"{name}.current"]).max()
        difference = np.abs(forward[f"{name}.current"] - inverse[f"{name}.current"])
        # At the instants at which a joint stops or sets off both values hold.
        assert np.median(difference) < 1e-4 * peak
        # The loops answer the errors of the step, of some 1e-6 rad, with as much.
        assert np.quantile(difference, 0.97) < 5e-3 * peak


def test_a_command_beyond_the_motor_is_refused_by_the_inverse_and_run_by_the_forward_engine(scene: Scene) -> None:
    first = scene.joints[0]
    weak = dict(scene.effects)
    weak[first] = tuple(
        MotorCurrent(effect.motor, 1.0, effect.voltage) if isinstance(effect, MotorCurrent) else effect
        for effect in scene.effects[first]
    )
    limited = Scene(scene.body, weak, scene.duration, scene.position, scene.speed)
    with pytest.raises(InputError, match=f"{first}.*more than 1 A"):
        simulate(limited, solver=Inverse())
    run = simulate(limited)
    assert np.abs(run[f"{first}.current"]).max() == 1.0
    assert np.abs(run[f"{first}.position"] - run[f"{first}.command_position"]).max() > 1e-3


def test_no_command_nothing_to_invert() -> None:
    with pytest.raises(InputError, match="not commanded"):
        simulate(joint_scene(1.0, [GivenTorque([0.0], [1.0])], 1.0), solver=Inverse())


def test_without_losses_the_current_is_torque_over_constant(evaluation: Evaluation) -> None:
    study = dt.load_study(STUDY)
    drives = {name: joint.drive for name, joint in evaluation.joints.items()}
    bare = scene_of(study, drives, options=SceneOptions(friction=False, mesh=False, heat=False, feed_forward=False))
    run = simulate(with_feed_forward(bare), solver=Inverse())
    name = bare.joints[1]
    series = evaluation.joints[name].series
    constant = torque_constant(drives[name].motor, drives[name].motor.reference_temperature)
    lossless = np.interp(run.time, series.time, series.gear_torque / drives[name].gear.ratio + series.rotor_torque)
    # Between samples of the study the torque bends; joint friction is none in this study.
    inner = (run.time > 0.1) & (run.time < bare.duration - 0.1)
    difference = np.abs(run[f"{name}.current"] * constant - lossless)[inner]
    assert np.quantile(difference, 0.9) < 2e-3 * np.abs(lossless).max()


def test_a_joint_without_a_drive_is_told(evaluation: Evaluation) -> None:
    study = dt.load_study(STUDY)
    with pytest.raises(InputError, match="has no drive"):
        scene_of(study, {})


def test_in_contact_the_inverse_engine_refuses(scene: Scene) -> None:
    wall = TipContact((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1e5)
    touching = Scene(scene.body, scene.effects | {"scene": (*scene.effects["scene"], wall)}, 0.1, scene.position)
    with pytest.raises(InputError, match=r"TipContact of scene.*does not know"):
        simulate(touching, solver=Inverse())
