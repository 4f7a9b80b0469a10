"""What can hardly be meant is doubted with its place and what was probably meant; what is sound is not."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivetrain.arm.builtin import builtin_names
from drivetrain.errors import InputError
from drivetrain.study.model import Study
from drivetrain.study.read import load_study
from drivetrain.study.template import study_template
from drivetrain.whole_files import shipped

GEAR = {"kind": "planetary", "ratio": 20, "mass": "150 g", "efficiency": "80 %", "source": "sheet"}
INERTIA = {"xx": "5e-3 kg m^2", "yy": "5e-3 kg m^2", "zz": "5e-3 kg m^2"}


def doubts(study: Study) -> list[str]:
    return [note for note in study.notes if note.startswith("warning:")]


def moved(unit: str | list[str], *waypoints: list[Any], **more: Any) -> dict[str, Any]:
    """A motion there and back alone."""
    rows = [[0, 0], *waypoints, [0, 0]]
    entry = {"unit": unit, "profile": "quintic", "durations": ["60 s"] * (len(rows) - 1), "waypoints": rows, **more}
    return {"motions": {"go": entry}, "cycle": [{"motion": "go"}]}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"payloads.part": {"mass": "2 kg", "com": ["0 m", "0 m", "60 m"]}},
            ["payloads.part.com", "60 m from the tip", "60 mm"],
        ),
        ({"payloads.part": {"mass": "250 kg"}}, ["payloads.part.mass", "250 kg", "20 times the 3 kg", "250 g meant"]),
        (
            {"payloads.part": {"mass": "50 kg", "inertia": {key: "1e-7 kg m^2" for key in INERTIA}}},
            ["payloads.part.mass", "50 kg", "denser than any metal", "50 g meant"],
        ),
        (
            {"payloads.part": {"mass": "2 g", "inertia": {key: "1 kg m^2" for key in INERTIA}}},
            ["payloads.part.mass", "0.002 kg", "lighter than air", "2 kg meant"],
        ),
        *(
            (
                {"payloads.part": {"mass": "3 kg", "inertia": dict.fromkeys(INERTIA, inertia)}},
                ["payloads.part.mass", beside, "inertia in another unit"],
            )
            for inertia, beside in (("8 kg m^2", "lighter than air"), ("8e-6 kg m^2", "denser than any metal"))
        ),  # 1000 times too large and too small: 3 kg with 8e-3 kg m^2 is right
        (
            {"payloads.part": {"mass": "3 kg", "inertia": INERTIA | {"zz": "50e-3 kg m^2"}}},
            ["payloads.part.inertia", "no body has principal moments 0.005, 0.005, 0.05 kg m^2"],
        ),
        ({"gravity": ["0 m/s^2", "0 m/s^2", "-981 m/s^2"]}, ["gravity", "981 m/s^2", "9.81 m/s^2"]),
        (moved("rad", [90, -45]), ["motions.go.waypoints[1][0]", "joint_1 at 90 rad, 14.3 turns", "90 deg meant"]),
        (
            moved("deg", [90, -45], ["90 rad", 0]),
            ["motions.go.waypoints[2][0]", "joint_1 at 90 rad", "90 deg meant"],
        ),
        (
            moved("deg", [90, -45], durations=["30 ms", "30 ms"]),
            ["motions.go", "joint_1 reaches", "rad/s", "rpm", "deg/s meant"],
        ),
        (
            {"cycle": [{"motion": way, "payload": "part"} for way in ("there", "back")] + [{"dwell": "1 s"}]},
            ["cycle[2]", "carries nothing in this dwell, between motions with part", "payload: part meant"],
        ),
        ({"gears": {"mine": GEAR | {"ratio": 0.02}}}, ["gears.mine.ratio", "0.02", "50 meant"]),
        ({"gears": {"mine": GEAR | {"ratio": -20}}}, ["gears.mine.ratio", "-20", "20 meant"]),
        (
            {"joints.joint_2.mount": {"offset": "50 m"}},
            ["joints.joint_2.mount.offset", "50 m from its joint", "50 mm meant"],
        ),
        ({"ambient": "30 K"}, ["ambient", "-243.1 °C", "was °C meant?"]),
        ({"ambient": "298 °C"}, ["ambient", "298 °C", "was K meant?"]),
        ({"supply": {"voltage": "320 mV"}}, ["supply.voltage", "0.32 V", "was 320 V meant?"]),
        ({"supply": {"voltage": "48 kV"}}, ["supply.voltage", "4.8e+04 V", "was 48 V meant?"]),
        (
            {"joints.default": {"candidates": {"motors": {"mass": ["5 kg", None]}}}},
            [
                "joints.default.candidates",
                "no pair",
                "joint_1",
                "filtered out 2 by 'mass: at least 5 kg'",
                "rules of `motors`",
            ],
        ),
        (
            {"joints.default": {"candidates": {"gears": {"ratio": [900, 990]}}}},
            ["joints.default.candidates", "joint_1", "filtered out 2 by 'ratio: 900 to 990'", "rules of `gears`"],
        ),
        (
            {"joints.default": {"candidates": {"motors": {"keys": ["large"]}}}},
            ["joints.default.candidates", "pairs: 0 of 2 combinations", "pairs: all lets"],
        ),
    ],
)
def test_what_can_hardly_be_meant_is_doubted_in_one_line(load: Any, changes: dict[str, Any], words: list[str]) -> None:
    found = doubts(load(changes))
    assert len(found) == 1
    assert "\n" not in found[0] and "study.yaml:" in found[0]
    assert all(word in found[0] for word in words), found[0]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"payloads.part": {"mass": "30 kg", "com": ["0 m", "0 m", "1.9 m"], "inertia": INERTIA}},
        {"payloads.part": {"mass": "0.2 g"}},
        {"cycle": [{"motion": "there", "payload": "part"}, {"dwell": "1 s"}, {"motion": "back"}]},
        {"payloads.part": {"mass": "7.85 kg", "inertia": INERTIA}},
        {"payloads.part": {"mass": "2 kg", "inertia": dict.fromkeys(INERTIA, "0.4 kg m^2")}},  # a frame of 1.5 m
        {"gravity": ["0 m/s^2", "0 m/s^2", "-24.8 m/s^2"]},
        moved("rad", [3.2, -12.5]),
        moved("deg", [1080, -720]),
        moved("deg", [90, -45], durations=["200 ms", "200 ms"]),
        {"gears": {"mine": GEAR | {"ratio": -20, "kind": "spur"}, "other": GEAR | {"ratio": 1}}},
        {"joints.joint_2.mount": {"offset": "-400 mm"}},
    ],
)
def test_what_is_plausible_is_not_doubted(load: Any, changes: dict[str, Any]) -> None:
    assert doubts(load(changes)) == []


def test_seventy_for_seventy_percent_is_a_fault_that_says_so(load: Any) -> None:
    with pytest.raises(InputError, match=r"at most 1.*was 70 % meant"):
        load({"gears": {"mine": GEAR | {"efficiency": 70}}})


def with_table(load: Any, folder: Path, header: str, rows: str) -> Study:
    (folder / "arm.csv").write_text(header + "\n" + rows, encoding="utf-8")
    study: Study = load({"arm": {"dh": "arm.csv", "convention": "classic"}})
    return study


def test_a_table_in_millimetres_with_metres_above_it(load: Any, folder: Path) -> None:
    rows = "425,0,0,5,-200\n390,0,90,3,-180\n"
    header = "a [{0}],alpha [deg],d [{0}],mass [kg],com_x [{1}]"
    assert doubts(with_table(load, folder, header.format("mm", "mm"), rows)) == []
    found = doubts(with_table(load, folder, header.format("m", "mm"), rows))
    assert [note.split(": ")[1].rpartition("/")[2] for note in found] == ["arm.csv:2", "arm.csv:3", "arm.csv:3"]
    assert "column a: 425 m is more than 10 m; was 425 mm meant?" in found[0]
    found = doubts(with_table(load, folder, header.format("mm", "m"), rows))
    assert len(found) == 2 and "column com_x: -200 m is more than 3 m; was -200 mm meant?" in found[0]


def test_a_slide_in_millimetres_as_metres(load: Any, folder: Path) -> None:
    rows = "prismatic,0,0,0.1,5\nrevolute,0.4,0,0,3\n"
    (folder / "arm.csv").write_text("kind,a [m],alpha [deg],d [m],mass [kg]\n" + rows, encoding="utf-8")

    def study(unit: str, travel: str) -> Study:
        slide = {"joints.joint_1": {"drive": {"motor": "small", "gear": "p20"}, "travel_per_turn": travel}}
        table = {"arm": {"dh": "arm.csv", "convention": "classic"}, "joints.default": {"candidates": {}}}
        loaded: Study = load(table | slide | moved([unit, "deg"], [800, 90]))
        return loaded

    assert doubts(study("mm", "20 mm/rev")) == []
    [slid] = doubts(study("m", "20 mm/rev"))
    assert "motions.go.waypoints[1][0]: joint joint_1 at 800 m, more than 50 m; was 800 mm meant?" in slid
    [travelled] = doubts(study("mm", "20 m/rev"))
    assert "joints.joint_1.travel_per_turn: 20 m a turn; was 20 mm meant?" in travelled


ROBOT = """<robot name="two"><link name="base"/>
<link name="upper"><inertial><origin xyz="{com} 0 0"/><mass value="3"/>
<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="joint_1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-{turn}" upper="{turn}" effort="1" velocity="3"/></joint>
<joint name="joint_2" type="continuous"><parent link="upper"/><child link="fore"/><axis xyz="0 0 1"/>
<origin xyz="{length} 0 0"/></joint></robot>"""


@pytest.mark.parametrize(
    ("spoiled", "words"),
    [
        ({}, []),
        ({"com": "250"}, ["centre of mass of link upper", "250 m", "250 mm meant"]),
        ({"com": "4.5"}, ["centre of mass of link upper", "4.5 m"]),
        ({"length": "400"}, ["link upper is 400 m long", "400 mm meant"]),
        ({"turn": "180"}, ["joint joint_1 may turn to 180 rad, 28.6 turns", "180 deg meant"]),
    ],
)
def test_a_robot_file(load: Any, folder: Path, spoiled: dict[str, str], words: list[str]) -> None:
    text = ROBOT.format(**{"com": "0.25", "length": "0.4", "turn": "6.2"} | spoiled)
    (folder / "two.urdf").write_text(text, encoding="utf-8")
    found = doubts(load({"arm": "two.urdf"}))
    assert len(found) == bool(words)
    assert all(word in found[0] and "study.yaml:" in found[0] for word in words), found


# What is varied, its border written out, whether larger values are doubted, and a word of the warning.
SOLID = (4.0 / 3.0 * math.pi) ** 0.4 * 2.5**0.6 * 0.01**0.6  # kg^(3/5) m^(6/5) of a ball: m = (density SOLID^2.5)^0.4
QUINTIC = 15.0 / 8.0  # largest speed over mean speed
BORDERS: dict[str, tuple[Callable[[float], dict[str, Any]], float, bool, str]] = {
    "cold": (lambda v: {"ambient": f"{v!r} degC"}, -90.0, False, "was °C meant?"),
    "hot": (lambda v: {"ambient": f"{v!r} degC"}, 150.0, True, "was K meant?"),
    **{
        name: (lambda v, name=name: {"safety": {name: v}}, 1.0, False, f"safety.{name}: a factor of 0.999999")
        for name in ("peak_torque", "rms", "speed", "voltage", "bearing_static_safety", "bearing_load_factor", "brake")
    },
    "amplifier": (
        lambda v: {"amplifier": {"current_basis": "dc", "continuous_current": "20 A", "peak_current": f"{v!r} A"}},
        20.0, False, "amplifier.peak_current: is below",
    ),
    "com": (
        lambda v: {"payloads.part": {"mass": "2 kg", "com": [f"{0.6 * v!r} m", "0 m", f"{-0.8 * v!r} m"]}},
        3.0, True, "payloads.part.com",
    ),
    "payload": (lambda v: {"payloads.part": {"mass": f"{v!r} kg"}}, 20.0 * 3.0, True, "20 times the 3 kg"),
    "dense": (
        lambda v: {"payloads.part": {"mass": f"{v!r} kg", "inertia": dict.fromkeys(INERTIA, "1e-8 kg m^2")}},
        1e7**0.4 * SOLID * 1e-6**0.6, True, "denser than any metal",
    ),
    "light": (
        lambda v: {"payloads.part": {"mass": f"{v!r} kg", "inertia": dict.fromkeys(INERTIA, "1 kg m^2")}},
        0.3**0.4 * SOLID * 100.0**0.6, False, "lighter than air",
    ),
    "gravity": (lambda v: {"gravity": ["0 m/s^2", f"{-v!r} m/s^2", "0 m/s^2"]}, 30.0, True, "more than on any planet"),
    "angle": (lambda v: moved("rad", [1.0, -v]), 4.0 * math.pi, True, "joint_2 at -12.57 rad, -2 turns"),
    "fast": (
        lambda v: moved("rad", [0.0, 5.0], durations=[f"{5.0 * QUINTIC / v!r} s"] * 2), 50.0, True,
        "joint_2 reaches 50 rad/s, 477.5 rpm",
    ),
    "offset": (lambda v: {"joints.joint_2.mount": {"offset": f"{-v!r} m"}}, 3.0, True, "drive sits -3 m"),
}  # fmt: skip


@pytest.mark.parametrize("name", BORDERS)
def test_each_bound_is_where_it_says(load: Any, name: str) -> None:
    changes, border, upward, word = BORDERS[name]
    outward = 1e-6 if upward else -1e-6
    outward *= math.copysign(1.0, border)
    assert doubts(load(changes(border * (1.0 - outward)))) == []
    [found] = doubts(load(changes(border * (1.0 + outward))))
    assert word in found


@pytest.mark.parametrize(
    ("given", "name", "border", "word"),
    [
        ({}, "com", 3.0, "more than 3 m"),
        ({"length": 0.2}, "com", 2.0, "more than 2 m"),
        ({"length": 0.05}, "com", 1.0, "more than 1 m"),
        ({}, "length", 10.0, "10 m long, more than 10 m"),
    ],
)
def test_each_bound_of_a_link_is_where_it_says(
    load: Any, folder: Path, given: dict[str, float], name: str, border: float, word: str
) -> None:
    for share, count in ((1.0 - 1e-6, 0), (1.0 + 1e-6, 1)):
        text = ROBOT.format(**{"com": 0.25, "length": 0.4, "turn": 6.2} | given | {name: border * share})
        (folder / "two.urdf").write_text(text, encoding="utf-8")
        found = doubts(load({"arm": "two.urdf"}))
        assert len(found) == count and all(word in note for note in found)


@pytest.mark.parametrize(("turn", "count"), [(39.0, 0), (40.0, 1), (719.5, 0), (720.0, 1), (721.0, 0)])
def test_whole_numbers_are_ranges_in_degrees(load: Any, folder: Path, turn: float, count: int) -> None:
    (folder / "two.urdf").write_text(ROBOT.format(com=0.25, length=0.4, turn=turn), encoding="utf-8")
    assert len(doubts(load({"arm": "two.urdf"}))) == count


def test_degrees_beyond_a_joints_range_stay_a_fault_that_names_the_unit(load: Any, folder: Path) -> None:
    (folder / "two.urdf").write_text(ROBOT.format(com="0.25", length="0.4", turn="6.2"), encoding="utf-8")
    with pytest.raises(InputError, match=r"above the upper limit.*degrees given as rad"):
        load({"arm": "two.urdf"} | moved("rad", [90, 0]))


def test_a_file_of_radians_that_are_degrees(load: Any, folder: Path) -> None:
    lines = [f"{0.05 * i:.2f},{90 * (i / 40) ** 2 * (3 - 2 * i / 40):.6f},0" for i in range(41)]
    for unit, count in (("rad", 1), ("deg", 0)):
        (folder / "go.csv").write_text(f"t [s],joint_1 [{unit}],joint_2 [{unit}]\n" + "\n".join(lines), "utf-8")
        found = doubts(load({"motions": {"go": {"file": "go.csv"}}, "cycle": [{"motion": "go"}], "open_cycle": True}))
        assert sum("are these degrees?" in note for note in found) == count, found


@pytest.mark.parametrize("name", builtin_names())
def test_no_built_in_arm_is_doubted(name: str, tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(study_template(name), encoding="utf-8")
    assert doubts(load_study(tmp_path / "study.yaml")) == []


@pytest.mark.parametrize("path", sorted(shipped("examples").glob("*/*.yaml")), ids=lambda path: path.parent.name)
def test_no_example_is_doubted(path: Path) -> None:
    if "schema_version" in path.read_text(encoding="utf-8") and path.name != "sweep.yaml":
        assert doubts(load_study(path)) == []
