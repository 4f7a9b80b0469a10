"""Which rates hang on which states, from what the effects of a plan say they read and write.

Accelerations all hang together through the inertia, the torques behind them do not: a current moves its own motor, a
twist its own link and motor. So the rows of accelerations stand here for those of the torques, from which
``jacobian_kernel.py`` finds the accelerations. Whether inertia and bias move with a motor's own state (they do with
that of a rotor that is a body of its own) is asked of the mechanics itself, at postures and speeds without symmetry.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.effects import signals as named
from drivetrain.simulation import fields as f
from drivetrain.simulation import rates_kernel
from drivetrain.simulation.plan import Plan
from drivetrain.solvers.compiled_function import evaluate

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
    n, words = plan.body.n, plan.memory.words
    bound = words[words[f.AT_BOUND] : words[f.AT_BOUND] + n] != 0 if words[f.COUPLED] else np.zeros(n, dtype=bool)
    together = [int(i) for i in np.flatnonzero(bound)]
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
    words, numbers, c = plan.memory.words.copy(), plan.memory.numbers.copy(), plan.body.c
    if int(words[f.KIND]) != f.ARM:
        return 0
    mass, bias = int(words[f.AT_SIGNALS] + words[f.AT_MASS]), int(words[f.AT_VECTORS] + f.BIAS * c)
    rates, address = np.zeros(len(plan.memory.states)), rates_kernel.rates().address

    def mechanics(state: Any) -> NDArray[np.float64]:
        evaluate(address, 0.0, state, rates, numbers, words)
        return np.append(numbers[mass : mass + c * c], numbers[bias : bias + c])

    found, rng = 0, np.random.default_rng(1)
    for _ in range(PROBES):
        state = np.zeros(len(rates))
        state[: 2 * c] = rng.uniform(-1.0, 1.0, 2 * c)
        first = mechanics(state)
        for k in range(2 * c):
            moved = state.copy()
            moved[k] += rng.uniform(0.1, 1.0)
            if not found >> k & 1 and not np.array_equal(first, mechanics(moved)):
                found |= 1 << k
    return found & moving
