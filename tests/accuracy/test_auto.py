"""The cheapest set of effects within a tolerance: chosen right, proven, and put back where the proof says so."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.accuracy import auto
from drivetrain.accuracy.auto import Estimate, Limits, added, audited, cheapest, choose_effects
from drivetrain.accuracy.costs import effects_cost, run_to_end, solver_cost
from drivetrain.accuracy.decision import basis_of, change, decision, tip_travel
from drivetrain.accuracy.inverse_forward import inverse_against_forward
from drivetrain.accuracy.scenes import choices, full_scene, wanted_scene, without
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.errors import InputError
from drivetrain.simulation.cost_results import Change, Choice
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import Scene
from drivetrain.sizing.results import Evaluation

STUDY = Path(__file__).resolve().parents[2] / "examples" / "puma560" / "study.yaml"
STEP = FixedStep(1e-3)


@pytest.fixture(scope="module")
def evaluation() -> Evaluation:
    return dt.evaluate(dt.load_study(STUDY))


@pytest.fixture(scope="module")
def full(evaluation: Evaluation) -> Scene:
    return full_scene(evaluation)


def told(name: str, share: float, tip: float = 0.0, valid: bool = True) -> Estimate:
    return Estimate(Choice(name, "a"), {"a": Change(share, 0.0, 0.0, 0.0, tip)}, valid, "")


def test_cheapest_set_is_that_of_all_subsets() -> None:
    costs = {f"e{k}": c for k, c in enumerate((5.0, 4.0, 3.0, 2.0, 1.0, 1.0))}
    limits = Limits(0.01, 1e-3)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        listed = [told(f"e{k}", rng.uniform(0.0, 8e-3), rng.uniform(0.0, 6e-4)) for k in range(6)]
        saved = sum(costs[one.kind] for one in cheapest(listed, limits, ("a",), costs))
        best = max(
            sum(costs[one.choice.kind] for one in some)
            for size in range(7)
            for some in combinations(listed, size)
            if added([one.changes for one in some], ("a",))["a"].peak_current <= 0.01
            and added([one.changes for one in some], ("a",))["a"].tip <= 1e-3
        )
        assert saved == best


def test_estimates_that_are_not_valid_are_kept() -> None:
    listed = [told("a1", 1e-4), told("a2", 0.0, valid=False)]
    assert cheapest(listed, Limits(0.01, 1.0), ("a",), {}) == (Choice("a1", "a"),)


def test_auto_on_a_study_is_proven_and_within_its_tolerance(evaluation: Evaluation, full: Scene) -> None:
    found = choose_effects(full, basis_of(full, evaluation), tolerance=0.05, step=1e-3)
    proof = found.proof
    assert proof is not None and proof.proven and not found.restored
    gone = {one.choice.kind for one in found.dropped}
    assert {"MeshLoss", "FullRotor"} <= gone  # lossless gears, small rotors
    kept = {type(effect).__name__ for effects in found.scene.effects.values() for effect in effects}
    assert {"DryFriction", "ViscousFriction"} <= kept and "MeshLoss" not in kept
    for name, measured in proof.measured.items():
        assert abs(measured.peak_current) <= min(0.05, 1.25 * proof.estimate[name].peak_current + 1e-6)
        assert abs(measured.rms_current) <= min(0.05, 1.25 * proof.estimate[name].rms_current + 1e-6)
    assert 0.0 <= proof.audit < 1e-3
    assert proof.chosen.verdict is proof.full.verdict


def test_an_estimate_that_lies_is_found_out_by_the_proof(
    evaluation: Evaluation, full: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = auto.estimates

    def lying(*asked: object) -> tuple[Estimate, ...]:
        return tuple(
            replace(one, changes={name: Change() for name in one.changes}, valid=True) if one.choice == liar else one
            for one in honest(*asked)  # type: ignore[arg-type]
        )

    liar = Choice("DryFriction", "joint_1")
    monkeypatch.setattr(auto, "estimates", lying)
    found = choose_effects(full, basis_of(full, evaluation), tolerance=0.05, step=1e-3)
    assert liar in found.restored
    assert found.proof is not None and found.proof.proven


def test_nothing_goes_within_a_tiny_tolerance(evaluation: Evaluation, full: Scene) -> None:
    found = choose_effects(full, basis_of(full, evaluation), tolerance=1e-7, tip_tolerance=1e-9, step=1e-3)
    assert {one.choice.kind for one in found.dropped} <= {"MeshLoss"}  # its gears lose nothing at all
    with pytest.raises(InputError, match="tolerance"):
        choose_effects(full, basis_of(full, evaluation), tolerance=-1.0)


def test_costs_of_effects_tell_friction_from_lossless_meshes(evaluation: Evaluation, full: Scene) -> None:
    found = effects_cost(full, basis_of(full, evaluation), engine=STEP, rounds=1)
    rows = {row.label: row for row in found.rows}
    assert set(rows) == {"dry friction", "viscous friction", "mesh loss", "rotor as a body"}
    friction = rows["dry friction"].changes["joint_1"]
    assert friction.peak_current < -0.1 and friction.rms_current < -0.1
    assert abs(rows["mesh loss"].changes["joint_1"].peak_current) < 1e-9
    assert all(row.time > 0.0 and row.work > 0.0 for row in found.rows)
    assert found.full.verdict == evaluation.verdict


def test_both_roads_draw_the_same_currents(evaluation: Evaluation, full: Scene) -> None:
    for joint in inverse_against_forward(evaluation, scene=full, engine=STEP).joints.values():
        assert joint.rms[1] == pytest.approx(joint.rms[0], rel=0.01)
        assert joint.peaks[1] == pytest.approx(joint.peaks[0], rel=0.05)
        assert joint.apart_moving < 0.15  # at the jumps of friction the loop answers what the step leaves


def test_solvers_come_nearer_the_more_they_work(evaluation: Evaluation, full: Scene) -> None:
    scene = replace(without(full, ()), duration=0.5)
    basis = replace(basis_of(full, evaluation), evaluation=None, period=None)
    found = solver_cost(
        scene,
        basis,
        steps=(4e-3, 1e-3, 2.5e-4),
        precisions=(1e-3, 1e-5),
        references=(1e-7, 1e-8),
        explicit=(),
        rounds=1,
    )
    fixed = [run.error for run in found.runs if run.family.startswith("fixed")]
    adaptive = [run.error for run in found.runs if run.family.startswith("adaptive")]
    assert found.settled < 1e-5
    assert fixed[0] > fixed[1] > fixed[2] > 2.0 * found.settled
    assert adaptive[1] < 1e-3
    assert all(run.work > 0 and not run.note for run in found.runs)


def test_leaving_everything_out_and_naming_nothing_are_one(full: Scene) -> None:
    bare, none = without(full, choices(full)), wanted_scene(full, [])
    one, other = run_to_end(plan(bare), STEP), run_to_end(plan(none), STEP)
    np.testing.assert_array_equal(one["joint_1.current"], other["joint_1.current"])
    assert not any(isinstance(e, FlexibleJoint) for effects in bare.effects.values() for e in effects)


def test_decision_agrees_with_sizing_and_tells_changes(evaluation: Evaluation, full: Scene) -> None:
    scene = without(full, ())
    run = run_to_end(plan(scene), STEP)
    found = decision(run, scene, basis_of(full, evaluation))
    for name, joint in found.joints.items():
        assert joint.peak_current == pytest.approx(np.abs(run[f"{name}.current"]).max(), rel=1e-12)
        assert joint.rms_current == pytest.approx(np.sqrt(np.mean(run[f"{name}.current"] ** 2)), rel=1e-3)
        assert np.isnan(joint.winding_temperature)  # the sheets of these motors say nothing of heat
    same = change(found, found)
    assert all(part.largest(1.0) == 0.0 for part in same.values())
    assert 0.1 < tip_travel(scene, run) < 2.0
    assert audited(run) < 1e-3
    checks = {check.name for check in found.checks["joint_1"]}
    assert {"motor speed", "motor voltage", "amplifier peak current"} <= checks
