"""What spins behind the gear: as a body on its carrier, or only as inertia reflected to the joint."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.effects.effect import NOTHING, Effect, Place, Ports, Shape
from drivetrain.errors import Fault, InputError


@dataclass(frozen=True)
class FullRotor(Effect):
    """A rotor as a body: it turns with its carrier too, and couples its joint with those before it.

    Attributes:
        inertia: About the motor's axis, gear input included [kg m^2].
        ratio: Motor angle over joint coordinate [- or rad/m].
    """

    inertia: float
    ratio: float = 1.0

    def __post_init__(self) -> None:
        _check(self.inertia, self.ratio)

    def ports(self, place: Place) -> Ports:
        return NOTHING

    def shape(self, place: Place) -> Shape:
        return Shape(self.ratio, self.inertia, full=True)

    def quasi_static(self) -> Effect:
        return ReflectedRotor(self.inertia, self.ratio)


@dataclass(frozen=True)
class ReflectedRotor(Effect):
    """A rotor as ``ratio^2`` times its inertia at its own joint, as simulators take it.

    Attributes:
        inertia: About the motor's axis, gear input included [kg m^2].
        ratio: Motor angle over joint coordinate [- or rad/m].
    """

    inertia: float
    ratio: float = 1.0

    def __post_init__(self) -> None:
        _check(self.inertia, self.ratio)

    def ports(self, place: Place) -> Ports:
        return NOTHING

    def shape(self, place: Place) -> Shape:
        return Shape(self.ratio, self.inertia, full=False)


def _check(inertia: float, ratio: float) -> None:
    faults = []
    if not 0.0 <= inertia < float("inf"):
        faults.append(Fault("rotor.inertia", "must not be negative [kg m^2]", inertia))
    if not 0.0 < abs(ratio) < float("inf"):
        faults.append(Fault("rotor.ratio", "must not be zero", ratio))
    if faults:
        raise InputError(faults)
