"""The text of the project stands on its own: no leftover marks, no path of one machine."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = {".py", ".ipynb", ".md", ".toml", ".yaml", ".yml", ".css", ".j2", ".txt", ".cfg", ""}
FORBIDDEN = re.compile(r"/work/|/root/|\.\./shared|\bTODO\b|\bFIXME\b|\bXXX\b|files\.pythonhosted")


def tracked() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    return [ROOT / line for line in listed.stdout.splitlines()]


def test_no_leftovers() -> None:
    own = Path(__file__).resolve()
    files = [p for p in tracked() if p.suffix in TEXT and p.is_file() and p != own and "_data" not in p.parts]
    hits = {
        f"{p.relative_to(ROOT)}:{i}"
        for p in files
        for i, line in enumerate(p.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        if FORBIDDEN.search(line)
    }
    assert hits == set()


def test_top_level_holds_what_the_readme_explains() -> None:
    allowed = {
        "pyproject.toml", "README.md", "CHANGELOG.md", "LICENSE", "Makefile", "drivetrain", "catalogs", "docs",
        "reports", "tests", "examples", "benchmarks", ".ci", ".gitignore",
    }  # fmt: skip
    found = {path.relative_to(ROOT).parts[0] for path in tracked()}
    assert found <= allowed
