"""What a user reads says it in the field's words: messages, help, pages, README and docs."""

from __future__ import annotations

import ast
import inspect
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

import pytest
from click import Command
from typer.main import get_command

import drivetrain as dt
from drivetrain.cli import app
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.verdict_lines import verdict_lines
from drivetrain.sizing.results import Selection

ROOT = Path(__file__).resolve().parents[2]
AVOIDED = {  # what is avoided: what an engineer writes
    r"fell(s|ed)?\b|fallen\b|why .* falls?\b": "rejected",
    r"mend(s|ed|ing)?\b": "fix",
    r"doubt(s|ed|ful)?\b": "warning",
    r"(numbers|report) rests? on\b": "inputs and assumptions",
    r"told, (and )?not judged|only told|reported, not judged": "for information",
    r"(cannot be|not|nothing is|nothing could be) judged\b": "not checked",
    r"of what there is\b": "of the limit",
    r"no set can be below\b": "lower bound",
    r"parted by\b|(is|are) parted\b": "separated by, split",
    r"put aside\b": "filtered out",
    r"next best that|why the others\b": "runners-up, rejected candidates",
    r"all combinations looked at\b": "search nodes",
    r"(for|short time and) for ever\b|repeat(s|ed) for ever, ": "continuous",
    r"(it )?takes back\b": "regenerative capacity",
    r"sheets? (is|are|was|were) silent|silent sheet": "where the data sheet gives no value",
    r"(on|of) (its|the) sheet\b|the sheet (prints|tells|gives|has|lacks)\b": "data sheet",
    r"(?<!data )sheets (hold|lack)\b": "data sheets",
    r"things? (is|are) wrong\b": "errors",
    r"(drives|them|it|set|none|drives are) (do|does|to do) it\b": "meets all limits",
    r"effects (may )?go\b": "are omitted",
    r"wanted reserve\b": "required reserve",
}
NOT_SHOWN = re.compile(r"<details><summary>\d+ cases.*?</details>|\{[{%].*?[%}]\}", re.S)  # a table of the tests, code


def found(text: str) -> list[str]:
    """Every avoided phrase of a text, with what to write instead."""
    return [
        f"{hit.group(0)!r}: write {better!r}"
        for avoided, better in AVOIDED.items()
        for hit in re.finditer(rf"\b(?:{avoided})", text, re.I)
    ]


def is_command(node: ast.AST) -> bool:
    """Whether the docstring of a function is its help on the command line."""
    return isinstance(node, ast.FunctionDef) and any("command" in ast.dump(one) for one in node.decorator_list)


def shown_strings(path: Path) -> Iterator[tuple[int, str]]:
    """Strings of more than a word that the code may show: no docstrings but those of commands."""
    tree, docs = ast.parse(path.read_text(encoding="utf-8")), set()
    for node in ast.walk(tree):
        for one in getattr(node, "body", ()) if not isinstance(node, ast.Lambda | ast.IfExp) else ():
            if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant) and not is_command(node):
                docs.add(id(one.value))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
            if id(node) not in docs:
                yield node.lineno, node.value


def test_the_list_finds_what_it_should() -> None:
    for text in (
        "699 candidates fell",
        "mend: write 5 V",
        "3 things are wrong",
        "told, not judged",
        "parted by commas",
    ):
        assert found(text), text
    for text in ("the torque falls with speed", "it takes 5 s", "separated by commas", "the data sheets lack values"):
        assert not found(text), text


@pytest.mark.parametrize("folder", sorted(p.name for p in (ROOT / "drivetrain").iterdir() if p.is_dir()))
def test_messages_and_help(folder: str) -> None:
    hits = [
        f"{path.relative_to(ROOT)}:{line}: {hit}"
        for path in sorted((ROOT / "drivetrain" / folder).rglob("*.py"))
        for line, text in shown_strings(path)
        for hit in found(text)
    ]
    assert not hits, "\n".join(hits)


def test_help_on_public_names_and_the_schema() -> None:
    documented = {name: getattr(dt, name) for name in dt.__all__ if isinstance(getattr(dt, name), type | FunctionType)}
    for name, one in list(documented.items()):
        members = vars(one).items() if isinstance(one, type) else ()
        documented |= {f"{name}.{part}": member for part, member in members if not part.startswith("_")}
    hits = [f"{name}: {hit}" for name, one in documented.items() for hit in found(inspect.getdoc(one) or "")]
    assert not hits, "\n".join(hits)
    assert not found(json.dumps(dt.json_schema()))


def test_readme_docs_and_templates() -> None:
    files = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "drivetrain").rglob("*.j2")]
    files += [path for path in (ROOT / "examples").rglob("*") if path.suffix in (".yaml", ".ipynb")]
    hits = [
        f"{path.name}: {hit}" for path in files for hit in found(NOT_SHOWN.sub("", path.read_text(encoding="utf-8")))
    ]
    assert not hits, "\n".join(hits)


def test_a_report_and_the_terminal(selection: Selection) -> None:
    page = re.sub(r"<(style|script)\b[^>]*>.*?</\1>", "", html_report(selection), flags=re.S)
    assert not found(re.sub(r"<[^>]+>", " ", page))
    assert not found("\n".join(line.plain for line in verdict_lines(selection)))


def commands(group: Command) -> Iterator[Command]:
    """A command and all below it."""
    yield group
    for one in getattr(group, "commands", {}).values():
        yield from commands(one)


def test_brackets_in_help_texts_are_shown() -> None:
    """A word in square brackets is markup there: it vanishes unless a backslash stands before it."""
    texts = [
        text for one in commands(get_command(app)) for text in (one.help, *(getattr(x, "help", "") for x in one.params))
    ]
    assert len(texts) > 100
    assert [text for text in texts if re.search(r"(?<!\\)\[/?[a-z#@]", text or "")] == []
