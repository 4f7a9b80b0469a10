"""Stages behind a gear in the answers that exchange the gear or its ratio: by hand, and against evaluations."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.report.charts.motion_data import kept_samples, motion_data
from drivetrain.study.model import FreeRatio

LEAD, SCREW, MASS = 0.02 / (2.0 * math.pi), 3e-3, 12.0  # a heavy screw: 3e-3 kg m^2 beside 1.2e-4 of the mass it moves
MOTOR = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3,
    "torque_constant": 0.06, "rotor_inertia": 5e-5, "nominal_current": 9.0, "peak_current": 35.0, "peak_torque": 2.0,
    "max_speed": 700.0,
    "coulomb_friction": 1e-9, "viscous_friction": 1e-12, "magnet_coefficient": 0.0, "mass": 0.9,
}  # fmt: skip
GEAR = {"kind": "planetary", "inertia": 1e-5, "mass": 1.2, "repeated_peak_torque": 20.0, "momentary_torque": 40.0}


def lift(efficiency=0.8, **changes) -> dt.Study:
    """A vertical slide on a screw behind a gear of ratio 2; another gear is there for the asking."""
    home = np.eye(4)[None]
    arm = dt.Arm.from_screws(home, [[0, 0, 0, 0, 0, 1.0]], [MASS], np.eye(3)[None] * 0.1, gravity=[0, 0, -9.81])
    t = np.linspace(0.0, 4.0, 121)
    q = 0.2 * np.sin(np.pi * t / 4.0)[:, None] ** 2
    ratios = {"G2": 2.0, "G4": 4.0}
    sheets = {
        key: {**GEAR, "ratio": r, "efficiency": efficiency, "part_number": f"no {key}"} for key, r in ratios.items()
    }
    sheets |= changes.pop("more", {})
    screw = {"type": "screw", "lead": LEAD, "efficiency": 0.9 if efficiency < 1.0 else 1.0, "inertia": SCREW,
             "force_limit": 5e3}  # fmt: skip
    joints = {"joint_1": {"stages": [screw], **changes.pop("joint", {"drive": {"motor": "M", "gear": "G2"}})}}
    return dt.study(
        arm=arm, drive_mass="included", motion=(t, q), motors={"M": MOTOR}, gears=sheets, supply=90.0,
        stop={"ramp": 0.3}, joints=joints, **changes,
    )  # fmt: skip


def evaluated(study: dt.Study, gear: str) -> dict[str, float | None]:
    return {check.name: check.utilisation for check in dt.evaluate(study, ("M", gear)).joints["joint_1"].checks}


def test_another_ratio_leaves_the_stages_as_they_are() -> None:
    study = lift()
    (two, four) = dt.ratio_study(study, "joint_1", ratios=[2.0, 4.0]).points
    for point, gear in ((two, "G2"), (four, "G4")):
        for name, used in evaluated(study, gear).items():
            if used is not None:
                assert point.utilisations[name] == pytest.approx(used, rel=1e-9), name
    assert two.rms_torque > 1.5 * four.rms_torque  # the screw is what there is to move


def test_closed_forms_count_stages_with_the_load() -> None:
    forms = dt.ratio_study(lift(efficiency=1.0), "joint_1", ratios=[2.0]).closed_forms
    own, load = 5e-5 + 1e-5, MASS * LEAD**2 + SCREW
    assert forms.matching == pytest.approx(math.sqrt(load / own), rel=1e-9)
    best = forms.least_rms
    points = dt.ratio_study(lift(efficiency=1.0), "joint_1", ratios=[0.99 * best, best, 1.01 * best]).points
    assert min(points, key=lambda one: one.rms_torque).ratio == pytest.approx(best)
    assert forms.load_match is not None and forms.load_match.best == pytest.approx(best, rel=1e-9)


def test_a_gear_named_alone_has_the_joints_stages_behind_it() -> None:
    study = lift()
    bare, whole = (dt.evaluate(study, ("M", gear)).joints["joint_1"] for gear in ("G4", "G4+screw"))
    assert bare.gear == whole.gear == "G4+screw"
    np.testing.assert_array_equal(bare.series.motor_torque, whole.series.motor_torque)
    assert [one.key for one in dt.ratio_study(study, "joint_1", ratios=[2.0]).gears] == ["G2+screw", "G4+screw"]
    for gear in ("G4", "no G4"):
        (answer,) = dt.why_not(study, "joint_1", gear=gear, motor="M", cost=False).answers
        assert answer.gear == "G4+screw" and answer.result is not None
        np.testing.assert_array_equal(answer.result.series.motor_torque, whole.series.motor_torque)
    among = lift(joint={"candidates": {"pairs": "all", "gears": {"keys": ["G2"]}}})
    (answer,) = dt.why_not(among, "joint_1", gear="G4", motor="M", cost=False).answers
    assert any("that of G4 is G4" in words for words in answer.passed_over)


def test_free_ratios_do_not_forget_stages() -> None:
    with pytest.raises(dt.InputError, match="is not computed with stages"):
        dt.sizing.free_ratios(lift(), free={"joint_1": FreeRatio(1.0, 8.0)})


def test_stages_are_load_in_the_ratio_of_inertias() -> None:
    found = dt.evaluate(lift(safety={"inertia_ratio": 100.0})).joints["joint_1"].checks
    ratio = next(check.required for check in found if check.name == "inertia ratio")
    assert ratio == pytest.approx((MASS * LEAD**2 + SCREW) / (2.0**2 * (5e-5 + 1e-5)), rel=1e-9)


def test_the_slider_of_a_page_leaves_the_stages_as_they_are() -> None:
    study = lift(efficiency=1.0)
    two, four = (dt.evaluate(study, ("M", gear)) for gear in ("G2", "G4"))
    told = motion_data(two)["joints"][0]
    torque, rotor = (np.array(told["series"][name]) for name in ("torque", "rotor"))
    own, s = told["ratio"]["rotor"] * rotor, 0.5
    page = (torque - own) * s + own + np.array(told["ratio"]["spin"]) * (1.0 / s - 1.0)
    shown = told["ratio"]["constant"] / 0.06  # a newton metre in the page's unit
    engine = shown * four.joints["joint_1"].series.motor_torque[kept_samples(two)]
    assert page == pytest.approx(engine, abs=3e-4 * np.abs(engine).max())  # figures of the page have four digits


def test_the_mass_of_stages_is_none_of_the_gears_input() -> None:
    silent = {key: value for key, value in GEAR.items() if key != "inertia"}
    shown = {}
    for mass in (0.0, 30.0):
        stage = {"type": "belt", "ratio": 1.0, "efficiency": 1.0, "inertia": SCREW, "mass": mass, "torque_limit": 90.0}
        found = dt.study(
            arm="planar-2r-bare", drive_mass="added", motion=([0.0, 1.0, 2.0], np.zeros((3, 2))), supply=48.0,
            motors={"M": MOTOR}, gears={"G": {**silent, "ratio": 50.0, "efficiency": 0.8}}, drives=("M", "G"),
            joints={"default": {"stages": [stage]}},
        )  # fmt: skip
        shown[mass] = dt.evaluate(found).joints["joint_1"].drive.gear
    assert shown[30.0].mass == GEAR["mass"] + 30.0
    assert shown[30.0].inertia == pytest.approx(shown[0.0].inertia, rel=1e-12)


def test_a_gears_spring_carries_the_stages_behind_it() -> None:
    """By hand: screw and mass on the gear's spring alone, then with the nut's spring between them, which is Dunkerley's
    bound of the two masses; a screw on the motor itself swings on nothing."""
    spring, nut = 1e4 * 0.7, 2e8 * 0.7  # of the gear [N m/rad] and along the screw [N/m], less the scatter
    sheet = {
        **GEAR,
        "ratio": 2.0,
        "efficiency": 0.8,
        **dict.fromkeys(("stiffness_1", "stiffness_2", "stiffness_3"), 1e4),
    }
    sheet |= {"torque_1": 1.0, "torque_2": 2.0}
    for gear, axial in ((True, None), (True, 2e8), (False, 2e8)):
        stage = {"type": "screw", "lead": LEAD, "efficiency": 0.9, "inertia": SCREW, "force_limit": 5e3}
        stage |= {} if axial is None else {"axial_stiffness": axial}
        drive = {"motor": "M", "gear": "S" if gear else "none"}
        study = lift(joint={"stages": [stage], "drive": drive}, stiffness={"first_resonance": 1.0}, more={"S": sheet})
        found = next(one.available for one in dt.evaluate(study).shared if one.name == "arm first resonance")
        k = [1.0 / spring if gear else 0.0, 0.0 if axial is None else 1.0 / (nut * LEAD**2)]
        squared = SCREW * k[0] + MASS * LEAD**2 * sum(k)
        assert found == pytest.approx(1.0 / math.sqrt(squared) / (2.0 * math.pi), rel=1e-9)
