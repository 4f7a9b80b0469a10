"""A varied number's figures are those of the changed study evaluated anew; edges lie where something begins to hold."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.matching import scaled_gear
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.vary import (
    Setup,
    Vary,
    Worst,
    edge,
    edges,
    first_edge,
    named_drives,
    ratio_number,
    task_number,
    worst_of,
    worst_of_set,
)
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.parts.verdicts import Check, Verdict

KEYS = {"j1": ("strong", "g80"), "j2": ("weak", "g50")}


@pytest.fixture
def study(make):
    motors = {
        "strong": replace(make.motor, key="strong", nominal_current=18.0, peak_current=60.0),
        "weak": replace(make.motor, key="weak", mass=0.3, nominal_current=4.0, peak_current=8.0),
    }
    gears = {f"g{ratio}": replace(make.gear, key=f"g{ratio}", ratio=float(ratio)) for ratio in (50, 80)}
    cycle = replace(make.sines(2, samples=61, duration=2.5, size=0.8), payload=np.zeros(61, dtype=int),
                    payload_names=("part",))  # fmt: skip
    tasks = tuple(make.task(name, drive=KEYS[name]) for name in cycle.joint_names)
    return make.study(
        cycle, arm=make.planar_arm([0.4, 0.3], [1.0, 0.6]), joints=tasks, catalog=Catalog(motors, gears),
        payloads=(make.payload(1.5),),
    )  # fmt: skip


def same(found, expected):
    """Every check of every joint and of all together; the same sums in another order."""
    for one, other in zip(
        itertools.chain(*(joint.checks for joint in found.joints.values()), found.shared),
        itertools.chain(*(joint.checks for joint in expected.joints.values()), expected.shared),
        strict=True,
    ):
        assert (one.name, one.verdict) == (other.name, other.verdict)
        assert (one.utilisation is None) == (other.utilisation is None)
        assert one.utilisation is None or one.utilisation == pytest.approx(other.utilisation, rel=1e-9)
    assert found.objective == pytest.approx(expected.objective, rel=1e-9, nan_ok=True)


@pytest.mark.parametrize(
    ("vary", "value", "change"),
    [
        (Vary.PAYLOAD, 0.6, TaskChange(payload=0.4)), (Vary.PAYLOAD, 0.0, TaskChange(payload=0.0)),
        (Vary.CYCLE_TIME, 3.25, TaskChange(time=1.3)), (Vary.CYCLE_TIME, 2.0, TaskChange(time=0.8)),
        (Vary.VOLTAGE, 38.4, TaskChange(voltage=0.8)), (Vary.AMBIENT, 35.0, TaskChange(ambient=10.0)),
    ],
)  # fmt: skip
def test_a_number_of_the_task(study, vary, value, change):
    number = task_number(WorkFamily(study), named_drives(study, KEYS), vary)
    assert number.now == pytest.approx(vary.now(study)) and number.unit == vary.unit
    setup, expected = number.put(value), evaluate(changed(study, change), KEYS)
    same(setup.evaluation(), expected)
    same(setup.proven(), expected)
    everything = [c for one in expected.joints.values() for c in one.checks] + list(expected.shared)
    assert worst_of_set(setup.evaluation()).utilisation == pytest.approx(worst_of(everything).utilisation, rel=1e-9)


def test_a_ratio(study):
    number = ratio_number(Setup(WorkFamily(study).at(TaskChange()), named_drives(study, KEYS)), 1)
    assert number.now == 50.0
    turned = replace(scaled_gear(study.catalog.gears["g50"], 71.0), key="turned")
    catalog = replace(study.catalog, gears={**study.catalog.gears, "turned": turned})
    expected = evaluate(replace(study, catalog=catalog), {**KEYS, "j2": ("weak", "turned")})
    same(number.put(71.0).evaluation(), expected)
    same(number.put(71.0).proven(), expected)


def test_the_first_edge_outwards():
    asked = []

    def holds(value):
        asked.append(value)
        return 2.0 <= value <= 3.0 or value > 8.0

    found = first_edge(holds, np.geomspace(1.0, 10.0, 20))
    assert found.inside == pytest.approx(2.0, rel=1e-6) and found.inside >= 2.0 > found.outside
    assert len(asked) < 60
    assert first_edge(lambda value: False, [1.0, 2.0]) is None


def test_an_edge_as_near_as_asked():
    for geometric in (False, True):
        found = edge(lambda value: value <= math.pi, 1.0, 10.0, error=1e-10, geometric=geometric)
        assert found.inside <= math.pi < found.outside <= found.inside * (1.0 + 2e-10)
    assert abs(edge(lambda value: value <= math.pi, 0.0, 10.0, error=0.0, least=0.5).inside - math.pi) <= 0.5


def test_runs_and_their_ends():
    runs = list(edges(lambda value: value < 2.5 or 4.5 < value < 7.5, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]))
    assert [low.known for low, _ in runs] == [False, True] and [high.known for _, high in runs] == [True, True]
    assert runs[0][0].inside == 0.0
    ends = [runs[0][1].inside, runs[1][0].inside, runs[1][1].inside]
    assert ends == pytest.approx([2.5, 4.5, 7.5], rel=1e-6)
    assert list(edges(lambda value: False, [1.0, 2.0])) == []
    ((low, high),) = edges(lambda value: True, [1.0, 2.0])
    assert (low.inside, high.inside) == (0.0, math.inf)


def test_what_runs_away_is_named_only_when_nothing_else_is_over():
    hot = Check("heat", math.inf, 100.0, "C", math.inf, Verdict.FAIL)
    over, under = (Check("x", used, 1.0, "", used, Verdict.FAIL) for used in (1.2, 0.9))
    assert worst_of([hot, over]) == Worst("x", 1.2)
    assert worst_of([hot, under]) == Worst("heat", math.inf)
    assert worst_of([Check("x", None, None, "", None, Verdict.NOT_CHECKED)]) == Worst("", 0.0)
    assert worst_of([Check("x", 1.0, 1.0, "", math.nan, Verdict.FAIL)]).utilisation == math.inf
