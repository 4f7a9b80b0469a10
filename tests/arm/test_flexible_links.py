"""Links cut into pieces on springs: rigid when unbent, and vibrating as beams do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.flexible_links import BendingLink, with_flexible_links
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.flexibility import free_frequencies, locked_frequencies, tip_compliance
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.spatial.beams import Beam, round_tube

SECTION = round_tube(0.03, 0.026, 70e9, 26e9)
L, MASS = 0.8, 0.6


def cantilever(tip_mass: float = 0.0) -> Arm:
    """A bar along x on a hinge about y, its inertia that of a bar without thickness, plus a point at its end."""
    home = np.eye(4)
    home[0, 3] = (MASS * L / 2 + tip_mass * L) / (MASS + tip_mass)
    x = home[0, 3]
    across = MASS * (L**2 / 12 + (L / 2 - x) ** 2) + tip_mass * (L - x) ** 2
    tip = np.eye(4)
    tip[0, 3] = L
    thin = MASS * SECTION.bending_x / SECTION.axial  # what a tube adds to it
    inertia = np.diag([2 * thin, across + thin, across + thin])
    return Arm.from_screws([home], [[0, -1, 0, 0, 0, 0]], [MASS + tip_mass], [inertia], tip=tip)


def bending(pieces: int, mass: float = MASS) -> BendingLink:
    return BendingLink(Beam(SECTION, np.zeros(3), np.array([L, 0, 0])), mass, rest_at_end=True, pieces=pieces)


def test_unbent_it_is_the_same_arm() -> None:
    arm = load_arm("ur5-corrected")
    arm = with_rotors(arm, [Rotor(100.0 * (-1) ** i, 1e-4 * (1 + i), carrier=min(i, 4)) for i in range(arm.n)])
    links = {
        1: BendingLink(Beam(SECTION, arm.joint_points[1], arm.joint_points[2]), 0.4, pieces=3),
        2: BendingLink(Beam(SECTION, arm.joint_points[2], arm.joint_points[3]), 0.3, rest_at_end=True, pieces=2),
    }
    sprung = with_flexible_links(arm, links)
    assert sprung.driven == (0, 1, 11, 18, 19, 20)
    assert sprung.arm.n == arm.n + 15
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, 4, arm.n))
    wide = [sprung.widened(x) for x in (q, qd, qdd)]
    driven = list(sprung.driven)
    np.testing.assert_allclose(tip_pose(sprung.arm, wide[0]), tip_pose(arm, q), atol=1e-12)
    np.testing.assert_allclose(
        inverse_dynamics(sprung.arm, *wide)[:, driven], inverse_dynamics(arm, q, qd, qdd), rtol=1e-10, atol=1e-10
    )
    masses = mass_matrix(sprung.arm, wide[0])
    np.testing.assert_allclose(masses[:, driven][:, :, driven], mass_matrix(arm, q), rtol=1e-10, atol=1e-12)
    assert sprung.arm.joint_names[2:5] == tuple(f"upper_arm_link_{x}_1" for x in ("bend_x", "bend_y", "twist"))
    assert sprung.arm.link_names[10] == "upper_arm_link"
    np.testing.assert_array_equal(sprung.arm.upper[driven], arm.upper)


def test_static_sag_is_the_beams() -> None:
    # Cuts in the middle of equal parts miss 1/(4 pieces^2) of P L^3/(3 E I).
    for pieces in (1, 2, 5):
        sprung = with_flexible_links(cantilever(), {0: bending(pieces)})
        soft = tip_compliance(sprung.arm, np.zeros(sprung.arm.n), sprung.stiffness)
        expected = L**3 / (3 * SECTION.bending_x) * (1 - 1 / (4 * pieces**2))
        np.testing.assert_allclose(np.diag(soft)[4:], expected, rtol=1e-12)
        assert soft[0, 0] == pytest.approx(L / SECTION.torsion, rel=1e-12)


@pytest.mark.parametrize(("mode", "root"), [(0, 1.8751040687), (1, 4.6940911330)])
def test_cantilever_frequencies(mode: int, root: float) -> None:
    expected = root**2 * math.sqrt(SECTION.bending_x * L / MASS / L**4) / (2 * math.pi)
    errors = []
    for pieces in (4, 8, 16):
        sprung = with_flexible_links(cantilever(), {0: bending(pieces)})
        found = locked_frequencies(sprung.arm, np.zeros(sprung.arm.n), sprung.stiffness)
        # The driven joint is rigid here; both directions of bending vibrate alike.
        assert found[2 * mode] == pytest.approx(found[2 * mode + 1], rel=1e-9)
        errors.append(found[2 * mode] / expected - 1)
    # Euler's beam has no inertia of turning sections: 0.1 % here for the second mode.
    assert abs(errors[-1]) < 0.008
    steps = np.diff(errors)
    assert steps[0] / steps[1] == pytest.approx(4.0, rel=0.25)  # second order


def test_mass_at_the_end() -> None:
    # Rayleigh: 33/140 of the bar swings with a heavy end.
    heavy = 20.0
    sprung = with_flexible_links(cantilever(heavy), {0: bending(20)})
    found = locked_frequencies(sprung.arm, np.zeros(sprung.arm.n), sprung.stiffness)
    stiffness = 3 * SECTION.bending_x / L**3
    assert found[0] == pytest.approx(math.sqrt(stiffness / (heavy + 33 / 140 * MASS)) / (2 * math.pi), rel=2e-3)


def test_joint_spring_and_beam_in_series() -> None:
    # A point far heavier than the bar: 1/k = L^2/K + L^3/(3 E I).
    heavy, joint = 200.0, 1e3
    arm = with_rotors(cantilever(heavy), [Rotor(50.0, 1e3, carrier=-1)])
    sprung = with_flexible_links(arm, {0: bending(30)})
    stiffness = sprung.stiffness.copy()
    stiffness[list(sprung.driven)] = joint
    soft = L**2 / joint + L**3 / (3 * SECTION.bending_x)
    expected = math.sqrt(1 / (soft * heavy)) / (2 * math.pi)
    for frequencies in (locked_frequencies, free_frequencies):  # a rotor without end is as good as locked
        assert frequencies(sprung.arm, np.zeros(sprung.arm.n), stiffness)[0] == pytest.approx(expected, rel=2e-3)


def test_sag_under_gravity_by_the_springs() -> None:
    # The torques that hold the springs, over their stiffness, bend the bar by w L^4/(8 E I).
    sprung = with_flexible_links(cantilever(), {0: bending(40)})
    q = np.zeros(sprung.arm.n)
    bent = np.where(np.isfinite(sprung.stiffness), -gravity_torque(sprung.arm, q) / sprung.stiffness, 0.0)
    expected = -MASS * 9.81 / L * L**4 / (8 * SECTION.bending_x)
    assert tip_pose(sprung.arm, bent)[2, 3] == pytest.approx(expected, rel=1e-3)


def test_levels_and_rotors_follow() -> None:
    arm = at_level(with_rotors(cantilever(1.0), [Rotor(30.0, 1e-4)]), RotorLevel.REFLECTED)
    sprung = with_flexible_links(arm, {0: bending(2)}).arm
    assert sprung.level is RotorLevel.REFLECTED
    assert [rotor is not None for rotor in sprung.rotors] == [True] + [False] * 6


def test_bad_input() -> None:
    arm = cantilever()
    with pytest.raises(InputError, match="must not exceed"):
        with_flexible_links(arm, {0: bending(2, mass=0.7)})
    with pytest.raises(InputError, match="no link of the arm"):
        with_flexible_links(arm, {1: bending(2)})
    slight = replace(arm, inertias=0.5 * arm.inertias)
    with pytest.raises(InputError, match="negative moment of inertia"):
        with_flexible_links(slight, {0: bending(2, mass=0.55)})
    with pytest.raises(InputError) as caught:
        BendingLink(bending(1).beam, -1.0, pieces=0)
    assert len(caught.value.faults) == 2
