"""Mean of the square of a quantity that is linear in time between two samples."""

from __future__ import annotations

from typing import Any

from drivetrain.jit import FAST, law


@law(fastmath=FAST)
def mean_square(before: Any, after: Any) -> Any:
    """Mean square over an interval, (a^2 + a b + b^2) / 3, with the values a and b at both ends."""
    return (before * before + before * after + after * after) * (1.0 / 3.0)
