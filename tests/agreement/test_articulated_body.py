"""The articulated-body recursion against the mass matrix and pinocchio; tests/hard has it against 50 digits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import (
    EVERY_JOINT,
    balanced_rotor,
    by_mass_matrix,
    error,
    motion,
    random_arm,
    rotors_of,
    unbalanced_rotor,
)

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.forward import articulated_body
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError

TOLERANCE = 1e-12  # of the largest acceleration; the condition numbers here are up to 1e5, what is found is 1e-14
SEEDS = range(4)
ARMS = ["RRRRRR", "RPRPR", "HRPH", EVERY_JOINT, "R", "P", "RRRRRRRRRR"]


@pytest.mark.parametrize("joints", ARMS)
@pytest.mark.parametrize("seed", SEEDS)
def test_without_rotors(seed: int, joints: str) -> None:
    arm = random_arm(seed, joints)
    q, qd, tau = motion(seed, arm.n)
    twin = InPinocchio(arm)
    wanted = np.array([pin.aba(twin.model, twin.data, *sample) for sample in zip(q, qd, tau, strict=True)])
    assert error(articulated_body(arm, q, qd, tau), wanted) < TOLERANCE
    assert error(articulated_body(arm, q[2], qd[2], tau[2]), wanted[2]) < TOLERANCE


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "HRPH"])
@pytest.mark.parametrize("kind", ["coaxial", "balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("level", RotorLevel)
def test_rotors_of_every_kind_on_every_link(joints: str, kind: str, level: RotorLevel) -> None:
    for seed in range(8):  # the carriers are drawn: base, before, after, further off either way
        bare = random_arm(seed, joints)
        arm = with_rotors(bare, rotors_of(seed, kind, bare.n), level=level)
        q, qd, tau = motion(seed, arm.n)
        tip = np.random.default_rng(seed).normal(size=(len(q), 6)) * 20
        wanted = by_mass_matrix(arm, q, qd, tau, tip_wrench=tip)
        assert error(articulated_body(arm, q, qd, tau, tip_wrench=tip), wanted) < TOLERANCE
        back = inverse_dynamics(arm, q, qd, articulated_body(arm, q, qd, tau))
        assert error(back, tau) < 1e-11  # round trip: times the largest entry of M


@pytest.mark.parametrize("seed", SEEDS)
def test_rotors_as_further_joints_of_pinocchio(seed: int) -> None:
    """Links and rotors on joints of their own, tied by the ratios: T^T (M T qdd + h) = tau."""
    bare = random_arm(seed, "RRPRRR")
    arm = with_rotors(bare, rotors_of(seed, "mixed", bare.n))
    twin = InPinocchio(arm)
    tie = np.array([twin.spread(unit) for unit in np.eye(arm.n)]).T
    for q, qd, tau in zip(*motion(seed, arm.n), strict=True):
        still = np.zeros(twin.model.nv)
        weight = pin.rnea(twin.model, twin.data, twin.spread(q), still, still)
        # By columns: crba takes it that joints are numbered branch by branch, and these are not.
        columns = [pin.rnea(twin.model, twin.data, twin.spread(q), still, unit) - weight for unit in tie.T]
        bias = pin.nonLinearEffects(twin.model, twin.data, twin.spread(q), twin.spread(qd))
        wanted = np.linalg.solve(tie.T @ np.array(columns).T, tau - tie.T @ bias)
        assert error(articulated_body(arm, q, qd, tau), wanted) < TOLERANCE


@pytest.mark.parametrize("reach", [-3, -2, 1, 2, 3])
def test_far_carriers_in_chains(reach: int) -> None:
    """Every rotor so many links before or after its joint: articulated bodies or the mass matrix, as it requires."""
    bare = random_arm(5, "RRPRRRRPRR")
    rng = np.random.default_rng(reach + 10)
    carriers = [int(np.clip(i + reach, -1, bare.n - 1)) for i in range(bare.n)]
    rotors = [(balanced_rotor, unbalanced_rotor)[i % 2](rng, c) for i, c in enumerate(carriers)]
    arm = with_rotors(bare, rotors)
    q, qd, tau = motion(reach + 10, arm.n)
    assert error(articulated_body(arm, q, qd, tau), by_mass_matrix(arm, q, qd, tau)) < TOLERANCE


def without_inertia(arm: object, links: list[int]) -> object:
    masses, inertias = arm.masses.copy(), arm.inertias.copy()
    masses[links], inertias[links] = 0.0, 0.0
    return replace(arm, masses=masses, inertias=inertias)


@pytest.mark.parametrize("links", [[5], [4, 5], [0, 1, 2, 3, 4, 5]])
def test_massless_end_is_an_error_that_names_the_joint(links: list[int]) -> None:
    arm = without_inertia(random_arm(1), links)
    q, qd, tau = motion(1, 6)
    with pytest.raises(InputError, match=rf"joint_{links[0] + 1}.*moves no inertia.*sample 0"):
        articulated_body(arm, q, qd, tau)
    geared = with_rotors(arm, [Rotor(100.0, 1e-4, carrier=-1)] * 6, level=RotorLevel.REFLECTED)
    assert error(articulated_body(geared, q, qd, tau), by_mass_matrix(geared, q, qd, tau)) < TOLERANCE


def test_point_mass_on_the_last_axis_is_an_error() -> None:
    arm = random_arm(2)
    home, inertias = arm.home.copy(), arm.inertias.copy()
    home[5, :3, 3] = np.cross(arm.screws[5, :3], arm.screws[5, 3:])
    inertias[5] = 0.0
    with pytest.raises(InputError, match="joint_6"):
        articulated_body(replace(arm, home=home, inertias=inertias), *(x[0] for x in motion(2, 6)))


def test_massless_links_between_heavy_ones_are_fine() -> None:
    arm = without_inertia(random_arm(3), [1, 3])
    q, qd, tau = motion(3, 6)
    assert error(articulated_body(arm, q, qd, tau), by_mass_matrix(arm, q, qd, tau)) < TOLERANCE


@pytest.mark.parametrize("kind", ["mixed", "unbalanced"])
def test_more_samples_than_a_block(kind: str) -> None:
    bare = random_arm(11, "RRPRRH")
    arm = with_rotors(bare, [replace(rotor, carrier=None) if rotor else None for rotor in rotors_of(11, kind, bare.n)])
    q, qd, tau = motion(11, arm.n, 150)
    tip = np.random.default_rng(11).normal(size=(150, 6)) * 20
    assert error(articulated_body(arm, q, qd, tau, tip_wrench=tip), by_mass_matrix(arm, q, qd, tau, tip)) < TOLERANCE


def test_a_singular_sample_after_the_first_block() -> None:
    """A top in massless gimbals: when its three axes lie in a plane, the first joint from the base without inertia."""
    screws = [[0, 0, 1, 0, 0, 0], [1, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0]]
    inertias = [np.zeros((3, 3)), np.zeros((3, 3)), np.diag([1.0, 1.0, 1.5])]
    arm = Arm.from_screws(np.tile(np.eye(4), (3, 1, 1)), screws, [0.0, 0.0, 2.0], inertias)
    q = np.random.default_rng(3).uniform(0.5, 1.0, (200, 3))
    q[[101, 150], 1] = 0.0
    with pytest.raises(InputError, match=r"joint_3.*sample 101:"):
        articulated_body(arm, q, 0.0 * q, 0.0 * q)
    assert np.isfinite(articulated_body(arm, q[:101], q[:101], q[:101])).all()


def test_levels_differ_as_they_should() -> None:
    bare = random_arm(7)
    arm = with_rotors(bare, rotors_of(7, "coaxial", 6))
    sample = [x[0] for x in motion(7, 6)]
    full, reflected, none = (articulated_body(at_level(arm, level), *sample) for level in ("full", "reflected", "none"))
    assert error(reflected, full) > 1e-4
    assert error(none, reflected) > 1e-2
