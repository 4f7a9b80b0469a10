"""How a study file asks for a Pareto front and for curves of the best set."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BeforeValidator, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from drivetrain.errors import InputError
from drivetrain.study import fields as f
from drivetrain.study.trade_offs import CRITERIA, UNITS, CurveWanted, read_criterion, read_curve


def _told(read: Callable[[object], Any]) -> Callable[[Any], Any]:
    """A reader whose faults are told at the place of the entry."""

    def told(value: Any) -> Any:
        try:
            return read(value)
        except InputError as error:
            # An entry is one text, so its faults share a place: told as one, each with its own words.
            problem = "; ".join(dict.fromkeys(fault.problem for fault in error.faults))
            raise f.refused(problem, error.faults[0].hint, error.faults[0].value) from None

    return told


class _Curve:
    """A curve: what is varied, and where it is given its range."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_told(read_curve))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        span = {"type": "string", "description": "a range such as 0 kg..8 kg"}
        mapping = {"type": "object", "properties": dict.fromkeys(UNITS, span), "maxProperties": 1}
        return {"anyOf": [{"type": "string", "enum": list(UNITS)}, {"type": "string"}, mapping]}


class _Criterion:
    """A criterion that sets are compared by."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_told(read_criterion))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": "string", "enum": list(CRITERIA)}


def _listed(value: Any) -> Any:
    """Only a list is one; anything else says what is wanted."""
    if not isinstance(value, list | tuple):
        raise f.refused("must be a list", "such as [mass, energy] for front, [payload, cycle_time] for curves")
    return value


Criteria = Annotated[tuple[Annotated[str, _Criterion()], ...], BeforeValidator(_listed)]
Curves = Annotated[tuple[Annotated[CurveWanted, _Curve()], ...], BeforeValidator(_listed)]
