"""A study's file with its drives named: the user's own text and comments, and what was chosen beside them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

import yaml

from drivetrain.errors import Fault, InputError
from drivetrain.study.document import Place, compose_document, read_document
from drivetrain.study.written import file_places, scalar

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
    """Names of files, started from another folder."""
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
