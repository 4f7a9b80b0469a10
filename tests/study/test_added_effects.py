"""Effects that a study adds by their names: built of their own fields, with units; every fault at its place."""

from __future__ import annotations

import math
import typing
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.drive import Drive
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.errors import InputError
from drivetrain.simulation.study_scene import SceneOptions
from drivetrain.study.form import attribute_words, form_of
from drivetrain.study.parts.simulation import drive_fields, known_effects, read_effects
from drivetrain.units import factor

# Other tests define effects of their own, which are known too once their modules are imported.
SHIPPED = [kind for kind in known_effects().values() if kind.__module__.startswith("drivetrain.effects.")]


@dataclass(frozen=True)
class SpringToGround(Effect):
    """An effect that the package does not know: a class is all that it takes.

    Attributes:
        stiffness: [N m/rad].
        rest: Position at which it is at rest [rad].
    """

    stiffness: float
    rest: float = 0.0

    def ports(self, place: Place) -> Ports:
        return Ports()

    def numbers(self, place: Place) -> Sequence[float]:
        return (self.stiffness, self.rest)


def added(load: Any, *entries: dict[str, Any]) -> Any:
    return load({"simulation": {"add": list(entries)}})


def faults_of(load: Any, *entries: Any) -> dict[str, str]:
    with pytest.raises(InputError) as caught:
        added(load, *entries)
    assert all(":" in fault.file for fault in caught.value.faults)  # each with its line
    return {fault.place: f"{fault.problem} | {fault.value} | {fault.hint}" for fault in caught.value.faults}


def test_effects_arrive_in_si(load: Any) -> None:
    study = added(
        load,
        {"effect": "Cogging", "joint": "joint_2", "amplitudes": ["5 mN m", "1 mN m"], "orders": [84, 168]},
        {"effect": "HoldingBrake", "joint": "joint_1", "holding": "12 N m", "engages": ["500 ms"], "closing": "20 ms"},
        {"effect": "DryFriction", "joint": "joint_1", "friction": {"coulomb": "1 N m"}, "side": "motor"},
        {"effect": "GivenTorque", "joint": "joint_1", "time": ["0 s", "1 s"], "torque": ["0 N m", "2 N m"]},
        {"effect": "TipContact", "point": ["10 cm", "0 m", "0 m"], "normal": [1, 0, 0], "stiffness": "1 kN/m"},
    )
    built = [one.built() for one in study.simulation.add]
    assert [one.joint for one in study.simulation.add] == ["joint_2", "joint_1", "joint_1", "joint_1", ""]
    assert built[0] == dt.Cogging((0.005, 0.001), (84, 168))
    assert built[1] == dt.HoldingBrake(12.0, engages=(0.5,), closing=0.02)
    assert built[2] == dt.DryFriction(dt.Friction(coulomb=1.0), "motor")
    assert np.array_equal(built[3].torque, [0.0, 2.0])
    assert built[4] == dt.TipContact((0.1, 0.0, 0.0), (1.0, 0.0, 0.0), 1000.0)


def test_a_new_effect_is_one_class(load: Any) -> None:
    study = added(load, {"effect": "SpringToGround", "joint": "joint_1", "stiffness": "2 N m/deg", "rest": "90 deg"})
    one = study.simulation.add[0].built()
    assert isinstance(one, SpringToGround)
    assert (one.stiffness, one.rest) == pytest.approx((360.0 / math.pi, math.pi / 2))


def test_they_are_in_the_scene_and_take_gears_from_the_drives(load: Any) -> None:
    study = added(
        load, {"effect": "Backlash", "joint": "joint_2", "damping": "1 N m s/rad"},
        {"effect": "SpringToGround", "joint": "joint_1", "stiffness": "2 N m/rad"},
    )  # fmt: skip
    motor = dt.Motor("m", 1.0, 0.1, mass=0.2, rotor_inertia=1e-5)
    gear = dt.Gear("g", 50.0, mass=0.1, efficiency=0.8, stiffness_1=1e4, backlash=1e-3)
    drives = {name: Drive(motor, gear) for name in ("joint_1", "joint_2")}
    scene = dt.scene_of(study, drives, options=SceneOptions(feed_forward=False))
    assert dt.Backlash(gear, 1.0) in scene.effects["joint_2"]
    assert SpringToGround(2.0) in scene.effects["joint_1"]
    without = dt.scene_of(load(), drives, options=SceneOptions(feed_forward=False))
    assert len(scene.effects["joint_2"]) == len(without.effects["joint_2"]) + 1


def test_every_fault_at_once(load: Any) -> None:
    found = faults_of(
        load,
        {"effect": "Coging", "joint": "joint_1"},
        {"effect": "HoldingBrake", "joint": "jiont_1", "holding": "12 N", "clossing": "1 s"},
        {"effect": "Cogging", "joint": "joint_1", "orders": [84]},
        {"effect": "Cogging", "joint": "joint_2", "amplitudes": ["1 N m"], "orders": [0]},
        {"effect": "TipContact", "joint": "joint_1", "point": ["1 m", "0 m", "0 m"], "normal": [1, 0, 0],
         "stiffness": "1 N/m"},
        {"effect": "CommandedMotion"},
    )  # fmt: skip
    assert "'Cogging'" in found["simulation.add[0].effect"]
    assert "'joint_1'" in found["simulation.add[1].joint"]
    assert "torque" in found["simulation.add[1].holding"] and "'closing'" in found["simulation.add[1].clossing"]
    assert "missing" in found["simulation.add[2].amplitudes"]
    assert "whole numbers" in found["simulation.add[3], Cogging.orders"]
    assert "whole scene" in found["simulation.add[4].joint"]
    assert "a study file cannot state" in found["simulation.add[5].effect"]
    assert len(found) == 8


JUNK = [None, 0, -1, 3.7, True, "x", "48 V", "", [], {}, [1], ["1 N m"], {"a": 1}, float("nan"), "1 N m", "2 s",
        "3 rad/s", ["1 s", "2 s"], ["0 m", "1 m", "2 m"], "joint", 10**30, [[]]]  # fmt: skip


@pytest.mark.parametrize("kind", SHIPPED, ids=lambda kind: kind.__name__)
def test_junk_is_refused_with_faults_and_nothing_else(load: Any, kind: type) -> None:
    random, refused = np.random.default_rng(3), 0
    for _ in range(8):
        entry = {one.name: JUNK[random.integers(len(JUNK))] for one in fields(kind)}
        try:
            added(load, {"effect": kind.__name__, "joint": "joint_1", **entry})
        except InputError as error:
            assert all(fault.file for fault in error.faults)
            refused += 1
    assert refused > 4


@pytest.mark.parametrize("junk", ["Cogging", {"effect": "Cogging"}, ["Cogging"], [[]]])
def test_only_a_list_of_mappings_is_one(load: Any, junk: Any) -> None:
    with pytest.raises(InputError, match=r"simulation\.add: must be a list of effects"):
        load({"simulation": {"add": junk}})


@pytest.mark.parametrize("kind", SHIPPED, ids=lambda kind: kind.__name__)
def test_every_number_of_an_effect_says_its_unit(kind: type) -> None:
    """A plain float of an effect is read in the unit that its docstring tells in brackets."""
    words, hints = attribute_words(kind), typing.get_type_hints(kind)
    for one in fields(kind):
        if hints[one.name] in (float, float | None, tuple[float, ...], dt.arrays.Array):
            assert "[" in words[one.name], one.name
            unit = words[one.name].partition("[")[2].partition("]")[0].split(" or ")[0]
            assert unit == "-" or factor(unit) > 0.0


@pytest.mark.parametrize("name", ["Backlash", "Cogging", "HoldingBrake", "LuGreFriction", "SupplyBus", "WallSpring"])
def test_editors_could_know_them(name: str) -> None:
    kind = known_effects()[name]
    assert set(form_of(kind).model_json_schema()["properties"]) == {one.name for one in fields(kind)} or drive_fields(
        kind
    )


@pytest.mark.parametrize(
    ("value", "names"),
    [("all", ("all",)), ("none", ()), ([], ()), ("springs", ("springs",)), (["heat", "heat"], ("heat",))],
)
def test_effects_by_name(value: Any, names: tuple[str, ...]) -> None:
    assert read_effects(value) == names


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("heet", r"found 'heet'\); did you mean 'heat'"),
        ("non", r"did you mean 'none'"),
        (["heat", "all"], r"found 'all'\); known: amplifier_sampling"),  # a word stands by itself
        (["heet", "spring"], r"(?s)'heet'.*'spring'"),
        ({"heat": 1}, "must be auto, all, none, or a list of effects"),
    ],
)
def test_unknown_effects_are_errors(value: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_effects(value, "effects")
