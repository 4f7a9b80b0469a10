"""The study file as text: lines, doubles, syntax errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetrain.errors import InputError
from drivetrain.study.document import place_of, read_document, spelled


def write(folder: Path, text: str) -> Path:
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_lines_are_those_an_editor_shows(tmp_path: Path) -> None:
    text = "# comment\nname: x\n\njoints:\n  elbow:\n    drive:\n      motor: 12\nlist:\n  - a\n  - {b: 1}\n"
    document = read_document(write(tmp_path, text))
    wanted = {"name": 2, "joints": 4, "elbow": 5, "motor": 7}
    for word, line in wanted.items():
        assert text.splitlines()[line - 1].strip().startswith(word)
    assert document.lines["name",] == 2
    assert document.lines["joints", "elbow", "drive", "motor"] == 7
    assert document.lines["list", 1, "b"] == 10
    assert document.where(("joints", "elbow", "absent", "deeper")) == f"{tmp_path / 'study.yaml'}:5"


def test_values_are_those_of_safe_yaml(tmp_path: Path) -> None:
    document = read_document(write(tmp_path, "a: 48 V\nb: [1, 2.5, null, true]\n0123: kept as text\n"))
    assert document.data == {"a": "48 V", "b": [1, 2.5, None, True], "0123": "kept as text"}


def test_every_key_given_twice_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_document(write(tmp_path, "a: 1\nb: {c: 1, c: 2}\na: 2\n"))
    faults = caught.value.faults
    assert [fault.place for fault in faults] == ["b.c", "a"]
    assert "first in line 1" in faults[1].problem
    assert faults[1].file.endswith("study.yaml:3")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [1, 2\nb: 3\n", "is not YAML"),
        ("a:\n\tb: 1\n", "spaces, not tabs"),
        ("- a\n- b\n", "must be a mapping"),
        ("", "must be a mapping"),
        ("a: !!python/object/apply:os.system [echo]\n", "has the tag"),
        ("a: !!python/name:os.system\n", "cannot be read"),
        ("a: &a [*a]\n", "nests too deeply"),
        ("base: &b {x: 1}\nother:\n  <<: *b\n", "plain names"),
    ],
)
def test_what_is_no_study_file_is_told_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read_document(write(tmp_path, text))
    assert words in str(caught.value)
    assert "study.yaml" in str(caught.value)


def test_a_missing_file_and_bytes_that_are_no_text_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_document(tmp_path / "absent.yaml")
    with pytest.raises(InputError, match=r"did you mean 'study\.yaml'"):
        read_document(write(tmp_path, "").with_suffix(".yml"))
    (tmp_path / "latin.yaml").write_bytes("name: Größe\n".encode("latin-1"))
    with pytest.raises(InputError, match="UTF-8"):
        read_document(tmp_path / "latin.yaml")


def test_places_are_spelled_as_paths() -> None:
    assert spelled(("motions", "pick", "waypoints", 2, 0)) == "motions.pick.waypoints[2][0]"
    assert spelled(()) == "the file"


def test_a_text_names_a_place(tmp_path: Path) -> None:
    study = read_document(write(tmp_path, "cycle: [{motion: a}, {dwell: 1 s}]\nsupply: {voltage: 48 V}\n"))
    assert place_of(study, "cycle.1.dwell") == ("cycle", 1, "dwell")
    assert place_of(study, "cycle.0.payload") == ("cycle", 0, "payload")  # the last name may be new
    assert place_of(study, "supply.voltage") == ("supply", "voltage")
    for text in ("cycle.2", "cycle.x", "cycle.-1.dwell", "supply.voltage.unit", "suply.voltage"):
        with pytest.raises(InputError, match="has no entry"):
            place_of(study, text)
