"""One chain: select --write, and what takes its file, a result.json, or the bare study; names of joints cut short."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
from test_cli import CHOICE, GIVEN, Run, Write, run, write  # noqa: F401

import drivetrain as dt
from drivetrain.errors import InputError, whole_names
from drivetrain.study.written import with_drives

ARM = """# An arm of our own
schema_version: 1
name: Two joints
arm: arms/two.urdf # beside this file
drive_mass: included
payloads: {{box: {{mass: 1 kg}}}}
motions:
  go: {{file: 'go.csv'}}
supply: {{voltage: 48 V}}
catalogs: [shipped, "own rows"]
joints:{joints}
safety: {{reserve: 10 %}} # kept
"""
JOINTS = {
    "block": """
  default: # for both
    candidates: {pairs: all}
  elbow_joint:
    # a comment in it
    friction: {coulomb: 0.1 N m}
    brake: # which
      - b1
      - b2
""",
    "flow": " {default: {candidates: {pairs: all}}, elbow_joint: {brake: true}} # all in one",
    "bare": """
    elbow_joint:
    default: {candidates: {pairs: all}}
""",
}
DRIVES = {
    "shoulder_joint": {"motor": "m: 1", "gear": ""},
    "elbow_joint": {"motor": "m2", "gear": "g,2", "brake": "b2"},
}


@pytest.mark.parametrize("style", JOINTS)
def test_the_text_keeps_its_comments_and_finds_its_files(tmp_path: Path, style: str) -> None:
    yaml = pytest.importorskip("yaml")
    study, target = tmp_path / "a" / "study.yaml", tmp_path / "b" / "chosen.yaml"
    study.parent.mkdir()
    study.write_text(ARM.format(joints=JOINTS[style]), encoding="utf-8")
    text = with_drives(study, target, DRIVES)
    before, after = yaml.safe_load(study.read_text(encoding="utf-8")), yaml.safe_load(text)
    assert after["arm"] == "../a/arms/two.urdf" and after["catalogs"] == ["shipped", "../a/own rows"]
    assert after["motions"]["go"]["file"] == "../a/go.csv"
    assert after["joints"]["shoulder_joint"]["drive"] == {"motor": "m: 1", "gear": "none"}
    elbow = after["joints"]["elbow_joint"]
    assert elbow["drive"] == {"motor": "m2", "gear": "g,2"} and elbow["brake"] == "b2"
    for name, value in (before["joints"]["elbow_joint"] or {}).items():
        assert name == "brake" or elbow[name] == value
    kept = [line.partition("#")[2] for line in study.read_text(encoding="utf-8").splitlines() if "#" in line]
    assert all(f"#{comment}" in text for comment in kept)
    same = ("schema_version", "name", "payloads", "supply", "safety")
    assert {name: before[name] for name in same} == {name: after[name] for name in same}
    beside = yaml.safe_load(with_drives(study, study.parent / "chosen.yaml", DRIVES))
    assert beside["arm"] == "arms/two.urdf"


def test_joints_written_with_anchors_are_a_message(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    study.write_text(ARM.format(joints="\n  a: &one {brake: true}\n  elbow_joint: *one\n"), encoding="utf-8")
    with pytest.raises(InputError, match="anchors"):
        with_drives(study, tmp_path / "chosen.yaml", DRIVES)


def test_every_command_takes_the_file_of_select_its_result_or_the_bare_study(
    run: Run, write: Write, tmp_path: Path  # noqa: F811
) -> None:  # fmt: skip
    bare = write(drive=CHOICE)
    target = tmp_path / "elsewhere" / "chosen.yaml"
    code, _, errors = run("select", bare, "--write", target, "--out", "sel")
    assert code == 0 and str(target) in errors
    written, result = dt.load_study(target), tmp_path / "sel" / "result.json"
    with pytest.raises(InputError, match="is a result of drivetrain, no study"):
        dt.load_study(result)
    assert [task.drive for task in written.joints] == [("good", "good")]
    wanted = dt.evaluate(written).objective
    sizes, currents = [], []
    for number, source in enumerate((target, result, bare)):
        code, out, errors = run("size", source, "--json", "--out", f"size{number}")
        assert code == 0 and ("selected first" in errors) == (source == bare)
        data = json.loads(out)
        assert data["objective"]["value"] == pytest.approx(wanted)
        sizes.append(data["joints"])
        assert run("currents", source, "--out", f"c{number}.csv")[0] == 0
        with (tmp_path / f"c{number}.csv").open(encoding="utf-8") as file:
            currents.append(list(csv.reader(file)))
        assert run("explain", source, "--joint", "doo", "--check", "motor peak t")[1].startswith("door: ")
        assert run("ratio", source, "--joint", "DOOR", "--out", "r")[0] == 0
    assert sizes[0] == sizes[1] == sizes[2] and currents[0] == currents[1] == currents[2]
    bare.write_text(bare.read_text(encoding="utf-8").replace("24 V}", "25 V}"), encoding="utf-8")
    assert "has changed" in run("size", result, "--out", "o")[2]
    bare.unlink()
    code, _, errors = run("size", result, "--out", "o")
    assert code == 2 and "does not exist any more" in errors


def test_a_required_probability_decides_what_is_written_and_used(run: Run, write: Write) -> None:  # noqa: F811
    """The light motor holds with nominal values, and in half of the samples."""
    checks = dt.evaluate(dt.load_study(write())).joints["door"].checks
    (required,) = (check.required for check in checks if check.name == "motor peak current")
    assert required is not None
    file = write(drive="candidates: {pairs: [{motor: good, gear: good}, {motor: light, gear: good}]}")
    text = file.read_text(encoding="utf-8")
    start, end = text.index("  good:"), text.index("gears:")
    light = text[start:end].replace("good:", "light:").replace("0.5 kg", "0.4 kg")
    light = light.replace("peak_current: 30 A", f"peak_current: {1.01 * required} A")
    asked = "tolerances: {torque_constant: 10 %, samples: 200}\nselection: {holds: 99 %}\n"
    file.write_text(text[:end] + light + text[end:] + asked, encoding="utf-8")
    study = dt.load_study(file)
    nominal = dt.select(replace(study, wanted=replace(study.wanted, holds=None)))
    assert nominal.drives["door"] == ("light", "good")
    robust = dt.select(study)
    assert robust.drives["door"] == ("good", "good") and "at least 99 %" in robust.proof
    assert robust.best_sets[0].drives == robust.drives and robust.objective > nominal.objective
    assert run("select", file, "--write", "chosen.yaml", "--out", "o")[0] == 0
    assert dt.load_study("chosen.yaml").joints[0].drive == ("good", "good")
    data = json.loads(run("size", file, "--json", "--out", "s")[1])
    assert data["joints"]["door"]["drive"]["motor"] == "good"
    _, out, _ = run("why-not", file, "--motor", "light")
    assert "light with good meets all limits with nominal values, and was not chosen" in out
    assert "With it at door, no set is known to meet all limits with 99 %: 1 tested" in out


def test_nothing_is_written_where_nothing_fits_or_over_the_study(run: Run, write: Write, tmp_path: Path) -> None:  # noqa: F811
    weak = write(torque="1 N m", drive=CHOICE)
    code, _, errors = run("select", weak, "--write", "chosen.yaml", "--out", "o")
    assert code == 1 and "not written" in errors and not (tmp_path / "chosen.yaml").exists()
    fits = write(drive=CHOICE)
    text = fits.read_text(encoding="utf-8")
    assert run("select", fits, "--write", fits, "--out", "o")[0] == 2 and fits.read_text(encoding="utf-8") == text
    assert run("select", fits, "--write", tmp_path, "--out", "o")[0] == 2
    given = write(drive=GIVEN)
    run("select", given, "--write", "chosen.yaml", "--out", "o")
    assert dt.load_study("chosen.yaml").joints[0].drive == ("good", "good")


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"study_file": 3}', '{"study_file": "a", "joints": {"a": 1}}'])
def test_what_is_no_result_is_a_message(run: Run, tmp_path: Path, text: str) -> None:  # noqa: F811
    (tmp_path / "result.json").write_text(text, encoding="utf-8")
    for command in ("size", "currents", "simulate", "explain", "ratio", "accuracy", "loops"):
        code, _, errors = run(command, "result.json")
        assert code == 2 and "result" in errors, (command, errors)
    assert run("size", "none.json")[0] == 2


NAMES = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "supply"]


@pytest.mark.parametrize(
    ("short", "whole"), [("elbow", "elbow_joint"), ("Pan", "shoulder_pan_joint"), ("1", "wrist_1_joint")]
)
def test_a_name_cut_short_is_the_only_one_it_can_be(short: str, whole: str) -> None:
    assert whole_names("--joint", "joint", [short], NAMES) == whole_names("joints", "joint", short, NAMES) == [whole]


@pytest.mark.parametrize(
    ("short", "words"), [("shoulder", "shoulder_lift_joint"), ("joint", "several"), ("hip", "no joint")]
)
def test_a_name_that_is_short_for_several_or_none_is_a_message(short: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        whole_names("--joint", "joint", ["elbow", short], NAMES)


@pytest.mark.parametrize(("gear", "ratio"), [("good", 1.2), ("none", 25)])
def test_stages_are_behind_the_gear_that_is_written(
    run: Run,  # noqa: F811
    write: Write,  # noqa: F811
    tmp_path: Path,
    gear: str,
    ratio: float,
) -> None:
    """The file names the catalogue's gear; the stages stay the study's, and the drive is the same again."""
    limits = "efficiency: 95 %, torque_limit: 50 N m, speed_limit: 900 rpm"
    belt = f"stages: [{{type: belt, ratio: 2, efficiency: 95 %}}, {{type: gear, ratio: {ratio}, {limits}}}]"
    pairs = CHOICE.replace("gear: good", f"gear: {gear}")
    file = write(torque="100 N m", drive=f"{pairs}\n    output_bearing: external\n    {belt}")
    code, _, errors = run("select", file, "--write", "chosen.yaml", "--out", "o")
    assert code in (0, 1) and "study with its drives" in errors, errors
    first, again = (dt.load_study(tmp_path / name) for name in (file, "chosen.yaml"))
    found = dt.select(first).evaluation.joints["door"]
    assert again.joints[0].drive == (found.motor, found.gear) and found.gear.endswith("+belt+gear")
    assert dt.evaluate(again).joints["door"].checks == found.checks
    assert f"gear: {gear}" in (tmp_path / "chosen.yaml").read_text(encoding="utf-8")
