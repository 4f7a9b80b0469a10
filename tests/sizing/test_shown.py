"""Results show themselves: a line as text, a table in a notebook, axes to draw on, tables for pandas with units."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest

import drivetrain as dt
from drivetrain.simulation.recording import Series

matplotlib.use("agg")

MOTOR: dict[str, Any] = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.5,
    "torque_constant": 0.1, "rotor_inertia": 3e-5, "mass": 0.6, "nominal_current": 12.0, "peak_current": 20.0,
    "resistance_winding_housing": 1.0, "resistance_housing_ambient": 1.0, "max_winding_temperature": 155.0,
}  # fmt: skip
GEAR: dict[str, Any] = {
    "kind": "strain_wave", "ratio": 100, "continuous_torque": 120.0, "repeated_peak_torque": 300.0,
    "momentary_torque": 900.0, "max_input_speed": 700.0, "efficiency": 0.75, "mass": 0.8, "inertia": 1e-5,
}  # fmt: skip
TIME = np.linspace(0.0, 2.0, 201)
MOTION = (TIME, np.sin(np.pi * TIME / 2.0)[:, np.newaxis] ** 2 * [0.5, 0.3])


@pytest.fixture(scope="module")
def selection() -> Any:
    heavy, weak = {**MOTOR, "mass": 0.9}, {**MOTOR, "peak_current": 0.01, "nominal_current": 0.01}
    return dt.select(
        dt.study(
            arm="planar-2r",
            motion=MOTION,
            motors={"MY": MOTOR, "HEAVY": heavy, "WEAK": weak},
            gears={"G": GEAR},
            supply={"voltage": 48.0, "regenerated_power": 100.0},
            selection={"sets": 3},
            name="shown",
            amplifier={"current_basis": "dc", "peak_current": 20.0, "continuous_current": 10.0},
            joints={"default": {"candidates": {"pairs": "all"}, "output_bearing": "external"}},
        )
    )


def test_everything_is_short_as_text(selection: Any) -> None:
    study, evaluation = selection.study, selection.evaluation
    one = evaluation.joints["joint_1"]
    for thing in (study, evaluation, selection, one, one.series, study.arm, study.cycle, study.joints[0], study.catalog,
                  dt.Motion("m", ("a",), TIME, *MOTION[1:], *MOTION[1:], *MOTION[1:])):  # fmt: skip
        assert len(repr(thing)) < 300
        assert repr(thing).startswith(type(thing).__name__)


def test_tables_hold_what_the_objects_hold(selection: Any) -> None:
    evaluation = selection.evaluation
    checks = evaluation.checks
    assert isinstance(checks, pd.DataFrame)
    listed = [(name, check) for name, joint in evaluation.joints.items() for check in joint.checks]
    listed += [("all joints", check) for check in evaluation.shared]
    assert len(checks) == len(listed)
    for row, (name, check) in zip(checks.itertuples(), listed, strict=True):
        assert (row.joint, row.check, row.verdict, row.unit) == (name, check.name, check.verdict, check.unit)
        assert row.utilisation == check.utilisation or (np.isnan(row.utilisation) and check.utilisation is None)
    assert "time [s]" in checks and checks.attrs["units"]["required"] == "unit"

    pd.testing.assert_frame_equal(selection.checks, checks)
    sets = selection.sets
    assert len(sets) == len(selection.best_sets) == 3
    assert sets["objective"].tolist() == [one.objective for one in selection.best_sets]
    assert sets["mass [kg]"].is_monotonic_increasing
    assert (sets["joint_1 motor"][0], sets["joint_1 gear"][0]) == selection.drives["joint_1"]

    rejected = selection.rejected
    assert len(rejected) == len(selection.rejected_pairs) > 0
    assert set(rejected["motor"]) == {"WEAK"}
    assert (rejected["utilisation"] > 1.0).all()


def test_a_supply_that_fails_is_shown(selection: Any) -> None:
    supply = replace(selection.study.supply, peak_power=0.1)
    found = dt.evaluate(replace(selection.study, supply=supply), selection.drives)
    place, check = found.binding
    assert (place, check.name) == ("supply", "supply peak power")
    assert check.utilisation == max(one.utilisation or 0.0 for one in found.shared)
    assert check.name in repr(found)
    assert found.summary.loc["supply", ["verdict", "limited by"]].tolist() == ["FAIL", check.name]
    assert list(found.summary.index) == ["joint_1", "joint_2", "supply", "arm"]


def test_notebooks_get_tables(selection: Any) -> None:
    for thing in (selection.study, selection.evaluation, selection, selection.study.arm):
        html = thing._repr_html_()
        assert "<table" in html and "joint_2" in html and len(html) < 20_000


def test_plots_draw_on_the_axes_given(selection: Any) -> None:
    from matplotlib.pyplot import close, subplots

    _, ax = subplots()
    assert selection.evaluation.plot(ax=ax) is ax
    drawn = {line.get_label(): line for line in ax.lines}
    nearest = max(selection.evaluation.joints.values(), key=lambda one: one.binding.utilisation)
    np.testing.assert_array_equal(drawn[nearest.motor].get_ydata(), nearest.series.motor_torque)
    other = selection.plot(joint="joint_2")
    assert other is not ax and other.get_title().startswith("joint_2")
    with pytest.raises(dt.InputError, match="joint_2"):
        selection.evaluation.plot(joint="joint_3")
    with pytest.raises(dt.InputError, match="ax: must be the axes"):
        selection.evaluation.plot("joint_2")
    close("all")


@pytest.mark.parametrize(("gravity", "told"), [((0.0, 0.0, -9.81), 0), ((0.0, -9.81, 0.0), 2)])
def test_only_joints_that_hold_a_load_are_told_to_need_a_brake(gravity: tuple[float, ...], told: int) -> None:
    """Joint 1 rests while joint 2 accelerates and loads it, which no power failure lasts for; then both rest."""
    still = np.zeros_like(TIME)
    moves = np.column_stack([np.r_[still, MOTION[1][1:, 0], still[1:]], np.r_[MOTION[1][:, 1], still[1:], still[1:]]])
    study = dt.study(
        arm=dt.load_arm("planar-2r", gravity=gravity), drive_mass="included", supply=48.0, drives=("MY", "G"),
        motion=(np.linspace(0.0, 6.0, len(moves)), moves), motors={"MY": MOTOR}, gears={"G": GEAR},
    )  # fmt: skip
    remarks = [line for joint in dt.evaluate(study).joints.values() for line in joint.remarks]
    assert sum("has no brake" in line for line in remarks) == told


def test_fronts_and_curves(selection: Any) -> None:
    from matplotlib.pyplot import close

    front = dt.pareto_front(selection.study, ("mass", "energy"))
    assert len(front.table) == len(front.points) == len(front.plot().lines[0].get_xdata())
    assert " by mass, energy" in repr(front) and "<table" in front._repr_html_()
    curve = dt.optimum_curve(selection.study, "voltage", (40.0, 48.0), points=2)
    assert curve.table["voltage [V]"].tolist() == [point.value for point in curve.points]
    assert curve.plot().get_xlabel() == "voltage [V]"
    assert len(repr(curve)) < 200 and "<table" in curve._repr_html_()
    close("all")


def test_recordings() -> None:
    from matplotlib.pyplot import close

    series = {"elbow.position": Series("rad", np.sin(TIME)),
              "elbow.current": Series("A", np.cos(TIME))}  # fmt: skip
    recording = dt.Recording(TIME, series)
    assert repr(recording) == "Recording(2 series, 201 instants, 2 s)"
    assert "elbow.current" in recording._repr_html_()
    assert recording.plot("current").get_ylabel() == "current [A]"
    assert recording.plot().lines[0].get_label() == "elbow.position"
    with pytest.raises(dt.InputError, match="one unit"):
        recording.plot("elbow.position", "elbow.current")
    with pytest.raises(dt.InputError, match="no series"):
        recording.plot("elbow.speed")
    close("all")
