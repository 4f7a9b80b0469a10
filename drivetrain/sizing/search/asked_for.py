"""What a search may be asked for: a study, and wishes that make sense of its joints."""

from __future__ import annotations

import math
from collections.abc import Iterator

from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.judge.objectives import TERMS
from drivetrain.study.model import JointTask, Study
from drivetrain.study.selection import Wanted


def check_asked(study: Study, wanted: Wanted | None) -> None:
    """Refuse what no search can answer; a study from a file has passed all of it.

    Args:
        wanted: What is asked for instead of what the study says; None: that.

    Raises:
        InputError: All that is wrong: no study, unknown terms or joints, numbers out of range.
    """
    if not isinstance(study, Study):
        raise InputError(Fault("study", "must be a study", type(study).__name__, "load_study reads one from its file"))
    asked = study.wanted if wanted is None else wanted
    if not isinstance(asked, Wanted):
        raise InputError(Fault("wanted", "must be a Wanted", type(asked).__name__))
    faults = [*_of_numbers(asked), *_of_weights(asked), *_of_groups(study, asked)]
    if faults:
        raise InputError(faults)


def check_keys(study: Study) -> None:
    """Refuse drives and candidates that the catalogue does not have; asked only once one was not found.

    Raises:
        InputError: The first unknown motor and gear of every joint.
    """
    faults = [fault for task in study.joints for fault in _of_keys(study, task)]
    if faults:
        raise InputError(faults)


def _of_numbers(asked: Wanted) -> Iterator[Fault]:
    for name in ("sets", "most_motor_types", "most_gear_types"):
        value = getattr(asked, name)
        if value is not None and not value >= 1:
            yield Fault(f"wanted.{name}", "must be 1 or more", value)
    if not asked.time_limit >= 0.0:
        yield Fault("wanted.time_limit", "must be 0 or more [s]", asked.time_limit)


def _of_weights(asked: Wanted) -> Iterator[Fault]:
    if not any(weight > 0.0 for _, weight in asked.weights):
        yield Fault("wanted.weights", "needs a weight above 0", asked.weights, f"for one of {', '.join(TERMS)}")
    for name, weight in asked.weights:
        if name not in TERMS:
            yield Fault("wanted.weights", "is no term of an objective", name, nearest(str(name), TERMS))
        elif not 0.0 <= weight < math.inf:
            yield Fault(f"wanted.weights.{name}", "must be 0 or more, and finite", weight)


def _of_groups(study: Study, asked: Wanted) -> Iterator[Fault]:
    names = [task.name for task in study.joints]
    for group in asked.same_family:
        for name in group:
            if name not in names:
                yield Fault("wanted.same_family", "is no joint of the study", name, nearest(str(name), names))


def _of_keys(study: Study, task: JointTask) -> Iterator[Fault]:
    """Of the first pair with an unknown motor, and of the first with an unknown gear."""
    motors, gears = study.catalog.motors, study.catalog.gears
    pairs = task.pairs if task.drive is None else (task.drive,)
    motor = next((one for one, _ in pairs if one not in motors), None)
    gear = next((one for _, one in pairs if one and one not in gears), None)
    if motor is not None:
        yield Fault(f"joints.{task.name}", "no motor has this key", motor, nearest(motor, motors))
    if gear is not None:
        yield Fault(f"joints.{task.name}", "no gear has this key", gear, nearest(gear, gears))
