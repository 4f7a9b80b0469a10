"""Pictures of simulations show what was recorded: every curve is there, with its numbers and units."""

from __future__ import annotations

import numpy as np
import pytest
from figures.constrained import figure_drift, figure_held_arm
from figures.steps import figure_step_study, step_study
from figures.task_space import figure_task_space

from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.constraints import Attachment, Plane, PointOnSurface
from drivetrain.dynamics.task_space import Damped, TipVelocity, task_space_dynamics
from drivetrain.report.charts.plotting import figure_of, house_style, png_bytes
from drivetrain.report.charts.run_charts import recording_charts
from drivetrain.simulation.constrained import simulate_constrained
from drivetrain.simulation.passive import simulate_passive
from drivetrain.simulation.recording import Event, Recording, Series
from drivetrain.solvers.solver import Euler, RungeKutta4


@pytest.fixture(scope="module")
def falling() -> Recording:
    return simulate_passive(load_arm("ur5"), np.zeros(6), np.zeros(6), 0.3)


def curves(axes: object) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in axes.lines if not line.get_label().startswith("_")}


def test_recording_over_time(falling: Recording) -> None:
    position, speed, energy, error = figure_of(recording_charts(falling)).axes  # no torques: they are zero
    assert position.get_ylabel() == "position [rad]"
    assert speed.get_ylabel() == "speed [rad/s]"
    np.testing.assert_array_equal(curves(position)["elbow_joint"], falling["elbow_joint.position"])
    assert set(curves(energy)) == {"kinetic energy", "potential energy"}
    assert error.get_ylabel() == "energy error [J]"
    assert position.get_legend() is not None
    assert speed.get_legend() is None  # the same joints in the same colours


def test_mixed_joints_have_a_picture_a_unit() -> None:
    time = np.linspace(0, 1, 5)
    series = {"a.position": Series("rad", time), "b.position": Series("m", time), "heat": Series("W", time)}
    stopped = Event(0.8, "diverged", "b.position: too large")
    charts = recording_charts(Recording(time, series, events=(Event(0.5, "limit", "a"),), stopped_by=stopped))
    figure = figure_of(charts)
    assert [axes.get_ylabel() for axes in figure.axes] == ["position [rad]", "position [m]", "heat [W]"]
    assert "0.8 s" in figure.axes[0].get_title(loc="left")


def test_steps_against_error() -> None:
    arm = at_level(load_arm("planar-2r"), RotorLevel.NONE)
    solvers = {"Euler": [Euler(0.01), Euler(0.001)], "Runge-Kutta": [RungeKutta4(0.01), RungeKutta4(0.001)]}
    studies = {name: step_study(arm, [0.5, 0.0], [0.0, 0.0], 0.5, several) for name, several in solvers.items()}
    left, middle, right = figure_step_study(studies).axes
    assert studies["Euler"][0].error[-1] > 5.0 * studies["Euler"][1].error[-1] > 1e-5
    assert studies["Runge-Kutta"][0].error[-1] > 1e3 * studies["Runge-Kutta"][1].error[-1]
    np.testing.assert_array_equal(left.lines[0].get_xdata(), [50, 500])
    np.testing.assert_array_equal(left.lines[1].get_xdata(), [200, 2000])
    assert [len(axes.lines) for axes in (left, middle, right)] == [2, 2, 2]
    for results in studies.values():
        for result in results:
            assert (np.diff(result.error) >= 0.0).all()


def test_task_space_along_a_path() -> None:
    arm = at_level(load_arm("planar-2r"), RotorLevel.NONE)
    angles = np.geomspace(1.0, 1e-4, 30)
    path = np.column_stack([0.5 + 0 * angles, angles])
    answers = {"damped": task_space_dynamics(arm, path, 0 * path, task=TipVelocity((3, 4)), near_singular=Damped(1e-2))}
    figure = figure_task_space(angles, answers, label="elbow [rad]", logarithmic=True)
    inertia, _, condition = figure.axes
    np.testing.assert_allclose(curves(inertia)["damped"], np.linalg.norm(answers["damped"].inertia, 2, axis=(1, 2)))
    np.testing.assert_array_equal(condition.lines[0].get_ydata(), answers["damped"].condition)
    assert len(condition.collections) == 1
    assert condition.get_xlabel() == "elbow [rad]"
    assert condition.get_ylabel() == "condition number [-]"


def test_held_arm_and_drift() -> None:
    arm, q = load_arm("ur5"), np.radians([10.0, -60.0, 90.0, -120.0, -90.0, 0.0])
    paper = PointOnSurface(Attachment.tip(arm), Plane([0, 0, 1], tip_pose(arm, q)[:3, 3]))
    run = simulate_constrained(arm, paper, q, np.zeros(6), 0.2)
    figure = figure_held_arm(arm, run, hinge=[0.1, 0.2, 0.3])
    picture, multipliers, speeds = figure.axes
    ends = tip_pose(arm, np.array(list(run.ending("position").values())).T)[:, :2, 3]
    np.testing.assert_allclose(np.array(picture.lines[0].get_data()).T, ends, atol=1e-12)
    np.testing.assert_array_equal(curves(multipliers)["row 1 [N]"], run["constraint_1.multiplier_1"])
    assert len(curves(speeds)) == 6
    labels = (picture.get_xlabel(), picture.get_ylabel(), multipliers.get_ylabel())
    assert labels == ("x [m]", "y [m]", "multipliers [N]")
    drift = figure_drift({"projection": run})
    assert [axes.get_yscale() for axes in drift.axes] == ["log", "log"]
    with house_style("held"):
        assert png_bytes(figure) == png_bytes(figure_held_arm(arm, run, hinge=[0.1, 0.2, 0.3]))
