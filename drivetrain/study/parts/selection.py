"""What a study wants of a selection: objective, constraints, how far to search, and what else to report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from annotated_types import Ge

from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, Faults, InputError, nearest
from drivetrain.units import Duration, Quantity, Reader, quantity, read_name, refused

TERMS = ("mass", "price", "energy")  # of the objective
CRITERIA = (*TERMS, "utilisation")  # of a front
UNITS = {"payload": "kg", "cycle_time": "s", "voltage": "V", "ambient": "degC"}  # of what a curve may go along
POSITIVE = ("cycle_time", "voltage")
FORM = "such as payload, or payload: 0 kg..8 kg"

Count = Annotated[int, Ge(1)]


class _Probability(Quantity):
    """A probability that can be reached: nothing holds for certain under tolerances."""

    def read(self, value: Any) -> float:
        found = super().read(value)
        if found >= 1.0:
            hint = "such as 0.99 or 99 %; leave it out to check nominal values only"
            raise refused("must be a probability below 1", hint)
        return found


class _Groups(Reader):
    """Groups of names: a list of lists, or one plain list for one group."""

    def read(self, value: Any) -> tuple[tuple[str, ...], ...]:
        if not isinstance(value, list | tuple) or not value:
            hint = "[[joint_4, joint_5, joint_6]]"
            raise refused("must be a list of joint names, or a list of such lists", hint)
        nested = any(isinstance(entry, list | tuple) for entry in value)
        groups = value if nested else [value]
        if not all(isinstance(group, list | tuple) for group in groups):
            hint = "[[joint_1, joint_2], [joint_4, joint_5]]"
            raise refused("mixes names and lists of names", hint)
        read = tuple(tuple(dict.fromkeys(map(read_name, group))) for group in groups)
        short = next((group for group in read if len(group) < 2), None)
        if short is not None:
            raise refused("a group needs at least two joints", found=", ".join(short))
        return read

    def json_schema(self) -> dict[str, Any]:
        names = {"type": "array", "minItems": 2, "items": {"type": "string"}}
        return {"anyOf": [names, {"type": "array", "items": names}]}


@dataclass(frozen=True)
class SelectionOptions:
    """What a selection minimises and must respect.

    Attributes:
        weights: What each term counts in the objective: ``mass`` [1/kg], ``price`` [1/unit of the catalogue's price]
            and ``energy`` [1/J a cycle]; terms that count nothing are left out.
        most_motor_types, most_gear_types: Different keys over all joints, at most; None: any number.
        same_family: Groups of joint names whose motors must be of one family, and whose gears too (see ``family``).
        sets: How many of the best sets are wanted.
        time_limit: Of the search [s]; what is left unproven then is reported.
        holds: Probability with which the chosen set must be feasible under the study's tolerances; None: not asked.
    """

    weights: tuple[tuple[str, float], ...] = (("mass", 1.0),)
    most_motor_types: Count | None = None
    most_gear_types: Count | None = None
    same_family: Annotated[tuple[tuple[str, ...], ...], _Groups()] = ()
    sets: Count = 5
    time_limit: Duration = 30.0
    holds: Annotated[float, _Probability("", above=0.0)] | None = None

    @property
    def objective(self) -> str:
        """``mass``, ``price`` or ``energy`` when that alone counts, as it is; ``weighted`` otherwise."""
        name, weight = self.weights[0]
        return name if len(self.weights) == 1 and weight == 1.0 else "weighted"


Wanted = SelectionOptions  # its older name


def family(row: Motor | Gear) -> str:
    """What parts share a family: those of one maker and series; a part whose sheet names no series stands alone."""
    return f"{row.maker} {row.series}".strip() if row.series else f"{row.maker} {row.key}".strip()


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
    if name not in CRITERIA:
        raise InputError(Fault(place, "is none that sets can be compared by", name, nearest(str(name), CRITERIA)))
    return str(name)


def read_curve(text: object, place: str = "curves") -> CurveWanted:
    """A curve as it is written on one line, ``payload`` or ``payload: 0 kg..8 kg``."""
    if isinstance(text, dict) and len(text) == 1:
        text = ": ".join(str(part) for part in next(iter(text.items())))
    if not isinstance(text, str):
        raise InputError(Fault(place, "must name what is varied", text, FORM))
    name, _, span = (part.strip() for part in text.partition(":"))
    if name not in UNITS:
        raise InputError(Fault(place, "is nothing that can be varied", name, nearest(name, UNITS)))
    if not span:
        return CurveWanted(name)
    ends = [part.strip() for part in span.split("..")]
    if len(ends) != 2:
        raise InputError(Fault(place, "must be a range of two values with their units", span, FORM))
    return CurveWanted(name, read_span(name, (ends[0], ends[1]), (place, place)))


def read_span(vary: str, ends: tuple[str, str], places: tuple[str, str]) -> tuple[float, float]:
    """The ends of a curve in SI, temperatures in [C]; raises every fault of both."""
    faults = Faults()
    least = 0.0 if vary == "payload" else None
    above = 0.0 if vary in POSITIVE else None
    low, high = (
        faults.attempt(quantity, end, UNITS[vary], place, minimum=least, above=above)
        for end, place in zip(ends, places, strict=True)
    )
    if low is not None and high is not None and not low < high:
        faults.add(places[1], "must be above the smallest value", f"{ends[0]}..{ends[1]}")
    faults.raise_any()
    assert low is not None and high is not None
    return low, high
