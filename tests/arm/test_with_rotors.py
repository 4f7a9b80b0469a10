"""Rotors: what they refuse, and how an arm settles what they leave open."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import MountedRotor, Rotor, RotorLevel
from drivetrain.errors import InputError
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation, unit

AXIS = unit([1.0, 2.0, -0.5])
POINT = np.array([0.4, -0.1, 0.7])


def line(axis: np.ndarray, point: np.ndarray) -> np.ndarray:
    return np.concatenate([axis, np.cross(point, axis)])


@pytest.fixture
def arm() -> Arm:
    screws = [[0, 0, 1.0, 0, 0, 0], line(AXIS, POINT), [0, 0, 0, 0, 1.0, 0]]
    home = [pose(point=[0.2, 0, 0.3]), pose(point=[1, 1, 1.0]), pose(point=[2, 0, 0.5])]
    return Arm.from_screws(home, screws, [1, 1, 1], [np.eye(3)] * 3)


def mounted(arm: Arm, joint: int, rotor: Rotor) -> MountedRotor:
    rotors: list[Rotor | None] = [None] * arm.n
    rotors[joint] = rotor
    found = with_rotors(arm, rotors).rotors[joint]
    assert isinstance(found, MountedRotor)
    return found


def test_defaults_on_a_vertical_axis_are_the_base_axes(arm: Arm) -> None:
    rotor = mounted(arm, 0, Rotor(-50.0, np.diag([1e-3, 2e-3, 2.5e-3]), 0.4))
    assert rotor.ratio == -50.0
    assert rotor.carrier == -1
    assert np.array_equal(rotor.home, pose(point=[0, 0, 0.3]))
    assert np.array_equal(rotor.screw, [0, 0, 1, 0, 0, 0])


def test_defaults_on_an_oblique_axis(arm: Arm) -> None:
    rotor = mounted(arm, 1, Rotor(100, 2e-4, 0.3))
    assert rotor.carrier == 0
    assert rotor.home[:3, 2] == pytest.approx(AXIS, abs=1e-15)
    assert rotor.home[:3, 3] == pytest.approx(arm.joint_points[1], abs=1e-15)
    assert rotor.screw == pytest.approx(line(AXIS, POINT), abs=1e-15)
    # A scalar is about the spin axis, which is z of the default frame, and nothing across it.
    assert rotor.inertia == pytest.approx(np.diag([0, 0, 2e-4]), abs=1e-18)
    assert rotor.axial_inertia == pytest.approx(2e-4)


def test_prismatic_joint_turns_about_its_direction_through_its_point(arm: Arm) -> None:
    rotor = mounted(arm, 2, Rotor(600.0, 1e-5))
    assert rotor.screw == pytest.approx(line(np.array([0, 1.0, 0]), np.array([2, 0, 0.5])))
    assert rotor.carrier == 1


def test_helical_joint_gives_its_line_without_the_pitch() -> None:
    screw = line(AXIS, POINT)
    arm = Arm.from_screws([np.eye(4)], [screw + np.concatenate([np.zeros(3), 0.02 * AXIS])], [1.0], [np.eye(3)])
    assert mounted(arm, 0, Rotor(10, 1e-4)).screw == pytest.approx(screw, abs=1e-15)


def test_given_screw_draws_the_home_to_its_axis(arm: Arm) -> None:
    screw = line(np.array([1.0, 0, 0]), np.array([0, 0.1, 0.2]))
    rotor = mounted(arm, 1, Rotor(5, 1e-4, screw=screw, carrier=-1))
    assert rotor.carrier == -1
    assert rotor.home[:3, 3] == pytest.approx([arm.joint_points[1, 0], 0.1, 0.2])
    assert rotor.home[:3, 2] == pytest.approx([1, 0, 0])


def test_given_home_keeps_the_joint_axis_and_turns_a_scalar_with_it(arm: Arm) -> None:
    home = pose(exp_rotation([0.3, 0.4, 0.5]), [1.0, 0.0, 0.0])
    rotor = mounted(arm, 1, Rotor(5, 2.0, mass=3.0, home=home))
    assert np.array_equal(rotor.home, home)
    in_base = rotor.home[:3, :3] @ rotor.inertia @ rotor.home[:3, :3].T
    assert in_base == pytest.approx(2.0 * np.outer(AXIS, AXIS), abs=1e-15)
    distance = np.linalg.norm(np.cross(home[:3, 3] - POINT, AXIS))
    assert rotor.axial_inertia == pytest.approx(2.0 + 3.0 * distance**2)


def test_mounted_rotors_can_be_mounted_again(arm: Arm) -> None:
    once = with_rotors(arm, [Rotor(3, 1e-3), None, Rotor(-7, np.eye(3), 2.0)])
    again = with_rotors(once, once.rotors)
    for a, b in zip(once.rotors, again.rotors, strict=True):
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            assert np.array_equal(a.home, b.home) and np.array_equal(a.inertia, b.inertia)


def test_levels(arm: Arm) -> None:
    geared = with_rotors(arm, [Rotor(3, 1e-3)] * 3, level=RotorLevel.REFLECTED)
    assert geared.level is RotorLevel.REFLECTED
    assert at_level(geared, RotorLevel.NONE).level is RotorLevel.NONE
    assert at_level(geared, RotorLevel.NONE).rotors == geared.rotors
    with pytest.raises(InputError, match="none, reflected, full"):
        at_level(arm, "some")  # type: ignore[arg-type]


def test_wrong_rotors_for_an_arm(arm: Arm) -> None:
    with pytest.raises(InputError, match="rotors"):
        with_rotors(arm, [None])
    with pytest.raises(InputError) as error:
        with_rotors(arm, [Rotor(2, 1.0, carrier=3), "motor", None])  # type: ignore[list-item]
    assert [fault.place for fault in error.value.faults] == ["rotors[0].carrier", "rotors[1]"]


def test_rotor_tells_all_its_faults() -> None:
    with pytest.raises(InputError) as error:
        Rotor(0.0, -1.0, -2.0, home=np.ones((4, 4)), screw=[0, 0, 1, 0, 0, 0.5], carrier=-2)
    places = {fault.place for fault in error.value.faults}
    assert places == {"ratio", "inertia", "mass", "home", "screw", "carrier"}


@pytest.mark.parametrize("ratio", [np.nan, np.inf, "ten"])
def test_ratio_must_be_a_number(ratio: object) -> None:
    with pytest.raises(InputError, match="ratio"):
        Rotor(ratio, 1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("inertia", [np.nan, [1, 2, 3], np.array([[1, 2, 0], [0, 1, 0], [0, 0, 1]])])
def test_inertia_must_be_scalar_or_symmetric(inertia: object) -> None:
    with pytest.raises(InputError, match="inertia"):
        Rotor(1.0, inertia)  # type: ignore[arg-type]
