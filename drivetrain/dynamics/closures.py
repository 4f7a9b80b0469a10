"""Loops closed: two frames, on links or on the base, held together as by a joint."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.constraints import Attachment, Constraint, Rows
from drivetrain.dynamics.frame_kernels import ACROSS, ALONG, compiled_closure
from drivetrain.errors import Fault, InputError

_X, _Y, _Z = ((ALONG, k, 0) for k in range(3))
_TILTS = ((ACROSS, 0, 2), (ACROSS, 1, 2))  # the z axis of a at right angles to x and y of b
_TURN = (ACROSS, 0, 1)  # its y axis at right angles to x of b: with the tilts, no turn at all


class ClosingJoint(Enum):
    """How two frames are held together, in the axes of the second; the joint's own freedom is left.

    WELD: nothing moves. HINGE: turns about the common z axis. SLIDER: slides along it. CYLINDER: both. BALL: turns any
    way about the common origin. PLANE: slides in the x-y plane and turns about z.
    """

    WELD = (_X, _Y, _Z, *_TILTS, _TURN)
    HINGE = (_X, _Y, _Z, *_TILTS)
    SLIDER = (_X, _Y, *_TILTS, _TURN)
    CYLINDER = (_X, _Y, *_TILTS)
    BALL = (_X, _Y, _Z)
    PLANE = (_Z, *_TILTS)


@dataclass(frozen=True, eq=False)
class LoopClosure(Constraint):
    """Two frames held together as by a joint: a loop of links, a handle, a fixture, or, by a WELD, a pose.

    Rows are distances along the axes of the second frame [m], then cosines of angles between axes [-], which near
    closure are the angles themselves [rad]. Their multipliers are forces [N] and moments [N m].

    Attributes:
        first, second: The frames.
        joint: What holds them together.
    """

    first: Attachment
    second: Attachment
    joint: ClosingJoint
    _homes: Array = field(init=False, repr=False)
    _ends: np.ndarray = field(init=False, repr=False)
    _codes: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.first.link == self.second.link:
            raise InputError(Fault("LoopClosure", "must hold frames on two different links", self.first.link))
        object.__setattr__(self, "_homes", np.array([self.first.pose, self.second.pose]))
        object.__setattr__(self, "_ends", np.array([self.first.link, self.second.link], dtype=np.int64))
        object.__setattr__(self, "_codes", np.array(self.joint.value, dtype=np.int64))

    @property
    def count(self) -> int:
        return len(self._codes)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple("N" if code[0] == ALONG else "N m" for code in self.joint.value)

    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        samples, k = len(q), self.count
        rows = Rows(np.empty((samples, k)), np.empty((samples, k, arm.n)), np.empty((samples, k)))
        compiled_closure()(arm.screws, self._homes, self._ends, self._codes, q, qd, *rows)
        return rows
