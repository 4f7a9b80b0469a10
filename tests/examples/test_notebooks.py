"""The notebooks run from their first cell to their last, and are kept without what they print."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib.pyplot
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def code_of(file: Path) -> list[str]:
    """The code cells of a notebook, in order."""
    cells = json.loads(file.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code), "outputs are kept"
    return ["".join(cell["source"]) for cell in code]


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_notebook_runs(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    with matplotlib.rc_context({"backend": "Agg"}):
        for i, code in enumerate(code_of(file)):
            exec(compile(code, f"{file.name}, code cell {i + 1}", "exec"), names)
        matplotlib.pyplot.close("all")
    assert names["chosen"].feasible
    assert names["study"]._repr_html_()
    assert names["chosen"]._repr_html_()
    if "answer" in names:
        assert repr(names["answer"]).endswith("joint_2 rejected)")


def test_there_are_two() -> None:
    assert [file.stem for file in NOTEBOOKS] == ["choose_drives", "size_an_axis"]
