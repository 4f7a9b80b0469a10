"""Arms and rotors from seeds, and motions for them: nothing about them is special."""

from __future__ import annotations

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix

EVERY_JOINT = "RPHRRP"  # revolute, prismatic, helical


def unit(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def rotation(rng: np.random.Generator) -> np.ndarray:
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def pose(rng: np.random.Generator, reach: float = 0.4) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = rotation(rng)
    result[:3, 3] = rng.uniform(-reach, reach, 3)
    return result


def tensor(rng: np.random.Generator, size: float) -> np.ndarray:
    """An inertia that a body can have: of six point masses."""
    points = rng.normal(size=(6, 3)) * np.sqrt(size / 6)
    return sum(p @ p * np.eye(3) - np.outer(p, p) for p in points)


def screw(rng: np.random.Generator, kind: str, point: np.ndarray) -> np.ndarray:
    axis = unit(rng)
    if kind == "P":
        return np.concatenate([np.zeros(3), axis])
    pitch = 0.07 if kind == "H" else 0.0
    return np.concatenate([axis, np.cross(point, axis) + pitch * axis])


def random_arm(seed: int, joints: str = "RRRRRR", tilted: bool = True) -> Arm:
    rng = np.random.default_rng([seed, 1])
    n = len(joints)
    points = rng.uniform(-0.5, 0.5, (n, 3))
    return Arm.from_screws(
        home=[pose(rng) for _ in joints],
        screws=[screw(rng, kind, point) for kind, point in zip(joints, points, strict=True)],
        masses=rng.uniform(0.2, 8.0, n),
        inertias=[tensor(rng, 0.05) for _ in joints],
        tip=pose(rng),
        gravity=rng.normal(size=3) * 6.0 if tilted else (0.0, 0.0, -9.81),
        joint_points=points,
    )


def balanced_rotor(rng: np.random.Generator, carrier: int | None) -> Rotor:
    """Axisymmetric, its centre of mass on its own oblique, offset axis."""
    axis, point = unit(rng), rng.uniform(-0.3, 0.3, 3)
    home = np.eye(4)
    across = np.cross(axis, unit(rng))
    across /= np.linalg.norm(across)
    home[:3, :3] = np.column_stack([across, np.cross(axis, across), axis])
    home[:3, 3] = point + 0.1 * axis
    line = np.concatenate([axis, np.cross(point, axis)])
    inertia = np.diag([2e-4, 2e-4, 3e-4])
    return Rotor(float(rng.choice([-1, 1]) * rng.uniform(20, 120)), inertia, 0.6, home, line, carrier)


def unbalanced_rotor(rng: np.random.Generator, carrier: int | None, ratio: float | None = None) -> Rotor:
    """Any tensor, its centre of mass off its own oblique, offset axis."""
    axis, point = unit(rng), rng.uniform(-0.3, 0.3, 3)
    line = np.concatenate([axis, np.cross(point, axis)])
    chosen = float(rng.choice([-1, 1]) * rng.uniform(5, 30)) if ratio is None else ratio
    return Rotor(chosen, tensor(rng, 1e-3), 0.4, pose(rng, 0.2), line, carrier)


def coaxial_rotor(rng: np.random.Generator) -> Rotor:
    """The usual one: on the joint axis, on the link before."""
    return Rotor(float(rng.choice([-1, 1]) * rng.uniform(50, 160)), 2e-4, 0.5)


def rotors_of(seed: int, kind: str, n: int) -> list[Rotor | None]:
    """One rotor a joint: ``coaxial``, ``balanced``, ``unbalanced`` (both on any link), or all kinds ``mixed``."""
    rng = np.random.default_rng([seed, 2])
    carriers = [int(c) for c in rng.integers(-1, n, n)]
    if kind == "coaxial":
        return [coaxial_rotor(rng) for _ in carriers]
    if kind == "balanced":
        return [balanced_rotor(rng, c) for c in carriers]
    if kind == "unbalanced":
        return [unbalanced_rotor(rng, c) for c in carriers]
    makers = [balanced_rotor, unbalanced_rotor, lambda r, _: coaxial_rotor(r), lambda r, _: None]
    return [makers[i % 4](rng, c) for i, c in enumerate(carriers)]


def motion(seed: int, n: int, count: int = 7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng([seed, 3])
    return rng.uniform(-3, 3, (count, n)), rng.uniform(-2, 2, (count, n)), rng.uniform(-5, 5, (count, n))


def error(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference over the largest value, or over 1 where all are smaller (a bias of zero, say)."""
    return float(np.abs(np.asarray(found) - wanted).max() / max(np.abs(wanted).max(), 1.0))


def by_mass_matrix(
    arm: Arm, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, tip_wrench: np.ndarray | None = None
) -> np.ndarray:
    """Accelerations as the textbook has them: M qdd = tau - h, with a general solver."""
    bias = inverse_dynamics(arm, q, qd, np.zeros(q.shape), tip_wrench=tip_wrench)
    return np.linalg.solve(mass_matrix(arm, q), (tau - bias)[..., None])[..., 0]
