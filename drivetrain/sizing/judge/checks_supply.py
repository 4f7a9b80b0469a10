"""The supply behind all joints: power drawn together, at its peak, on average, and fed back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Supply
from drivetrain.sizing.judge.held import Limit, held, peak
from drivetrain.study.verdicts import Check


def supply_checks(
    supply: Supply, time: Array, weights: Array, powers: Mapping[str, Array], *, reserve: float, unknown: str = ""
) -> tuple[Check, ...]:
    """Power of all joints together, instant by instant, against the supply's limits.

    What one joint feeds back another may use at the same instant; only the sum reaches the supply. Drawn is where the
    sum is positive, regenerated where it is negative; the mean of each is over the whole cycle, so that a supply that
    takes nothing back is not credited with it.

    Args:
        time: [s], (N,).
        weights: Time each sample stands for [s], (N,).
        powers: Electrical power by joint name [W], (N,) each.

    Returns:
        Peak, mean and regenerated power [W].
    """
    total = np.sum(list(powers.values()), axis=0)
    drawn, fed_back = np.maximum(total, 0.0), np.maximum(-total, 0.0)
    duration = float(weights.sum())
    highest = peak(time, drawn)

    def mean(values: Array) -> float:
        """Over the cycle."""
        return float(values @ weights) / duration if duration > 0.0 else float(np.mean(values))

    found: tuple[tuple[str, float, float | None, float | None], ...] = (
        ("supply peak power", highest.value, supply.peak_power, highest.time),
        ("supply mean power", mean(drawn), supply.mean_power, None),
        ("supply regenerated power", mean(fed_back), supply.regenerated_power, None),
    )
    return tuple(
        held(name, "W", None if unknown else value, _limit(limit, name, unknown), reserve=reserve, time=instant)
        for name, value, limit, instant in found
    )


def _limit(value: float | None, name: str, unknown: str) -> Limit:
    remark = f"power unknown of {unknown}" if unknown else "the study states no limit" if value is None else ""
    return Limit(value, f"{name} limit of the study", remark)
