"""When nothing fits: the nearest set of drives, what binds it, and what would mend it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from drivetrain.sizing.answers.smallest_change import Steps, first_passing
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.missing import gap_lines, gaps
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.rejected import SUPPLY, Nearest
from drivetrain.sizing.tolerance.bench import Bench
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.verdicts import Check, Verdict

SLOWEST = 10.0  # times the cycle's length; slower is another task
HIGHEST = 10.0  # times the supply's voltage
STEPS = 32
ROUNDED = 1e-3  # of the change, to the safe side of its edge, so that printed digits hold too


def advice_on(evaluation: Evaluation, near: Nearest) -> tuple[str, ...]:
    """What stands in the way of the nearest set, and each single change that was tried and mends it."""
    words = [_place(near), *_binding(evaluation, near)]
    if gaps(evaluation):
        return (*words, *missing_words(evaluation))
    found = [text for text in (_slower(near), _lighter(near), _higher(near)) if text]
    if not found:
        found = [
            f"Neither a slower cycle (up to {SLOWEST:g} times as long), nor less payload, nor more supply voltage "
            f"(up to {HIGHEST:g} times) alone mends it: the catalogue needs a stronger drive."
        ]
    return (*words, *found)


def missing_words(evaluation: Evaluation) -> tuple[str, ...]:
    """What is missing to prove that a set fits."""
    found = gap_lines(gaps(evaluation))
    hint = "No change of the task mends missing data: complete the catalogue rows, or state assumptions."
    return (*found, hint) if found else ()


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
    found = _least(near, np.geomspace(1.0, SLOWEST, STEPS), lambda factor: TaskChange(time=factor))
    if found is None:
        return ""
    length = near.study.cycle.duration
    kept = "" if near.study.arm is not None else ", at the table's torques"
    return (
        f"A slower motion mends it: a cycle of {length * found:.4g} s instead of {length:.4g} s, "
        f"{100.0 * (found - 1.0):.3g} % longer{kept}."
    )


def _lighter(near: Nearest) -> str:
    if near.study.arm is None or not any(payload.mass > 0.0 for payload in near.study.payloads):
        return ""
    found = _least(near, np.linspace(1.0, 0.0, STEPS), lambda share: TaskChange(payload=share))
    if found is None:
        return ""
    masses = ", ".join(
        f"{one.name} {one.mass * found:.4g} kg instead of {one.mass:.3g} kg" for one in near.study.payloads
    )
    return f"Less payload mends it: {masses}."


def _higher(near: Nearest) -> str:
    volts = near.study.supply.voltage
    found = _least(near, np.geomspace(1.0, HIGHEST, STEPS), lambda factor: TaskChange(voltage=factor))
    if found is None:
        return ""
    return f"More supply voltage mends it: {volts * found:.4g} V instead of {volts:g} V."


def _least(near: Nearest, steps: Steps, change: Callable[[float], TaskChange]) -> float | None:
    """The smallest change that mends the nearest set, a ten-thousandth to the safe side; None when none does."""
    bench = Bench(WorkFamily(near.study), near.keys)
    edge = first_passing(lambda factor: bench.set_worst(change(factor)), steps)
    if edge is None:
        return None
    found = edge.passes + ROUNDED * (edge.passes - 1.0)
    found = max(found, 0.0)
    return found if evaluate(changed(near.study, change(found)), near.keys).feasible else None
