"""The rejected candidates (up to some half a million): as CSV text, counted by check, and the closest for the page."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd

from drivetrain.report.charts.chart import rounded
from drivetrain.sizing.judge.objectives import criteria, weighted
from drivetrain.sizing.results import REJECTED as COLUMNS
from drivetrain.sizing.results import REJECTED_NUMBERS as _NUMBERS
from drivetrain.sizing.results import Selection
from drivetrain.study.model import gear_name

_ROW = ",".join("%.6g" if name in _NUMBERS else "%s" for name in COLUMNS) + "\n"
_AT_ONCE = 4096  # rows formatted by one call
MOST = 3000  # largest number on the page; rejected.csv contains all
SHOWN = ("joint", "motor", "gear", "check", "utilisation", "objective")
SHARES = {
    "mass": "mass of motor and gear [kg]", "price": "price of motor and gear", "energy": "energy a cycle [J]",
    "weighted": "share of the weighted objective",
}  # fmt: skip


def rejected_text(rejected: pd.DataFrame) -> str:
    columns = [rejected[name].tolist() if name in _NUMBERS else _quoted(rejected[name]) for name in COLUMNS]
    parts = [",".join(COLUMNS) + "\n"]
    for first in range(0, len(rejected), _AT_ONCE):
        rows = zip(*(values[first : first + _AT_ONCE] for values in columns), strict=True)
        values = tuple(chain.from_iterable(rows))
        parts.append(_ROW * (len(values) // len(COLUMNS)) % values)
    return "".join(parts)


def _quoted(names: pd.Series) -> list[str]:
    texts = [_cell(str(name)) for name in names.cat.categories]
    return np.array([*texts, ""], dtype=object)[names.cat.codes.to_numpy()].tolist()


def _cell(text: str) -> str:
    quoted = any(letter in text for letter in ',"\r\n')
    return '"' + text.replace('"', '""') + '"' if quoted else text


def counted(rejected: pd.DataFrame) -> dict[tuple[str, str], int]:
    """Number of candidates that each check rejected at each joint, by (joint, check); zeros are left out."""
    counts: dict[Any, int] = rejected.groupby(["joint", "check"], observed=True).size().to_dict()
    return {(str(joint), str(check)): count for (joint, check), count in counts.items()}


def rejected_data(selection: Selection, rejected: pd.DataFrame) -> dict[str, Any]:
    """The rejected rows as indices into lists of names and as numbers, and the chosen drives."""
    used = rejected["utilisation"].to_numpy(dtype=float)
    closest = rejected.iloc[np.sort(np.argsort(used, kind="stable")[:MOST])]
    columns: list[list[Any]] = []
    names: list[list[str] | None] = []
    for name in SHOWN:
        if name in ("utilisation", "objective"):
            columns.append(rounded(np.minimum(closest[name].to_numpy(dtype=float), 1e6), 9))
            names.append(None)
            continue
        texts = closest[name].astype(str).tolist()
        known = sorted(set(texts)) if name != "check" else closest[name].astype(str).value_counts().index.tolist()
        place = {text: number for number, text in enumerate(known)}
        columns.append([place[text] for text in texts])
        names.append([gear_name(text) for text in known])
    return {
        "columns": list(SHOWN),
        "names": names,
        "rows": [list(row) for row in zip(*columns, strict=True)],
        "chosen": _chosen(selection),
        "axis": SHARES[selection.study.objective],
        "count": len(rejected),
    }


def _chosen(selection: Selection) -> list[list[Any]]:
    """Joint, motor, gear, share of the objective, utilisation and its check, for drives with both numbers known."""
    found: list[list[Any]] = []
    study, word = selection.study, "chosen" if selection.drives else "closest"
    for name, joint in selection.evaluation.joints.items():
        alone = replace(study, joints=tuple(task for task in study.joints if task.name == name))
        share = weighted(study.wanted, criteria(alone, {name: joint}, ()))
        used = None if joint.binding is None else joint.binding.utilisation
        if used is None or not np.isfinite([share, used]).all():
            continue
        found.append([name, joint.motor, gear_name(joint.gear), float(share), min(float(used), 1e6), word])
    return found
