"""Laws that jump, as who does not know better writes them; in a module of their own, where numba's cache finds them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.laws import joint_law
from drivetrain.solvers.compiled_function import compiled


@dataclass
class Own:
    """Nothing is kept."""


@joint_law(Own)
def _sign(t: Any, h: Any, own: Any, joint: Any) -> None:
    speed = joint.load.speed
    joint.load.torque -= 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0


@joint_law(Own)
def _step(t: Any, h: Any, own: Any, joint: Any) -> None:
    joint.load.torque += 5.0 if t >= 0.3 else -1.0


@dataclass(frozen=True)
class Sign(Effect):
    """Friction as a jump of the torque with the speed, as who does not know better writes it."""

    compute = _sign

    def ports(self, place: Place) -> Ports:
        """Reads the speed, adds a torque."""
        return Ports(needs=(s.SPEED,), contributes=(s.JOINT_TORQUE,))

    def own(self, place: Place) -> Own:
        """Nothing."""
        return Own()


@dataclass(frozen=True)
class Step(Sign):
    """A torque that jumps at 0.3 s and tells nobody."""

    compute = _step


@compiled
def oscillator_rates(t: Any, x: Any, dx: Any, numbers: Any, words: Any) -> None:
    dx[0] = x[1]
    dx[1] = -100.0 * x[0] - (1.0 if x[1] > 0.0 else -1.0 if x[1] < 0.0 else 0.0)
