"""Lagrange's equations by sympy: energies of every body from its pose alone, then derivatives, then numbers.

Knows nothing of twists, angular velocities or recursions: the kinetic energy of a body with pose T is
trace(dT/dt P dT/dt^T) / 2, where P holds its mass and second moments. Poses are polynomials in the sines and cosines of
the joint and rotor angles and in the joint positions, which sympy multiplies and differentiates a hundred times faster
than expressions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from sympy import RR
from sympy.polys.rings import PolyElement, ring

from drivetrain.arm.arm import Arm


class Lagrangian:
    """Mass matrix and potential of an arm as polynomials, and their derivatives."""

    def __init__(self, arm: Arm):
        self.arm, self.n = arm, arm.n
        # Of each joint: its position, sine and cosine, and the sine and cosine of its rotor.
        names = [f"{kind}{i}" for i in range(arm.n) for kind in ("x", "s", "c", "S", "C")]
        self.ring, *self.symbols = ring(names, RR)
        moved = [self._constant(np.eye(4))]
        for i in range(arm.n):
            x, s, c, _, _ = self._of(i)
            moved.append(moved[-1] @ self._displacement(arm.screws[i], x, s, c))
        bodies = [(moved[i + 1], arm.home[i], arm.masses[i], arm.inertias[i]) for i in range(arm.n)]
        for i, r in enumerate(arm.rotors):
            if r is not None:
                _, _, _, s, c = self._of(i)
                spin = self._displacement(r.screw, self.ring(0), s, c)
                bodies.append((moved[r.carrier + 1] @ spin, r.home, r.mass, r.inertia))
        self.masses, self.potential = self._constant(np.zeros((arm.n, arm.n))), self.ring(0)
        for displaced, home, mass, tensor in bodies:
            self._add(displaced @ self._constant(home), mass, tensor)

    def torques(self) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
        """A function of q, qd, qdd that gives the generalised torques."""
        n = self.n
        masses = [[Numbers(self.masses[i, j]) for j in range(n)] for i in range(n)]
        slopes = [[[Numbers(self.slope(self.masses[i, j], k)) for k in range(n)] for j in range(n)] for i in range(n)]
        pulls = [Numbers(self.slope(self.potential, i)) for i in range(n)]

        def evaluate(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
            at = self._values(q)
            mass = np.array([[m(at) for m in row] for row in masses])
            slope = np.array([[[m(at) for m in entry] for entry in row] for row in slopes])
            centrifugal = np.einsum("ijk,j,k->i", slope, qd, qd) - 0.5 * np.einsum("jki,j,k->i", slope, qd, qd)
            return mass @ qdd + centrifugal + np.array([p(at) for p in pulls])

        return evaluate

    def slope(self, value: PolyElement, i: int) -> PolyElement:
        """The derivative with respect to a joint position."""
        x, s, c, rotor_s, rotor_c = self._of(i)
        result = value.diff(x) + value.diff(s) * c - value.diff(c) * s
        if self.arm.rotors[i] is not None:
            result += (value.diff(rotor_s) * rotor_c - value.diff(rotor_c) * rotor_s) * self.arm.rotors[i].ratio
        return result

    def _of(self, i: int) -> list[PolyElement]:
        return self.symbols[5 * i : 5 * i + 5]

    def _values(self, q: np.ndarray) -> np.ndarray:
        ratios = np.array([0.0 if r is None else r.ratio for r in self.arm.rotors])
        return np.column_stack([q, np.sin(q), np.cos(q), np.sin(ratios * q), np.cos(ratios * q)]).ravel()

    def _constant(self, matrix: np.ndarray) -> np.ndarray:
        return np.vectorize(lambda value: self.ring(float(value)), otypes=[object])(matrix)

    def _displacement(self, screw: np.ndarray, x: PolyElement, s: PolyElement, c: PolyElement) -> np.ndarray:
        """The exponential of a unit screw, by Rodrigues' formula."""
        w, v = screw[:3], screw[3:]
        result = self._constant(np.eye(4))
        if not w.any():
            result[:3, 3] = self._constant(v) * x
            return result
        hat = self._constant(np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]]))
        result[:3, :3] = result[:3, :3] + hat * s + hat @ hat * (1 - c)
        # The term in the angle itself is all along the axis: (I + [w]^2) v = w (w . v).
        along = self._constant(w * (w @ v)) * x
        result[:3, 3] = along + hat @ self._constant(v) * (1 - c) - hat @ hat @ self._constant(v) * s
        return result

    def _add(self, pose: np.ndarray, mass: float, tensor: np.ndarray) -> None:
        moments = np.diag([0.5 * np.trace(tensor)] * 3 + [mass])
        moments[:3, :3] -= tensor
        slope = np.vectorize(self.slope, otypes=[object])
        slopes = [slope(pose, i) for i in range(self.n)]
        weighted = [s @ self._constant(moments) for s in slopes]
        for i in range(self.n):
            for j in range(self.n):
                self.masses[i, j] = self.masses[i, j] + (weighted[i] * slopes[j]).sum()
        self.potential -= (pose[:3, 3] @ self._constant(mass * self.arm.gravity)) if mass else self.ring(0)


class Numbers:
    """A polynomial made quick to evaluate."""

    def __init__(self, value: PolyElement):
        self.powers = np.array(list(value.keys()) or [[0] * value.ring.ngens])
        self.factors = np.array([float(f) for f in value.values()] or [0.0])

    def __call__(self, at: np.ndarray) -> float:
        return float(self.factors @ np.prod(at**self.powers, axis=1))


def lagrange_torques(arm: Arm) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """The generalised torques of an arm as a function of q, qd, qdd."""
    return Lagrangian(arm).torques()
