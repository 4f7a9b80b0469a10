"""The pieces of a study: DH tables, joints, amplifiers, assumptions, the template."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.arm.builtin import builtin_names
from drivetrain.arm.files.dh_table import read_dh_table
from drivetrain.arm.files.load import load_arm
from drivetrain.catalog.schema import GEAR_KINDS
from drivetrain.errors import InputError
from drivetrain.study.parts.joints import merged_joint
from drivetrain.study.parts.sheets import shipped_assumptions
from drivetrain.study.read import load_study
from drivetrain.study.schema import JointForm
from drivetrain.study.template import study_template

PUMA_HEADER = (
    "name,a [mm],alpha [deg],d [mm],mass [kg],com_x [mm],com_y [mm],com_z [mm],ixx [kg m^2],iyy [kg m^2],izz [kg m^2]"
)
PUMA_ROWS = """
joint_1,0,90,0,0,0,0,0,0,0.35,0
joint_2,431.8,0,0,17.4,-363.8,6,227.5,0.13,0.524,0.539
joint_3,20.3,-90,150.05,4.8,-20.3,-14.1,70,0.066,0.086,0.0125
"""


def test_a_dh_table_is_the_built_in_puma(tmp_path: Path) -> None:
    """First three rows of the table, typed in other units, against the built-in arm's reading of its own data."""
    path = tmp_path / "puma.csv"
    path.write_text("# a comment\n" + PUMA_HEADER + PUMA_ROWS, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the published inertias break the triangle inequality
        arm = read_dh_table(path, "classic")
    puma = load_arm("puma560")
    base = puma.home[0] @ np.linalg.inv(arm.home[0])  # the built-in one may stand on a base of its own
    for link in range(3):
        np.testing.assert_allclose(base @ arm.home[link], puma.home[link], atol=1e-12)
    np.testing.assert_allclose(arm.masses, puma.masses[:3], atol=1e-12)
    np.testing.assert_allclose(arm.inertias[1:], puma.inertias[1:3], atol=1e-12)
    assert arm.joint_names == ("joint_1", "joint_2", "joint_3")
    assert arm.name == "puma"


def test_prismatic_rows_and_cells_with_their_own_unit(tmp_path: Path) -> None:
    path = tmp_path / "gantry.csv"
    header = "kind,a [mm],alpha [deg],d [mm],mass [kg],lower [deg],upper [deg],speed_limit [deg/s]\n"
    path.write_text(
        header + "prismatic,0,0,100,2,-20 mm,0.3 m,50 mm/s\nrevolute,250,0,0,1,-90,90,180\n", encoding="utf-8"
    )
    arm = read_dh_table(path, "classic")
    np.testing.assert_allclose(arm.screws[0], [0, 0, 0, 0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(arm.lower, [-0.02, -math.pi / 2])
    np.testing.assert_allclose(arm.upper, [0.3, math.pi / 2])
    np.testing.assert_allclose(arm.speed_limits, [0.05, math.pi])


TOOLBOX = """sigma,theta [rad],d [m],a [m],alpha [rad],offset,m [kg],rx [m],ry [m],rz [m],\
Ixx [kg m^2],Iyy [kg m^2],Izz [kg m^2],Jm,G
0,0,0.3,0.2,1.2,0.4 rad,2,0.1,0,0,0.01,0.02,0.02,1e-4,50
1,0.7,0,0.1,-0.5,0.25 m,1,0,0.2,0,0.01,0.01,0.01,1e-4,50
R,0,0.1,0.3,0,-30 deg,3,0,0,0.1,0.02,0.02,0.01,1e-4,50
"""


def dh_matrix(modified: bool, theta: float, d: float, a: float, alpha: float) -> np.ndarray:
    """Written out as in Corke, Robotics, Vision and Control, and in Craig, equation 3.6."""
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    if modified:
        return np.array(
            [[ct, -st, 0, a], [st * ca, ct * ca, -sa, -sa * d], [st * sa, ct * sa, ca, ca * d], [0, 0, 0, 1]]
        )
    return np.array([[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]])


@pytest.mark.parametrize("modified", [False, True])
def test_a_table_with_the_columns_of_the_robotics_toolbox(tmp_path: Path, modified: bool) -> None:
    path = tmp_path / "arm.csv"
    path.write_text(TOOLBOX, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # inertias made up
        arm = read_dh_table(path, "modified" if modified else "classic")
    q = np.random.default_rng(3).normal(size=3)
    expected = np.eye(4)
    for theta, d, a, alpha in (
        (q[0] + 0.4, 0.3, 0.2, 1.2), (0.7, q[1] + 0.25, 0.1, -0.5), (q[2] - np.pi / 6, 0.1, 0.3, 0.0)
    ):  # fmt: skip
        expected = expected @ dh_matrix(modified, theta, d, a, alpha)
    assert dt.tip_pose(arm, q) == pytest.approx(expected, abs=1e-14)
    assert arm.masses.tolist() == [2.0, 1.0, 3.0]
    assert any(note.startswith("Jm, G: not used") for note in arm.notes)


def test_every_fault_of_a_dh_table(tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text("a [mm],alpha [m],d [mm],masss [kg],kind\n1,x,3,4,hinge\n1,2,3,4,prismatic\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_dh_table(path, "classic")
    told = str(caught.value)
    for words in (
        "column masss", "'mass'", "column mass: is missing", "revolute or prismatic", "row 2, column alpha [m]",
        "row 3, column alpha [m]",
    ):  # fmt: skip
        assert words in told, told


def joint(**entries: Any) -> JointForm:
    return JointForm.model_validate(entries)


DRIVE = {"motor": "m", "gear": "g"}


def test_a_joint_goes_over_the_default_name_by_name() -> None:
    default = joint(
        candidates={"motors": {"frameless": True}, "gears": {"kind": "rv", "ratio": [50, 100]}},
        friction={"coulomb": "1 N m", "viscous": "2 N m s/rad"}, housing_to_ambient="3 K/W",
    )  # fmt: skip
    own = joint(candidates={"gears": {"ratio": [30, 60]}}, friction={"coulomb": "0.5 N m"}, housing_to_ambient=None)
    merged = merged_joint(own, default)
    assert merged is not None
    assert merged.candidates is not None
    assert merged.candidates.gears is not None
    assert merged.candidates.motors.frameless is True
    assert merged.candidates.gears.kind == ("rv",)
    assert merged.candidates.gears.ratio == (30.0, 60.0)
    assert (merged.friction.coulomb, merged.friction.viscous) == (0.5, 2.0)
    assert merged.housing_to_ambient is None
    assert merged_joint(None, default) == default
    assert merged_joint(own, None) == own
    assert merged_joint(None, None) is None


def test_an_own_drive_takes_the_place_of_the_defaults_candidates_and_the_other_way_round() -> None:
    merged = merged_joint(joint(drive=DRIVE), joint(candidates={}))
    assert merged is not None
    assert merged.candidates is None
    merged = merged_joint(joint(candidates={}), joint(drive=DRIVE))
    assert merged is not None
    assert merged.drive is None
    both = merged_joint(joint(drive=DRIVE, candidates={}), joint(candidates={"pairs": "all"}))
    assert both is not None
    assert both.drive is not None
    assert both.candidates is not None
    assert both.candidates.pairs == "all"


def test_amplifier_limits_are_converted_by_the_basis_beside_them(load: Any) -> None:
    study = load({
        "amplifier": {"current_basis": "rms", "peak_current": "10 A", "continuous_current": "4 A", "modulation": 0.9},
        "joints.joint_2.amplifier": {"current_basis": "peak", "peak_current": "10 A"},
    })  # fmt: skip
    first, second = (task.amplifier for task in study.joints)
    assert first.peak_current == pytest.approx(10.0 * math.sqrt(1.5))
    assert second.peak_current == pytest.approx(10.0 * math.sqrt(0.75))
    assert second.continuous_current == pytest.approx(4.0 * math.sqrt(1.5))
    assert first.modulation == second.modulation == pytest.approx(0.9)


def test_mount_friction_and_contained_arrive(load: Any) -> None:
    study = load({
        "drive_mass": "replaced",
        "joints.default": {"candidates": {}, "contained": {"mass": "800 g", "mount": {"carrier": "child"}}},
        "joints.joint_2": {
            "drive": {"motor": "small", "gear": "p20"}, "mount": {"carrier": "base", "offset": "-40 mm"},
            "friction": {"coulomb": "2 N m", "coulomb_negative": "1 N m"},
            "motor_friction": {"viscous": "1e-5 N m s/rad"}, "housing_to_ambient": "2 K/W",
        },
    })  # fmt: skip
    first, second = study.joints
    assert first.contained is not None
    assert (first.contained.mass, first.contained.mount.carrier, first.mount.carrier) == (0.8, "child", "parent")
    assert (second.mount.carrier, second.mount.offset) == ("base", -0.04)
    assert (second.friction.coulomb, second.friction.coulomb_negative) == (2.0, 1.0)
    assert second.motor_friction is not None
    assert second.motor_friction.viscous == 1e-5
    assert first.motor_friction is None
    assert second.housing_to_ambient == 2.0


def test_a_prismatic_joint_needs_its_travel_a_turn(load: Any, folder: Path) -> None:
    (folder / "slide.csv").write_text("kind,a [mm],alpha [deg],d [mm],mass [kg]\nprismatic,0,0,0,5\n", encoding="utf-8")
    entries = {
        "arm": {"dh": "slide.csv", "convention": "classic"}, "joints": {"default": {"candidates": {}}}, "cycle": None,
        "motions": {"up": {"profile": "quintic", "durations": ["1 s", "1 s"],
                           "waypoints": [["0 mm"], ["100 mm"], ["0 mm"]]}},
    }  # fmt: skip
    with pytest.raises(InputError, match=r"travel_per_turn: is missing; joint \w+ is prismatic"):
        load(entries)
    entries["joints"] = {"default": {"candidates": {}, "travel_per_turn": "10 mm/rev"}}
    study = load(entries)
    assert study.joints[0].travel_per_turn == pytest.approx(0.01 / (2.0 * math.pi))
    assert study.cycle.position.max() == pytest.approx(0.1)
    screw = {"stages": [{"type": "screw", "lead": "10 mm/rev", "efficiency": "90 %"}]}
    entries["joints"] = {"default": {"candidates": {}, **screw}}
    assert load(entries).joints[0].travel_per_turn == pytest.approx(0.01 / (2.0 * math.pi))
    entries["joints"]["default"]["travel_per_turn"] = "10 mm/rev"  # said twice
    with pytest.raises(InputError, match="stages: say what the joint travels: travel_per_turn is then not needed"):
        load(entries)
    with pytest.raises(InputError, match="stages: contain a sliding one, but the joint turns"):
        load({"joints": {"default": {"candidates": {}, **screw}}})
    with pytest.raises(InputError, match=r"joint_2\.travel_per_turn: applies only to a prismatic joint"):
        load({"joints.joint_2": {"travel_per_turn": "10 mm/rev"}})
    assert load({"joints.default": {"candidates": {}, "travel_per_turn": "10 mm/rev"}})  # for those that slide


def test_the_studys_assumption_replaces_the_shipped_one_as_a_whole(load: Any) -> None:
    shipped = load().gear_assumptions
    assert shipped["strain_wave"].efficiency == pytest.approx(0.7)
    gear = {"no_load_torque_share": "5 %", "source": "our rig"}
    motor = {"max_winding_temperature": "100 °C", "source": "class B"}
    study = load({"assumptions": {"gears": {"strain_wave": gear}, "motors": {"brushed": motor}}})
    assert study.gear_assumptions["strain_wave"].efficiency is None
    assert study.gear_assumptions["strain_wave"].no_load_torque_share == 0.05
    assert study.gear_assumptions["rv"] == shipped["rv"]
    assert study.motor_assumptions["brushed"].max_winding_temperature == 100.0


def test_every_shipped_assumption_has_its_source() -> None:
    shipped = shipped_assumptions()
    assert set(shipped.gears) <= set(GEAR_KINDS)
    for form in (*shipped.gears.values(), *shipped.motors.values()):
        assert len(form.source) > 30


@pytest.mark.parametrize("arm", builtin_names())
def test_the_template_loads_for_every_built_in_arm(arm: str, tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(study_template(arm), encoding="utf-8")
    study = load_study(path)
    assert study.arm is not None
    assert len(study.joints) == study.arm.n
    assert all(task.pairs for task in study.joints)
    assert [body.mass for body in study.payloads] == [3.0]
    assert not [note for note in study.notes if note.startswith("warning:")]
