"""Couplings: what is refused, how groups are found, and the usual mechanisms against turning their wheels by hand."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import (
    belts_over,
    coupled_groups,
    differential,
    placed,
    rotor_turns,
    shaft_motion,
    shaft_torques,
    with_coupling,
)
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.flexible_links import BendingLink, with_flexible_links
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.errors import InputError
from drivetrain.spatial.beams import Beam, round_tube


@pytest.fixture(scope="module")
def arm() -> Arm:
    return load_arm("ur5-corrected")


@pytest.mark.parametrize(
    ("matrix", "problem"),
    [
        (np.eye(5), "shape"),
        (np.full((6, 6), np.nan), "finite"),
        (np.ones((6, 6)), "singular"),
        (np.diag([1.0, 1, 0, 1, 1, 1]), "that no joint turns: \\[2\\]"),
        (np.eye(6)[[0, 1, 2, 3, 4, 4]], "singular"),
        ("C", "numbers"),
    ],
)
def test_what_is_no_coupling(arm: Arm, matrix: object, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        with_coupling(arm, matrix)
    with pytest.raises(InputError, match=problem):
        with_rotors(arm, [None] * 6, coupling=matrix)


def test_all_faults_at_once(arm: Arm) -> None:
    with pytest.raises(InputError) as error:
        with_rotors(arm, [Rotor(50, 1e-4, carrier=9)] + [None] * 5, coupling=np.ones((6, 6)))
    assert len(error.value.faults) == 2


def test_large_and_small_units_are_not_singular(arm: Arm) -> None:
    """A shaft in rad/m beside others: entries of 1e4 and 1e-4 alone say nothing."""
    matrix = placed(differential(), (4, 5), 6) * np.array([1.0, 1e5, 1.0, 1.0, 1e-6, 1.0])
    assert with_coupling(arm, matrix).coupling == pytest.approx(matrix)


def test_it_stays_until_it_is_changed(arm: Arm) -> None:
    matrix = placed(differential(), (4, 5), 6)
    one = with_coupling(arm, matrix)
    assert not one.coupling.flags.writeable
    assert with_rotors(one, [None] * 6).coupling is one.coupling
    assert at_level(one, one.level).coupling is one.coupling
    assert with_rotors(one, [None] * 6, coupling=np.eye(6)).coupling is None
    assert with_coupling(one, None).coupling is None


def test_rotor_turns_are_ratios_times_shafts(arm: Arm) -> None:
    rotors = [Rotor(r, 1e-4) if r else None for r in (50.0, -80.0, 0.0, 30.0, 20.0, -10.0)]
    assert rotor_turns(with_rotors(arm, rotors)) == pytest.approx(np.diag([50.0, -80, 1, 30, 20, -10]))
    turns = rotor_turns(with_rotors(arm, rotors, coupling=placed(differential(1.0, 2.0), (4, 5), 6)))
    assert turns[4:, 4:] == pytest.approx(np.array([[20.0, 40.0], [-10.0, 20.0]]))
    assert turns[:4, :4] == pytest.approx(np.diag([50.0, -80, 1, 30]))


def test_without_a_coupling_shafts_are_joints(arm: Arm) -> None:
    values = np.ones((3, 6))
    assert shaft_motion(arm, values) is values and shaft_torques(arm, values) is values
    assert coupled_groups(arm) == []


def test_groups(arm: Arm) -> None:
    chain = placed(belts_over([1.0, 1.0]), (3, 4, 5), 6)
    assert coupled_groups(with_coupling(arm, chain)) == [(3, 4, 5)]
    two = placed(differential(), (1, 2), 6) @ placed(differential(), (4, 5), 6)
    assert coupled_groups(with_coupling(arm, two)) == [(1, 2), (4, 5)]
    assert coupled_groups(with_coupling(arm, np.diag([1.0, 2.0, 1, 1, 1, 1]))) == [(1,)]
    assert coupled_groups(with_coupling(arm, np.eye(6)[[1, 0, 2, 3, 4, 5]])) == [(0, 1)]


def test_differential_as_two_bevel_wheels_and_a_spider() -> None:
    """Turned alike the wheels carry the spider along; turned against each other they roll the third wheel on it."""
    shafts = differential()
    assert np.linalg.solve(shafts, [0.3, 0.3]) == pytest.approx([0.3, 0.0])
    assert np.linalg.solve(shafts, [0.3, -0.3]) == pytest.approx([0.0, 0.3])
    # A push of both shafts adds up at the spider.
    assert shafts.T @ [2.0, 2.0] == pytest.approx([4.0, 0.0])


@pytest.mark.parametrize("passes", [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [0.5, -2.0], []])
def test_belts_over_joints_wheel_by_wheel(passes: list[float]) -> None:
    n = len(passes) + 1
    joints = np.random.default_rng(1).normal(size=n)
    shafts = belts_over(passes) @ joints
    for i in range(n):
        # The shaft turns with the first wheel, but for what the passes multiply on the way.
        angle = shafts[i] / np.prod(passes[:i])
        for j in range(i):
            angle = passes[j] * (angle - joints[j])
        assert angle == pytest.approx(joints[i])


# The beam is heavier than the link's own tensor allows for; only its joints matter here.
@pytest.mark.filterwarnings("ignore::drivetrain.errors.PhysicsWarning")
def test_links_that_bend_keep_the_coupling_of_the_joints_that_drives_turn(arm: Arm) -> None:
    matrix = placed(differential(), (4, 5), 6)
    beam = Beam(round_tube(0.08, 0.07, 70e9, 26e9), arm.joint_points[1], arm.joint_points[2])
    bent = with_flexible_links(with_coupling(arm, matrix), {1: BendingLink(beam, 2.0, pieces=2)})
    assert bent.arm.n == 12
    assert bent.arm.coupling[np.ix_(bent.driven, bent.driven)] == pytest.approx(matrix)
    springs = [i for i in range(12) if i not in bent.driven]
    assert bent.arm.coupling[np.ix_(springs, springs)] == pytest.approx(np.eye(6))
