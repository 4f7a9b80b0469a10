"""A study file with some of its entries replaced, for runs that differ in them."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from drivetrain.errors import Fault, InputError, nearest
from drivetrain.study.document import Document, Place, spelled


def place_of(document: Document, text: str) -> Place:
    """The place in a study file that a text such as ``payloads.box.mass`` names.

    Raises:
        InputError: A name before the last that the file does not have, with those it has there.
    """
    place: Place = ()
    found: Any = document.data
    names = text.split(".")
    for depth, name in enumerate(names):
        last = depth == len(names) - 1
        if isinstance(found, dict) and (name in found or last):
            place, found = (*place, name), found.get(name)
        elif isinstance(found, list) and name.isdigit() and int(name) < len(found):
            place, found = (*place, int(name)), found[int(name)]
        else:
            problem = f"{spelled(place)} of {document.path} has no entry {name!r}"
            known = found if isinstance(found, dict) else ()
            raise InputError(Fault(text, problem, text, nearest(name, known)))
    return place


def varied(document: Document, entries: Mapping[Place, Any]) -> Document:
    """A study file with entries replaced."""
    if not entries:
        return document
    data = copy.deepcopy(document.data)
    for place, value in entries.items():
        inner: Any = data
        for name in place[:-1]:
            inner = inner[name]
        inner[place[-1]] = copy.deepcopy(value)
    told = json.dumps([[list(place), value] for place, value in entries.items()], sort_keys=True, default=str)
    return replace(document, data=data, content=document.content + b"\n# with " + told.encode())
