"""A mix in the study file: its shares, its parts, and every fault of it at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetrain.study.model import Study

ROUND: list[dict[str, Any]] = [
    {"motion": "there", "payload": "part"}, {"dwell": "500 ms", "payload": "part"}, {"motion": "back"},
]  # fmt: skip
MIX: dict[str, Any] = {
    "cycle": None,
    "mix": [
        {"name": "loaded", "share": "60 %", "cycle": ROUND},
        {"name": "empty", "share": 0.4, "cycle": [{"motion": "there"}, {"motion": "back"}, {"dwell": "1 s"}]},
    ],
}


def test_a_mix_arrives(load: Any) -> None:
    study: Study = load(MIX)
    cycle = study.cycle
    assert cycle.part_names == ("loaded", "empty") and cycle.shares == pytest.approx((0.6, 0.4))
    assert cycle.duration == pytest.approx(3.5 + 4.0)
    assert [body.name for body in study.payloads] == ["part"]
    assert np.unique(cycle.payload[cycle.parts[1]]).tolist() == [-1]
    for part, share in zip(cycle.parts, cycle.shares, strict=True):
        assert cycle.weights[part].sum() / cycle.duration == pytest.approx(share)


def test_one_part_is_the_plain_cycle(load: Any) -> None:
    plain = load().cycle
    alone = load({"cycle": None, "mix": [{"share": 1, "cycle": ROUND}]}).cycle
    for name in ("time", "position", "velocity", "acceleration", "payload", "segment", "weights"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(plain, name))
    assert alone.parts == plain.parts


def test_a_part_without_a_name_has_a_number(load: Any) -> None:
    parts = [{"share": 0.5, "cycle": ROUND}, {"share": 0.5, "cycle": ROUND}]
    assert load({"cycle": None, "mix": parts}).cycle.part_names == ("part 1", "part 2")


def test_every_fault_at_once(faults_of: Any) -> None:
    found = faults_of({
        "cycle": None,
        "mix": [
            {"name": "one", "share": "60 %", "cycle": [{"motion": "ther"}, {"motion": "back"}]},
            {"name": "one", "share": "30 %", "cycle": [{"motion": "there", "payload": "prt"}, {"motion": "back"}]},
        ],
    })  # fmt: skip
    assert "there" in found["mix[0].cycle[0].motion"] and "part" in found["mix[1].cycle[0].payload"]
    assert "60 % + 30 % is 90 %" in found["mix[1].share"]
    assert "twice" in found["mix[1].name"]


@pytest.mark.parametrize(("mix", "place", "words"), [
    ([], "mix", "at least one part"),
    ([{"share": 1, "cycle": []}], "mix[0].cycle", "at least one entry"),
    ([{"share": "120 %", "cycle": ROUND}], "mix[0].share", "at most"),
    ([{"cycle": ROUND}], "mix[0].share", "missing"),
    ([{"share": 1, "cycle": ROUND, "nme": "x"}], "mix[0].nme", "name"),
    ([{"share": 1, "cycle": [{"motion": "there"}]}], "mix[0].cycle", "close"),
    ([{"share": 0.5, "cycle": ROUND, "name": "a"}] * 2, "mix[1].name", "twice"),
])  # fmt: skip
def test_single_faults(faults_of: Any, mix: list[dict[str, Any]], place: str, words: str) -> None:
    found = faults_of({"cycle": None, "mix": mix})
    assert any(where.startswith(place) and words in text for where, text in found.items()), found


def test_a_mix_beside_a_cycle(faults_of: Any) -> None:
    assert "cannot stand beside cycle" in faults_of({"mix": MIX["mix"]})["mix"]
