"""Where a run begins: states that fit one another, so that no layer of fast motion comes first."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects.effect import Effect
from drivetrain.simulation import fields as f
from drivetrain.simulation import rates_kernel
from drivetrain.simulation.memory import Words
from drivetrain.simulation.plan import Plan
from drivetrain.solvers.compiled_function import evaluate

PASSES = 4  # states that depend on states that depend on states


def started(plan: Plan, numbers: Array, words: Words) -> Array:
    """The numbers of a run with its states at the start.

    Args:
        plan: The plan.
        numbers, words: Of the run.

    Returns:
        The numbers; the last accelerations are those of the start, so that the first step guesses as well as any.
    """
    scene, states = plan.scene, np.zeros(len(plan.memory.states))
    n, c = plan.body.n, plan.body.c
    position, speed = _motion(plan)
    states[:n], states[c : c + n] = position, speed
    for i in plan.body.springs:
        states[c + plan.body.motors[i]] = speed[i]
    signals = np.zeros(words[f.SIGNALS])
    rates, places = np.zeros(len(states)), list(plan.memory.places.values())
    for _ in range(PASSES):
        evaluate(rates_kernel.signals().address, 0.0, states, signals, numbers, words)
        told = dict(zip(plan.memory.places, signals[places].tolist(), strict=True))
        for i, shape in plan.body.springs.items():
            joint = scene.joints[i]
            if shape.deflection is not None:
                load = told[f"{joint}.bias_torque"] - told[f"{joint}.joint_torque"]
                states[plan.body.motors[i]] = shape.deflection(load)
        for one in plan.instances:
            if one.states:
                states[[plan.memory.states[name] for name in one.states]] = one.effect.start(one.place, told)
    evaluate(rates_kernel.rates().address, 0.0, states, rates, numbers, words)
    numbers[words[f.AT_STATE] : words[f.AT_STATE] + len(states)] = states
    numbers[words[f.AT_RATES] : words[f.AT_RATES] + len(states)] = 0.0
    last = words[f.AT_VECTORS] + f.LAST * c
    numbers[last : last + c] = np.where(np.isfinite(rates[c : 2 * c]), rates[c : 2 * c], 0.0)
    return numbers


def _motion(plan: Plan) -> tuple[Array, Array]:
    """Positions and speeds at the start: the scene's own, else where a command begins."""
    scene, n = plan.scene, plan.body.n
    position, speed = np.zeros(n), np.zeros(n)
    for one in plan.instances:
        told: Effect = one.effect
        begin = getattr(told, "begins_at", None)
        if begin is not None:
            joints, where, fast = begin(one.place)
            position[joints], speed[joints] = where, fast
    if scene.position is not None:
        position = np.asarray(scene.position)
        speed = np.zeros(n)
    if scene.speed is not None:
        speed = np.asarray(scene.speed)
    return position, speed
