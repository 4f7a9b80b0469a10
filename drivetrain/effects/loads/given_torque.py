"""A torque given as a function of time, on the link or at the motor's shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Place, Ports
from drivetrain.effects.fields import Side
from drivetrain.effects.laws import flange_of, side_of, table_law
from drivetrain.effects.tables import OverTime, table_value


@dataclass
class Own:
    """Record of the effect: its side, its power [W]. Table rows: time [s], torque [N m]."""

    side: int
    power: float = 0.0


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    flange_of(joint, own.side).torque += table_value(table, t)


@table_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    # The contribution cannot be recovered from the sum of all torques, so it is computed again.
    own.power = table_value(table, t) * flange_of(joint, own.side).speed


@dataclass(frozen=True, eq=False)
class GivenTorque(OverTime):
    """Torque from a table, linear between its instants; two rows at one instant are a step.

    Attributes:
        time: Times of the rows, not decreasing [s], (N,); before the first and after the last the torque is constant.
        torque: Torques at these times [N m], (N,).
        side: ``joint``, ``motor``, or ``shaft``: the gear's output shaft, where motors are coupled.
    """

    torque: Array
    side: Side = "joint"

    follows = "torque"
    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        speed, torque, _ = s.of_side(self.side, place)
        return Ports(needs=(speed,), contributes=(torque,), outputs=(s.source(f"given_{self.side}_power"),))

    def own(self, place: Place) -> Own:
        return Own(side_of(self.side, place))

    def breakpoints(self) -> Sequence[float]:
        return [float(t) for t in np.unique(self.time)]
