"""Arms from screws: what is taken, what is mended, what is refused, and that all faults are told at once."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.errors import InputError, PhysicsWarning
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation

HOME = [pose(point=[1.0, 0.0, 0.2]), pose(point=[2.0, 0.0, 0.0])]
SCREWS = [[0, 0, 1.0, 0, 0, 0], [0, 0, 1.0, 0, -1.0, 0]]
MASSES = [1.0, 2.0]
INERTIAS = [np.eye(3), np.eye(3)]


def faults_of(error: pytest.ExceptionInfo[InputError]) -> list[str]:
    return [fault.place for fault in error.value.faults]


def test_defaults() -> None:
    arm = Arm.from_screws(HOME, SCREWS, MASSES, INERTIAS)
    assert arm.n == 2
    assert arm.gravity.tolist() == [0, 0, -9.81]
    assert np.array_equal(arm.tip, HOME[1])
    assert arm.rotors == (None, None)
    assert arm.joint_names == ("joint_1", "joint_2")
    assert arm.lower.tolist() == [-np.inf] * 2
    assert arm.notes == ()


def test_joints_sit_abreast_of_the_centre_of_mass() -> None:
    slide = [0, 0, 0, 0, 0, 1.0]
    helix = [0, 0, 1.0, 0, -1.0, 0.3]
    arm = Arm.from_screws([*HOME, HOME[0]], [SCREWS[0], helix, slide], [1, 1, 1], [np.eye(3)] * 3)
    assert arm.joint_points == pytest.approx(np.array([[0, 0, 0.2], [1, 0, 0], [1, 0, 0.2]]))


def test_nothing_can_be_written_into() -> None:
    arm = Arm.from_screws(HOME, SCREWS, MASSES, INERTIAS, joint_points=np.zeros((2, 3)), lower=[0, 0])
    for name in ("home", "screws", "masses", "inertias", "tip", "gravity", "joint_points", "lower", "upper"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(arm, name)[...] = 0.0


def test_the_users_arrays_stay_the_users() -> None:
    masses, home = np.array(MASSES), np.array(HOME)
    arm = Arm.from_screws(home, SCREWS, masses, INERTIAS, tip=home[1])
    masses[0], home[0, 0, 3] = 9.0, 9.0
    assert arm.masses[0] == 1.0
    assert arm.home[0, 0, 3] == 1.0


def test_rounded_screws_and_frames_are_made_exact() -> None:
    turn = exp_rotation([0.3, -0.2, 0.9])
    rounded = np.round(turn, 7)
    axis = np.round(turn[:, 2], 7)
    screw = np.concatenate([axis, np.cross([0.5, 0.5, 0.0], axis)])
    arm = Arm.from_screws([pose(rounded)], [screw], [1.0], [np.eye(3)])
    assert np.linalg.norm(arm.screws[0, :3]) == pytest.approx(1.0, abs=1e-15)
    assert arm.home[0, :3, :3].T @ arm.home[0, :3, :3] == pytest.approx(np.eye(3), abs=4e-15)  # one decomposition
    assert arm.home[0, :3, :3] == pytest.approx(turn, abs=1e-6)


def test_exact_input_is_kept_to_the_bit() -> None:
    turn = exp_rotation([0.3, -0.2, 0.9])
    arm = Arm.from_screws([pose(turn)], [SCREWS[0]], [1.0], [np.diag([0.1, 0.2, 0.25])])
    assert np.array_equal(arm.home[0], pose(turn))
    assert np.array_equal(arm.inertias[0], np.diag([0.1, 0.2, 0.25]))


def test_all_faults_at_once() -> None:
    bad_home = [pose(2 * np.eye(3)), np.full((4, 4), np.nan)]
    bad_screws = [[0, 0, 2.0, 0, 0, 0], [0, 0, 0, 0, 0, 0]]
    with pytest.raises(InputError) as error:
        Arm.from_screws(
            bad_home,
            bad_screws,
            [-1.0, 2.0],
            [np.arange(9).reshape(3, 3), np.diag([1, 1, -1])],
            tip=np.eye(3),
            gravity=[0, 0],
            joint_names=["a", "a"],
            lower=[1, 0],
            upper=[0, 0],
            speed_limits=[0, 1],
            joint_points=np.zeros((3, 3)),
        )
    places = faults_of(error)
    for wanted in ("home[0]", "home[1][0, 0]", "screws[0]", "screws[1]", "masses[0]", "inertias[0]", "inertias[1]",
                   "tip", "gravity", "joint_names", "lower[0]", "speed_limits[0]", "joint_points"):  # fmt: skip
        assert wanted in places


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"masses": [1.0, np.nan]}, "masses[1]"),
        ({"masses": []}, "masses"),
        ({"masses": 3.0}, "masses"),
        ({"screws": SCREWS[:1]}, "screws"),
        ({"home": np.eye(4)}, "home"),
        ({"home": [pose(np.diag([1.0, 1.0, -1.0])), HOME[1]]}, "home[0]"),
        ({"home": [HOME[0], np.ones((4, 4))]}, "home[1]"),
        ({"inertias": [np.eye(3), np.array([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]])]}, "inertias[1]"),
        ({"upper": [1.0]}, "upper"),
        ({"lower": [0.0, np.nan]}, "lower"),
        ({"lower": "ab"}, "lower"),
    ],
)
def test_each_fault_has_its_place(change: dict[str, object], place: str) -> None:
    arguments = {"home": HOME, "screws": SCREWS, "masses": MASSES, "inertias": INERTIAS} | change
    with pytest.raises(InputError) as error:
        Arm.from_screws(**arguments)
    assert place in faults_of(error)


def test_impossible_inertia_warns_by_name_and_is_noted() -> None:
    turn = exp_rotation([0.7, 0.1, -0.4])
    hidden = turn @ np.diag([1.0, 1.0, 2.2]) @ turn.T  # its diagonal alone looks fine
    diagonal = np.sort(np.diag(hidden))
    assert diagonal[2] < diagonal[0] + diagonal[1]
    with pytest.warns(PhysicsWarning, match="forearm") as caught:
        arm = Arm.from_screws(HOME, SCREWS, MASSES, [np.eye(3), hidden], link_names=["upper", "forearm"])
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert "forearm" in arm.notes[0]


def test_planar_inertia_is_allowed_with_a_warning() -> None:
    with pytest.warns(PhysicsWarning):
        arm = Arm.from_screws(HOME, SCREWS, MASSES, [np.diag([0, 0, 1.0]), np.zeros((3, 3))])
    assert len(arm.notes) == 1


def test_flat_bodies_and_points_do_not_warn() -> None:
    Arm.from_screws(HOME, SCREWS, MASSES, [np.diag([1.0, 1.0, 2.0]), np.zeros((3, 3))])
