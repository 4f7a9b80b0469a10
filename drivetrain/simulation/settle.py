"""Laws that bend within a step: asked again at what the solution makes of the step, until both agree.

Newton's method on what springs, flanks and walls answer; each only grows with its rate, so a chord between a rate that
was too slow and one that was too fast helps where that goes round in circles.
"""

from __future__ import annotations

import math
from typing import Any

from drivetrain.simulation.records import (
    AT,
    Run,
    call_laws,
    coordinates_of,
    engine_of,
    joints_of,
    pairs_of,
    part,
    world_of,
)
from drivetrain.simulation.tip import calm_tip, clear_tip, tip_agrees, try_tip

AGREED = 1e-12  # of a spring's torque that a solution may be off
PATIENCE = 6  # solutions before chords help


@part
def ask_again(run: Run, t: float, h: float, theta: float) -> None:
    """Ask springs and surroundings of the tip again, at the motion that the solution makes.

    Args:
        t: Middle of the step [s].
        h: Step [s].
    """
    coordinates, joints = coordinates_of(run), joints_of(run)
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.trial = one.speed + theta * one.change
    for i in range(len(joints)):
        m = coordinates[i].motor
        if m != i:
            rotor, spring = coordinates[m], joints[i].spring
            rate = rotor.trial - coordinates[i].trial
            spring.wind_up, spring.speed = rotor.position + theta * h * rate, rate
            spring.torque = spring.damping = spring.stiffness = 0.0
    if engine_of(run).uses_tip:
        try_tip(run, theta * h)
        clear_tip(world_of(run).tip)
    call_laws(run, AT.repeats, t, h)


@part
def _chord(rotor: Any, rate: float, torque: float, expected: float) -> float:
    """Note a rate that was tried; the slope of the chord between one too slow and one too fast, or -1.

    A spring's torque only grows with its rate, and its rate only falls with its torque: what answers more than expected
    turns too fast, what answers less too slowly. Where Newton's method goes round in circles the chord stays between.

    Reference: Dowell and Jarratt, A modified regula falsi method (Illinois), BIT 11 (1971) 168.
    """
    slow, fast = rotor.slow, rotor.fast
    too_fast = torque > expected
    if too_fast:
        own, other = fast, slow
    else:
        own, other = slow, fast
    again = abs(own.rate) < math.inf
    own.rate, own.expected, own.off = rate, expected, torque - expected
    if not slow.rate < fast.rate:  # other springs have moved on: what was tried before says nothing any more
        other.rate = -math.inf if too_fast else math.inf
    if not abs(other.rate) < math.inf:
        return -1.0
    if again:
        other.off *= 0.5
    return max((fast.expected + fast.off - slow.expected - slow.off) / (fast.rate - slow.rate), 0.0)


@part
def agrees(run: Run, h: float, theta: float, attempt: int) -> bool:
    """Whether springs and surroundings of the tip answer what the solution expects of them.

    Args:
        h: Step [s].
        attempt: How often the step has been solved again [-].
    """
    coordinates, joints, pairs = coordinates_of(run), joints_of(run), pairs_of(run)
    good = True
    for i in range(len(joints)):
        m = coordinates[i].motor
        if m == i:
            continue
        link, rotor, spring = coordinates[i], coordinates[m], joints[i].spring
        expected = rotor.transmitted + pairs[m, m].transmitted * rotor.change + pairs[m, i].transmitted * link.change
        slope = max(spring.damping + theta * h * spring.stiffness, pairs[m, m].transmitted / theta)
        size = abs(rotor.trial) + abs(link.trial) + abs(spring.wind_up) / (theta * h)
        if attempt == 0:
            rotor.slow.rate, rotor.fast.rate = -math.inf, math.inf
        off = abs(spring.torque - expected)
        if off <= AGREED * (abs(spring.torque) + abs(expected)) + 2e-15 * slope * size:
            continue
        good = False
        chord = _chord(rotor, spring.speed, spring.torque, expected)
        if attempt >= PATIENCE and chord >= 0.0:
            spring.damping, spring.stiffness = chord, 0.0
    if engine_of(run).uses_tip:
        good = tip_agrees(run, theta * h) and good
        if attempt >= PATIENCE and attempt % 2:
            calm_tip(run)
    return good
