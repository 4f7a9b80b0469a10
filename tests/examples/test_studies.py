"""The example studies load: without a doubt about the files, and with the task that their README tells."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.model import DriveMass
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

study_of = cache(load_study)
EXAMPLES = sorted(path.parent.name for path in shipped("examples").glob("*/study.yaml"))


def test_there_are_five() -> None:
    assert {"ur5_pick_and_place", "desktop_arm", "puma560", "one_axis", "mix"} <= set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_loads(name: str) -> None:
    study = study_of(shipped("examples") / name / "study.yaml")
    assert study.description
    assert all(task.drive is not None or task.pairs for task in study.joints)
    assert not [note for note in study.notes if note.startswith("warning:")]
    assert (shipped("examples") / name / "README.md").is_file()


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_command_in_its_readme_is_the_one_for_it(name: str) -> None:
    text = (shipped("examples") / name / "README.md").read_text(encoding="utf-8")
    study = study_of(shipped("examples") / name / "study.yaml")
    command = "size" if all(task.drive for task in study.joints) else "select"
    assert f"drivetrain {command} examples/{name}/study.yaml" in text


@pytest.mark.parametrize("name", EXAMPLES)
def test_where_it_lies_changes_nothing(name: str, tmp_path: Path) -> None:
    source = shipped("examples") / name
    for file in source.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    here, there = study_of(source / "study.yaml"), load_study(tmp_path / "study.yaml")
    assert here.digest == there.digest
    np.testing.assert_array_equal(here.cycle.position, there.cycle.position)


def test_the_payload_is_carried_only_where_the_task_has_it() -> None:
    study = study_of(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    masses = {body.name: body.mass for body in study.payloads}
    carried = np.array([masses[study.cycle.payload_names[i]] for i in study.cycle.payload])
    assert carried.max() == 5.0
    share = np.trapezoid((carried == 5.0).astype(float), study.cycle.time) / study.cycle.duration
    assert 0.3 < share < 0.7
    assert study.drive_mass is DriveMass.REPLACED
    assert all(task.contained is not None for task in study.joints)


def test_the_puma_stays_inside_its_published_ranges() -> None:
    """P. Corke, Visual Control of Robots (1996), table 2.1, of the same Denavit-Hartenberg table."""
    study = study_of(shipped("examples") / "puma560" / "study.yaml")
    lower = np.radians([-180.0, -170.0, -160.0, -180.0, -10.0, -180.0])
    upper = np.radians([180.0, 165.0, 150.0, 180.0, 100.0, 180.0])
    assert (study.cycle.position >= lower).all()
    assert (study.cycle.position <= upper).all()
    ratios = [study.catalog.gears[task.drive[1]].ratio for task in study.joints if task.drive]
    np.testing.assert_allclose(ratios, [-62.6111, 107.815, -53.7063, 76.0364, 71.923, 76.686])
    assert study.joints[0].motor_friction is not None
    assert study.joints[0].motor_friction.coulomb == 0.395
    assert study.joints[0].motor_friction.coulomb_negative == 0.435


def test_the_door_closes_and_its_speed_is_the_derivative_of_its_travel() -> None:
    study = study_of(shipped("examples") / "one_axis" / "study.yaml")
    angle = study.cycle.position[:, 0]
    assert angle.max() == pytest.approx(np.pi / 2, abs=1e-4)  # the table is rounded to 1e-4 rpm
    assert angle[-1] == pytest.approx(0.0, abs=1e-4)
    assert study.arm is None
    assert study.cycle.torque is not None
    # Work of the motion: against seals (2 N m) both ways and wind (3 N m) one way; spring and inertia give all back.
    power = study.cycle.torque[:, 0] * study.cycle.velocity[:, 0]
    assert np.trapezoid(power, study.cycle.time) == pytest.approx((2.0 + 2.0 + 3.0) * np.pi / 2, rel=2e-3)


def test_neither_product_of_the_mix_alone_tells_what_it_needs() -> None:
    """As its README says: all day the heavy one asks for more than the mix does, the light one for less."""
    study = study_of(shipped("examples") / "mix" / "study.yaml")
    cycle = study.cycle
    assert cycle.part_names == ("canisters", "cartons") and cycle.shares == pytest.approx((0.25, 0.75))
    mixed = select(study)
    assert mixed.proof == "optimal" and mixed.evaluation.feasible
    all_day, quick = (replace(study, cycle=_alone(cycle, part)) for part in range(2))
    heavy, light = select(all_day), select(quick)
    assert light.objective < mixed.objective < heavy.objective
    alone = evaluate(all_day, mixed.drives).joints["shoulder_lift_joint"]
    assert [check.name for check in alone.checks if check.verdict is Verdict.FAIL] == ["motor RMS current"]
    joints = evaluate(study, light.drives).joints
    for joint, name in (
        ("elbow_joint", "winding temperature"), ("elbow_joint", "motor RMS current"),
        ("shoulder_lift_joint", "gear repeated peak torque"),
    ):  # fmt: skip
        check = next(check for check in joints[joint].checks if check.name == name)
        assert check.verdict is Verdict.FAIL
    elbow = next(
        one for one in mixed.evaluation.joints["elbow_joint"].checks if one.name == "gear repeated peak torque"
    )
    assert "canisters" in elbow.remark


def _alone(cycle: Cycle, part: int) -> Cycle:
    """One part of a mix as a cycle of its own."""
    rows = cycle.parts[part]
    return replace(
        cycle, time=cycle.time[rows] - cycle.time[rows.start], position=cycle.position[rows],
        velocity=cycle.velocity[rows], acceleration=cycle.acceleration[rows], payload=cycle.payload[rows],
        segment=cycle.segment[rows], parts=(), shares=(1.0,), part_names=(cycle.part_names[part],),
    )  # fmt: skip
