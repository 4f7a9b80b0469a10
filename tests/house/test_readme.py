"""What the README and the pages in ``docs/`` name exists: functions, test files, pages, commands."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

import drivetrain as dt

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SOURCE = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "drivetrain").rglob("*.py"))


def chapter_rows() -> list[list[str]]:
    section = (ROOT / "docs" / "chapter.md").read_text(encoding="utf-8")
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")]
    return [row for row in rows[2:] if len(row) == 3]


def quoted(text: str) -> list[str]:
    return re.findall(r"`([^`]+)`", text)


def test_chapter_table_names_functions_and_tests_that_exist() -> None:
    rows = chapter_rows()
    assert len(rows) >= 20
    for topic, functions, tests in rows:
        for name in quoted(functions):
            known = name in dt.__all__ or re.search(rf"^(def|class) {name}\b", SOURCE, re.M)
            path = name.startswith("drivetrain") or (ROOT / "drivetrain" / name).exists()
            assert known or path, f"{topic}: {name}"
        assert quoted(tests), f"{topic}: no test"
        for name in quoted(tests):
            assert (ROOT / "tests" / name).exists(), f"{topic}: tests/{name}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "<!--" not in text, "no place is left open"
    for name in re.findall(r"`((?:catalogs|examples|reports|benchmarks|drivetrain)/[\w./-]+)`", text):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"\]\(((?!http)[^)#]+)\)", text):
        assert (page.parent / name).exists(), name


def test_every_page_is_in_the_site_and_in_the_readme() -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\w+$", "\n".join(re.findall(r"```{toctree}(.*?)```", index, re.S)), re.M))
    assert named == {page.stem for page in PAGES[1:]} - {"index"}
    linked = set(re.findall(r"docs/(\w+\.md)", PAGES[0].read_text(encoding="utf-8")))
    assert {page.name for page in PAGES[1:]} - {"index.md", "reference.md"} <= linked


def test_printed_pages_are_those_of_the_code() -> None:
    """``python docs/tables.py`` writes them."""
    tables = runpy.run_path(str(ROOT / "docs" / "tables.py"))
    for name in ("checks", "effects", "columns"):
        assert (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") == tables[f"{name}_page"]()
