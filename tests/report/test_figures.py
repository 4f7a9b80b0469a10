"""The pictures say what they show: every axis with its unit, every limit by name."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.report.figures_arm import supply_power, temperatures
from drivetrain.report.figures_gear import gear_plane
from drivetrain.report.figures_margins import margin_bars
from drivetrain.report.figures_motor import _free_corner, motor_plane, motor_regions, worst_instant
from drivetrain.report.figures_overview import overview_png
from drivetrain.report.figures_selection import candidates
from drivetrain.report.figures_strips import ElectricalLimits, electrical_strips, motion_strips
from drivetrain.sizing.results import Evaluation, Selection

LIMITS = ElectricalLimits(60.0, 45.6)


SVG = "{http://www.w3.org/2000/svg}"


def texts(svg: str) -> list[str]:
    return [(e.text or "").replace("\u00a0", " ") for e in ET.fromstring(svg).iter(f"{SVG}text")]


def test_motor_plane_names_axes_regions_and_points(evaluation: Evaluation) -> None:
    joint, task = evaluation.joints["elbow"], evaluation.study.joints[2]
    found = texts(motor_plane(joint, task, evaluation.study))
    for label in ("motor speed [rpm]", "motor torque [N m]", "gear output speed [rpm]", "time in the cycle [s]"):
        assert label in found
    assert "torque at the gear output, no losses [N m]" in found
    hot = f"{joint.series.winding_temperature.max():.0f} °C"
    for region in ("intermittent", "continuous"):
        assert f"{region}, winding at {hot}" in found and f"{region}, winding at 25 °C" in found
    assert any(text.startswith("RMS ") for text in found)
    told = " ".join(found)
    assert "motor peak torque: 86 %" in told and "t = 0.710 s: " in told


def test_gear_side_axis_is_the_motor_side_times_the_ratio(evaluation: Evaluation) -> None:
    """Ticks are read off the drawing: the gear's 100 N m stands where the motor's 1 N m stands (ratio 100)."""
    joint, task = evaluation.joints["elbow"], evaluation.study.joints[2]
    root = ET.fromstring(motor_plane(joint, task, evaluation.study))
    spots = [(e.text or "", float(e.get("x", 0)), float(e.get("y", 0))) for e in root.iter(f"{SVG}text")]
    ticks = [spot for spot in spots if spot[0].replace("−", "").replace(".", "").isdigit()]
    right = max(x for _, x, _ in ticks)
    gear = {float(t.replace("−", "-")): y for t, x, y in ticks if x == right}
    motor = {float(t.replace("−", "-")): y for t, x, y in ticks if x < 520}  # tenths of a point: left of the plane
    assert {200.0, -200.0} <= set(gear) and {2.0, -2.0} <= set(motor)
    for value in (200.0, -200.0):
        assert gear[value] == pytest.approx(motor[value / 100.0], abs=1.0)  # a tenth of a point


def test_regions_shrink_when_hot(evaluation: Evaluation) -> None:
    for task in evaluation.study.joints:
        regions = motor_regions(evaluation.joints[task.name], task, evaluation.study)
        assert regions.hot > regions.cold == 25.0
        for hot, cold in (
            (regions.intermittent_hot, regions.intermittent_cold),
            (regions.continuous_hot, regions.continuous_cold),
        ):
            assert hot is not None and cold is not None
            assert np.abs(hot[:, 1]).max() < np.abs(cold[:, 1]).max()


def test_the_label_never_lies_on_its_point() -> None:
    assert _free_corner(0.5, 0.3) == (1, 1)
    assert _free_corner(-0.5, -0.3) == (0, 0)
    assert _free_corner(-0.34, -0.84) == (1, 0)


def test_worst_instant_is_not_a_temperature(evaluation: Evaluation) -> None:
    joint = evaluation.joints["elbow"]
    assert joint.binding is not None and joint.binding.name == "winding temperature"
    worst = worst_instant(joint)
    assert worst is not None and worst.name == "motor peak torque"


def test_gear_plane_names_every_limit(evaluation: Evaluation) -> None:
    found = " | ".join(texts(gear_plane(evaluation.joints["elbow"])))
    for label in ("rated 80.0 N m", "average 120 N m", "repeated peak 200 N m", "momentary 400 N m"):
        assert label in found
    for label in ("rated 1\u202f996 rpm", "mean 3\u202f438 rpm", "maximum 6\u202f685 rpm"):
        assert label in found
    assert "gear input speed, magnitude [rpm]" in found and "gear output torque, magnitude [N m]" in found


def test_direct_drive_has_no_gear_plane(without_data: Evaluation) -> None:
    assert gear_plane(without_data.joints["elbow"]) == ""


@pytest.mark.parametrize("prismatic", [False, True])
def test_motion_strips_have_units(evaluation: Evaluation, prismatic: bool) -> None:
    found = texts(motion_strips(evaluation.joints["elbow"], evaluation.study.cycle, prismatic=prismatic))
    position = "position [m]" if prismatic else "position [°]"
    labels = (position, "output speed [rpm]", "gear torque [N m]", "motor torque [N m]", "time in the cycle [s]")
    assert set(labels) <= set(found)
    assert {"approach", "carry", "retreat", "wait", "repeated peak", "momentary"} <= set(found)
    assert "furthest over its limit: winding temperature" in found


def test_electrical_strips_have_units_and_limits(evaluation: Evaluation) -> None:
    found = texts(electrical_strips(evaluation.joints["elbow"], evaluation.study.cycle, limits=LIMITS))
    labels = ("current [A]", "terminal voltage [V]", "power [W]", "temperature [°C]", "available", "winding limit")
    assert set(labels) <= set(found)
    assert "far above: motor peak 60.0 A, amplifier peak 60.0 A" in found


def test_missing_temperatures_are_told(without_data: Evaluation) -> None:
    found = texts(electrical_strips(without_data.joints["elbow"], without_data.study.cycle, limits=LIMITS))
    assert "not computed: not in the catalogue row" in found
    assert temperatures(without_data) == ""


def test_margin_bars_hold_every_judged_check_sorted(evaluation: Evaluation) -> None:
    svg = margin_bars(evaluation, reserve=0.1)
    found = texts(svg)
    judged = {
        check.name for joint in evaluation.joints.values() for check in joint.checks if check.utilisation is not None
    }
    judged |= {check.name for check in evaluation.shared}
    assert judged <= set(found)
    assert "utilisation [% of the limit]" in found
    names = [text for text in found if text in judged]
    assert names[:3] == ["winding temperature", "motor RMS current", "motor peak torque"]
    dots = [text for text in found if text in ("1", "2", "3")]
    assert len(dots) == 3 * len(judged - {check.name for check in evaluation.shared})


def test_margin_bars_survive_infinite_and_huge_utilisations(evaluation: Evaluation) -> None:
    joint = evaluation.joints["elbow"]
    checks = (
        replace(joint.checks[0], utilisation=float("inf")),
        replace(joint.checks[1], utilisation=50.0),
        *joint.checks[2:],
    )
    changed = Evaluation(
        evaluation.study, {"elbow": replace(joint, checks=checks)}, evaluation.shared, evaluation.objective
    )
    assert "∞" in texts(margin_bars(changed, reserve=0.1))
    assert "5\u202f000 %" in texts(margin_bars(changed, reserve=0.1))


def test_supply_power_tells_drawn_from_given_back(evaluation: Evaluation) -> None:
    found = texts(supply_power(evaluation))
    assert {"drawn", "given back", "power of all joints [kW]", "time in the cycle [s]"} <= set(found)


def test_temperatures_show_every_joint(evaluation: Evaluation) -> None:
    found = texts(temperatures(evaluation))
    assert set(evaluation.joints) <= set(found)
    assert "temperature in the periodic steady state [°C]" in found


def test_candidates_show_every_joint_and_the_felling_checks(selection: Selection) -> None:
    svg = candidates(selection)
    found = texts(svg)
    assert {f"{joint}: 400 rejected" for joint in selection.evaluation.joints} <= set(found)
    assert {"winding temperature", "motor voltage", "gear repeated peak torque", "chosen", "also passes"} <= set(found)
    assert "mass of motor and gear [kg]" in found and "worst utilisation [%]" in found
    assert 3 * 350 < svg.count("h0") <= 3 * 400  # a dot each, but for those that lie on one another
    assert candidates(replace(selection, fallen=(), alternatives={})) == ""


def test_a_large_cloud_is_not_larger_than_the_eye_sees(evaluation: Evaluation) -> None:
    """Eight times the samples on the same curve: the picture hardly grows."""
    joint, task = evaluation.joints["elbow"], evaluation.study.joints[2]
    skipped = ("bearing_load", "load_inertia")
    series = {name: v for name, v in vars(joint.series).items() if v is not None and name not in skipped}
    grid = np.arange(len(joint.series.time))
    fine = np.linspace(0, grid[-1], 8 * len(grid))
    many = replace(joint.series, **{name: np.interp(fine, grid, values) for name, values in series.items()})
    plain = motor_plane(joint, task, evaluation.study)
    assert len(motor_plane(replace(joint, series=many), task, evaluation.study)) < 3 * len(plain)


def test_nothing_known_still_draws(without_data: Evaluation) -> None:
    joint, task = without_data.joints["elbow"], without_data.study.joints[2]
    found = texts(motor_plane(joint, task, without_data.study))
    assert "motor speed [rpm]" in found
    assert not any(text.startswith("continuous") for text in found)


def test_overview_is_one_png(evaluation: Evaluation) -> None:
    data = overview_png(evaluation)
    assert data.startswith(b"\x89PNG") and data == overview_png(evaluation)
