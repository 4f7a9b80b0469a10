"""What a newcomer types in Python and the shell: names cut short, results that show themselves, messages."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_cli import Run, run  # noqa: F401

import drivetrain as dt

TIME = np.linspace(0.0, 2.0, 201)
POSITION = np.sin(np.pi * TIME / 2)[:, None] ** 2 * [0.5, 0.3]
SMALL, LARGE = ("AM_MF0060008_48V", "hd_CSG-14-80-2UH"), ("AM_MF0060020_48V", "hd_CSG-17-80-2UH")


@pytest.fixture(scope="module")
def study() -> Any:
    few = {"motors": {"keys": [SMALL[0], LARGE[0]]}, "gears": {"size": [14, 17]}}
    motion = (TIME, POSITION)
    return dt.study(
        arm="planar-2r-bare", drive_mass="added", motion=motion, supply="48 V", joints={"default": {"candidates": few}}
    )


@pytest.fixture(scope="module")
def selection(study: Any) -> Any:
    return dt.select(study)


def test_a_joint_may_be_cut_short_wherever_one_is_named(study: Any, selection: Any) -> None:
    assert dt.why_not(study, "2", LARGE[0], selection=selection, cost=False).answers[0].joint == "joint_2"
    assert dt.ratio_study(study, "2", drives=selection.drives).joint == "joint_2"
    assert dt.evaluate(study, {"1": LARGE, "2": SMALL}).drives == {"joint_1": LARGE, "joint_2": SMALL}
    assert selection.plot(joint="1").get_title().startswith("joint_1")
    scales = dt.current_scales(selection.evaluation, "amperes", full_scale={"1": 5.0})
    assert list(scales) == ["joint_1", "joint_2"]
    lines = list(dt.explanation(selection.evaluation, ["2"], ["rms current"]))
    assert lines[0].startswith("joint_2:") and "motor RMS current" in " ".join(lines)


def test_a_name_short_for_several_or_none_is_a_message(study: Any, selection: Any) -> None:
    for call in (
        lambda name: dt.why_not(study, name, LARGE[0]),
        lambda name: dt.ratio_study(study, name),
        lambda name: dt.evaluate(study, {name: LARGE}),
        lambda name: selection.plot(joint=name),
        lambda name: dt.current_scales(selection.evaluation, "amperes", full_scale={name: 5.0}),
        lambda name: dt.explanation(selection.evaluation, [name]),
    ):
        with pytest.raises(dt.InputError, match="short for several: joint_1, joint_2"):
            call("joint")
        with pytest.raises(dt.InputError, match="is no joint of"):
            call("elbow")
    with pytest.raises(dt.InputError, match="joint_1, which is given twice"):
        dt.evaluate(study, {"1": LARGE, "joint_1": LARGE})


def test_the_issues_names_are_at_hand() -> None:
    assert dt.waypoints is dt.motion.waypoints and dt.motion.waypoints("a", ("j",), [[0.0], [1.0]],
        profile=dt.Quintic(), durations=[1.0]).position[-1] == 1.0  # fmt: skip
    assert {"cuboid", "cylinder"} <= set(dir(dt.spatial)) and "identify" in dir(dt.identification)


def test_results_show_themselves_in_a_line(study: Any, selection: Any) -> None:
    zero = 0.0 * POSITION
    for result in (
        dt.inverse_dynamics_derivatives(study.arm, POSITION, zero, zero),
        dt.forward_dynamics_derivatives(study.arm, POSITION, zero, zero),
        dt.drive_torques(study.arm, POSITION, zero, zero),
        dt.MeasuredMotion("run", study.arm.joint_names, TIME, POSITION),
        dt.Commander(selection.evaluation),
        dt.ratio_study(study, "2", drives=selection.drives),
        dt.fastest(study, selection.drives),
    ):
        assert repr(result).startswith(f"{type(result).__name__}(") and len(repr(result)) < 130


def test_every_number_of_a_table_has_its_unit(study: Any, selection: Any) -> None:
    assert selection.sets.attrs["units"]["objective"] == selection.rejected.attrs["units"]["objective"] == "kg"
    for table in (selection.sets, selection.rejected, selection.checks):
        numbers = [name for name in table.columns if table[name].dtype.kind in "if" and name != "factor"]
        assert {*numbers} <= {*table.attrs["units"], "available", "required"}


def test_an_identification_shows_itself_in_a_notebook() -> None:
    arm = dt.load_arm("planar-2r-bare")
    motion = dt.exciting_motion(arm, acceleration=8.0, duration=4.0, candidates=2)
    torque = dt.inverse_dynamics(arm, motion.position, motion.velocity, motion.acceleration)
    found = dt.identify(arm, dt.MeasuredMotion("run", arm.joint_names, motion.time, motion.position, torque=torque))
    html = found._repr_html_()
    assert "joint_1" in html and "N m" in html and "<table" in html


def test_a_commander_called_with_too_little_says_so(selection: Any) -> None:
    commander = dt.Commander(selection.evaluation)
    with pytest.raises(dt.InputError, match="qdd"):
        commander([0.0, 0.0], [0.0, 0.0])
    with pytest.raises(dt.InputError, match="'q'"):
        commander()


def test_positions_without_an_arm_ask_for_one(tmp_path: Path) -> None:
    with pytest.raises(dt.InputError, match="arm: is missing") as error:
        dt.study(motion=(TIME, POSITION), supply="48 V")
    assert len(error.value.faults) == 1


def test_a_motion_may_be_a_file(tmp_path: Path) -> None:
    file = tmp_path / "m.csv"
    rows = [f"{t!r},{a!r},{b!r}" for t, (a, b) in zip(TIME.tolist(), POSITION.tolist(), strict=True)]
    file.write_text("\n".join(["t [s],q1 [rad],q2 [rad]", *rows]), encoding="utf-8")
    given = {"arm": "planar-2r-bare", "drive_mass": "added", "supply": "48 V"}
    for motion in (file, str(file)):
        study = dt.study(motion=motion, **given)
        np.testing.assert_allclose(study.cycle.position, POSITION, atol=1e-12)


def test_an_array_without_a_known_name_is_told_how_to_name_it(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", t=TIME, phi=POSITION)
    with pytest.raises(dt.InputError, match=r"columns=\{'phi': 'q \[rad\]'\}"):
        dt.read_recording(tmp_path / "run.npz", ["joint_1", "joint_2"])
    named = {"t": "time [s]", "phi": "q [rad]"}
    found = dt.read_recording(tmp_path / "run.npz", ["joint_1", "joint_2"], columns=named)
    np.testing.assert_array_equal(found.position, POSITION)


def test_the_name_of_an_effect_is_one_fault_with_its_fix() -> None:
    arm = dt.load_arm("planar-2r-bare")
    for wrong in ("DryFriction", [dt.DryFriction]):
        with pytest.raises(dt.InputError, match="effect") as error:
            dt.Scene(arm, {"joint_1": wrong}, 1.0)
        assert len(error.value.faults) == 1


def test_a_trajectory_of_two_points_is_told_what_it_may_be(tmp_path: Path) -> None:
    points = [f"- {{positions: [{q}], time_from_start: {{sec: {t}, nanosec: 0}}}}" for t, q in ((0, 0.0), (2, 0.5))]
    (tmp_path / "two.yaml").write_text("\n".join(["joint_names: [a]", "points:", *points]), encoding="utf-8")
    with pytest.raises(dt.InputError, match="waypoints"):
        dt.read_motion(tmp_path / "two.yaml", ["a"])


def test_an_unknown_choice_is_told_in_the_programs_words(run: Run, tmp_path: Path) -> None:  # noqa: F811
    code, _, errors = run("export", "none.yaml", "--to", "foo")
    assert code == 2 and "'foo'" in errors and "Value error" not in errors


def test_fastest_leaves_the_report_of_the_study_alone(run: Run, tmp_path: Path) -> None:  # noqa: F811
    assert run("init", "axis.yaml", "--arm", "planar-2r")[0] == 0
    assert run("select", "axis.yaml", "--write", "chosen.yaml")[0] == 0
    (report,) = tmp_path.glob("*_report/report.html")
    before = report.read_bytes()
    assert run("fastest", "chosen.yaml")[0] == 0
    assert report.read_bytes() == before
    assert len(list(tmp_path.glob("*fastest*_report/motion.csv"))) == 1


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("voltage: 48 V", "voltage 48 V", "lacks its colon"),
        ("mass: 3 kg", "mass:3 kg", "space after it"),
        ("cycle:\n  - {motion: there, payload: part}", "cycle:\n  {motion: there, payload: part}", "indented alike"),
        ("peak_torque: 1.2", "peak_torque: 20 %", "1.2"),
    ],
)
def test_slips_of_the_pen_are_told_with_their_fix(right: str, wrong: str, words: str, tmp_path: Path) -> None:
    text = dt.study_template("planar-2r", tmp_path)
    assert right in text
    try:
        told = " ".join(dt.load_study(text.replace(right, wrong, 1)).notes)
    except dt.InputError as error:
        told = str(error)
    assert words in told


def test_drives_may_be_given_as_one_thinks_of_them(study: Any, selection: Any) -> None:
    for one in (dt.evaluate(study, LARGE), dt.evaluate(study, {"1": LARGE, "2": LARGE})):
        assert one.drives == {"joint_1": LARGE, "joint_2": LARGE}
    parts = study.catalog
    given: dict[str, Any] = {
        "arm": "planar-2r-bare",
        "drive_mass": "added",
        "supply": "48 V",
        "motion": (TIME, POSITION),
    }
    large = (parts.motors[LARGE[0]], parts.gears[LARGE[1]])
    for drives in ([large, large], large, [large, LARGE]):
        made = dt.study(**given, drives=drives)
        assert [task.drive for task in made.joints] == [LARGE, LARGE]
    with pytest.raises(dt.InputError, match="one for each of joint_1, joint_2"):
        dt.study(**given, drives=[LARGE])
    with pytest.raises(dt.InputError, match=r"drives: must be keys.*motors=") as error:
        dt.study(**given, drives=({"mass": 1.0}, {"ratio": 50}))
    assert len(error.value.faults) == 1
    assert dt.current_commands(made).equals(dt.current_commands(dt.evaluate(made)))
    commands = dt.current_commands(selection)
    assert commands.equals(dt.current_commands(selection.evaluation))
    assert dt.pareto_front(study, "mass, energy").names == ("mass", "energy")
    curve = dt.optimum_curve(study, "voltage", ("40 V", "56000 mV"), points=2)
    assert [curve.points[0].value, curve.points[-1].value] == [40.0, 56.0]


def test_a_name_that_is_not_there_leads_to_the_one_that_is() -> None:
    for wrong, right in (
        ("size", "dt.evaluate"),
        ("currents", "dt.current_commands"),
        ("inverse_dynamic", "'inverse_dynamics'"),
    ):
        with pytest.raises(AttributeError, match=right):
            getattr(dt, wrong)
    assert next(iter(inspect.signature(dt.study).parameters)) == "arm"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"motion": (POSITION, TIME)}, "the time comes first"),
        ({"motion": (TIME, POSITION.T)}, r"give the transpose, such as q\.T"),
        (
            {"joints": [{"output_bearing": "external"}] * 2},
            r"joints: must be a mapping of joint names \(found 'list'\)",
        ),
        ({"motors": {"kind": "brushless", "mass": 1.0}}, r"one sheet without a key.*motors={\"MY_KEY\""),
        ({"gears": [{"kind": "planetary", "ratio": 5}]}, r"data sheets by key.*gears={\"MY_KEY\""),
        ({"arm": 5}, "name of a built-in arm, the path of a file, an Arm"),
        ({"gears": {"G": {"kind": "planetary", "ratio": 5, "eff": 0.9}}}, "did you mean 'efficiency'"),
    ],
)
def test_usual_mistakes_are_told_with_their_fix(wrong: dict[str, Any], words: str) -> None:
    given = {"arm": "planar-2r-bare", "drive_mass": "added", "motion": (TIME, POSITION), "supply": "48 V"} | wrong
    with pytest.raises(dt.InputError, match=words):
        dt.study(**given)


def test_degrees_taken_for_radians_show_wherever_a_result_shows_itself(study: Any, selection: Any) -> None:
    few = {"motors": {"keys": [LARGE[0]]}, "gears": {"keys": [LARGE[1]]}}
    doubted = dt.study(
        arm="planar-2r-bare", drive_mass="added", motion=(TIME, np.degrees(POSITION)), supply="48 V",
        joints={"default": {"candidates": few}},
    )  # fmt: skip
    assert "are these degrees?" in doubted.notes[-1]
    assert repr(doubted).endswith("2 warnings in .notes)")
    for result in (dt.select(doubted), dt.evaluate(doubted, LARGE)):
        assert repr(result).endswith("2 warnings in .study.notes)")
    assert "warning" not in repr(study) + repr(selection) + repr(selection.evaluation)


def test_what_was_chosen_is_taken_wherever_drives_are_needed(selection: Any) -> None:
    assert dt.Commander(selection).joints == dt.Commander(selection.evaluation).joints
    assert dt.fastest(selection).duration == dt.fastest(selection.study, selection.drives).duration


def test_an_unknown_heading_leads_to_the_columns_of_its_unit(tmp_path: Path) -> None:
    header = "key,kind,current_basis,winding_basis,R [ohm],Kt [mNm/A],peak [Nmm/Nmm],comment"
    (tmp_path / "motors.csv").write_text(f"{header}\nA,brushless,dc,line_line,1,2,3,4\n")
    with pytest.raises(dt.InputError) as caught:
        dt.read_catalog(tmp_path)
    hints = {fault.place.partition("column ")[2]: fault.hint for fault in caught.value.faults}
    assert hints["R [ohm]"] == "columns that take ohm: resistance"
    assert "torque_constant" in hints["Kt [mNm/A]"]
    assert hints["comment"].startswith("known: ")
