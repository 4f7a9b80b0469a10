"""What a study file may say of the set of drives that is wanted: what counts, and what it must respect."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from drivetrain.study import fields as f
from drivetrain.study.form import Form
from drivetrain.study.schema_trade_offs import Criteria, Curves

TERMS = ("mass", "price", "energy")

Weight = Annotated[float, f.Quantity("", minimum=0.0)]
Count = Annotated[int, Field(ge=1)]


class WeightsForm(Form):
    """Weights of a mixed objective, pure numbers: a kilogram, a unit of the price, a joule of each cycle."""

    mass: Weight = Field(default=0.0, description="what one kilogram of motors and gears counts")
    price: Weight = Field(default=0.0, description="what one unit of the catalogue's price counts")
    energy: Weight = Field(default=0.0, description="what one joule a cycle counts")

    @model_validator(mode="after")
    def _something_counts(self) -> Self:
        if not any(getattr(self, name) for name in TERMS):
            raise f.refused("needs a weight above 0", f"for at least one of {', '.join(TERMS)}")
        return self


def _word_or_weights(value: Any) -> str:
    return "<weights>" if isinstance(value, dict | WeightsForm) else "<word>"


Objective = Annotated[
    Annotated[Literal["mass", "price", "energy"], Tag("<word>")] | Annotated[WeightsForm, Tag("<weights>")],
    Discriminator(_word_or_weights),
]


class _Groups:
    """Groups of names: a list of lists, or one plain list for one group."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = {"type": "array", "minItems": 2, "items": {"type": "string"}}
        return {"anyOf": [names, {"type": "array", "items": names}]}

    @staticmethod
    def _read(value: Any) -> tuple[tuple[str, ...], ...]:
        if not isinstance(value, list | tuple) or not value:
            raise f.refused("must be a list of joint names, or a list of such lists", "[[joint_4, joint_5, joint_6]]")
        nested = any(isinstance(entry, list | tuple) for entry in value)
        groups = value if nested else [value]
        if not all(isinstance(group, list | tuple) for group in groups):
            raise f.refused("mixes names and lists of names", "[[joint_1, joint_2], [joint_4, joint_5]]")
        read = tuple(tuple(dict.fromkeys(map(f.read_name, group))) for group in groups)
        short = next((group for group in read if len(group) < 2), None)
        if short is not None:
            raise f.refused("a group needs at least two joints", found=", ".join(short))
        return read


Groups = Annotated[tuple[tuple[str, ...], ...], _Groups()]


def _not_certain(value: float) -> float:
    """A probability that can be reached: nothing holds for certain under tolerances."""
    if value >= 1.0:
        hint = "such as 0.99 or 99 %; leave it out to judge the nominal values alone"
        raise f.refused("must be a probability below 1", hint)
    return value


Probability = Annotated[float, f.Quantity("", above=0.0), AfterValidator(_not_certain)]


class SelectionForm(Form):
    """What a selection must respect, and how far it goes."""

    sets: Count = Field(default=5, description="how many of the best sets are wanted")
    time_limit: f.Duration = Field(default=30.0, description="of the search; what is unproven then is told")
    most_motor_types: Count | None = Field(default=None, description="different motors over all joints, at most")
    most_gear_types: Count | None = Field(default=None, description="different gears over all joints, at most")
    same_family: Groups = Field(
        default=(), description="groups of joints whose motors, and whose gears, are of one maker's series"
    )
    holds: Probability | None = Field(
        default=None, description="probability with which the set must hold under the tolerances, such as 99 %"
    )
    front: Criteria = Field(default=(), description="criteria of a Pareto front in the report, such as [mass, energy]")
    curves: Curves = Field(
        default=(), description="the best drives over payload, cycle_time, voltage or ambient, in the report"
    )
