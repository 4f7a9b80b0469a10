"""The candidates that fell, column by column: there may be half a million of them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from drivetrain.sizing.results import Selection

COLUMNS = ("joint", "motor", "gear", "check", "required", "available", "unit", "utilisation", "objective")
_NUMBERS = ("required", "available", "utilisation", "objective")


def fallen_columns(selection: Selection) -> pd.DataFrame:
    """Every candidate that fell.

    Args:
        selection: Of ``select``.

    Returns:
        One row a candidate in the order of ``selection.fallen``; its columns are ``COLUMNS``.
    """
    frame = getattr(selection.fallen, "frame", None)  # a table that is made of columns hands them over
    if frame is not None:
        table: pd.DataFrame = frame()
        return table
    columns = {
        name: np.array([getattr(one, name) for one in selection.fallen], dtype=float if name in _NUMBERS else object)
        for name in COLUMNS
    }
    return pd.DataFrame(columns)


def fallen_text(fallen: pd.DataFrame) -> str:
    """Candidates that fell as CSV text.

    Args:
        fallen: From ``fallen_columns``.

    Returns:
        One header row, one row a candidate; required and available in the unit of their column ``unit``.
    """
    out = pd.DataFrame(fallen[list(COLUMNS)])
    return str(out.to_csv(index=False, lineterminator="\n", float_format="%.6g", na_rep="nan"))


def counted(fallen: pd.DataFrame) -> dict[tuple[str, str], int]:
    """How many candidates each check felled at each joint.

    Args:
        fallen: From ``fallen_columns``.

    Returns:
        By (joint, check); pairs that never occur are left out.
    """
    codes, names = {}, {}
    for column in ("joint", "check"):
        codes[column], names[column] = pd.factorize(fallen[column])
    size = max(len(names["check"]), 1)
    counts = np.bincount(codes["joint"] * size + codes["check"], minlength=1)
    found = np.flatnonzero(counts)
    return {(str(names["joint"][k // size]), str(names["check"][k % size])): int(counts[k]) for k in found.tolist()}
