"""Waypoints of a study file as a motion: rows of values with units, limits and rests, one a joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.motion.profiles import Profile, Quintic, SCurve, Trapezoid
from drivetrain.motion.waypoints import MotionLimits, waypoint_motion
from drivetrain.study.document import Place
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import MotionForm
from drivetrain.units import quantity

PROFILES: dict[str, Profile] = {"trapezoid": Trapezoid(), "quintic": Quintic(), "s_curve": SCurve()}
LIMITS = {
    "speed": ("rad/s", "m/s"),
    "acceleration": ("rad/s^2", "m/s^2"),
    "jerk": ("rad/s^3", "m/s^3"),
}  # of a revolute and of a prismatic joint
LONGEST_MOVE = 3600.0  # [s]; sampled every few milliseconds, so more is a slip of units


@dataclass(frozen=True, eq=False)
class JointAxes:
    """What a motion must know of the joints.

    Attributes:
        names: In the arm's order.
        slides: True for prismatic joints.
    """

    names: tuple[str, ...]
    slides: tuple[bool, ...]


def resolve_waypoints(name: str, form: MotionForm, axes: JointAxes, ledger: Ledger, place: Place) -> Motion | None:
    """The motion through the waypoints.

    Returns:
        The motion; None when it cannot be made.
    """
    known = len(ledger.faults)
    rows = [_row(row, form, axes, ledger, (*place, "waypoints", i)) for i, row in enumerate(form.waypoints or [])]
    points = np.array([row for row in rows if row is not None]).reshape(-1, len(axes.names))
    limits = {what: _limit(getattr(form, what), what, axes, ledger, (*place, what)) for what in LIMITS}
    dwell = _dwell(form.dwell, len(rows), ledger, (*place, "dwell"))
    durations = form.durations
    if form.profile is None:
        ledger.fault((*place, "profile"), f"is missing: {', '.join(PROFILES)}")
    if len(rows) < 2:
        ledger.fault((*place, "waypoints"), "must be at least two rows")
    if durations is not None and len(durations) != len(rows) - 1:
        problem = f"must be {len(rows) - 1} times, one for each move between the {len(rows)} waypoints"
        ledger.fault((*place, "durations"), problem, len(durations))
    if len(ledger.faults) > known or form.profile is None:
        return None
    if _takes_too_long(points, limits, durations):
        ledger.fault(
            place, f"has a move of more than {LONGEST_MOVE:g} s: too long to be sampled", hint="check its units"
        )
        return None
    bounds = MotionLimits(**{what: limit for what, limit in limits.items() if limit is not None})
    given = any(limit is not None for limit in limits.values())
    with ledger.gather(place):
        return waypoint_motion(
            name, axes.names, points,
            profile=PROFILES[form.profile], durations=durations, limits=bounds if given else None, dwell=dwell,
        )  # fmt: skip
    return None


def _row(row: Any, form: MotionForm, axes: JointAxes, ledger: Ledger, place: Place) -> list[float] | None:
    """One waypoint: a value a joint, each with its own unit or that of the entry."""
    n = len(axes.names)
    if not isinstance(row, list) or len(row) != n:
        found = f"{len(row)} values" if isinstance(row, list) else row
        ledger.fault(place, f"must be a list of {n} values, one for each of {', '.join(axes.names)}", found)
        return None
    units = form.unit or ()
    if len(units) not in (0, 1, n):
        ledger.fault((*place[:-2], "unit"), f"must be one unit, or {n}: one a joint", len(units))
        return None
    values = []
    for i, (value, slides) in enumerate(zip(row, axes.slides, strict=True)):
        unit = units[i % len(units)] if units else ""
        values.append(_value(value, unit, "m" if slides else "rad", ledger, (*place, i)))
    return None if any(value is None for value in values) else [float(value) for value in values if value is not None]


def _value(value: Any, unit: str, wanted: str, ledger: Ledger, place: Place) -> float | None:
    """A quantity; a bare number takes the unit of the entry."""
    bare = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        return quantity(f"{value} {unit}" if bare else value, wanted, "")
    except InputError as error:
        fault = error.faults[0]
        hint = fault.hint or ("or give the motion a unit: deg" if bare and not unit else "")
        ledger.fault(place, fault.problem, value, hint)
        return None


def _limit(value: Any, what: str, axes: JointAxes, ledger: Ledger, place: Place) -> Array | None:
    """A limit a joint."""
    if value is None:
        return None
    n = len(axes.names)
    listed = value if isinstance(value, list) else [value] * n
    if len(listed) != n:
        ledger.fault(place, f"must be one limit for all joints, or {n}: one a joint", f"{len(listed)} limits")
        return None
    limits = []
    for i, (entry, slides) in enumerate(zip(listed, axes.slides, strict=True)):
        inner = (*place, i) if isinstance(value, list) else place
        limits.append(_value(entry, "", LIMITS[what][int(slides)], ledger, inner))
    return None if any(limit is None for limit in limits) else np.array(limits, dtype=np.float64)


def _takes_too_long(points: Array, limits: dict[str, Array | None], durations: list[float] | None) -> bool:
    """Whether a move takes too long by its duration, or cannot be quicker by its limits."""
    moves = np.abs(np.diff(points, axis=0))
    times = [0.0, *(durations or [])]
    for order, limit in enumerate(limits.values(), 1):
        if limit is not None and (limit > 0.0).all():
            times.append(float(np.max(moves / limit, initial=0.0) ** (1.0 / order)))
    return max(times) > LONGEST_MOVE


def _dwell(value: Any, count: int, ledger: Ledger, place: Place) -> Array:
    """A rest at each waypoint; one value for all counts at every waypoint but the first, where the motion begins."""
    if value is None:
        return np.zeros(count)
    listed = value if isinstance(value, list) else [0.0, *[value] * (count - 1)]
    if len(listed) != count:
        ledger.fault(place, f"must be one time, or {count}: one a waypoint", f"{len(listed)} times")
        return np.zeros(count)
    rests = [0.0 if entry == 0 else _value(entry, "", "s", ledger, place) or 0.0 for entry in listed]
    return np.array(rests, dtype=np.float64)
