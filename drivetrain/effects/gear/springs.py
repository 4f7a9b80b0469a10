"""A flexible joint: the gear's piecewise linear spring with damping, with or without backlash, and the rotor behind it.

The wind-up is a state of its own, so that it is never computed as the difference of two large angles.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from drivetrain.drive.gear import Gear, sprung_stages
from drivetrain.drive.spring import Spring, answer, gear_spring, mean_touch, touch, twist_under
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Shape, Signal, ratio_of
from drivetrain.effects.fields import not_negative, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class Own:
    spring: Spring
    half: float  # half of the backlash; 0: the spring is never out of contact [rad]
    damping: float  # of the spring, or of a tooth flank in contact [N m s/rad]
    energy: float = 0.0  # elastic energy [J]
    power: float = 0.0  # power lost [W]
    torque: float = 0.0  # torque transmitted by the flanks [N m]


@law
def _transmitted(own: Any, gear: Any, h: float, damping: float) -> tuple[float, float, float]:
    """Torque [N m], stiffness [N m/rad] and damping [N m s/rad] at an instant, or means over a step ``h``."""
    flanks = -own.half, own.half
    if h > 0.0 and (own.half > 0.0 or own.spring.bend_1 < math.inf):
        return mean_touch(own.spring, flanks, damping, gear.wind_up, gear.speed, h)
    return touch(own.spring, flanks, damping, gear.wind_up, gear.speed)


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    gear = joint.spring
    torque, slope, damping = _transmitted(own, gear, h, own.damping)
    gear.torque += torque
    gear.damping += damping
    gear.stiffness += slope


@joint_law(Own)
def _account_elastic(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Elastic energy and damping loss of a spring without backlash."""
    gear = joint.spring
    _, _, own.energy = answer(own.spring, gear.wind_up)
    own.power = own.damping * gear.speed * gear.speed


@joint_law(Own)
def _account_flanks(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Torque, elastic energy and damping loss of the tooth flanks."""
    gear = joint.spring
    own.torque, _, _ = _transmitted(own, gear, h, own.damping)
    elastic, _, _ = _transmitted(own, gear, h, 0.0)
    penetration = max(abs(gear.wind_up) - own.half, 0.0)
    _, _, own.energy = answer(own.spring, penetration)
    own.power = (own.torque - elastic) * gear.speed


@dataclass(frozen=True)
class GearSpring(Effect):
    """Base of the flexible joints: the rotor is a coordinate of its own, behind the gear's spring.

    Attributes:
        gear: Data of the gear, of which the stiffnesses and their torque limits are used, and the backlash. Of stages
            behind it, whose inertia the rotor's includes, it takes what the spring carries to the link.
        damping: Damping of the spring, or of the tooth flanks in contact [N m s/rad].
    """

    gear: Gear
    damping: float = 0.0

    limits = ranges(damping=not_negative("N m s/rad"))
    outputs: ClassVar[tuple[Signal, ...]]
    compute = _compute

    def __post_init__(self) -> None:
        gear_spring(self.gear)  # raises if the stiffness is unknown

    @property
    def spring(self) -> Spring:
        """The piecewise linear spring of the gear, with three stiffnesses."""
        return gear_spring(self.gear)

    @property
    @abstractmethod
    def half(self) -> float:
        """Half of the backlash [rad]."""

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(s.DEFLECTION, s.DEFLECTION_SPEED),
            contributes=(s.GEAR_TORQUE, s.GEAR_DAMPING, s.GEAR_STIFFNESS),
            outputs=self.outputs,
        )

    def piecewise(self) -> bool:
        return self.half > 0.0 or self.spring.bend_1 < math.inf

    def shape(self, place: Place) -> Shape:
        ratio, carried = ratio_of(place, self.gear), sprung_stages(self.gear)
        return Shape(ratio=ratio, flexible=True, deflection=self._wind_up, carried=carried)

    def _wind_up(self, torque: float) -> float:
        """Wind-up under a torque, backlash included [rad]."""
        return float(twist_under(self.spring, torque)) + math.copysign(self.half, torque)


@dataclass(frozen=True)
class FlexibleJoint(GearSpring):
    """Torsional spring of the gear between rotor and link."""

    account = _account_elastic
    outputs = (s.store("spring_energy"), s.loss("spring_damping_power"))

    @property
    def half(self) -> float:
        return 0.0


@dataclass(frozen=True)
class Backlash(GearSpring):
    """Gear spring with backlash: it transmits no torque between the tooth flanks, and never pulls at a flank.

    Used instead of ``FlexibleJoint``; with a backlash of zero both are the same.
    """

    account = _account_flanks
    outputs = (
        s.store("flank_energy"),
        s.loss("flank_damping_power"),
        Signal("flank_torque", "N m", path="torque"),
    )

    def faults(self) -> list[Fault]:
        if self.gear.backlash is not None:
            return []
        hint = "state one, or take FlexibleJoint"
        return [Fault("Backlash.gear", "has no backlash in its catalogue row [rad]", self.gear.key, hint)]

    @property
    def half(self) -> float:
        return 0.5 * (self.gear.backlash or 0.0)
