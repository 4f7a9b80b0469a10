"""What the README names exists: functions, test files, pages, commands."""

from __future__ import annotations

import re
from pathlib import Path

import drivetrain as dt

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SOURCE = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "drivetrain").rglob("*.py"))


def chapter_rows() -> list[list[str]]:
    section = README.split("## The chapter, section by section")[1].split("\n## ")[0]
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


def test_no_place_is_left_open() -> None:
    assert "<!--" not in README


def test_files_that_are_named_exist() -> None:
    for name in re.findall(r"`((?:catalogs|examples|reports|benchmarks|drivetrain)/[\w./-]+)`", README):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"\]\(((?!http)[^)#]+)\)", README):
        assert (ROOT / name).exists(), name
