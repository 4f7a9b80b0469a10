"""Which pairs may drive a joint: filters, pairing, order, and what was excluded in words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.study.document import Document
from drivetrain.study.faults import Ledger
from drivetrain.study.parts.candidates import candidate_pairs
from drivetrain.study.parts.rules import CandidatesForm

PLACE = ("joints", "elbow", "candidates")


def motor(key: str, mass: float | None, **more: Any) -> Motor:
    return Motor(key, 1.0, 0.1, maker="Acme", series="S", mass=mass, **more)


CATALOG = Catalog(
    motors={
        "heavy": motor("heavy", 2.0, nominal_voltage=24.0),
        "light": motor("light", 0.5, nominal_voltage=48.0),
        "bare": motor("bare", 0.7, nominal_voltage=48.0, frameless=True, diameter=0.06),
        "unknown": motor("unknown", None),
    },
    gears={
        "p10": Gear("p10", 10.0, maker="Acme", kind="planetary", mass=0.3),
        "p100": Gear("p100", -100.0, maker="Other", kind="planetary", mass=0.2),
        "sw100": Gear("sw100", 100.0, maker="Other", kind="strain_wave", mass=0.4, pitch_diameter=0.05, size=20),
    },
    pairs={"heavy": frozenset({"p10", "p100"}), "light": frozenset({"p100"})},
)


def pairs(**form: Any) -> tuple[list[tuple[str, str]], tuple[str, ...], Ledger]:
    ledger = Ledger(Document(Path("study.yaml"), b"", {}, {}))
    found, words = candidate_pairs(CandidatesForm.model_validate(form), CATALOG, ledger, PLACE)
    return list(found), words, ledger


def test_published_pairs_and_the_rule_for_frameless_motors_lightest_first() -> None:
    found, words, ledger = pairs()
    # Combined masses: 0.7, 1.1, 2.2, 2.3 kg; the frameless motor is 1.2 times as wide as the gear's pitch circle.
    assert found == [("light", "p100"), ("bare", "sw100"), ("heavy", "p100"), ("heavy", "p10")]
    assert "4 of 12 combinations" in words[2]
    assert ledger.faults == []


def test_the_order_does_not_depend_on_the_order_of_the_catalogue() -> None:
    turned = Catalog(
        dict(reversed(CATALOG.motors.items())), dict(reversed(CATALOG.gears.items())), CATALOG.pairs, CATALOG.notes
    )
    ledger = Ledger(Document(Path("study.yaml"), b"", {}, {}))
    form = CandidatesForm.model_validate({"pairs": "all"})
    assert candidate_pairs(form, CATALOG, ledger, PLACE)[0] == candidate_pairs(form, turned, ledger, PLACE)[0]
    parts = [
        [CATALOG.motors[motor].mass, *([CATALOG.gears[gear].mass] if gear else [])]
        for motor, gear in candidate_pairs(form, CATALOG, ledger, PLACE)[0]
    ]
    masses = [sum(float("inf") if mass is None else mass for mass in pair) for pair in parts]
    assert masses == sorted(masses)
    assert masses[-1] == float("inf")


@pytest.mark.parametrize(
    ("form", "wanted"),
    [
        ({"pairs": "published"}, {("light", "p100"), ("heavy", "p100"), ("heavy", "p10")}),
        ({"frameless_rule": {"max_diameter_ratio": 1.1}}, {("light", "p100"), ("heavy", "p100"), ("heavy", "p10")}),
        ({"motors": {"frameless": True}}, {("bare", "sw100")}),
        ({"motors": {"frameless": False, "mass": ["0 kg", "1 kg"]}}, {("light", "p100")}),
        ({"motors": {"nominal_voltage": ["40 V", None]}, "pairs": "published"}, {("light", "p100")}),
        ({"gears": {"ratio": [50, 160]}}, {("light", "p100"), ("heavy", "p100"), ("bare", "sw100")}),
        ({"gears": {"kind": "PLANETARY", "maker": ["acme"]}}, {("heavy", "p10")}),
        ({"gears": {"keys": ["p10", "sw100"]}}, {("heavy", "p10"), ("bare", "sw100")}),
        ({"gears": "none", "motors": {"keys": ["bare", "light"]}}, {("light", ""), ("bare", "")}),
        ({"pairs": [{"motor": "unknown", "gear": "p10"}, {"motor": "bare", "gear": "none"}]},
         {("unknown", "p10"), ("bare", "")}),
        ({"pairs": "all", "motors": {"mass": ["1 kg", "3 kg"]}, "gears": {"size": [14, 25]}}, {("heavy", "sw100")}),
        ({"motors": {"mass": ["5 kg", None]}}, set()),
    ],
)  # fmt: skip
def test_rules(form: dict[str, Any], wanted: set[tuple[str, str]]) -> None:
    found, _, ledger = pairs(**form)
    assert ledger.faults == []
    assert set(found) == wanted
    assert len(found) == len(wanted)


def test_what_each_rule_put_aside_is_counted() -> None:
    _, words, _ = pairs(motors={"frameless": False, "mass": ["0 kg", "1 kg"]})
    assert words[0].startswith("motors: 1 of 4 considered")
    assert "2 by 'mass: 0 to 1 kg'" in words[0]  # one too heavy, one of unknown mass
    assert "1 by 'frameless: no'" in words[0]
    assert words[1] == "gears: 3 of 3 considered"


@pytest.mark.parametrize(
    ("form", "place", "hint"),
    [
        ({"gears": {"kind": "planetry"}}, "gears.kind", "'planetary'"),
        ({"motors": {"keys": ["ligth"]}}, "motors.keys", "'light'"),
        ({"motors": {"maker": "Acmee"}}, "motors.maker", "'Acme'"),
        ({"pairs": [{"motor": "heavy", "gear": "p11"}]}, "pairs[0].gear", "'p10'"),
    ],
)
def test_names_that_no_row_has_are_faults(form: dict[str, Any], place: str, hint: str) -> None:
    _, _, ledger = pairs(**form)
    assert [fault.place for fault in ledger.faults] == [f"joints.elbow.candidates.{place}"]
    assert hint in ledger.faults[0].hint
