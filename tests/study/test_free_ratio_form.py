"""A free ratio in a study file: read, and its faults told."""

from __future__ import annotations

import pytest

from drivetrain.errors import InputError
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


def written(tmp_path, entry):
    """The shipped study with one more line for every joint."""
    text = (shipped("examples") / "ur5_pick_and_place" / "study.yaml").read_text(encoding="utf-8")
    path = tmp_path / "study.yaml"
    path.write_text(text.replace("    mount: {carrier: child}\n", f"    mount: {{carrier: child}}\n    {entry}\n", 1))
    return path


def test_range_series_and_motor_are_read(tmp_path):
    entry = "free_ratio: {ratio: [30, 160], series: CSG-2UH, motor: AM_MF0060008_48V}"
    task = load_study(written(tmp_path, entry)).joints[0]
    assert task.free_ratio is not None
    assert (task.free_ratio.low, task.free_ratio.high, task.free_ratio.series) == (30.0, 160.0, "CSG-2UH")
    assert task.free_ratio.motor == "AM_MF0060008_48V" and task.pairs


@pytest.mark.parametrize(
    ("entry", "word"),
    [
        ("free_ratio: {ratio: [160, 30]}", r"\[30, 160\]"),
        ("free_ratio: {ratio: [30, null]}", r"\[30, 160\]"),
        ("free_ratio: {ratio: [30, 160], series: CSG-2UU}", "CSG-2UH"),
        ("free_ratio: {ratio: [30, 160], motor: AM_MF0060008_47V}", "AM_MF0060008_48V"),
        ("free_ratio: {ratios: [30, 160]}", "ratio"),
    ],
)
def test_faults_are_told(tmp_path, entry, word):
    with pytest.raises(InputError, match=word):
        load_study(written(tmp_path, entry))
