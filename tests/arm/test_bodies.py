"""Bodies added to links and taken away, against point masses and energy."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import with_body, with_payload
from drivetrain.errors import InputError, PhysicsWarning
from drivetrain.spatial.inertia import RigidBody, cuboid
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation


@pytest.fixture
def arm() -> Arm:
    turn = exp_rotation([0.4, -0.3, 0.9])
    home = [pose(turn, [0.3, 0.1, 0.2]), pose(turn.T, [0.8, 0.0, 0.3])]
    tensor = cuboid(3.0, 0.3, 0.2, 0.1).inertia
    screws = [[0, 0, 1.0, 0, 0, 0], [0, 1.0, 0, -0.3, 0, 0.5]]
    return Arm.from_screws(home, screws, [3.0, 2.0], [tensor, 0.5 * tensor], tip=pose(turn, [1.0, 0.1, 0.3]))


def link_energy(arm: Arm, link: int, twist: np.ndarray) -> float:
    body = RigidBody(arm.masses[link], np.zeros(3), arm.inertias[link])
    return float(0.5 * twist @ body.spatial_inertia(arm.home[link]) @ twist)


def test_energies_add_whatever_the_motion(arm: Arm) -> None:
    rng = np.random.default_rng(1)
    body = RigidBody(1.3, rng.normal(size=3), cuboid(1.3, 0.1, 0.4, 0.2).inertia)
    loaded = with_body(arm, 0, body.mass, body.com, body.inertia)
    for twist in rng.normal(size=(10, 6)):
        added = 0.5 * twist @ body.spatial_inertia() @ twist
        assert link_energy(loaded, 0, twist) == pytest.approx(link_energy(arm, 0, twist) + added)
    assert np.array_equal(loaded.home[0, :3, :3], arm.home[0, :3, :3])
    assert loaded.home[0, :3, 3] == pytest.approx((3.0 * arm.home[0, :3, 3] + 1.3 * body.com) / 4.3)
    assert np.array_equal(loaded.home[1], arm.home[1])
    assert np.array_equal(loaded.tip, arm.tip)


def test_taking_away_undoes_adding(arm: Arm) -> None:
    body = (1.3, [0.5, 0.4, -0.2], cuboid(1.3, 0.1, 0.4, 0.2).inertia)
    back = with_body(with_body(arm, 1, *body), 1, -body[0], *body[1:])
    assert back.masses == pytest.approx(arm.masses, rel=1e-15)
    assert back.home == pytest.approx(arm.home, abs=1e-15)
    assert back.inertias == pytest.approx(arm.inertias, abs=1e-15)


def test_payload_is_given_in_the_tip_frame(arm: Arm) -> None:
    tensor = np.diag([0.01, 0.02, 0.025])
    loaded = with_payload(arm, 2.0, [0.1, 0.0, 0.05], tensor)
    turn = arm.tip[:3, :3]
    direct = with_body(arm, 1, 2.0, arm.tip[:3, 3] + turn @ [0.1, 0, 0.05], turn @ tensor @ turn.T)
    assert loaded.home == pytest.approx(direct.home, abs=1e-15)
    assert loaded.inertias == pytest.approx(direct.inertias, abs=1e-16)
    assert np.array_equal(loaded.inertias[0], arm.inertias[0])


def test_base_carries_for_nothing(arm: Arm) -> None:
    assert with_body(arm, -1, 5.0, [0, 0, 0], np.eye(3)) is arm


def test_rotor_inertia_without_mass(arm: Arm) -> None:
    loaded = with_body(arm, 0, 0.0, [5, 5, 5], np.diag([0, 0, 0.1]))
    turn = arm.home[0, :3, :3]
    assert np.array_equal(loaded.home, arm.home)
    assert turn @ (loaded.inertias[0] - arm.inertias[0]) @ turn.T == pytest.approx(np.diag([0, 0, 0.1]), abs=1e-15)


@pytest.mark.parametrize("link", [-2, 2, 0.0, True, "elbow"])
def test_no_such_link(arm: Arm, link: object) -> None:
    with pytest.raises(InputError, match="link"):
        with_body(arm, link, 1.0, [0, 0, 0], np.eye(3))  # type: ignore[arg-type]


def test_more_cannot_be_taken_than_is_there(arm: Arm) -> None:
    with pytest.raises(InputError, match="3 kg"):
        with_body(arm, 0, -3.0, arm.home[0, :3, 3], np.zeros((3, 3)))
    with pytest.raises(InputError, match="negative moment"):
        with_body(arm, 0, -1.0, arm.home[0, :3, 3], np.eye(3))
    with pytest.raises(InputError, match="diagonal"):
        with_body(arm, 0, -1.0, [0, 0, 0], -np.eye(3))


def test_a_doubtful_remainder_warns(arm: Arm) -> None:
    turn = arm.home[0, :3, :3]
    thin = turn @ np.diag([0.01, 0.0, 0.0]) @ turn.T
    with pytest.warns(PhysicsWarning, match="link_1"):
        with_body(arm, 0, -1.0, arm.home[0, :3, 3], 0.5 * (thin + thin.T))
