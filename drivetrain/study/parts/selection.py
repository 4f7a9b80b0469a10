"""Options of a selection: objective, constraints, limits of the search, and additional results to report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from annotated_types import Ge

from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, Faults, InputError, nearest
from drivetrain.units import TEXT, Duration, Function, Quantity, quantity, read_name, refused

TERMS = ("mass", "price", "energy")  # terms of the objective
CRITERIA = (*TERMS, "utilisation")  # criteria of a Pareto front
# quantities that a curve may vary; a force is a share of the study's own
UNITS = {"payload": "kg", "cycle_time": "s", "voltage": "V", "ambient": "degC", "force": "%"}
POSITIVE = ("cycle_time", "voltage")
FORM = "such as payload, or payload: 0 kg..8 kg"

Count = Annotated[int, Ge(1)]


class _Probability(Quantity):
    """A probability below 1: with tolerances, nothing is satisfied with certainty."""

    def read(self, value: Any) -> float:
        found = super().read(value)
        if found >= 1.0:
            hint = "such as 0.99 or 99 %; leave it out to check nominal values only"
            raise refused("must be a probability below 1", hint)
        return found


def _groups(value: Any) -> tuple[tuple[str, ...], ...]:
    """Groups of names: a list of lists, or one plain list for one group."""
    if not isinstance(value, list | tuple) or not value:
        raise refused("must be a list of joint names, or a list of such lists", "[[joint_4, joint_5, joint_6]]")
    nested = any(isinstance(entry, list | tuple) for entry in value)
    groups = value if nested else [value]
    if not all(isinstance(group, list | tuple) for group in groups):
        raise refused("mixes names and lists of names", "[[joint_1, joint_2], [joint_4, joint_5]]")
    read = tuple(tuple(dict.fromkeys(map(read_name, group))) for group in groups)
    short = next((group for group in read if len(group) < 2), None)
    if short is not None:
        raise refused("a group needs at least two joints", found=", ".join(short))
    return read


_GROUP = {"type": "array", "minItems": 2, "items": TEXT}
_GROUPS = {"anyOf": [_GROUP, {"type": "array", "items": _GROUP}]}


@dataclass(frozen=True)
class SelectionOptions:
    """Objective and constraints of a selection.

    Attributes:
        weights: Weight of each term of the objective: ``mass`` [1/kg], ``price`` [1/unit of the catalogue's price] and
            ``energy`` [1/J per cycle]; terms with weight 0 are omitted.
        most_motor_types, most_gear_types: Largest number of different keys over all joints; None: no limit.
        same_family: Groups of joint names whose motors must be of one family, and whose gears too (see ``family``).
        sets: Number of best sets to find.
        time_limit: Time limit of the search [s]; what is then not proven is reported.
        holds: Probability with which the chosen set must be feasible under the study's tolerances; None: not required.
    """

    weights: tuple[tuple[str, float], ...] = (("mass", 1.0),)
    most_motor_types: Count | None = None
    most_gear_types: Count | None = None
    same_family: Annotated[tuple[tuple[str, ...], ...], Function(_groups, _GROUPS)] = ()
    sets: Count = 5
    time_limit: Duration = 30.0
    holds: Annotated[float, _Probability("", above=0.0)] | None = None

    @property
    def objective(self) -> str:
        """``mass``, ``price`` or ``energy`` if it is the only term and its weight is 1; ``weighted`` otherwise."""
        name, weight = self.weights[0]
        return name if len(self.weights) == 1 and weight == 1.0 else "weighted"


Wanted = SelectionOptions  # its older name


def family(row: Motor | Gear) -> str:
    """Identifier of a part's family (maker and series); a part without a series is a family of its own."""
    return f"{row.maker} {row.series}".strip() if row.series else f"{row.maker} {row.key}".strip()


@dataclass(frozen=True)
class CurveWanted:
    """A curve of the best set over one number of the task.

    Attributes:
        vary: ``payload`` [kg], ``cycle_time`` [s], ``voltage`` [V], ``ambient`` [C] or ``force`` [%].
        span: Smallest and largest value, in the unit above; None: a range around the study's own value.
    """

    vary: str
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class TradeOffs:
    """Additional results of a selection besides the best set; by default none.

    Attributes:
        front: Criteria of a Pareto front; empty: none.
        curves: Curves of the best set, each over another quantity of the task.
    """

    front: tuple[str, ...] = ()
    curves: tuple[CurveWanted, ...] = ()

    def __bool__(self) -> bool:
        """Whether any additional result is requested."""
        return bool(self.front or self.curves)


def read_criterion(name: object, place: str = "front") -> str:
    if name not in CRITERIA:
        raise InputError(
            Fault(place, "is not a criterion by which sets can be compared", name, nearest(str(name), CRITERIA))
        )
    return str(name)


def read_curve(text: object, place: str = "curves") -> CurveWanted:
    """Read a curve from one line such as ``payload`` or ``payload: 0 kg..8 kg``."""
    if isinstance(text, dict) and len(text) == 1:
        text = ": ".join(str(part) for part in next(iter(text.items())))
    if not isinstance(text, str):
        raise InputError(Fault(place, "must name what is varied", text, FORM))
    name, _, span = (part.strip() for part in text.partition(":"))
    if name not in UNITS:
        raise InputError(Fault(place, "is not a quantity that can be varied", name, nearest(name, UNITS)))
    if not span:
        return CurveWanted(name)
    ends = [part.strip() for part in span.split("..")]
    if len(ends) != 2:
        raise InputError(Fault(place, "must be a range of two values with their units", span, FORM))
    return CurveWanted(name, read_span(name, (ends[0], ends[1]), (place, place)))


def read_span(vary: str, ends: tuple[str, str], places: tuple[str, str]) -> tuple[float, float]:
    """The ends of a curve in SI (temperatures [C]); raises InputError with the faults of both."""
    faults = Faults()
    least = 0.0 if vary in ("payload", "force") else None
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
