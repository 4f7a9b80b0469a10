"""The closed form against the recursion, pinocchio, the book's stacked equations and a complex-step derivative."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of
from scipy.linalg import block_diag

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import body_jacobian
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.book.closed_form import closed_form, closed_form_torque, mass_matrix_rate, stacked
from drivetrain.dynamics.derivatives import coriolis_matrix
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics, velocity_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.spatial.poses import adjoint, inverse_pose
from drivetrain.spatial.wrenches import bracket

# The reference multiplies twists of rotors a hundred times as fast as their joints, and most products cancel.
TOLERANCE = 1e-10
KINDS = [None, "coaxial", "balanced", "unbalanced", "mixed"]


def arm_of(seed: int, joints: str, kind: str | None, level: RotorLevel = RotorLevel.FULL) -> Arm:
    arm = random_arm(seed, joints)
    return arm if kind is None else with_rotors(arm, rotors_of(seed, kind, arm.n), level=level)


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "P"])
@pytest.mark.parametrize("seed", range(2))
def test_closed_form_is_the_recursion(seed: int, joints: str, kind: str | None, level: RotorLevel) -> None:
    arm = arm_of(seed, joints, kind, level)
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=(len(q), 6)) * 20
    terms = closed_form(arm, q, qd)
    assert error(terms.mass, mass_matrix(arm, q)) < TOLERANCE
    assert error(terms.velocity, velocity_torque(arm, q, qd)) < TOLERANCE
    assert error(terms.gravity, gravity_torque(arm, q)) < TOLERANCE
    assert error(terms.tip_jacobian, body_jacobian(arm, q)) < TOLERANCE
    symbols = coriolis_matrix(arm, q, qd)
    assert error(terms.mass_rate, symbols + np.swapaxes(symbols, 1, 2)) < TOLERANCE
    wanted = inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    assert error(closed_form_torque(arm, q, qd, qdd, tip_wrench=tip), wanted) < TOLERANCE


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_closed_form_is_pinocchio(seed: int, kind: str | None) -> None:
    arm = arm_of(seed, EVERY_JOINT, kind)
    q, qd, qdd = motion(seed, arm.n, 3)
    twin = InPinocchio(arm)
    ratios = [1.0 if rotor is None else rotor.ratio for rotor in arm.rotors]
    motor = np.array([twin.torques(*sample)[1] for sample in zip(q, qd, qdd, strict=True)])
    assert error(closed_form_torque(arm, q, qd, qdd), motor * ratios) < TOLERANCE


def test_without_rotors_each_term_is_pinocchios() -> None:
    arm = random_arm(5, EVERY_JOINT)
    q, qd, _ = motion(5, arm.n)
    twin = InPinocchio(arm)
    terms = closed_form(arm, q, qd)
    for k, (x, v) in enumerate(zip(q, qd, strict=True)):
        mass = pin.crba(twin.model, twin.data, x)
        assert error(terms.mass[k], np.triu(mass) + np.triu(mass, 1).T) < TOLERANCE
        assert error(terms.gravity[k], pin.computeGeneralizedGravity(twin.model, twin.data, x)) < TOLERANCE
        coriolis = pin.computeCoriolisMatrix(twin.model, twin.data, x, v)
        assert error(terms.velocity[k], coriolis @ v) < TOLERANCE
        assert error(terms.mass_rate[k], coriolis + coriolis.T) < TOLERANCE


def se3(screw: np.ndarray) -> np.ndarray:
    x, y, z, a, b, c = screw
    return np.array([[0, -z, y, a], [z, 0, -x, b], [-y, x, 0, c], [0, 0, 0, 0]])


def exponential(screw: np.ndarray, angle: complex) -> np.ndarray:
    """Exponential of a unit screw by the powers of its matrix, of which the fourth is minus the second."""
    one, two, three = (np.linalg.matrix_power(se3(screw), k) for k in (1, 2, 3))
    if not screw[:3].any():
        return np.eye(4) + angle * one
    return np.eye(4) + angle * one + (1 - np.cos(angle)) * two + (angle - np.sin(angle)) * three


def complex_mass(arm: Arm, q: np.ndarray) -> np.ndarray:
    """M by equation 8.57 in complex numbers, from rates of homogeneous matrices and second moments of mass."""

    moved, columns, result = [np.eye(4, dtype=complex)], [], np.zeros((arm.n, arm.n), dtype=complex)
    for i, screw in enumerate(arm.screws):
        body = moved[i] @ se3(screw) @ np.linalg.inv(moved[i])
        columns.append(body)
        moved.append(moved[i] @ exponential(screw, q[i]))

    def add(home: np.ndarray, mass: float, tensor: np.ndarray, velocities: list[np.ndarray]) -> None:
        """Add a body: trace of (T' S T'^T) with its second moments S and the rates T' of its pose per joint rate."""
        moments = np.zeros((4, 4))
        moments[:3, :3] = 0.5 * np.trace(tensor) * np.eye(3) - tensor
        moments[3, 3] = mass
        for i, first in enumerate(velocities):
            for j, second in enumerate(velocities):
                result[i, j] += np.trace(first @ home @ moments @ home.T @ second.T)

    for b in range(arm.n):
        rates = [columns[i] @ moved[b + 1] if i <= b else np.zeros((4, 4)) for i in range(arm.n)]
        add(arm.home[b], arm.masses[b], arm.inertias[b], rates)
    for j, rotor in enumerate(arm.rotors):
        if rotor is not None:
            on, spin = moved[rotor.carrier + 1], exponential(rotor.screw, rotor.ratio * q[j])
            rates = [columns[i] @ on @ spin if i <= rotor.carrier else np.zeros((4, 4), complex) for i in range(arm.n)]
            rates[j] = rates[j] + rotor.ratio * on @ se3(rotor.screw) @ spin
            add(rotor.home, rotor.mass, rotor.inertia, rates)
    return result


@pytest.mark.parametrize("kind", [None, "coaxial", "unbalanced"])
def test_rate_of_the_mass_matrix_by_a_complex_step(kind: str | None) -> None:
    """Exercise 8.7 against the derivative along the motion, which is exact to rounding."""
    bare = random_arm(7, "RPHR")
    rotors = None if kind is None else rotors_of(7, kind, bare.n)
    arm = bare if rotors is None else with_rotors(bare, rotors)
    q, qd, _ = motion(7, arm.n, 1)
    step = 1e-30
    found = complex_mass(arm, q[0] + 1j * step * qd[0])
    assert error(mass_matrix(arm, q[0]), found.real) < 1e-9
    assert error(mass_matrix_rate(arm, q, qd)[0], found.imag / step) < 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_stacked_equations_of_the_book(kind: str | None) -> None:
    """Equations 8.68 to 8.71 solved directly, and the misprint in 8.74."""
    arm = arm_of(1, EVERY_JOINT, kind)
    q, qd, qdd = (x[0] for x in motion(1, arm.n))
    tip = np.random.default_rng(1).normal(size=6)
    m = stacked(arm, q)
    one = np.eye(len(m.W))
    base = m.base @ np.concatenate([np.zeros(3), -arm.gravity])
    own = block_diag(*[bracket(twist) for twist in (m.A @ qd).reshape(-1, 6)])
    v = np.linalg.solve(one - m.W, m.A @ qd)
    rate = np.linalg.solve(one - m.W, m.A @ qdd - own @ m.W @ v + base)
    moving = block_diag(*[bracket(twist) for twist in v.reshape(-1, 6)])
    f = np.linalg.solve(one - m.W.T, m.G @ rate - moving.T @ m.G @ v + m.tip @ tip)
    wanted = inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    assert error(m.A.T @ f, wanted) < TOLERANCE
    printed = m.L @ (m.A @ qdd + own @ m.W @ v + base)  # 8.74
    wrong = m.A.T @ m.L.T @ (m.G @ printed - moving.T @ m.G @ v + m.tip @ tip)
    assert error(wrong, wanted) > 1e-3


def test_exercise_8_7_as_printed_is_wrong_and_as_corrected_right() -> None:
    arm = arm_of(1, "RRRRRR", None)
    q, qd, _ = (x[0] for x in motion(1, arm.n))
    m = stacked(arm, q)
    own = block_diag(*[bracket(twist) for twist in (m.A @ qd).reshape(-1, 6)])
    symbols = coriolis_matrix(arm, q, qd)
    wanted = symbols + symbols.T
    for gamma in (m.W, -m.W, m.L, -m.L):
        first = m.A.T @ m.L.T @ gamma.T @ own.T @ m.L.T @ m.G @ m.L @ m.A
        printed = first + m.A.T @ m.L.T @ m.G @ m.L @ own @ gamma @ m.A
        assert error(printed, wanted) > 1e-2
    gamma = -m.W
    first = m.A.T @ m.L.T @ gamma.T @ own.T @ m.L.T @ m.G @ m.L @ m.A
    second = m.A.T @ m.L.T @ m.G @ m.L @ own @ gamma @ m.L @ m.A
    assert error(first + second, wanted) < TOLERANCE


@pytest.mark.parametrize("kind", KINDS)
def test_w_is_nilpotent_and_l_its_series(kind: str | None) -> None:
    arm = arm_of(2, "RRRR", kind)
    m = stacked(arm, motion(2, arm.n)[0])
    power, series = np.eye(m.W.shape[1])[np.newaxis], np.zeros_like(m.W)
    for _ in range(arm.n + 1):  # a rotor on the last link is one level deeper than the links
        series = series + power
        power = power @ m.W
    assert not power.any()
    assert error(m.L, series) < 1e-13
    assert error(m.L @ (np.eye(m.W.shape[1]) - m.W), np.eye(m.W.shape[1])[np.newaxis]) < 1e-13


def test_constant_matrices_hold_the_link_data() -> None:
    arm = load_arm("ur5")
    m = stacked(arm, np.zeros(6))
    assert m.A.shape == (36, 6)
    assert m.carriers == (-1, 0, 1, 2, 3, 4)
    assert [m.G[6 * i + 3, 6 * i + 3] for i in range(6)] == pytest.approx(arm.masses)
    assert m.A[:6, 0] == pytest.approx(adjoint(inverse_pose(arm.home[0])) @ arm.screws[0])
    geared = stacked(load_arm("planar-2r"), np.zeros(2))
    assert geared.carriers == (-1, 0, -1, 0)
    assert geared.A[12:18, 0] == pytest.approx([0, 0, 10, 0, 0, 0])
    assert geared.A[18:24, 1] == pytest.approx([0, 0, 10, 0, 0, 0])


def test_geared_2r_of_the_book() -> None:
    """Section 8.9.2 at G = 10: [[4.13125 + 2 c, 1.0125 + c], [1.0125 + c, 1.125]]; 1.125 is printed 1.13."""
    c = np.cos(0.7)
    found = closed_form(load_arm("planar-2r"), [0.3, 0.7], [0.0, 0.0]).mass
    assert found == pytest.approx(np.array([[4.13125 + 2 * c, 1.0125 + c], [1.0125 + c, 1.125]]), abs=1e-13)


def test_levels_differ() -> None:
    """Otherwise the agreement at each level would prove nothing."""
    arm = arm_of(4, "RRRRRR", "mixed")
    q, qd, _ = motion(4, arm.n, 1)
    full, reflected, none = (closed_form(at_level(arm, level), q, qd).mass for level in ("full", "reflected", "none"))
    assert error(full, reflected) > 1e-3
    assert error(reflected, none) > 1e-3


def test_a_huge_angle_has_no_effect_on_other_terms() -> None:
    """A rounding error in the displacement of a body along its axis would grow with the angle."""
    arm = with_rotors(load_arm("ur5"), [Rotor(100.0, 2e-5)] * 6)
    q = np.array([0.3, -1.0, 0.7, 1e59, 0.2, 0.1])
    found = closed_form(arm, q, np.full(6, 0.2))
    np.testing.assert_allclose(found.mass, mass_matrix(arm, q), rtol=0.0, atol=1e-12)
    assert np.isfinite(found.velocity).all() and np.abs(found.tip_jacobian).max() < 2.0
