"""Collects all faults of a study file, so that they are reported together.

Entries that do not have the required form are cut out, and the rest is read again. A fault that may be only the
consequence of a known one is not reported.
"""

from __future__ import annotations

import copy
import re
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from drivetrain.errors import Fault, InputError, PhysicsWarning, close_names, nearest
from drivetrain.study.document import Document, Place, spelled
from drivetrain.study.form import Form
from drivetrain.study.parts.rules import GearRow, MotorRow

F = TypeVar("F", bound=Form)
T = TypeVar("T")
_ROUNDS = 20  # each round cuts out at least one entry; faults hidden behind others come up in the next
_SHEETS: dict[str, type[BaseModel]] = {"motors": MotorRow, "gears": GearRow}
_SYMBOLS = {"kt": "torque_constant", "r": "resistance", "l": "inductance", "j": "rotor_inertia", "m": "mass",
            "eta": "efficiency", "i": "ratio", "n": "ratio"}  # fmt: skip
INERTIA = "{xx: 8e-3 kg m^2, yy: 8e-3 kg m^2, zz: 6e-3 kg m^2}, about the centre of mass; also xy, xz, yz"
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


class Places:
    """Places of faults: faults of entries around or inside such a place may be mere consequences."""

    def __init__(self) -> None:
        self._faulty: set[Place] = set()
        self._around: set[Place] = set()

    def add(self, place: Place) -> None:
        """Add a place."""
        self._faulty.add(place)
        self._around |= {place[:end] for end in range(len(place) + 1)}

    def touch(self, place: Place) -> bool:
        """Whether a fault at a place may only be the consequence of one already known."""
        return place in self._around or any(place[:end] in self._faulty for end in range(len(place)))


def read_form(form: type[F], document: Document) -> tuple[F, list[Fault], Places]:
    """Read a file by its form: what could be read, the faults, and their places."""
    data: dict[str, Any] = copy.deepcopy(document.data)
    faults: list[Fault] = []
    places = Places()
    for _ in range(_ROUNDS):
        try:
            return form.model_validate(data), faults, places
        except ValidationError as error:
            for details in error.errors(include_url=False):
                for place, fault in _faults(document, details):
                    if not places.touch(place):
                        faults.append(fault)
                        places.add(place)
                    _cut(data, place, form.assumed_limits)
    return form.model_validate(form.assumed_limits), faults, places


def _faults(document: Document, details: ErrorDetails) -> list[tuple[Place, Fault]]:
    """Translate one pydantic error to faults with their places."""
    place: Place = tuple(part for part in details["loc"] if not str(part).startswith("<"))
    context = details.get("ctx", {})
    kind, found = details["type"], details["input"]
    if kind == "unknown":
        hints = {(*place, name): _meant(name, context["known"]) for name in context["unknown"]}
        return [(inner, document.fault(inner, "is not known here", hint=hint)) for inner, hint in hints.items()]
    if kind == "missing":
        return [(place, document.fault(place, "is missing", hint=_choices(place)))]
    if isinstance(context.get("error"), InputError):  # an entry has one place, so its faults are reported as one
        faults = context["error"].faults
        problem, first = "; ".join(dict.fromkeys(fault.problem for fault in faults)), faults[0]
        shown = _shown(found) if first.value is None else first.value
        return [(place, document.fault(place, problem, shown, first.hint))]
    if kind in ("literal_error", "enum"):
        names = [word or number for word, number in re.findall(r"'([^']*)'|(\d+)", context["expected"])]
        hint = close_names(found, names)  # the problem already lists all of them
        return [(place, document.fault(place, f"must be {context['expected']}", _shown(found), hint))]
    words = _WORDS.get(kind, details["msg"][:1].lower() + details["msg"][1:])
    hint = INERTIA if kind.startswith("model") and place[-1:] == ("inertia",) else ""
    return [(place, document.fault(place, words, _shown(found), hint))]


def _meant(name: str, known: Iterable[str]) -> str:
    """The hint for a name that is not known: the quantity whose usual symbol it is, or the nearest names."""
    symbol = _SYMBOLS.get(name.casefold(), "")
    return f"did you mean {symbol!r}?" if symbol in known else nearest(name, known)


def _choices(place: Place) -> str:
    """The allowed values of a missing column of a data sheet, if it has a fixed set of them; else empty."""
    columns = _SHEETS[str(place[0])].model_fields if place[0] in _SHEETS else {}
    words = get_args(columns[str(place[-1])].annotation) if place[-1] in columns else ()
    return " or ".join(words) if all(isinstance(word, str) for word in words) else ""


def _shown(found: object) -> object:
    """The value as shown in a fault; mappings and long lists are left out."""
    return found if isinstance(found, str | int | float | bool) else None


def _cut(data: dict[str, Any], place: Place, assumed_limits: Mapping[str, Any]) -> None:
    """Remove a faulty entry (the nearest named one around it, or the one that lacks a name).

    Required top-level entries that are then missing get their value of ``assumed_limits``.
    """
    names = place
    while names and isinstance(names[-1], int):
        names = names[:-1]  # a list with a faulty entry is removed whole: other entries refer to its positions
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
    data |= {name: copy.deepcopy(stand_in) for name, stand_in in assumed_limits.items() if name not in data}


@dataclass(eq=False)
class Ledger:
    """Collector of the faults and notes of one study while it is read and resolved."""

    document: Document  # the study file
    faults: list[Fault] = field(default_factory=list)  # found so far
    faulty: Places = field(default_factory=Places)  # places of the faults in the study file
    notes: list[str] = field(default_factory=list)  # warnings and remarks, in the order found, each once

    def fault(self, place: Place, problem: str, value: object = None, hint: str = "") -> None:
        """Add a fault of the study file, unless it may be the consequence of one already known."""
        if not self.spoiled(place):
            self.faults.append(self.document.fault(place, problem, value, hint))
            self.faulty.add(place)

    def known(self, place: Place, problem: str, name: str, names: Collection[str]) -> bool:
        """Whether a name is one of the known ones; if not, a fault with the nearest of them is added."""
        if name not in names:
            self.fault(place, problem, name, nearest(name, names))
        return name in names

    def note(self, notes: Iterable[str]) -> None:
        """Add remarks for the report."""
        self.notes.extend(note for note in dict.fromkeys(notes) if note not in self.notes)

    def warning(self, place: Place, problem: str, hint: str = "") -> None:
        """Add a warning on an implausible entry; the hint says what was probably meant."""
        self.note([f"warning: {self.document.fault(place, problem, hint=hint)}"])

    def spoiled(self, place: Place) -> bool:
        """Whether an entry already has a fault, so that whatever depends on it need not be checked."""
        return self.faulty.touch(place)

    @contextmanager
    def gather(self, place: Place) -> Iterator[None]:
        """Context that collects the InputErrors and physics warnings of its body instead of letting them through."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                yield
            except InputError as error:
                self._take(place, error.faults)
        for warning in caught:
            if issubclass(warning.category, PhysicsWarning):
                self.note([str(warning.message)])
            else:
                warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)

    def attempt(self, place: Place, check: Callable[..., T], *values: Any, **named: Any) -> T | None:
        """The return value of a check, or None if it raises ``InputError``; its faults and warnings are added here."""
        with self.gather(place):
            return check(*values, **named)
        return None

    def read(self, form: type[F], data: Mapping[str, Any], place: Place) -> F | None:
        """Read an entry of the file by its form; None if it has faults, which are added here."""
        known = form.model_fields
        for name in data:
            if name not in known:  # which would keep the rest from being looked at
                self.fault((*place, name), "is not known here", hint=_meant(name, known))
        try:
            return form.model_validate({name: value for name, value in data.items() if name in known})
        except ValidationError as error:
            for details in error.errors(include_url=False):
                details["loc"] = (*place, *details["loc"])
                for inner, fault in _faults(self.document, details):
                    self.fault(inner, fault.problem, fault.value, fault.hint)
        return None

    def raise_any(self) -> None:
        """Raise InputError with all faults found, in the order of the file's lines; nothing if there are none."""
        if self.faults:
            raise InputError(sorted(self.faults, key=_line))

    def _take(self, place: Place, faults: Iterable[Fault]) -> None:
        """Add faults of another reader; those without a file are placed at the entry that was being read."""
        for fault in faults:
            if fault.file:
                self.faults.append(fault)
            else:
                whole = fault.place.startswith(spelled(place))  # it names the entry itself
                inner = fault.place if whole else ", ".join(filter(None, (spelled(place), fault.place)))
                self.faults.append(replace(fault, place=inner, file=self.document.where(place)))
        self.faulty.add(place)


def _line(fault: Fault) -> tuple[str, int]:
    """Sort key of a fault: file, then line; faults of one line keep the order in which they were found."""
    file, _, line = fault.file.rpartition(":")
    return (file, int(line)) if line.isdigit() else (fault.file, 0)
