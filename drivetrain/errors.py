"""The errors of the package: wrong input raises an error; a drive that does not fit is a result, not an error.

Every error that a user can cause is an ``InputError`` that lists all faults found, not only the first one.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, TypeVar

# Control characters of terminals, characters that change the direction of text, and lone surrogates.
_COMMANDS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_LONGEST = 200  # largest number of characters of a value or a place in a message; ten times that for a sentence
_T = TypeVar("_T")
_E = TypeVar("_E", bound=StrEnum)
LARGEST = 1e60  # largest accepted number in SI: far beyond all machines, and its fifth power is still finite


class DrivetrainError(Exception):
    """Base class of all errors that this package raises."""


class PhysicsWarning(UserWarning):
    """Input that is allowed but implausible, such as an inertia that violates the triangle inequality."""


@dataclass(frozen=True)
class Fault:
    """One fault of the input, described so that it can be fixed.

    Attributes:
        place: Place of the fault, such as ``joints.elbow.gear`` or ``row 12, column Kt [mNm/A]``.
        problem: What is wrong and what is allowed, as text with units.
        value: The value as the user wrote it.
        hint: The fix, such as the nearest known name.
        file: The file that contains it, if any.
    """

    place: str
    problem: str
    value: object = None
    hint: str = ""
    file: str = ""

    def __str__(self) -> str:
        where = f"{self.file}: {_cut(self.place)}" if self.file else _cut(self.place, 10 * _LONGEST)
        found = "" if self.value is None else f" (found {self.shown})"
        fix = f"; {_cut(self.hint, 10 * _LONGEST)}" if self.hint else ""
        return plain(f"{where}: {_cut(self.problem, 10 * _LONGEST)}{found}{fix}")

    @property
    def shown(self) -> str:
        return _cut(repr(self.value))


def _cut(text: str, longest: int = _LONGEST) -> str:
    return text if len(text) <= longest else f"{text[:longest]} ... {len(text)} characters"


def plain(text: str) -> str:
    """A text with its control characters escaped, so that none reaches a terminal."""
    return _COMMANDS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class InputError(DrivetrainError, ValueError):
    """Input that cannot be used; ``faults`` contains every fault found."""

    def __init__(self, faults: Fault | Iterable[Fault]):
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


class Faults:
    """Collects the faults of several checks, so that all are reported together; ``file`` contains them, if given."""

    def __init__(self, file: str = "") -> None:
        self.found: list[Fault] = []
        self.file = file

    def add(self, place: str, problem: str, value: object = None, hint: str = "") -> None:
        self.found.append(Fault(place, problem, value, hint, self.file))

    def attempt(self, check: Callable[..., _T], *values: Any, **named: Any) -> _T | None:
        """The return value of a check; if it raises ``InputError``, None, and its faults are added."""
        try:
            return check(*values, **named)
        except InputError as error:
            self.found += [replace(fault, file=fault.file or self.file) for fault in error.faults]
            return None

    def raise_any(self) -> None:
        """Raise the collected faults, without duplicates, if there are any."""
        raise_faults({str(fault): fault for fault in self.found}.values())


def raise_faults(faults: Iterable[Fault]) -> None:
    """Raise the faults as one error, if there are any."""
    found = tuple(faults)
    if found:
        raise InputError(found)


def close_names(wanted: object, known: Iterable[str]) -> str:
    """Hint with the known names closest to a wanted one; empty if none is close."""
    names, name = sorted(set(known)), str(wanted)
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    if not close and len(name) > 2:
        close = [one for one in names if one.startswith(name)][:3]
    return "did you mean " + " or ".join(repr(match) for match in close) + "?" if close else ""


def nearest(wanted: object, known: Iterable[str]) -> str:
    """Hint with the known names closest to a wanted one, or with all known names if there are few."""
    names = sorted(set(known))
    hint = close_names(wanted, names)
    if hint or not names:
        return hint
    listed = ", ".join(names)
    return f"known: {listed}" if len(listed) <= _LONGEST else f"known: {', '.join(names[:8])}, ..., {len(names)} in all"


def member_of(kind: type[_E], value: object, place: str, problem: str) -> _E:
    """The member of an enumeration that has a value; InputError with the nearest value if there is none."""
    known = [one.value for one in kind]
    if str(value) not in known:
        raise InputError(Fault(place, problem, value, nearest(str(value), known)))
    return kind(str(value))


def whole_name(place: str, what: str, short: str, names: Iterable[str], faults: list[Fault]) -> str:
    """The full name for an abbreviation, such as elbow_joint for elbow.

    This is the name itself, or the only known name that begins with it, or the only one that contains it. Otherwise a
    fault is added.
    """
    known = list(names)
    if not isinstance(short, str):
        faults.append(Fault(place, f"must be the name of a {what}, as a text", short, nearest(short, known)))
        return short
    low = short.lower()
    kinds = (
        [name for name in known if name == short],
        [name for name in known if name.lower().startswith(low)],
        [name for name in known if low in name.lower()],
    )
    fits = next((kind for kind in kinds if kind), []) if short else []
    if not fits:
        faults.append(Fault(place, f"is no {what}", short, nearest(short, known)))
    elif len(fits) > 1:
        faults.append(Fault(place, f"is short for several: {', '.join(fits)}", short, "write more of it"))
    return fits[0] if len(fits) == 1 else short


def whole_names(place: str, what: str, wanted: Iterable[str], names: Iterable[str]) -> list[str]:
    """Full names for abbreviations, or for one; raises ``InputError`` with all unknown and ambiguous ones."""
    faults, known = list[Fault](), list(names)
    found = [whole_name(place, what, one, known, faults) for one in ([wanted] if isinstance(wanted, str) else wanted)]
    raise_faults(faults)
    return found


def by_joint(place: str, given: Mapping[str, _T], names: Iterable[str], faults: list[Fault]) -> dict[str, _T]:
    """A mapping with abbreviated names of joints as keys, with full names instead, as ``whole_name``."""
    known, found = list(names), dict[str, _T]()
    for short, value in given.items():
        name = whole_name(f"{place}.{short}", "joint of the study", short, known, faults)
        if name in found:
            faults.append(Fault(f"{place}.{short}", f"stands for {name}, which is given twice"))
        found[name] = value
    return found
