"""What no sheet holds and a study states: loops at samples, encoders, cogging; in scenes, tables and the choice."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.accuracy.auto import choose_effects, estimates
from drivetrain.accuracy.costs import run_to_end
from drivetrain.accuracy.decision import basis_of
from drivetrain.accuracy.scenes import LABELS, choices, full_scene, wanted_scene, without
from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop, SampledCascade
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.effect import Effect
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop, SampledCurrentLoop
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.winding import Winding
from drivetrain.errors import InputError
from drivetrain.simulation.cost_results import Choice
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene
from drivetrain.sizing.results import Evaluation
from drivetrain.study.parts.simulation import AddedEffect, Control, Teeth

STATED = """
simulation:
  effects: all
  control:
    default: {rate: 1 kHz, amplifier_rate: 10 kHz, delay: 1, encoder_bits: 17}
    joint_5: {sampled: false}
    joint_6: {amplifier_rate: null, encoder_bits: 12}
  cogging:
    default: {amplitude: 4 mN m, periods: 48}
    joint_1: {amplitude: 0 N m}
    joint_2: {amplitude: 6 mN m}
"""


def written(folder: Path, more: str) -> Path:
    """The PUMA's study with an inductance in every sheet, and something more."""
    shutil.copytree(Path(__file__).resolve().parents[2] / "examples" / "puma560", folder)
    text = (folder / "study.yaml").read_text(encoding="utf-8")
    text = text.replace("    torque_constant:", "    inductance: 3 mH\n    torque_constant:")
    (folder / "study.yaml").write_text(text + more, encoding="utf-8")
    return folder / "study.yaml"


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory: pytest.TempPathFactory) -> Evaluation:
    return dt.evaluate(dt.load_study(written(tmp_path_factory.mktemp("stated") / "puma", STATED)))


@pytest.fixture(scope="module")
def full(evaluation: Evaluation) -> Scene:
    return full_scene(evaluation)


def of_kind(scene: Scene, joint: str, kind: type[Effect]) -> list[Effect]:
    return [effect for effect in scene.effects[joint] if isinstance(effect, kind)]


def test_a_joint_of_its_own_goes_over_the_default(evaluation: Evaluation) -> None:
    told = evaluation.study.simulation
    assert told.control["joint_1"] == Control(True, 1e3, 1e4, 1, 17)
    assert told.control["joint_6"] == Control(True, 1e3, None, 1, 12)
    assert "joint_5" not in told.control
    assert "joint_1" not in told.cogging
    assert told.cogging["joint_2"] == Teeth(6e-3, 48)
    assert told.cogging["joint_3"] == Teeth(4e-3, 48)


def test_the_scene_holds_what_is_stated(full: Scene) -> None:
    for joint in ("joint_1", "joint_2", "joint_3", "joint_4"):
        (cascade,) = of_kind(full, joint, SampledCascade)
        (loop,) = of_kind(full, joint, SampledCurrentLoop)
        assert (cascade.every, loop.every) == (1e-3, 1e-4)
        assert of_kind(full, joint, Winding) and of_kind(full, joint, Encoder) == [Encoder(2**17)]
        assert not of_kind(full, joint, PositionLoop) and not of_kind(full, joint, CurrentLoop)
    assert of_kind(full, "joint_5", PositionLoop) and of_kind(full, "joint_5", CurrentLoop)
    assert of_kind(full, "joint_6", SampledCascade) and of_kind(full, "joint_6", CurrentLoop)
    assert not of_kind(full, "joint_1", Cogging)
    assert of_kind(full, "joint_2", Cogging) == [Cogging((6e-3,), (48,))]


def test_sampled_gains_are_those_of_the_continuous_loop(full: Scene, evaluation: Evaluation) -> None:
    """Without samples, steps and teeth it is the scene of a study that states none of them."""
    plain = full_scene(evaluation, type(evaluation.study.simulation)())
    stated = {"SampledCascade", "SampledCurrentLoop", "Encoder", "Cogging"}
    less = without(full, [one for one in choices(full) if one.kind in stated])
    one, other = (run_to_end(plan(scene), FixedStep(5e-4)) for scene in (less, without(plain, ())))
    assert of_kind(less, "joint_1", CascadeLoop) and of_kind(less, "joint_1", CurrentLoop)
    for name in full.joints:
        np.testing.assert_allclose(one[f"{name}.position"], other[f"{name}.position"], atol=1e-9)
        np.testing.assert_allclose(one[f"{name}.current"], other[f"{name}.current"], atol=1e-5)


def test_what_stands_in_may_be_left_out_too(full: Scene) -> None:
    quick = wanted_scene(full, ())
    for name in full.joints:
        assert of_kind(quick, name, MotorCurrent)
        assert not any(of_kind(quick, name, kind) for kind in (Winding, CurrentLoop, SampledCurrentLoop, Cogging))
    inductive = wanted_scene(full, ("inductance",))
    assert all(of_kind(inductive, name, CurrentLoop) for name in full.joints)


def test_an_added_effect_stays_where_its_kind_is_left_out_and_acts(evaluation: Evaluation) -> None:
    more = (AddedEffect("joint_1", Cogging, {"amplitudes": (3e-3,), "orders": (12,)}),)
    study = replace(evaluation.study, simulation=replace(evaluation.study.simulation, add=more))
    scene = wanted_scene(full_scene(replace(evaluation, study=study)), (), more)
    assert of_kind(scene, "joint_1", Cogging) == [Cogging((3e-3,), (12,))] and not of_kind(scene, "joint_2", Cogging)
    run = simulate(scene, solver=FixedStep(5e-4), interval=5e-3, duration=0.1)
    turned = 12.0 * run["joint_1.motor_position"]
    np.testing.assert_allclose(run["joint_1.cogging_energy"], 3e-3 / 12.0 * (1.0 - np.cos(turned)), atol=1e-12)


def test_the_sampled_scene_runs_and_feels_its_samples(full: Scene) -> None:
    run = simulate(without(full, ()), solver=FixedStep(5e-4), interval=5e-3)
    assert run.stopped_by is None
    for name in full.joints:
        assert np.abs(run[f"{name}.position"] - run[f"{name}.command_position"]).max() < 0.02
    held = simulate(without(full, ()), solver=FixedStep(1e-4), interval=1e-4, duration=0.02)["joint_2.sampled_current"]
    assert np.count_nonzero(np.diff(held)) <= 20  # once a millisecond


def test_they_are_choices_with_labels_and_estimates(full: Scene) -> None:
    kinds = {one.kind for one in choices(full)}
    assert {"SampledCascade", "SampledCurrentLoop", "Encoder", "Cogging"} <= kinds <= set(LABELS)
    short = replace(full, duration=0.2)
    told = {one.choice: one for one in estimates(short, basis_of(short))}
    fine = told[Choice("Encoder", "joint_1")]
    assert fine.valid and 0.0 < fine.changes["joint_1"].peak_current < 0.05
    assert told[Choice("SampledCascade", "joint_1")].changes["joint_1"].tip > 0.0


def test_the_choice_is_proven_with_them(full: Scene) -> None:
    short = replace(full, duration=0.2)
    found = choose_effects(short, basis_of(short), tolerance=0.1)
    assert found.proof is None or found.proof.proven


def test_stated_gains_are_those_of_the_cascade(evaluation: Evaluation, full: Scene) -> None:
    """Gains that are not stated stay those of the position loop; written out, those change nothing."""
    [usual] = [one for one in full.effects["joint_2"] if isinstance(one, SampledCascade)]
    settings = evaluation.study.simulation

    def cascade(**gains: float) -> SampledCascade:
        control = {**settings.control, "joint_2": replace(settings.control["joint_2"], **gains)}
        scene = full_scene(evaluation, replace(settings, control=control))
        return next(one for one in scene.effects["joint_2"] if isinstance(one, SampledCascade))

    assert cascade(position_gain=usual.position_gain, speed_gain=usual.speed_gain) == usual
    assert cascade(integral_time=0.3) == replace(usual, integral_time=0.3)
    own = cascade(position_gain=3.0, speed_gain=0.07, integral_time=0.3)
    assert (own.position_gain, own.speed_gain, own.integral_time) == (3.0, 0.07, 0.3)


def test_gains_of_a_study(tmp_path: Path) -> None:
    """In the units of amplifiers; 60 rpm are 2 pi rad/s."""
    gains = "position_gain: 1.2 (m/min)/mm, speed_gain: 2 mA/rpm, integral_time: 80 ms"
    path = written(tmp_path / "puma", f"\nsimulation: {{control: {{default: {{{gains}}}}}}}\n")
    control = dt.load_study(path).simulation.control["joint_3"]
    assert control.position_gain == pytest.approx(20.0)
    assert control.speed_gain == pytest.approx(2e-3 * 60.0 / (2.0 * np.pi))
    assert control.integral_time == pytest.approx(0.08)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("control: {joint_7: {}}", "not there"),
        ("control: {default: {rate: 1}}", "Hz"),
        ("control: {default: {rate: 20 kHz}}", "rate of the outer loops"),
        ("control: {default: {amplifier_rate: 2 kHz}}", "above 3142 Hz"),
        ("control: {default: {delay: 3}}", "delay"),
        ("control: {default: {encoder: 17}}", "encoder_bits"),
        ("cogging: {default: {amplitude: 5 mN m}}", "periods"),
        ("cogging: {joint_9: {amplitude: 5 mN m, periods: 84}}", "not there"),
        ("cogging: {default: {amplitude: 5 mm, periods: 84}}", "N m"),
    ],
)
def test_faults_name_place_and_mend(tmp_path: Path, more: str, said: str) -> None:
    path = written(tmp_path / "puma", f"\nsimulation:\n  {more}\n")
    with pytest.raises(InputError, match=said) as error:
        dt.load_study(path)
    assert len(error.value.faults) == 1
    assert "study.yaml" in str(error.value)
