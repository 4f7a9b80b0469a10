"""The tower stands: a module imports only from floors below its own or from its own folder, and nothing goes round."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "drivetrain"
FLOORS = {
    "errors": 1, "version": 1, "face": 2, "jit": 1,
    "arrays": 2, "units": 2, "whole_files": 2, "records": 2, "vector": 2, "call_address": 2,
    "notebook": 2,
    "spatial": 3, "drive": 3, "motion": 3, "solvers": 3,
    "arm": 4, "catalog": 4, "effects": 4,
    "study": 5, "dynamics": 5,
    "sizing": 6, "simulation": 6,
    "report": 7, "accuracy": 7, "export": 7, "sweep": 7, "identification": 8, "control": 7,
    "commands": 9, "modern_robotics": 9, "cli": 10, "__main__": 11,
}  # fmt: skip

SIZING = {
    "results": 0,
    "tables": 0,
    "demand": 1,
    "judge": 2,
    "as_one": 3,
    "tolerance": 3,
    "search": 4,
    "answers": 5,
    "currents": 6,
    "deflection": 6,
}


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py")) if path.parent.name != "_data"}


@cache
def imports(name: str) -> set[str]:
    """Modules of the package that a module imports, late imports and type-only imports included."""
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            base = node.module or ""
            found |= {f"{base}.{a.name}" if f"{base}.{a.name}" in MODULES else base for a in node.names}
    return {module for module in found if module == "drivetrain" or module.startswith("drivetrain.")}


def part(name: str) -> str:
    return name.split(".")[1] if "." in name else ""


def pairs() -> Iterator[tuple[str, str]]:
    """Every module beside each one that it imports, except what any module may import."""
    for name in MODULES:
        if name != "drivetrain":
            yield from ((name, target) for target in sorted(imports(name)) if target != "drivetrain.version")


def test_every_folder_has_a_floor() -> None:
    assert {part(name) for name in MODULES if name != "drivetrain"} <= set(FLOORS)


def test_imports_exist_and_are_not_the_package_root() -> None:
    assert [pair for pair in pairs() if pair[1] not in MODULES or pair[1] == "drivetrain"] == []


def test_imports_only_downwards() -> None:
    wrong = [
        (name, target) for name, target in pairs()
        if part(target) != part(name) and not FLOORS[part(target)] < FLOORS[part(name)]
    ]  # fmt: skip
    assert wrong == []


def test_rooms_of_sizing_look_downwards_too() -> None:
    def room(name: str) -> str:
        return name.split(".")[2]

    within = [pair for pair in pairs() if pair[0].count(".") > 2 and all(part(one) == "sizing" for one in pair)]
    wrong = [
        (name, target) for name, target in within
        if target.count(".") > 1 and room(target) != room(name) and not SIZING[room(target)] < SIZING[room(name)]
    ]  # fmt: skip
    assert within and wrong == []


def test_no_import_cycles() -> None:
    graph = {name: imports(name) & set(MODULES) for name in MODULES if name != "drivetrain"}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"import cycle: {error.args[1]}")
