"""Where a run begins: states that fit one another, so that no layer of fast motion comes first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

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
    """The numbers of a run with its states at the start."""
    scene, states = plan.scene, np.zeros(len(plan.memory.states))
    n, c = plan.body.n, plan.body.c
    position, speed = _motion(plan)
    states[:n], states[c : c + n] = plan.body.coordinates_of(position), plan.body.coordinates_of(speed)
    for i in plan.body.springs:
        states[c + plan.body.motors[i]] = speed[i]
    rates, signals = np.zeros(len(states)), np.zeros(words[f.SIGNALS])
    begun = [(one, [plan.memory.states[name] for name in one.states]) for one in plan.instances if one.states]
    bent = {i: shape.deflection for i, shape in plan.body.springs.items() if shape.deflection is not None}
    for _ in range(PASSES if begun or bent else 0):
        before = states.copy()
        evaluate(rates_kernel.signals().address, 0.0, states, signals, numbers, words)
        told = _Told(plan.memory.places, signals.tolist())
        for i, deflection in bent.items():
            load = told[f"{scene.joints[i]}.bias_torque"] - told[f"{scene.joints[i]}.joint_torque"]
            states[plan.body.motors[i]] = deflection(load)
        for one, at in begun:
            states[at] = one.effect.start(one.place, told)
        if np.array_equal(states, before):
            break
    # Who slid while states did not fit yet would else go on sliding at no speed.
    words[words[f.AT_MODES] : words[f.AT_MODES] + c] = 0
    evaluate(rates_kernel.rates().address, 0.0, states, rates, numbers, words)
    numbers[words[f.AT_STATE] : words[f.AT_STATE] + len(states)] = states
    numbers[words[f.AT_RATES] : words[f.AT_RATES] + len(states)] = 0.0
    last = words[f.AT_VECTORS] + f.LAST * c
    numbers[last : last + c] = np.where(np.isfinite(rates[c : 2 * c]), rates[c : 2 * c], 0.0)
    return numbers


class _Told(Mapping[str, float]):
    """Signals by name, looked up one by one: of hundreds an effect asks for three."""

    def __init__(self, places: Mapping[str, int], values: list[float]) -> None:
        self._places, self._values = places, values

    def __getitem__(self, name: str) -> float:
        return self._values[self._places[name]]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


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
