"""A study from Python's objects is the study of a file that says the same, in values, checks and messages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

import drivetrain as dt
from drivetrain.study.schema import StudyForm

MOTOR: dict[str, Any] = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": "0.5 ohm",
    "torque_constant": "50 mNm/A", "rotor_inertia": 3e-5, "mass": 0.6, "nominal_current": "6 A", "peak_current": 20.0,
    "max_speed": "6000 rpm", "resistance_winding_housing": 1.0, "resistance_housing_ambient": 3,
    "max_winding_temperature": "155 °C",
}  # fmt: skip
GEAR: dict[str, Any] = {
    "kind": "strain_wave", "ratio": 100, "continuous_torque": "40 N m", "repeated_peak_torque": 80.0,
    "momentary_torque": "150 N m", "max_input_speed": "7000 rpm", "efficiency": "75 %", "mass": 0.8, "inertia": 1e-5,
}  # fmt: skip
TIME = np.linspace(0.0, 2.0, 201)
RISE = np.sin(np.pi * TIME / 2.0) ** 2
THERE_AND_BACK = RISE[:, np.newaxis] * [0.5, 0.3]
OWN: dict[str, Any] = {"motors": {"MY": MOTOR}, "gears": {"G": GEAR}, "supply": "48 V"}


def planar(**changes: Any) -> Any:
    stated = {"arm": "planar-2r", "motion": (TIME, THERE_AND_BACK), "drives": ("MY", "G"), **OWN, **changes}
    return dt.study(**stated)


def faults(call: Callable[[], object]) -> str:
    with pytest.raises(dt.InputError) as caught:
        call()
    return str(caught.value)


def same_checks(one: Any, other: Any) -> None:
    """Every check of two evaluations, to the last bit: they are to come from the same numbers."""
    assert one.joints.keys() == other.joints.keys()
    for name, joint in one.joints.items():
        assert [repr(check) for check in joint.checks] == [repr(check) for check in other.joints[name].checks]
    assert repr(one.objective) == repr(other.objective)


def test_an_own_motor_from_a_dict_on_a_planar_arm(tmp_path: Path) -> None:
    """Against the file that a user would write, in other units."""
    pd.DataFrame(
        np.column_stack([TIME, np.degrees(THERE_AND_BACK)]),
        columns=["time [s]", "q_joint_1 [deg]", "q_joint_2 [deg]"],
    ).to_csv(tmp_path / "motion.csv", index=False)
    file = {
        "schema_version": 1, "arm": "planar-2r", "drive_mass": "added", "motions": {"m": {"file": "motion.csv"}},
        "motors": {"MY": {**MOTOR, "source": "me", "rotor_inertia": "0.3 kg cm^2", "mass": "600 g",
                          "peak_current": "20 A", "resistance_winding_housing": "1 K/W",
                          "resistance_housing_ambient": "3 K/W"}},
        "gears": {"G": {**GEAR, "source": "me", "repeated_peak_torque": "80 N m", "mass": "800 g",
                        "inertia": "100 g cm^2"}},
        "joints": {"default": {"drive": {"motor": "MY", "gear": "G"}}}, "supply": {"voltage": "48 V"},
    }  # fmt: skip
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(file), encoding="utf-8")
    ours, theirs = dt.evaluate(planar()), dt.evaluate(dt.load_study(tmp_path / "study.yaml"))
    for name, joint in ours.joints.items():
        for one, other in zip(joint.checks, theirs.joints[name].checks, strict=True):
            assert (one.name, one.verdict) == (other.name, other.verdict)
            if one.required is not None:  # degrees and back cost a few digits, differences of positions some more
                assert one.required == pytest.approx(other.required, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("form", ["text", "mapping"])
def test_written_and_read_again_it_evaluates_identically(form: str) -> None:
    study = planar(
        ambient=30.0, amplifier={"current_basis": "dc", "peak_current": 20.0, "continuous_current": "8 A"},
        safety={"peak_torque": 1.1, "life": "2000 h"}, payloads={"box": {"mass": 0.5, "com": [0.0, 0.0, 0.05]}},
        joints={"joint_2": {"friction": {"coulomb": 0.3}}},
        tolerances={"friction": "20 %"}, selection={"sets": 3}, name="round trip",
    )  # fmt: skip
    text = study.to_yaml()
    again = dt.load_study(text if form == "text" else yaml.safe_load(text))
    assert (again.name, again.ambient, again.wanted.sets) == ("round trip", 30.0, 3)
    same_checks(dt.evaluate(study), dt.evaluate(again))
    assert again.to_yaml() == text


def test_numbers_are_in_si_and_written_with_their_units() -> None:
    text = planar().to_yaml()
    stated = yaml.safe_load(text)
    assert stated["motors"]["MY"]["rotor_inertia"] == "3e-05 kg m^2"
    assert stated["motors"]["MY"]["resistance_housing_ambient"] == "3 K/W"
    assert stated["gears"]["G"]["ratio"] == 100
    assert stated["supply"] == {"voltage": "48 V"}


def test_a_file_keeps_asking_for_units(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(planar().to_yaml().replace("voltage: 48 V", "voltage: 48"), encoding="utf-8")
    assert "needs a unit, such as 48 V" in faults(lambda: dt.load_study(file))


def test_a_study_of_a_file_can_be_written_from_another_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "there"
    folder.mkdir()
    (folder / "motion.csv").write_text(yaml.safe_load(planar().to_yaml())["motions"]["motion"]["samples"])
    data = yaml.safe_load(planar().to_yaml()) | {"motions": {"m": {"file": "motion.csv"}}}
    (folder / "study.yaml").write_text(yaml.safe_dump(data))
    study = dt.load_study(folder / "study.yaml")
    monkeypatch.chdir(tmp_path)
    again = dt.load_study(study.to_yaml())
    np.testing.assert_array_equal(again.cycle.position, study.cycle.position)


def test_a_changed_study_does_not_write_what_it_no_longer_is() -> None:
    changed = dt.changed(planar(), dt.TaskChange(voltage=0.5))
    assert "was changed" in faults(changed.to_yaml)


def test_arms_as_objects_files_and_names() -> None:
    arm = dt.load_arm("planar-2r")
    by_object, by_name = planar(arm=arm), planar()
    for what in ("home", "screws", "masses", "inertias", "tip", "gravity", "lower", "upper", "speed_limits"):
        np.testing.assert_allclose(getattr(by_object.arm, what), getattr(by_name.arm, what), rtol=1e-15)
    same_checks(dt.evaluate(by_object), dt.evaluate(dt.load_study(by_object.to_yaml())))
    same_checks(dt.evaluate(by_object), dt.evaluate(by_name))


def test_what_is_left_out_or_assumed_is_told() -> None:
    arm = dt.load_arm("planar-2r-bare")
    geared = dt.with_rotors(arm, [dt.Rotor(ratio=100, inertia=2e-5)] * 2)
    told = " ".join(planar(arm=geared).notes)
    assert "rotors of planar-2r-bare are left out" in told
    assert "drive_mass: is not stated, 'added' is assumed" in told
    silent = " ".join(planar(arm=arm, drive_mass="added").notes)
    assert "left out" not in silent and "assumed" not in silent
    same_checks(dt.evaluate(planar(arm=geared)), dt.evaluate(planar(arm=arm)))


SLIDE = """<robot name="lift">
  <link name="base"/>
  <link name="tower"><inertial><mass value="4"/><inertia ixx="0.1" iyy="0.1" izz="0.02" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="carriage"><inertial><mass value="6"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="tower"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="3" effort="100"/></joint>
  <joint name="lift" type="prismatic"><parent link="tower"/><child link="carriage"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.8" velocity="0.6" effort="500"/></joint>
</robot>
"""


def test_a_urdf_with_a_slide(tmp_path: Path) -> None:
    """Gravity of the carriage over the screw's travel is the gear's torque while it stands."""
    (tmp_path / "lift.urdf").write_text(SLIDE, encoding="utf-8")
    travel = 0.02 / (2.0 * np.pi)
    motion = (TIME, RISE[:, np.newaxis] * [0.5, 0.1])
    stated = {**OWN, "gears": {"G": {**GEAR, "ratio": 10}}, "arm": tmp_path / "lift.urdf", "motion": motion,
              "drives": ("MY", "G"), "drive_mass": "included"}  # fmt: skip
    study = dt.study(**stated, joints={"lift": {"travel_per_turn": "20 mm/rev"}})
    series = dt.evaluate(study).joints["lift"].series
    at_rest = np.argmin(np.abs(series.acceleration))
    assert series.gear_torque[at_rest] == pytest.approx(6.0 * 9.81 * travel, rel=2e-3)  # what is left of acceleration
    same_checks(dt.evaluate(study), dt.evaluate(dt.load_study(study.to_yaml())))
    message = faults(lambda: dt.study(**stated))
    assert "travel_per_turn" in message
    assert "such as 10 mm/rev" in message


def test_currents_for_numpy_arrays() -> None:
    """Of a motion whose speed and acceleration are given: the current is the motor's torque over its constant."""
    rate = np.pi / 2.0
    speed, bend = rate * np.sin(2.0 * rate * TIME), 2.0 * rate**2 * np.cos(2.0 * rate * TIME)
    motion = (TIME, THERE_AND_BACK, speed[:, np.newaxis] * [0.5, 0.3], bend[:, np.newaxis] * [0.5, 0.3])
    evaluation = dt.evaluate(planar(motion=motion))
    np.testing.assert_array_equal(evaluation.study.cycle.velocity, motion[2])
    np.testing.assert_array_equal(evaluation.study.cycle.acceleration, motion[3])
    currents = dt.current_commands(evaluation)
    assert len(currents) == 2 * len(TIME)
    series = evaluation.joints["joint_1"].series
    found = currents[currents["joint"] == "joint_1"]["current [A]"].to_numpy()
    np.testing.assert_allclose(found, series.current, rtol=1e-12)


CATALOG_MOTORS = """key,kind,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A],rotor_inertia [gcm2],\
mass [g],nominal_current [A],peak_current [A],max_speed [rpm],resistance_winding_housing [K/W],\
resistance_housing_ambient [K/W],max_winding_temperature [°C]
SMALL,brushless,dc,line_line,1.2,30,60,250,3,10,8000,1.5,5,155
LARGE,brushless,dc,line_line,0.3,60,500,900,9,35,6000,0.8,2.5,155
"""
CATALOG_GEARS = """key,kind,ratio,continuous_torque [Nm],repeated_peak_torque [Nm],momentary_torque [Nm],\
max_input_speed [rpm],efficiency [%],mass [g],inertia [gcm2]
G50,strain_wave,50,30,60,120,7000,75,600,100
G100,strain_wave,100,40,80,150,7000,75,800,100
G160,strain_wave,160,60,120,250,7000,75,1200,150
"""


@pytest.mark.parametrize("given", ["frames", "files", "folder"])
def test_a_catalogue_of_two_motors_and_three_gears(given: str, tmp_path: Path) -> None:
    """All six pairs at both joints, by every way of handing them over; the best set is that of brute force."""
    (tmp_path / "motors.csv").write_text(CATALOG_MOTORS, encoding="utf-8")
    (tmp_path / "gears.csv").write_text(CATALOG_GEARS, encoding="utf-8")
    files = {"motors": tmp_path / "motors.csv", "gears": tmp_path / "gears.csv"}
    parts: dict[str, Any] = {
        "frames": {name: pd.read_csv(file) for name, file in files.items()},
        "files": files,
        "folder": {"catalogs": str(tmp_path)},
    }[given]
    study = dt.study(arm="planar-2r", motion=(TIME, THERE_AND_BACK), supply=48, **parts)
    assert {len(joint.pairs) for joint in study.joints} == {6}
    assert study.catalog.motors["LARGE"].rotor_inertia == pytest.approx(500e-7)
    assert study.catalog.gears["G160"].mass == pytest.approx(1.2)
    chosen = dt.select(study)
    pairs = study.joints[0].pairs
    sets = [dt.evaluate(study, {"joint_1": one, "joint_2": other}) for one in pairs for other in pairs]
    feasible = [one.objective for one in sets if one.feasible]
    assert chosen.feasible == bool(feasible)
    if feasible:
        assert chosen.objective == pytest.approx(min(feasible), rel=1e-12)


def test_motors_and_gears_as_objects() -> None:
    catalog = planar().catalog
    study = planar(motors=catalog.motors["MY"], gears=[catalog.gears["G"]], drives=(catalog.motors["MY"], "G"))
    same_checks(dt.evaluate(study), dt.evaluate(planar()))


def test_brakes_need_no_source_either() -> None:
    """As motors and gears given in Python."""
    brake = {"kind": "spring", "torque_side": "motor", "static_torque": 1.0, "power": 8, "mass": 0.2, "inertia": 1e-6}
    study = planar(brakes={"B": brake}, joints={"joint_1": {"brake": "B"}})
    checks = dt.evaluate(study).checks
    assert set(checks.joint[checks.check == "holding brake torque"]) == {"joint_1"}
    assert "given in Python" in checks.source[checks.check == "holding brake torque"].iloc[0]


def test_a_list_of_motions_is_a_cycle() -> None:
    half = len(TIME) // 2
    there = dt.Motion(
        "there", ("joint_1", "joint_2"), TIME[: half + 1], *(THERE_AND_BACK[: half + 1] * k for k in (1, 0, 0))
    )
    back = pd.DataFrame(THERE_AND_BACK[half:], columns=["joint_1", "q2 [rad]"], index=TIME[half:])
    still = (TIME[: half + 1], THERE_AND_BACK[: half + 1])
    study = planar(motion=[still, {"dwell": "0.5 s"}, {"motion": back, "payload": None}])
    assert study.cycle.segment_names == ("motion", "dwell", "motion_2")
    assert study.cycle.duration == pytest.approx(2.5)
    steps = [{"motion": "out"}, {"dwell": "0.5 s"}, {"motion": "home"}]
    by_name = planar(motion=None, motions={"out": still, "home": back}, cycle=steps).cycle
    assert by_name.segment_names == ("out", "dwell", "home")
    np.testing.assert_array_equal(by_name.position, study.cycle.position)
    assert "there" in planar(motion=[still, back], motions={"there": {"waypoints": [[0, 0], [0.1, 0]],
                             "profile": "quintic", "durations": ["1 s"]}}).to_yaml()  # fmt: skip
    assert "joint_1" in faults(lambda: planar(motion=there))  # whose speed is not the derivative of its position


def test_the_time_of_a_table_is_a_column_or_its_index() -> None:
    """The numbers of its rows are no instants, and an index in milliseconds is read as such."""
    table = pd.DataFrame(THERE_AND_BACK, columns=["joint_1", "joint_2"])
    assert "has no time" in faults(lambda: planar(motion=table))
    for index in (pd.Index(TIME), pd.Index(1e3 * TIME, name="time [ms]")):
        assert planar(motion=table.set_axis(index)).cycle.duration == pytest.approx(2.0, rel=1e-12)


def test_own_parts_whose_values_contradict_each_other_give_warnings() -> None:
    """Millinewton metres as newton metres: the rotor would take minutes to start (R J/kt^2)."""
    assert not any(note.startswith("warning: motors") for note in planar().notes)
    [note] = (note for note in planar(motors={"MY": {**MOTOR, "torque_constant": 5e-5}}).notes if "motors.MY" in note)
    assert "R J/kt^2" in note


def test_waypoints_in_si_or_in_the_unit_of_their_motion() -> None:
    points = {"profile": "quintic", "durations": [1.0, "1 s"], "waypoints": [[0.0, 0], [np.pi / 2, 0.1], [0, 0]]}
    radians = planar(motion=None, motions={"m": points})
    degrees = planar(
        motion=None,
        motions={"m": {**points, "unit": "deg", "waypoints": [[0, 0], [90.0, np.degrees(0.1)], [0, 0]]}},
    )
    np.testing.assert_allclose(radians.cycle.position, degrees.cycle.position, atol=1e-14)
    for study in (radians, degrees):
        again = dt.load_study(study.to_yaml())
        np.testing.assert_array_equal(again.cycle.position, study.cycle.position)


def test_a_load_table_without_an_arm() -> None:
    table = pd.DataFrame({"t": TIME, "torque": 5.0 + RISE, "speed": 2.0 * np.sin(np.pi * TIME)})
    study = dt.study(motion=table, drives=("MY", "G"), **OWN)
    assert study.joints[0].name == "axis"
    same_checks(dt.evaluate(study), dt.evaluate(dt.load_study(study.to_yaml())))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"motors": {"MY": {**MOTOR, "torque_constant": "50 mV"}}}, "motors.MY.torque_constant: must be a torque"),
        ({"motors": {"MY": {**MOTOR, "resistance": -1.0}}}, "motors.MY.resistance: must be at least"),
        ({"motors": {"MY": {**MOTOR, "coulomb_friction": "0 N m"}}}, "N m'); leave it out if it is unknown"),
        ({"motors": {"MY": {k: v for k, v in MOTOR.items() if k != "current_basis"}}}, "motors.MY.current_basis"),
        ({"motors": {"MY": {**MOTOR, "torque_konstant": 1.0}}}, "did you mean 'torque_constant'"),
        ({"drives": ("MI", "G")}, "no motor has this key (found 'MI'); known: MY"),
        ({"drives": "MY"}, "drives: must be (motor key, gear key)"),
        ({"drives": {"joint_3": ("MY", "G")}}, "joints.joint_3: is no joint"),
        ({"motors": {"MY": {"kt": "1 N m/A"}}}, "motors.MY.kt: is not known here; did you mean 'torque_constant'?"),
        ({"motors": {"MY": {"R": "1 ohm"}}}, "motors.MY.kind: is missing; brushed or brushless"),
        ({"suply": "48 V"}, "suply: is not known here; did you mean 'supply'"),
        ({"supply": "48 W"}, "supply.voltage: must be a voltage"),
        ({"supply": None}, "supply: is missing"),
        ({"motion": None}, "motions"),
        ({"motion": (TIME, THERE_AND_BACK[:-1])}, "(201,), (200, 2)"),
        ({"motion": (TIME, THERE_AND_BACK[:, :1])}, "q_joint_2"),
        ({"motion": [TIME, THERE_AND_BACK]}, "a list is a cycle"),
        ({"motion": None, "motions": {"out": 3.0}}, "motions.out: must be (t, q)"),
        ({"motion": np.zeros((3, 2))}, "motion: must be (t, q) or (t, q, qd, qdd)"),
        ({"motion": (TIME,)}, "motion: must be (t, q) or (t, q, qd, qdd)"),
        ({"motion": (TIME, *[THERE_AND_BACK] * 4)}, "motion: must be (t, q) or (t, q, qd, qdd)"),
        ({"motion": (TIME, THERE_AND_BACK + np.nan)}, "finite"),
        ({"arm": "planar-3r"}, "did you mean 'planar-2r'"),
        ({"ambient": np.nan}, "ambient: must be a number"),
        ({"motors": 3}, "motors: must be"),
        ({"joints": {"default": object()}}, "joints.default"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(changes: dict[str, Any], words: str) -> None:
    assert words in faults(lambda: planar(**changes))


def test_several_faults_come_at_once() -> None:
    told = faults(lambda: planar(motors={"MY": {**MOTOR, "mass": "1 m"}}, supply="48 W", ambient="-400 °C"))
    assert all(place in told for place in ("motors.MY.mass", "supply.voltage", "ambient"))


def test_every_entry_of_a_file_is_an_argument() -> None:
    """Those that study() takes by name itself are entries too."""
    import inspect

    named = set(inspect.signature(dt.study.__call__).parameters) - {"entries", "motion", "drives"}
    assert named <= set(StudyForm.model_fields)
