"""What must hold of any arm: symmetry, passivity, power, mirror images, and limits where models agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_arms import EVERY_JOINT, coaxial_rotor, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import body_jacobian, link_poses
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.derivatives import coriolis_matrix
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import drive_torques, gravity_torque, inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix

ROUNDING = 1e-12  # some thousand operations, each good to 1e-16, on values of one size
CASES = [(seed, kind, level) for seed in range(3) for kind in ("coaxial", "balanced", "mixed") for level in RotorLevel]


def geared(seed: int, kind: str, level: RotorLevel = RotorLevel.FULL, joints: str = EVERY_JOINT) -> Arm:
    bare = random_arm(seed, joints)
    return with_rotors(bare, rotors_of(seed, kind, bare.n), level=level)


@pytest.mark.parametrize(("seed", "kind", "level"), CASES)
def test_mass_matrix_is_symmetric_positive_and_made_of_unit_accelerations(
    seed: int, kind: str, level: RotorLevel
) -> None:
    arm = geared(seed, kind, level)
    q, _, _ = motion(seed, arm.n)
    matrices = mass_matrix(arm, q)
    np.testing.assert_array_equal(matrices, np.swapaxes(matrices, 1, 2))
    assert np.linalg.eigvalsh(matrices).min() > 0.0
    still = np.zeros_like(q)
    for j in range(arm.n):
        unit = np.tile(np.eye(arm.n)[j], (len(q), 1))
        column = inverse_dynamics(arm, q, still, unit) - gravity_torque(arm, q)
        assert error(column, matrices[:, :, j]) < ROUNDING


@pytest.mark.parametrize(("seed", "kind", "level"), CASES)
def test_terms_add_up(seed: int, kind: str, level: RotorLevel) -> None:
    arm = geared(seed, kind, level)
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=(len(q), 6)) * 10
    terms = np.einsum("kij,kj->ki", mass_matrix(arm, q), qdd)
    terms += np.einsum("kij,kj->ki", coriolis_matrix(arm, q, qd), qd) + gravity_torque(arm, q)
    terms += np.einsum("kji,kj->ki", body_jacobian(arm, q), tip)  # equation 8.77
    assert error(inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip), terms) < ROUNDING


@pytest.mark.parametrize(("seed", "kind", "level"), CASES)
def test_forward_dynamics_undoes_inverse_dynamics(seed: int, kind: str, level: RotorLevel) -> None:
    arm = geared(seed, kind, level)
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=6) * 10
    tau = inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    # The condition of the mass matrix, up to 1e4 here, times rounding of torques up to 1e4.
    assert error(forward_dynamics(arm, q, qd, tau, tip_wrench=tip), qdd) < 1e-9


@pytest.mark.parametrize(("seed", "kind", "level"), CASES)
def test_coriolis_matrix_is_passive(seed: int, kind: str, level: RotorLevel) -> None:
    arm = geared(seed, kind, level)
    q, qd, _ = motion(seed, arm.n, count=3)
    # Rotors turn 100 times faster than joints, so the step is short; fourth order keeps it exact to 1e-7.
    h = 2e-4
    change = [mass_matrix(arm, q + k * h * qd) for k in (-2, -1, 1, 2)]
    rate = (change[0] - 8 * change[1] + 8 * change[2] - change[3]) / (12 * h)
    matrix = coriolis_matrix(arm, q, qd)
    skew = rate - 2 * matrix
    assert error(skew, -np.swapaxes(skew, 1, 2)) < 1e-6
    assert error(rate, matrix + np.swapaxes(matrix, 1, 2)) < 1e-6


def test_coriolis_matrix_is_linear_in_speed_and_zero_at_rest() -> None:
    arm = geared(3, "mixed")
    q, qd, _ = motion(3, arm.n)
    assert error(coriolis_matrix(arm, q, 1e3 * qd), 1e3 * coriolis_matrix(arm, q, qd)) < ROUNDING
    assert error(coriolis_matrix(arm, q, 1e-6 * qd), 1e-6 * coriolis_matrix(arm, q, qd)) < ROUNDING
    assert np.abs(coriolis_matrix(arm, q, 0 * qd)).max() == 0.0
    other = np.roll(qd, 1, axis=1)
    # Christoffel symbols are symmetric in their last two indices.
    crossed = np.einsum("kij,kj->ki", coriolis_matrix(arm, q, qd), other)
    assert error(crossed, np.einsum("kij,kj->ki", coriolis_matrix(arm, q, other), qd)) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["coaxial", "balanced", "mixed"])
def test_power_is_the_rate_of_energy(seed: int, kind: str) -> None:
    arm = geared(seed, kind)
    q, qd, qdd = motion(seed, arm.n, count=3)

    def energy(t: float) -> np.ndarray:
        now, speed = q + t * qd + 0.5 * t * t * qdd, qd + t * qdd
        kinetic = 0.5 * np.einsum("ki,kij,kj->k", speed, mass_matrix(arm, now), speed)
        return kinetic + potential(arm, now)

    h = 2e-4
    rate = (energy(-2 * h) - 8 * energy(-h) + 8 * energy(h) - energy(2 * h)) / (12 * h)
    power = np.sum(inverse_dynamics(arm, q, qd, qdd) * qd, axis=1)
    assert error(power, rate) < 1e-7  # of the differences


def potential(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Of links and rotors, from where their masses are."""
    poses = link_poses(arm, q)
    total = -np.einsum("i,kia,a->k", arm.masses, poses[:, :, :3, 3], arm.gravity)
    for i, rotor in enumerate(arm.rotors):
        if rotor is not None:
            spin = Arm.from_screws([rotor.home], [rotor.screw], [rotor.mass], np.zeros((1, 3, 3)))
            for k, sample in enumerate(q):
                own = link_poses(spin, np.array([rotor.ratio * sample[i]]))[0]
                carried = np.eye(4)
                if rotor.carrier >= 0:
                    carried = poses[k, rotor.carrier] @ np.linalg.inv(arm.home[rotor.carrier])
                total[k] -= rotor.mass * (carried @ own)[:3, 3] @ arm.gravity
    return total


@pytest.mark.parametrize("seed", range(3))
def test_mirror_image(seed: int) -> None:
    """The mirror image of an arm on the mirror image of a motion asks the same of every joint."""
    arm = geared(seed, "mixed", joints="RPRRPR")
    mirror = np.diag([1.0, -1.0, 1.0])

    def pose(home: np.ndarray) -> np.ndarray:
        # The frame is reflected and then made right-handed again by turning its y axis round.
        result = home.copy()
        result[:3, :3], result[:3, 3] = mirror @ home[:3, :3] @ mirror, mirror @ home[:3, 3]
        return result

    def screw(line: np.ndarray) -> np.ndarray:
        # Angular velocity is an axial vector.
        return np.concatenate([-mirror @ line[:3], mirror @ line[3:]])

    image = Arm.from_screws(
        [pose(h) for h in arm.home],
        [screw(s) for s in arm.screws],
        arm.masses,
        mirror @ arm.inertias @ mirror,
        pose(arm.tip),
        mirror @ arm.gravity,
        joint_points=arm.joint_points @ mirror,
    )

    def rotor(r: Rotor) -> Rotor:
        return Rotor(r.ratio, mirror @ r.inertia @ mirror, r.mass, pose(r.home), screw(r.screw), r.carrier)

    image = with_rotors(image, [None if r is None else rotor(r) for r in arm.rotors])
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=6)
    reflected = np.concatenate([-mirror @ tip[:3], mirror @ tip[3:]])
    one, other = (drive_torques(a, q, qd, qdd, tip_wrench=t) for a, t in ((arm, tip), (image, reflected)))
    assert error(other.gear, one.gear) < ROUNDING
    assert error(other.motor, one.motor) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_reversed_rotor_needs_the_opposite_torque(seed: int) -> None:
    """A ratio of the other sign on a reversed spin axis is the same rotor, its torque counted the other way."""
    rng = np.random.default_rng(seed)
    bare = random_arm(seed)
    rotors = with_rotors(bare, [coaxial_rotor(rng) for _ in range(bare.n)]).rotors
    reversed_ = [Rotor(-r.ratio, r.inertia, r.mass, r.home, -r.screw, r.carrier) for r in rotors]
    q, qd, qdd = motion(seed, bare.n)
    one = drive_torques(with_rotors(bare, rotors), q, qd, qdd)
    other = drive_torques(with_rotors(bare, reversed_), q, qd, qdd)
    assert error(other.gear, one.gear) < ROUNDING
    assert error(other.motor, -one.motor) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_on_the_base_reflected_is_full(seed: int) -> None:
    """A balanced rotor whose carrier does not turn has no coupling."""
    bare = random_arm(seed, "PPR")
    rng = np.random.default_rng(seed)
    arm = with_rotors(bare, [coaxial_rotor(rng) for _ in range(3)])
    q, qd, qdd = motion(seed, 3)
    for level in (RotorLevel.REFLECTED, RotorLevel.FULL):
        torque = drive_torques(at_level(arm, level), q, qd, qdd)
        locked = drive_torques(at_level(arm, RotorLevel.NONE), q, qd, qdd)
        axial = np.array([r.axial_inertia * r.ratio for r in arm.rotors])
        assert error(torque.gear, locked.gear) < ROUNDING
        assert error(torque.motor, locked.motor + axial * qdd) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_a_rotor_of_ratio_one_on_the_joint_axis_is_part_of_the_link(seed: int) -> None:
    bare = random_arm(seed)
    rng = np.random.default_rng(seed)
    rotors = [replace(coaxial_rotor(rng), ratio=1.0) for _ in range(bare.n)]
    mounted = with_rotors(bare, rotors).rotors
    # The same bodies with the link after the joint for their carrier, locked there.
    fixed = [Rotor(1.0, r.inertia, r.mass, r.home, r.screw, i) for i, r in enumerate(mounted)]
    whole = with_rotors(bare, fixed, level=RotorLevel.NONE)
    q, qd, qdd = motion(seed, bare.n)
    found = inverse_dynamics(with_rotors(bare, rotors), q, qd, qdd)
    assert error(found, inverse_dynamics(whole, q, qd, qdd)) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_balanced_rotors_need_no_pass_of_their_own(seed: int) -> None:
    """The folded form of a balanced rotor against the general one, to which a trace of imbalance sends it."""
    bare = random_arm(seed)
    rng = np.random.default_rng(seed)
    rotors = with_rotors(bare, [coaxial_rotor(rng) for _ in range(bare.n)]).rotors
    nearly = [Rotor(r.ratio, r.inertia + np.diag([1e-13, 0, 0]), r.mass, r.home, r.screw, r.carrier) for r in rotors]
    assert len(packed(with_rotors(bare, rotors)).rotors) == 0
    assert packed(with_rotors(bare, nearly)).rotors["balanced"].tolist() == [0] * bare.n
    q, qd, qdd = motion(seed, bare.n)
    one = drive_torques(with_rotors(bare, rotors), q, qd, qdd)
    other = drive_torques(with_rotors(bare, nearly), q, qd, qdd)
    assert error(other.gear, one.gear) < 1e-6
    assert error(other.motor, one.motor) < 1e-6
