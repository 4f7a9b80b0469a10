"""Where the limit of a check comes from, and what a reader should know: source and remark, in words."""

from __future__ import annotations

from typing import Any, NamedTuple


class Words(NamedTuple):
    """What is told beside the numbers of a check.

    Attributes:
        source: Where the limit comes from.
        remark: What a reader should know, or what is missing.
        silent: Whether neither number is told, as one of them cannot be made sense of.
    """

    source: str
    remark: str = ""
    silent: bool = False


def printed(op: Any, row: Any) -> Words:
    return Words("")


repeated_peak = average_torque = gear_life = bearing = inertia_ratio = short_time = voltage = rms_current = winding = (
    printed
)
