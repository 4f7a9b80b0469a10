"""The pictures say what they show, and what the page draws from is what the engine found."""

from __future__ import annotations

import json
import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from overview import overview_png

from drivetrain.arm.kinematics import link_poses
from drivetrain.drive.motor_limits import operating_region
from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.report.charts.arm_charts import heat_chart, margin_chart, power_chart
from drivetrain.report.charts.chart import Chart, Mark, Pictures, rounded
from drivetrain.report.charts.motion_data import FOLLOWS, TURNED, kept_samples, motion_data, regions, temperatures
from drivetrain.report.charts.plotting import figure_of
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.quantities import convert
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


def data_of(page: str) -> dict[str, Any]:
    """What the page's scripts read."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


def test_rounded_keeps_what_the_eye_sees() -> None:
    values = np.array([123.45678, -0.001, np.nan, 7.0])
    assert rounded(values) == [123.46, -0.0, None, 7.0]
    assert rounded([12345678.0, 1.0]) == [12346000, 0]
    assert rounded([0.0, 0.0]) == [0, 0] and rounded([]) == []


def test_a_chart_is_a_place_in_the_text_and_data_at_the_end() -> None:
    pictures = Pictures()
    assert str(pictures.end()) == ""
    chart = Chart("two <lines>", "x [m]", "y [N]", [Mark("line", [0, 1], [1, np.inf], label="</script>")])
    assert 'data-chart="0"' in pictures.add(chart) and "two &lt;lines&gt;" in pictures.add(chart)
    end = str(pictures.end())
    found = data_of(end)["charts"][1]
    assert found["x"] == "x [m]" and found["y"] == "y [N]"
    assert found["marks"] == [{"kind": "line", "label": "</script>", "x": [0.0, 1.0], "y": [1.0, None]}]
    assert end.count("</script>") == 3  # data, library, script: none of them inside the data


def test_small_numbers_of_a_logarithmic_axis_stay_apart() -> None:
    pictures = Pictures()
    pictures.add(Chart("gain", "Hz", "dB", [Mark("line", [0.0123, 0.0124, 1e4], [1.0, 2.0, 3.0])], log_x=True))
    assert pictures.charts[0]["marks"][0]["x"] == [0.0123, 0.0124, 1e4]


def test_every_judged_check_is_on_the_axis(evaluation: Evaluation) -> None:
    chart = margin_chart(evaluation)
    assert chart is not None and chart.x == "used [% of the limit]"
    drawn = {
        (m.label, chart.rows[row]): x
        for m in chart.marks
        if m.kind == "points"
        for x, row in zip(m.x, m.y, strict=True)
    }
    wanted = {
        (name, check.name): 100.0 * check.utilisation
        for name, checks in [(j.name, j.checks) for j in evaluation.joints.values()] + [("supply", evaluation.shared)]
        for check in checks if check.utilisation is not None
    }  # fmt: skip
    assert drawn == pytest.approx(wanted)
    first = max(wanted, key=lambda place: wanted[place])
    assert chart.rows[0] == first[1]


def test_a_check_far_beyond_its_limit_stands_at_the_edge(evaluation: Evaluation) -> None:
    joint = evaluation.joints["elbow"]
    far = replace(joint, checks=(replace(joint.checks[0], utilisation=37.0), *joint.checks[1:]))
    chart = margin_chart(replace(evaluation, joints=evaluation.joints | {"elbow": far}))
    assert chart is not None and chart.x_range[1] == 210.0
    tips = [tip for mark in chart.marks for tip in mark.tips]
    assert any("3\u202f700\u00a0%" in tip for tip in tips)
    assert max(x for mark in chart.marks if mark.kind == "points" for x in mark.x) == 200.0


def test_power_is_the_sum_of_the_joints(evaluation: Evaluation) -> None:
    chart = power_chart(evaluation)
    assert chart is not None and chart.y == "power of all joints [kW]"
    line = next(mark for mark in chart.marks if mark.kind == "line")
    total = np.sum([joint.series.electrical_power for joint in evaluation.joints.values()], axis=0)
    assert np.max(line.y) == pytest.approx(1e-3 * total.max()) and np.min(line.y) == pytest.approx(1e-3 * total.min())


def test_heat_is_told_with_its_limit(evaluation: Evaluation, without_data: Evaluation) -> None:
    chart = heat_chart(evaluation)
    assert chart is not None and chart.x == "temperature in the periodic steady state [°C]"
    hottest = [joint.series.winding_temperature.max() for joint in evaluation.joints.values()]
    assert next(mark for mark in chart.marks if mark.kind == "bars").to == pytest.approx(hottest)
    assert heat_chart(without_data) is None and margin_chart(without_data) is None


def test_regions_shrink_when_hot_or_with_less_voltage(evaluation: Evaluation) -> None:
    for task in evaluation.study.joints:
        joint = evaluation.joints[task.name]
        at = temperatures(joint, evaluation.study)
        hot, cold = (regions(joint, task, evaluation.study, at[name], 48.0) for name in ("hot", "cold"))
        assert at["cold"] == (25.0, 25.0) and at["hot"][0] == joint.series.winding_temperature.max()
        for warm, other in zip(hot, cold, strict=True):
            assert warm is not None and other is not None
            assert np.abs(warm[:, 1]).max() < np.abs(other[:, 1]).max()
        less = regions(joint, task, evaluation.study, at["hot"], 40.0)[0]
        assert area(less) < area(hot[0])


def area(corners: np.ndarray) -> float:
    x, y = corners.T
    return 0.5 * abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1]))


def test_the_page_holds_the_series_of_the_engine(selection: Selection) -> None:
    """Units, samples and values; the largest of every series is among them."""
    evaluation = selection.evaluation
    motion = data_of(html_report(selection))["motion"]
    kept = kept_samples(evaluation)
    assert motion["time"] == pytest.approx(evaluation.study.cycle.time[kept], abs=1e-4)
    assert len(kept) < 900
    for told, joint in zip(motion["joints"], evaluation.joints.values(), strict=True):
        assert told["name"] == joint.name
        for key, values, unit in (
            ("torque", joint.series.motor_torque, "N m"), ("speed", joint.series.motor_speed, "rad/s"),
            ("current", joint.series.current, "A"), ("voltage", joint.series.voltage, "V"),
            ("gear", joint.series.gear_torque, "N m"), ("winding", joint.series.winding_temperature, "C"),
        ):  # fmt: skip
            shown = motion["units"][key].replace("rpm", "rpm").replace("°C", "C")
            engine = convert(values, unit, shown)
            assert told["series"][key] == pytest.approx(engine[kept], abs=2e-4 * np.abs(engine).max())
            assert np.abs(told["series"][key]).max() == pytest.approx(np.abs(engine).max(), rel=2e-4)
        instants = [check.time for check in joint.checks if check.time is not None]
        assert all(np.abs(evaluation.study.cycle.time[kept] - at).min() < 2e-3 for at in instants)
        for check in joint.checks:
            if check.name in FOLLOWS:
                assert told["checks"][check.name] == check.utilisation


def test_a_step_before_a_rest_is_drawn_as_a_step(evaluation: Evaluation) -> None:
    """The sample after the step has an odd index, which even thinning by two would drop: the rest would be a ramp."""
    time = np.array([*np.linspace(0.0, 1.0, 1001), 1.0, 2.0])
    joint = next(iter(evaluation.joints.values()))
    load = np.where(np.arange(len(time)) < 1001, 5.0, 0.0)
    load[0] = -1.0  # the extreme that is kept anyway is elsewhere
    series = replace(
        joint.series,
        **{one.name: None if getattr(joint.series, one.name) is None else load for one in fields(joint.series)}
        | {"time": time},
    )
    cycle = replace(evaluation.study.cycle, time=time, parts=())
    own = replace(evaluation, joints={joint.name: replace(joint, series=series, checks=())})
    kept = kept_samples(replace(own, study=replace(evaluation.study, cycle=cycle)))
    assert np.trapezoid(load[kept], time[kept]) == pytest.approx(5.0, rel=0.01)  # the ramp would add 2.5


def test_the_switches_show_the_regions_of_the_engine(selection: Selection) -> None:
    evaluation = selection.evaluation
    motion = motion_data(evaluation)
    for told, task in zip(motion["joints"], evaluation.study.joints, strict=True):
        motor = evaluation.joints[task.name].drive.motor
        engine = operating_region(motor, task.amplifier, 1.1 * 48.0, 25.0, 25.0)
        speed, torque = told["regions"]["cold 1.1"][0]
        assert speed == pytest.approx(convert(engine[:, 0], "rad/s", "rpm"), rel=1e-3, abs=1e-3)
        assert torque == pytest.approx(engine[:, 1], rel=1e-3, abs=1e-3)
        assert set(told["regions"]) == {f"{t} {v}" for t in ("hot", "cold", "limit") for v in ("0.9", "1", "1.1")}


@pytest.fixture(scope="module")
def arm() -> Evaluation:
    study = load_study(shipped("examples") / "desktop_arm" / "study.yaml")
    tasks = study.joints
    return evaluate(study, {task.name: task.drive or task.pairs[0] for task in tasks})


@pytest.mark.parametrize("factor", [0.6, 1.7])
def test_the_law_of_the_slider_is_that_of_the_engine(evaluation: Evaluation, factor: float) -> None:
    """Torque at another ratio from what the page holds, against the same parts summed at that ratio.

    The made-up joint is rotor and friction on the motor's shaft and a load through a gear without loss, so that the
    parts are known by themselves; friction counts with the load, as the page says of its estimate.
    """
    joint, study = evaluation.joints["elbow"], evaluation.study
    spin = joint.drive.motor.rotor_inertia + joint.drive.gear.inertia
    series = joint.series
    rotor = spin * 100.0 * series.acceleration
    whole = replace(series, rotor_torque=rotor, motor_torque=series.gear_torque / 100.0 + rotor)
    own = replace(evaluation, joints={"elbow": replace(joint, series=whole)})
    own = replace(own, study=replace(study, joints=(study.joints[2],)))
    told = motion_data(own)["joints"][0]
    kept, s = kept_samples(own), 1.0 / factor
    torque, spun = (
        np.array(told[a] if b is None else told[a][b]) for a, b in (("series", "torque"), ("ratio", "spin"))
    )
    rotors = np.array(told["series"]["rotor"])
    page = (torque - rotors) * s + rotors + spun * (1.0 / s - 1.0)
    engine = series.gear_torque / (100.0 * factor) + spin * 100.0 * factor * series.acceleration
    assert page == pytest.approx(engine[kept], abs=3e-4 * np.abs(engine).max())
    moments, w = np.array(told["ratio"]["moments"]).reshape(3, 3), np.array([s, 1.0, 1.0 / s - 1.0])
    weights = sample_weights(series.time)
    assert w @ moments @ w == pytest.approx(weights @ engine**2 / weights.sum(), rel=1e-9)


def test_the_arm_stands_where_the_engine_puts_it(arm: Evaluation) -> None:
    motion = motion_data(arm)
    told, study = motion["arm"], arm.study
    moved = np.array(told["moved"]).reshape(-1, study.arm.n, 3, 4) / np.array([TURNED] * 3 + [1.0])
    at = kept_samples(arm)[told["samples"]]
    poses = link_poses(study.arm, study.cycle.position[at])
    tips = (poses[:, -1] @ np.linalg.inv(study.arm.home[-1]) @ study.arm.tip)[:, :3, 3]
    page = moved[:, -1] @ [*told["points"][-1], 1.0]
    assert page == pytest.approx(1e3 * tips, abs=1.1)  # whole millimetres, turned by four digits
    joints = np.array(told["points"])
    apart = [k for k in range(study.arm.n + 1) if np.linalg.norm(joints[k + 1] - joints[k]) > 1.0]
    assert [one["link"] + 1 for one in told["shapes"]] == apart  # bars, as no file has shapes
    middles = np.array([np.mean(one["corners"], axis=0) for one in told["shapes"]])
    assert middles == pytest.approx((0.5 * (joints[1:] + joints[:-1]))[apart], abs=0.6)


def test_rejected_candidates_are_those_of_the_search(selection: Selection) -> None:
    told = data_of(html_report(selection))["rejected"]
    assert told["count"] == len(selection.rejected_pairs) == len(told["rows"])
    names = told["names"]
    page = sorted((names[0][row[0]], names[1][row[1]], names[3][row[3]], row[4]) for row in told["rows"])
    engine = sorted((one.joint, one.motor, one.check, one.utilisation) for one in selection.rejected_pairs)
    for ours, theirs in zip(page, engine, strict=True):
        assert ours[:3] == theirs[:3] and ours[3] == pytest.approx(theirs[3], rel=1e-6)


def test_nothing_known_still_draws(without_data: Evaluation) -> None:
    motion = data_of(html_report(without_data))["motion"]
    assert motion["arm"] is None
    assert all(joint["regions"]["hot 1"][1] is None and joint["checks"] == {} for joint in motion["joints"])


def test_overview_is_one_png(evaluation: Evaluation) -> None:
    data = overview_png(evaluation)
    assert data.startswith(b"\x89PNG") and data == overview_png(evaluation)


def test_a_long_line_keeps_its_peaks() -> None:
    x = np.arange(100_000)
    y = np.sin(x / 500.0)
    y[77_777] = 9.0
    pictures = Pictures()
    pictures.add(Chart("", "", "", [Mark("line", x, y), Mark("points", x[:3], y[:3])]))
    line = pictures.charts[0]["marks"][0]
    assert len(line["y"]) < 900 and max(line["y"]) == 9.0 and line["x"][line["y"].index(9.0)] == 77_777
    assert line["x"][0] == 0 and line["x"][-1] == 99_999


def test_matplotlib_draws_the_same(evaluation: Evaluation) -> None:
    charts = [chart for chart in (margin_chart(evaluation), power_chart(evaluation), heat_chart(evaluation)) if chart]
    figure = figure_of(charts)
    for chart, axes in zip(charts, figure.axes, strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel()) == (chart.x, chart.y)
    line = next(mark for mark in charts[1].marks if mark.kind == "line")
    assert any(np.array_equal(drawn.get_ydata(), line.y) for drawn in figure.axes[1].lines)
    assert [text.get_text() for text in figure.axes[2].get_yticklabels()] == list(charts[2].rows)
