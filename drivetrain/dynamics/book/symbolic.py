"""Symbolic equations of motion of a small arm from the Euler-Lagrange equations, with sympy (the extra ``symbolic``).

The kinetic energy is computed from the poses of all bodies alone: with the pose T of a body and its second moments P
about the frame's origin it is ``trace(dT/dt P dT/dt^T) / 2``. No twist, no wrench and no recursion is used, so the
equations are an independent check of the recursions. For more than three joints the equations fill pages, but can be
computed: those of the PUMA 560 within a second, of the UR5 in about three, of the seven-axis Panda in ten without
simplification and in minutes with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.rotors import MountedRotor, RotorLevel
from drivetrain.arrays import Array, finite_samples
from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:
    from sympy import Expr, ImmutableMatrix, Symbol

    from drivetrain.dynamics.book.trigonometric import Trigonometry

Polynomials = Any  # object array of sympy's polynomials
Torques = Callable[[Any, Any, Any], Array]


@dataclass(frozen=True, eq=False)
class SymbolicDynamics:
    """The equations ``tau = M qdd + c + g`` of an arm in the symbols q1, qd1, qdd1, ...; numbers in SI units.

    Attributes:
        q, qd, qdd: Symbols of positions, speeds and accelerations [rad or m, and per s, s^2], n each.
        M: Mass matrix [kg m^2, kg m or kg], (n, n).
        c: Velocity-product torque [N m or N], (n, 1).
        g: Gravity torque [N m or N], (n, 1).
        potential: Potential energy, with the zero of ``potential_energy`` [J].
        exact: Whether every number of the arm is a short decimal or fraction, so that nothing is rounded.
        rates: dM_ij/dq_k [kg m^2 per rad etc.], (n, n, n), used by the torque function.
    """

    q: tuple[Symbol, ...]
    qd: tuple[Symbol, ...]
    qdd: tuple[Symbol, ...]
    M: ImmutableMatrix
    c: ImmutableMatrix
    g: ImmutableMatrix
    potential: Expr
    exact: bool
    rates: tuple[tuple[tuple[Expr, ...], ...], ...]

    @property
    def tau(self) -> ImmutableMatrix:
        """The torques [N m or N], (n, 1)."""
        return self.M * _column(self.qdd) + self.c + self.g

    @property
    def kinetic(self) -> Expr:
        """The kinetic energy, equation 8.14 [J]."""
        speeds = _column(self.qd)
        return (speeds.T * self.M * speeds)[0, 0] / 2

    @property
    def lagrangian(self) -> Expr:
        """Kinetic minus potential energy, equation 8.13 [J]."""
        return self.kinetic - self.potential

    def text(self) -> str:
        """The terms as text, one line per entry, in SI units."""
        return "\n".join(f"{name} = {expression}" for name, expression in self._lines())

    def latex(self) -> str:
        """The torques as LaTeX in an ``aligned`` block, with theta and dots as symbols; SI units."""
        from sympy import latex

        names: dict[Symbol, str] = {}
        for letters, accent in ((self.q, "{}"), (self.qd, r"\dot{{{}}}"), (self.qdd, r"\ddot{{{}}}")):
            names |= {x: accent.format(rf"\theta_{{{i + 1}}}") for i, x in enumerate(letters)}
        rows = [rf"\tau_{{{i + 1}}} &= {latex(row, symbol_names=names)}" for i, row in enumerate(self.tau)]
        return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"

    def torque_function(self) -> Torques:
        """A numerical function of q, qd, qdd [rad or m, per s, s^2], (n,) or (N, n) each, to torques [N m or N].

        It evaluates M, its rates and g with sympy's ``lambdify`` and the sums of Lagrange's equations numerically.
        """
        from sympy import lambdify

        n = len(self.q)
        flat = [*self.M, *(x for plane in self.rates for row in plane for x in row), *self.g]
        evaluate = lambdify(self.q, flat, modules="numpy")

        def torque(q: Any, qd: Any, qdd: Any) -> Array:
            positions, speeds, accelerations = finite_samples(n, {"q": q, "qd": qd, "qdd": qdd})
            columns = [np.broadcast_to(x, len(positions)) for x in evaluate(*positions.T)]
            values = np.stack(columns, axis=1)
            mass = values[:, : n * n].reshape(-1, n, n)
            rates = values[:, n * n : -n].reshape(-1, n, n, n)
            found = np.einsum("sij,sj->si", mass, accelerations) + values[:, -n:]
            found += np.einsum("sijk,sj,sk->si", rates, speeds, speeds)
            found -= 0.5 * np.einsum("sjki,sj,sk->si", rates, speeds, speeds)
            return found if np.ndim(q) == 2 else np.asarray(found[0])

        return torque

    def _lines(self) -> list[tuple[str, Expr]]:
        n = len(self.q)
        lines = [(f"M{i + 1}{j + 1}", self.M[i, j]) for i in range(n) for j in range(i, n)]
        for name, column in (("c", self.c), ("g", self.g)):
            lines += [(f"{name}{i + 1}", column[i, 0]) for i in range(n)]
        return lines


def symbolic_dynamics(arm: Arm, *, simplify: bool = True, most_joints: int = 6) -> SymbolicDynamics:
    """The equations of motion of an arm as sympy expressions, rotors included at the arm's level.

    Args:
        arm: With rotors or without. Numbers that are short decimals or fractions become exact rationals.
        simplify: Whether to write products of sines and cosines with sums of angles if that is shorter. Terms that
            cancel are removed in any case.
        most_joints: Refuse arms with more joints, whose equations would take very long [-].

    Returns:
        The equations.

    Raises:
        InputError: More joints than allowed, or sympy is not installed.

    Reference: Modern Robotics, equations 8.13 to 8.16, in the form of the Euler-Lagrange equations:
        ``tau_i = sum_j M_ij qdd_j + sum_jk (dM_ij/dq_k - dM_jk/dq_i / 2) qd_j qd_k + dV/dq_i``.
    """
    if arm.n > most_joints:
        hint = "raise most_joints and be patient"
        raise InputError(Fault("arm", f"must have at most {most_joints} joints for equations in letters", arm.n, hint))
    refuse_loops(arm)
    try:
        from sympy import symbols
    except ImportError:
        hint = 'install it with: pip install "drivetrain[symbolic]"'
        raise InputError(Fault("symbolic_dynamics", "needs the package sympy", hint=hint)) from None
    letters = [symbols(f"{kind}1:{arm.n + 1}", real=True) for kind in ("q", "qd", "qdd")]
    return _equations(arm, _trigonometry(arm, letters[0]), letters, simplify)


@dataclass(frozen=True, eq=False)
class _Body:
    """A body at its displaced pose, as polynomials."""

    pose: Polynomials
    mass: float
    inertia: Array


def _equations(
    arm: Arm, algebra: Trigonometry, letters: Sequence[tuple[Symbol, ...]], simplify: bool
) -> SymbolicDynamics:
    from sympy import Add, ImmutableMatrix

    n, (q, qd, qdd) = arm.n, letters
    mass, potential = _energies(arm, algebra)

    def rate(value: Any, k: int) -> Any:
        return algebra.shortened(algebra.slope(value, k))

    def shown(value: Any) -> Expr:
        return algebra.expression(value, sums=simplify)

    rates = [[[rate(mass[i, j], k) for k in range(n)] for j in range(n)] for i in range(n)]
    half = algebra.number(0.5)

    def velocity_term(i: int, j: int, k: int) -> Expr:
        """Coefficient of qd_j qd_k, j <= k, in row i."""
        value = rates[i][j][k] + rates[i][k][j] - rates[j][k][i] if j < k else rates[i][j][j] - half * rates[j][j][i]
        return shown(algebra.shortened(value)) * qd[j] * qd[k]

    centrifugal = [Add(*(velocity_term(i, j, k) for j in range(n) for k in range(j, n))) for i in range(n)]
    return SymbolicDynamics(
        q,
        qd,
        qdd,
        ImmutableMatrix(n, n, lambda i, j: shown(mass[i, j])),
        ImmutableMatrix(centrifugal),
        ImmutableMatrix([shown(rate(potential, i)) for i in range(n)]),
        shown(potential),
        algebra.rational,
        tuple(tuple(tuple(algebra.expression(x, sums=False) for x in row) for row in plane) for plane in rates),
    )


def _column(letters: tuple[Symbol, ...]) -> ImmutableMatrix:
    from sympy import ImmutableMatrix

    return ImmutableMatrix(list(letters))


def _turning(arm: Arm) -> dict[int, MountedRotor]:
    """The rotors that spin as bodies, by joint."""
    return {i: r for i, r in enumerate(arm.rotors) if r is not None and arm.level is RotorLevel.FULL}


def _trigonometry(arm: Arm, q: Sequence[Symbol]) -> Trigonometry:
    """Angles of the joints, then of the rotors that spin as bodies."""
    from drivetrain.dynamics.book.trigonometric import Trigonometry, all_exact

    numbers: list[Any] = [arm.home, arm.screws, arm.masses, arm.inertias, arm.gravity]
    for r in arm.rotors:
        numbers += [] if r is None else [r.home, r.screw, r.inertia, np.array([r.ratio, r.mass])]
    numbers += [] if arm.coupling is None else [arm.coupling]
    factors = np.vstack([np.eye(arm.n), rotor_turns(arm)[list(_turning(arm))]]).tolist()
    return Trigonometry(q, factors, all_exact(numbers))


def _energies(arm: Arm, algebra: Trigonometry) -> tuple[Polynomials, Any]:
    n = arm.n
    mass, potential = _constant(algebra, np.zeros((n, n))), algebra.number(0.0)
    slopes = np.vectorize(algebra.slope, otypes=[object], excluded=[1])
    for body in _bodies(arm, algebra):
        moments = np.diag([0.5 * np.trace(body.inertia)] * 3 + [body.mass])
        moments[:3, :3] -= body.inertia
        moved = [slopes(body.pose, i) for i in range(n)]
        weighted = [slope @ _constant(algebra, moments) for slope in moved]
        for i in range(n):
            for j in range(i, n):
                mass[i, j] = mass[i, j] + (weighted[i] * moved[j]).sum()
        potential -= (body.pose[:3, 3] * _constant(algebra, body.mass * arm.gravity)).sum()
    if arm.level is RotorLevel.REFLECTED:
        axial = np.array([0.0 if r is None else r.axial_inertia for r in arm.rotors])
        mass = mass + _constant(algebra, (rotor_turns(arm).T * axial) @ rotor_turns(arm))
    for i in range(n):
        for j in range(i, n):
            mass[i, j] = mass[j, i] = algebra.shortened(mass[i, j])
    return mass, algebra.shortened(potential)


def _bodies(arm: Arm, algebra: Trigonometry) -> list[_Body]:
    """Links and rotors; rotors below the level FULL are locked to their carriers."""
    moved = [_constant(algebra, np.eye(4))]
    for i, screw in enumerate(arm.screws):
        turn = _displacement(algebra, screw, i, algebra.position(i))
        moved.append(moved[-1] @ turn)
    links = zip(moved[1:], arm.home, arm.masses, arm.inertias, strict=True)
    bodies = [_Body(pose @ _constant(algebra, home), float(m), tensor) for pose, home, m, tensor in links]
    angles = {joint: arm.n + place for place, joint in enumerate(_turning(arm))}
    for joint, r in enumerate(arm.rotors):
        if r is not None:
            pose = moved[r.carrier + 1]
            if joint in angles:
                pose = pose @ _displacement(algebra, r.screw, angles[joint], algebra.number(0.0))
            bodies.append(_Body(pose @ _constant(algebra, r.home), r.mass, r.inertia))
    return bodies


def _displacement(algebra: Trigonometry, screw: Array, angle: int, position: Any) -> Polynomials:
    """The exponential of a unit screw, by Rodrigues' formula."""
    w, v = screw[:3], screw[3:]
    result = _constant(algebra, np.eye(4))
    if not w.any():
        result[:3, 3] = _constant(algebra, v) * position
        return result
    s, c = algebra.sine_cosine(angle)
    hat = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    result[:3, :3] = result[:3, :3] + _constant(algebra, hat) * s + _constant(algebra, hat @ hat) * (1 - c)
    # The term that is linear in the angle is along the axis: (I + [w]^2) v = w (w . v).
    along = _constant(algebra, w * (w @ v)) * position
    result[:3, 3] = along + _constant(algebra, hat @ v) * (1 - c) - _constant(algebra, hat @ hat @ v) * s
    return result


def _constant(algebra: Trigonometry, values: Array) -> Polynomials:
    return np.vectorize(algebra.number, otypes=[object])(values)
