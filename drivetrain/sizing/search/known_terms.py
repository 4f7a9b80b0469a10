"""Whether the candidates of a study have what sets of drives are to be compared by: told before any search."""

from __future__ import annotations

from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault
from drivetrain.sizing.judge.objectives import TERMS, weight_of
from drivetrain.study.model import JointTask, Study

SHEET = ("mass", "price")  # what sheets state; energy and utilisation are computed
MOST_NAMED = 3


def lacking_of(study: Study, name: str) -> dict[str, tuple[int, int]]:
    """How many candidates of each joint have no known mass or price."""
    found = {}
    for task in study.joints:
        pairs = _pairs(task)
        lacks = sum(any(getattr(row, name) is None for row in _rows(study, *pair)) for pair in pairs)
        found[task.name] = (lacks, len(pairs))
    return found


def words_of(study: Study, name: str) -> str:
    """Where nothing is known of a term, in words."""
    bare = {joint: count for joint, (lacks, count) in lacking_of(study, name).items() if count and lacks == count}
    if not bare:
        return ""
    joints = ", ".join(f"{count} at {joint}" for joint, count in bare.items())
    parts = []
    for kind, keys in zip(("motors", "gears"), _keys(study, name, bare), strict=True):
        if keys:
            some = ", ".join(sorted(keys)[:MOST_NAMED]) + (", ..." if len(keys) > MOST_NAMED else "")
            parts.append(f"{len(keys)} {kind} ({some})")
    return f"no candidate has a known {name}: {joints}; without one are the rows of {' and '.join(parts)}"


def unknown_terms(study: Study) -> list[Fault]:
    """What an objective weighs that no candidate of some joint has."""
    found = []
    for name in TERMS:
        words = words_of(study, name) if name in SHEET and weight_of(study.wanted, name) else ""
        if words:
            hint = f"fill the column {name} of the catalogue, or minimise something else"
            found.append(Fault("objective", words, name, hint))
    return found


def _pairs(task: JointTask) -> tuple[tuple[str, str], ...]:
    return tuple(task.pairs) if task.drive is None else (task.drive,)


def _rows(study: Study, motor: str, gear: str) -> list[Motor | Gear]:
    """The sheets of a pair; none of a part that the catalogue does not have."""
    catalog = study.catalog
    rows: list[Motor | Gear] = [catalog.motors[motor]] if motor in catalog.motors else []
    return rows + ([catalog.gears[gear]] if gear in catalog.gears else [])


def _keys(study: Study, name: str, joints: dict[str, int]) -> tuple[set[str], set[str]]:
    """Motors and gears without a value among the candidates of some joints."""
    motors: set[str] = set()
    gears: set[str] = set()
    for task in study.joints:
        for motor, gear in _pairs(task) if task.name in joints else ():
            for keys, key, rows in ((motors, motor, study.catalog.motors), (gears, gear, study.catalog.gears)):
                if key in rows and getattr(rows[key], name) is None:
                    keys.add(key)
    return motors, gears
