"""No writer of JSON can write NaN or infinity, which other readers refuse."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import drivetrain.report
from drivetrain.report.json_text import json_text
from drivetrain.report.outputs import result_json
from drivetrain.sizing.results import Evaluation, Selection


def refused(token: str) -> float:
    raise AssertionError(f"no JSON: {token}")


def strictly(text: str) -> dict[str, object]:
    """Parsed by a reader that knows no NaN."""
    found: dict[str, object] = json.loads(text, parse_constant=refused)
    return found


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
TREES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner))


@settings(max_examples=30)
@given(st.dictionaries(st.text(max_size=3), TREES))
def test_anything_plain_is_strict_json(data: dict[str, object]) -> None:
    strictly(json_text(data))


def test_what_is_no_number_is_null_at_any_depth() -> None:
    data = {"a": [1.0, math.nan, {"b": -math.inf}], "c": np.array([np.inf, 2.0]), "d": np.float64("nan"), "e": (3,)}
    assert strictly(json_text(data)) == {"a": [1.0, None, {"b": None}], "c": [None, 2.0], "d": None, "e": [3]}


def test_there_is_no_other_way_to_write_json() -> None:
    """Every writer of the reports goes through ``json_text``."""
    folder = Path(drivetrain.report.__file__).parent
    writers = {file.name for file in folder.glob("*.py") if "json.dumps(" in file.read_text(encoding="utf-8")}
    assert writers == {"json_text.py"}


def test_unknown_figures_of_a_result_are_null(
    make_evaluation: Callable[..., Evaluation], selection: Selection, without_data: Evaluation
) -> None:
    whole = make_evaluation()
    unknown = replace(whole, objective=math.nan, criteria={"mass": math.nan, "utilisation": math.inf})
    for result in (unknown, without_data, replace(selection, objective=math.inf, bound=math.nan, evaluation=unknown)):
        assert strictly(result_json(result))["objective"]["value"] is None  # type: ignore[index]
