"""A force and a moment on the arm's tip, given over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.laws import scene_law
from drivetrain.effects.tables import kinks, repeated_time, table_value
from drivetrain.errors import Fault, raise_faults

_GIVEN = s.TIP_GIVEN[3:]  # velocity and angular velocity of the tip
_TAKEN = s.TIP_TAKEN[:6]  # force and moment on the tip


@dataclass
class Own:
    """Record of the effect. Table rows: time [s], force [N] and moment [N m] on the tip."""

    period: float  # of a repeated force [s]; 0: not repeated
    last: float  # end of the last repetition [s]
    power: float = 0.0  # power supplied to the arm [W]


@scene_law(Own)
def _compute(t: Any, h: Any, own: Any, scene: Any) -> None:
    tip, now = scene.world.tip, repeated_time(own.period, own.last, t)
    for k in range(3):
        tip.force[k] += table_value(scene.table, now, 1 + k)
        tip.moment[k] += table_value(scene.table, now, 4 + k)


@scene_law(Own)
def _account(t: Any, h: Any, own: Any, scene: Any) -> None:
    # The contribution cannot be recovered from the sum of all forces, so it is computed again.
    tip, now = scene.world.tip, repeated_time(own.period, own.last, t)
    own.power = 0.0
    for k in range(3):
        own.power += table_value(scene.table, now, 1 + k) * tip.speed[k]
        own.power += table_value(scene.table, now, 4 + k) * tip.turning[k]


@dataclass(frozen=True, eq=False)
class TipForce(Effect):
    """Force and moment on the tip from a table, linear between its instants; two rows at one instant are a step.

    Attributes:
        time: Times of the rows, not decreasing [s], (N,); before the first and after the last, both are constant.
        force: Force on the tip, in base axes [N], (N, 3).
        moment: Moment on the tip about its origin, in base axes [N m], (N, 3).
        repetitions: How often the table is run through.
    """

    time: Array
    force: Array
    moment: Array
    repetitions: int = 1

    scope = "scene"
    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        time = checked_array(self.time, (None,), "time")
        object.__setattr__(self, "time", time)
        for name in ("force", "moment"):
            object.__setattr__(self, name, checked_array(getattr(self, name), (len(time), 3), name))
        faults = []
        if not len(time) or (np.diff(time) < 0.0).any():
            faults.append(Fault("time", "must be instants that never decrease [s]", time[:5].tolist()))
        if self.repetitions < 1 or (self.repetitions > 1 and not (len(time) > 1 and time[0] == 0.0 < time[-1])):
            problem = "must be 1, or more with a table from 0 s that takes some time"
            faults.append(Fault("repetitions", problem, self.repetitions))
        raise_faults(faults)

    @property
    def _period(self) -> float:
        return float(self.time[-1]) if self.repetitions > 1 else 0.0

    @property
    def _last(self) -> float:
        return float(self.time[-1]) * self.repetitions

    def ports(self, place: Place) -> Ports:
        return Ports(needs=_GIVEN, contributes=_TAKEN, outputs=(s.source("tip_force_power"),))

    def own(self, place: Place) -> Own:
        return Own(self._period, self._last)

    def table(self, place: Place) -> Array:
        return np.column_stack([self.time, self.force, self.moment])

    def at(self, times: Array) -> Array:
        """Moment [N m] and force [N] on the tip at some times [s], (M, 6)."""
        now = [repeated_time(self._period, self._last, float(t)) for t in times]
        return np.column_stack([np.interp(now, self.time, values) for values in (*self.moment.T, *self.force.T)])

    def _starts(self) -> list[float]:
        return [k * float(self.time[-1]) for k in range(self.repetitions)]

    def breakpoints(self) -> Sequence[float]:
        jumps = self.time[1:][self.time[1:] == self.time[:-1]]
        return [start + float(t) for start in self._starts() for t in (self.time[0], *np.unique(jumps), self.time[-1])]

    def knots(self, tolerance: float) -> Sequence[float]:
        inner = {t for values in (*self.force.T, *self.moment.T) for t in kinks(self.time, values, tolerance)}
        return [start + t for start in self._starts() for t in sorted(inner)]
