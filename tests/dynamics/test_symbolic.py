"""Symbolic equations: those of the book, sympy's derivatives of the Lagrangian, printing, and checks of input."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from random_arms import random_arm
from sympy import Function, Rational, cos, diff, expand_trig, simplify, sin, symbols, trigsimp

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm, planar_2r_torque
from drivetrain.dynamics.book.ratio_sweep import with_ratio
from drivetrain.dynamics.book.symbolic import SymbolicDynamics, symbolic_dynamics
from drivetrain.dynamics.energy import kinetic_energy, potential_energy
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError
from drivetrain.spatial.poses import pose


def elbow_arm() -> Arm:
    """Waist, shoulder and elbow, with parameters of two digits."""
    home = [pose(point=[0, 0, 0.3]), pose(point=[0.2, 0, 0.4]), pose(point=[0.6, 0, 0.4])]
    screws = [[0, 0, 1, 0, 0, 0], [0, -1, 0, 0.4, 0, 0], [0, -1, 0, 0.4, 0, -0.4]]
    tensors = [np.diag([0.02, 0.02, 0.01]), np.diag([0.01, 0.03, 0.03]), np.diag([0.01, 0.02, 0.02])]
    return Arm.from_screws(home, screws, [3, 2, 1], tensors)


def test_equation_8_9_symbolically() -> None:
    found = symbolic_dynamics(planar_2r_arm(Planar2R((2.0, 0.5), (0.4, 0.3))))
    (q1, q2), (w1, w2) = found.q, found.qd
    m1, m2, l1, l2, g = Rational(2), Rational(1, 2), Rational(2, 5), Rational(3, 10), Rational(981, 100)
    assert found.exact
    assert found.M[0, 0] - (m1 * l1**2 + m2 * (l1**2 + 2 * l1 * l2 * cos(q2) + l2**2)) == 0
    assert found.M[0, 1] == found.M[1, 0] == m2 * l2**2 + m2 * l1 * l2 * cos(q2)
    assert found.M[1, 1] == m2 * l2**2
    lever = m2 * l1 * l2 * sin(q2)
    assert (found.c[0] + lever * (2 * w1 * w2 + w2**2)).expand() == 0
    assert found.c[1] == lever * w1**2
    far = m2 * l2 * g * cos(q1 + q2)
    assert found.g[0] == (m1 + m2) * l1 * g * cos(q1) + far and found.g[1] == far
    assert found.tau[1] - (found.M[1, 0] * found.qdd[0] + found.M[1, 1] * found.qdd[1] + found.c[1] + found.g[1]) == 0


@pytest.mark.parametrize(
    ("ratio", "first", "cross", "second"),
    [(10.0, "661/160", "81/80", "9/8"), (100.0, "2641/160", "9/8", "27/2")],
)
def test_mass_matrices_of_section_8_9_2(ratio: float, first: str, cross: str, second: str) -> None:
    """4.13125, 1.0125, 1.125 and 16.50625, 1.125, 13.5; the book prints three digits, 1.13 for 1.125."""
    found = symbolic_dynamics(with_ratio(load_arm("planar-2r"), ratio))
    c = cos(found.q[1])
    assert found.M.tolist() == [[Rational(first) + 2 * c, Rational(cross) + c], [Rational(cross) + c, Rational(second)]]


@pytest.mark.parametrize("level", RotorLevel)
def test_euler_and_lagrange_by_derivatives_of_functions_of_time(level: RotorLevel) -> None:
    """Equation 8.3: positions as functions of t, with the Lagrangian differentiated by sympy."""
    rotor = Rotor(6.0, np.diag([2e-3, 1e-3, 3e-3]), 0.4, pose(point=[0.5, 0.1, 0.2]), [0, 0, 1, 0, -0.4, 0], 0)
    arm = at_level(with_rotors(elbow_arm(), [Rotor(5.0, 2e-3), rotor, None]), level)
    found = symbolic_dynamics(arm)
    t, n = symbols("t"), arm.n
    paths = [Function(f"f{i}")(t) for i in range(n)]
    in_time = dict(zip(found.q, paths, strict=True)) | {w: p.diff(t) for w, p in zip(found.qd, paths, strict=True)}
    out = {p.diff(t, 2): a for p, a in zip(paths, found.qdd, strict=True)}
    out |= {p.diff(t): w for p, w in zip(paths, found.qd, strict=True)} | dict(zip(paths, found.q, strict=True))
    at = dict(zip([*found.q, *found.qd, *found.qdd], np.random.default_rng(1).uniform(-2, 2, 3 * n), strict=True))
    for i in range(n):
        momentum = diff(found.lagrangian, found.qd[i]).subs(in_time)
        force = diff(found.lagrangian, found.q[i])
        wanted = momentum.diff(t).subs(out) - force
        assert float((wanted - found.tau[i]).subs(at)) == pytest.approx(0.0, abs=1e-11)
        assert abs(float(found.tau[i].subs(at))) > 1e-3


def test_simplified_or_not_is_the_same() -> None:
    short, long = (symbolic_dynamics(elbow_arm(), simplify=wish) for wish in (True, False))
    assert short.exact and long.exact
    assert simplify(trigsimp(expand_trig(short.M[0, 0]) - long.M[0, 0])) == 0
    assert short.M[0, 1] == 0 and short.g[0] == 0  # the waist joint has no coupling and carries no weight
    assert short.M[0, 0].count_ops() < long.M[0, 0].count_ops()
    assert not short.M.has(short.q[0])


def test_energies_agree_with_numbers() -> None:
    rng = np.random.default_rng(2)
    arm = with_rotors(random_arm(120, "RP"), [Rotor(-7.0, np.diag([1e-3, 2e-3, 2.5e-3]), 0.5, carrier=1), None])
    found, q, qd = symbolic_dynamics(arm), rng.uniform(-1, 1, 2), rng.uniform(-2, 2, 2)
    at = dict(zip([*found.q, *found.qd], [*q, *qd], strict=True))
    assert not found.exact
    assert float(found.kinetic.subs(at)) == pytest.approx(kinetic_energy(arm, q, qd), rel=1e-12)
    assert float(found.potential.subs(at)) == pytest.approx(potential_energy(arm, q), rel=1e-12)
    assert float(found.lagrangian.subs(at)) == pytest.approx(
        kinetic_energy(arm, q, qd) - potential_energy(arm, q), rel=1e-12
    )


def test_torque_function_takes_one_sample_or_a_batch() -> None:
    chain = Planar2R((1.3, 0.4), (0.7, 1.9))
    torque = symbolic_dynamics(planar_2r_arm(chain)).torque_function()
    q, qd, qdd = np.random.default_rng(3).uniform(-3, 3, (3, 5, 2))
    np.testing.assert_allclose(torque(q, qd, qdd), planar_2r_torque(chain, q, qd, qdd), atol=1e-12)
    assert torque(q[2], qd[2], qdd[2]).shape == (2,)
    np.testing.assert_allclose(torque(q[2], qd[2], qdd[2]), torque(q, qd, qdd)[2], rtol=1e-14)
    with pytest.raises(InputError, match="qd"):
        torque(q, qd[:2], qdd)


def test_all_of_a_real_arm_with_its_rotors() -> None:
    arm = load_arm("puma560")
    q, qd, qdd = np.random.default_rng(4).uniform(-3, 3, (3, 5, 6))
    found = symbolic_dynamics(arm)
    assert found.exact
    np.testing.assert_allclose(found.torque_function()(q, qd, qdd), inverse_dynamics(arm, q, qd, qdd), atol=1e-12)


def test_text_and_latex() -> None:
    found = symbolic_dynamics(planar_2r_arm(Planar2R()))
    lines = found.text().splitlines()
    assert lines[0] == "M11 = 2*cos(q2) + 3" and lines[1] == "M12 = cos(q2) + 1" and lines[2] == "M22 = 1"
    assert lines[-1] == "g2 = 981*cos(q1 + q2)/100" and len(lines) == 7
    tex = found.latex()
    assert tex.startswith("\\begin{aligned}") and tex.endswith("\\end{aligned}")
    assert r"\tau_{2} &=" in tex and r"\ddot{\theta_{1}}" in tex and r"\dot{\theta_{1}}^{2}" in tex and "qd" not in tex


def test_too_many_joints() -> None:
    with pytest.raises(InputError, match=r"at most 6 joints.*most_joints"):
        symbolic_dynamics(load_arm("panda"))
    assert isinstance(symbolic_dynamics(elbow_arm(), most_joints=3), SymbolicDynamics)
    with pytest.raises(InputError, match="at most 2 joints"):
        symbolic_dynamics(elbow_arm(), most_joints=2)


def test_without_sympy_the_message_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(InputError, match=r"drivetrain\[symbolic\]"):
        symbolic_dynamics(planar_2r_arm(Planar2R()))
