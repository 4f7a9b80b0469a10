"""What ``dt`` shows says what it is, names every argument and nothing else; inside, a module says what it is for."""

from __future__ import annotations

import ast
import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

import drivetrain as dt
from drivetrain.face import homes

PACKAGE = Path(__file__).resolve().parents[2] / "drivetrain"
FILES = sorted(PACKAGE.rglob("*.py"))
PUBLIC = {(home, name) for room in dt._ROOMS for name, home in homes(f"drivetrain.{room}").items()}
SECTION = re.compile(r"^(Args|Returns|Raises|Reference|References|Attributes|Yields|Example|Examples|Note|Notes):")


def public_definitions(tree: ast.Module, shown: set[str]) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    """What the package root shows of a module, with the methods of its classes; an override inherits its docstring."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name in shown:
            yield node
            if isinstance(node, ast.ClassDef) and not node.bases:
                yield from (
                    item for item in node.body if isinstance(item, ast.FunctionDef) and not item.name.startswith("_")
                )


def signature(node: ast.FunctionDef) -> set[str]:
    arguments = node.args
    several = [arguments.vararg] if arguments.vararg else []
    names = [a.arg for a in [*arguments.posonlyargs, *arguments.args, *several, *arguments.kwonlyargs]]
    return set(names) - {"self", "cls"}


def section(doc: str, name: str) -> list[str]:
    lines, inside = [], False
    for line in doc.splitlines():
        if SECTION.match(line):
            inside = line.startswith(name + ":")
        elif inside:
            lines.append(line)
    return lines


def named(lines: list[str]) -> set[str]:
    """Names before the colon of each entry (entries stand at the smallest indentation of the section)."""
    filled = [line for line in lines if line.strip()]
    if not filled:
        return set()
    indent = min(len(line) - len(line.lstrip()) for line in filled)
    heads = [line.strip().split(":")[0] for line in filled if len(line) - len(line.lstrip()) == indent]
    return {name.strip() for head in heads for name in head.split(",")}


def faults(path: Path) -> list[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = [] if ast.get_docstring(tree) else ["the module has no docstring"]
    home = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    for node in public_definitions(tree, {name for place, name in PUBLIC if place == home}):
        doc = ast.get_docstring(node)
        if not doc:
            found.append(f"{node.name} has no docstring")
        elif isinstance(node, ast.FunctionDef):
            arguments, documented = signature(node), named(section(doc, "Args"))
            if arguments != documented:
                found.append(f"{node.name}: takes {sorted(arguments)}, documents {sorted(documented)}")
        elif any("dataclass" in ast.unparse(d) for d in node.decorator_list):
            own = {i.target.id for i in node.body if isinstance(i, ast.AnnAssign) and isinstance(i.target, ast.Name)}
            own = {name for name in own if not name.startswith("_")}
            whole = {field.name for field in dataclasses.fields(getattr(dt, node.name))}
            documented = named(section(doc, "Attributes"))
            if not own <= documented <= whole:
                found.append(f"{node.name}: has {sorted(own)}, documents {sorted(documented)}")
    return found


def test_docstrings_name_every_argument() -> None:
    found = {str(path.relative_to(PACKAGE)): faults(path) for path in FILES}
    assert {name: own for name, own in found.items() if own} == {}
