"""The lowest versions that are tried are those that the package allows."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_what_is_tried_is_what_is_allowed() -> None:
    """``make lowest`` installs the file; who raises a bound must raise it in both."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [*project["dependencies"], *project["optional-dependencies"]["excel"]]
    allowed = {re.sub(r",<.*", "", line).replace(">=", "==") for line in asked}
    lines = (ROOT / ".ci" / "lowest.txt").read_text(encoding="utf-8").splitlines()
    assert {line for line in lines if not line.startswith("#")} == allowed
