"""The payload of the tip, and when it is picked up or set down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.errors import Fault, raise_faults
from drivetrain.spatial.inertia import RigidBody

ROUNDING = 1e-9  # negative principal moment, over the largest, that may come from rounding


@dataclass(frozen=True, eq=False)
class Body(RigidBody):
    """A body fixed to the tip.

    Attributes:
        mass: Mass [kg]; 0 for an empty tip.
        com: Centre of mass in the tip frame [m], (3,).
        inertia: Inertia about the centre of mass, in the tip frame [kg m^2], (3, 3).
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        faults = [Fault("Body.mass", "must not be negative [kg]", self.mass)] if self.mass < 0.0 else []
        moments = np.linalg.eigvalsh(self.inertia)
        if moments[0] < -ROUNDING * moments[-1] or moments[-1] < 0.0:
            faults.append(Fault("Body.inertia", "must have no negative moment [kg m^2]", self.inertia.tolist()))
        raise_faults(faults)


EMPTY = Body(0.0, np.zeros(3), np.zeros((3, 3)))


@dataclass(frozen=True, eq=False)
class PayloadChange(Effect):
    """Payloads that change at given instants.

    Speeds do not jump: a payload is assumed to move with the tip already when it is picked up, and the energy that it
    brings is counted in ``scene.payload_energy``.

    Attributes:
        time: Times from which each body is carried, increasing [s], (K,); before the first the tip is empty.
        bodies: The bodies carried from these times on, K of them.
    """

    time: Array
    bodies: tuple[Body, ...]

    scope = "scene"

    def __post_init__(self) -> None:
        time = checked_array(self.time, (None,), "time")
        faults = []
        if len(time) != len(self.bodies) or (np.diff(time) <= 0.0).any():
            faults.append(Fault("time", "must be instants that rise, one a body [s]", time[:5].tolist()))
        raise_faults(faults)
        object.__setattr__(self, "time", time)

    def ports(self, place: Place) -> Ports:
        return Ports(provides=(s.PAYLOAD_ENERGY,))

    def breakpoints(self) -> Sequence[float]:
        return [float(t) for t in self.time]

    def carried(self) -> tuple[Array, Array]:
        """Times of the changes [s], (K,), and the bodies as matrices of mass moments in the tip frame, (K, 4, 4)."""
        moments = np.zeros((len(self.bodies), 4, 4))
        for moment, body in zip(moments, self.bodies, strict=True):
            spread = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
            moment[:3, :3] = spread + body.mass * np.outer(body.com, body.com)
            moment[:3, 3] = moment[3, :3] = body.mass * body.com
            moment[3, 3] = body.mass
        return np.asarray(self.time), moments
