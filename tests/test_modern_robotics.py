"""The book's functions against the book's own package, on its own examples and on arms from seeds."""

from __future__ import annotations

import inspect
from collections.abc import Callable

import modern_robotics as book
import numpy as np
import pytest

import drivetrain.modern_robotics as ours
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.lists import book_lists
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError, PhysicsWarning
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation

NAMES = [
    "ad", "InverseDynamics", "MassMatrix", "VelQuadraticForces", "GravityForces", "EndEffectorForces",
    "ForwardDynamics", "EulerStep", "InverseDynamicsTrajectory", "ForwardDynamicsTrajectory",
]  # fmt: skip
TOLERANCE = 1e-11  # of the largest value: the package multiplies chains of matrices and inverts M

# The three-joint arm of the package's docstrings; its first axis is not unit, (1, 0, 1).
M01 = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.089159], [0, 0, 0, 1]])
M12 = np.array([[0, 0, 1, 0.28], [0, 1, 0, 0.13585], [-1, 0, 0, 0], [0, 0, 0, 1]])
M23 = np.array([[1, 0, 0, 0], [0, 1, 0, -0.1197], [0, 0, 1, 0.395], [0, 0, 0, 1]])
M34 = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.14225], [0, 0, 0, 1]])
G1 = np.diag([0.010267, 0.010267, 0.00666, 3.7, 3.7, 3.7])
G2 = np.diag([0.22689, 0.22689, 0.0151074, 8.393, 8.393, 8.393])
G3 = np.diag([0.0494433, 0.0494433, 0.004095, 2.275, 2.275, 2.275])
GLIST = [G1, G2, G3]
MLIST = [M01, M12, M23, M34]
SLIST = np.array([[1, 0, 1, 0, 1, 0], [0, 1, 0, -0.089, 0, 0], [0, 1, 0, -0.089, 0, 0.425]]).T
GRAVITY = np.array([0, 0, -9.8])
Q, QD, QDD = np.array([0.1, 0.1, 0.1]), np.array([0.1, 0.2, 0.3]), np.array([2, 1.5, 1])
FTIP = np.ones(6)
CHAIN = (MLIST, GLIST, SLIST)


def near(found: np.ndarray, wanted: np.ndarray, tolerance: float = TOLERANCE) -> None:
    assert np.shape(found) == np.shape(wanted)
    assert np.abs(found - wanted).max() <= tolerance * np.abs(wanted).max()


def random_chain(seed: int, n: int = 6, slide: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames anywhere, inertias about points that are no centres of mass, screws of any length."""
    rng = np.random.default_rng(seed)
    poses = np.array([pose(exp_rotation(rng.normal(size=3)), rng.uniform(-0.4, 0.4, 3)) for _ in range(n + 1)])
    inertias = []
    for _ in range(n):
        points = rng.normal(size=(5, 3)) * 0.1
        tensor = sum(p @ p * np.eye(3) - np.outer(p, p) for p in points)
        inertias.append(RigidBody(rng.uniform(0.5, 5.0), rng.uniform(-0.2, 0.2, 3), tensor).spatial_inertia())
    axes = []
    for i in range(n):
        w = rng.normal(size=3)
        axes.append([*w, *np.cross(rng.uniform(-0.5, 0.5, 3), w)])
        if slide and i == 2:
            axes[-1] = [0, 0, 0, *rng.normal(size=3)]
    return poses, np.array(inertias), np.array(axes).T


@pytest.mark.parametrize("name", NAMES)
def test_signatures_are_the_books(name: str) -> None:
    found, wanted = (list(inspect.signature(getattr(module, name)).parameters) for module in (ours, book))
    assert found == wanted


def test_printed_results_of_the_package() -> None:
    """The outputs in its docstrings, 8 or 9 digits."""
    near(ours.InverseDynamics(Q, QD, QDD, GRAVITY, FTIP, *CHAIN), [74.69616155, -33.06766016, -3.23057314], 1e-9)
    mass = [[22.5433380, -0.307146754, -0.00718426391], [-0.307146754, 1.96850717, 0.432157368],
            [-0.00718426391, 0.432157368, 0.191630858]]  # fmt: skip
    near(ours.MassMatrix(Q, *CHAIN), np.array(mass), 1e-8)
    near(ours.VelQuadraticForces(Q, QD, *CHAIN), [0.26453118, -0.05505157, -0.00689132], 1e-7)
    near(ours.GravityForces(Q, GRAVITY, *CHAIN), [28.40331262, -37.64094817, -5.4415892], 1e-9)
    near(ours.EndEffectorForces(Q, FTIP, *CHAIN), [1.40954608, 1.85771497, 1.392409], 1e-8)
    near(ours.ForwardDynamics(Q, QD, [0.5, 0.6, 0.7], GRAVITY, FTIP, *CHAIN), [-0.97392907, 25.58466784, -32.91499212],
         1e-9)  # fmt: skip
    following = ours.EulerStep(Q, QD, QDD, 0.1)
    near(following[0], [0.11, 0.12, 0.13])
    near(following[1], [0.3, 0.35, 0.4])
    near(ours.ad([1, 2, 3, 4, 5, 6]), book.ad(np.array([1, 2, 3, 4, 5, 6])))


@pytest.mark.parametrize("seed", range(6))
def test_every_function_on_arms_from_seeds(seed: int) -> None:
    chain = random_chain(seed)
    rng = np.random.default_rng(seed + 100)
    q, qd, qdd, tau = rng.uniform(-2, 2, (4, 6))
    g, tip = rng.normal(size=3) * 9.0, rng.normal(size=6) * 10.0
    near(ours.InverseDynamics(q, qd, qdd, g, tip, *chain), book.InverseDynamics(q, qd, qdd, g, tip, *chain))
    near(ours.MassMatrix(q, *chain), book.MassMatrix(q, *chain))
    near(ours.VelQuadraticForces(q, qd, *chain), book.VelQuadraticForces(q, qd, *chain))
    near(ours.GravityForces(q, g, *chain), book.GravityForces(q, g, *chain))
    near(ours.EndEffectorForces(q, tip, *chain), book.EndEffectorForces(q, tip, *chain))
    # Their inverse of M, whose condition number is up to 1e4 here.
    near(ours.ForwardDynamics(q, qd, tau, g, tip, *chain), book.ForwardDynamics(q, qd, tau, g, tip, *chain), 1e-9)


@pytest.mark.parametrize("chain", [CHAIN, random_chain(7, 3)], ids=["printed", "random"])
def test_trajectories(chain: tuple[object, object, object]) -> None:
    rng = np.random.default_rng(3)
    q, qd, qdd = rng.uniform(-2, 2, (3, 20, 3))
    tips = rng.normal(size=(20, 6))
    wanted = book.InverseDynamicsTrajectory(q, qd, qdd, GRAVITY, tips, *chain)
    near(ours.InverseDynamicsTrajectory(q, qd, qdd, GRAVITY, tips, *chain), wanted)
    start, torques = rng.uniform(-1, 1, (2, 3)), rng.normal(size=(10, 3))
    given = (torques, GRAVITY, tips[:10], *chain, 0.01, 4)
    for found, expected in zip(
        ours.ForwardDynamicsTrajectory(*start, *given), book.ForwardDynamicsTrajectory(*start, *given), strict=True
    ):
        near(found, expected, 1e-9)


def test_the_printed_forward_trajectory() -> None:
    """The arm of the docstring over its ten rows of torque; a first-order method that shakes, the same way there."""
    taus = np.array([[3.63, -6.58, -5.57], [3.74, -5.55, -5.5], [4.31, -0.68, -5.19], [5.18, 5.63, -4.31],
                     [5.85, 8.17, -2.59]])  # fmt: skip
    given = (np.full(3, 0.1), QD, taus, GRAVITY, np.ones((5, 6)), *CHAIN, 0.1, 8)
    for found, expected in zip(
        ours.ForwardDynamicsTrajectory(*given), book.ForwardDynamicsTrajectory(*given), strict=True
    ):
        near(found, expected, 1e-8)


def test_zero_stands_for_no_tip_forces() -> None:
    q = np.tile(Q, (4, 1))
    wanted = book.InverseDynamicsTrajectory(q, q, q, GRAVITY, np.zeros((4, 6)), *CHAIN)
    for nothing in (0, None, np.zeros((4, 6))):
        near(ours.InverseDynamicsTrajectory(q, q, q, GRAVITY, nothing, *CHAIN), wanted)
    still = ours.ForwardDynamicsTrajectory(Q, QD, q, GRAVITY, 0, *CHAIN, 0.01, 1)
    near(still[0], book.ForwardDynamicsTrajectory(Q, QD, q, GRAVITY, np.zeros((4, 6)), *CHAIN, 0.01, 1)[0], 1e-9)


def test_lists_in_place_of_arrays_and_changed_content() -> None:
    """The arm is remembered by what the lists hold, not by which lists they are."""
    inertias = [matrix.copy() for matrix in GLIST]
    before = ours.MassMatrix([0.1, 0.1, 0.1], MLIST, inertias, SLIST.tolist())
    inertias[2][3:, 3:] *= 2.0
    after = ours.MassMatrix([0.1, 0.1, 0.1], MLIST, inertias, SLIST.tolist())
    near(before, book.MassMatrix(Q, *CHAIN))
    near(after, book.MassMatrix(Q, MLIST, inertias, SLIST))
    assert np.abs(after - before).max() > 0.1


def test_an_arm_of_this_package_in_the_books_lists() -> None:
    arm = load_arm("ur5")
    lists = book_lists(arm)
    q, qd, qdd = np.random.default_rng(0).uniform(-2, 2, (3, 6))
    wanted = inverse_dynamics(arm, q, qd, qdd)
    near(ours.InverseDynamics(q, qd, qdd, arm.gravity, 0, *lists), wanted)
    near(book.InverseDynamics(q, qd, qdd, arm.gravity, np.zeros(6), *lists), wanted)


def test_inertias_that_no_body_has_are_told_and_used() -> None:
    inertias = [matrix.copy() for matrix in GLIST]
    inertias[0][0, 0] = 0.5
    with pytest.warns(PhysicsWarning, match="link_1"):
        found = ours.MassMatrix(Q, MLIST, inertias, SLIST)
    near(found, book.MassMatrix(Q, MLIST, inertias, SLIST))


def move(count: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From rest to rest by a polynomial of degree nine, with 0.2 s of rest before and after, at 1 kHz."""
    rise = np.polynomial.Polynomial([0, 0, 0, 0, 0, 126, -420, 540, -315, 70])
    x = np.clip((1e-3 * np.arange(count) - 0.2) / 1.6, 0.0, 1.0)[:, None]
    stroke = np.array([2.0, -3.0, 1.5])
    return tuple(stroke * rise.deriv(k)(x) / 1.6**k if k else stroke * rise(x) for k in range(3))


@pytest.mark.parametrize("bits", [12, 16])
def test_exercise_8_14_from_an_encoder(bits: int) -> None:
    q, qd, qdd = move()
    step = 2 * np.pi / 2**bits
    readings = np.round(q / step) * step
    wanted = ours.InverseDynamicsTrajectory(q, qd, qdd, GRAVITY, 0, *CHAIN)
    for resolution in (step, [step] * 3, None):
        found = ours.InverseDynamicsTrajectoryFromPositions(readings, 1e-3, GRAVITY, 0, *CHAIN, resolution)
        rms = np.sqrt((found**2).mean(axis=0) / (wanted**2).mean(axis=0))
        peak = np.abs(found).max(axis=0) / np.abs(wanted).max(axis=0)
        assert rms == pytest.approx(np.ones(3), abs=0.03)
        assert peak == pytest.approx(np.ones(3), abs=0.05)
    rough = np.gradient(np.gradient(readings, 1e-3, axis=0), 1e-3, axis=0)
    naive = ours.InverseDynamicsTrajectory(readings, np.gradient(readings, 1e-3, axis=0), rough, GRAVITY, 0, *CHAIN)
    assert (naive[:, 0] ** 2).mean() > (1.0 + 0.1 / 4.0 ** (bits - 16)) * (wanted[:, 0] ** 2).mean()


def test_exercise_8_14_from_exact_positions() -> None:
    """The verification that the exercise asks for."""
    q, qd, qdd = move()
    wanted = ours.InverseDynamicsTrajectory(q, qd, qdd, GRAVITY, np.ones((2000, 6)), *CHAIN)
    found = ours.InverseDynamicsTrajectoryFromPositions(q, 1e-3, GRAVITY, np.ones((2000, 6)), *CHAIN, 0.0)
    inner = slice(1, -1)  # at the ends differences are one-sided, first order
    near(found[inner], wanted[inner], 1e-4)
    near(found, wanted, 1e-2)


def faults(call: Callable[..., object], *arguments: object) -> str:
    with pytest.raises(InputError) as caught:
        call(*arguments)
    return str(caught.value)


def test_wrong_shapes_and_no_arm() -> None:
    assert "thetalist" in faults(ours.MassMatrix, np.zeros(4), *CHAIN)
    assert "dthetalist" in faults(ours.VelQuadraticForces, Q, np.zeros(2), *CHAIN)
    assert "Mlist" in faults(ours.MassMatrix, Q, MLIST[:3], GLIST, SLIST)
    assert "Slist" in faults(ours.MassMatrix, Q, MLIST, GLIST, SLIST.T)
    assert "Slist[:, 1]" in faults(ours.MassMatrix, Q, MLIST, GLIST, SLIST * [1, 0, 1])
    assert "tip_wrench" in faults(ours.EndEffectorForces, Q, np.ones(5), *CHAIN)
    assert "intRes" in faults(ours.ForwardDynamicsTrajectory, Q, QD, np.ones((3, 3)), GRAVITY, 0, *CHAIN, 0.1, 0)
    assert "gravity" in faults(ours.GravityForces, Q, [0, -9.81], *CHAIN)


@pytest.mark.parametrize("where", [(3, 3), (0, 1), (0, 4), (1, 5)])
def test_what_is_no_rigid_body(where: tuple[int, int]) -> None:
    inertias = [matrix.copy() for matrix in GLIST]
    inertias[1][where] += 0.5
    assert "Glist[1]" in faults(ours.MassMatrix, Q, MLIST, inertias, SLIST)


@pytest.mark.parametrize("n", [1, 2, 6, 7])
def test_columns_stand_for_vectors(n: int) -> None:
    chain = random_chain(40 + n, n)
    q, qd, qdd = np.random.default_rng(n).normal(size=(3, n))
    g, tip = np.array([1.0, -2.0, -9.0]), np.arange(6.0)
    calls: list[tuple[str, tuple[object, ...], tuple[object, ...]]] = [
        ("InverseDynamics", (q, qd, qdd, g, tip), chain),
        ("MassMatrix", (q,), chain),
        ("VelQuadraticForces", (q, qd), chain),
        ("GravityForces", (q, g), chain),
        ("EndEffectorForces", (q, tip), chain),
        ("ForwardDynamics", (q, qd, qdd, g, tip), chain),
        ("ad", (tip,), ()),
    ]
    for name, vectors, lists in calls:
        columns = tuple(np.reshape(v, (-1, 1)) for v in vectors)
        wanted = getattr(book, name)(*vectors, *lists)
        found = getattr(ours, name)(*columns, *lists)
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)  # one joint alone has no velocity torque
    # The package itself takes columns for these two, and gives what vectors give.
    near(ours.MassMatrix(q[:, None], *chain), book.MassMatrix(q[:, None], *chain), 1e-10)


def test_an_euler_step_of_different_shapes() -> None:
    with pytest.raises(InputError, match="must have one shape"):
        ours.EulerStep([0.0, 0.0], [0.0], [1.0, 2.0], 0.1)


def test_other_chapters_are_the_books_own() -> None:
    assert ours.FKinSpace is book.FKinSpace
    assert ours.ForwardDynamics is not book.ForwardDynamics
    with pytest.raises(AttributeError, match="no attribute 'FKinSpaec'"):
        _ = ours.FKinSpaec  # type: ignore[attr-defined]
