"""Where nothing fits: what binds the nearest set, and which single change of the task would fix it.

A change is tried with the nearest set first; what that cannot do is then searched for in all candidates of the study.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.missing import gaps, missing_words
from drivetrain.sizing.judge.stop_checks import asks_stops
from drivetrain.sizing.judge.vary import Vary, first_edge, named_drives, task_number, worst_of_set
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.asked import satisfied
from drivetrain.sizing.search.candidates import candidates
from drivetrain.sizing.search.problem import problem
from drivetrain.sizing.search.rejected import SUPPLY, Nearest
from drivetrain.sizing.search.tree import Tree
from drivetrain.study.parts.verdicts import Check, Verdict, shared_place

MOST = 10.0  # times the cycle's length, times the supply's voltage: beyond, it is another task
STEPS = 32
ROUNDED = 1e-3  # of the change, to the safe side of its edge, so that printed digits hold too
PARTS = 8  # of the change, at whose ends all candidates are searched: at most four of them
AT_MOST = 5.0  # s of such a search


def advice_on(evaluation: Evaluation, near: Nearest) -> tuple[str, ...]:
    """What stands in the way of the nearest set, and each single change that was tried and fixes it."""
    words = [_place(near), *_binding(evaluation, near)]
    if gaps(evaluation):
        return (*words, *missing_words(evaluation))
    family = WorkFamily(near.study)
    tried = [_slower(near, family), _lighter(near, family), _higher(near, family)]
    found = [text for text in tried if text]
    if not found:
        found = [
            f"With these drives neither a slower cycle (up to {MOST:g} times as long), nor less payload, nor more "
            f"supply voltage (up to {MOST:g} times) by itself fixes it."
        ]
    slower = (
        ""
        if tried[0] or near.study.base is not None
        else _others(near, family, Vary.CYCLE_TIME, np.geomspace(1.0, MOST, PARTS + 1))
    )
    lighter = (
        "" if tried[1] or not _carries(near) else _others(near, family, Vary.PAYLOAD, np.linspace(1, 0, PARTS + 1))
    )
    return (*words, *found, *(text for text in (slower, lighter) if text))


def _place(near: Nearest) -> str:
    if near.joint == SUPPLY:
        soft = ", or are not as stiff as wished" if near.study.stiffness.asked else ""
        hard = ", or load their gears too much as all stop at once" if asks_stops(near.study) else ""
        return f"Every joint has a drive that meets its limits; together they need too much of the supply{soft}{hard}."
    name = near.study.joints[near.joint].name
    motor, gear = near.keys[name]
    return f"No candidate at {name} meets all limits; the closest is {motor} with {gear or 'no gear'}."


def _binding(evaluation: Evaluation, near: Nearest) -> list[str]:
    """The failed check that is furthest over its limit: where the search stopped, then place by place to the base."""
    found = []
    places = [(name, joint.checks) for name, joint in evaluation.joints.items()]
    shared = [(shared_place(check), (check,)) for check in evaluation.shared]
    for place, checks in [*places[near.joint :: -1], *places, *shared]:
        failed = [check for check in checks if check.verdict is Verdict.FAIL]
        if failed:
            check = max(failed, key=_excess)
            found.append(f"Binding at {place}: {check.name}, {_figures(check)}.")
    return list(dict.fromkeys(found))


def _excess(check: Check) -> float:
    """Utilisation for ordering; heat that runs away comes last, as the check beside it has a number."""
    used = check.utilisation or 0.0
    return used if math.isfinite(used) else 0.0


def _figures(check: Check) -> str:
    required, available = (math.nan if v is None else v for v in (check.required, check.available))
    over = 100.0 * ((check.utilisation or 0.0) - 1.0)
    excess = f"{over:.3g} % over" if math.isfinite(over) else "without bound"
    return f"{required:.4g} of {available:.4g} {check.unit} ({excess})"


def _slower(near: Nearest, family: WorkFamily) -> str:
    if near.study.base is not None:
        return ""
    found, length = _least(near, family, Vary.CYCLE_TIME, np.geomspace(1.0, MOST, STEPS)), near.study.cycle.duration
    if found is None:
        return ""
    kept = "" if near.study.arm is not None else ", at the table's torques"
    return (
        f"With these drives a slower motion is enough: a cycle of {length * found:.4g} s instead of {length:.4g} s, "
        f"{100.0 * (found - 1.0):.3g} % longer{kept}."
    )


def _lighter(near: Nearest, family: WorkFamily) -> str:
    if not _carries(near):
        return ""
    found = _least(near, family, Vary.PAYLOAD, np.linspace(1.0, 0.0, STEPS))
    if found is None:
        return ""
    return f"With these drives less payload is enough: {_masses(near, found)}."


def _carries(near: Nearest) -> bool:
    return near.study.arm is not None and any(payload.mass > 0.0 for payload in near.study.payloads)


def _masses(near: Nearest, share: float) -> str:
    return ", ".join(
        f"{one.name} {one.mass * share:.4g} kg instead of {one.mass:.3g} kg" for one in near.study.payloads
    )


def _higher(near: Nearest, family: WorkFamily) -> str:
    found, volts = _least(near, family, Vary.VOLTAGE, np.geomspace(1.0, MOST, STEPS)), near.study.supply.voltage
    if found is None:
        return ""
    return f"With these drives more supply voltage is enough: {volts * found:.4g} V instead of {volts:g} V."


def _least(near: Nearest, family: WorkFamily, vary: Vary, steps: Array) -> float | None:
    """The factor of the smallest change that lets the nearest set pass, rounded to the safe side; None: none does."""
    number = task_number(family, named_drives(near.study, near.keys), vary)
    found = first_edge(
        lambda value: worst_of_set(number.put(value).evaluation()).utilisation <= 1.0, number.now * steps
    )
    if found is None:
        return None
    factor = found.inside / number.now
    factor = max(factor + ROUNDED * (factor - 1.0), 0.0)
    return factor if number.put(factor * number.now).proven().feasible else None


# All candidates


def _others(near: Nearest, family: WorkFamily, vary: Vary, factors: Array) -> str:
    """The smallest of some changes at which any candidates do it, by halving, the largest one looked at first."""
    found, settled = _searched(near, family, vary, factors[-1])
    works, fails, drives = len(factors) - 1, 0, found
    while drives and works - fails > 1 and settled:
        middle = (works + fails) // 2
        found, settled = _searched(near, family, vary, factors[middle])
        works, fails, drives = (middle, fails, found) if found else (works, middle, drives)
    paced = vary is Vary.CYCLE_TIME
    length, factor, before = near.study.cycle.duration, factors[works], factors[fails]
    if not drives:
        even = f"even with a cycle {factor:g} times as long" if paced else "even without any payload"
        return f"None of the other candidates meets all limits either, {even}: all were searched." if settled else ""
    what = f"a cycle of {length * factor:.4g} s instead of {length:.4g} s" if paced else _masses(near, factor)
    least = f"{length * before:.4g} s" if paced else f"{100.0 * before:.3g} % of the payload"
    limit = "" if fails == 0 or not settled else f"; with {least} none do"
    named = ", ".join(f"{name} {' with '.join(key for key in pair if key)}" for name, pair in drives.items())
    return f"Other candidates meet all limits with {what}{limit}: {named}."


def _searched(
    near: Nearest, family: WorkFamily, vary: Vary, factor: float
) -> tuple[dict[str, tuple[str, str]], bool]:  # fmt: skip
    """The best set of all candidates with a change, and whether the search came to its end."""
    work = family.at(vary.change(near.study, float(factor) * vary.now(near.study)))
    study = replace(work.study, wanted=replace(near.study.wanted, sets=1))
    tree = Tree(problem(candidates(study, replace(work, study=study)), study.wanted))
    tree.run(time.perf_counter() + min(AT_MOST, study.wanted.time_limit), lambda done, total, text: None)
    if not tree.best or not satisfied(tree.problem.evaluation(tree.best[0].pairs)):
        return {}, tree.finished
    return tree.problem.keys(dict(enumerate(tree.best[0].pairs))), True
