"""How far the things that are built may lie from the numbers they were sized with; nothing is assumed by itself.

A sheet's tolerance is a limit within which anything may lie, so a plain value is read as a uniform distribution over
plus and minus that value. What was measured on several pieces is better described by its standard deviation:
``{normal: 2 %}``. As a guide, where a maker says anything at all: Beckhoff prints that the data of its AM8100 motors
hold within 10 %. For gears the tables of efficiency and no-load torque over temperature and load in the catalogues of
strain-wave gears show by how much these change in use, which is more than between pieces.

Motor and gear of every joint are drawn by themselves; ambient and each payload are the same for all joints. Nothing is
correlated beyond that: where a batch of motors is off together, all of them fail together more often than is said here.

Two laws are known, uniform and normal. A normal law has no ends; it is cut only where nothing could be built: factors
on parts at 1 % of the nominal value (what would be below lies there; with 30 %, the widest that a study file may state,
one part in 2000), payloads at nothing, efficiencies at 1.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge

from drivetrain.arrays import Array
from drivetrain.errors import nearest
from drivetrain.units import Quantity, Reader, refused

LAWS = ("uniform", "normal")
WIDEST = {"uniform": 0.9, "normal": 0.3}  # shares of the nominal value that still leave a positive number likely
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
class _Scatter(Reader):
    """A width: ``5 %``, ``{uniform: 5 %}`` or ``{normal: 2 %}``; in a unit of its own where that is given."""

    unit: str = ""
    relative: bool = True

    def read(self, value: Any) -> Tolerance:
        law, width = "uniform", value
        if isinstance(value, dict):
            if len(value) != 1 or next(iter(value)) not in LAWS:
                found = ", ".join(map(str, value))
                hint = nearest(found, LAWS) if len(value) == 1 else "such as {normal: 2 %}"
                raise refused("must have one of: uniform (plus and minus), normal (standard deviation)", hint, found)
            law, width = next(iter(value.items()))
        share = not self.unit or (self.relative and isinstance(width, int | float | str) and "%" in str(width))
        read = Quantity("" if share else self.unit, minimum=0.0, maximum=WIDEST[law] if share else None).read(width)
        return Tolerance(read, law == "normal", not share)

    def json_schema(self) -> dict[str, Any]:
        width = {"type": ["number", "string"]}
        laws = {"type": "object", "properties": dict.fromkeys(LAWS, width), "minProperties": 1, "maxProperties": 1}
        return {"anyOf": [width, laws], "description": "plus and minus (uniform), or {normal: standard deviation}"}


Scatter = Annotated[Tolerance, _Scatter()]


@dataclass(frozen=True)
class Tolerances:
    """What scatters; None: known exactly.

    Attributes:
        torque_constant: Of the motors, and with it the back-emf constant.
        resistance: Of the windings.
        friction: Of motor shaft, gear (no-load running torque) and joint, all of one joint together.
        efficiency: Of the gears, relative: 5 % of 80 % are 4 points; never above 1.
        thermal_resistance: From winding to housing and on to ambient, both of one joint together; heat capacities stay.
        payload: Of each payload's mass, its shape and centre staying the same.
        ambient: Of the temperature around the drives.
        drag: Of the gears whose data sheets give mesh and drag separately: running, seals and starting. The shipped
            strain-wave rows hold within 20 % for sizes 14 to 25 and within 40 % elsewhere (catalogs/SOURCES.md).
        samples: How many sets of parts are drawn.
        seed: Of the random numbers.
    """

    torque_constant: Scatter | None = None
    resistance: Scatter | None = None
    friction: Scatter | None = None
    efficiency: Scatter | None = None
    thermal_resistance: Scatter | None = None
    payload: Annotated[Tolerance, _Scatter("kg")] | None = None
    ambient: Annotated[Tolerance, _Scatter("K", relative=False)] | None = None
    drag: Scatter | None = None
    samples: Annotated[int, Ge(100)] = 20000
    seed: Annotated[int, Ge(0)] = 1

    @property
    def given(self) -> tuple[str, ...]:
        """Names of what scatters."""
        return tuple(field.name for field in fields(self) if isinstance(getattr(self, field.name), Tolerance))


EXACT = Tolerances()
"""Nothing scatters."""
