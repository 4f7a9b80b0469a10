"""Numbers of a drive as other tools are given them, each limit in turn the one that binds."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from sizing.conftest import GEAR, MOTOR, planar_arm, sines, study, task

import drivetrain as dt
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.export.currents import _quoted
from drivetrain.export.drives import DriveData, _drive, exported, in_frame, joint_limits
from drivetrain.export.limits import _envelope, write_ros2
from drivetrain.export.sdf import write_sdf
from drivetrain.sizing.results import JointResult

WIDE = {"motor": {"peak_torque": 90.0, "peak_current": 900.0, "max_speed": 9e4}, "current": 800.0, "volts": 500.0,
        "gear": {"repeated_peak_torque": 9e4, "max_input_speed": 9e4}}  # fmt: skip


def changed(travel: float | None = None, **changes: Any) -> tuple[DriveData, JointResult]:
    """One axis with a gear of -50 and 80 %, friction that differs between directions, at 31 C; as data and as judged.

    Every limit is far away, except those that are given.
    """
    asked: Any = {name: {**value, **changes.get(name, {})} if isinstance(value, dict) else changes.get(name, value)
                  for name, value in WIDE.items()}  # fmt: skip
    motor = replace(MOTOR, magnet_coefficient=-0.002, reference_temperature=25.0, no_load_current=0.0, **asked["motor"])
    gear, current = replace(GEAR, ratio=-50.0, **asked["gear"]), asked["current"]
    own = task(
        friction=Friction(3.0, coulomb_negative=5.0, viscous=0.4, viscous_negative=0.6),
        motor_friction=Friction(0.03, coulomb_negative=0.01, viscous=2e-4),
        amplifier=Amplifier(peak_current=current, continuous_current=0.9 * current),
    )
    made = study(sines(1), arm=planar_arm([0.3], [1.0]), joints=(own,), ambient=31.0, supply=Supply(asked["volts"]),
                 catalog=Catalog({"m1": motor}, {"g1": gear}))  # fmt: skip
    evaluation = dt.evaluate(made)
    result = evaluation.joints["j1"]
    if travel is None:
        return exported(evaluation, "urdf")[1][0], result
    slide: Any = SimpleNamespace(name="j1", travel_per_turn=travel, housing_to_ambient=None)
    return _drive(evaluation.study, slide, result), result


def warm(result: JointResult) -> float:
    """Torque constant at the housing's temperature [N m/A]."""
    assert result.housing_temperature is not None and result.housing_temperature > 31.0
    return 0.05 * (1.0 - 0.002 * (result.housing_temperature - 25.0))


@pytest.mark.parametrize(
    ("changes", "effort"),
    [
        ({"current": 12.0}, lambda constant: 0.8 * 50.0 * constant * 12.0),
        ({"motor": {"peak_current": 14.0}}, lambda constant: 0.8 * 50.0 * constant * 14.0),
        ({"motor": {"peak_torque": 1.1}}, lambda _: 0.8 * 50.0 * 1.1),
        ({"gear": {"repeated_peak_torque": 33.0}}, lambda _: 33.0),
        ({"gear": {"repeated_peak_torque": None, "continuous_torque": 21.0}}, lambda _: 21.0),
    ],
)
def test_the_limit_of_effort(changes: dict[str, Any], effort: Any) -> None:
    """At the output, when the motor drives the load through 80 %."""
    found, result = changed(**changes)
    assert found.effort == pytest.approx(effort(warm(result)), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "speed"),
    [
        ({"volts": 20.0}, lambda constant: 0.95 * 20.0 / constant / 50.0),
        ({"motor": {"max_speed": 300.0}}, lambda _: 6.0),
        ({"gear": {"max_input_speed": 200.0}}, lambda _: 4.0),
    ],
)
def test_the_limit_of_speed(changes: dict[str, Any], speed: Any) -> None:
    found, result = changed(**changes)
    assert found.speed == pytest.approx(speed(warm(result)), rel=1e-9)


def test_friction_inertia_and_winding_of_a_drive() -> None:
    """Means of both directions at the output; the motor's by the ratio, the square of it for viscous friction."""
    found, result = changed()
    assert (found.ratio, found.rotor_inertia) == (-50.0, pytest.approx(2e-5 + 1e-6))
    assert found.coulomb == pytest.approx(0.5 * (3.0 + 5.0) + 50.0 * 0.5 * (0.03 + 0.01))
    assert found.viscous == pytest.approx(0.5 * (0.4 + 0.6) + 2500.0 * 2e-4)
    housing, rms = result.housing_temperature, next(one for one in result.checks if one.name == "motor RMS current")
    assert found.resistance == pytest.approx(0.3 * (1.0 + 0.0039 * (housing - 25.0)))
    assert (found.cold_resistance, found.inductance, found.constant) == (0.3, 2e-4, pytest.approx(warm(result)))
    assert found.thermal == pytest.approx((1.0, 20.0 / 1.0, 0.0039, 25.0, housing))
    assert rms.available is not None and found.continuous == pytest.approx(rms.available * warm(result) * 50.0)
    bare, _ = changed(motor={"inductance": None, "peak_torque": None, "winding_time_constant": None})
    assert (bare.inductance, bare.torque, bare.thermal) == (0.0, math.inf, None)


def test_limits_of_coupled_joints() -> None:
    """The largest speed and torque of a joint alone that no shaft exceeds, found on a grid of one percent."""
    rng = np.random.default_rng(4)
    coupling = rng.normal(size=(3, 3))
    drives: list[Any] = [SimpleNamespace(speed=speed, effort=effort) for speed, effort in rng.uniform(1.0, 5.0, (3, 2))]
    for alone in (False, True):
        arm: Any = SimpleNamespace(coupling=None if alone else coupling, speed_limits=np.array([9.0, 0.3, 9.0]))
        speeds, efforts = joint_limits(arm, drives)
        turns = np.eye(3) if alone else coupling
        for j in range(3):
            unit = np.eye(3)[j]
            shafts, torques = turns @ unit, np.linalg.solve(turns.T, unit)
            speed = min(one.speed / abs(turn) for one, turn in zip(drives, shafts, strict=True) if turn)
            effort = min(one.effort / abs(share) for one, share in zip(drives, torques, strict=True) if share)
            assert speeds[j] == pytest.approx(min(speed, arm.speed_limits[j])) and efforts[j] == pytest.approx(effort)


def test_an_envelope_is_the_line_of_the_voltage() -> None:
    """At every effort on it, back-emf and resistive voltage are the supply's; unknown numbers are None."""
    found, _ = changed(volts=48.0)
    made = _envelope(found)
    for share in (0.0, 0.3, 1.0):
        effort = share * made["tau_max"]
        speed = made["max_actuator_velocity"] - made["speed_effort_gradient"] * effort
        current = effort / (found.constant * 50.0)
        assert found.resistance * current + found.constant * 50.0 * speed == pytest.approx(0.95 * 48.0)
        assert made["k"] * (made["max_actuator_velocity"] - speed) == pytest.approx(effort)
    assert made["armature"] == pytest.approx(2500.0 * 2.1e-5) and made["velocity_dependent_resistance"] == 0.0
    assert (made["friction_effort"], made["viscous_friction"]) == (found.coulomb, found.viscous)
    assert (made["max_effort"], made["velocity_limit"]) == (found.effort, found.speed)
    assert _envelope(replace(found, continuous=math.nan, effort=math.inf))["continuous_effort"] is None


def test_a_point_in_a_frame() -> None:
    frame = np.eye(4)
    frame[:3] = [[0.0, -1.0, 0.0, 1.0], [0.6, 0.0, -0.8, 2.0], [0.8, 0.0, 0.6, -0.5]]
    point = np.array([0.2, -0.7, 0.9])
    np.testing.assert_allclose(frame[:3, :3] @ in_frame(frame, point) + frame[:3, 3], point, atol=1e-12)


def test_a_slide_has_forces_and_speeds_along_it() -> None:
    """Of 0.02 m a radian of the gear's output: torques over it, speeds times it, viscous friction over its square."""
    turned, slid = changed()[0], changed(travel=0.02)[0]
    for name, power in {"ratio": -1, "effort": -1, "speed": 1, "continuous": -1, "coulomb": -1, "viscous": -2}.items():
        assert getattr(slid, name) == pytest.approx(getattr(turned, name) * 0.02**power, rel=1e-12)
    for name in ("rotor_inertia", "constant", "resistance", "volts", "current", "torque", "thermal"):
        assert getattr(slid, name) == getattr(turned, name)


def test_files_of_two_drives(tmp_path: Path) -> None:
    """Every number of a drive stands at its joint, in SDF and in the tag of ros2_control."""
    tasks = (task("j1", friction=Friction(3.0, viscous=0.4)), task("j2", motor_friction=Friction(0.02, viscous=1e-4)))
    evaluation = dt.evaluate(study(sines(2), arm=planar_arm([0.3, 0.2], [1.0, 0.5]), joints=tasks))
    write_sdf(evaluation, tmp_path / "arm.sdf")
    write_ros2(evaluation, tmp_path / "limits.yaml")
    model = ElementTree.parse(tmp_path / "arm.sdf").getroot().find("model")
    tags = ElementTree.parse(tmp_path / "limits.ros2_control.xacro").getroot()
    assert model is not None
    arm, drives = exported(evaluation, "sdf")
    speeds, efforts = joint_limits(arm, drives)
    for drive, speed, effort in zip(drives, speeds, efforts, strict=True):
        (joint,) = (one for one in model.iter("joint") if one.get("name") == drive.joint)
        told = {one.tag.rpartition("}")[2]: one.text for one in joint.iter()}
        wanted = {"effort": effort, "velocity": speed, "damping": drive.viscous, "friction": drive.coulomb,
                  "rotor_inertia": drive.rotor_inertia, "gear_ratio": drive.ratio}  # fmt: skip
        assert {name: float(told[name] or "") for name in wanted} == pytest.approx(wanted, rel=1e-9)
        (joint,) = (one for one in tags.iter("joint") if one.get("name") == drive.joint)
        ends = {one.get("name"): float(one.text or "") for one in joint.iter("param")}
        assert ends == pytest.approx({"min": -effort, "max": effort}, rel=1e-9)
    (tip,) = model.iter("frame")
    assert [float(one) for one in (tip.findtext("pose") or "").split()] == pytest.approx(
        [0.2, 0, 0, 0, 0, 0], abs=1e-12
    )
    masses = [float(one.text or "") for one in model.iter("mass")]
    assert sum(masses) == pytest.approx(sum(arm.masses) + sum(one.mass for one in arm.rotors if one is not None))


def test_names_that_yaml_would_misread_are_quoted() -> None:
    for name in ("j1", "left-arm.2", "a b", "it's", "1st", "no: thing", "# x"):
        assert yaml.safe_load(f"[{_quoted(name)}]") == [name]
    assert _quoted("j1") == "j1"
