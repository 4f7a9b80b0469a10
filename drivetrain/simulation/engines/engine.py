"""The engines of forward simulation, as descriptions: what is wanted of each, and what it gives back to be recorded."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event, Series

Progress = Callable[[float], bool | None]  # called with the share done [-]; False stops the run


@dataclass(frozen=True, eq=False)
class RunOptions:
    """What is wanted of a run."""

    interval: float  # between two recorded instants [s]
    progress: Progress | None = None  # called with the progress of the run; None: not shown
    resume: dict[str, Any] | None = None  # what an earlier run kept, by name; None: from the start
    # states at the start that are given, by name [their own units]; all others are in equilibrium
    start: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What an engine gives back."""

    rows: Array  # time, states, signals, energies at the wanted instants, (N, 1 + states + signals + powers)
    counters: dict[str, int]  # what it cost, by name [-]
    events: tuple[Event, ...] = ()  # what happened
    stopped_by: Event | None = None  # what ended the run before its time; None when nothing did
    kept: dict[str, Any] = field(default_factory=dict)  # what the run must keep to go on later, by name
    # what is to be recorded instead of rows, by name; empty: the rows
    series: dict[str, Series] = field(default_factory=dict)
    times: Array | None = None  # instants of those series [s]


class Engine(ABC):
    """A way to run a plan."""

    @property
    def tolerance(self) -> float:
        """Relative, that is wanted of it [-]; 0: it has none."""
        return 0.0

    def finer(self, period: float = math.inf) -> Engine:
        """The same at half the step, or of samples no further apart than a period [s], or a tenth of the tolerance."""
        raise InputError(Fault("verify", "needs an engine with a step or a tolerance", type(self).__name__))

    @abstractmethod
    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Run a plan."""
