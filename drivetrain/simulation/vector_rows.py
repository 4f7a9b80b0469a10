"""Where the rows of a run's vectors begin."""

from __future__ import annotations

from typing import Any

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f


@part
def row_of(w: Any, which: int) -> int:
    """Where a row of the vectors begins."""
    return w[f.AT_VECTORS] + which * w[f.COORDINATES]
