"""The Python and YAML that README and the pages on own arms, parts and motions print runs as printed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

import drivetrain as dt
from drivetrain.study.template import study_template

ROOT = Path(__file__).resolve().parents[2]
PAGE, ARM_PAGE = ((ROOT / "docs" / f"own_{name}.md").read_text(encoding="utf-8") for name in ("parts", "arm"))


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def executed(text: str) -> dict[str, Any]:
    """The names that the Python blocks of a page leave behind, run one after the other."""
    names: dict[str, Any] = {}
    exec("\n".join(blocks(text, "python")), names)
    return names


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the tables that the pages print."""
    (tmp_path / "parts").mkdir()
    for name, table in re.findall(r"`([\w/]+\.csv)`:\n\n```text\n(.*?)```", PAGE + ARM_PAGE, re.S):
        (tmp_path / name).write_text(table, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_python_of_the_readme() -> None:
    names = executed((ROOT / "README.md").read_text(encoding="utf-8"))
    assert names["chosen"].feasible
    assert len(names["currents"]) > 0


def test_python_of_own_parts() -> None:
    names = executed(PAGE)
    assert [len(joint.pairs) for joint in names["study"].joints] == [6, 6]
    assert names["chosen"].feasible
    assert set(names["checks"]["verdict"]) <= {"PASS", "MARGINAL", "NOT CHECKED"}


def test_python_of_choose_drives(folder: Path) -> None:
    (folder / "my_arm.yaml").write_text(study_template(), encoding="utf-8")
    table = executed((ROOT / "docs" / "choose_drives.md").read_text(encoding="utf-8"))["table"]
    assert list(table) == ["best", "runner-up"] and table["best"].max() <= 1.0


def test_code_of_own_motion(folder: Path) -> None:
    page = (ROOT / "docs" / "own_motion.md").read_text(encoding="utf-8")
    assert executed(page)["drawn"].time[-1] > 1.0
    drawing = (ROOT / "examples" / "ur5_pick_and_place" / "drawing.yaml").read_text(encoding="utf-8")
    fragment, pressed = blocks(page, "yaml")
    told, run = (yaml.safe_load(text)["motions"]["draw"] for text in (fragment, drawing))
    assert told["moves"] == run["moves"] and told["start"] == run["start"]
    forces, study = yaml.safe_load(pressed)["forces"], yaml.safe_load(study_template("planar-2r-bare"))
    (folder / "ground_reaction.csv").write_text("time [s],force_z [N]\n0,0\n1,80\n60,0\n", encoding="utf-8")
    study["cycle"][0]["force"], study["cycle"][2]["force"] = "grinding", "ground"
    (folder / "study.yaml").write_text(yaml.safe_dump({**study, "forces": forces}), encoding="utf-8")
    wrench = dt.load_study(folder / "study.yaml").cycle.tip_wrench
    assert wrench[:, 5].max() == 40.0 and wrench[:, 5].min() < -60.0


def test_yaml_of_own_parts(folder: Path) -> None:
    """In place of the same entries of the study that ``init`` writes; the own parts are those of Python."""
    base = yaml.safe_load(study_template("planar-2r-bare"))
    studies = []
    for text in blocks(PAGE, "yaml"):
        fragment = yaml.safe_load(text)
        joints = {**base["joints"], **fragment["joints"]}
        (folder / "study.yaml").write_text(yaml.safe_dump({**base, **fragment, "joints": joints}), encoding="utf-8")
        studies.append(dt.load_study(folder / "study.yaml"))
    own, braked, catalogue = studies
    assert [one.key for one in braked.joints[0].brakes] == ["B"]
    assert len(braked.joints[1].amplifiers) > 1
    assert own.joints[0].pairs == (("M", "G"),)
    assert len(catalogue.joints[0].pairs) == 6
    in_python: dict[str, Any] = {}
    exec("\n".join(blocks(PAGE, "python")[:2]), in_python)
    for part, key in (("motors", "M"), ("gears", "G")):
        stated = [getattr(study.catalog, part)[key] for study in (own, in_python["study"])]
        assert repr(stated[0]).replace("my sheet", "given in Python") == repr(stated[1])
    assert dt.evaluate(own, {name: ("M", "G") for name in ("joint_1", "joint_2")}).joints


def test_code_of_own_arm(folder: Path) -> None:
    """Each fragment over the study that ``init`` writes, with the own parts of the page before it."""
    own = {**yaml.safe_load(study_template("planar-2r-bare")), **yaml.safe_load(blocks(PAGE, "yaml")[0])}
    own["joints"] = {"default": {"output_bearing": "external", "drive": {"motor": "M", "gear": "G"}}}
    found = []
    for text in blocks(ARM_PAGE, "yaml"):
        fragment = yaml.safe_load(text)
        joints = {**own["joints"], **fragment.get("joints", {})}
        (folder / "study.yaml").write_text(yaml.safe_dump({**own, **fragment, "joints": joints}), encoding="utf-8")
        found.append(dt.evaluate(dt.load_study(folder / "study.yaml")))
    balanced, staged, shared, track, rubbing, closed, ship = found
    assert len(balanced.study.joints[0].counterbalances) == 4
    assert list(track.joints) == ["track", "swivel"] and list(closed.joints) == ["joint_1", "crank"]
    assert list(shared.joints) == ["joint_1", "joint_1_motor_2", "joint_2"]
    assert ship.study.base is not None
    assert rubbing.study.joints[0].friction.load_share == 0.04
    assert "FAIL" not in [
        check.verdict for one in (track, closed) for joint in one.joints.values() for check in joint.checks
    ]
    for joint in staged.joints.values():
        assert "PASS" in [check.verdict for check in joint.checks if check.name == "torque behind the gear"]
    names = executed(ARM_PAGE)
    assert names["joints"].shape == (401, 6) and names["gear"].ratio == 50.0
    assert names["weakest"][0].keys() == {"buckling"} and abs(names["balance"][-1]) < abs(names["balance"][0])
