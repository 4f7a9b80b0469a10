"""Converts studies between nested Python mappings and the text of a study file."""

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

VERSION = "schema_version"  # kept as a plain number, not a quantity with a unit
SHIPPED = "shipped"


def python_document(entries: Mapping[str, Any]) -> Document:
    """The document of a study given as Python mappings; bare numbers are in SI."""
    data = {str(name): value if name == VERSION else plain(value, str(name)) for name, value in entries.items()}
    content = json.dumps(data, sort_keys=True, default=str).encode()
    return Document(Path("study"), content, data, {})


def plain(value: Any, place: str) -> Any:
    """Convert Python values to those of a study file: mappings, lists, texts, and numbers in SI."""
    if value is None or isinstance(value, bool | np.bool_ | SI):
        return bool(value) if isinstance(value, np.bool_) else value
    if isinstance(value, Enum | Path | str):
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
    """The text of a study file at ``place``; names of other files become relative to that folder (default: cwd)."""
    data = copy.deepcopy(document.data)
    for at in file_places(data):
        name = entry_at(data, at)
        if not Path(name).is_absolute():
            entry_at(data, at[:-1])[at[-1]] = os.path.relpath(document.folder / name, place)
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
    """Places at which a study names files or folders, except the shipped catalogue and files of ROS packages."""
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
    forces = data.get("forces") or {}
    yield from (("forces", name, "file") for name, force in forces.items() if force and "file" in force)
    listed = [((), catalogs)] if isinstance(catalogs, str) else [((i,), name) for i, name in enumerate(catalogs or ())]
    yield from (("catalogs", *at) for at, name in listed if name != SHIPPED)


def entry_at(data: Any, place: Place) -> Any:
    return reduce(getitem, place, data)


class _Dumper(yaml.SafeDumper):
    """Writes tables as blocks of lines, and short lists of numbers in one line."""


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style="|" if "\n" in value else None)


def _list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.SequenceNode:
    nested = any(isinstance(one, list | dict) for one in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=not nested)


_Dumper.add_representer(str, _text)
_Dumper.add_representer(list, _list)


# Write chosen drives into the text of a study file; the user's text and comments are kept


Edit = tuple[int, int, str]  # start, end, replacement text


def with_drives(path: str | Path, target: Path, drives: Mapping[str, Mapping[str, str]]) -> str:
    """The text of a study file with the given drives written into it.

    Args:
        path: The study file.
        target: File to which the text will be written; names of other files become relative to its folder.
        drives: By joint name, the keys of ``motor`` and ``gear`` ("": none), ``brake``, ``amplifier`` to write.
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
    """Edits that write the chosen parts at the beginning of each joint's entry; existing entries are replaced."""
    joints = next(value for key, value in root.value if key.value == "joints")
    own, fresh = _entries(joints), []
    if any(value.start_mark.index < key.start_mark.index for key, value in joints.value):
        problem, hint = "is written with anchors, which cannot be changed one by one", "write each joint's entry out"
        raise InputError(Fault("joints", problem, hint=hint, file=file))
    for name, keys in drives.items():
        named = {part: scalar(key) for part, key in keys.items() if part not in ("motor", "gear")}
        if "motor" in keys:
            named["drive"] = f"{{motor: {scalar(keys['motor'])}, gear: {scalar(keys['gear'] or 'none')}}}"
        node, whole = own.get(name), f"{{{', '.join(f'{part}: {value}' for part, value in named.items())}}}"
        if node is None:
            fresh.append(f"{scalar(name)}: {whole}")
            continue
        if not isinstance(node, yaml.MappingNode):  # a key without a value
            yield node.start_mark.index, node.end_mark.index, f" {whole}"
            continue
        there = _entries(node)
        for part in [part for part in named if part in there]:
            yield there[part].start_mark.index, _end(there[part]), named.pop(part)
        yield from _inserted(node, [f"{part}: {value}" for part, value in named.items()])
    yield from _inserted(joints, fresh)


def _inserted(mapping: yaml.MappingNode, entries: list[str]) -> Iterator[Edit]:
    """Edits that insert entries before the first one of a mapping, in the style of the mapping."""
    if not entries:
        return
    if mapping.flow_style or not mapping.value:
        start = mapping.start_mark.index + 1
        yield start, start, ", ".join(entries) + (", " if mapping.value else "")
        return
    first = mapping.value[0][0].start_mark
    yield first.index, first.index, "".join(f"{entry}\n{' ' * first.column}" for entry in entries)


def _end(node: yaml.Node) -> int:
    """Index of the end of a value, without the blanks and comments after it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


def _entries(node: yaml.Node | None) -> dict[str, yaml.Node]:
    """Value nodes of a mapping by name; empty for any other node."""
    return {key.value: value for key, value in node.value} if isinstance(node, yaml.MappingNode) else {}
