"""Joints at which a search has nothing to choose from: why, told once for all joints that share the reason."""

from __future__ import annotations

import numpy as np

from drivetrain.sizing.judge.missing import cells_to_fill
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.search.problem import Problem
from drivetrain.study.verdicts import Check, Verdict


def nothing_to_choose(problem: Problem) -> tuple[Check, ...]:
    """What keeps joints from having any candidate, as checks that fail; none has a utilisation, as no limit is met."""
    return tuple(
        Check(
            f"candidates of {task.name}", 1.0, 0.0, "1", None, Verdict.FAIL,
            remark=_told(_reason(problem, joint)[0], [task.name]),
        )
        for joint, task in enumerate(problem.packed.study.joints) if not len(problem.known[joint])
    )  # fmt: skip


def why_nothing(problem: Problem) -> tuple[tuple[str, str], ...]:
    """The reasons in words, each with all joints that it holds for."""
    joints: dict[tuple[str, str], list[str]] = {}
    for joint, task in enumerate(problem.packed.study.joints):
        if not len(problem.known[joint]):
            joints.setdefault(_reason(problem, joint), []).append(task.name)
    return tuple((_told(reason, names), mend) for (reason, mend), names in joints.items())


def _reason(problem: Problem, joint: int) -> tuple[str, str]:
    """Why a joint has no candidate, with a place for its name, and what would mend it."""
    packed, pairs, task = problem.packed, problem.unknown[joint], problem.packed.study.joints[joint]
    if not len(pairs):
        return "{} neither a given drive nor a candidate", "" if task.pairs else "; ".join(task.passed_over)
    terms, cells = [], []
    for term, values in (("mass", packed.mass), ("price", packed.price)):
        if np.isnan(values[pairs]).any() and (term == "mass" or weight_of(problem.wanted, term)):
            terms.append(term)
            cells.append(cells_to_fill(packed.study, [packed.keys(pair) for pair in pairs], term))
    return f"none of the {len(pairs)} candidates of {{}} has a known {' and '.join(terms)}", "; ".join(cells)


def _told(reason: str, names: list[str]) -> str:
    """A reason with the names of its joints."""
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    if reason.startswith("{} "):
        return reason.format(f"{listed} {'has' if len(names) == 1 else 'have'}")
    return reason.format(listed)
