"""The file of a sweep, and its points: all combinations of the values that it varies."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge
from pydantic import Field

from drivetrain.errors import InputError
from drivetrain.study.change import TaskChange
from drivetrain.study.document import Document, Place, place_of, read_document
from drivetrain.study.faults import Ledger, read_form
from drivetrain.study.form import Form, given
from drivetrain.units import Name, Reader, refused
from drivetrain.version import __version__

SELECT = "select"
MOST_POINTS = 10_000_000


class _Values(Reader):
    """A non-empty list of distinct values, as written."""

    def read(self, value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list) or not value:
            raise refused("must be a list of values, such as [24 V, 48 V]", found=value)
        if len({_text(one) for one in value}) < len(value):
            raise refused("lists a value twice", found=value)
        return tuple(value)


@dataclass(frozen=True)
class _Factors(_Values):
    """A list of distinct pure numbers of at least ``least``."""

    least: float

    def read(self, value: Any) -> tuple[Any, ...]:
        for one in super().read(value):
            number = isinstance(one, int | float) and not isinstance(one, bool)
            if not number or not self.least <= one < math.inf:
                raise refused("must be positive factors, such as [0.8, 1, 1.25]", found=one)
        return tuple(value)


class ScaleForm(Form):
    """Factors on the payload, the forces at the tip, the duration of the cycle and the supply voltage."""

    payload: Annotated[tuple[float, ...], _Factors(0.0)] | None = None
    time: Annotated[tuple[float, ...], _Factors(1e-9)] | None = None
    voltage: Annotated[tuple[float, ...], _Factors(1e-9)] | None = None
    force: Annotated[tuple[float, ...], _Factors(0.0)] | None = None


class SweepForm(Form):
    """The file of a sweep."""

    assumed_limits: ClassVar[dict[str, Any]] = {"study": "none"}

    schema_version: Literal[1] = 1
    study: Name
    vary: dict[str, Annotated[tuple[Any, ...], _Values()]] = Field(default_factory=dict)
    scale: ScaleForm = ScaleForm()
    run: Literal["select", "size"] = "select"
    points_per_shard: Annotated[int, Ge(1)] = 8


@dataclass(frozen=True)
class Point:
    """One point of a sweep: a study with some entries changed."""

    index: int  # from 0; the last varied entry changes fastest
    entries: tuple[tuple[Place, Any], ...]  # new values of the study file, by place
    change: TaskChange  # change of payload, force, time and voltage
    texts: tuple[str, ...]  # value of each varied entry as text, in the order of ``Sweep.names``


@dataclass(frozen=True, eq=False)
class Sweep:
    """The varied entries with their values, and what is computed at each point."""

    document: Document  # the study file
    names: tuple[str, ...]  # of the varied entries: places in the study file, then ``scale.payload`` etc.
    values: tuple[tuple[Any, ...], ...]  # of each varied entry, in the order given
    places: tuple[Place, ...]  # places of the varied entries of the study file
    run: str  # ``select``: choose drives at each point; ``size``: evaluate those of the study
    points_per_shard: int  # number of points in one file of results

    def __len__(self) -> int:
        return math.prod(map(len, self.values))

    @property
    def shards(self) -> int:
        return -(-len(self) // self.points_per_shard)

    def points(self, shard: int) -> Iterator[Point]:
        first = shard * self.points_per_shard
        last = min(first + self.points_per_shard, len(self))
        for index, chosen in enumerate(itertools.islice(itertools.product(*self.values), first, last), first):
            entries = tuple(zip(self.places, chosen, strict=False))
            scaled = zip(self.names[len(self.places) :], chosen[len(self.places) :], strict=True)
            factors: dict[str, Any] = {name.removeprefix("scale."): float(value) for name, value in scaled}
            yield Point(index, entries, TaskChange(**factors), tuple(_text(value) for value in chosen))

    def digest(self) -> str:
        """Digest of everything on which results depend, except the files that the study names."""
        parts = [__version__, self.run, self.points_per_shard, self.names, self.values]
        text = json.dumps(parts, default=str).encode()
        return hashlib.sha256(self.document.content + b"\0" + text).hexdigest()


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep from its file.

    Args:
        path: YAML: ``study`` (path relative to it), ``vary`` (lists of values by place in the study file, such as
            ``supply.voltage``), ``scale`` (lists of factors on ``payload``, ``time``, ``voltage``, ``force``), ``run``
            (``select`` or ``size``), ``points_per_shard``.

    Returns:
        The sweep; its study file has been read but not checked.

    Raises:
        InputError: Every fault of the file.
    """
    document = read_document(path)
    form, faults, places = read_form(SweepForm, document)
    ledger = Ledger(document, faults, places)
    spoiled = ledger.spoiled(("study",))
    study = None if spoiled else ledger.attempt(("study",), read_document, document.folder / form.study)
    entries = {} if study is None else _places(form, study, ledger)
    scale = {name: getattr(form.scale, name) for name in document.data.get("scale") or {} if given(form.scale, name)}
    if not form.vary and not scale and not ledger.faults:
        ledger.fault((), "must vary something: give 'vary' or 'scale'")
    names, values = (*form.vary, *(f"scale.{name}" for name in scale)), (*form.vary.values(), *scale.values())
    if (points := math.prod(map(len, values))) > MOST_POINTS:
        ledger.fault((), f"asks for {points} points; {MOST_POINTS} are allowed")
    ledger.raise_any()
    assert study is not None
    return Sweep(study, names, values, tuple(entries.values()), form.run, form.points_per_shard)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _places(form: SweepForm, study: Document, ledger: Ledger) -> dict[str, Place]:
    """Places of the varied entries in the study file, by name; faults are added to ``ledger``."""
    found: dict[str, Place] = {}
    for name in form.vary:
        try:
            place = place_of(study, name)
        except InputError as error:
            ledger.fault(("vary", name), error.faults[0].problem, hint=error.faults[0].hint)
            continue
        within = [other for other, one in found.items() if all(a == b for a, b in zip(one, place, strict=False))]
        if within:
            ledger.fault(("vary", name), f"lies within, or around, {within[0]}")
        found[name] = place
    return found
