"""Studies of one axis without an arm: the forward road against what sizing computes from the table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.errors import InputError
from drivetrain.simulation.study_scene import SceneOptions, axis_motion, scene_of
from drivetrain.whole_files import shipped

STUDY = """
schema_version: 1
name: {name}
motions: {{turn: {{table: load.csv}}}}
supply: {{voltage: 24 V}}
ambient: 25 °C
objective: mass
joints:
  {joint}:
    drive: {{motor: maxon_614949, gear: maxon_223094}}
    {inertia}
"""


@pytest.fixture(scope="module")
def door() -> dt.Evaluation:
    """The shipped door with the drive that the search finds."""
    return dt.select(dt.load_study(shipped("examples") / "one_axis" / "study.yaml")).evaluation


def test_the_simulated_door_takes_the_current_that_sizing_computes(door: dt.Evaluation) -> None:
    """With the command's currents fed forward, away from jumps of torque and from rest; 0.5 % as loops lag there."""
    drives = {name: joint.drive for name, joint in door.joints.items()}
    run = dt.simulate(scene_of(door.study, drives, options=SceneOptions(heat=False)), interval=0.01)
    series = door.joints["hinge"].series
    sized = np.interp(run.time, series.time, series.motor_torque)
    smooth = np.abs(np.interp(run.time - 0.05, series.time, series.motor_torque) - sized) < 0.02 * np.abs(sized).max()
    smooth &= np.abs(np.interp(run.time, series.time, series.speed)) > 0.05
    assert smooth.sum() > 300
    apart = np.abs(run["hinge.motor_torque"] - sized)[smooth]
    assert np.median(apart) < 0.005 * np.abs(sized).max()
    # The door is where the integral of the table's speed says.
    place = np.interp(run.time, series.time, series.position)
    assert np.abs(run["hinge.position"] - place).max() < 1e-3


def test_inertia_ratio_is_that_of_the_told_load(door: dt.Evaluation) -> None:
    joint = door.joints["hinge"]
    rotor = joint.drive.motor.rotor_inertia + (joint.drive.gear.inertia or 0.0)
    check = next(check for check in joint.checks if check.name == "inertia ratio")
    assert check.required == pytest.approx(15.0 / (joint.drive.gear.ratio**2 * rotor), rel=1e-12)


def _study(folder: Path, inertia: str, joint: str = "belt", speed: tuple[float, float] = (3.0, 3.0)) -> dt.Study:
    rows = [f"time [s],torque_{joint} [N m],speed_{joint} [rpm]", f"0,2,{speed[0]}", f"1,2,{speed[1]}"]
    (folder / "load.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    text = STUDY.format(name="one", joint=joint, inertia=inertia)
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    return dt.load_study(folder / "study.yaml")


def test_a_conveyor_goes_on_from_where_it_was(tmp_path: Path) -> None:
    """A twentieth of a turn a second for three seconds, at a torque that is the table's all the time."""
    study = _study(tmp_path, "load_inertia: 0.02 kg m^2")
    motion, load = axis_motion(study, 3)
    assert motion.position[-1, 0] == pytest.approx(0.3 * np.pi, rel=1e-12)
    assert (np.diff(motion.position[:, 0]) >= 0.0).all()
    np.testing.assert_allclose(load.torque, -2.0, rtol=1e-12)
    drives = {name: joint.drive for name, joint in dt.evaluate(study).joints.items()}
    run = dt.simulate(
        scene_of(study, drives, options=SceneOptions(repetitions=3, mesh=False, friction=False, heat=False))
    )
    assert run["belt.position"][-1] == pytest.approx(0.3 * np.pi, abs=1e-6)
    # No friction, no loss, steady speed: the motor gives the table's torque over the ratio.
    expected = 2.0 / drives["belt"].gear.ratio
    # At the last instant the command stands still.
    np.testing.assert_allclose(run["belt.motor_torque"][:-1], expected, rtol=1e-6)


def test_acceleration_is_not_counted_twice(tmp_path: Path) -> None:
    """Torque 2 N m while 1 kg m^2 gains 2 pi rad/s in a second: 2 - 2 pi is left for the load."""
    study = _study(tmp_path, "load_inertia: 1 kg m^2", speed=(0.0, 60.0))
    _, load = axis_motion(study, 1)
    np.testing.assert_allclose(load.torque, 2.0 * np.pi - 2.0, rtol=1e-12)


def test_what_cannot_be_simulated_is_told_with_the_mend(tmp_path: Path) -> None:
    study = _study(tmp_path, "")
    drives = {name: joint.drive for name, joint in dt.evaluate(study).joints.items()}
    with pytest.raises(InputError, match="load_inertia") as told:
        dt.simulate(study, drives=drives)
    assert "kg m^2" in told.value.faults[0].hint
    two = replace(study, joints=(*study.joints, replace(study.joints[0], name="other")))
    with pytest.raises(InputError) as several:
        scene_of(two, drives | {"other": drives["belt"]})
    assert {fault.place for fault in several.value.faults} == {
        "joints", "joints.belt.load_inertia", "joints.other.load_inertia",
    }  # fmt: skip


def test_the_mesh_carries_the_table_whatever_effects_there_are(door: dt.Evaluation) -> None:
    """What a recording calls the mesh torque is load and joint friction, also where nothing is lost in the mesh."""
    drives = {name: joint.drive for name, joint in door.joints.items()}
    series, found = door.joints["hinge"].series, {}
    for mesh in (True, False):
        run = dt.simulate(scene_of(door.study, drives, options=SceneOptions(heat=False, mesh=mesh)), interval=0.01)
        moving = np.abs(np.interp(run.time, series.time, series.speed)) > 0.05
        apart = np.abs(run["hinge.mesh_torque"] - np.interp(run.time, series.time, series.gear_torque))[moving]
        assert np.median(apart) < 1e-3 * np.abs(series.gear_torque).max()
        found[mesh] = float(np.abs(run["hinge.mesh_torque"]).max())
    assert found[False] == pytest.approx(found[True], rel=0.02)
