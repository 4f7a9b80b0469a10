"""When nothing fits: the nearest set of drives, what binds it, and which single change of the task would fix it."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.missing import gaps, missing_words
from drivetrain.sizing.judge.vary import Vary, first_edge, named_drives, task_number, worst_of_set
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.nearest import SUPPLY, Nearest
from drivetrain.study.verdicts import Check, Verdict

MOST = 10.0  # times the cycle's length, times the supply's voltage: beyond, it is another task
STEPS = 32
ROUNDED = 1e-3  # of the change, to the safe side of its edge, so that printed digits hold too


def advice_on(evaluation: Evaluation, near: Nearest) -> tuple[str, ...]:
    """What stands in the way of the nearest set, and each single change that was tried and fixes it."""
    words = [_place(near), *_binding(evaluation, near)]
    if gaps(evaluation):
        return (*words, *missing_words(evaluation))
    found = [text for text in (_slower(near), _lighter(near), _higher(near)) if text]
    if not found:
        found = [
            f"Neither a slower cycle (up to {MOST:g} times as long), nor less payload, nor more supply voltage "
            f"(up to {MOST:g} times) alone mends it: the catalogue needs a stronger drive."
        ]
    return (*words, *found)


def _place(near: Nearest) -> str:
    if near.joint == SUPPLY:
        return "Every joint has a drive that holds; together they ask too much of the supply."
    name = near.study.joints[near.joint].name
    motor, gear = near.keys[name]
    return f"No candidate at {name} holds; the nearest is {motor} with {gear or 'no gear'}."


def _binding(evaluation: Evaluation, near: Nearest) -> list[str]:
    """The failed check that is furthest over its limit: where the search stopped, then place by place to the base."""
    found = []
    places = [(name, joint.checks) for name, joint in evaluation.joints.items()]
    for place, checks in [*places[near.joint :: -1], *places, ("supply", evaluation.shared)]:
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


def _slower(near: Nearest) -> str:
    found, length = _least(near, Vary.CYCLE_TIME, np.geomspace(1.0, MOST, STEPS)), near.study.cycle.duration
    if found is None:
        return ""
    kept = "" if near.study.arm is not None else ", at the table's torques"
    return (
        f"A slower motion mends it: a cycle of {length * found:.4g} s instead of {length:.4g} s, "
        f"{100.0 * (found - 1.0):.3g} % longer{kept}."
    )


def _lighter(near: Nearest) -> str:
    if near.study.arm is None or not any(payload.mass > 0.0 for payload in near.study.payloads):
        return ""
    found = _least(near, Vary.PAYLOAD, np.linspace(1.0, 0.0, STEPS))
    if found is None:
        return ""
    masses = ", ".join(
        f"{one.name} {one.mass * found:.4g} kg instead of {one.mass:.3g} kg" for one in near.study.payloads
    )
    return f"Less payload mends it: {masses}."


def _higher(near: Nearest) -> str:
    found, volts = _least(near, Vary.VOLTAGE, np.geomspace(1.0, MOST, STEPS)), near.study.supply.voltage
    return "" if found is None else f"More supply voltage mends it: {volts * found:.4g} V instead of {volts:g} V."


def _least(near: Nearest, vary: Vary, steps: Array) -> float | None:
    """The factor of the smallest change that lets the nearest set pass, rounded to the safe side; None: none does."""
    number = task_number(WorkFamily(near.study), named_drives(near.study, near.keys), vary)
    found = first_edge(
        lambda value: worst_of_set(number.put(value).evaluation()).utilisation <= 1.0, number.now * steps
    )
    if found is None:
        return None
    factor = found.inside / number.now
    factor = max(factor + ROUNDED * (factor - 1.0), 0.0)
    return factor if number.put(factor * number.now).proven().feasible else None
