"""A study as a whole: what arrives in SI, what is refused, and every fault at once across all files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.study.model import DriveMass, Study


def test_everything_arrives(load: Any) -> None:
    study: Study = load({
        "ambient": "40 °C", "objective": "price", "safety": {"rms": 1.2, "reserve": "5 %"},
        "supply": {"voltage": "48 V", "mean_power": "0.2 kW"},
    })  # fmt: skip
    assert (study.name, study.ambient, study.objective) == ("two joints", 40.0, "price")
    assert (study.safety.rms, study.safety.reserve, study.safety.peak_torque) == (1.2, 0.05, 1.0)
    assert (study.supply.voltage, study.supply.mean_power, study.supply.peak_power) == (48.0, 200.0, None)
    assert study.drive_mass is DriveMass.INCLUDED
    assert study.arm is not None
    assert study.cycle.duration == pytest.approx(3.5)
    assert [body.name for body in study.payloads] == ["part"]
    assert list(study.catalog.motors) == ["small", "large"]
    assert [task.name for task in study.joints] == ["joint_1", "joint_2"]
    first, second = study.joints
    assert first.drive is None
    assert first.pairs == (("small", "p20"), ("small", "p60"))  # 0.35 and 0.45 kg
    assert second.drive == ("small", "p20")
    assert second.pairs == ()


def test_the_motion_is_the_quintic_in_radians(load: Any) -> None:
    cycle = load().cycle
    samples = np.unique(cycle.time, return_index=True)[1]
    for t in (0.1, 0.5, 0.9):
        found = [np.interp(t, cycle.time[samples], cycle.position[samples, joint]) for joint in range(2)]
        s = 10 * t**3 - 15 * t**4 + 6 * t**5
        # Samples stand 2 ms apart: linear interpolation between them is good to qdd h^2/8 = 1e-5 rad.
        np.testing.assert_allclose(found, [s * math.pi / 2, -s * math.pi / 4], atol=1e-5)
    carried = {cycle.segment_names[s]: p for s, p in zip(cycle.segment, cycle.payload, strict=True)}
    assert carried == {"there": 0, "dwell": 0, "back": -1}


def test_a_catalogue_row_is_converted_once(load: Any) -> None:
    large = load().catalog.motors["large"]
    assert large.resistance == pytest.approx(0.8)  # phase to line-line
    assert large.torque_constant == pytest.approx(0.09 / math.sqrt(1.5))  # rms to dc


def test_rows_written_into_the_study_join_the_catalogue(load: Any) -> None:
    own = {
        "current_basis": "rms", "winding_basis": "phase", "kind": "brushless", "resistance": "400 mohm",
        "torque_constant": "0.09 N m/A", "mass": "900 g", "source": "own measurement",
    }  # fmt: skip
    gear = {"kind": "spur", "ratio": -12.5, "source": "drawing 7"}
    study = load({
        "motors": {"mine": own, "small": {**own, "mass": "1 kg"}}, "gears": {"spur": gear},
        "joints.joint_2.drive": {"motor": "mine", "gear": "spur"},
    })  # fmt: skip
    mine, large = study.catalog.motors["mine"], study.catalog.motors["large"]
    assert mine.resistance == pytest.approx(large.resistance)
    assert mine.torque_constant == pytest.approx(large.torque_constant)
    assert mine.source == "own measurement"
    assert study.catalog.gears["spur"].ratio == -12.5
    assert study.joints[1].drive == ("mine", "spur")
    assert study.catalog.motors["small"].mass == 1.0
    assert any("replace" in note and "small" in note for note in study.notes)


def test_every_fault_of_every_file_at_once(load: Any, folder: Path) -> None:
    (folder / "wave.csv").write_text("time [s],q_joint_1 [deg],q_joint_2\n0,0,0\n1,x,1\n2,2,2\n", encoding="utf-8")
    motors = folder / "catalog" / "motors.csv"
    motors.write_text(
        motors.read_text(encoding="utf-8").replace("dc,line_line,1.2", ",line_line,-1.2"), encoding="utf-8"
    )
    with pytest.raises(InputError) as caught:
        load({
            "drive_mass": None, "payloads.part.mass": 2, "motions.there": {"file": "wave.csv"},
            "motions.back.durations": ["2 s", "1 s"],
            "cycle": [{"motion": "their"}, {"dwell": "1 s", "payload": "prt"}],
            "joints.joint_3": {}, "joints.joint_2.friction": {"coulomb": "1 N m", "static": "0.5 N m"},
            "supply.voltag": "48 V", "assumptions": {"gears": {"planetry": {"efficiency": 0.8, "source": "me"}}},
        })  # fmt: skip
    told = str(caught.value)
    for words in (
        "drive_mass: is missing", "added: the arm's links are bare", "payloads.part.mass: needs a unit",
        "wave.csv: column q_joint_2", "motions.back.durations: must be 1 times", "cycle[0].motion: is no motion",
        "did you mean 'there'?", "cycle[1].payload", "did you mean 'part'?", "joints.joint_3: is no joint",
        "joints.joint_2.friction", "supply.voltag: is not known here", "assumptions.gears.planetry",
        "did you mean 'planetary'?", "motors.csv: row 2, column current_basis", "motors.csv: row 2, column resistance",
    ):  # fmt: skip
        assert words in told, f"{words!r} is not in\n{told}"
    files = {fault.file.split(":")[0].rsplit("/", 1)[-1] for fault in caught.value.faults}
    assert files == {"study.yaml", "wave.csv", "motors.csv"}


@pytest.mark.parametrize(
    ("changes", "place", "words"),
    [
        ({"arm": "ur55"}, "arm", "did you mean 'ur5'?"),
        ({"arm": "absent.urdf"}, "arm", "no such file"),
        ({"arm": "links.csv"}, "arm", "a DH table is {dh: links.csv, convention: classic}"),
        ({"arm": {"dh": "absent.csv", "convention": "classic"}}, "the file", "cannot be read"),
        ({"tip": "hand"}, "arm, tip", "no links to choose from"),
        ({"motions.there.waypoints": [[0, 0], [90]]}, "motions.there.waypoints[1]", "2 values"),
        ({"motions.there.waypoints": [[0, 0], [90, "5 mm"]]}, "motions.there.waypoints[1][1]", "angle"),
        ({"motions.there.unit": None}, "motions.there.waypoints[1][0]", "give the motion a unit"),
        ({"motions.there.profile": None}, "motions.there.profile", "is missing"),
        ({"motions.there.durations": None}, "motions.there", "needs a duration, or limits"),
        ({"motions.there.durations": ["2 h"]}, "motions.there", "too long"),
        ({"motions.there.speed": "1e-9 rad/s"}, "motions.there", "too long"),
        ({"motions.there.speed": ["1 rad/s"]}, "motions.there.speed", "1 limits"),
        ({"motions.there.speed": "90 deg"}, "motions.there.speed", "rotation speed"),
        ({"motions.there": {"table": "x.csv"}}, "motions.there.table", "without an arm"),
        ({"motions.there": {"file": "x.csv", "profile": "quintic"}}, "motions.there.profile", "combined with file"),
        ({"motions.there": {}}, "motions.there", "one of: file, table, samples, waypoints"),
        ({"motions.default": {"durations": ["1 s"]}}, "motions.default.durations", "for one motion"),
        ({"cycle": None}, "cycle", "in which order"),
        ({"cycle": []}, "cycle", "at least one"),
        ({"cycle": [{"motion": "there"}]}, "cycle, end (there) to start (there)", "does not close"),
        ({"joints.default": None}, "joints.joint_1", "what may drive this joint"),
        ({"joints.default": {}}, "joints.default", "neither a drive nor candidates"),
        ({"payloads.part.inertia": "8e-3 kg m^2"}, "payloads.part.inertia", "{xx: 8e-3 kg m^2"),
        ({"joints.joint_2": {"drive": {"motor": "smal", "gear": "p20"}}}, "joints.joint_2.drive.motor", "'small'"),
        ({"joints.joint_2": {"drive": {"motor": "small", "gear": "p2"}}}, "joints.joint_2.drive.gear", "'p20'"),
        ({"joints.joint_2.load_inertia": "1 kg m^2"}, "joints.joint_2.load_inertia", "without an arm"),
        ({"joints.joint_2.travel_per_turn": "5 mm/rev"}, "joints.joint_2.travel_per_turn", "prismatic"),
        ({"joints.joint_2.contained": {"mass": "1 kg"}}, "joints.joint_2.contained", "drive_mass: replaced"),
        ({"drive_mass": "replaced"}, "joints.default.contained", "what the links hold"),
        ({"amplifier": {"peak_current": "10 A"}}, "amplifier.peak_current", "current_basis"),
        ({"catalogs": ["catalog", "absent"]}, "absent", "is no folder"),
        ({"gears": {"g": {"kind": "spur", "ratio": 0, "source": "x"}}}, "gears.g, gear g.ratio", "must not be 0"),
        ({"joints.default": {"candidates": {"gears": {"kind": "rv"}}}}, "joints.default.candidates.gears.kind", "rv"),
        ({"joints.default.candidates.frameless_rule": {"min_diameter_ratio": 3}}, "frameless rule", "the smallest"),
        ({"joints.default.candidates.gears": {"ratio": [-160, -30]}}, "gears.ratio", "must not be negative"),
        ({"joints.default.candidates.gears": {"ratio": [None, -30]}}, "gears.ratio", "must not be negative"),
        ({"motions.default": {"file": "x.csv"}}, "motions.default.file", "for one motion"),
    ],
)  # fmt: skip
def test_one_fault(faults_of: Any, changes: dict[str, Any], place: str, words: str) -> None:
    found = faults_of(changes)
    assert any(known.startswith(place) or known.endswith(place) for known in found), found
    assert words in " ".join(found.values())


def test_what_only_an_arm_gives_meaning_is_refused_without_one(faults_of: Any) -> None:
    found = faults_of({"arm": None, "gravity": ["0 m/s^2", "0 m/s^2", "1 m/s^2"]})
    assert {"gravity", "drive_mass", "payloads", "motions.there.waypoints", "motions.back.waypoints"} <= set(found)


def test_a_load_table_needs_no_arm(load: Any, folder: Path) -> None:
    (folder / "load.csv").write_text(
        "time [s],torque_door [N m],speed_door [rpm]\n0,10,0\n1,10,60\n2,-10,0\n", encoding="utf-8"
    )
    study = load({
        "arm": None, "drive_mass": None, "payloads": None, "cycle": None, "motions": {"swing": {"table": "load.csv"}},
        "joints": {"door": {"candidates": {}}},
    })  # fmt: skip
    assert study.arm is None
    assert study.cycle.joint_names == ("door",)
    assert study.cycle.torque is not None
    assert study.cycle.position[-1, 0] == pytest.approx(2.0 * math.pi)  # one turn a second, on average half of it
    assert study.joints[0].pairs


def test_positions_outside_the_ranges_are_faults_and_speeds_warnings(load: Any, faults_of: Any) -> None:
    panda = {
        "arm": "panda", "cycle": None, "payloads": None, "joints": {"default": {"candidates": {}}},
        "motions": {"nod": {"unit": "deg", "profile": "quintic", "durations": ["0.2 s", "0.2 s"],
                            "waypoints": [[0, 0, 0, -90, 0, 90, 0], [50, 0, 0, -90, 0, 90, 0],
                                          [0, 0, 0, -90, 0, 90, 0]]}},
    }  # fmt: skip
    study = load(panda)
    assert any("panda_joint1" in note and "speed limit" in note for note in study.notes)
    panda["motions"]["nod"]["waypoints"][1][3] = 10
    found = faults_of(panda)
    assert any("panda_joint4" in place + text and "upper limit" in text for place, text in found.items())


def test_the_only_motion_and_the_only_payload_make_the_cycle(load: Any) -> None:
    loop = {"unit": "deg", "profile": "trapezoid", "durations": ["1 s", "1 s"], "waypoints": [[0, 0], [9, 9], [0, 0]]}
    study = load({"motions": {"loop": loop}, "cycle": None})
    assert study.cycle.segment_names == ("loop",)
    assert set(study.cycle.payload) == {0}
    assert study.payloads[0].mass == 2.0
    assert any("point mass" in note for note in study.notes)


def test_default_motion_fills_in_what_others_leave_out(load: Any) -> None:
    default = {"unit": "deg", "profile": "trapezoid", "speed": "90 deg/s", "acceleration": "180 deg/s^2"}
    study = load({
        "motions": {"default": default, "there": {"waypoints": [[0, 0], [90, 0]]},
                    "back": {"waypoints": [[90, 0], [0, 0]], "speed": "45 deg/s"}},
        "cycle": [{"motion": "there"}, {"motion": "back"}],
    })  # fmt: skip
    # 90 deg at 90 deg/s with ramps of 0.5 s: 1.5 s; at 45 deg/s with ramps of 0.25 s: 2.25 s.
    assert study.cycle.duration == pytest.approx(1.5 + 2.25)
    assert np.abs(study.cycle.velocity).max() == pytest.approx(math.pi / 2)


def test_a_wrong_profile_of_the_default_motion_is_one_fault(load: Any) -> None:
    """The motions that take it from there are not said to lack one."""
    default = {"unit": "deg", "profile": "trapez", "speed": "90 deg/s", "acceleration": "180 deg/s^2"}
    with pytest.raises(InputError) as caught:
        load({
            "motions": {"default": default, "there": {"waypoints": [[0, 0], [90, 0], [0, 0]]}},
            "cycle": [{"motion": "there"}],
        })  # fmt: skip
    assert [fault.place for fault in caught.value.faults] == ["motions.default.profile"]


def test_digest_follows_content_only(load: Any, folder: Path) -> None:
    first = load().digest
    assert load().digest == first
    gears = folder / "catalog" / "gears.csv"
    gears.write_text(gears.read_text(encoding="utf-8").replace("60,250", "60,251"), encoding="utf-8")
    second = load().digest
    assert second != first
    assert load({"name": "another"}).digest != second


def test_a_pair_nobody_publishes_is_allowed_with_a_note(load: Any) -> None:
    study = load({"joints.joint_2": {"drive": {"motor": "large", "gear": "p20"}}})
    assert study.joints[1].drive == ("large", "p20")
    assert any("joint_2: large with p20 is not published" in note for note in study.notes)
    direct = load({"joints.joint_2": {"drive": {"motor": "large", "gear": "none"}}})
    assert direct.joints[1].drive == ("large", "")


def test_a_task_done_once_may_end_elsewhere(load: Any) -> None:
    study = load({"cycle": [{"motion": "there"}], "open_cycle": True})
    assert study.cycle.position[-1, 0] == pytest.approx(math.pi / 2)
    assert any("goes on from" in note for note in study.notes)


def test_no_candidate_left_is_no_fault(load: Any) -> None:
    study = load({"joints.default": {"candidates": {"motors": {"mass": ["5 kg", None]}}}})
    assert study.joints[0].pairs == ()
    assert "motors: 0 of 2 considered" in study.joints[0].passed_over[0]


@pytest.mark.parametrize(
    ("rules", "words"),
    [
        ({"motors": {"mass": ["50 kg", None]}}, "motors: 0 of 2 considered; filtered out 2 by 'mass: at least 50 kg'"),
        ({"gears": {"ratio": [400, None]}}, "gears: 0 of 2 considered; filtered out 2 by 'ratio: at least 400'"),
        ({"motors": {"price": [None, 300]}}, "motors: 0 of 2 considered; filtered out 2 by 'price: at most 300'"),
        ({"motors": {"keys": "large"}}, "pairs: 0 of 2 combinations are published as fitting"),
    ],
)
def test_a_joint_that_nothing_can_drive_is_no_fault_of_the_file(load: Any, rules: dict[str, Any], words: str) -> None:
    """That is for a selection to answer; the rules that left nothing are told in words."""
    study = load({"joints": {"default": {"candidates": rules}}})
    assert [task.pairs for task in study.joints] == [(), ()]
    assert words in study.joints[0].passed_over


def test_joints_with_the_same_rules_share_one_list_of_pairs(load: Any) -> None:
    study = load({"joints": {"default": {"candidates": {}}, "joint_2": {"mount": {"carrier": "child"}}}})
    first, second = study.joints
    assert first.pairs is second.pairs and len(first.pairs) == 2
    other = load({"joints": {"default": {"candidates": {}}, "joint_2": {"candidates": {"gears": {"ratio": [50, 70]}}}}})
    assert len(other.joints[0].pairs) == 2 and other.joints[1].pairs == (("small", "p60"),)
