"""The errors of the package: wrong input raises, a drive that does not fit is a result.

Every error that a user can cause is an ``InputError`` and lists all faults found, not the first one.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

# Characters that command a terminal or turn text round, and lone surrogates.
_COMMANDS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_LONGEST = 200  # characters of a value or a place, as shown; of a sentence ten times that
_T = TypeVar("_T")
LARGEST = 1e60  # of any number that comes in, in SI: far beyond all machines, and its fifth power is still a number


class DrivetrainError(Exception):
    """Base of every error this package raises on purpose."""


class PhysicsWarning(UserWarning):
    """Input that is allowed but hard to believe, such as an inertia that breaks the triangle inequality."""


@dataclass(frozen=True)
class Fault:
    """One fault of the input, described so that it can be fixed.

    Attributes:
        place: Where it stands: a path such as ``joints.elbow.gear`` or ``row 12, column Kt [mNm/A]``.
        problem: What is wrong and what is allowed, in words, with units.
        value: What was found there, as the user wrote it.
        hint: The fix, such as the nearest known name.
        file: The file it stands in, if any.
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
    """A text with its control characters spelled out: none reaches a terminal."""
    return _COMMANDS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class InputError(DrivetrainError, ValueError):
    """Input that cannot be used; ``faults`` holds every fault found."""

    def __init__(self, faults: Fault | Iterable[Fault]):
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


class Faults:
    """Collects the faults of several checks, so that all are reported at once; ``file`` is where they stand, if any."""

    def __init__(self, file: str = "") -> None:
        self.found: list[Fault] = []
        self.file = file

    def add(self, place: str, problem: str, value: object = None, hint: str = "") -> None:
        self.found.append(Fault(place, problem, value, hint, self.file))

    def attempt(self, check: Callable[..., _T], *values: Any, **named: Any) -> _T | None:
        """What a check returns, or None with its faults noted."""
        try:
            return check(*values, **named)
        except InputError as error:
            self.found += [replace(fault, file=fault.file or self.file) for fault in error.faults]
            return None

    def raise_any(self) -> None:
        """Raise what was found, if anything, each once."""
        raise_faults({str(fault): fault for fault in self.found}.values())


def raise_faults(faults: Iterable[Fault]) -> None:
    """Raise the faults as one error, if there are any."""
    found = tuple(faults)
    if found:
        raise InputError(found)


def nearest(name: str, known: Iterable[str]) -> str:
    """The hint that names the closest known names, or the known names themselves when few."""
    names = sorted(set(known))
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    if not close and len(name) > 2:
        close = [one for one in names if one.startswith(name)][:3]
    if close:
        return "did you mean " + " or ".join(repr(match) for match in close) + "?"
    if not names:
        return ""
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"known: {shown}"


def whole_name(place: str, what: str, short: str, names: Iterable[str], faults: list[Fault]) -> str:
    """The name itself; else the only one that begins with it, or contains it: elbow for elbow_joint; else a fault."""
    known, low = list(names), short.lower()
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
    """Names as they are known, each as above; raises every one that none or several begin with or contain."""
    faults, known = list[Fault](), list(names)
    found = [whole_name(place, what, one, known, faults) for one in wanted]
    raise_faults(faults)
    return found


def by_whole_name(
    place: str, what: str, given: Mapping[str, _T], names: Iterable[str], faults: list[Fault]
) -> dict[str, _T]:
    """What is given by names, by the whole ones."""
    known, found = list(names), dict[str, _T]()
    for short, value in given.items():
        name = whole_name(f"{place}.{short}", what, short, known, faults)
        if name in found:
            faults.append(Fault(f"{place}.{short}", f"stands for {name}, which is given twice"))
        found[name] = value
    return found
