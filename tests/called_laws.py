"""Laws called in Python on plain objects with the fields of their records: nothing is compiled, nothing integrated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from operator import attrgetter
from typing import Any

import numpy as np

from drivetrain.effects.connectors import Flange, HeatPort, Joint, Mesh, Motion, Pin, Spring, Tip, World
from drivetrain.effects.effect import Effect, Place, Role, Signal
from drivetrain.effects.laws import Whole

PLACE = Place(0, "joint", ("joint",), (-40.0,), (True,), 1)
COUPLED = Place(0, "a", ("a", "b"), (-40.0, 60.0), (True, True), 2, ((1.0, 0.5), (-0.5, 1.0)))


def joint_at(numbers: Mapping[str, float]) -> Joint:
    """Connectors of a joint, zero but for some numbers by their paths."""
    joint = Joint(Flange(), Flange(), Flange(), Spring(), Mesh(), Pin(), HeatPort(), Motion(), Motion())
    for path, value in numbers.items():
        *way, name = path.split(".")
        setattr(attrgetter(".".join(way))(joint) if way else joint, name, value)
    return joint


def world_at(place: Any = (0.0, 0.0, 0.0), speed: Any = (0.0, 0.0, 0.0)) -> World:
    """The record of a scene, its tip at a place [m] with a speed [m/s]."""
    tip = Tip(np.array(place), np.array(speed), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(6), np.zeros(6))
    return World(0, 1, 1, 0.0, 0.0, 0.0, 0, 0, 0, math.inf, tip)


class Called:
    """An effect with its record and what its laws read and write."""

    def __init__(
        self, effect: Effect, numbers: Mapping[str, float], states: Mapping[str, Any] | None = None,
        place: Place = PLACE, world: World | None = None,
    ):  # fmt: skip
        self.effect, self.own, self.joint = effect, effect.own(place), joint_at(numbers)
        self.world, self.table = world or world_at(), effect.table(place)
        for name, value in (states or {}).items():
            setattr(self.own, name, value)

    def __call__(self, law: str, h: float = 0.0, t: float = 0.0) -> Called:
        found: Any = getattr(self.effect, law)
        if self.effect.scope == "scene":
            found(t, h, self.own, Whole([self.joint], self.world, np.eye(1), self.table))
        elif found is not None:
            found(t, h, self.own, self.joint, *([self.table] if self.table.size else []))
        return self

    def value(self, signal: Signal) -> float:
        """Of an output."""
        path = signal.path or signal.name
        return float(attrgetter(path)(self.joint if "." in path else self.own))

    def total(self, *roles: Role) -> float:
        """The sum of all outputs of some roles."""
        return sum(self.value(one) for one in self.effect.ports(PLACE).outputs if one.role in roles)
