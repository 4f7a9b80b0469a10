"""The rotor: as a rigid body on its carrier, or only as an inertia reflected to the joint."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.effects.effect import NOTHING, Effect, Place, Ports, Shape
from drivetrain.effects.fields import not_negative, ranges
from drivetrain.errors import Fault


@dataclass(frozen=True)
class FullRotor(Effect):
    """Rotor as a rigid body: it also moves with its carrier, and couples its joint with those before it.

    Attributes:
        inertia: Inertia about the motor's axis, gear input included [kg m^2].
        ratio: Motor angle over joint coordinate [- or rad/m].
    """

    inertia: float
    ratio: float = 1.0

    limits = ranges(inertia=not_negative("kg m^2"))

    def faults(self) -> list[Fault]:
        if 0.0 < abs(self.ratio) < float("inf"):
            return []
        return [Fault(f"{type(self).__name__}.ratio", "must not be zero", self.ratio)]

    def ports(self, place: Place) -> Ports:
        return NOTHING

    def shape(self, place: Place) -> Shape:
        return Shape(self.ratio, self.inertia, full=True)

    def quasi_static(self) -> Effect | None:
        return ReflectedRotor(self.inertia, self.ratio)


@dataclass(frozen=True)
class ReflectedRotor(FullRotor):
    """Rotor as ``ratio^2`` times its inertia at its own joint, the usual simplification of simulators."""

    def shape(self, place: Place) -> Shape:
        return Shape(self.ratio, self.inertia, full=False)

    def quasi_static(self) -> Effect | None:
        return None
