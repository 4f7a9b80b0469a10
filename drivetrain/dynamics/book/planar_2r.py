"""The book's first arm in closed form: two links in a plane, each a point mass at the end of a massless rod.

Written by hand from equation 8.9, it shares no code with the recursions and is used to check them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, finite_samples, frozen_array
from drivetrain.errors import Faults
from drivetrain.spatial.poses import pose


@dataclass(frozen=True, eq=False)
class Planar2R:
    """Two links in the x-y plane with joint axes along z; gravity acts along -y."""

    masses: Array | tuple[float, float] = (1.0, 1.0)  # at the ends of the links [kg], (2,), positive
    lengths: Array | tuple[float, float] = (1.0, 1.0)  # of the links [m], (2,), positive
    gravity: float = 9.81  # acceleration of free fall [m/s^2]

    def __post_init__(self) -> None:
        faults = Faults()
        for name, shape, unit in (("masses", (2,), "kg"), ("lengths", (2,), "m"), ("gravity", (), "")):
            value = faults.attempt(frozen_array, getattr(self, name), shape, name)
            if value is not None:
                if unit and not (value > 0.0).all():
                    faults.add(name, f"must be positive [{unit}]", value.tolist())
                object.__setattr__(self, name, value if value.ndim else float(value))
        faults.raise_any()


class MotionTerms(NamedTuple):
    """The three terms of ``torque = M qdd + c + g``; one sample has no leading axis."""

    mass: Array  # M [kg m^2], (N, 2, 2)
    velocity: Array  # c, Coriolis and centripetal torque [N m], (N, 2)
    gravity: Array  # g [N m], (N, 2)


def planar_2r_terms(chain: Planar2R, q: Any, qd: Any) -> MotionTerms:
    """The terms of the equation of motion of the 2R arm [kg m^2, N m]; Modern Robotics, equations 8.9 and 8.10."""
    angles, speeds = finite_samples(2, {"q": q, "qd": qd})
    (m1, m2), (l1, l2) = chain.masses, chain.lengths
    first, second = angles.T
    one, two = speeds.T
    coupling = m2 * (l1 * l2 * np.cos(second) + l2**2)
    own = m1 * l1**2 + m2 * (l1**2 + 2.0 * l1 * l2 * np.cos(second) + l2**2)
    last = np.full(len(angles), m2 * l2**2)
    mass = np.stack([np.stack([own, coupling], axis=1), np.stack([coupling, last], axis=1)], axis=1)
    lever = m2 * l1 * l2 * np.sin(second)
    velocity = np.stack([-lever * (2.0 * one * two + two**2), lever * one**2], axis=1)
    far = m2 * l2 * chain.gravity * np.cos(first + second)
    gravity = np.stack([(m1 + m2) * l1 * chain.gravity * np.cos(first) + far, far], axis=1)
    terms = MotionTerms(mass, velocity, gravity)
    return terms if np.ndim(q) == 2 else MotionTerms(*(term[0] for term in terms))


def planar_2r_torque(chain: Planar2R, q: Any, qd: Any, qdd: Any) -> Array:
    """The joint torques of the 2R arm [N m], (2,) or (N, 2); Modern Robotics, equation 8.9."""
    finite_samples(2, {"q": q, "qd": qd, "qdd": qdd})
    terms = planar_2r_terms(chain, q, qd)
    inertial = (terms.mass @ np.asarray(qdd, dtype=np.float64)[..., None])[..., 0]
    return np.asarray(inertial + terms.velocity + terms.gravity)


def planar_2r_arm(chain: Planar2R) -> Arm:
    """The arm of figure 8.1 without motors: stretched along x at zero, with its base at joint 1, its tip at mass 2."""
    l1, l2 = (float(length) for length in chain.lengths)
    home = [pose(point=[l1, 0.0, 0.0]), pose(point=[l1 + l2, 0.0, 0.0])]
    screws = [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, -l1, 0.0]]
    return Arm.from_screws(
        home,
        screws,
        chain.masses,
        np.zeros((2, 3, 3)),
        gravity=(0.0, -chain.gravity, 0.0),
        joint_points=[[0.0, 0.0, 0.0], [l1, 0.0, 0.0]],
        name="planar 2R",
    )
