"""The tip against a wall: a spring and a damper across it, which push and never pull."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import checked_array
from drivetrain.drive.spring_kernel import mean_touch, touch
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, Signal
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

_GIVEN = s.TIP_GIVEN[:6]  # place and speed
_TAKEN = (*s.TIP_TAKEN[:3], *s.TIP_TAKEN[6:])  # force, and how it falls with speed and place


@law
def _met(numbers: Any, at: int, deep: float, into: float, h: float, damp: float) -> tuple[float, float, float]:
    """Force, slope and damping of the wall, at an instant or in the mean over a step."""
    pieces, flanks = (numbers[at + 3], numbers[at + 3], numbers[at + 3], math.inf, math.inf), (-math.inf, 0.0)
    if h > 0.0:
        return mean_touch(pieces, flanks, damp, deep, into, h)
    return touch(pieces, flanks, damp, deep, into)


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        deep, into = numbers[at + 5], 0.0
        for i in range(3):
            deep -= numbers[at + i] * signals[words[row + 1 + i]]
            into -= numbers[at + i] * signals[words[row + 4 + i]]
        force, stiff, damp = _met(numbers, at, deep, into, h, numbers[at + 4])
        if stiff == 0.0:
            continue
        entry = 0
        for i in range(3):
            signals[words[row + 7 + i]] += force * numbers[at + i]
            for j in range(i, 3):
                across = numbers[at + i] * numbers[at + j]
                signals[words[row + 10 + entry]] += damp * across
                signals[words[row + 16 + entry]] += stiff * across
                entry += 1


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        deep, into = numbers[at + 5], 0.0
        for i in range(3):
            deep -= numbers[at + i] * signals[words[row + 1 + i]]
            into -= numbers[at + i] * signals[words[row + 4 + i]]
        force, _, _ = _met(numbers, at, deep, into, h, numbers[at + 4])
        spring, _, _ = _met(numbers, at, deep, into, h, 0.0)
        signals[words[row + 22]] = force
        signals[words[row + 23]] = (force - spring) * into
        signals[words[row + 24]] = 0.5 * numbers[at + 3] * max(deep, 0.0) ** 2


@dataclass(frozen=True)
class TipContact(Effect):
    """A flat wall without friction; the arm's tip is the point that touches it.

    Attributes:
        point: Of the wall, base axes [m].
        normal: Out of the wall, towards where the tip may be.
        stiffness: [N/m].
        damping: [N s/m]; the force is cut off where it would pull.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    stiffness: float
    damping: float = 0.0

    scope = "scene"
    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults: list[Fault] = []
        for name in ("point", "normal"):
            try:
                checked_array(getattr(self, name), (3,), f"TipContact.{name}")
            except InputError as error:
                faults.extend(error.faults)
        if not faults and not np.linalg.norm(self.normal) > 0.0:
            faults.append(Fault("TipContact.normal", "must point somewhere", self.normal))
        if not 0.0 < self.stiffness < math.inf:
            faults.append(Fault("TipContact.stiffness", "must be positive [N/m]", self.stiffness))
        if not 0.0 <= self.damping < math.inf:
            faults.append(Fault("TipContact.damping", "must not be negative [N s/m]", self.damping))
        if faults:
            raise InputError(faults)

    def piecewise(self) -> bool:
        return True

    def ports(self, place: Place) -> Ports:
        loss, energy = Signal("contact_power", "W"), Signal("contact_spring_energy", "J")
        return Ports(
            needs=_GIVEN,
            contributes=_TAKEN,
            outputs=(Signal("contact_force", "N"), loss, energy),
            powers={loss.name: Role.LOSS},
            stores=(energy.name,),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        normal = np.asarray(self.normal, dtype=np.float64) / np.linalg.norm(self.normal)
        return *normal, self.stiffness, self.damping, float(normal @ np.asarray(self.point))
