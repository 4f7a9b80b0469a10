"""The file of a sweep, and the points that it asks for: every combination of the values it varies."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivetrain.errors import Fault, InputError, nearest
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.document import Document, Place, place_of, read_document, varied
from drivetrain.study.model import Study
from drivetrain.study.read import study_from
from drivetrain.version import __version__

SCHEMA_VERSION = 1
FACTORS = ("payload", "time", "voltage")
"""What ``scale`` may hold: factors on payload, on the length of the cycle, on the supply's voltage."""

SELECT, SIZE = "select", "size"
MOST_POINTS = 10_000_000
_KNOWN = ("schema_version", "study", "vary", "scale", "run", "points_per_shard")


@dataclass(frozen=True)
class Point:
    """One study of a sweep."""

    index: int  # from 0, in the order in which values vary, the last one fastest
    entries: tuple[tuple[Place, Any], ...]  # new values of the study file, by place
    change: TaskChange  # of the task
    texts: tuple[str, ...]  # what is varied and to what, in words, in the order of ``Sweep.names``


@dataclass(frozen=True, eq=False)
class Sweep:
    """What is varied, and what is done at each point."""

    document: Document  # the study file
    names: tuple[str, ...]  # of what is varied: places in the study file, then ``scale.payload`` and its like
    values: tuple[tuple[Any, ...], ...]  # of each, in the order given
    places: tuple[Place, ...]  # of those that are entries of the study file
    run: str  # ``select`` drives at each point, or ``size`` those that the study gives
    points_per_shard: int  # how many are kept in one file

    def __len__(self) -> int:
        size = 1
        for values in self.values:
            size *= len(values)
        return size

    @property
    def shards(self) -> int:
        """Number of files."""
        return -(-len(self) // self.points_per_shard)

    def points(self, shard: int) -> Iterator[Point]:
        """The points of one file."""
        first = shard * self.points_per_shard
        last = min(first + self.points_per_shard, len(self))
        for index, chosen in enumerate(itertools.islice(itertools.product(*self.values), first, last), first):
            entries = tuple(zip(self.places, chosen, strict=False))
            factors = dict(zip(self._factors, map(float, chosen[len(self.places) :]), strict=True))
            payload, time, voltage = (factors.get(f"scale.{name}", 1.0) for name in FACTORS)
            change = TaskChange(payload=payload, time=time, voltage=voltage)
            yield Point(index, entries, change, tuple(_text(value) for value in chosen))

    @property
    def _factors(self) -> tuple[str, ...]:
        """What is scaled."""
        return self.names[len(self.places) :]

    def digest(self) -> str:
        """What results depend on besides the files that the study names: two sweeps with the same one are one."""
        told = [__version__, self.run, self.points_per_shard, self.names, self.values]
        text = json.dumps(told, default=str).encode()
        return hashlib.sha256(self.document.content + b"\0" + text).hexdigest()


def read_sweep(path: str | Path) -> Sweep:
    """A sweep from its file.

    Args:
        path: YAML: ``study`` (a file beside it), ``vary`` (lists of values by place in the study file, such as
            ``supply.voltage``), ``scale`` (lists of factors on ``payload``, ``time``, ``voltage``), ``run`` (``select``
            or ``size``), ``points_per_shard``.

    Returns:
        The sweep; its study file has been read, not yet checked.

    Raises:
        InputError: Every fault of the file.
    """
    document = read_document(path)
    data, faults = document.data, []
    faults += [
        document.fault((name,), "is not known here", name, nearest(name, _KNOWN)) for name in data if name not in _KNOWN
    ]
    version = data.get("schema_version", SCHEMA_VERSION)
    if version != SCHEMA_VERSION:
        faults.append(document.fault(("schema_version",), f"must be {SCHEMA_VERSION}", version))
    run = data.get("run", SELECT)
    if run not in (SELECT, SIZE):
        faults.append(document.fault(("run",), f"must be {SELECT} or {SIZE}", run))
    size = data.get("points_per_shard", 8)
    if not isinstance(size, int) or isinstance(size, bool) or size < 1:
        faults.append(document.fault(("points_per_shard",), "must be a whole number from 1", size))
    study = _study(document, faults)
    vary, scale = _lists(document, "vary", faults), _lists(document, "scale", faults)
    places = _places(document, study, vary, faults)
    faults += _scale_faults(document, scale)
    if not faults and not vary and not scale:
        faults.append(document.fault((), "must vary something: give 'vary' or 'scale'"))
    if faults or study is None:
        raise InputError(faults)
    names = (*vary, *(f"scale.{name}" for name in scale))
    sweep = Sweep(study, names, (*vary.values(), *scale.values()), places, run, size)
    if len(sweep) > MOST_POINTS:
        raise InputError(document.fault((), f"asks for {len(sweep)} points; {MOST_POINTS} are allowed"))
    return sweep


def study_of(sweep: Sweep, point: Point) -> Study:
    """The study of one point, its task not yet changed."""
    return study_from(varied(sweep.document, dict(point.entries)))


def task_of(study: Study, point: Point) -> Study:
    """The study of one point with its task changed."""
    return changed(study, point.change)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _study(document: Document, faults: list[Fault]) -> Document | None:
    """The study file that a sweep names."""
    name = document.data.get("study")
    if not isinstance(name, str):
        faults.append(document.fault(("study",), "must name a study file", name))
        return None
    try:
        return read_document(document.folder / name)
    except InputError as error:
        faults += error.faults
        return None


def _lists(document: Document, part: str, faults: list[Fault]) -> dict[str, tuple[Any, ...]]:
    """Names with lists of values."""
    found = document.data.get(part, {})
    if not isinstance(found, dict):
        faults.append(document.fault((part,), "must be a mapping of names to lists of values", found))
        return {}
    lists: dict[str, tuple[Any, ...]] = {}
    for name, values in found.items():
        if not isinstance(values, list) or not values:
            faults.append(document.fault((part, name), "must be a list of values, such as [24 V, 48 V]", values))
        elif len({_text(value) for value in values}) < len(values):
            faults.append(document.fault((part, name), "lists a value twice", values))
        else:
            lists[name] = tuple(values)
    return lists


def _places(
    document: Document, study: Document | None, vary: dict[str, tuple[Any, ...]], faults: list[Fault]
) -> tuple[Place, ...]:
    """Where the varied entries stand in the study file."""
    found: list[Place] = []
    for name in vary if study else ():
        try:
            place = place_of(study, name)  # type: ignore[arg-type]
        except InputError as error:
            fault = error.faults[0]
            faults.append(document.fault(("vary", name), fault.problem, hint=fault.hint))
            continue
        within = [spelled for other, spelled in zip(found, vary, strict=False) if _nested(other, place)]
        if within:
            faults.append(document.fault(("vary", name), f"lies within, or around, {within[0]}"))
        found.append(place)
    return tuple(found)


def _nested(one: Place, other: Place) -> bool:
    shorter = min(len(one), len(other))
    return one[:shorter] == other[:shorter]


def _scale_faults(document: Document, scale: dict[str, tuple[Any, ...]]) -> list[Fault]:
    """Factors that are none."""
    faults = []
    for name, values in scale.items():
        place: Place = ("scale", name)
        if name not in FACTORS:
            faults.append(document.fault(place, "is nothing that can be scaled", name, nearest(name, FACTORS)))
            continue
        for value in values:
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not (0.0 if name == "payload" else 1e-9) <= value < float("inf"):
                faults.append(document.fault(place, "must be positive factors, such as [0.8, 1, 1.25]", value))
    return faults
