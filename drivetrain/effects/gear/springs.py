"""A flexible joint: the gear's piecewise linear spring with damping, with or without backlash, and the rotor behind it.

The wind-up is a state of its own, so that it is never computed as the difference of two large angles.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.gear import Gear, sprung_stages
from drivetrain.drive.spring import Spring, answer, gear_spring, mean_touch, touch, twist_under
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Shape, Signal, ratio_of
from drivetrain.effects.fields import not_negative, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class SpringOwn:
    """Record of the effect: the spring, its damping [N m s/rad]; elastic energy [J], power lost [W]."""

    spring: Spring
    damping: float
    energy: float = 0.0
    power: float = 0.0


@joint_law(SpringOwn)
def _spring_torque(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Contribute torque, damping and stiffness of the spring; with several pieces they are means over the step."""
    gear = joint.spring
    if h > 0.0 and own.spring.bend_1 < math.inf:
        torque, slope, damping = mean_touch(own.spring, (0.0, 0.0), own.damping, gear.wind_up, gear.speed, h)
    else:
        torque, slope, _ = answer(own.spring, gear.wind_up)
        torque, damping = torque + own.damping * gear.speed, own.damping
    gear.torque += torque
    gear.damping += damping
    gear.stiffness += slope


@joint_law(SpringOwn)
def _account_elastic(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Elastic energy and damping loss of the spring."""
    gear = joint.spring
    _, _, own.energy = answer(own.spring, gear.wind_up)
    own.power = own.damping * gear.speed * gear.speed


@dataclass
class PlayOwn:
    """Record of the effect."""

    spring: Spring
    damping: float  # of a tooth flank in contact [N m s/rad]
    half: float  # half of the backlash [rad]
    energy: float = 0.0  # elastic energy [J]
    power: float = 0.0  # power lost [W]
    torque: float = 0.0  # torque transmitted by the flanks [N m]


@law
def _flank_torque(own: Any, gear: Any, h: float, damping: float) -> tuple[float, float, float]:
    """Torque [N m], stiffness [N m/rad] and damping [N m s/rad] of the flanks: at an instant, or means over a step."""
    flanks = -own.half, own.half
    if h > 0.0:
        return mean_touch(own.spring, flanks, damping, gear.wind_up, gear.speed, h)
    return touch(own.spring, flanks, damping, gear.wind_up, gear.speed)


@joint_law(PlayOwn)
def _flanks(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Contribute torque, damping and stiffness of the tooth flanks."""
    gear = joint.spring
    torque, slope, damping = _flank_torque(own, gear, h, own.damping)
    gear.torque += torque
    gear.damping += damping
    gear.stiffness += slope


@joint_law(PlayOwn)
def _account_flanks(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Torque, elastic energy and damping loss of the tooth flanks."""
    gear = joint.spring
    own.torque, _, _ = _flank_torque(own, gear, h, own.damping)
    elastic, _, _ = _flank_torque(own, gear, h, 0.0)
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

    def shape(self, place: Place) -> Shape:
        ratio, carried = ratio_of(place, self.gear), sprung_stages(self.gear)
        return Shape(ratio=ratio, flexible=True, deflection=self._wind_up, carried=carried)

    def _wind_up(self, torque: float) -> float:
        """Wind-up under a torque, backlash included [rad]."""
        return float(twist_under(self.spring, torque)) + math.copysign(self.half, torque)


@dataclass(frozen=True)
class FlexibleJoint(GearSpring):
    """Torsional spring of the gear between rotor and link."""

    compute = _spring_torque
    account = _account_elastic

    @property
    def half(self) -> float:
        return 0.0

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(s.DEFLECTION, s.DEFLECTION_SPEED),
            contributes=(s.GEAR_TORQUE, s.GEAR_DAMPING, s.GEAR_STIFFNESS),
            outputs=(s.store("spring_energy"), s.loss("spring_damping_power")),
        )

    def piecewise(self) -> bool:
        return self.spring.bend_1 < math.inf


@dataclass(frozen=True)
class Backlash(GearSpring):
    """Gear spring with backlash: it transmits no torque between the tooth flanks, and never pulls at a flank.

    Used instead of ``FlexibleJoint``; with a backlash of zero both are the same.
    """

    compute = _flanks
    account = _account_flanks

    def faults(self) -> list[Fault]:
        if self.gear.backlash is not None:
            return []
        hint = "state one, or take FlexibleJoint"
        return [Fault("Backlash.gear", "has no backlash in its catalogue row [rad]", self.gear.key, hint)]

    @property
    def half(self) -> float:
        return 0.5 * (self.gear.backlash or 0.0)

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(s.DEFLECTION, s.DEFLECTION_SPEED),
            contributes=(s.GEAR_TORQUE, s.GEAR_DAMPING, s.GEAR_STIFFNESS),
            outputs=(
                s.store("flank_energy"),
                s.loss("flank_damping_power"),
                Signal("flank_torque", "N m", path="torque"),
            ),
        )

    def piecewise(self) -> bool:
        return True
