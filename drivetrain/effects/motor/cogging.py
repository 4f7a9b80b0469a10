"""Cogging torque of the magnets against the teeth, which depends on the motor's angle only."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import Range
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import finite, ranges
from drivetrain.effects.laws import table_law
from drivetrain.errors import Fault


@dataclass
class Own:
    """Record of the effect: its energy [J]. One table row per harmonic: amplitude [N m], order, phase [rad]."""

    energy: float = 0.0


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    motor = joint.motor
    for k in range(len(table)):
        size, order, phase = table[k, 0], table[k, 1], table[k, 2]
        # Mean of the sine over the rotation within the step; it vanishes if many teeth are passed.
        half = 0.5 * h * order * motor.speed
        mean = math.sin(half) / half if abs(half) > 1e-4 else 1.0 - half * half / 6.0
        angle = order * motor.position + phase
        motor.torque -= size * mean * math.sin(angle)
        pull = size * mean * order * math.cos(angle)
        if pull > 0.0:
            motor.stiffness += pull


@table_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    own.energy = 0.0
    for k in range(len(table)):
        size, order, phase = table[k, 0], table[k, 1], table[k, 2]
        own.energy += size / order * (1.0 - math.cos(order * joint.motor.position + phase))


@dataclass(frozen=True)
class Cogging(Effect):
    """Cogging torque ``-a sin(k angle + phase)`` for each harmonic; it does no work over a whole turn.

    Attributes:
        amplitudes: Amplitudes of the harmonics [N m].
        orders: Periods per turn: the least common multiple of teeth and poles, and multiples of it.
        phases: Phases of the harmonics [rad]; empty: all zero.
    """

    amplitudes: tuple[float, ...]
    orders: tuple[int, ...]
    phases: tuple[float, ...] = ()

    limits = ranges(
        amplitudes=finite("N m"), orders=Range("must be whole numbers from 1", low=1.0, low_included=True),
        phases=finite("rad"),
    )  # fmt: skip
    compute = _compute
    account = _account

    def faults(self) -> list[Fault]:
        count = len(self.amplitudes)
        if not count or len(self.orders) != count or len(self.phases) not in (0, count):
            return [Fault("Cogging", "needs as many orders (and phases) as amplitudes", self.orders)]
        return []

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_STIFFNESS),
            outputs=(s.store("cogging_energy"),),
        )

    def table(self, place: Place) -> Array:
        return np.array([self.amplitudes, self.orders, self.phases or (0.0,) * len(self.orders)], dtype=np.float64).T
