"""Charts and words of hand-made answers: positions, ranges and colours written out."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from drivetrain.drive.motor import Motor
from drivetrain.report.charts.answer_charts import along_axis, front_charts, knee
from drivetrain.report.charts.chart import INSTANTS, rounded
from drivetrain.report.charts.motion_data import temperatures, view
from drivetrain.report.charts.run_charts import auto_charts, bode_charts, effects_charts, solver_charts
from drivetrain.report.json_text import plain
from drivetrain.report.words import heat_model, identity, nearness, required_text
from drivetrain.sizing.results import DriveSet
from drivetrain.study.parts.verdicts import Check, Verdict

TURN = 2.0 * math.pi


def marks_of(chart, kind: str) -> list[Any]:
    return [mark for mark in chart.marks if mark.kind == kind]


def front(*rows: tuple[float, float, float]) -> Any:
    """A front of mass and energy; the third number is the utilisation."""
    points = tuple(DriveSet({"j1": (f"m{i}", "g")}, mass, {"mass": mass, "energy": energy, "utilisation": used})
                   for i, (mass, energy, used) in enumerate(rows))  # fmt: skip
    return SimpleNamespace(names=("mass", "energy"), points=points)


def test_a_front_is_drawn_with_its_knee_from_dark_to_light() -> None:
    """Distances of (0, 1), (0.25, 0.35), (0.5, 0.2), (1, 0) in spans from the best of both: the third is nearest."""
    found = front((3.0, 30.0, 0.5), (3.5, 17.0, 0.7), (4.0, 14.0, 0.95), (5.0, 10.0, 0.6))
    assert knee(found) == 1 and knee(front((3.0, 30.0, 0.5), (5.0, 10.0, 0.6))) is None
    (chart,) = front_charts(found, found.points[2])
    points, bend, chosen = marks_of(chart, "points")
    shades = [round(23 * (used - 0.5) / 0.45) for used in (0.5, 0.7, 0.95, 0.6)]
    assert list(points.colours) == [INSTANTS[shade] for shade in shades] and points.size == 9
    assert (list(bend.x), list(bend.y), chosen.x.tolist()) == ([3.5], [17.0], [4.0])
    (line,) = marks_of(chart, "step")
    assert (line.x.tolist(), line.y.tolist()) == ([3.0, 3.5, 4.0, 5.0], [30.0, 17.0, 14.0, 10.0])
    assert not marks_of(chart, "rule") and "set 2: mass [kg] 3.500, energy [J] 17.00" in points.tips[1]
    near = SimpleNamespace(names=("mass", "utilisation"), points=found.points)
    (limit,) = marks_of(front_charts(near)[0], "rule")
    assert (list(limit.x), list(limit.y)) == ([], [100.0])
    three = SimpleNamespace(names=("mass", "energy", "utilisation"), points=found.points * 25)
    charts = front_charts(three)
    assert [(one.x[:4], one.y[:4]) for one in charts] == [("mass", "ener"), ("mass", "high"), ("ener", "high")]
    assert not marks_of(charts[0], "step") and marks_of(charts[0], "points")[0].size == 5


def test_the_axis_of_a_sweep_has_the_most_values() -> None:
    """Of those that are numbers of one unit."""
    table = pd.DataFrame({"a": ["1 kg", "2 kg", "1 kg"], "b": ["1 s", "2 s", "3 s"], "c": ["x", "y", "z"],
                          "d": ["1 s", "2 m", "3 s"]})  # fmt: skip
    assert along_axis(table, ["a", "b", "c", "d"]) == "b" and along_axis(table, ["a", "d"]) == "a"
    assert along_axis(table, ["c"]) == ""


@pytest.mark.parametrize(("speed", "critical", "resonance", "top"), [(30.0, 40.0, math.inf, 300.0),
                                                                     (30.0, 400.0, math.inf, 800.0),
                                                                     (30.0, 40.0, 200.0, 600.0)])  # fmt: skip
def test_open_loops_are_drawn_around_their_crossings(speed, critical, resonance, top) -> None:
    """An integrator and half of it, over 0.02 of the position loop's bandwidth to the largest of three frequencies."""
    frequency = np.geomspace(0.01, 1e5, 4001)
    loop = 100.0 / (1j * frequency)
    design: Any = SimpleNamespace(
        resonance=resonance, anti_resonance=0.5 * resonance, speed_bandwidth=speed, critical_frequency=critical,
        position_bandwidth=10.0, frequencies=frequency, speed_loop=loop, position_loop=0.5 * loop,
        speed_phase_margin=math.radians(61.0), speed_gain_margin=10.0, position_phase_margin=math.radians(72.0),
        position_gain_margin=math.inf,
    )  # fmt: skip
    gain, phase = bode_charts("j1", design, design)
    lines = marks_of(gain, "line")
    shown = frequency[(frequency > 0.2) & (frequency < top)] / TURN
    assert np.array_equal(lines[0].x, shown) and tuple(gain.x_range) == (shown[0], shown[-1])
    assert lines[0].y == pytest.approx(20.0 * np.log10(100.0 / (TURN * shown)))
    assert marks_of(phase, "line")[1].y == pytest.approx(np.full(len(shown), -90.0))
    assert lines[0].label == "speed loop: phase margin 61°, gain margin 20.0 dB"
    assert lines[1].label.endswith("phase margin 72°, gain margin without limit")
    crossings = [TURN * mark.x[0] for mark in marks_of(gain, "points")]
    assert crossings == pytest.approx([100.0, 50.0], rel=0.01)
    drawn = [TURN * mark.x[0] for mark in marks_of(gain, "rule") if len(mark.x)]
    assert drawn == pytest.approx([] if resonance == math.inf else [100.0, 200.0])
    assert np.array_equal(lines[2].x, shown) and lines[2].dash


def changed(*shares: float, tip: float = 0.0) -> Any:
    return SimpleNamespace(shares=shares, tip=tip)


def test_changes_by_effects_and_their_time() -> None:
    """The largest change of any joint in percent; changes below 1e-5 are not drawn."""
    rows = [
        SimpleNamespace(label="heat", time=1.5, changes={"a": changed(0.02, -0.5, 1e-6, math.nan, tip=1e-3),
                                                         "b": changed(-0.03, 0.1, 0.0, 0.2)}),
        SimpleNamespace(label="play", time=0.8, changes={"a": changed(0.0, 0.0, 0.0, 0.0, tip=-4e-3)}),
    ]  # fmt: skip
    found: Any = SimpleNamespace(rows=rows, full=SimpleNamespace(tip_deviation=2e-3))
    change, cost = effects_charts(found)
    bars = marks_of(change, "bars")
    ends = [dict(zip(np.round(one.y).astype(int).tolist(), one.to, strict=True)) for one in bars]
    expected = [{0: 3.0}, {0: 50.0}, {}, {0: 20.0}, {0: 50.0, 1: 200.0}]
    assert ends == [pytest.approx(one) for one in expected] and all(one.x == [1e-3] * len(one.y) for one in bars)
    assert [one.y[0] for one in bars if one.y] == pytest.approx([-0.32, -0.16, 0.16, 0.32])
    assert tuple(change.x_range) == pytest.approx((1e-3, 320.0))
    assert (marks_of(cost, "bars")[0].to, tuple(cost.x_range)) == ([1.5, 0.8], pytest.approx((0.75, 1.725)))
    assert [(one.x, one.y, one.label) for one in marks_of(cost, "text")] == [
        ([1.5], [0], "×1.50"),
        ([1.0], [1], "×0.80"),
    ]


def test_errors_of_solvers_down_to_what_the_reference_settles() -> None:
    runs = [SimpleNamespace(family="RK4", setting=1e-3, error=error, seconds=time, work=10.0 * time)
            for error, time in ((1e-2, 1.0), (1e-5, 2.0), (1e-8, 4.0))]  # fmt: skip
    found: Any = SimpleNamespace(settled=1e-6, runs=[*runs, SimpleNamespace(**{**vars(runs[2]), "family": "Rodas4"})])
    seconds, work = solver_charts(found)
    for chart, factor in ((seconds, 1.0), (work, 10.0)):
        (line,) = marks_of(chart, "line")
        assert (line.x, line.y) == ([factor, 2.0 * factor], [1e-2, 1e-5])
        assert [one.y for one in marks_of(chart, "rule")] == [[pytest.approx(2e-6)], [0.01]]
        assert marks_of(chart, "points")[0].tips == ["RK4, 1\u00a0ms"] * 2


def test_estimates_beside_measured_changes() -> None:
    """In percent of a tolerance of 2 %, at which a tip may move by 0.1 mm; quantities without change are left out."""
    proof = SimpleNamespace(estimate={"a": changed(0.01, 0.0, 0.0, 0.0, tip=2e-5)},
                            measured={"a": changed(-0.015, 0.0, 0.0, 0.0, tip=5e-5)})  # fmt: skip
    found: Any = SimpleNamespace(proof=proof, tolerance=0.02, tip_tolerance=1e-4)
    charts = auto_charts(found)
    assert [[one.to for one in marks_of(chart, "bars")] for chart in charts] == [
        [[pytest.approx(1.0)], [pytest.approx(1.5)]], [[pytest.approx(0.4)], [pytest.approx(1.0)]],
    ]  # fmt: skip
    assert all(tuple(one.x_range) == (0.0, pytest.approx(2.5)) for one in charts)
    assert [one.x for one in marks_of(charts[0], "rule")] == [[pytest.approx(2.0)]]
    assert auto_charts(SimpleNamespace(proof=None)) == ()  # type: ignore[arg-type]


def test_the_view_of_a_region() -> None:
    """The region's crossings of zero torque and its height, but no more than four times what the motion needs."""
    corners = np.array([[-300.0, 2.0], [100.0, 2.0], [200.0, 0.0], [100.0, -2.0], [-300.0, -2.0], [-300.0, 2.0]])
    for speed, torque, expected in (
        (100.0, 1.0, (1.12 * 300.0, 1.12 * 2.0)), (20.0, 0.1, (80.0, 0.4)), (400.0, 3.0, (460.0, 3.6)),
        (0.0, 0.0, (1.12 * 300.0, 1.12 * 2.0)),
    ):  # fmt: skip
        joint: Any = SimpleNamespace(series=SimpleNamespace(motor_speed=np.array([0.5, -1.0]) * speed,
                                                            motor_torque=np.array([-1.0, 0.0]) * torque))  # fmt: skip
        assert view(joint, corners) == pytest.approx(expected)
    assert view(joint, corners[1:4]) == pytest.approx((1.12 * 200.0, 1.12 * 2.0))


def test_temperatures_of_regions() -> None:
    """Those of the motion where they are known, else the limit, else the air; magnets at the housing's mean."""

    def told(winding, housing, limit) -> dict[str, tuple[float, float]]:
        series = SimpleNamespace(winding_temperature=winding, housing_temperature=housing)
        motor = SimpleNamespace(max_winding_temperature=limit)
        joint: Any = SimpleNamespace(drive=SimpleNamespace(motor=motor), series=series)
        study: Any = SimpleNamespace(ambient=25.0)
        return temperatures(joint, study)

    warm = np.array([40.0, 90.0]), np.array([40.0, 60.0])
    assert told(*warm, 125.0) == {"hot": (90.0, 50.0), "cold": (25.0, 25.0), "limit": (125.0, 50.0)}
    assert told(None, None, 125.0)["hot"] == (125.0, 125.0) and told(None, None, None)["hot"] == (25.0, 25.0)
    assert told(np.array([10.0]), np.array([5.0]), 125.0)["limit"] == (125.0, 25.0)


def test_words_of_a_motor_and_of_a_check() -> None:
    one = Motor("m", resistance=1.0, torque_constant=0.1, maker="maxon", series="EC 45", part_number="EC 45 flat")
    assert identity(one) == "maxon EC 45 EC 45 flat" and identity(replace(one, part_number="EC 45")) == "maxon EC 45"
    assert identity(replace(one, maker="EC 45", part_number="7")) == "EC 45 7" and identity(None) == ""
    thin = replace(one, resistance_winding_housing=0.05, resistance_housing_ambient=2.0, winding_time_constant=3.0,
                   housing_time_constant=300.0)  # fmt: skip
    assert heat_model(thin, None).startswith("two nodes, winding to housing 0.0500 K/W (data sheet)")
    assert heat_model(replace(thin, resistance_winding_housing=None, resistance_housing_ambient=None), None) == (
        "temperatures not computed: thermal resistances are not in the catalogue row"
    )
    check = Check("motor speed", 3.3, 2.0, "rad/s", 1.65, Verdict.FAIL, factor=1.1)
    assert nearness(check) == "furthest over its limit" and nearness(None) == "closest to a limit"
    for used in (0.55, 1.0, None):
        assert nearness(replace(check, utilisation=used)) == "closest to a limit"
    assert required_text(check, "rad/s") == "3.00 × 1.1 = 3.30"
    # 0.769 x 1.3 is 0.9997, which would print as another number: one digit more.
    assert required_text(replace(check, required=1.0, factor=1.3), "rad/s") == "0.7692 × 1.3 = 1.00"


def test_numbers_of_charts_and_files() -> None:
    """Digits of the largest number; whole ones below 1e15 have no point; what is not finite is null or a word."""
    assert [str(one) for one in rounded([2e14, 3.0])] == ["200000000000000", "0"]
    assert [str(one) for one in rounded([2e15, 3.0])] == ["2000000000000000.0", "0.0"]
    assert rounded([12345.0, math.inf]) == [12345.0, None]
    assert plain({"a": [1.0, np.float64(2.0)]}) == {"a": [1.0, 2.0]}
    assert plain(math.inf) != math.inf and plain(1.5) == 1.5
