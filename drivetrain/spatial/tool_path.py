"""Paths of a tool: lines and circular arcs with rounded corners, with exact derivatives over the distance.

The orientation changes at a constant rate over the distance along a line or an arc. Around a corner that is rounded by
r, the remaining distance on the first piece decreases as ``r (2 v^3 - v^4)`` while the distance on the second one
grows as ``r (2 u^3 - u^4)``, with u from 0 to 1 and v = 1 - u. Direction and curvature are continuous, and the
derivative of the position over the distance is at most 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import atan2, hypot, pi, tau
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.rotations import log_rotation, quaternion

SMALLEST_LENGTH = 1e-9  # [m] or [rad] smallest length of a piece
STRAIGHT = 1e-9  # sine of the angle below which three points are collinear


class PathSamples(NamedTuple):
    """Poses along a path, and their first and second derivatives over the distance, in base axes.

    First derivatives are (angular [rad/m], linear [-]), in the convention of ``tip_jacobian``; second derivatives are
    per metre of that.
    """

    poses: Array  # (N, 4, 4), translation [m]
    first: Array  # (N, 6)
    second: Array  # (N, 6)


@dataclass(frozen=True, eq=False)
class Piece:
    """A line or an arc from pose to pose."""

    # poses [m], (4, 4)
    start: Array
    end: Array
    via: Array | None = None  # a point of the arc [m], (3,); None: a line

    @cached_property
    def _arc(self) -> tuple[Array, Array, Array, float]:
        """Centre, radius vector to the start, radius vector a quarter of a turn later, and angle of the arc [rad]."""
        a, b, c = self.start[:3, 3], np.asarray(self.via), self.end[:3, 3]
        ab, ac = b - a, c - a
        normal = np.cross(ab, ac)
        square = float(normal @ normal)
        if square <= (STRAIGHT * hypot(*ab) * hypot(*ac)) ** 2:
            raise InputError(Fault("via", "start, via and end of a circle must be three points that no line holds"))
        centre = a + (np.cross(normal, ab) * (ac @ ac) + np.cross(ac, normal) * (ab @ ab)) / (2.0 * square)
        along = a - centre
        across = np.cross(normal, along) / square**0.5
        angle = atan2(float((c - centre) @ across), float((c - centre) @ along)) % tau
        return centre, along, across, angle

    @cached_property
    def _turn(self) -> Array:
        """Rotation from start to end, axis times angle in the axes of the start [rad], (3,)."""
        return log_rotation(self.start[:3, :3].T @ self.end[:3, :3])

    @cached_property
    def length(self) -> float:
        """Length of the piece [m]; of a pure rotation the angle [rad]."""
        if self.via is not None:
            _, along, _, angle = self._arc
            return hypot(*along) * angle
        way = hypot(*(self.end[:3, 3] - self.start[:3, 3]))
        return way if way > SMALLEST_LENGTH else hypot(*self._turn)

    def places(self, s: Array) -> tuple[Array, Array, Array]:
        """Points at distances from the start, also beyond the ends, and their derivatives, (N, 3) each [m, -, 1/m]."""
        if self.via is None:
            way = (self.end[:3, 3] - self.start[:3, 3]) / self.length
            return self.start[:3, 3] + s[:, None] * way, np.tile(way, (len(s), 1)), np.zeros((len(s), 3))
        centre, along, across, _ = self._arc
        radius = hypot(*along)
        cos, sin = np.cos(s / radius)[:, None], np.sin(s / radius)[:, None]
        out = cos * along + sin * across
        return centre + out, (cos * across - sin * along) / radius, -out / radius**2

    def quaternions(self, s: Array) -> tuple[Array, Array, Array]:
        """Orientations at distances ``s`` as quaternions, real part first, and their derivatives, (N, 4) each."""
        rate = self._turn / (2.0 * self.length)
        size = hypot(*rate)
        real, imaginary = quaternion(self.start[:3, :3])
        begin = np.array([real, *imaginary])
        turning = product(begin, np.array([0.0, *rate]))
        share = s * np.sinc(size * s / pi)  # sin(size s) / size
        value = np.cos(size * s)[:, None] * begin + share[:, None] * turning
        slope = np.cos(size * s)[:, None] * turning - size**2 * share[:, None] * begin
        return value, slope, -(size**2) * value


@dataclass(frozen=True, eq=False)
class ToolPath:
    """Consecutive pieces, followed without a stop."""

    pieces: tuple[Piece, ...]  # each starts at the end of the previous one
    # distance from each corner to the start and the end of its rounding [m], one fewer than pieces
    blends: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for k, (blend, *neighbours) in enumerate(zip(self.blends, self.pieces, self.pieces[1:], strict=False)):
            before = self.blends[k - 1] if k else 0.0
            available = min(neighbours[0].length - before, neighbours[1].length)
            turns_only = any(
                np.allclose(piece.start[:3, 3], piece.end[:3, 3], atol=SMALLEST_LENGTH) for piece in neighbours
            )
            if turns_only:
                problem = f"corner {k + 1} cannot be rounded: one of its moves only turns the tool"
                raise InputError(Fault("blend", problem, f"{1e3 * blend:.4g} mm"))
            if not 0.0 < blend < available:
                problem = (
                    f"the moves at corner {k + 1} leave {1e3 * available:.4g} mm for its rounding, which must be less"
                )
                raise InputError(Fault("blend", problem, f"{1e3 * blend:.4g} mm"))

    @cached_property
    def _ends(self) -> Array:
        return np.cumsum([piece.length for piece in self.pieces])

    @property
    def length(self) -> float:
        """Length of the path without rounding [m]."""
        return float(self._ends[-1])

    def at(self, s: Array) -> PathSamples:
        """Poses at distances [m] from the start, (N,)."""
        place, u = (np.empty((3, len(s), width)) for width in (3, 4))
        which = np.minimum(np.searchsorted(self._ends, s, side="right"), len(self.pieces) - 1)
        for k, (piece, end) in enumerate(zip(self.pieces, self._ends, strict=True)):
            on = which == k
            since = s[on] - (end - piece.length)
            place[:, on], u[:, on] = piece.places(since), piece.quaternions(since)
        for blend, first, then, corner in zip(self.blends, self.pieces, self.pieces[1:], self._ends, strict=False):
            on = np.abs(s - corner) < blend
            done, left = _blend_distances(0.5 * (1.0 + (s[on] - corner) / blend), blend)
            until = first.length - left[0]
            place[:, on] = _chain_rule(first.places(until), -left) + _chain_rule(then.places(done[0]), done)
            place[0, on] -= then.start[:3, 3]
            real, imaginary = quaternion(then.start[:3, :3])
            a, da, dda = _chain_rule(first.quaternions(until), -left)
            b, db, ddb = product(np.array([real, *-imaginary]), _chain_rule(then.quaternions(done[0]), done))
            u[0, on], u[1, on] = product(a, b), product(da, b) + product(a, db)
            u[2, on] = product(dda, b) + 2.0 * product(da, db) + product(a, ddb)
        conjugate = u[0] * [1.0, -1.0, -1.0, -1.0]
        spin, slope = 2.0 * product(conjugate, u[1])[:, 1:], 2.0 * product(conjugate, u[2])[:, 1:]
        rotation = rotations(u[0])
        poses = np.zeros((len(s), 4, 4))
        poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = rotation, place[0], 1.0
        angular = [(rotation @ own[:, :, None])[:, :, 0] for own in (spin, slope)]
        return PathSamples(poses, np.hstack([angular[0], place[1]]), np.hstack([angular[1], place[2]]))


def _blend_distances(u: Array, blend: float) -> tuple[Array, Array]:
    """Distances on the piece after a corner and left on that before it, with two derivatives, (3, N) each."""

    def distance(u: Array) -> Array:
        return np.array([blend * u**3 * (2.0 - u), u**2 * (3.0 - 2.0 * u), 3.0 * u * (1.0 - u) / blend])

    return distance(u), distance(1.0 - u) * [[1.0], [-1.0], [1.0]]


def _chain_rule(outer: tuple[Array, Array, Array], inner: Array) -> Array:
    """Values and two derivatives of a composite function by the chain rule, (3, N, width)."""
    (value, slope, second), (_, d, dd) = outer, inner[:, :, None]
    return np.array([value, slope * d, second * d**2 + slope * dd])


def product(a: Array, b: Array) -> Array:
    """Products of quaternions, real part first, (..., 4)."""
    real = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    rest = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([real, rest], axis=-1)


def rotations(unit_quaternions: Array) -> Array:
    """Rotation matrices of unit quaternions, real part first, (N, 4) to (N, 3, 3)."""
    w, x, y, z = np.moveaxis(unit_quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
