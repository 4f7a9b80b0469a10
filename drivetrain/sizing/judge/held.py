"""How a requirement is held against a limit: one form for every check."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.study.verdicts import Check, Verdict


class Limit(NamedTuple):
    """What a part can do, and who says so.

    Attributes:
        value: In the unit of the check; None when nobody says.
        source: In words.
        remark: What a reader should know, or what is missing.
    """

    value: float | None
    source: str = ""
    remark: str = ""


class Peak(NamedTuple):
    """The largest magnitude of a series.

    Attributes:
        value: In the unit of the series.
        time: Its instant [s].
    """

    value: float
    time: float


def peak(time: Array, values: Array) -> Peak:
    """The largest magnitude of a series and its instant.

    Args:
        time: [s], (N,).
        values: In any unit, (N,).
    """
    magnitude = np.abs(values)
    index = int(np.argmax(magnitude))
    return Peak(float(magnitude[index]), float(time[index]))


def held(
    name: str, unit: str, required: float | None, limit: Limit, *, reserve: float, time: float | None = None
) -> Check:
    """A requirement held against a limit.

    Args:
        required: What the task asks, safety factor included; None when it could not be computed.
        time: Instant of the requirement [s].
    """
    if required is None or limit.value is None:
        return Check(
            name, required, limit.value, unit, None, Verdict.NOT_CHECKED, time, limit.source,
            limit.remark or "the sheet gives no limit",
        )  # fmt: skip
    used = utilisation(required, limit.value)
    return Check(name, required, limit.value, unit, used, judged(used, reserve), time, limit.source, limit.remark)


def utilisation(required: float, available: float) -> float:
    """Required over available; infinite when something is asked of nothing."""
    if available > 0.0:
        return required / available
    return 0.0 if required <= 0.0 else math.inf


def judged(used: float, reserve: float) -> Verdict:
    """The verdict on a utilisation."""
    if used <= 1.0 - reserve:
        return Verdict.PASS
    return Verdict.MARGINAL if used <= 1.0 else Verdict.FAIL


def reported(name: str, unit: str, value: float | None, remark: str, *, time: float | None = None) -> Check:
    """A number that is told and not judged.

    Args:
        value: The number; None when it is unknown.
        time: Its instant [s].
    """
    return Check(name, value, None, unit, None, Verdict.NOT_CHECKED, time, "", remark)
