"""How parts of the study file are read: as forms, made of the dataclasses that say already what they hold.

A dataclass says once what a part of a study holds: its annotations the units and limits of each field, its docstring
the words that editors show (and, of a plain float, the unit, in brackets as everywhere). ``Entry[Friction]`` is that
part as it stands in a file: values in SI, still without the dataclass's own checks, and knowing which names were given,
so that an entry can go over a default one. ``made`` makes the dataclass of it.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache, reduce
from operator import or_
from types import UnionType
from typing import Annotated, Any, ClassVar, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, create_model, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from drivetrain.units import Quantity

T = TypeVar("T")


class Form(BaseModel):
    """A mapping of the study file whose names are known beforehand."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    stands_for: ClassVar[Any] = None
    assumed_limits: ClassVar[dict[str, Any]] = {}  # for what a file must state and this one does not

    def made(self, **more: Any) -> Any:
        names = type(self).model_fields.keys() & {one.name for one in fields(self.stands_for)}
        return self.stands_for(**{name: made(getattr(self, name)) for name in names} | more)

    @model_validator(mode="before")
    @classmethod
    def _only_known_names(cls, data: Any) -> Any:
        unknown = [name for name in data if name not in cls.model_fields] if isinstance(data, dict) else []
        if unknown:
            raise PydanticCustomError("unknown", "unknown names", {"unknown": unknown, "known": [*cls.model_fields]})
        return data


@cache
def form_of(kind: type, without: tuple[str, ...] = (), needed: tuple[str, ...] = ()) -> type[Form]:
    """The form of a dataclass: its fields with their annotations, defaults and words.

    Args:
        without: Fields that no file states.
        needed: Fields that a file must state though they have a default.
    """
    hints, words = get_type_hints(kind, include_extras=True), attribute_words(kind)
    entries: dict[str, Any] = {}
    for one in fields(kind):
        default: dict[str, Any] = {}
        if one.default is not MISSING and one.name not in needed:
            default = {"default": one.default}
        elif one.default_factory is not MISSING:
            default = {"default_factory": one.default_factory}
        text = words.get(one.name, "")
        unit = re.search(r"\[([^\]]*)\]", text)
        tells_more = text and not (unit and text == f"{unit[0]}.")  # than its reader says of the unit
        about = Field(description=text if tells_more else None, **default)
        if one.name not in without:
            entries[one.name] = (_as_written(hints[one.name], unit[1] if unit else ""), about)
    doc = (inspect.getdoc(kind) or "").split("\n")[0]
    made_of = create_model(f"{kind.__name__}Form", __base__=Form, __doc__=doc, **entries)
    made_of.stands_for = kind
    return made_of


def attribute_words(kind: type) -> dict[str, str]:
    """What the docstring of a class says of each of its attributes."""
    words: dict[str, str] = {}
    names: list[str] = []
    for base in kind.__mro__[1:-1]:
        words = attribute_words(base) | words
    for line in (inspect.getdoc(kind) or "").partition("\nAttributes:\n")[2].splitlines():
        entry = re.fullmatch(r" {4}(\w+(?:, \w+)*): (.*)", line)
        if not entry and not line.startswith(" " * 8):
            break
        names = entry[1].split(", ") if entry else names
        words |= {name: entry[2] if entry else f"{words[name]} {line.strip()}" for name in names}
    return words


def _as_written(hint: Any, unit: str) -> Any:
    """An annotation as a file takes it: dataclasses by their forms, numbers with the unit of their description."""
    if is_dataclass(hint):
        return Annotated[hint, AsForm()]
    if hint is float:
        return Annotated[float, Quantity({"C": "degC"}.get(unit, unit))]
    origin, parts = get_origin(hint), get_args(hint)
    if origin is np.ndarray:
        return _as_written(tuple[float, ...], unit)
    if not parts or origin is Annotated:
        return hint
    inner = tuple(_as_written(part, unit) for part in parts)
    return reduce(or_, inner) if origin in (Union, UnionType) else origin[inner]


@dataclass(frozen=True)
class AsForm:
    """Says of a field that its dataclass is read by its form."""

    # as of ``form_of``
    without: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(form_of(source, self.without, self.needed))


Entry = Annotated[T, AsForm()]


@dataclass(frozen=True)
class Shaped:
    """Says of a field of two kinds that these values are of the second one: faults are then reported for one kind
    alone.
    """

    values: Any  # types of Python

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        kinds = dict(zip(("<first>", "<second>"), map(handler.generate_schema, get_args(source)), strict=True))
        return core_schema.tagged_union_schema(
            kinds, lambda value: "<second>" if isinstance(value, self.values) else "<first>"
        )


def given(entry: object, name: str) -> bool:
    """Whether a field of an entry stands in the file."""
    return isinstance(entry, Form) and name in entry.model_fields_set and getattr(entry, name) is not None


def over(own: T, default: T) -> T:
    """An entry with what it does not say filled from another: mappings are merged name by name."""
    assert isinstance(own, Form) and isinstance(default, Form)
    merged = {name: getattr(own, name) for name in own.model_fields_set}
    for name, value in merged.items():
        base = getattr(default, name)
        if isinstance(value, Form) and type(base) is type(value):
            merged[name] = over(value, base)
    filled: T = default.model_copy(update=merged)
    return filled


def made(entry: T) -> T:
    """The dataclass that an entry of the file stands for, and those inside of it; raises what its own checks raise."""
    found: Any = entry
    if isinstance(entry, Form):
        found = entry.made()
    elif type(found) in (list, tuple):
        found = type(found)(map(made, found))
    return found  # type: ignore[no-any-return]
