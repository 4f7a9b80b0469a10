"""What a report shall tell beside the best set: a Pareto front, and the best set over a payload or a pace."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.errors import Fault, InputError, nearest
from drivetrain.units import quantity

CRITERIA = ("mass", "price", "energy", "utilisation")
UNITS = {"payload": "kg", "cycle_time": "s", "voltage": "V", "ambient": "degC"}  # of what a curve may go along
POSITIVE = ("cycle_time", "voltage")
FORM = "such as payload, or payload: 0 kg..8 kg"


@dataclass(frozen=True)
class CurveWanted:
    """A curve of the best set over one number of the task.

    Attributes:
        vary: ``payload`` [kg], ``cycle_time`` [s], ``voltage`` [V] or ``ambient`` [C].
        span: Its smallest and largest value; None: around the study's own.
    """

    vary: str
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class TradeOffs:
    """What is wanted beside the best set; nothing of it unless asked for.

    Attributes:
        front: Criteria of a Pareto front; empty for none.
        curves: Each of another number of the task.
    """

    front: tuple[str, ...] = ()
    curves: tuple[CurveWanted, ...] = ()

    def __bool__(self) -> bool:
        """Whether anything is asked for."""
        return bool(self.front or self.curves)


def read_criterion(name: object, place: str = "front") -> str:
    """A criterion of a front.

    Raises:
        InputError: Another name.
    """
    if name not in CRITERIA:
        raise InputError(Fault(place, "is none that sets can be compared by", name, nearest(str(name), CRITERIA)))
    return str(name)


def read_curve(text: object, place: str = "curves") -> CurveWanted:
    """A curve as it is written on one line, ``payload`` or ``payload: 0 kg..8 kg``.

    Raises:
        InputError: Another quantity, or ends that are no rising range of it: every fault at once.
    """
    if isinstance(text, dict) and len(text) == 1:
        text = ": ".join(str(part) for part in next(iter(text.items())))
    if not isinstance(text, str):
        raise InputError(Fault(place, "must name what is varied", text, FORM))
    name, _, told = (part.strip() for part in text.partition(":"))
    if name not in UNITS:
        raise InputError(Fault(place, "is nothing that can be varied", name, nearest(name, UNITS)))
    if not told:
        return CurveWanted(name)
    ends = [part.strip() for part in told.split("..")]
    if len(ends) != 2:
        raise InputError(Fault(place, "must be a range of two values with their units", told, FORM))
    return CurveWanted(name, read_span(name, (ends[0], ends[1]), (place, place)))


def read_span(vary: str, ends: tuple[str, str], places: tuple[str, str]) -> tuple[float, float]:
    """The ends of a curve.

    Returns:
        The range in SI, temperatures in [C].

    Raises:
        InputError: No quantities of this kind, or no rising range: every fault at once.
    """
    faults: list[Fault] = []
    values = []
    least = 0.0 if vary == "payload" else None
    above = 0.0 if vary in POSITIVE else None
    for end, place in zip(ends, places, strict=True):
        try:
            values.append(quantity(end, UNITS[vary], place, minimum=least, above=above))
        except InputError as error:
            faults += error.faults
    if not faults and not values[0] < values[1]:
        faults.append(Fault(places[1], "must be above the smallest value", f"{ends[0]}..{ends[1]}"))
    if faults:
        raise InputError(faults)
    return values[0], values[1]
