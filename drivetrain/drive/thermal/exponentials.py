"""Two functions of the exponential that are accurate near zero, for the exact step of a linear stage.

A stage ``x' = a x + b`` with b held over a step h ends at ``x + h (a x + b) first(a h)``, and its mean over the step is
``x + h (a x + b) second(a h, first(a h))``.
"""

from __future__ import annotations

import math

from drivetrain.jit import kernel


@kernel
def first(x: float) -> float:
    """(e^x - 1) / x."""
    if abs(x) < 0.05:  # seven terms suffice: the eighth is below rounding
        return 1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0 * (1.0 + x / 7.0)))))
    return math.expm1(x) / x


@kernel
def second(x: float, first_of_x: float) -> float:
    """((e^x - 1) / x - 1) / x."""
    if abs(x) < 0.05:
        inner = 1.0 + x / 5.0 * (1.0 + x / 6.0 * (1.0 + x / 7.0 * (1.0 + x / 8.0)))
        return 0.5 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * inner))
    return (first_of_x - 1.0) / x
