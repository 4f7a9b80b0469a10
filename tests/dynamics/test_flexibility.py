"""Vibration and compliance of small motions: closed forms of one and two masses, beams, and pinocchio."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import eigh

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.flexibility import (
    carried_to,
    free_frequencies,
    free_mass,
    locked_frequencies,
    locked_mass,
    struck_torques,
    tip_compliance,
    tip_jacobian,
)
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.spatial.beams import Beam, beam_compliance, round_tube

SECTION = round_tube(0.05, 0.046, 70e9, 26e9)


def pendulum(inertia: float = 0.8, rotor: Rotor | None = None) -> Arm:
    arm = Arm.from_screws([np.eye(4)], [[0, 0, 1, 0, 0, 0]], [2.0], [np.diag([inertia] * 3)])
    return with_rotors(arm, [rotor])


def random_arm(seed: int, *, unbalanced: bool = True) -> Arm:
    """Six joints with rotors on various carriers, off their axes and unbalanced."""
    rng = np.random.default_rng(seed)
    arm = load_arm("ur5-corrected")
    rotors = []
    for i in range(arm.n):
        home = arm.home[i].copy()
        home[:3, 3] += 0.1 * rng.normal(size=3)
        tensor = np.diag([1e-4, 1.3e-4, 1.6e-4]) * rng.uniform(0.5, 2.0)
        carrier = int(rng.integers(-1, i + 1))
        own = {"mass": 0.3, "home": home, "inertia": tensor} if unbalanced else {"inertia": 1e-4}
        rotors.append(Rotor(float(rng.choice([-1, 1]) * rng.uniform(5, 60)), carrier=carrier, **own))
    return with_rotors(arm, rotors)


def test_one_mass_on_a_spring() -> None:
    found = locked_frequencies(pendulum(0.8), [0.3], [5000.0])
    np.testing.assert_allclose(found, [math.sqrt(5000.0 / 0.8) / (2 * math.pi)], rtol=1e-14)


def test_what_a_spring_carries_beside_the_arm_adds_to_its_inertia() -> None:
    """The frequencies of the eigenvalue problem of stiffness and mass, with and without further inertias."""
    arm, q, stiffness = random_arm(5), np.linspace(-1.0, 1.0, 6), np.geomspace(2e3, 2e5, 6)
    for added in (np.zeros(6), np.array([0.1, 3.0, 0.0, 0.5, 0.02, 1.0])):
        squares = eigh(np.diag(stiffness), locked_mass(arm, q) + np.diag(added), eigvals_only=True)
        found = locked_frequencies(arm, q, stiffness, added=added)
        np.testing.assert_allclose(found, np.sqrt(squares) / (2.0 * math.pi), rtol=1e-10)


def rotor_inertias(arm: Arm, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The block that couples rotors and joints, and the rotors' own block."""
    whole = free_mass(arm, np.atleast_2d(q))
    shared, own = whole[:, : arm.n, arm.n :], whole[:, arm.n :, arm.n :]
    return (shared, own) if np.ndim(q) == 2 else (shared[0], own[0])


@pytest.mark.parametrize("ratio", [100.0, -100.0, 1.0])
def test_two_masses_and_a_spring(ratio: float) -> None:
    inertia, rotor, stiffness = 0.8, 1.5e-4, 5000.0
    arm = pendulum(inertia, Rotor(ratio, rotor))
    expected = math.sqrt(stiffness * (1 / inertia + 1 / (ratio**2 * rotor))) / (2 * math.pi)
    np.testing.assert_allclose(free_frequencies(arm, [0.0], [stiffness]), [expected], rtol=1e-9)
    locked = math.sqrt(stiffness / inertia) / (2 * math.pi)
    np.testing.assert_allclose(locked_frequencies(arm, [0.0], [stiffness]), [locked], rtol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_rotor_inertias_are_the_parts_of_the_mass_matrix(seed: int) -> None:
    arm = random_arm(seed, unbalanced=False)
    q = np.random.default_rng(seed).normal(size=(4, arm.n))
    shared, own = rotor_inertias(arm, q)
    locked = mass_matrix(at_level(arm, RotorLevel.NONE), q)
    whole = locked + shared + np.swapaxes(shared, 1, 2) + own
    np.testing.assert_allclose(whole, mass_matrix(arm, q), rtol=1e-12, atol=1e-12)
    assert np.abs(shared).max() > 1e-4  # the coupling is not negligible, so that an error would show


@pytest.mark.parametrize("seed", range(3))
def test_unbalanced_rotors_by_turning_them_alone(seed: int) -> None:
    # With only one rotor's ratio varied, M(ratio) is quadratic in that ratio, and its linear part is S.
    # At joint positions of zero every rotor is at zero, independent of its ratio.
    arm = random_arm(seed)
    q = np.zeros(arm.n)
    shared, own = rotor_inertias(arm, q)
    for i, rotor in enumerate(arm.rotors):
        flipped = list(arm.rotors)
        flipped[i] = replace(rotor, ratio=-rotor.ratio)
        both = [mass_matrix(a, q) for a in (arm, replace(arm, rotors=tuple(flipped)))]
        expected = np.zeros((arm.n, arm.n))
        expected[:, i] += shared[:, i]
        expected[i] += shared[:, i]
        np.testing.assert_allclose(0.5 * (both[0] - both[1]), expected, rtol=1e-10, atol=1e-12)
        assert own[i, i] == pytest.approx(rotor.ratio**2 * rotor.axial_inertia, rel=1e-14)


def test_unbalanced_rotors_turn_with_their_joints() -> None:
    # After half a turn of the joint, a rotor with an even ratio is in its initial orientation, one with an odd ratio is
    # not. The energy of a rotor that spins while its carrier moves must be that of a separate body.
    arm = random_arm(7)
    q = np.array([0.4, -1.1, 0.7, 2.0, -0.6, 0.9])
    shared, own = rotor_inertias(arm, q)
    locked = mass_matrix(arm, q) - shared - shared.T - own
    # Rotors locked in the orientation at these joint positions: their home frames are rotated accordingly.
    turned = []
    for rotor, angle in zip(arm.rotors, q, strict=True):
        turn = pin.exp6(np.concatenate([rotor.screw[3:], rotor.screw[:3]]) * rotor.ratio * angle).homogeneous
        turned.append(replace(rotor, home=turn @ rotor.home))
    ridden = mass_matrix(at_level(replace(arm, rotors=tuple(turned)), RotorLevel.NONE), q)
    np.testing.assert_allclose(locked, ridden, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(free_mass(arm, q[None])[0, :6, :6], ridden, rtol=1e-9, atol=1e-10)


def test_free_frequencies_are_those_of_the_larger_system() -> None:
    arm = random_arm(1)
    q = np.random.default_rng(8).normal(size=(3, arm.n))
    stiffness = np.array([2e4, 3e4, 1e4, 6e3, 5e3, 4e3])
    shared, own = rotor_inertias(arm, q)
    for k, found in enumerate(free_frequencies(arm, q, stiffness)):
        links = mass_matrix(arm, q[k]) - shared[k] - shared[k].T - own[k]
        masses = np.block([[links, shared[k]], [shared[k].T, own[k]]])
        springs = np.block([[np.diag(stiffness), -np.diag(stiffness)], [-np.diag(stiffness), np.diag(stiffness)]])
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(masses, springs)).real)
        # n modes deflect no spring.
        np.testing.assert_allclose(squares[: arm.n], 0.0, atol=1e-8 * squares[-1])
        np.testing.assert_allclose(found, np.sqrt(squares[arm.n :]) / (2 * math.pi), rtol=1e-8)


def test_free_is_never_below_locked() -> None:
    arm = random_arm(2, unbalanced=False)
    q = np.random.default_rng(2).normal(size=(6, arm.n))
    stiffness = np.full(arm.n, 1e4)
    heavy = with_rotors(arm, [replace(r, inertia=1e6 * r.inertia) for r in arm.rotors])
    # Rotors of very large inertia are effectively locked, if they are on the base and so do not load the links.
    based = with_rotors(arm, [Rotor(50.0, 1e4, carrier=-1) for _ in arm.rotors])
    np.testing.assert_allclose(
        free_frequencies(based, q, stiffness), locked_frequencies(based, q, stiffness), rtol=1e-4
    )
    light = with_rotors(arm, [Rotor(50.0, 1e-9, carrier=-1) for _ in arm.rotors])
    assert (free_frequencies(light, q, stiffness) > 10 * locked_frequencies(light, q, stiffness)).all()
    assert (free_frequencies(heavy, q, stiffness) > 0.99 * locked_frequencies(heavy, q, stiffness)).all()


def test_stiff_and_rigid_agree() -> None:
    arm = random_arm(3)
    q = np.random.default_rng(4).normal(size=(2, arm.n))
    some = np.array([2e4, np.inf, 1e4, np.inf, 5e3, 4e3])
    for frequencies in (locked_frequencies, free_frequencies):
        rigid = frequencies(arm, q, some)
        stiff = frequencies(arm, q, np.where(np.isfinite(some), some, 1e13))
        assert rigid.shape == (2, 4)
        np.testing.assert_allclose(rigid, stiff[:, :4], rtol=1e-6)


def test_frequencies_grow_with_the_root_of_stiffness() -> None:
    arm, q = random_arm(4), np.full(6, 0.3)
    base = np.array([2e4, 3e4, 1e4, 6e3, 5e3, 4e3])
    for frequencies in (locked_frequencies, free_frequencies):
        np.testing.assert_allclose(frequencies(arm, q, 16 * base), 4 * frequencies(arm, q, base), rtol=1e-8)


def test_reflected_level_has_no_coupling() -> None:
    arm = at_level(random_arm(5), RotorLevel.REFLECTED)
    shared, own = rotor_inertias(arm, np.full(6, 0.2))
    assert not shared.any()
    assert (np.diag(own) > 0).all()
    assert not rotor_inertias(at_level(arm, RotorLevel.NONE), np.zeros(6))[1].any()


def test_tip_jacobian_is_pinocchios() -> None:
    arm = load_arm("ur5-corrected")
    q = np.random.default_rng(6).normal(size=arm.n)
    model = pin.Model()
    parent, before = 0, pin.SE3.Identity()
    for i in range(arm.n):
        # A joint at its point, z along its axis, in the frame of the previous joint.
        axis = arm.screws[i, :3]
        placed = pin.SE3(pin.Quaternion.FromTwoVectors(np.array([0.0, 0, 1]), axis).matrix(), arm.joint_points[i])
        parent = model.addJoint(parent, pin.JointModelRZ(), before.actInv(placed), f"joint {i}")
        before = placed
    frame = pin.Frame("tip", parent, 0, before.actInv(pin.SE3(arm.tip)), pin.FrameType.OP_FRAME)
    index = model.addFrame(frame)
    jacobian = pin.computeFrameJacobian(model, model.createData(), q, index, pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(tip_jacobian(arm, q), np.vstack([jacobian[3:], jacobian[:3]]), atol=1e-12)


def test_joint_springs_alone() -> None:
    arm = load_arm("ur5-corrected")
    q = np.random.default_rng(7).normal(size=arm.n)
    stiffness = np.array([2e4, 3e4, 1e4, 6e3, np.inf, 4e3])
    force = np.array([0, 0, 0, 3.0, -5.0, 20.0])
    moved = tip_compliance(arm, q, stiffness) @ force
    # Joint torques that balance the force, by virtual work at displaced postures.
    step = 1e-6
    torque = np.array([
        force[3:] @ (tip_pose(arm, q + step * e)[:3, 3] - tip_pose(arm, q - step * e)[:3, 3]) / (2 * step)
        for e in np.eye(arm.n)
    ])  # fmt: skip
    tip = tip_pose(arm, q + 1e-3 * torque / stiffness)[:3, 3] - tip_pose(arm, q - 1e-3 * torque / stiffness)[:3, 3]
    # Central differences with steps of a thousandth: second order.
    np.testing.assert_allclose(moved[3:], tip / 2e-3, rtol=1e-6, atol=1e-10)


def test_a_beam_on_a_joint() -> None:
    # An elastic joint at the base and a beam of 0.8 m along x with the tip at its end: P L^2/K + P L^3/(3 E I).
    length, stiffness = 0.8, 9e3
    tip = np.eye(4)
    tip[0, 3] = length
    arm = Arm.from_screws([tip], [[0, -1, 0, 0, 0, 0]], [1.0], [0.01 * np.eye(3)], tip=tip)
    beams = {0: Beam(SECTION, np.zeros(3), tip[:3, 3])}
    soft = tip_compliance(arm, [0.0], [stiffness], beams=beams)
    expected = length**2 / stiffness + length**3 / (3 * SECTION.bending_x)
    assert soft[5, 5] == pytest.approx(expected, rel=1e-12)
    # The beam rotates with the joint: in the vertical position it is only stretched.
    upright = tip_compliance(arm, [np.pi / 2], [stiffness], beams=beams)
    assert upright[5, 5] == pytest.approx(length / SECTION.axial, rel=1e-9)
    # A tip beyond the end of the beam also moves by the rotation of that end.
    far = replace(arm, tip=np.block([[np.eye(3), np.array([[length + 0.3], [0], [0]])], [np.zeros((1, 3)), 1]]))
    compliance, lever = beam_compliance(SECTION, length), 0.3
    by_hand = compliance[4, 4] - 2 * lever * compliance[0, 4] + lever**2 * compliance[0, 0]
    assert tip_compliance(far, [0.0], [np.inf], beams=beams)[5, 5] == pytest.approx(by_hand, rel=1e-12)


def test_compliance_halves_as_stiffness_doubles_and_batches() -> None:
    arm = load_arm("ur5-corrected")
    q = np.random.default_rng(9).normal(size=(5, arm.n))
    stiffness = np.full((5, arm.n), 1e4)
    many = tip_compliance(arm, q, stiffness)
    np.testing.assert_allclose(many, 2 * tip_compliance(arm, q, 2 * stiffness), rtol=1e-14)
    np.testing.assert_allclose(many[3], tip_compliance(arm, q[3], stiffness[3]), rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(many, np.swapaxes(many, 1, 2), atol=1e-18)
    assert not tip_compliance(arm, q, np.full(arm.n, np.inf)).any()


def test_carried_motion() -> None:
    small = np.array([0.1, -0.2, 0.3, 1.0, 2.0, 3.0])
    lever = np.array([0.5, 0.7, -0.2])
    carried = carried_to(lever[np.newaxis])[0] @ small
    np.testing.assert_allclose(carried[:3], small[:3])
    np.testing.assert_allclose(carried[3:], small[3:] + np.cross(small[:3], lever), rtol=1e-14)


def test_bad_input() -> None:
    arm = pendulum()
    with pytest.raises(InputError, match="stiffness"):
        locked_frequencies(arm, [0.0], [0.0])
    with pytest.raises(InputError, match="shape"):
        locked_frequencies(arm, [0.0], [1.0, 2.0])
    with pytest.raises(InputError, match="in every sample or in none"):
        locked_frequencies(arm, [[0.0], [0.1]], [[1e3], [np.inf]])
    with pytest.raises(InputError, match="rotor of joint_1: must have inertia"):
        free_frequencies(pendulum(0.8, Rotor(100.0, 0.0)), [0.0], [1e3])
    with pytest.raises(InputError, match=r"beams\[1\]"):
        tip_compliance(arm, [0.0], [1e3], beams={1: Beam(SECTION, np.zeros(3), np.ones(3))})


def test_no_sample_has_frequencies_of_the_elastic_joints_alone() -> None:
    arm = load_arm("planar-2r")
    none = np.zeros((0, 2))
    assert locked_frequencies(arm, none, [1e4, 1e4]).shape == (0, 2)
    assert locked_frequencies(arm, none, [1e4, np.inf]).shape == (0, 1)
    assert locked_frequencies(arm, none, none).shape == (0, 2)
    assert tip_compliance(arm, none, [1e4, np.inf]).shape == (0, 6, 6)


def test_the_torque_of_a_struck_spring():
    """One joint stopped at once: w sqrt(K J), and as much again as the spring was wound beyond its rest."""
    inertia, stiffness = np.full((2, 1, 1), 0.5), np.array([2e4])
    found = struck_torques(inertia, stiffness, np.array([[2.0], [0.0]]), np.array([[3.0], [-7.0]]))
    np.testing.assert_allclose(found, [[3.0 + 2.0 * np.sqrt(2e4 * 0.5)], [7.0]], rtol=1e-12)
    assert struck_torques(inertia, np.array([np.nan]), np.ones((2, 1)), np.ones((2, 1))).tolist() == [[np.inf]] * 2
    assert struck_torques(inertia, np.array([np.inf]), np.ones((2, 1)), np.ones((2, 1))).tolist() == [[np.inf]] * 2


def test_a_spring_coupled_to_one_of_unknown_stiffness_has_no_bound():
    """Of four springs, the third is unknown and coupled to the second, this to the first; the fourth is apart."""
    inertia = np.array([[1.0, 0.3, 0.0, 0.0], [0.3, 1.0, 0.4, 0.0], [0.0, 0.4, 1.0, 0.0], [0.0, 0.0, 0.0, 0.5]])
    speed, excess = np.array([[0.2, -1.0, 3.0, 2.0]]), np.array([[1.0, 2.0, -30.0, 3.0]])
    unknown = struck_torques(inertia[None], np.array([2e4, 1e4, np.nan, 2e4]), speed, excess)[0]
    np.testing.assert_allclose(unknown, [np.inf, np.inf, np.inf, 3.0 + 2.0 * np.sqrt(2e4 * 0.5)], rtol=1e-12)
    # A rigid one loads them less than the worst of the others.
    stiffness = [np.array([2e4, 1e4, k, 2e4]) for k in (np.inf, *np.geomspace(1e2, 1e6, 20))]
    known = np.array([struck_torques(inertia[None], one, speed, excess)[0, :2] for one in stiffness])
    assert np.isfinite(known).all() and (known[1:].max(axis=0) > 1.5 * known[0]).all()


@pytest.mark.parametrize("hardening", [1.0, 2.5])
def test_struck_springs_never_bear_more_than_the_bound(hardening):
    """Random arms whose rotors stop one after another, in any time, in small steps; with springs that harden, too."""
    random, close = np.random.default_rng(5), []
    for _ in range(10):
        n = int(random.integers(1, 4))
        root = random.normal(size=(n, n)) * 10.0 ** random.uniform(-0.5, 0.5, n)
        inertia, soft = root @ root.T + 0.05 * np.eye(n), 10.0 ** random.uniform(3.5, 4.5, n)
        bend, speed = 10.0 ** random.uniform(0.0, 2.0, n), random.normal(size=n) * 3.0
        rest = random.normal(size=n) * 10.0
        torque = rest + random.normal(size=n) * 5.0
        masses = np.linalg.eigvalsh(inertia)
        fastest, slowest = np.sqrt(hardening * soft.max() / masses[0]), np.sqrt(soft.min() / masses[-1])
        begin = random.uniform(0.0, 2.0, n) / slowest * random.integers(0, 2)
        lasts = random.uniform(0.0, 1.0, n) / slowest * random.integers(0, 2) + 1e-9
        beyond = np.maximum(np.abs(torque) - bend, 0.0)
        x = np.sign(torque) * (np.minimum(np.abs(torque), bend) + beyond / hardening) / soft
        inverse, step, now, link, peak = np.linalg.inv(inertia), 0.1 / fastest, 0.0, speed.copy(), np.abs(torque)
        while now < max((begin + lasts).max(), 0.0) + 12.0 / slowest:
            beyond = np.maximum(np.abs(x) - bend / soft, 0.0)
            borne = np.sign(x) * soft * (np.minimum(np.abs(x), bend / soft) + hardening * beyond)
            peak, link = np.maximum(peak, np.abs(borne)), link + step * (inverse @ (borne - rest))
            slowed = np.clip((now + 0.5 * step - begin) / lasts, 0.0, 1.0)
            x, now = x + step * (speed * (1.0 - slowed) - link), now + step
        bound = struck_torques(inertia[None], hardening * soft, speed[None], (torque - rest)[None])[0] + np.abs(rest)
        assert (peak <= 1.03 * bound).all()  # the steps are a tenth of a radian of the fastest mode
        close.append((peak / bound).max())
    assert np.mean(close) > 0.4
