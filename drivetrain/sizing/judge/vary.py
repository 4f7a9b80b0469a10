"""Varies one parameter of a task or drive: checks at a value, and the value from which they are satisfied.

Curves, ratio studies, free ratios, the smallest change and the advice of a search use it. The dynamics of the arm are
not computed again for another value (see ``changed_work``); figures equal those of ``evaluate`` for the changed study
to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.matching import scaled_gear
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.demand.demand import JointDemand, Workload, workload
from drivetrain.sizing.judge.evaluate import evaluate_joint, evaluation_of, shared_checks
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.results import Evaluation, JointResult, placed_checks
from drivetrain.study.change import TaskChange, heaviest
from drivetrain.study.model import Study
from drivetrain.study.parts.selection import UNITS
from drivetrain.study.parts.verdicts import Check, undecided

NOT_CHECKED = " (not checked)"  # follows the name of a check that is undecided
EDGE = 1e-7  # relative error of a bisected boundary
MOST, STEPS = 10.0, 32  # largest factor on a parameter and number of steps in the search for the smallest change


class Vary(StrEnum):
    """The parameter of a task that is varied."""

    PAYLOAD = "payload"
    CYCLE_TIME = "cycle_time"
    VOLTAGE = "voltage"
    AMBIENT = "ambient"
    FORCE = "force"  # at the tip, as a share of the study's own

    @property
    def unit(self) -> str:
        return UNITS[self.value]

    @property
    def outwards(self) -> Array:
        """Shares of the study's value at which the smallest change is searched; other values count as another task."""
        less = self in (Vary.PAYLOAD, Vary.FORCE)
        return np.linspace(1.0, 0.0, STEPS) if less else np.geomspace(1.0, MOST, STEPS)

    def now(self, study: Study, payload: str = "") -> float:
        """The study's own value; that of the heaviest payload where none is named."""
        if self is Vary.PAYLOAD:
            return max((one.mass for one in study.payloads if payload in ("", one.name)), default=0.0)
        if self is Vary.CYCLE_TIME:
            return study.cycle.duration
        if self is Vary.FORCE:
            return 100.0 if study.cycle.tip_wrench is not None else 0.0
        return study.supply.voltage if self is Vary.VOLTAGE else study.ambient

    def change(self, study: Study, value: float, payload: str = "") -> TaskChange:
        """The change of the task that sets a value; where no payload is named, it scales all of them in proportion."""
        now = self.now(study, payload)
        if self is Vary.AMBIENT:
            return TaskChange(ambient=value - now)
        if self is Vary.FORCE:
            return TaskChange(force=value / now)
        if self is Vary.PAYLOAD:
            return TaskChange(payload=value / now, payloads=(payload,) if payload else ())
        return TaskChange(time=value / now) if self is Vary.CYCLE_TIME else TaskChange(voltage=value / now)


@dataclass(frozen=True, eq=False)
class Setup:
    """A task with its workload prepared, and drives by joint index; a joint is evaluated on first use."""

    work: Workload
    drives: Mapping[int, Drive]
    _results: dict[int, JointResult] = field(default_factory=dict)

    @property
    def study(self) -> Study:
        return self.work.study

    def joint(self, joint: int) -> JointResult:
        if joint not in self._results:
            drive = self.drives[joint]
            self._results[joint] = evaluate_joint(self.work, self.drives, joint, (drive.motor.key, drive.gear.key))
        return self._results[joint]

    def results(self) -> dict[str, JointResult]:
        """Results of all joints that have a drive, by name."""
        return {self.study.joints[i].name: self.joint(i) for i in sorted(self.drives)}

    def evaluation(self) -> Evaluation:
        results = self.results()
        return evaluation_of(self.study, results, shared_checks(self.study, results))

    def holds(self) -> bool:
        """Whether no utilisation exceeds 1; the checks of all joints together are made only if each joint passes."""
        if any(worst_of(self.joint(i).checks).utilisation > 1.0 for i in sorted(self.drives)):
            return False
        return worst_of(shared_checks(self.study, self.results(), quick=True)).utilisation <= 1.0

    def proven(self) -> Evaluation:
        """The evaluation with the dynamics of the arm computed again."""
        return Setup(workload(self.study), self.drives).evaluation()

    def demand(self, joint: int) -> JointDemand:
        return self.work.at(joint, self.drives).demand(self.drives[joint])

    def with_drive(self, joint: int, drive: Drive) -> Setup:
        """The set with another drive at a joint; of two motors on one axis, both have it."""
        joints = self.study.joints
        on_axis = [i for i, task in enumerate(joints) if task.axis_name == joints[joint].axis_name]
        return Setup(self.work, {**self.drives, **dict.fromkeys(on_axis, drive)})

    def with_keys(self, joint: int, motor: str, gear: str) -> Setup:
        return self.with_drive(joint, FilledParts(self.study).drive(self.study.joints[joint], motor, gear))


@dataclass(frozen=True, eq=False)
class Number:
    """One parameter that can take other values while the drives and the rest of the task are kept."""

    name: str
    unit: str
    now: float
    put: Callable[[float], Setup]


def named_drives(study: Study, keys: Mapping[str, tuple[str, str]]) -> dict[int, Drive]:
    """Drives of some joints by catalogue key, with assumptions filled in, by joint index."""
    filled_parts = FilledParts(study)
    return {i: filled_parts.drive(task, *keys[task.name]) for i, task in enumerate(study.joints) if task.name in keys}


def lighter_work(study: Study) -> WorkFamily:
    """The work of a task, and of the same task with another heaviest payload."""
    return WorkFamily(study, tuple(one.name for one in heaviest(study)))


def task_number(family: WorkFamily, drives: Mapping[int, Drive], vary: Vary) -> Number:
    """A parameter of the task for a set of drives; the payload of a workload family if the family has members."""
    payload = next(iter(family.payloads), "")
    study, names = family.study, {Vary.VOLTAGE: "supply voltage", Vary.FORCE: "force at the tip"}
    name = names.get(vary, vary.replace("_", " "))
    return Number(
        name, vary.unit, vary.now(study, payload),
        lambda value: Setup(family.at(vary.change(study, value, payload)), drives),
    )  # fmt: skip


def ratio_number(setup: Setup, joint: int) -> Number:
    """The magnitude of a joint's gear ratio; the rest of the data sheet is kept (see ``scaled_gear``)."""
    drive = setup.drives[joint]
    return Number(
        "gear ratio", "", abs(drive.gear.ratio),
        lambda value: setup.with_drive(joint, replace(drive, gear=scaled_gear(drive.gear, value))),
    )  # fmt: skip


class Edge(NamedTuple):
    """The last value at which a condition is satisfied, and its neighbour at which it is not."""

    inside: float
    outside: float

    @property
    def known(self) -> bool:
        """Whether the boundary was found and is not an end of the searched interval."""
        return 0.0 < self.outside < math.inf


def edge(
    holds: Callable[[float], bool], inside: float, outside: float,
    *, error: float = EDGE, least: float = 0.0, geometric: bool = False,
) -> Edge:  # fmt: skip
    """The boundary between a value that satisfies a condition and one that does not, by bisection."""
    while abs(inside - outside) > max(error * max(abs(inside), abs(outside)), least):
        middle = math.sqrt(inside * outside) if geometric else 0.5 * (inside + outside)
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return Edge(inside, outside)


def first_edge(holds: Callable[[float], bool], steps: Sequence[float] | Array) -> Edge | None:
    """The first boundary of a condition along steps from a value that does not satisfy it; None if no step does."""
    for before, step in pairwise(map(float, steps)):
        if holds(step):
            return edge(holds, step, before)
    return None


def edges(
    holds: Callable[[float], bool], values: Sequence[float], *, error: float = EDGE
) -> Iterator[tuple[Edge, Edge]]:
    """Both ends of every interval of rising positive values in which a condition holds; infinite for an open end."""
    open_low, open_high = Edge(0.0, 0.0), Edge(math.inf, math.inf)
    flags = [holds(value) for value in values]
    low = open_low
    for i, flag in enumerate(flags):
        if flag and i > 0 and not flags[i - 1]:
            low = edge(holds, values[i], values[i - 1], error=error, geometric=True)
        if flag and i + 1 == len(flags):
            yield low, open_high
        elif flag and not flags[i + 1]:
            yield low, edge(holds, values[i], values[i + 1], error=error, geometric=True)


class Worst(NamedTuple):
    """The check with the highest utilisation, and the joint (or ``supply``) it belongs to."""

    check: str  # its name, followed by "(not checked)" if it is undecided
    utilisation: float  # infinite if a required value is unbounded, or if the check is undecided
    place: str = ""

    @property
    def undecided(self) -> bool:
        """Whether missing data leave the check undecided."""
        return self.check.endswith(NOT_CHECKED)


def worst_of_set(evaluation: Evaluation) -> Worst:
    """The check with the highest utilisation of a set of drives."""
    return _worst(placed_checks(evaluation))


def worst_of(checks: Iterable[Check]) -> Worst:
    """The check with the highest utilisation; no name if none was made."""
    return _worst(("", check) for check in checks)


def _worst(checks: Iterable[tuple[str, Check]]) -> Worst:
    """The check with the highest finite utilisation; an unbounded or undecided one only if no finite one exceeds 1."""
    found = []
    for place, one in checks:
        if undecided(one):
            found.append(Worst(one.name + NOT_CHECKED, math.inf, place))
        elif one.utilisation is not None:
            found.append(Worst(one.name, math.inf if math.isnan(one.utilisation) else one.utilisation, place))
    numbered = [one for one in found if math.isfinite(one.utilisation)]
    largest = max(numbered, key=lambda one: one.utilisation, default=None)
    unbounded = [one for one in found if not math.isfinite(one.utilisation)]
    worst = unbounded[0] if unbounded and (largest is None or largest.utilisation <= 1.0) else largest
    return worst or Worst("", 0.0)
