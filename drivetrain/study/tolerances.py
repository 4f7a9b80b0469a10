"""How far the things that are built may lie from the numbers they were sized with; nothing is assumed by itself.

A sheet's tolerance is a limit within which anything may lie, so a plain value is read as a uniform distribution over
plus and minus that value. What was measured on several pieces is better told by its standard deviation:
``{normal: 2 %}``. As a guide, where a maker says anything at all: Beckhoff prints that the data of its AM8100 motors
hold within 10 %. For gears the tables of efficiency and no-load torque over temperature and load in the catalogues of
strain-wave gears show by how much these change in use, which is more than between pieces.

Motor and gear of every joint are drawn by themselves; the air and each payload are the same for all joints. Nothing is
correlated beyond that: where a batch of motors is off together, all of them fail together more often than is told here.

Two laws are known, uniform and normal. A normal law has no ends; it is cut only where nothing could be built: factors
on parts at 1 % of the nominal value (what would be below lies there; with 30 %, the widest that a study file may state,
one part in 2000), payloads at nothing, efficiencies at 1.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from drivetrain.arrays import Array

SMALLEST = 0.01  # share of its nominal value below which nothing is drawn: a tail of the normal law, not a part


@dataclass(frozen=True)
class Tolerance:
    """How one number scatters about its nominal value.

    Attributes:
        width: Half the range of a uniform law, or the standard deviation of a normal one; a share of the nominal value,
            or where ``absolute`` in kg or K.
        normal: The law is normal; else uniform.
        absolute: The width is in the unit of the number.
    """

    width: float
    normal: bool = False
    absolute: bool = False

    def deviation(self, uniform: Array) -> Array:
        """The deviation with a given probability of a smaller one."""
        if self.normal:
            from scipy.special import ndtri  # 0.3 s that only a study with tolerances needs

            return np.asarray(self.width * ndtri(uniform))
        return self.width * (2.0 * uniform - 1.0)

    @property
    def edges(self) -> tuple[float, float]:
        """The deviations that a tornado shows: the limits of a uniform law, twice the deviation of a normal one."""
        reach = 2.0 * self.width if self.normal else self.width
        return -reach, reach


@dataclass(frozen=True)
class Tolerances:
    """What scatters; None: known exactly.

    Attributes:
        torque_constant: Of the motors, and with it the back-emf constant.
        resistance: Of the windings.
        friction: Of motor shaft, gear (no-load running torque) and joint, all of one joint together.
        efficiency: Of the gears, relative: 5 % of 80 % are 4 points; never above 1.
        thermal_resistance: From winding to housing and on to the air, both of one joint together; heat capacities stay.
        payload: Of each payload's mass, its shape and centre staying the same.
        ambient: Of the air's temperature.
        samples: How many sets of parts are drawn.
        seed: Of the random numbers.
    """

    torque_constant: Tolerance | None = None
    resistance: Tolerance | None = None
    friction: Tolerance | None = None
    efficiency: Tolerance | None = None
    thermal_resistance: Tolerance | None = None
    payload: Tolerance | None = None
    ambient: Tolerance | None = None
    samples: int = 20000
    seed: int = 1

    @property
    def given(self) -> tuple[str, ...]:
        """Names of what scatters."""
        return tuple(field.name for field in fields(self) if isinstance(getattr(self, field.name), Tolerance))


EXACT = Tolerances()
"""Nothing scatters."""
