"""Scatter of part data and loads about their nominal values; without an entry of the study a value is exact.

The tolerance of a data sheet is a limit, so a plain value is read as a uniform distribution over plus and minus that
value. A scatter that was measured on several parts is better described by its standard deviation: ``{normal: 2 %}``.
As a guide, as few makers state tolerances: Beckhoff states 10 % for the data of its AM8100 motors. For gears, the
catalogues of strain-wave gears show how efficiency and no-load torque change with temperature and load; this is more
than the scatter between parts.

Motor and gear of every joint are drawn independently; ambient temperature, each payload and the forces at the tip,
which share one draw, are the same for all joints. There is no other correlation: if all motors of a batch deviate in
the same direction, they fail together more often than computed here.

The distributions are uniform and normal. A normal distribution is unbounded and is clipped only at physical limits:
factors on parts at 1 % of the nominal value (with 30 %, the largest that a study file may state, one part in 2000 is
clipped), payloads and forces at zero, efficiencies at 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.units import Quantity, Reader, refused

LAWS = ("uniform", "normal")
WIDEST = {"uniform": 0.9, "normal": 0.3}  # shares of the nominal value that still leave a positive number likely
SMALLEST = 0.01  # smallest factor on a nominal value: the tail of the normal distribution is clipped here


@dataclass(frozen=True)
class Tolerance:
    """Distribution of one value about its nominal value.

    Attributes:
        width: Half the range of a uniform distribution, or the standard deviation of a normal one; a share of the
            nominal value or, if ``absolute``, in kg or K.
        normal: Whether the distribution is normal; else uniform.
        absolute: Whether the width is in the unit of the value.
    """

    width: float
    normal: bool = False
    absolute: bool = False

    def __post_init__(self) -> None:
        if not 0.0 <= self.width < math.inf:
            raise InputError(Fault("width", "of a tolerance must be 0 or more, and finite", self.width))

    def deviation(self, uniform: Array) -> Array:
        """Quantile of the deviation, for probabilities of a smaller deviation; same shape."""
        if self.normal:
            from scipy.special import ndtri  # imported here because it takes 0.3 s

            return np.asarray(self.width * ndtri(uniform))
        return self.width * (2.0 * uniform - 1.0)

    @property
    def edges(self) -> tuple[float, float]:
        """Lower and upper deviation of a tornado chart: the limits if uniform, two standard deviations if normal."""
        reach = 2.0 * self.width if self.normal else self.width
        return -reach, reach


@dataclass(frozen=True)
class _Scatter(Reader):
    """Reader of a tolerance: ``5 %``, ``{uniform: 5 %}`` or ``{normal: 2 %}``, or with a unit if it is absolute."""

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
    """Tolerances of a study; None: the value is exact.

    Attributes:
        torque_constant: Tolerance of the motors' torque constants; the back-emf constants change with them.
        resistance: Tolerance of the winding resistances.
        friction: Tolerance of the friction of motor shaft, gear (no-load running torque) and joint; one common draw per
            joint.
        efficiency: Relative tolerance of the gear efficiencies: 5 % of 80 % are 4 points; never above 1.
        thermal_resistance: Tolerance of the thermal resistances from winding to housing and from housing to ambient,
            one common draw per joint; heat capacities do not change.
        payload: Tolerance of each payload's mass; its shape and centre of mass do not change.
        ambient: Tolerance of the ambient temperature.
        drag: Tolerance of the drag (running, seals, starting) of gears whose data sheets give mesh and drag separately.
            That of the shipped strain-wave rows is 20 % for sizes 14 to 25 and 40 % elsewhere (catalogs/SOURCES.md).
        force: Tolerance of the forces and moments at the tip, one common draw for all.
        samples: Number of sets of parts to draw.
        seed: Seed of the random numbers.
    """

    torque_constant: Scatter | None = None
    resistance: Scatter | None = None
    friction: Scatter | None = None
    efficiency: Scatter | None = None
    thermal_resistance: Scatter | None = None
    payload: Annotated[Tolerance, _Scatter("kg")] | None = None
    ambient: Annotated[Tolerance, _Scatter("K", relative=False)] | None = None
    drag: Scatter | None = None
    force: Scatter | None = None
    samples: Annotated[int, Ge(100)] = 20000
    seed: Annotated[int, Ge(0)] = 1

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the tolerances that are stated."""
        return tuple(field.name for field in fields(self) if isinstance(getattr(self, field.name), Tolerance))


EXACT = Tolerances()
"""Nothing scatters."""
