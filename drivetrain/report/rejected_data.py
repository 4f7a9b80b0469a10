"""The rejected candidates as the page searches, sorts and draws them: the closest, however many there are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from drivetrain.report.chart import rounded
from drivetrain.sizing.judge.objectives import criteria, weighted
from drivetrain.sizing.results import Selection

MOST = 3000  # on the page; rejected.csv holds them all
COLUMNS = ("joint", "motor", "gear", "check", "utilisation", "objective")
SHARES = {
    "mass": "mass of motor and gear [kg]", "price": "price of motor and gear", "energy": "energy a cycle [J]",
    "weighted": "share of the weighted objective",
}  # fmt: skip


def rejected_data(selection: Selection, rejected: pd.DataFrame) -> dict[str, Any]:
    """Rows as places in lists of names and as numbers, the chosen drives, and those that also pass.

    Args:
        rejected: Of ``rejected_columns``.
    """
    used = rejected["utilisation"].to_numpy(dtype=float)
    closest = rejected.iloc[np.sort(np.argsort(used, kind="stable")[:MOST])]
    columns: list[list[Any]] = []
    names: list[list[str] | None] = []
    for name in COLUMNS:
        if name in ("utilisation", "objective"):
            columns.append(rounded(np.minimum(closest[name].to_numpy(dtype=float), 1e6), 9))
            names.append(None)
            continue
        texts = closest[name].astype(str).tolist()
        known = sorted(set(texts)) if name != "check" else closest[name].astype(str).value_counts().index.tolist()
        place = {text: number for number, text in enumerate(known)}
        columns.append([place[text] for text in texts])
        names.append([text or "direct drive" for text in known])
    return {
        "columns": list(COLUMNS),
        "names": names,
        "rows": [list(row) for row in zip(*columns, strict=True)],
        "chosen": _chosen(selection),
        "axis": SHARES[selection.study.objective],
        "count": len(rejected),
    }


def _chosen(selection: Selection) -> list[list[Any]]:
    """Joint, motor, gear, share of the objective, utilisation and what it is, where both numbers are known."""
    found: list[list[Any]] = []
    study, word = selection.study, "chosen" if selection.drives else "closest"
    for name, joint in selection.evaluation.joints.items():
        share = weighted(study.wanted, criteria(study, {name: joint}, ()))
        used = None if joint.binding is None else joint.binding.utilisation
        if used is None or not np.isfinite([share, used]).all():
            continue
        found.append([name, joint.motor, joint.gear or "direct drive", float(share), min(float(used), 1e6), word])
    return found
