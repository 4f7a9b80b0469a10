"""Pydantic models ("forms") that read parts of the study file, derived from the dataclasses of those parts.

A dataclass defines a part of a study once: its annotations give units and limits of each field, its docstring the help
text that editors show (and the unit of a plain float, in square brackets). ``Entry[Friction]`` is the form of such a
part: it holds values in SI, does not yet run the dataclass's own checks, and knows which names were given, so that an
entry can be merged over a default one. ``made`` turns it into the dataclass.
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
    """A mapping in the study file with a fixed set of names."""

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
    """The form of a dataclass, with the annotations, defaults and descriptions of its fields; ``made`` turns it back.

    A study file cannot state the fields ``without``, and must state those ``needed`` although they have a default.
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
        tells_more = text and not (unit and text == f"{unit[0]}.")  # than the unit, which its reader states already
        about = Field(description=text if tells_more else None, **default)
        if one.name not in without:
            entries[one.name] = (_as_written(hints[one.name], unit[1] if unit else ""), about)
    doc = (inspect.getdoc(kind) or "").split("\n")[0]
    made_of = create_model(f"{kind.__name__}Form", __base__=Form, __doc__=doc, **entries)
    made_of.stands_for = kind
    return made_of


def attribute_words(kind: type) -> dict[str, str]:
    """Description of each attribute of a class, from the "Attributes" section of its docstring."""
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
    """The annotation of a form's field: dataclasses become forms, plain floats get the unit of their description."""
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
    """Annotation of a field: its dataclass is read by its form."""

    # arguments of ``form_of``
    without: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(form_of(source, self.without, self.needed))


Entry = Annotated[T, AsForm()]


@dataclass(frozen=True)
class Shaped:
    """Annotation of a field that is a union of two types: values of the given Python types belong to the second one.

    Faults are then reported for one of the two types only.
    """

    values: Any  # types of Python

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        kinds = dict(zip(("<first>", "<second>"), map(handler.generate_schema, get_args(source)), strict=True))
        return core_schema.tagged_union_schema(
            kinds, lambda value: "<second>" if isinstance(value, self.values) else "<first>"
        )


def given(entry: object, name: str) -> bool:
    """Whether the file states a field of an entry."""
    return isinstance(entry, Form) and name in entry.model_fields_set and getattr(entry, name) is not None


def over(own: T, default: T) -> T:
    """An entry completed by the fields of a default one that it does not state; mappings are merged name by name."""
    assert isinstance(own, Form) and isinstance(default, Form)
    merged = {name: getattr(own, name) for name in own.model_fields_set}
    for name, value in merged.items():
        base = getattr(default, name)
        if isinstance(value, Form) and type(base) is type(value):
            merged[name] = over(value, base)
    filled: T = default.model_copy(update=merged)
    return filled


def made(entry: T) -> T:
    """The dataclass of an entry, with those nested in it; raises InputError if the dataclass's own checks fail."""
    found: Any = entry
    if isinstance(entry, Form):
        found = entry.made()
    elif type(found) in (list, tuple):
        found = type(found)(map(made, found))
    return found  # type: ignore[no-any-return]
