"""Files and functions stay small enough to be read at one go."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "drivetrain"
FILES = sorted(PACKAGE.rglob("*.py"))
LONGEST_FILE = 400
LONGEST_BODY = 50
MOST_ARGUMENTS = 8
LONG_KERNEL = "# long kernel:"  # a compiled kernel may be longer where splitting it costs speed, and says so


def body_lines(node: ast.FunctionDef) -> int:
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


def is_excused(node: ast.FunctionDef, lines: list[str]) -> bool:
    first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
    above = lines[max(0, first - 4) : node.lineno]
    return any(LONG_KERNEL in line for line in above)


def is_compiled(node: ast.FunctionDef) -> bool:
    """A compiled kernel takes arrays one by one, as compiled code must."""
    return any("njit" in ast.unparse(decorator) for decorator in node.decorator_list)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_sizes(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    assert len(lines) <= LONGEST_FILE
    functions = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    long = {f.name: body_lines(f) for f in functions if body_lines(f) > LONGEST_BODY and not is_excused(f, lines)}
    assert long == {}
    excused = path.name == "modern_robotics.py"  # the book's own signatures
    crowded = [f.name for f in functions if len(f.args.args) > MOST_ARGUMENTS and not is_compiled(f) and not excused]
    assert [name for name in crowded if not name.startswith("_")] == []
