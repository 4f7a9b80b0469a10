"""Torques that depend only on a joint's angle: springs and gas springs on levers, weights, bias torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import FINITE, NOT_NEGATIVE, POSITIVE, Range, range_faults
from drivetrain.errors import Fault, raise_faults
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
    """A torque on the link of a revolute joint that depends on the joint's angle only, so its energy over a cycle is
    zero.

    A spring, a gas spring or both act between a point of the link before the joint and a point of the link behind it.
    ``torque`` is constant (a bias, a weight on a drum); ``torques`` depend on the angle (cables and hoses).

    Attributes:
        stiffness: Stiffness of the spring [N/m].
        free_length: Length of the unloaded spring [m]; below it the spring pushes.
        gas_force: Force of an extended gas spring [N].
        extended_length: Length of the extended gas spring [m].
        stroke: Stroke of the gas spring [m].
        progression: Force of the compressed gas spring over that of the extended one [-].
        exponent: Polytropic exponent of the gas: 1 for slow, isothermal motion, 1.4 for fast, adiabatic motion [-].
        lever_carrier, lever_link: Distances of the two points from the joint's axis, across it [m].
        dead_centre: Joint angle at which both points lie on one line with the axis, on the same side of it [rad].
        torque: Constant torque on the link, positive along the axis [N m].
        angles: Joint angles of ``torques``, rising [rad].
        torques: Torques on the link at these angles [N m], linear between them and constant beyond their ends.
        mass: Mass of the device, which counts as a point mass [kg].
        moves: Whether the point mass moves with the link behind the joint.
        com: Position of the point mass relative to the joint, in base axes with all joints at zero [m].
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
        raise_faults(faults)


@law
def span_length(balance: Any, angle: Any) -> Any:
    """Distance between the two points of a spring, sqrt(a^2 + b^2 - 2 a b cos(q - q0)) [m]."""
    a, b = balance.lever_carrier, balance.lever_link
    return np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(angle - balance.dead_centre))


@law
def gas_spring_force(balance: Any, length: Any) -> Any:
    """Force of a gas spring, F1 (V1 / V)^n [N]; the volume decreases by the rod's cross-section times the travel s.

    Gas law p V^n = constant, with the pressure acting on the rod's cross-section; atmospheric pressure and friction are
    neglected. With V2/V1 = x^(-1/n) at full stroke: F1 (1 - s/stroke (1 - x^(-1/n)))^(-n).
    """
    travel = (balance.extended_length - length) / balance.stroke
    return balance.gas_force * (1.0 - travel * (1.0 - balance.progression ** (-1.0 / balance.exponent))) ** (
        -balance.exponent
    )


def out_of_stroke(balance: Counterbalance, angle: Array) -> Array:
    """Whether a gas spring would be longer than extended or shorter than compressed at an angle [rad], same shape."""
    length = span_length(balance, angle)
    beyond = (length > balance.extended_length) | (length < balance.extended_length - balance.stroke)
    return np.asarray(beyond & (balance.gas_force > 0.0))


@law
def lever_torque(balance: Any, angle: Any) -> Any:
    """Torque of springs on levers and of the constant torque, on the link, positive along the axis [N m].

    The spring force times a b sin(q - q0) / l, the change of its length per radian.
    """
    torque = balance.torque + 0.0 * angle
    if balance.lever_carrier * balance.lever_link > 0.0:
        length = span_length(balance, angle)
        pull = balance.stiffness * (length - balance.free_length) - gas_spring_force(balance, length)
        arm = balance.lever_carrier * balance.lever_link * np.sin(angle - balance.dead_centre) / length
        torque = torque - pull * arm
    return torque


def counterbalance_torque(balances: Sequence[Counterbalance], angle: Array) -> Array:
    """Torque of counterbalances on the link behind a joint.

    Args:
        balances: All counterbalances of the joint.
        angle: Angle of the joint [rad], any shape.

    Returns:
        Torque, positive along the joint's axis [N m], the shape of ``angle``.
    """
    torque = np.zeros(np.shape(angle))
    for one in balances:
        torque = torque + lever_torque(one, np.asarray(angle))
        if one.angles:
            torque = torque + np.interp(angle, one.angles, one.torques)
    return torque
