"""Field types of the study file: quantities with a unit, ranges of them, and short vectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from drivetrain.errors import InputError
from drivetrain.units import PURE, quantities, quantity

Interval = tuple[float | None, float | None]


def refused(problem: str, hint: str = "", found: object = None) -> PydanticCustomError:
    """The error a field type raises, carrying words of our own."""
    return PydanticCustomError("study", "{problem}", {"problem": problem, "hint": hint, "found": found})


@dataclass(frozen=True)
class Quantity:
    """A number with a unit, read into SI.

    Attributes:
        unit: The SI unit wanted; empty for a pure number, which may be bare or in percent.
        minimum, maximum: Smallest and largest value allowed [unit].
        above: Value that must be exceeded [unit].
    """

    unit: str
    minimum: float | None = None
    maximum: float | None = None
    above: float | None = None

    def read(self, value: Any) -> float:
        """The SI value."""
        try:
            return quantity(value, self.unit, "", minimum=self.minimum, maximum=self.maximum, above=self.above)
        except InputError as error:
            raise refused(error.faults[0].problem, error.faults[0].hint) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        if self.unit in PURE:
            return {"type": ["number", "string"], "description": "a pure number, or in %"}
        return {"type": "string", "description": f"a number with a unit such as {self.unit.replace('degC', '°C')}"}


@dataclass(frozen=True)
class Between:
    """A range of a quantity: a list of the smallest and the largest value, null for an open end.

    Attributes:
        unit: The SI unit wanted; empty for pure numbers.
    """

    unit: str

    def read(self, value: Any) -> Interval:
        """Both ends in SI.

        Returns:
            Smallest and largest [unit]; None where open.
        """
        example = f"[1 {self.unit}, 2 {self.unit}]" if self.unit not in PURE else "[30, 160]"
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise refused(f"must be a range such as {example}", "null leaves an end open")
        low, high = (None if end is None else Quantity(self.unit).read(end) for end in value)
        if low is not None and high is not None and low > high:
            raise refused(f"must be a range such as {example}, smallest first")
        return low, high

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        end = {"type": ["number", "null"] if self.unit in PURE else ["string", "null"]}
        return {"type": "array", "minItems": 2, "maxItems": 2, "items": end, "description": "smallest and largest"}


@dataclass(frozen=True)
class Vector:
    """Three quantities: ``[0, 0, 40] mm``, or ``[0 mm, 0 mm, 40 mm]`` with a unit each.

    Attributes:
        unit: The SI unit wanted.
    """

    unit: str

    def read(self, value: Any) -> tuple[float, float, float]:
        """The three values in SI.

        Returns:
            The values [unit].
        """
        try:
            x, y, z = quantities(value, self.unit, "", 3)
        except InputError as error:
            raise refused(error.faults[0].problem, error.faults[0].hint, error.faults[0].value) from None
        return float(x), float(y), float(z)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        listed = {"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": "string"}}
        return {"anyOf": [{"type": "string"}, listed], "description": f"three values such as [0, 0, 40] {self.unit}"}


class _Names:
    """One name or a list of names, read into a tuple; a number is taken as the text it was written as."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}

    @staticmethod
    def _read(value: Any) -> tuple[str, ...]:
        entries = value if isinstance(value, list | tuple) else [value]
        return tuple(read_name(entry) for entry in entries)


def read_name(value: Any) -> str:
    """A name; a number, such as a bare part number, is taken as its text."""
    if isinstance(value, bool) or not isinstance(value, str | int) or not str(value).strip():
        raise refused("must be a name", "put it in quotes" if isinstance(value, bool | float) else "", value)
    return str(value).strip()


Name = Annotated[str, BeforeValidator(read_name)]
Names = Annotated[tuple[str, ...], _Names()]
Angle = Annotated[float, Quantity("rad")]
Current = Annotated[float, Quantity("A", above=0.0)]
Duration = Annotated[float, Quantity("s", above=0.0)]
Inertia = Annotated[float, Quantity("kg m^2", minimum=0.0)]
InertiaProduct = Annotated[float, Quantity("kg m^2")]
Length = Annotated[float, Quantity("m")]
Mass = Annotated[float, Quantity("kg", minimum=0.0)]
Power = Annotated[float, Quantity("W", minimum=0.0)]
Share = Annotated[float, Quantity("", minimum=0.0, maximum=1.0)]
Efficiency = Annotated[float, Quantity("", above=0.0, maximum=1.0)]
Factor = Annotated[float, Quantity("", above=0.0)]
Temperature = Annotated[float, Quantity("degC", minimum=-273.15)]
TemperatureStep = Annotated[float, Quantity("K", minimum=0.0)]
ThermalResistance = Annotated[float, Quantity("K/W", above=0.0)]
Torque = Annotated[float, Quantity("N m", minimum=0.0)]
ViscousFriction = Annotated[float, Quantity("N m s/rad", minimum=0.0)]
Speed = Annotated[float, Quantity("rad/s", above=0.0)]
Voltage = Annotated[float, Quantity("V", above=0.0)]
TravelPerTurn = Annotated[float, Quantity("m/rad")]
Position3 = Annotated[tuple[float, float, float], Vector("m")]
Acceleration3 = Annotated[tuple[float, float, float], Vector("m/s^2")]
