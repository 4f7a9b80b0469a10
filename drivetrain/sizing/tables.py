"""Checks and sets of drives as tables for pandas, with units in the names of columns or beside each row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import Check

ALL = "all joints"  # place of the checks of all joints together
CHECK_COLUMNS = [
    "joint", "check", "verdict", "utilisation", "required", "available", "unit", "factor", "time", "essential",
    "source", "remark",
]  # fmt: skip
CRITERION_UNITS = {"mass": "mass [kg]", "energy": "energy [J]"}


def check_table(checks: Mapping[str, Iterable[Check]]) -> pd.DataFrame:
    """Every check of every joint, one a row; required and available are in the row's own ``unit``."""
    rows = [
        (joint, check.name, str(check.verdict), *(getattr(check, name) for name in CHECK_COLUMNS[3:]))
        for joint, made in checks.items()
        for check in made
    ]
    table = pd.DataFrame(rows, columns=CHECK_COLUMNS)
    table = table.astype(dict.fromkeys(("utilisation", "required", "available", "time"), float))
    table = table.rename(columns={"time": "time [s]"})
    table.attrs = {"units": {"required": "unit", "available": "unit", "time [s]": "s", "utilisation": "1"}}
    return table


def set_table(sets: Sequence[Any], study: Study) -> pd.DataFrame:
    """Sets of drives, one a row, best first: objective and criteria, then motor and gear of each joint."""
    rows = []
    for one in sets:
        row: dict[str, Any] = {"objective": one.objective}
        row |= {CRITERION_UNITS.get(name, name): value for name, value in one.criteria.items()}
        for joint, (motor, gear) in one.drives.items():
            row |= {f"{joint} motor": motor, f"{joint} gear": gear}
        rows.append(row)
    named = (f"{joint.name} {part}" for joint in study.joints for part in ("motor", "gear"))
    empty = None if rows else ["objective", "mass [kg]", "price", "energy [J]", "utilisation", *named]
    table = pd.DataFrame(rows, columns=empty)
    units = {"mass [kg]": "kg", "energy [J]": "J", "utilisation": "1", "price": study.prices.currency}
    table.attrs = {"units": units | {"objective": study.objective_unit}}
    return table
