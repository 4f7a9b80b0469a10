"""The candidates that fell, column by column: there may be half a million of them."""

from __future__ import annotations

from itertools import chain

import numpy as np
import pandas as pd

from drivetrain.sizing.results import REJECTED as COLUMNS
from drivetrain.sizing.results import REJECTED_NUMBERS as _NUMBERS

_ROW = ",".join("%.6g" if name in _NUMBERS else "%s" for name in COLUMNS) + "\n"
_AT_ONCE = 4096  # rows formatted by one call


def rejected_text(fallen: pd.DataFrame) -> str:
    """Candidates that fell as CSV text."""
    columns = [fallen[name].tolist() if name in _NUMBERS else _quoted(fallen[name]) for name in COLUMNS]
    parts = [",".join(COLUMNS) + "\n"]
    for first in range(0, len(fallen), _AT_ONCE):
        rows = zip(*(values[first : first + _AT_ONCE] for values in columns), strict=True)
        values = tuple(chain.from_iterable(rows))
        parts.append(_ROW * (len(values) // len(COLUMNS)) % values)
    return "".join(parts)


def _quoted(names: pd.Series) -> list[str]:
    """Names as cells of a CSV file."""
    texts = [_cell(str(name)) for name in names.cat.categories]
    return np.array([*texts, ""], dtype=object)[names.cat.codes.to_numpy()].tolist()


def _cell(text: str) -> str:
    quoted = any(letter in text for letter in ',"\r\n')
    return '"' + text.replace('"', '""') + '"' if quoted else text


def counted(fallen: pd.DataFrame) -> dict[tuple[str, str], int]:
    """How many candidates each check felled at each joint.

    Returns:
        By (joint, check); pairs that never occur are left out.
    """
    joints, checks = (list(fallen[name].cat.categories) for name in ("joint", "check"))
    joint, check = (fallen[name].cat.codes.to_numpy().astype(np.int64) for name in ("joint", "check"))
    counts = np.bincount(joint * len(checks) + check, minlength=1)
    found = np.flatnonzero(counts).tolist()
    return {(str(joints[k // len(checks)]), str(checks[k % len(checks)])): int(counts[k]) for k in found}
