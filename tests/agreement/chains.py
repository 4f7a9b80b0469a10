"""Planar chains as arms, and their accelerations in many digits, written out in absolute angles."""

from __future__ import annotations

import mpmath as mp
import numpy as np

from drivetrain.arm.arm import Arm

DIGITS = 50


def chain(lengths: np.ndarray, masses: np.ndarray, gyration: float = 0.3) -> Arm:
    """Rods along x turning about z, centre of mass in the middle of each, gravity along -y."""
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    homes = np.tile(np.eye(4), (len(lengths), 1, 1))
    homes[:, 0, 3] = 0.5 * (ends[1:] + ends[:-1])
    screws = np.zeros((len(lengths), 6))
    screws[:, 2], screws[:, 4] = 1.0, -ends[:-1]
    moments = masses * (gyration * lengths) ** 2
    inertias = np.array([np.diag([0.5 * m, 0.5 * m, m]) for m in moments])
    points = np.zeros((len(lengths), 3))
    points[:, 0] = ends[:-1]
    tip = np.eye(4)
    tip[0, 3] = ends[-1]
    return Arm.from_screws(homes, screws, masses, inertias, tip, (0.0, -9.81, 0.0), joint_points=points)


def exact_accelerations(
    arm: Arm, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, armature: np.ndarray | None = None
) -> np.ndarray:
    """Lagrange's equations of a chain in the absolute angles of its rods, solved with 50 digits.

    With p the absolute angles, rod i turns everything beyond it: the kinetic energy is the sum of
    ``a_ij cos(p_i - p_j) p_i' p_j' / 2``, so
    ``sum_j a_ij cos(p_i - p_j) p_j'' = Q_i - sum_j a_ij sin(p_i - p_j) p_j'^2``.
    """
    with mp.workdps(DIGITS):
        n = arm.n
        ends = [mp.mpf(float(-s[4])) for s in arm.screws] + [mp.mpf(float(arm.tip[0, 3]))]
        length = [ends[i + 1] - ends[i] for i in range(n)]
        centre = [mp.mpf(float(arm.home[i, 0, 3])) - ends[i] for i in range(n)]
        mass = [mp.mpf(float(m)) for m in arm.masses]
        moment = [mp.mpf(float(t[2, 2])) for t in arm.inertias]
        beyond = [sum(mass[i + 1 :], mp.mpf(0)) for i in range(n)]
        lever = [mass[i] * centre[i] + length[i] * beyond[i] for i in range(n)]
        angle, rate = list(np.cumsum([mp.mpf(float(x)) for x in q])), list(np.cumsum([mp.mpf(float(x)) for x in qd]))
        torque = [mp.mpf(float(x)) for x in tau] + [mp.mpf(0)]
        extra = [mp.mpf(0 if armature is None else float(armature[i])) for i in range(n)] + [mp.mpf(0)]
        matrix, right = mp.matrix(n, n), mp.matrix(n, 1)
        for i in range(n):
            right[i] = torque[i] - torque[i + 1] - mp.mpf(9.81) * lever[i] * mp.cos(angle[i])
            for j in range(n):
                if i == j:
                    factor = moment[i] + mass[i] * centre[i] ** 2 + length[i] ** 2 * beyond[i]
                else:
                    factor = length[min(i, j)] * lever[max(i, j)]
                matrix[i, j] = factor * mp.cos(angle[i] - angle[j])
                right[i] -= factor * mp.sin(angle[i] - angle[j]) * rate[j] ** 2
        for i in range(n):  # an armature at joint i feels the difference of two absolute angles
            matrix[i, i] += extra[i] + extra[i + 1]
            if i + 1 < n:
                matrix[i, i + 1] -= extra[i + 1]
                matrix[i + 1, i] -= extra[i + 1]
        absolute = mp.cholesky_solve(matrix, right)
        return np.array([float(absolute[i] - (absolute[i - 1] if i else 0)) for i in range(n)])
