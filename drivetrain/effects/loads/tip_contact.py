"""Contact of the tip with a flat wall: a spring and a damper along the normal, which can push but not pull."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.spring import Spring, answer, mean_touch, touch
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Signal
from drivetrain.effects.fields import finite, not_negative, positive, ranges
from drivetrain.effects.laws import scene_law
from drivetrain.errors import Fault
from drivetrain.jit import law

_GIVEN = s.TIP_GIVEN[:6]  # position and velocity of the tip
_TAKEN = (*s.TIP_TAKEN[:3], *s.TIP_TAKEN[6:])  # force on the tip, and its derivatives


@dataclass
class Own:
    normal: Annotated[Array, 3]  # unit vector out of the wall, in the base frame
    spring: Spring  # stiffness in N/m
    damping: float  # [N s/m]
    at: float  # position of the wall along the normal [m]
    force: float = 0.0  # contact force [N]
    power: float = 0.0  # power lost [W]
    energy: float = 0.0  # elastic energy [J]


@law
def _penetration(own: Any, tip: Any) -> tuple[float, float]:
    """Penetration of the tip into the wall [m], and its rate [m/s]."""
    depth, depth_rate = own.at, 0.0
    for i in range(3):
        depth -= own.normal[i] * tip.place[i]
        depth_rate -= own.normal[i] * tip.speed[i]
    return depth, depth_rate


@law
def _contact_force(own: Any, depth: float, depth_rate: float, h: float, damping: float) -> tuple[float, float, float]:
    """Force [N], stiffness [N/m] and damping [N s/m] of the contact: at an instant, or means over a step."""
    flanks = (-math.inf, 0.0)
    if h > 0.0:
        return mean_touch(own.spring, flanks, damping, depth, depth_rate, h)
    return touch(own.spring, flanks, damping, depth, depth_rate)


@scene_law(Own)
def _compute(t: Any, h: Any, own: Any, scene: Any) -> None:
    tip, entry = scene.world.tip, 0
    depth, depth_rate = _penetration(own, tip)
    force, stiff, damping = _contact_force(own, depth, depth_rate, h, own.damping)
    if stiff == 0.0:
        return
    for i in range(3):
        tip.force[i] += force * own.normal[i]
        for j in range(i, 3):
            outer = own.normal[i] * own.normal[j]
            tip.damping[entry] += damping * outer
            tip.stiffness[entry] += stiff * outer
            entry += 1


@scene_law(Own)
def _account(t: Any, h: Any, own: Any, scene: Any) -> None:
    depth, depth_rate = _penetration(own, scene.world.tip)
    own.force, _, _ = _contact_force(own, depth, depth_rate, h, own.damping)
    elastic, _, _ = _contact_force(own, depth, depth_rate, h, 0.0)
    own.power = (own.force - elastic) * depth_rate
    own.energy = answer(own.spring, max(depth, 0.0))[2]


@dataclass(frozen=True)
class TipContact(Effect):
    """Contact of the arm's tip with a flat wall without friction.

    Attributes:
        point: A point of the wall, in the base frame [m].
        normal: Direction out of the wall, towards the free side.
        stiffness: Stiffness of the contact [N/m].
        damping: Damping of the contact [N s/m]; the force is never negative, so the wall does not pull.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    stiffness: float
    damping: float = 0.0

    scope = "scene"
    limits = ranges(
        point=finite("m"), normal=finite("-"), stiffness=positive("N/m"), damping=not_negative("N s/m"),
    )  # fmt: skip
    compute = _compute
    account = _account

    def faults(self) -> list[Fault]:
        faults = [
            Fault(f"TipContact.{name}", "must be three numbers", getattr(self, name))
            for name in ("point", "normal")
            if len(getattr(self, name)) != 3
        ]
        if not np.linalg.norm(self.normal) > 0.0:
            faults.append(Fault("TipContact.normal", "must point somewhere", self.normal))
        return faults

    def piecewise(self) -> bool:
        return True

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=_GIVEN,
            contributes=_TAKEN,
            outputs=(
                Signal("contact_force", "N", path="force"), s.loss("contact_power"), s.store("contact_spring_energy"),
            ),
        )  # fmt: skip

    def own(self, place: Place) -> Own:
        normal = np.asarray(self.normal, dtype=np.float64) / np.linalg.norm(self.normal)
        return Own(normal, Spring(*(self.stiffness,) * 3), self.damping, float(normal @ np.asarray(self.point)))
