"""A YAML file as data with the line of every entry; duplicate keys and syntax errors are faults with a line."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from drivetrain.errors import Fault, InputError, close_names, nearest, plain, raise_faults
from drivetrain.whole_files import read_bytes

Place = tuple[str | int, ...]  # keys and list positions from the top, such as ("joints", "elbow", "drive")

_DEEPEST = 20
_LARGEST = 4 << 20  # bytes
_MOST_ENTRIES = 100_000  # counting each use of an anchor
_LONGEST_TEXT = 20_000  # characters
_MOST_SHOWN = 60  # characters shown of an invalid name
_MOST_NAMED = 5  # files listed when a folder is given instead of a study file
_PLAIN = ("tag:yaml.org,2002:map", "tag:yaml.org,2002:seq")
_MERGE_KEY = "tag:yaml.org,2002:merge"


@dataclass(frozen=True, eq=False)
class Document:
    """One YAML file, read."""

    path: Path  # as given by the caller
    content: bytes  # its bytes
    data: dict[str, Any]  # nested dictionaries, lists, texts and numbers; keys are texts
    lines: dict[Place, int]  # line of each entry, from 1, by place

    @property
    def folder(self) -> Path:
        """Folder to which relative file names in the document refer."""
        return self.path.parent

    def where(self, place: Place) -> str:
        """File and line of an entry, or of the nearest entry that contains it; empty if there is no file."""
        if not self.lines:
            return ""
        for end in range(len(place), 0, -1):
            line = self.lines.get(place[:end])
            if line is not None:
                return f"{self.path}:{line}"
        return str(self.path)

    def fault(self, place: Place, problem: str, value: object = None, hint: str = "") -> Fault:
        """A fault of this file, with its line."""
        return Fault(spelled(place), problem, value, hint, self.where(place))


def spelled(place: Place) -> str:
    """A place as text, such as ``motions.pick.waypoints[2]``; ``the file`` for its top."""
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text or "the file"


def read_document(path: str | Path) -> Document:
    """Read a YAML file with the line of each entry; what is not YAML, and all duplicate keys, are faults."""
    file = Path(path)
    return parsed_document(file, _content(file))


def parsed_document(file: Path, content: bytes) -> Document:
    """Parse a YAML text with the line of each entry; file names in it are relative to the folder of ``file``."""
    node = _root(file, content)
    if not isinstance(node, yaml.MappingNode):
        problem = "must be a mapping of names to values, such as 'name: my arm'"
        raise InputError(Fault("the file", problem, file=str(file)))
    lines: dict[Place, int] = {}
    faults: list[Fault] = []
    data = _data(node, (), file, lines, faults)
    raise_faults(faults)
    return Document(file, content, data, lines)


def compose_document(document: Document) -> tuple[str, yaml.MappingNode]:
    """The text of a document and its YAML nodes, which know their positions in the text."""
    node = _root(document.path, document.content)
    assert isinstance(node, yaml.MappingNode)  # as read
    return document.content.decode("utf-8"), node


def _content(file: Path) -> bytes:
    try:
        content = read_bytes(file, _LARGEST)
        content.decode("utf-8")
    except FileNotFoundError:
        written = [one.name for one in file.parent.glob("*.y*ml")]
        hint = close_names(file.name, written) or "drivetrain init writes one"
        raise InputError(Fault("the study file", "does not exist", str(file), hint)) from None
    except IsADirectoryError:
        inside = sorted(one.name for one in file.glob("*.y*ml"))[:_MOST_NAMED]
        hint = f"it holds {', '.join(inside)}" if inside else "drivetrain init writes a study"
        raise InputError(Fault("the study file", "is a folder", str(file), hint)) from None
    except UnicodeDecodeError as error:
        raise InputError(Fault(f"byte {error.start}", "the file must be UTF-8 text", file=str(file))) from None
    except InputError:
        raise
    except (OSError, ValueError) as error:  # no right to read it, or no name that a file can have
        raise InputError(Fault("the study file", f"cannot be read: {error}", str(file))) from None
    return content


class _Loader(yaml.SafeLoader):
    """Loader that stops with an error at more entries than any study needs."""

    entries = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose one node and count it."""
        self.entries += 1
        if self.entries > _MOST_ENTRIES:
            raise yaml.YAMLError(f"it has more than {_MOST_ENTRIES} entries; long series belong in a CSV file")
        return super().compose_node(parent, index)  # type: ignore[no-any-return, no-untyped-call]


def _root(file: Path, content: bytes) -> yaml.Node | None:
    try:
        return yaml.compose(content.decode("utf-8"), Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{file}:{mark.line + 1}" if mark else str(file)
        column = f"column {mark.column + 1}" if mark else "the file"
        words = " ".join(part for part in (error.problem, error.context) if part)
        raise InputError(Fault(column, f"is not YAML: {words}", hint=_yaml_hint(words), file=where)) from None
    except yaml.YAMLError as error:
        raise InputError(Fault("the file", f"is not YAML: {error}", file=str(file))) from None
    except RecursionError:
        raise InputError(Fault("the file", "nests too deeply", file=str(file))) from None


def _yaml_hint(words: str) -> str:
    if "\\t" in words:
        return "indent with spaces, not tabs"
    if "mapping values are not allowed" in words:
        return (
            "here or in the line before a key lacks its colon or the space after it; entries must be indented alike, "
            "and a colon inside a text needs quotes around the text"
        )
    if "block end" in words:
        return "entries of one list or mapping must be indented alike, all with a dash in front or all without"
    return ""


def _data(node: yaml.Node, place: Place, file: Path, lines: dict[Place, int], faults: list[Fault]) -> Any:
    """The value of a node; fills ``lines`` and ``faults``."""
    lines.setdefault(place, node.start_mark.line + 1)
    if len(lines) > _MOST_ENTRIES:
        raise InputError(Fault("the file", f"its anchors stand for more than {_MOST_ENTRIES} entries", file=str(file)))
    problem = _refused(node, place)
    if problem:
        faults.append(Fault(spelled(place), problem, file=f"{file}:{node.start_mark.line + 1}"))
        return None
    if isinstance(node, yaml.MappingNode):
        return _mapping(node, place, file, lines, faults)
    if isinstance(node, yaml.SequenceNode):
        return [_data(item, (*place, i), file, lines, faults) for i, item in enumerate(node.value)]
    try:
        return yaml.SafeLoader("").construct_object(node)
    except (yaml.YAMLError, ValueError) as error:
        where = f"{file}:{node.start_mark.line + 1}"
        faults.append(Fault(spelled(place), f"cannot be read: {error}", node.value, "put it in quotes", where))
        return None


def _refused(node: yaml.Node, place: Place) -> str:
    """Why a node is rejected (a tag, an anchor that contains itself, an unsuitable text); empty if it is accepted."""
    if isinstance(node, yaml.ScalarNode):
        if place[:1] in (("motions",), ("forces",)) and place[2:] == ("samples",):  # a table, however long
            return "" if plain(str(node.value)) == node.value else "has control characters"
        return _refused_text(str(node.value))
    if isinstance(node, yaml.CollectionNode) and node.tag not in _PLAIN:
        return f"has the tag {node.tag}, which a study file has no use for"
    return "nests too deeply" if len(place) > _DEEPEST else ""


def _refused_text(text: str) -> str:
    """Why a text or a name is rejected; empty if it is accepted."""
    if len(text) > _LONGEST_TEXT:
        return f"has {len(text)} characters, more than {_LONGEST_TEXT}"
    return "has control characters" if plain(text) != text else ""


def _mapping(
    node: yaml.MappingNode, place: Place, file: Path, lines: dict[Place, int], faults: list[Fault]
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key_node, value_node in node.value:
        where = f"{file}:{key_node.start_mark.line + 1}"
        if not isinstance(key_node, yaml.ScalarNode) or key_node.tag == _MERGE_KEY:
            faults.append(Fault(spelled(place), "keys must be plain names", hint="write the entries out", file=where))
            continue
        key = str(key_node.value)
        if _refused_text(key):
            shown = Fault(spelled(place), f"a name in it {_refused_text(key)}", key[:_MOST_SHOWN], file=where)
            faults.append(shown)
            continue
        inner = (*place, key)
        if key in found:
            first = lines[inner]
            faults.append(Fault(spelled(inner), f"is given twice, first in line {first}", hint="keep one", file=where))
        lines.setdefault(inner, key_node.start_mark.line + 1)
        found[key] = _data(value_node, inner, file, lines, faults)
    return found


def place_of(document: Document, text: str) -> Place:
    """The place that a text such as ``payloads.box.mass`` names; a missing entry before the last name is a fault."""
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
    changes = json.dumps([[list(place), value] for place, value in entries.items()], sort_keys=True, default=str)
    return replace(document, data=data, content=document.content + b"\n# with " + changes.encode())
