"""A study without a file: from nested mappings of Python, and back to the text of a study file."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drivetrain.arm.files.load import SUFFIXES
from drivetrain.arm.files.xml import PACKAGE
from drivetrain.errors import Fault, InputError
from drivetrain.study.document import Document, Place, compose_document, read_document
from drivetrain.units import PURE, SI

VERSION = "schema_version"  # which is reported by itself, not measured
SHIPPED = "shipped"


def python_document(entries: Mapping[str, Any]) -> Document:
    """The document of a study that Python states; bare numbers count in SI."""
    data = {str(name): value if name == VERSION else plain(value, str(name)) for name, value in entries.items()}
    content = json.dumps(data, sort_keys=True, default=str).encode()
    return Document(Path("study"), content, data, {})


def plain(value: Any, place: str) -> Any:
    """Python's values as a file has them: mappings, lists, texts, and numbers in SI."""
    if value is None or isinstance(value, bool | np.bool_ | SI):
        return bool(value) if isinstance(value, np.bool_) else value
    if isinstance(value, Enum | Path):
        return str(value)
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int | float | np.number):
        return SI(value)
    if is_dataclass(value) and not isinstance(value, type):
        stated = {one.name: getattr(value, one.name) for one in fields(value)}
        return plain({name: one for name, one in stated.items() if one is not None}, place)
    if isinstance(value, Mapping):
        return {str(name): plain(one, f"{place}.{name}") for name, one in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist(), place)
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(one, f"{place}[{i}]") for i, one in enumerate(value)]
    raise InputError(Fault(place, f"a study cannot hold a {type(value).__name__}"))


def written(document: Document, place: Path = Path()) -> str:
    """The text of a study file; names of other files start from its place, left out: where this is called."""
    data = copy.deepcopy(document.data)
    _relocate(data, document.folder, place)
    ordered = {name: data[name] for name in ("schema_version", "name") if name in data} | data
    return yaml.dump(_with_units(ordered), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120)


def scalar(text: str) -> str:
    """A text as YAML writes it inside a list."""
    return str(yaml.safe_dump([text], default_flow_style=True, width=10_000, allow_unicode=True).strip()[1:-1])


def _with_units(value: Any) -> Any:
    if isinstance(value, SI):
        number = int(value) if value.is_integer() and abs(value) < 1e15 else float(value)
        return number if value.unit is None or value.unit in PURE else f"{number!r} {value.unit}"
    if isinstance(value, dict):
        return {name: _with_units(one) for name, one in value.items()}
    return [_with_units(one) for one in value] if isinstance(value, list) else value


def file_places(data: Mapping[str, Any]) -> Iterator[Place]:
    """Where the data of a study name files and folders, the shipped catalogue and files of ROS packages left out."""
    arm, catalogs = data.get("arm"), data.get("catalogs")
    named = {(): arm} if isinstance(arm, str) else {(name,): arm.get(name) for name in ("source", "dh")} if arm else {}
    yield from (
        ("arm", *at)
        for at, name in named.items()
        if name and (at == ("dh",) or (Path(name).suffix.lower() in SUFFIXES and not name.startswith(PACKAGE)))
    )
    motions: dict[Place, Any] = {("motions", name): one for name, one in data["motions"].items()}
    motions["base", "motion"] = (data.get("base") or {}).get("motion")
    for place, motion in motions.items():
        yield from ((*place, name) for name in ("file", "table") if motion and name in motion)
    listed = [((), catalogs)] if isinstance(catalogs, str) else [((i,), name) for i, name in enumerate(catalogs or ())]
    yield from (("catalogs", *at) for at, name in listed if name != SHIPPED)


def entry_at(data: Any, place: Place) -> Any:
    return reduce(getitem, place, data)


def _relocate(data: dict[str, Any], folder: Path, place: Path) -> None:
    """Names of files, from those of the study's folder to those of another."""
    for at in file_places(data):
        name = entry_at(data, at)
        if not Path(name).is_absolute():
            entry_at(data, at[:-1])[at[-1]] = os.path.relpath(folder / name, place)


class _Dumper(yaml.SafeDumper):
    """Tables as blocks of lines, short lists of numbers in one line."""


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style="|" if "\n" in value else None)


def _list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.SequenceNode:
    nested = any(isinstance(one, list | dict) for one in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=not nested)


_Dumper.add_representer(str, _text)
_Dumper.add_representer(list, _list)


# A study's file with its drives named: the user's own text and comments, and what was chosen beside them


Edit = tuple[int, int, str]  # from, to, and what stands there instead


def with_drives(path: str | Path, target: Path, drives: Mapping[str, Mapping[str, str]]) -> str:
    """The text of a study with its drives named; names of other files start from the folder of the target.

    ``drives``: by joint what is named there, ``motor`` and ``gear`` ("": none), ``brake``, ``amplifier``.
    """
    document = read_document(path)
    text, root = compose_document(document)
    edits = [*_paths(root, document.folder, target.parent), *_joints(root, drives, str(path))]
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return f"# Drives named by drivetrain select; all else as in {Path(path).name}.\n{text}"


def _paths(root: yaml.MappingNode, old: Path, new: Path) -> Iterator[Edit]:
    if old.resolve() == new.resolve():
        return
    data = yaml.SafeLoader("").construct_document(root)
    for node in (_node_at(root, place) for place in file_places(data)):
        name = node.value
        if not Path(name).is_absolute():
            moved = Path(os.path.relpath(old / name, new)).as_posix()
            yield node.start_mark.index, node.end_mark.index, scalar(moved)


def _node_at(node: yaml.Node, place: Place) -> yaml.Node:
    for name in place:
        node = node.value[name] if isinstance(name, int) else _entries(node)[name]
    return node


def _joints(root: yaml.MappingNode, drives: Mapping[str, Mapping[str, str]], file: str) -> Iterator[Edit]:
    """What is chosen, written at the beginning of each joint's entry; entries that are there are replaced."""
    joints = next(value for key, value in root.value if key.value == "joints")
    own, fresh = _entries(joints), []
    if any(value.start_mark.index < key.start_mark.index for key, value in joints.value):
        hint = "write each joint's entry out"
        raise InputError(
            Fault("joints", "is written with anchors, which cannot be changed one by one", hint=hint, file=file)
        )
    for name, keys in drives.items():
        named = {part: scalar(key) for part, key in keys.items() if part not in ("motor", "gear")}
        if "motor" in keys:
            named["drive"] = f"{{motor: {scalar(keys['motor'])}, gear: {scalar(keys['gear'] or 'none')}}}"
        node, whole = own.get(name), f"{{{', '.join(f'{part}: {value}' for part, value in named.items())}}}"
        if node is None:
            fresh.append(f"{scalar(name)}: {whole}")
            continue
        if not isinstance(node, yaml.MappingNode):  # a name with nothing behind it
            yield node.start_mark.index, node.end_mark.index, f" {whole}"
            continue
        there = _entries(node)
        for part in [part for part in named if part in there]:
            yield there[part].start_mark.index, _end(there[part]), named.pop(part)
        yield from _inserted(node, [f"{part}: {value}" for part, value in named.items()])
    yield from _inserted(joints, fresh)


def _inserted(mapping: yaml.MappingNode, entries: list[str]) -> Iterator[Edit]:
    """Entries before the first one of a mapping, in its own style."""
    if not entries:
        return
    if mapping.flow_style or not mapping.value:
        start = mapping.start_mark.index + 1
        yield start, start, ", ".join(entries) + (", " if mapping.value else "")
        return
    first = mapping.value[0][0].start_mark
    yield first.index, first.index, "".join(f"{entry}\n{' ' * first.column}" for entry in entries)


def _end(node: yaml.Node) -> int:
    """Where a value ends, without the blanks and comments after it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


def _entries(node: yaml.Node | None) -> dict[str, yaml.Node]:
    """The values of a mapping by name; none of anything else."""
    return {key.value: value for key, value in node.value} if isinstance(node, yaml.MappingNode) else {}
