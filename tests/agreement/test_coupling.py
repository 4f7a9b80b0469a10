"""Coupled motors against pinocchio, Lagrange's equations and the balance of power; every kind of rotor, every level."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns, shaft_motion, shaft_torques, with_coupling
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.book.closed_form import closed_form
from drivetrain.dynamics.book.symbolic import symbolic_dynamics
from drivetrain.dynamics.derivatives import christoffel_symbols, coriolis_matrix
from drivetrain.dynamics.energy import kinetic_energy, potential_energy, power_balance
from drivetrain.dynamics.flexibility import (
    free_frequencies,
    free_mass,
    locked_frequencies,
    tip_compliance,
    tip_jacobian,
)
from drivetrain.dynamics.forward import articulated_body, forward_dynamics, unchecked_accelerations
from drivetrain.dynamics.inverse import drive_torques, gravity_torque, inverse_dynamics, joint_loads
from drivetrain.dynamics.mass import mass_matrix

TOLERANCE = 1e-10  # as of the other comparisons with pinocchio; what is found is some 1e-13
ROUNDING = 1e-12
CASES = [(seed, kind, level) for seed in range(2) for kind in ("coaxial", "balanced", "mixed") for level in RotorLevel]


def coupling(seed: int, n: int) -> np.ndarray:
    """A matrix with nothing special about it, but for one shaft that has a joint to itself."""
    rng = np.random.default_rng([seed, 4])
    matrix = np.eye(n) + 0.7 * rng.normal(size=(n, n))
    matrix[1] = np.eye(n)[1]
    return matrix


def coupled(seed: int, kind: str, level: RotorLevel = RotorLevel.FULL, joints: str = EVERY_JOINT) -> Arm:
    bare = random_arm(seed, joints)
    return with_rotors(bare, rotors_of(seed, kind, bare.n), level=level, coupling=coupling(seed, bare.n))


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "RPR"])
@pytest.mark.parametrize("kind", ["coaxial", "balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("seed", range(3))
def test_rotors_as_bodies_of_pinocchio(seed: int, kind: str, joints: str) -> None:
    arm = coupled(seed, kind, joints=joints)
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=6) * 20
    twin = InPinocchio(arm)
    wanted = np.array([twin.torques(*sample, tip) for sample in zip(q, qd, qdd, strict=True)])
    found = drive_torques(arm, q, qd, qdd, tip_wrench=tip)
    assert error(found.gear @ arm.coupling, wanted[:, 0]) < TOLERANCE  # joint torques are C^T shaft torques
    assert error(found.motor, wanted[:, 1]) < TOLERANCE
    torque = inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    assert error(torque, wanted[:, 1] @ rotor_turns(arm)) < TOLERANCE
    loads = joint_loads(arm, q, qd, qdd, tip_wrench=tip)
    np.testing.assert_array_equal(loads.gear, found.gear)
    np.testing.assert_allclose(loads.motor, found.motor, rtol=1e-15)
    np.testing.assert_array_equal(loads.torque, torque)


@pytest.mark.parametrize("seed", range(3))
def test_wrenches_and_carriers_of_coupled_rotors(seed: int) -> None:
    """Against the sum over rotors one by one: with all others locked, each alone adds what it adds."""
    arm = coupled(seed, "mixed")
    q, qd, qdd = motion(seed, arm.n)
    locked = at_level(arm, RotorLevel.NONE)
    found, base = joint_loads(arm, q, qd, qdd), joint_loads(locked, q, qd, qdd)
    total = base.wrench.copy()
    for i in range(arm.n):
        alone = [r if r is None or j == i else replace_spin(r) for j, r in enumerate(arm.rotors)]
        total += joint_loads(replace(arm, rotors=tuple(alone)), q, qd, qdd).wrench - base.wrench
    assert error(found.wrench, total) < ROUNDING
    assert error(found.carrier_acceleration, base.carrier_acceleration) < ROUNDING


def replace_spin(rotor: Rotor) -> Rotor:
    """A rotor that turns so slowly that it is as good as locked."""
    return replace(rotor, ratio=1e-14 * rotor.ratio)


@pytest.mark.parametrize(("joints", "kind"), [("RR", "coaxial"), ("RP", "balanced"), ("HR", "unbalanced")])
@pytest.mark.parametrize("level", RotorLevel)
def test_lagranges_equations(joints: str, kind: str, level: RotorLevel) -> None:
    bare = random_arm(21, joints)
    rotors = rotors_of(21, kind, bare.n)
    arm = with_rotors(bare, rotors, level=level, coupling=[[1.0, 0.75], [1.25, -1.0]])
    wanted = symbolic_dynamics(arm, simplify=False).torque_function()
    q, qd, qdd = motion(21, arm.n)
    assert error(inverse_dynamics(arm, q, qd, qdd), wanted(q, qd, qdd)) < TOLERANCE


@pytest.mark.parametrize("seed", range(3))
def test_energy_of_spins_by_hand(seed: int) -> None:
    """REFLECTED adds J (N qd)^2 / 2 to the energy, so N^T diag(J) N to the mass matrix, and nothing else."""
    arm = coupled(seed, "balanced", RotorLevel.REFLECTED)
    q, qd, _ = motion(seed, arm.n)
    locked = at_level(arm, RotorLevel.NONE)
    axial = np.array([r.axial_inertia for r in arm.rotors])
    spins = (rotor_turns(arm) @ qd.T).T
    more = kinetic_energy(arm, q, qd) - kinetic_energy(locked, q, qd)
    assert error(more, 0.5 * np.sum(axial * spins**2, axis=1)) < ROUNDING
    reflected = rotor_turns(arm).T @ np.diag(axial) @ rotor_turns(arm)
    assert error(mass_matrix(arm, q) - mass_matrix(locked, q), np.tile(reflected, (len(q), 1, 1))) < ROUNDING
    np.testing.assert_array_equal(coriolis_matrix(arm, q, qd).shape, (len(q), arm.n, arm.n))
    assert error(coriolis_matrix(arm, q, qd), coriolis_matrix(locked, q, qd)) < ROUNDING


@pytest.mark.parametrize(("seed", "kind", "level"), CASES)
def test_terms_add_up(seed: int, kind: str, level: RotorLevel) -> None:
    arm = coupled(seed, kind, level)
    q, qd, qdd = motion(seed, arm.n)
    matrices = mass_matrix(arm, q)
    np.testing.assert_array_equal(matrices, np.swapaxes(matrices, 1, 2))
    assert np.linalg.eigvalsh(matrices).min() > 0.0
    bias = np.einsum("kij,kj->ki", coriolis_matrix(arm, q, qd), qd)
    assert error(np.einsum("kijl,kj,kl->ki", christoffel_symbols(arm, q), qd, qd), bias) < ROUNDING
    terms = np.einsum("kij,kj->ki", matrices, qdd) + bias + gravity_torque(arm, q)
    torque = inverse_dynamics(arm, q, qd, qdd)
    assert error(torque, terms) < ROUNDING
    # The condition of the mass matrix, up to 1e6 here, times rounding of torques up to 1e4.
    assert error(forward_dynamics(arm, q, qd, torque), qdd) < 1e-8
    assert error(articulated_body(arm, q, qd, torque), qdd) < 1e-8
    assert error(unchecked_accelerations(arm)(q[0], qd[0], torque[0]), qdd[0]) < 1e-8
    assert np.isnan(unchecked_accelerations(arm)(q[0], qd[0], np.nan * torque[0])).all()
    form = closed_form(arm, q, qd)
    assert error(form.mass, matrices) < ROUNDING and error(form.velocity, bias) < ROUNDING
    assert error(form.gravity, gravity_torque(arm, q)) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["coaxial", "balanced", "mixed"])
def test_power_of_the_motors_is_the_rate_of_energy(seed: int, kind: str) -> None:
    arm = coupled(seed, kind)
    q, qd, qdd = motion(seed, arm.n, count=3)
    h = 2e-4  # rotors turn 100 times faster than joints: a short step, of fourth order

    def energy(t: float) -> np.ndarray:
        now = q + t * qd + 0.5 * t * t * qdd
        return kinetic_energy(arm, now, qd + t * qdd) + potential_energy(arm, now)

    rate = (energy(-2 * h) - 8 * energy(-h) + 8 * energy(h) - energy(2 * h)) / (12 * h)
    motors = drive_torques(arm, q, qd, qdd).motor
    power = np.sum(motors * (qd @ rotor_turns(arm).T), axis=1)
    assert error(power, rate) < 1e-6  # of the differences
    assert error(power, power_balance(arm, q, qd, qdd).joints.sum(axis=1)) < ROUNDING


@pytest.mark.parametrize("kind", ["coaxial", "mixed"])
def test_shafts_are_joints_of_another_description(kind: str) -> None:
    """On parallel axes a link's angle against the base is the sum of joint angles: what a belt over joints turns."""
    bare = random_arm(3, "RR")
    screws = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 1, 0.2, -0.7, 0]], dtype=float)
    bare = replace(bare, screws=screws, joint_points=np.array([[0.0, 0, 0], [0.7, 0.2, 0]]))
    rotors = [replace_carrier(r) for r in rotors_of(3, kind, 2)]
    belted = with_rotors(bare, rotors, coupling=[[1.0, 0.0], [1.0, 1.0]])
    q, qd, qdd = motion(3, 2)
    # Motors on the base cannot tell a belt from a rod: their torque is what moves the absolute angle.
    found = drive_torques(belted, q, qd, qdd)
    plain = inverse_dynamics(bare, q, qd, qdd)
    absolute = np.column_stack([plain[:, 0] - plain[:, 1], plain[:, 1]])
    assert error(found.gear, absolute) < ROUNDING
    spins = shaft_motion(belted, qdd)
    own = np.array([0.0 if r is None else r.axial_inertia * r.ratio for r in belted.rotors])
    ratios = np.array([1.0 if r is None else r.ratio for r in belted.rotors])
    assert error(found.motor, absolute / ratios + own * spins) < ROUNDING


def replace_carrier(rotor: Rotor | None) -> Rotor | None:
    """A balanced rotor on the base."""
    return None if rotor is None else Rotor(rotor.ratio, 3e-4, 0.5, carrier=-1)


def test_identity_and_diagonal_couplings_are_ratios() -> None:
    bare = random_arm(4)
    rotors = rotors_of(4, "mixed", 6)
    q, qd, qdd = motion(4, 6)
    plain = with_rotors(bare, rotors)
    assert with_coupling(plain, np.eye(6)).coupling is None
    factors = np.array([2.0, -0.5, 1.0, -3.0, 0.25, 1.0])
    other = [None if r is None else Rotor(r.ratio / f, r.inertia, r.mass, r.home, r.screw, r.carrier)
             for r, f in zip(plain.rotors, factors, strict=True)]  # fmt: skip
    scaled = with_rotors(bare, other, coupling=np.diag(factors))
    one, two = drive_torques(plain, q, qd, qdd), drive_torques(scaled, q, qd, qdd)
    assert error(two.gear * factors, one.gear) < ROUNDING
    geared = [i for i, r in enumerate(rotors) if r is not None]
    assert error(two.motor[:, geared], one.motor[:, geared]) < ROUNDING


@pytest.mark.parametrize("seed", range(2))
def test_springs_behind_coupled_gears(seed: int) -> None:
    """Frequencies against the eigenvalues of links and free rotors written out as one mass matrix and one stiffness."""
    arm = coupled(seed, "balanced", joints="RRRRRR")
    q, _, _ = motion(seed, 6, count=2)
    stiffness = np.array([2e4, 3e4, np.inf, 1e4, 5e3, 4e3])
    whole = free_mass(arm, q)
    shared, own = whole[:, :6, 6:], whole[:, 6:, 6:]
    c, sprung = arm.coupling, np.isfinite(stiffness)
    nearly = np.where(sprung, stiffness, 1e9)  # rigid to 1e-4 of the others, and still to be calculated with
    for k in range(2):
        locked = mass_matrix(at_level(arm, RotorLevel.NONE), q[k])
        assert error(locked + shared[k] @ c + c.T @ shared[k].T + c.T @ own[k] @ c, mass_matrix(arm, q[k])) < ROUNDING
        # Coordinates: joints, then the sprung rotors as shaft angles; the rigid one follows C q.
        follow = np.vstack([np.hstack([np.eye(6), np.zeros((6, 5))]), np.zeros((6, 11))])
        follow[8, :6] = c[2]
        follow[np.ix_(6 + np.flatnonzero(sprung), 6 + np.arange(5))] = np.eye(5)
        masses = follow.T @ np.block([[locked, shared[k]], [shared[k].T, own[k]]]) @ follow
        twist = np.hstack([c[sprung], -np.eye(5)])
        values = np.linalg.eigvals(np.linalg.solve(masses, twist.T @ np.diag(stiffness[sprung]) @ twist)).real
        wanted = np.sqrt(np.sort(values)[-5:]) / (2 * np.pi)
        assert free_frequencies(arm, q[k], stiffness) == pytest.approx(wanted, rel=1e-8)
        joint_stiffness = c.T @ np.diag(nearly) @ c
        values = np.linalg.eigvals(np.linalg.solve(locked, joint_stiffness)).real
        wanted = np.sqrt(np.sort(values)[:5]) / (2 * np.pi)
        assert locked_frequencies(arm, q[k], stiffness) == pytest.approx(wanted, rel=1e-3)
        assert locked_frequencies(arm, q[k], nearly)[:5] == pytest.approx(wanted, rel=1e-6)
        # The tip gives way as springs in joint space do.
        jacobian = tip_jacobian(arm, q[k])
        wanted = jacobian @ np.linalg.solve(joint_stiffness, jacobian.T)
        assert error(tip_compliance(arm, q[k], nearly) * 1e4, wanted * 1e4) < 1e-9


def test_torques_and_motions_of_shafts_do_the_same_work() -> None:
    arm = coupled(0, "mixed")
    _, qd, qdd = motion(0, arm.n)
    work = np.sum(shaft_torques(arm, qdd) * shaft_motion(arm, qd), axis=1)
    assert error(work, np.sum(qdd * qd, axis=1)) < ROUNDING
    assert shaft_torques(arm, qdd[0]) == pytest.approx(shaft_torques(arm, qdd)[0], rel=1e-12)
