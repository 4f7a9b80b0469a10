"""A holding brake on the motor's shaft: while engaged it holds up to its static torque and slips with a lower one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import not_negative, positive, ranges
from drivetrain.effects.laws import table_law
from drivetrain.effects.tables import interval_of
from drivetrain.errors import Fault


@dataclass
class Own:
    """Record of the effect; table rows: time [s], 1 if it is engaged from then on, else 0."""

    holding: float  # static torque [N m]
    sliding: float  # torque while slipping [N m]


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    if table[interval_of(table, t), 1] > 0.0:
        motor = joint.motor
        motor.hold_forward += own.holding
        motor.hold_backward += own.holding
        motor.slide_forward += own.sliding
        motor.slide_backward += own.sliding


@dataclass(frozen=True)
class HoldingBrake(Effect):
    """Spring-applied brake: while engaged it adds its holding torque to that of dry friction, and needs no current.

    Attributes:
        holding: Static torque [N m].
        sliding: Torque while it slips [N m]; None: three quarters of ``holding``.
        engages, releases: Times of the commands to engage and to release [s].
        closing, opening: Delays from these commands until it is engaged, or released [s].
        engaged: Whether it is engaged at the start.
    """

    holding: float
    sliding: float | None = None
    engages: tuple[float, ...] = ()
    releases: tuple[float, ...] = ()
    closing: float = 0.0
    opening: float = 0.0
    engaged: bool = False

    limits = ranges(
        holding=positive("N m"), closing=not_negative("s"), opening=not_negative("s"),
        engages=not_negative("s"), releases=not_negative("s"),
    )  # fmt: skip
    compute = _compute

    def faults(self) -> list[Fault]:
        if self.sliding is None or 0.0 <= self.sliding <= self.holding:
            return []
        return [Fault("HoldingBrake.sliding", "must be from 0 to the holding torque [N m]", self.sliding)]

    def ports(self, place: Place) -> Ports:
        return Ports(contributes=s.MOTOR_BOUNDS)

    def own(self, place: Place) -> Own:
        return Own(self.holding, 0.75 * self.holding if self.sliding is None else self.sliding)

    def table(self, place: Place) -> Array:
        return np.array(self._changes())

    @property
    def engaged_at_start(self) -> bool:
        """Whether it is engaged at 0 s."""
        return next(state for time, state in reversed(self._changes()) if time <= 0.0) > 0.0

    def breakpoints(self) -> Sequence[float]:
        return [t for t, _ in self._changes() if t > 0.0]

    def _changes(self) -> list[tuple[float, float]]:
        """Times of all changes [s], each with 1 if it is engaged from then on, else 0; the start first.

        A command revokes an opposite one before it whose delay is not over. Of two at one instant, engaging counts.
        """
        closes = [(t, 1.0, self.closing) for t in self.engages]
        opens = [(t, 0.0, self.opening) for t in self.releases]
        changes = [(0.0, float(self.engaged))]
        for t, closed, delay in sorted(closes + opens):
            changes = [one for one in changes if one[0] <= t or one[1] == closed]
            changes = sorted([*changes, (t + delay, closed)], key=lambda one: one[0])
        return changes
