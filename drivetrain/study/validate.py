"""The data of a study file as a form, with every fault found: what is wrong is cut out and the rest read again."""

from __future__ import annotations

import copy
import re
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from drivetrain.errors import Fault, nearest
from drivetrain.study.document import Document, Place
from drivetrain.study.schema import StudyForm

_ROUNDS = 20  # each round cuts out at least one entry; faults hidden behind others come up in the next
_STAND_INS: dict[str, Any] = {"schema_version": 1, "motions": {}, "supply": {"voltage": "1 V"}, "joints": {}}
_WORDS = {
    "dict_type": "must be a mapping of names to values",
    "model_type": "must be a mapping of names to values",
    "model_attributes_type": "must be a mapping of names to values",
    "list_type": "must be a list",
    "string_type": "must be a text",
    "too_short": "must have at least one entry",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
}


def read_form(document: Document) -> tuple[StudyForm, list[Fault], set[Place]]:
    """The study file as a form, as far as it can be read."""
    data: dict[str, Any] = copy.deepcopy(document.data)
    faults: list[Fault] = []
    places: set[Place] = set()
    for _ in range(_ROUNDS):
        try:
            return StudyForm.model_validate(data), faults, places
        except ValidationError as error:
            for details in error.errors(include_url=False):
                for place, fault in _faults(document, details):
                    if not touches(place, places):
                        faults.append(fault)
                        places.add(place)
                    _cut(data, place)
    return StudyForm.model_validate(_STAND_INS), faults, places


def touches(place: Place, faulty: set[Place]) -> bool:
    """Whether a fault at a place may only be the consequence of one already known."""
    return any(known[: len(place)] == place or place[: len(known)] == known for known in faulty)


def _faults(document: Document, details: ErrorDetails) -> list[tuple[Place, Fault]]:
    """What one error of pydantic means to the user."""
    place: Place = tuple(part for part in details["loc"] if not str(part).startswith("<"))
    context = details.get("ctx", {})
    kind, found = details["type"], details["input"]
    if kind == "unknown":
        return [_unknown(document, place, name, context["known"]) for name in context["unknown"]]
    if kind == "missing":
        return [(place, document.fault(place, "is missing"))]
    if kind == "study":
        shown = context["found"] if context["found"] is not None else _shown(found)
        return [(place, document.fault(place, context["problem"], shown, context["hint"]))]
    if kind in ("literal_error", "enum"):
        allowed = re.findall(r"'([^']*)'|(\d+)", context["expected"])
        names = [word or number for word, number in allowed]
        problem = f"must be {context['expected']}"
        return [(place, document.fault(place, problem, _shown(found), _near(str(found), names)))]
    words = _WORDS.get(kind, details["msg"][:1].lower() + details["msg"][1:])
    return [(place, document.fault(place, words, _shown(found)))]


def _unknown(document: Document, place: Place, name: str, known: list[str]) -> tuple[Place, Fault]:
    inner = (*place, name)
    return inner, document.fault(inner, "is not known here", hint=nearest(name, known))


def _near(found: str, names: list[str]) -> str:
    """The nearest allowed word, only when there is one: the problem already lists them all."""
    hint = nearest(found, names)
    return hint if hint.startswith("did you mean") else ""


def _shown(found: object) -> object:
    """The value as shown in a fault: mappings and long lists say too much."""
    return found if isinstance(found, str | int | float | bool) else None


def _cut(data: dict[str, Any], place: Place) -> None:
    """Takes the faulty entry out: the nearest name around it, or what lacks a name; at the top a stand-in goes in."""
    names = place
    while names and isinstance(names[-1], int):
        names = names[:-1]  # a list with a faulty entry goes as a whole: others count its entries
    for end, part in enumerate(names):
        if isinstance(part, int):
            names = names[:end]
            break
    while names:
        parent: Any = data
        for part in names[:-1]:
            parent = parent.get(part) if isinstance(parent, dict) else None
        if isinstance(parent, dict) and names[-1] in parent:
            del parent[names[-1]]
            break
        names = names[:-1]
    for name, stand_in in _STAND_INS.items():
        if name not in data:
            data[name] = copy.deepcopy(stand_in)
