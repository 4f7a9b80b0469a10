"""Loss in the mesh of a gear: a share of the transmitted torque, by direction of power, up to self-locking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.drive.gear import Gear, mesh
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Shape, ratio_of
from drivetrain.effects.laws import joint_law


@dataclass
class Own:
    """Record of the effect: loss over transmitted torque when the motor drives, and when the load drives [-]."""

    driving: float
    driven: float


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    joint.mesh.driving += own.driving
    joint.mesh.driven += own.driven


@dataclass(frozen=True)
class MeshLoss(Effect):
    """Mesh loss: a driving motor provides 1/eta of the load torque, a driving load returns eta_back of it.

    At rest it holds as dry friction does, with bounds that are proportional to the load and differ by direction. With a
    loss of 1 or more when the load drives, the gear is self-locking.

    Attributes:
        gear: Data of the gear, of which efficiencies and ratio are used.
    """

    gear: Gear

    compute = _compute

    @property
    def driven_loss(self) -> float:
        """Loss over transmitted torque when the load drives [-]; from 1 on the mesh is self-locking."""
        return 1.0 - mesh(self.gear).driven

    def ports(self, place: Place) -> Ports:
        return Ports(contributes=(s.MESH_DRIVING, s.MESH_DRIVEN))

    def own(self, place: Place) -> Own:
        return Own(mesh(self.gear).driving - 1.0, self.driven_loss)

    def shape(self, place: Place) -> Shape:
        return Shape(ratio=ratio_of(place, self.gear))
