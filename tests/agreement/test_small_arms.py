"""Compiled laws of loops, constraints and rotors on the smallest arms that need them, against equations written out.

They take hundredths of a second as plain Python too, so that each mutant of these laws can be tried against them.
"""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import (
    balanced_rotor,
    by_mass_matrix,
    coaxial_rotor,
    error,
    motion,
    random_arm,
    rotors_of,
    unbalanced_rotor,
)

import drivetrain as dt
from drivetrain.arm.closures import Closure, LoopLink, with_closures
from drivetrain.control.laws import Chain
from drivetrain.dynamics.core import equation_of_motion, factor, loops
from drivetrain.dynamics.core.articulated import articulated_accelerations
from drivetrain.dynamics.core.frames import LINK
from drivetrain.dynamics.core.packed import link_frames, packed
from drivetrain.dynamics.derivatives import inverse_dynamics_derivatives
from drivetrain.dynamics.forward import unchecked_accelerations
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.jit import kernel
from drivetrain.records import record_type
from drivetrain.spatial.poses import pose

mass_and_bias = kernel(equation_of_motion.mass_and_bias)
follow, move_followers = kernel(loops.follow), kernel(loops.move_followers)

CRANK, ROD, ROCKER, BASE = 0.3, 1.0, 0.7, 0.9  # a crank-rocker: the shortest and longest are less than the other two
Y = np.array([0.0, 1.0, 0.0])


def four_bar() -> dt.Arm:
    """Crank at the origin, rocker at (BASE, 0), a rod between their ends; all turn about Y, in the plane x, z."""
    rocker, pin = rocker_of(0.0)[0], [CRANK, 0.0, 0.0]
    top = [BASE + ROCKER * np.cos(rocker), 0.0, -ROCKER * np.sin(rocker)]
    tensor = 0.01 * np.eye(3)
    main = dt.Arm.from_screws(
        [pose(point=[0.5 * CRANK, 0, 0])], [[0, 1, 0, 0, 0, 0]], [1.0], [tensor], pose(point=pin), joint_names=["crank"]
    )
    links = (
        LoopLink("rocker", Y, np.array([BASE, 0, 0]), 1.0, np.array([BASE, 0, 0.3]), tensor),
        LoopLink("rod", Y, np.array(top), 1.0, np.array([0.5, 0, 0.3]), tensor),
    )
    return with_closures(main, [Closure("base", "crank", np.array(pin), links)])


def rocker_of(crank: float) -> tuple[float, float]:
    """Angles of rocker and rod about Y from x, by the triangle over the diagonal; turns about Y lead from x to -z."""
    across, up = BASE - CRANK * np.cos(crank), CRANK * np.sin(crank)  # from the crank's end to the rocker's foot
    diagonal = np.hypot(across, up)
    at_foot = np.arccos((diagonal**2 + ROCKER**2 - ROD**2) / (2 * diagonal * ROCKER))
    rocker = np.pi - np.arctan2(up, across) + at_foot  # the foot sees the crank's end at pi - atan2(up, across)
    x, z = BASE + ROCKER * np.cos(rocker), -ROCKER * np.sin(rocker)
    rod = np.arctan2(z + CRANK * np.sin(crank), CRANK * np.cos(crank) - x)  # from the rocker's end to the crank's
    return float(rocker), float(rod)


def pins_of(arm: dt.Arm) -> loops.Pins:
    """The joints of an arm with one loop, at zero: chains are the crank alone, and rocker and rod."""
    whole, passive, ends = loops.linkage_records(arm.linkage)
    chains = np.zeros(2, record_type(Chain, np.int64))
    chains["row"], chains["joints"] = [0, 1], [1, 2]
    screws = np.concatenate([chain.screws for chain in arm.linkage.chains])
    assert screws.shape == (3, 6)
    return loops.Pins(
        whole, passive, ends, chains, np.arange(3), screws, np.zeros(3), np.zeros(3), np.zeros(5, LINK),
        np.zeros((3, 5)), np.zeros((2, 5)), np.zeros((2, 2)),
    )  # fmt: skip


def fourth_order(values: dict[int, np.ndarray], step: float) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative at 0 from values at -2 to 2 steps."""
    first = (8.0 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12.0 * step)
    second = (16.0 * (values[1] + values[-1]) - (values[2] + values[-2]) - 30.0 * values[0]) / (12.0 * step**2)
    return first, second


@pytest.mark.parametrize("crank", [0.15, -0.9, 2.4, 5.8])
def test_a_four_bar_follows_its_triangle(crank: float) -> None:
    pins, zero = pins_of(four_bar()), np.array(rocker_of(0.0))
    pins.whole["wanted"][0] = crank
    assert follow(pins, 1e4)
    # The rod turns on the rocker: its joint is the difference of both angles; whole turns mean nothing.
    angles = {k: np.array(rocker_of(crank + 1e-3 * k)) - zero for k in range(-2, 3)}
    joints = {k: np.unwrap([angles[0], one], axis=0)[1] @ [[1.0, -1.0], [0.0, 1.0]] for k, one in angles.items()}
    apart = (pins.whole["place"][1:] - joints[0] + np.pi) % (2.0 * np.pi) - np.pi
    np.testing.assert_allclose(apart, 0.0, atol=1e-12)
    slope, curvature = fourth_order(joints, 1e-3)
    pins.whole["speed"][0] = 1.7
    assert move_followers(pins) > 0.0
    # Fourth order of 1e-3 in angles that change within one: 1e-12, and rounding over the square of the step.
    np.testing.assert_allclose(pins.whole["speed"][1:], 1.7 * slope, atol=1e-10)
    np.testing.assert_allclose(-pins.found[:, 0], slope, atol=1e-10)
    np.testing.assert_allclose(-pins.found[:, 4], 1.7**2 * curvature, atol=1e-8)


def test_a_four_bar_stays_where_it_cannot_follow() -> None:
    """Beyond more strides than are allowed, or beyond a dead centre: then all joints stay where they were."""
    pins = pins_of(four_bar())
    pins.whole["wanted"][0] = 0.2
    assert not follow(pins, 0.99) and not pins.whole["place"].any()
    assert follow(pins, 1.01)  # 0.2 rad are one stride
    # Driven by its rocker it comes to a dead centre, where crank and rod are in line.
    for record, coordinate, follower in zip(pins.whole, (-1, 0, -1), (0, -1, 1), strict=True):
        record["coordinate"], record["follower"], record["place"] = coordinate, follower, 0.0
    pins.follow[:] = [0, 2]
    # There the angle at its foot is that of the triangle with a side of rod + crank, or rod - crank.
    sides = (ROD + np.array([CRANK, -CRANK])) ** 2
    ends = np.pi + np.arccos((BASE**2 + ROCKER**2 - sides) / (2.0 * BASE * ROCKER)) - rocker_of(0.0)[0]
    for end in ends:
        pins.whole["place"] = 0.0
        pins.whole["wanted"][1] = 0.98 * end
        assert follow(pins, 1e4)
        kept = pins.whole["place"].copy()
        pins.whole["wanted"][1] = 1.02 * end
        assert not follow(pins, 1e4)
        np.testing.assert_array_equal(pins.whole["place"], kept)


def test_the_least_change_under_constraints() -> None:
    """Against the pseudo-inverse in the metric of M: rows that say the same twice, and one that contradicts."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(3, 4, 4))
    masses = root @ root.swapaxes(1, 2) + 0.1 * np.eye(4)
    jacobian, force, drift = rng.normal(size=(3, 3, 4)), rng.normal(size=(3, 4)), rng.normal(size=(3, 3))
    jacobian[1, 2], drift[1, 2] = -2.0 * jacobian[1, 0], -2.0 * drift[1, 0]
    jacobian[2, 1], drift[2, 1] = jacobian[2, 0], drift[2, 0] + 0.5
    motion, multipliers, found = np.empty((3, 4)), np.empty((3, 3)), np.empty((3, 3))
    assert factor.least_change(masses.copy(), jacobian, force, drift, 1e-10, motion, multipliers, found) == (-1, -1)
    for k in range(3):
        lower = np.linalg.cholesky(masses[k])
        w = np.linalg.solve(lower, jacobian[k].T).T
        free = np.linalg.solve(lower, force[k])
        wanted = np.linalg.pinv(w @ w.T, rcond=1e-12) @ (w @ free + drift[k])
        np.testing.assert_allclose(multipliers[k], wanted, atol=1e-10)
        np.testing.assert_allclose(masses[k] @ motion[k], force[k] - jacobian[k].T @ wanted, atol=1e-10)
        sizes = np.linalg.svd(w, compute_uv=False)
        sizes = sizes[sizes > 1e-10 * sizes[0]]
        assert found[k, 0] == len(sizes) == (3, 2, 2)[k]
        assert found[k, 1] == pytest.approx(sizes[0] / sizes[-1], rel=1e-10)
    # Two rows ask 0.5 of each other: a direction of (1, -1)/sqrt(2) misses that over sqrt(2).
    np.testing.assert_allclose(found[:, 2], [0.0, 0.0, 0.5 / np.sqrt(2.0)], atol=1e-12)


def test_a_factor_is_a_triangle() -> None:
    root = np.random.default_rng(5).normal(size=(3, 4, 4))
    masses = root @ root.swapaxes(1, 2) + 0.1 * np.eye(4)
    lower = masses.copy()
    assert factor.factorise(lower) == (-1, -1)
    np.testing.assert_array_equal(lower, np.tril(lower))
    np.testing.assert_allclose(lower @ lower.swapaxes(1, 2), masses, atol=1e-13)


def test_a_matrix_without_inertia_is_named() -> None:
    masses = np.array([np.eye(2), [[1.0, 1.0], [1.0, 1.0]]])
    rest = np.zeros((2, 1, 2)), np.zeros((2, 2)), np.zeros((2, 1)), 1e-10, np.zeros((2, 2)), np.zeros((2, 1))
    assert factor.least_change(masses, *rest, np.zeros((2, 3))) == (1, 1)


ROTORS = {  # of each joint i of three, on link i - 1, on link i, or on the base
    "oblique on the link before": [lambda rng, i: balanced_rotor(rng, i - 1)] * 3,
    "unbalanced on the link before": [lambda rng, i: unbalanced_rotor(rng, i - 1)] * 3,
    "oblique on its link": [lambda rng, i: balanced_rotor(rng, i)] * 3,
    "unbalanced on its link": [lambda rng, i: unbalanced_rotor(rng, i)] * 3,
    "on the axis, on the base": [lambda rng, i: coaxial_rotor(rng), lambda rng, i: unbalanced_rotor(rng, -1)] * 2,
}


@pytest.mark.parametrize("joints", ["RRR", "RPH"])
@pytest.mark.parametrize("kind", ROTORS)
def test_accelerations_of_three_joints_with_rotors(joints: str, kind: str) -> None:
    """By articulated bodies, of samples in a block and of one alone, against the mass matrix."""
    bare, rng = random_arm(12, joints), np.random.default_rng(12)
    arm = dt.with_rotors(bare, [ROTORS[kind][i](rng, i) for i in range(3)])
    assert packed(arm).chained
    (q, qd, tau), tip = motion(12, 3, 2), 20.0 * rng.normal(size=(2, 6))
    wanted = by_mass_matrix(arm, q, qd, tau, tip)
    assert error(dt.forward_dynamics(arm, q, qd, tau, tip_wrench=tip), wanted) < 1e-12
    assert error(dt.forward_dynamics(arm, q[1], qd[1], tau[1], tip_wrench=tip[1]), wanted[1]) < 1e-12
    # Without a wrench, and without the mass matrix in reserve.
    wanted, found = by_mass_matrix(arm, q, qd, tau), np.empty((2, 3))
    assert articulated_accelerations(packed(arm).arm, q, qd, tau, np.zeros((0, 6)), found) == (-1, -1)
    assert error(found, wanted) < 1e-12
    assert error(unchecked_accelerations(arm)(q[0], qd[0], tau[0]), wanted[0]) < 1e-12


@pytest.mark.parametrize("kind", ["balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_mass_and_bias_of_two_joints_with_rotors(kind: str, seed: int) -> None:
    arm = random_arm(seed, "RP" if seed == 1 else "RR")
    arm = dt.with_rotors(arm, rotors_of(seed, kind, 2))
    model, (q, qd, qdd) = packed(arm), np.random.default_rng(seed).normal(size=(3, 2))
    bodies = equation_of_motion.moving_bodies(2, len(model.rotors), link_frames(arm)[0], arm.gravity)
    mass, turned, bias, turned_bias = np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(2), np.zeros(2)
    mass_and_bias(model.links, model.rotors, q, qd, bodies, mass, turned, bias, turned_bias)
    np.testing.assert_allclose(mass, dt.mass_matrix(arm, q), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(bias, bias_torque(arm, q, qd), rtol=1e-11, atol=1e-12)
    gear = dt.drive_torques(arm, q, qd, qdd).gear
    rest = mass @ qdd + bias - (turned @ qdd + turned_bias)
    spinning = np.array([rotor is not None for rotor in arm.rotors])
    np.testing.assert_allclose(rest[spinning], gear[spinning], rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("each", [True, False])
def test_a_wrench_at_the_tip_enters_derivatives_by_its_own_jacobian(each: bool) -> None:
    """Linear in the wrench: what it adds to d tau/d q is what a difference of its torque shows."""
    arm, (q, qd, qdd) = random_arm(3, "RR"), motion(3, 2, 2)
    tip = np.random.default_rng(3).normal(size=(2, 6) if each else 6)
    added = (
        inverse_dynamics_derivatives(arm, q, qd, qdd, tip_wrench=tip).q
        - inverse_dynamics_derivatives(arm, q, qd, qdd).q
    )
    columns = []
    for unit in 1e-3 * np.eye(2):
        values = {k: dt.body_jacobian(arm, q + k * unit) for k in range(-2, 3)}
        columns.append(fourth_order(values, 1e-3)[0])  # (N, 6, n) by q of one joint
    wanted = np.stack([np.einsum("kji,kj->ki", one, np.broadcast_to(tip, (2, 6))) for one in columns], axis=-1)
    assert error(added, wanted) < 1e-9


@pytest.mark.parametrize(("joints", "kind"), [("RR", "none"), ("RP", "balanced"), ("PR", "none"), ("RR", "mixed")])
def test_derivatives_of_two_joints(joints: str, kind: str) -> None:
    """Of inverse dynamics by position and speed against differences, by acceleration against the mass matrix."""
    arm, (q, qd, qdd) = random_arm(8, joints), motion(8, 2, 2)
    arm = arm if kind == "none" else dt.with_rotors(arm, rotors_of(8, kind, 2))
    found = inverse_dynamics_derivatives(arm, q, qd, qdd)
    # An unbalanced rotor turns by up to 120 times the step.
    step = 1e-5 if kind == "mixed" else 1e-3
    columns = []
    for unit in step * np.eye(2):
        by_q = {k: dt.inverse_dynamics(arm, q + k * unit, qd, qdd) for k in range(-2, 3)}
        by_qd = {k: dt.inverse_dynamics(arm, q, qd + k * unit, qdd) for k in range(-2, 3)}
        columns.append([fourth_order(values, step)[0] for values in (by_q, by_qd)])
    by_q, by_qd = (np.stack(parts, axis=-1) for parts in zip(*columns, strict=True))
    # Truncation of the fourth order, and rounding over the step.
    assert error(found.q, by_q) < (1e-6 if kind == "mixed" else 1e-9)
    assert error(found.qd, by_qd) < (1e-8 if kind == "mixed" else 1e-9)
    assert error(found.qdd, dt.mass_matrix(arm, q)) < 1e-12
