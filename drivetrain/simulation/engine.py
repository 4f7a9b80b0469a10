"""The engines of forward simulation, as descriptions: where a run begins, and what each gives back to be recorded."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects.effect import Effect
from drivetrain.errors import Fault, InputError
from drivetrain.simulation import equations
from drivetrain.simulation.plan import Plan
from drivetrain.simulation.recording import Event, Series

Progress = Callable[[float], bool | None]  # told the share done [-]; False stops the run


@dataclass(frozen=True, eq=False)
class Wish:
    """What is wanted of a run.

    Attributes:
        interval: Between two recorded instants [s].
        progress: Told how far the run has come; None: nobody.
        resume: What an earlier run kept, by name; None: from the start.
    """

    interval: float
    progress: Progress | None = None
    resume: dict[str, Any] | None = None


@dataclass(frozen=True, eq=False)
class Outcome:
    """What an engine gives back.

    Attributes:
        rows: Time, states, signals, energies at the wanted instants, (N, 1 + states + signals + powers).
        counters: What it cost, by name [-].
        events: What happened.
        stopped_by: What ended the run before its time; None when nothing did.
        kept: What the run must keep to go on later, by name.
        series: What is to be recorded instead of rows, by name; empty: the rows.
        times: Instants of those series [s].
    """

    rows: Array
    counters: dict[str, int]
    events: tuple[Event, ...] = ()
    stopped_by: Event | None = None
    kept: dict[str, Any] = field(default_factory=dict)
    series: dict[str, Series] = field(default_factory=dict)
    times: Array | None = None


class Engine(ABC):
    """A way to run a plan."""

    @property
    def tolerance(self) -> float:
        """Relative, that is wanted of it [-]; 0: it has none."""
        return 0.0

    def finer(self) -> Engine:
        """The same at half the step or a tenth of the tolerance.

        Raises:
            InputError: It has neither.
        """
        raise InputError(Fault("verify", "needs an engine with a step or a tolerance", type(self).__name__))

    @abstractmethod
    def run(self, plan: Plan, wish: Wish) -> Outcome:
        """Run a plan."""


PASSES = 4  # states that depend on states that depend on states


def started(plan: Plan) -> Array:
    """The numbers of a run at its start."""
    memory, n = plan.memory, plan.body.n
    numbers = memory.numbers.copy()
    at, states = memory.view(numbers, "coordinates"), memory.view(numbers, "states")
    position, speed = _motion(plan)
    at["position"][:n], at["speed"][:n] = plan.body.coordinates_of(position), plan.body.coordinates_of(speed)
    for i in plan.body.springs:
        at["speed"][plan.body.motors[i]] = speed[i]
    begun = [(one, [memory.states[name] for name in one.states]) for one in plan.instances if one.states]
    bent = {i: shape.deflection for i, shape in plan.body.springs.items() if shape.deflection is not None}
    known = _Known(memory.places, numbers)
    for _ in range(PASSES if begun or bent else 0):
        before = numbers[states["value"]]
        equations.evaluate_signals(numbers)
        for i, deflection in bent.items():
            joint = plan.scene.joints[i]
            load = known[f"{joint}.bias_torque"] - known[f"{joint}.joint_torque"]
            at["position"][plan.body.motors[i]] = deflection(load)
        for one, places in begun:
            numbers[states["value"][places]] = one.effect.start(one.place, known)
        if np.array_equal(numbers[states["value"]], before):
            break
    # Who slid while states did not fit yet would else go on sliding at no speed.
    at["dry"]["mode"] = 0
    found = equations.evaluate_rates(numbers, numbers[states["value"][: memory.moving]])
    rate = found[plan.body.c : 2 * plan.body.c]
    at["last"] = np.where(np.isfinite(rate), rate, 0.0)
    return numbers


class _Known(Mapping[str, float]):
    """Signals by name, looked up one by one: of hundreds an effect asks for three."""

    def __init__(self, places: Mapping[str, int], values: Array) -> None:
        self._places, self._values = places, values

    def __getitem__(self, name: str) -> float:
        return float(self._values[self._places[name]])

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
