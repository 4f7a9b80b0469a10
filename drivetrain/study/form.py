"""The base of every part of the study file: unknown names are faults that say what is known."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError


class Form(BaseModel):
    """A mapping of the study file whose names are known beforehand."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _only_known_names(cls, data: Any) -> Any:
        unknown = [name for name in data if name not in cls.model_fields] if isinstance(data, dict) else []
        if unknown:
            raise PydanticCustomError("unknown", "unknown names", {"unknown": unknown, "known": [*cls.model_fields]})
        return data

    def given(self, name: str) -> bool:
        """Whether a field stands in the file."""
        return name in self.model_fields_set and getattr(self, name) is not None

    def over(self, default: Self) -> Self:
        """This form with what it does not say filled from another: mappings are merged name by name."""
        merged = {name: getattr(self, name) for name in self.model_fields_set}
        for name, value in merged.items():
            base = getattr(default, name)
            if isinstance(value, Form) and type(base) is type(value):
                merged[name] = value.over(base)
        return default.model_copy(update=merged)
