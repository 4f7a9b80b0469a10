"""Torques that a joint's angle alone decides: springs and gas springs on levers, weights, biases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import FINITE, NOT_NEGATIVE, POSITIVE, Range, range_faults
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

_RANGES = {
    "stiffness": NOT_NEGATIVE,
    "free_length": NOT_NEGATIVE,
    "gas_force": NOT_NEGATIVE,
    "extended_length": NOT_NEGATIVE,
    "stroke": POSITIVE,
    "progression": Range("must be at least 1", low=1.0, low_included=True),
    "exponent": POSITIVE,
    "lever_carrier": NOT_NEGATIVE,
    "lever_link": NOT_NEGATIVE,
    "dead_centre": FINITE,
    "torque": FINITE,
    "mass": NOT_NEGATIVE,
}


@dataclass(frozen=True)
class Counterbalance:
    """A torque on a turning joint's link that depends on the joint's angle alone: it takes no energy over a cycle.

    A spring, a gas spring or both stretch between a point of the link before the joint and one of the link behind it; a
    ``torque`` stays the same (a bias, a weight on a drum), ``torques`` follow the angle (a bias of cables and hoses).

    Attributes:
        stiffness: Of the spring [N/m].
        free_length: At which it does not pull [m]; shorter it pushes.
        gas_force: With which a gas spring pushes while it is extended [N].
        extended_length: Of the gas spring [m].
        stroke: By which it can be pushed together [m].
        progression: Its force pushed together over that extended [-].
        exponent: Of its gas: 1 while heat has time to leave, 1.4 where it has none [-].
        lever_carrier, lever_link: From the joint's axis to the two points, across it [m].
        dead_centre: Angle of the joint at which both points lie on one side of the axis in line, nearest [rad].
        torque: On the link, positive along the axis [N m].
        angles: Of the joint, rising [rad].
        torques: On the link at these [N m], on straight lines between; beyond the ends they stay.
        mass: That counts as a point [kg].
        moves: Whether that point moves with the link behind the joint.
        com: Where that point is from the joint's, base axes, all joints at zero [m].
    """

    stiffness: float = 0.0
    free_length: float = 0.0
    gas_force: float = 0.0
    extended_length: float = 0.0
    stroke: float = 1.0
    progression: float = 1.0
    exponent: float = 1.0
    lever_carrier: float = 0.0
    lever_link: float = 0.0
    dead_centre: float = 0.0
    torque: float = 0.0
    angles: tuple[float, ...] = ()
    torques: tuple[float, ...] = ()
    mass: float = 0.0
    moves: bool = False
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        faults = range_faults("counterbalance", self, _RANGES, required=tuple(_RANGES))
        pulls = not faults and bool(self.stiffness or self.gas_force)
        if pulls and (not self.lever_carrier * self.lever_link > 0.0 or self.lever_carrier == self.lever_link):
            problem = "needs lever_carrier and lever_link, positive and not the same"
            faults.append(Fault("counterbalance", problem, f"{self.lever_carrier:g} and {self.lever_link:g} m"))
        if not faults and self.gas_force and not 0.0 < self.stroke < self.extended_length:
            problem = "must be shorter than extended_length, which a gas spring needs too"
            faults.append(Fault("counterbalance.stroke", problem, self.stroke))
        table = np.array([self.angles, self.torques]) if len(self.angles) == len(self.torques) else None
        if table is None or not np.isfinite(table).all() or len(self.angles) == 1 or (np.diff(table[0]) <= 0.0).any():
            problem = "must rise, two or more, with as many torques"
            faults.append(Fault("counterbalance.angles", problem, f"{len(self.angles)}, {len(self.torques)} torques"))
        if not faults and not (pulls or self.torque or self.torques or self.mass):
            hint = "one of stiffness, gas_force, torque, torques"
            faults.append(Fault("counterbalance", "says no torque", hint=hint))
        if faults:
            raise InputError(faults)


@law
def span_length(balance: Any, angle: Any) -> Any:
    """Between the two points of a spring [m]: a^2 + b^2 - 2 a b cos(q - q0), its root."""
    a, b = balance.lever_carrier, balance.lever_link
    return np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(angle - balance.dead_centre))


@law
def gas_spring_force(balance: Any, length: Any) -> Any:
    """With which a gas spring pushes, F1 (V1 / V)^n [N]: the volume falls by the rod's section times the way s.

    The gas law p V^n constant, its pressure on the rod's section; the atmosphere and friction left out. With V2/V1 =
    x^(-1/n) at the full stroke: F1 (1 - s/stroke (1 - x^(-1/n)))^(-n).
    """
    way = (balance.extended_length - length) / balance.stroke
    return balance.gas_force * (1.0 - way * (1.0 - balance.progression ** (-1.0 / balance.exponent))) ** (
        -balance.exponent
    )


@law
def lever_torque(balance: Any, angle: Any) -> Any:
    """Of springs on their levers and of the constant torque, on the link, positive along the axis [N m].

    The pull times a b sin(q - q0) / l, by which the length grows a radian.
    """
    torque = balance.torque + 0.0 * angle
    if balance.lever_carrier * balance.lever_link > 0.0:
        length = span_length(balance, angle)
        pull = balance.stiffness * (length - balance.free_length) - gas_spring_force(balance, length)
        arm = balance.lever_carrier * balance.lever_link * np.sin(angle - balance.dead_centre) / length
        torque = torque - pull * arm
    return torque


def counterbalance_torque(balances: Sequence[Counterbalance], angle: Array) -> Array:
    """What counterbalances do to the link behind a joint.

    Args:
        balances: All of the joint.
        angle: Of the joint [rad], any shape.

    Returns:
        Positive along the joint's axis [N m], the shape of ``angle``.
    """
    torque = np.zeros(np.shape(angle))
    for one in balances:
        torque = torque + lever_torque(one, np.asarray(angle))
        if one.angles:
            torque = torque + np.interp(angle, one.angles, one.torques)
    return torque
