"""A round surface of a test's own, as a user would write one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.dynamics.constraints import Surface


@dataclass(frozen=True, eq=False)
class Sphere(Surface):
    centre: np.ndarray  # [m], (3,)
    radius: float  # [m]

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        offset = points - np.asarray(self.centre)
        distance = np.linalg.norm(offset, axis=1)
        out = offset / distance[:, None]
        bent = (np.eye(3) - out[:, :, None] * out[:, None, :]) / distance[:, None, None]
        return distance - self.radius, out, bent
