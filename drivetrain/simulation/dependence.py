"""Which rates hang on which states, from what the effects of a plan say they read and write.

Accelerations all hang together through the inertia, the torques behind them do not: a current moves its own motor, a
twist its own link and motor. So the rows of accelerations stand here for those of the torques, from which
``jacobian.py`` finds the accelerations. Whether inertia and bias move with a motor's own state (they do with
that of a rotor that is a body of its own) is asked of the mechanics itself, at postures and speeds without symmetry.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.effects import signals as named
from drivetrain.simulation import rates
from drivetrain.simulation.plan import Plan

TIP = tuple(signal.name for signal in named.TIP_TAKEN)
PROBES = 2  # postures


def dependence(plan: Plan) -> NDArray[np.bool_]:
    """Where the derivative of a rate by a state can differ from zero; of a torque, where the rate is an acceleration.

    Returns:
        Rates by states, (m, m); never less than there is.
    """
    states, c = plan.memory.states, plan.body.c
    known = _motion(plan)
    places, speeds = (1 << c) - 1, ((1 << 2 * c) - 1) ^ ((1 << c) - 1)
    rows = [0] * len(states)
    for _ in range(2):  # what one effect adds after another of its kind has read
        for one in plan.instances:
            read = 0
            for name in one.needs:
                read |= known.get(name, 0)
            for name in one.states:
                read |= 1 << states[name]
            for name in (*one.provides, *one.contributes):
                known[name] = known.get(name, 0) | read
            for name, state in zip(one.states, one.ports.states, strict=True):
                rows[states[name]] = 0 if state.memory or one.effect.compute is None else read
    for i, coordinates in enumerate(_coordinates(plan)):
        joint, own = plan.scene.joints[i], 0
        for signal in (*named.TAKEN, *named.SHAFT_TAKEN):
            own |= known.get(f"{joint}.{signal.name}", 0)
        for k in coordinates:
            rows[c + k] |= own
    tip = 0
    for name in TIP:
        tip |= known.get(name, 0)
    inertial = _inertial(plan, places | speeds)
    for k in range(c):
        rows[k] = 1 << c + k
        rows[c + k] |= tip | inertial
    for i in plan.body.springs:
        rows[int(plan.body.motors[i])] |= 1 << c + i
    found = np.array([[row >> k & 1 for k in range(len(states))] for row in rows], dtype=bool)
    if not inertial:
        for coordinates in _coordinates(plan):
            found[np.ix_([c + k for k in coordinates], coordinates)] = True  # weights of joints without an arm
    return found


def _coordinates(plan: Plan) -> list[list[int]]:
    """Coordinates on which torques of a joint act: its own and its motor's, and those of shafts coupled to it."""
    n = plan.body.n
    together = [] if plan.body.coupled is None else list(plan.body.coupled.shafts)
    found = []
    for i in range(n):
        joints = together if i in together else [i]
        found.append(sorted({*joints, *(int(plan.body.motors[k]) for k in joints)}))
    return found


def _motion(plan: Plan) -> dict[str, int]:
    """States behind each signal that is known before any law, one bit a state."""
    c, states = plan.body.c, plan.memory.states
    known = {name: 1 << k for name, k in states.items()}
    everything = (1 << 2 * c) - 1
    for i, coordinates in enumerate(_coordinates(plan)):
        joint = plan.scene.joints[i]
        where = sum(1 << k for k in coordinates)
        for signal in (*named.BEFORE, *named.SHAFT_GIVEN):
            known[f"{joint}.{signal.name}"] = where << c if "speed" in signal.name else where
        known[f"{joint}.{named.BIAS_TORQUE.name}"] = everything
    for name in ("scene.mass_matrix", *(signal.name for signal in named.TIP_GIVEN)):
        known[name] = everything
    every = (1 << len(states)) - 1
    for joint in plan.scene.joints:  # of the evaluation before, if a law reads them at all
        for signal in named.AFTER:
            known[f"{joint}.{signal.name}"] = every
    return known


def _inertial(plan: Plan, moving: int) -> int:
    """States on which inertia or bias of an arm hang, one bit a state; 0 where the inertia is constant."""
    memory, c = plan.memory, plan.body.c
    if plan.body.arm is None:
        return 0
    numbers = memory.numbers.copy()
    pairs, at = memory.view(numbers, "pairs"), memory.view(numbers, "coordinates")

    def mechanics(state: Any) -> NDArray[np.float64]:
        rates.evaluate_rates(numbers, state)
        return np.append(pairs["mass"], at["bias"])

    found, rng = 0, np.random.default_rng(1)
    for _ in range(PROBES):
        state = np.zeros(memory.moving)
        state[: 2 * c] = rng.uniform(-1.0, 1.0, 2 * c)
        first = mechanics(state)
        for k in range(2 * c):
            moved = state.copy()
            moved[k] += rng.uniform(0.1, 1.0)
            if not found >> k & 1 and not np.array_equal(first, mechanics(moved)):
                found |= 1 << k
    return found & moving
