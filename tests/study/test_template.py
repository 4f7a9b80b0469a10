"""What `drivetrain init` writes runs as it is and ends in a verdict, for arms of every kind."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.sizing.search.search import select
from drivetrain.study.read import load_study
from drivetrain.study.template import study_template


def link(name: str, mass: float, com: str = "0 0 0.1") -> str:
    inertia = 'ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"'.format(0.01 * mass)
    body = f'<inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia {inertia}/></inertial>' if mass else ""
    return f'<link name="{name}">{body}</link>'


def joint(name: str, kind: str, links: str, at: str, axis: str = "0 0 1", limit: str = "", more: str = "") -> str:
    parent, child = links.split()
    low, high, speed = (limit or "0 0 0").split()
    bounds = f'<limit lower="{low}" upper="{high}" velocity="{speed}" effort="9"/>' if limit else ""
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/><axis xyz="{axis}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{bounds}{more}</joint>'


UPPER_AND_FORE = [
    link("base", 1), link("upper", 3), link("fore", 2),
    joint("shoulder", "revolute", "base upper", "0 0 0.1", "0 1 0", "-1.5 1.5 2"),
    joint("elbow", "revolute", "upper fore", "0 0 0.4", "0 1 0", "0.5 0.7 0.3"),
]  # fmt: skip
ARMS = {
    "slide": [link("base", 1), link("a", 4), joint("lift", "prismatic", "base a", "0 0 0", limit="0 0.5 0.1")],
    "scara": [
        link("base", 1), link("a", 5, "0.15 0 0"), link("b", 3, "0.12 0 0"), link("quill", 1), link("flange", 0.3),
        joint("j1", "revolute", "base a", "0 0 0.3", limit="-2.3 2.3 4"),
        joint("j2", "revolute", "a b", "0.325 0 0", limit="-2.5 2.5 6"),
        joint("j3", "prismatic", "b quill", "0.275 0 0", "0 0 -1", "-0.15 0 1"),
        joint("j4", "continuous", "quill flange", "0 0 0"),
    ],
    "gantry": [
        link("base", 1), link("x", 30), link("y", 15), link("z", 5),
        joint("x axis", "prismatic", "base x", "0 0 1", "1 0 0", "0 2 1"),
        joint("y: axis", "prismatic", "x y", "0 0 0", "0 1 0", "-0.5 0.5 1"),
        joint("z", "prismatic", "y z", "0 0 0", limit="-0.4 0 0.5"),
    ],
    "gripper": [
        *UPPER_AND_FORE, link("hand", 0.5), link("left", 0.05), link("right", 0.05), link("camera", 0.1),
        joint("wrist", "fixed", "fore hand", "0 0 0.4"),
        joint("l", "prismatic", "hand left", "0 0.02 0", "0 1 0", "0 0.04 0.1"),
        joint("r", "prismatic", "hand right", "0 -0.02 0", "0 -1 0", "0 0.04 0.1", '<mimic joint="l"/>'),
        joint("c", "fixed", "upper camera", "0.05 0 0"),
    ],
    "fixed branches": [
        *UPPER_AND_FORE, link("camera", 0.2), link("tool0", 0), link("flange", 0),
        joint("c", "fixed", "upper camera", "0.05 0 0"), joint("t", "fixed", "fore tool0", "0 0 0.4"),
        joint("f", "fixed", "fore flange", "0 0 0.4"),
    ],
    "mimic": [
        *UPPER_AND_FORE, link("c", 1),
        joint("wrist", "continuous", "fore c", "0 0 0.4", "0 1 0", more='<mimic joint="elbow" multiplier="-1"/>'),
    ],
    "massless": [
        link("base", 0), link("a", 0), link("b", 0), joint("j1", "revolute", "base a", "0 0 0.1", limit="-1 1 0"),
        joint("j2", "continuous", "a b", "0 0 0.4", "0 1 0"),
    ],
}  # fmt: skip


def written(folder: Path, kind: str) -> Path:
    """A study for one of the arms, in a folder beside that of its file."""
    file, study = folder / "files" / f"{kind}.urdf", folder / "studies" / "study.yaml"
    for one in (file, study):
        one.parent.mkdir()
    file.write_text(f'<robot name="{kind}">{"".join(ARMS[kind])}</robot>', encoding="utf-8")
    study.write_text(study_template(str(file), study.parent), encoding="utf-8")
    return study


@pytest.mark.parametrize("kind", ARMS)
def test_every_arm_gets_a_study_that_ends_in_a_verdict(tmp_path: Path, kind: str) -> None:
    study = load_study(written(tmp_path, kind))
    assert study.arm is not None
    found = select(study)
    assert found.feasible and found.proof == "optimal", found.advice
    position, speed = study.cycle.position, np.abs(study.cycle.velocity).max(axis=0)
    assert not any("speed limit" in note for note in study.notes)
    assert len({note.split(": ", 1)[-1] for note in study.notes}) == len(study.notes)  # nothing is said twice
    assert np.ptp(position, axis=0).min() > 0.0
    assert (position >= study.arm.lower - 1e-9).all() and (position <= study.arm.upper + 1e-9).all()
    lower, upper = study.arm.lower, study.arm.upper  # the middle of the range, and a swing of 40 degrees or 0.1 m
    bounded = np.isfinite(lower) & np.isfinite(upper)
    middle = 0.5 * (np.where(bounded, lower, 0.0) + np.where(bounded, upper, 0.0))
    swing = np.minimum(np.where(study.arm.slides, 0.1, np.radians(40.0)), 0.8 * (upper - lower))
    rounding = 1.01 * np.where(study.arm.slides, 0.5e-3, np.radians(0.05))
    assert (np.abs(0.5 * (position.min(axis=0) + position.max(axis=0)) - middle) <= rounding).all()
    assert (np.abs(np.ptp(position, axis=0) - swing) <= 2.0 * rounding).all()
    known = np.isfinite(study.arm.speed_limits) & (study.arm.speed_limits > 0.0)
    assert (speed[known] <= study.arm.speed_limits[known] * (1.0 + 1e-9)).all()


def test_a_hand_is_the_tip_and_not_one_of_its_fingers(tmp_path: Path) -> None:
    text = written(tmp_path, "gripper").read_text(encoding="utf-8")
    assert "\ntip: hand " in text and "joints:\n  default:" in text


def test_the_tip_of_several_chains(tmp_path: Path) -> None:
    """Of two legs the first, down to its fixed foot; or the link that was asked for."""
    legs = [link("trunk", 9)]
    for side in ("left", "right"):
        legs += [link(f"{side}_shank", 2), link(f"{side}_foot", 0.2),
                 joint(f"{side}_hip", "continuous", f"trunk {side}_shank", "0 0 0", "0 1 0"),
                 joint(f"{side}_sole", "fixed", f"{side}_shank {side}_foot", "0 0 -0.4")]  # fmt: skip
    file = tmp_path / "legs.urdf"
    file.write_text(f'<robot name="legs">{"".join(legs)}</robot>', encoding="utf-8")
    assert "\ntip: left_foot # the file has several chains; this" in study_template(str(file))
    asked = study_template(str(file), tip="right_shank")
    assert "\ntip: right_shank # this link" in asked and "right_hip" in asked
    with pytest.raises(InputError, match="no such link"):
        study_template(str(file), tip="tail")


@pytest.mark.parametrize(("shared", "tip"), [(1, "left3"), (2, "chest2"), (3, "chest3")])
def test_the_tip_of_two_arms_is_the_longer_arm_or_their_chest(tmp_path: Path, shared: int, tip: str) -> None:
    """The chest, if at least half of the longer chain moves it: 2 of 4 joints or 3 of 5, but not 1 of 4."""
    longer = 3 if shared == 1 else 2
    names = ["base", *(f"chest{i + 1}" for i in range(shared))]
    chains = [names, [names[-1], *(f"left{i + 1}" for i in range(longer))], [names[-1], "right1"]]
    parts = [link("base", 1)]
    for chain in chains:
        for parent, child in pairwise(chain):
            parts += [link(child, 1), joint(f"to {child}", "continuous", f"{parent} {child}", "0 0 0.2", "0 1 0")]
    file = tmp_path / "two.urdf"
    file.write_text(f'<robot name="two">{"".join(parts)}</robot>', encoding="utf-8")
    assert f"\ntip: {tip} " in study_template(str(file))


def test_a_slide_has_a_screw_and_no_gear(tmp_path: Path) -> None:
    file = written(tmp_path, "slide")
    assert " [mm], ..." in file.read_text(encoding="utf-8")  # the header that a recording would have
    (task,) = load_study(file).joints
    assert task.travel_per_turn == pytest.approx(0.01 / math.tau) and {gear for _, gear in task.pairs} == {""}


def test_a_file_is_named_from_the_folder_of_the_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, "slide")
    monkeypatch.chdir(tmp_path)
    assert "\narm: ../files/slide.urdf\n" in study_template("files/slide.urdf", Path("studies"))
    assert "\narm: files/slide.urdf\n" in study_template("files/slide.urdf")
