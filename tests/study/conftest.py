"""A small study of the two-joint arm with a catalogue of its own, to be changed by each test."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from drivetrain.errors import InputError
from drivetrain.study.model import Study
from drivetrain.study.read import load_study

MOTORS = """key,kind,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A],mass [g],source
small,brushless,dc,line_line,1.2,50,200,sheet
large,brushless,rms,phase,0.4,90,900,sheet
"""
GEARS = """key,kind,ratio,mass [g],efficiency [%],source
p20,planetary,20,150,80,sheet
p60,planetary,60,250,75,sheet
"""
PAIRS = """motor_key,gear_keys,source
small,p20 p60,sheet
"""
STUDY: dict[str, Any] = {
    "schema_version": 1,
    "name": "two joints",
    "arm": "planar-2r",
    "drive_mass": "included",
    "payloads": {"part": {"mass": "2 kg"}},
    "motions": {
        "there": {
            "unit": "deg", "profile": "quintic", "durations": ["1 s"], "waypoints": [[0, 0], [90, -45]],
        },
        "back": {
            "unit": "deg", "profile": "quintic", "durations": ["2 s"], "waypoints": [[90, -45], [0, 0]],
        },
    },
    "cycle": [{"motion": "there", "payload": "part"}, {"dwell": "500 ms", "payload": "part"}, {"motion": "back"}],
    "supply": {"voltage": "24 V"},
    "catalogs": "catalog",
    "joints": {"default": {"candidates": {}}, "joint_2": {"drive": {"motor": "small", "gear": "p20"}}},
}  # fmt: skip

Load = Callable[..., Study]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a catalogue."""
    catalog = tmp_path / "catalog"
    catalog.mkdir()
    for name, text in (("motors", MOTORS), ("gears", GEARS), ("compatibility", PAIRS)):
        (catalog / f"{name}.csv").write_text(text, encoding="utf-8")
    return tmp_path


@pytest.fixture
def load(folder: Path) -> Load:
    """Loads the small study with some entries replaced; None takes one out, dots reach inside."""

    def load(changes: dict[str, Any] | None = None) -> Study:
        data = copy.deepcopy(STUDY)
        for path, value in (changes or {}).items():
            *outer, last = path.split(".")
            part = data
            for name in outer:
                part = part[name]
            if value is None:
                del part[last]
            else:
                part[last] = value
        file = folder / "study.yaml"
        file.write_text(yaml.safe_dump(data, sort_keys=False, allow_unicode=True), encoding="utf-8")
        return load_study(file)

    return load


@pytest.fixture
def faults_of(load: Load) -> Callable[..., dict[str, str]]:
    """Loads the small study with faulty entries: the faults by their places."""

    def faults_of(changes: dict[str, Any]) -> dict[str, str]:
        with pytest.raises(InputError) as caught:
            load(changes)
        return {fault.place: f"{fault.problem} | {fault.value} | {fault.hint}" for fault in caught.value.faults}

    return faults_of
