"""Starting is quick: nothing heavy is imported before it is needed."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

HEAVY = ("numba", "scipy", "pandas", "matplotlib", "control", "pint", "pydantic", "yaml", "jinja2", "http")


def seconds(*command: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, *command], check=True, capture_output=True)
    return time.perf_counter() - start


def loaded_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return {name.split(".")[0] for name in done.stdout.split()}


def test_import_is_light() -> None:
    assert loaded_after("import drivetrain") & {*HEAVY, "numpy"} == set()


def test_command_line_imports_nothing_heavy() -> None:
    assert loaded_after("import drivetrain.cli") & {*HEAVY, "numpy"} == set()


def test_help_is_quick() -> None:
    """Against a bare interpreter in the same run, since machines differ: 15 ms to 0.3 s is a factor of 20."""
    seconds("-m", "drivetrain", "--help")
    bare, shown = [], []
    for _ in range(5):
        bare.append(seconds("-c", "pass"))
        shown.append(seconds("-m", "drivetrain", "--help"))
    assert statistics.median(shown) / statistics.median(bare) < 20
