"""The gains of a cascade, continuous or sampled: what may stand there."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.errors import Fault


def gain_faults(loop: Any) -> list[Fault]:
    """What is wrong with the gains of a cascade, continuous or sampled."""
    kind = type(loop).__name__
    faults = [
        Fault(f"{kind}.{name}", "must not be negative and finite", getattr(loop, name))
        for name in ("position_gain", "speed_gain")
        if not 0.0 <= getattr(loop, name) < math.inf
    ]
    faults += [
        Fault(f"{kind}.{name}", f"must be positive [{unit}]", getattr(loop, name))
        for name, unit in (("integral_time", "s"), ("peak_current", "A"))
        if not getattr(loop, name) > 0.0
    ]
    return faults
