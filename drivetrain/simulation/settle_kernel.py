"""Laws that bend within a step: asked again at what the solution makes of the step, until both agree.

Newton's method on what springs, flanks and walls answer; each only grows with its rate, so a chord between a rate that
was too slow and one that was too fast helps where that goes round in circles.
"""

from __future__ import annotations

import math
from typing import Any

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all
from drivetrain.simulation.tip_kernel import calm_tip, tip_agrees, try_tip
from drivetrain.simulation.vector_rows import row_of

AGREED = 1e-12  # of a spring's torque that a solution may be off
PATIENCE = 6  # solutions before chords help


@part
def ask_again(n: Any, w: Any, t: float, h: float, theta: float, rates: Any) -> None:
    """Ask springs and surroundings of the tip again, at the motion that the solution makes.

    Args:
        t: Middle of the step [s].
        h: Step [s].
    """
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    trial, speeds, change = row_of(w, f.TRIAL), w[f.AT_STATE] + c, row_of(w, f.CHANGE)
    taken = s + w[f.ADDED_FROM]
    for i in range(c):
        n[trial + i] = n[speeds + i] + theta * n[change + i]
    for i in range(joints):
        m = w[w[f.AT_MOTORS] + i]
        if m != i:
            rate = n[trial + m] - n[trial + i]
            n[s + f.DEFLECTION * joints + i] = n[w[f.AT_STATE] + m] + theta * h * rate
            n[s + f.DEFLECTION_SPEED * joints + i] = rate
            for j in range(f.GEAR_TORQUE, f.GEAR_STIFFNESS + 1):
                n[taken + j * joints + i] = 0.0
    if w[f.TIP]:
        try_tip(n, w, theta * h)
        for k in range(f.TIP_FORCES):
            n[s + w[f.AT_TIP_TAKEN] + k] = 0.0
    call_all(w[f.REPEATS], w[f.AT_REPEATS], t, h, rates, n, w)


@part
def _bracketed(n: Any, at: int, rate: float, torque: float, expected: float) -> float:
    """Note a rate that was tried; the slope of the chord between one too slow and one too fast, or -1.

    A spring's torque only grows with its rate, and its rate only falls with its torque: what answers more than expected
    turns too fast, what answers less too slowly. Where Newton's method goes round in circles the chord stays between.

    Reference: Dowell and Jarratt, A modified regula falsi method (Illinois), BIT 11 (1971) 168.
    """
    own, other = (at + 3, at) if torque > expected else (at, at + 3)
    again = abs(n[own]) < math.inf
    n[own] = rate
    n[own + 1] = expected
    n[own + 2] = torque - expected
    if not n[at] < n[at + 3]:  # other springs have moved on: what was tried before says nothing any more
        n[other] = -math.inf if other == at else math.inf
    if not abs(n[other]) < math.inf:
        return -1.0
    if again:
        n[other + 2] *= 0.5
    return max((n[at + 4] + n[at + 5] - n[at + 1] - n[at + 2]) / (n[at + 3] - n[at]), 0.0)


@part
def agrees(n: Any, w: Any, h: float, theta: float, attempt: int) -> bool:
    """Whether springs and surroundings of the tip answer what the solution expects of them.

    Args:
        h: Step [s].
        attempt: How often the step has been solved again [-].
    """
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    trial, change, good = row_of(w, f.TRIAL), row_of(w, f.CHANGE), True
    for i in range(joints):
        m, taken = w[w[f.AT_MOTORS] + i], s + w[f.ADDED_FROM] + i
        if m == i:
            continue
        rows, at = w[f.AT_CARRIED] + m * c, w[f.AT_TRIED] + 6 * m
        expected = n[row_of(w, f.CARRIED) + m] + n[rows + m] * n[change + m] + n[rows + i] * n[change + i]
        torque, rate = n[taken + f.GEAR_TORQUE * joints], n[s + f.DEFLECTION_SPEED * joints + i]
        slope = n[taken + f.GEAR_DAMPING * joints] + theta * h * n[taken + f.GEAR_STIFFNESS * joints]
        slope = max(slope, n[rows + m] / theta)
        size = abs(n[trial + m]) + abs(n[trial + i]) + abs(n[s + f.DEFLECTION * joints + i]) / (theta * h)
        if attempt == 0:
            n[at] = -math.inf
            n[at + 3] = math.inf
        if abs(torque - expected) <= AGREED * (abs(torque) + abs(expected)) + 2e-15 * slope * size:
            continue
        good = False
        chord = _bracketed(n, at, rate, torque, expected)
        if attempt >= PATIENCE and chord >= 0.0:
            n[taken + f.GEAR_DAMPING * joints] = chord
            n[taken + f.GEAR_STIFFNESS * joints] = 0.0
    if w[f.TIP]:
        good = tip_agrees(n, w, theta * h) and good
        if attempt >= PATIENCE and attempt % 2:
            calm_tip(n, w)
    return good
