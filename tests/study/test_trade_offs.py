"""What a study may ask for beside the best set: front and curves, every fault at once."""

from __future__ import annotations

import json
from typing import Any

import pytest

from drivetrain.errors import InputError
from drivetrain.study.parts.selection import CurveWanted, TradeOffs, read_curve, read_span
from drivetrain.study.schema import json_schema


def test_a_silent_study_asks_for_nothing(load: Any) -> None:
    study = load()
    assert study.trade_offs == TradeOffs() and not study.trade_offs


def test_front_and_curves_arrive(load: Any) -> None:
    told = {
        "front": ["mass", "energy", "mass"],
        "curves": ["voltage", "cycle_time: 3 s..0.1 min", {"ambient": "0 °C..40 °C"}],
    }
    study = load({"selection": told})
    curves = (CurveWanted("voltage"), CurveWanted("cycle_time", (3.0, 6.0)), CurveWanted("ambient", (0.0, 40.0)))
    assert study.trade_offs == TradeOffs(("mass", "energy"), curves)
    assert study.trade_offs and study.wanted == load().wanted


def test_every_fault_at_once(faults_of: Any) -> None:
    found = faults_of({
        "selection": {
            "front": ["mass", "enrgy"],
            "curves": ["paylod", "voltage: 3 s..8 s", "ambient: 3 °C", "cycle_time: 5 s..4 s", "cycle_time: 0 s..4 s"],
        },
    })  # fmt: skip
    assert set(found) == {"selection.front[1]", *(f"selection.curves[{i}]" for i in range(5))}
    assert "'energy'" in found["selection.front[1]"] and "'payload'" in found["selection.curves[0]"]
    assert "range of two values" in found["selection.curves[2]"] and "above" in found["selection.curves[3]"]
    assert "above 0" in found["selection.curves[4]"]


@pytest.mark.parametrize(
    ("selection", "place", "words"),
    [
        ({"front": "mass"}, "selection.front", "must be a list"),
        ({"curves": "voltage"}, "selection.curves", "must be a list"),
        ({"curves": [3]}, "selection.curves[0]", "must name what is varied"),
        ({"curves": ["voltage", "voltage: 20 V..30 V"]}, "selection.curves[1]", "twice"),
    ],
)
def test_one_fault(faults_of: Any, selection: dict[str, Any], place: str, words: str) -> None:
    found = faults_of({"selection": selection})
    assert set(found) == {place}
    assert words in found[place]


def test_a_payload_is_varied_only_where_one_is_carried(faults_of: Any) -> None:
    cycle = [{"motion": "there"}, {"motion": "back"}]
    found = faults_of({"payloads": None, "cycle": cycle, "selection": {"curves": ["payload"]}})
    assert "no payload" in found["selection.curves[0]"]


def test_ends_are_told_one_by_one() -> None:
    with pytest.raises(InputError) as caught:
        read_span("payload", ("-1 kg", "8"), ("--curve-from", "--curve-to"))
    assert [fault.place for fault in caught.value.faults] == ["--curve-from", "--curve-to"]
    assert read_curve(" payload :0 kg..8000 g") == CurveWanted("payload", (0.0, 8.0))


def test_editors_know_them() -> None:
    told = json.dumps(json_schema()["$defs"]["SelectionForm"])
    assert all(name in told for name in ("front", "curves", "utilisation", "cycle_time"))
