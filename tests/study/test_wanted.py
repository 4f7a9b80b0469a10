"""What a study wants of a selection: weights, constraints, limits; every fault at once with the nearest name."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from drivetrain.study.parts.selection import Wanted, family
from drivetrain.study.schema import json_schema


def test_a_silent_study_wants_the_least_mass(load: Any) -> None:
    study = load()
    assert study.wanted == Wanted((("mass", 1.0),), None, None, (), 5, 30.0, None)
    assert study.objective == "mass"


@pytest.mark.parametrize("word", ["mass", "price", "energy"])
def test_a_word_is_one_weight(load: Any, word: str) -> None:
    study = load({"objective": word})
    assert study.wanted.weights == ((word, 1.0),)
    assert study.objective == word


def test_weights_and_constraints_arrive_in_si(load: Any) -> None:
    told = {
        "sets": 8, "time_limit": "0.5 min", "most_motor_types": 2, "most_gear_types": 3,
        "same_family": [["joint_1", "joint_2"]], "holds": "99 %",
    }  # fmt: skip
    study = load({"objective": {"mass": 2, "energy": "0.5 %", "price": 0}, "selection": told})
    weights = (("mass", 2.0), ("energy", 0.005))
    assert study.wanted == Wanted(weights, 2, 3, (("joint_1", "joint_2"),), 8, 30.0, 0.99)
    assert study.objective == "weighted"


def test_one_weight_other_than_one_is_a_mix_of_its_own(load: Any) -> None:
    assert load({"objective": {"mass": 2}}).objective == "weighted"
    assert load({"objective": {"price": 1}}).objective == "price"


def test_a_plain_list_is_one_group(load: Any) -> None:
    study = load({"selection": {"same_family": ["joint_2", "joint_1", "joint_2"]}})
    assert study.wanted.same_family == (("joint_2", "joint_1"),)


def test_every_fault_of_the_wishes_at_once(faults_of: Any) -> None:
    found = faults_of({
        "objective": {"mass": -1, "cost": 2},
        "selection": {
            "sets": 0, "time_limit": "0 s", "most_motor_types": 0, "most_gear_types": 1.5, "holds": 1,
            "same_family": [["joint_1", "jiont_2"]], "set": 3,
        },
    })  # fmt: skip
    assert set(found) == {
        "objective.mass", "objective.cost", "selection.sets", "selection.time_limit", "selection.most_motor_types",
        "selection.most_gear_types", "selection.holds", "selection.same_family[0]", "selection.set",
    }  # fmt: skip
    assert "'joint_2'" in found["selection.same_family[0]"] and "jiont_2" in found["selection.same_family[0]"]
    assert "sets" in found["selection.set"]
    assert "greater than or equal to 1" in found["selection.sets"]
    assert "below 1" in found["selection.holds"]


@pytest.mark.parametrize(
    ("changes", "place", "words"),
    [
        ({"objective": {}}, "objective", "weight above 0"),
        ({"objective": {"mass": 0}}, "objective", "weight above 0"),
        ({"objective": "mas"}, "objective", "'mass'"),
        ({"objective": {"price": "3 kg"}}, "objective.price", "is a mass"),
        ({"selection": {"holds": 0}}, "selection.holds", "above 0"),
        ({"selection": {"time_limit": 10}}, "selection.time_limit", "unit"),
        ({"selection": {"same_family": ["joint_1"]}}, "selection.same_family", "at least two"),
        ({"selection": {"same_family": [["joint_1", "joint_2"], "joint_1"]}}, "selection.same_family", "mixes"),
        ({"selection": {"same_family": "joint_1"}}, "selection.same_family", "must be a list"),
    ],
)
def test_one_fault(faults_of: Any, changes: dict[str, Any], place: str, words: str) -> None:
    found = faults_of(changes)
    assert set(found) == {place}
    assert words in found[place]


def test_families_are_of_one_maker_and_series(load: Any) -> None:
    motor = load().catalog.motors["small"]
    named = replace(motor, maker="acme", series="RE")
    assert family(named) == family(replace(named, key="other"))
    assert family(named) != family(replace(named, maker="apex"))
    assert family(motor) != family(replace(motor, key="other"))  # no series: alone


def test_editors_know_the_wishes() -> None:
    schema = json_schema()
    told = json.dumps(schema["$defs"]["SelectionForm"])
    assert all(name in told for name in ("time_limit", "same_family", "most_gear_types", "holds"))
    assert {"mass", "price", "energy"} <= set(schema["$defs"]["WeightsForm"]["properties"])
