"""What a study file may say of the scatter of parts, payload and air."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from drivetrain.errors import nearest
from drivetrain.study import fields as f
from drivetrain.study.form import Form
from drivetrain.study.tolerances import Tolerance

LAWS = ("uniform", "normal")
WIDEST = {"uniform": 0.9, "normal": 0.3}  # shares of the nominal value that still leave a positive number likely


class _Scatter:
    """A width: ``5 %``, ``{uniform: 5 %}`` or ``{normal: 2 %}``; in a unit of its own where that is given."""

    def __init__(self, unit: str = "", relative: bool = True) -> None:
        self.unit = unit
        self.relative = relative

    def read(self, value: Any) -> Tolerance:
        """The tolerance."""
        law, width = "uniform", value
        if isinstance(value, dict):
            if len(value) != 1 or next(iter(value)) not in LAWS:
                found = ", ".join(map(str, value))
                hint = nearest(found, LAWS) if len(value) == 1 else "such as {normal: 2 %}"
                raise f.refused("must have one of: uniform (plus and minus), normal (standard deviation)", hint, found)
            law, width = next(iter(value.items()))
        share = not self.unit or (self.relative and isinstance(width, int | float | str) and "%" in str(width))
        read = f.Quantity("" if share else self.unit, minimum=0.0, maximum=WIDEST[law] if share else None).read(width)
        return Tolerance(read, law == "normal", not share)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        width = {"type": ["number", "string"]}
        laws = {"type": "object", "properties": dict.fromkeys(LAWS, width), "minProperties": 1, "maxProperties": 1}
        return {"anyOf": [width, laws], "description": "plus and minus (uniform), or {normal: standard deviation}"}


Share = Annotated[Tolerance, _Scatter()]
Mass = Annotated[Tolerance, _Scatter("kg")]
Kelvin = Annotated[Tolerance, _Scatter("K", relative=False)]


class TolerancesForm(Form):
    """How far what is built may lie from the nominal numbers; what is left out is taken as exact."""

    torque_constant: Share | None = Field(default=None, description="of the motors")
    resistance: Share | None = Field(default=None, description="of the windings")
    friction: Share | None = Field(default=None, description="of motor shaft, gear and joint")
    efficiency: Share | None = Field(default=None, description="of the gears; a share of the efficiency itself")
    thermal_resistance: Share | None = Field(default=None, description="from winding to housing and on to the air")
    payload: Mass | None = Field(default=None, description="of each payload's mass, a share or in kg")
    ambient: Kelvin | None = Field(default=None, description="of the air, in K")
    samples: Annotated[int, Field(ge=100)] = Field(default=20000, description="drawn, for the probabilities")
    seed: Annotated[int, Field(ge=0)] = Field(default=1, description="of the random numbers")
