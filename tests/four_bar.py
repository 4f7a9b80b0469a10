"""A four-bar loop that several rooms try."""

from __future__ import annotations

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.dynamics.constrained import closed_position
from drivetrain.dynamics.constraints import Attachment, ClosingJoint, LoopClosure


def four_bar() -> tuple[Arm, LoopClosure, np.ndarray]:
    """Crank, coupler and rocker of 0.4, 1.0 and 0.8 m, the far pin 0.9 m away."""
    lengths, masses = np.array([0.4, 1.0, 0.8]), np.array([1.0, 2.0, 1.5])
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    homes = np.tile(np.eye(4), (3, 1, 1))
    homes[:, 0, 3] = 0.5 * (ends[1:] + ends[:-1])
    screws = np.zeros((3, 6))
    screws[:, 2], screws[:, 4] = 1.0, -ends[:-1]
    moments = masses * lengths**2 / 12.0
    tip, ground = np.eye(4), np.eye(4)
    tip[0, 3], ground[0, 3] = ends[-1], 0.9
    arm = Arm.from_screws(homes, screws, masses, [np.diag([0.0, m, m]) for m in moments], tip, (0.0, -9.81, 0.0))
    loop = LoopClosure(Attachment.tip(arm), Attachment.base(ground), ClosingJoint.HINGE)
    return arm, loop, closed_position(arm, loop, [1.2, -0.9, -1.5])
