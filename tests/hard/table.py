"""The hard cases as a Markdown table, each measured afresh and held to its criterion.

Run as ``python tests/hard/table.py`` for all, or with ids: ``python tests/hard/table.py T06 T31``.
"""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "agreement"), str(HERE.parents[1])]

from hard_case import CASES  # noqa: E402

HEAD = "| | problem | simple method and its result | drivetrain |\n|---|---|---|---|"


def load_all() -> None:
    """Import every test file of this folder, which registers its cases."""
    for path in sorted(HERE.glob("test_*.py")):
        spec = importlib.util.spec_from_file_location(f"hard_{path.stem}", path)
        if spec is None or spec.loader is None:
            raise ImportError(str(path))
        spec.loader.exec_module(importlib.util.module_from_spec(spec))


def order(id: str) -> tuple[int, str]:
    """T9 before T10, T23a before T23b."""
    number = re.match(r"T(\d+)", id)
    return (int(number[1]) if number else 10**6, id)


def main(wanted: list[str]) -> int:
    """Print the rows as they come; 0 when every case held."""
    load_all()
    unknown = sorted(set(wanted) - set(CASES))
    if unknown:
        print(f"no such case: {', '.join(unknown)}; known: {', '.join(sorted(CASES, key=order))}", file=sys.stderr)
        return 2
    print(HEAD)
    failed = 0
    for id in sorted(wanted or CASES, key=order):
        try:
            print(CASES[id].row(), flush=True)
        except AssertionError as error:
            failed += 1
            print(f"FAILED {error}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
