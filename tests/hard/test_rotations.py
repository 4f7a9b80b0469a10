"""Rotations and poses next to zero and to half a turn, and a million of them one after another."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
from hard_case import Figure, hard_case

from drivetrain.spatial.poses import exp_pose, log_pose
from drivetrain.spatial.rotations import exp_rotation, log_rotation, nearest_rotation, skew

NEAR_ZERO = 1e-6  # the textbook's
ANGLES = [
    *(10.0**e for e in range(-12, 1)), 0.009999, 0.010001, 2.0, 3.0,
    *(math.pi - 10.0**e for e in range(-12, 0)), math.pi,
]  # fmt: skip
MILLION = 1_000_000


def textbook_exp(vector: np.ndarray) -> np.ndarray:
    """Modern Robotics, equation 3.51, as its code has it."""
    angle = float(np.linalg.norm(vector))
    if angle < NEAR_ZERO:
        return np.eye(3)
    turn = skew(vector) / angle
    return np.eye(3) + math.sin(angle) * turn + (1.0 - math.cos(angle)) * turn @ turn


def textbook_log(rotation: np.ndarray) -> np.ndarray:
    """Modern Robotics, section 3.2.3.3, as its code has it."""
    cosine = (np.trace(rotation) - 1.0) / 2.0
    if cosine >= 1.0:
        return np.zeros(3)
    if cosine <= -1.0:
        for i in (2, 1, 0):
            if abs(1.0 + rotation[i, i]) >= NEAR_ZERO:
                return math.pi * (rotation[:, i] + np.eye(3)[i]) / math.sqrt(2.0 * (1.0 + rotation[i, i]))
    angle = math.acos(cosine)
    skewed = (rotation - rotation.T) * (angle / 2.0 / math.sin(angle))
    return np.array([skewed[2, 1], skewed[0, 2], skewed[1, 0]])


def exact_exp(twist: np.ndarray) -> np.ndarray:
    """The matrix exponential of a twist with 60 digits, rounded once, (4, 4)."""
    with mp.workdps(60):
        matrix = mp.zeros(4, 4)
        x, y, z, a, b, c = (mp.mpf(float(value)) for value in twist)
        rows = [[0, -z, y, a], [z, 0, -x, b], [-y, x, 0, c]]
        for i, row in enumerate(rows):
            for j, value in enumerate(row):
                matrix[i, j] = value
        square = x * x + y * y + z * z
        angle = mp.sqrt(square)
        s, v = (1 - mp.cos(angle)) / square, (angle - mp.sin(angle)) / (square * angle)
        result = mp.eye(4) + matrix + s * matrix**2 + v * matrix**3
        return np.array(result.tolist(), dtype=np.float64)


def twists() -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    found = []
    for angle in ANGLES:
        for axis in [*np.eye(3), *rng.normal(size=(5, 3))]:
            found.append(np.concatenate([angle * axis / np.linalg.norm(axis), rng.uniform(-0.5, 0.5, 3)]))
    return found


def back(found: np.ndarray, vector: np.ndarray) -> float:
    """The error of a logarithm; the other way round, by 2 pi less the angle, is the same rotation."""
    other = vector * (1.0 - 2.0 * math.pi / float(np.linalg.norm(vector)))
    return float(min(np.abs(found - vector).max(), np.abs(found - other).max()))


@hard_case(
    "T31a",
    "Exponential of rotations and poses",
    setup="240 twists with angles from 1e-12 to pi. The reference has 60 digits.",
    naive="the textbook formula, with the identity below 1e-6",
)
def test_exponential() -> list[Figure]:
    ours, poses, naive = 0.0, 0.0, 0.0
    for twist in twists():
        wanted = exact_exp(twist)
        ours = max(ours, float(np.abs(exp_rotation(twist[:3]) - wanted[:3, :3]).max()))
        poses = max(poses, float(np.abs(exp_pose(twist) - wanted).max()))
        naive = max(naive, float(np.abs(textbook_exp(twist[:3]) - wanted[:3, :3]).max()))
    return [
        Figure("error of a rotation", ours, naive, at_most=1e-15),
        Figure("error of a pose", poses, at_most=1e-15),
    ]


@hard_case(
    "T31b",
    "Logarithm of rotations and poses",
    setup="The twists of T31a are recovered from their matrices.",
    naive="arccosine of the trace, as in textbooks",
)
def test_logarithm() -> list[Figure]:
    # The matrix itself is rounded, and a twist of angle pi is told by it to one unit of rounding of pi, 4.4e-16.
    ours, poses, naive = 0.0, 0.0, 0.0
    for twist in twists():
        matrix = exact_exp(twist)
        ours = max(ours, back(log_rotation(matrix[:3, :3]), twist[:3]))
        naive = max(naive, back(textbook_log(matrix[:3, :3]), twist[:3]))
        if np.linalg.norm(twist[:3]) < math.pi - 1e-15:
            poses = max(poses, float(np.abs(log_pose(matrix) - twist).max()))
    return [
        Figure("error of a rotation vector", ours, naive, at_most=1e-15, unit="rad"),
        Figure("error of a twist", poses, at_most=1e-15, unit="rad or m"),
    ]


@hard_case(
    "T32",
    "A million successive rotations",
    setup="1e6 steps of 1 mrad about an oblique axis.",
    naive="products of exact steps, and of 1 + [w] dt over 1e5 steps",
)
def test_a_million_compositions() -> list[Figure]:
    step = 1e-3 * np.array([1.0, -2.0, 2.0]) / 3.0
    exact, first = exp_rotation(step), np.eye(3) + skew(step)
    product, linear, kept = np.eye(3), np.eye(3), np.eye(3)
    for count in range(1, MILLION + 1):
        kept = kept @ exact
        if count % 1000 == 0:
            kept = nearest_rotation(kept)
        if count <= 100_000:  # that is enough for these two
            product, linear = product @ exact, linear @ first
    whole = exp_rotation(MILLION * step)

    def off(rotation: np.ndarray) -> float:
        return float(np.abs(rotation.T @ rotation - np.eye(3)).max())

    return [
        Figure("error of R'R = 1 with projection at intervals", off(kept), off(product), at_most=1e-12),
        Figure("error of R'R = 1 with R computed from the angle", off(whole), off(linear), at_most=1e-12),
    ]
