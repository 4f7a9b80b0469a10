"""A set of drives on the bench: every check of one joint or of all, while the task or a ratio is changed.

Made for searches that ask often: the arm is not run again (see ``changed_work``). The figures are those of
``evaluate`` for the changed study to rounding, and what a search finds is to be evaluated there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from drivetrain.drive.drive import Drive
from drivetrain.drive.matching import scaled_gear
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.old_judge import judge
from drivetrain.sizing.judge.operation import Operation, operation
from drivetrain.sizing.results import Evaluation
from drivetrain.study.change import TaskChange
from drivetrain.study.study import Study
from drivetrain.study.verdicts import Check

AS_IT_IS = TaskChange()


class Worst(NamedTuple):
    """The check that is closest to its limit, or furthest over it.

    Attributes:
        check: Its name; empty when none was judged.
        utilisation: 1 is the limit; infinite when something is without bound.
        place: The joint, or ``supply``; empty where only one place was looked at.
    """

    check: str
    utilisation: float
    place: str = ""


@dataclass(frozen=True, eq=False)
class Bench:
    """A set of drives held against changes of a task.

    Attributes:
        family: The task, and the work of its changes.
        keys: Of (motor, gear) by joint name, all joints.
    """

    family: WorkFamily
    keys: Mapping[str, tuple[str, str]]

    @property
    def study(self) -> Study:
        """The task unchanged."""
        return self.family.study

    @cached_property
    def shelf(self) -> Shelf:
        """The catalogue's rows, assumptions filled in."""
        return Shelf(self.study)

    @cached_property
    def mounted(self) -> dict[int, Drive]:
        """The drives by joint index."""
        return {i: self.shelf.drive(task, *self.keys[task.name]) for i, task in enumerate(self.study.joints)}

    @cached_property
    def _work(self) -> Workload:
        return self.family.at(AS_IT_IS)

    def run(self, joint: int, change: TaskChange = AS_IT_IS, drive: Drive | None = None) -> Operation:
        """One joint's drive at its work, the other drives in place.

        Args:
            drive: Instead of the joint's own; None: its own.
        """
        own = self.mounted[joint] if drive is None else drive
        work = self._work if change == AS_IT_IS else self.family.at(change)
        return operation(work.study, joint, work.at(joint, self.mounted).demand(own), own)

    def joint_worst(self, joint: int, change: TaskChange = AS_IT_IS, drive: Drive | None = None) -> Worst:
        """How near one joint's drive comes to its limits.

        Args:
            drive: Instead of the joint's own; None: its own.
        """
        return worst_of(judge(self.run(joint, change, drive)))

    def evaluation(self, change: TaskChange = AS_IT_IS) -> Evaluation:
        """The whole set at a change."""
        return evaluated(self.family.at(change), self.keys)

    def set_worst(self, change: TaskChange = AS_IT_IS) -> Worst:
        """How near the whole set comes to its limits."""
        return worst_of_set(self.evaluation(change))


def worst_of_set(evaluation: Evaluation) -> Worst:
    """The check of highest utilisation of a set, and where it is."""
    places = [worst_of(one.checks)._replace(place=name) for name, one in evaluation.joints.items()]
    places.append(worst_of(evaluation.shared)._replace(place="supply"))
    numbered = [one for one in places if math.isfinite(one.utilisation)]
    most = max(numbered, key=lambda one: one.utilisation, default=places[0])
    beyond = [one for one in places if not math.isfinite(one.utilisation)]
    return beyond[0] if beyond and most.utilisation <= 1.0 else most


def worst_of(checks: Iterable[Check]) -> Worst:
    """The check of highest utilisation."""
    used = [(_number(one.utilisation), one.name) for one in checks if one.utilisation is not None]
    numbered = [entry for entry in used if math.isfinite(entry[0])]
    most, name = max(numbered, default=(0.0, ""), key=lambda entry: entry[0])
    if most <= 1.0 and len(numbered) < len(used):
        return next(Worst(name, used) for used, name in used if not math.isfinite(used))
    return Worst(name, most)


def with_ratio(study: Study, gear: str, ratio: float) -> tuple[Study, str]:
    """The study with one more gear in its catalogue: one of its own at another ratio, its sheet kept otherwise."""
    key = f"{gear} at ratio {ratio:.9g}"
    row = replace(scaled_gear(study.catalog.gears[gear], ratio), key=key)
    gears = {**study.catalog.gears, key: row}
    return replace(study, catalog=replace(study.catalog, gears=gears)), key


def _number(used: float | None) -> float:
    """Not a number is a failed check."""
    return math.inf if used is None or math.isnan(used) else used
