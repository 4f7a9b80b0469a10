"""The interface of the simulation engines: the options of a run, and the result that is made into a recording."""

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

Progress = Callable[[float], bool | None]  # called with the finished share of the run [-]; returning False stops it


@dataclass(frozen=True, eq=False)
class RunOptions:
    """The options of a run."""

    interval: float  # time between two output rows [s]
    progress: Progress | None = None  # called from time to time with the finished share; None: not called
    resume: dict[str, Any] | None = None  # ``Outcome.kept`` of an earlier run, to continue it; None: begin at the start
    # initial states that are given, by name [their own units]; all others are in equilibrium
    start: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The result of a run of an engine."""

    rows: Array  # output rows: time, states, signals, energies of powers, (N, 1 + states + signals + powers)
    counters: dict[str, int]  # computing effort, by name [-]
    events: tuple[Event, ...] = ()
    stopped_by: Event | None = None  # what ended the run early; None when nothing did
    kept: dict[str, Any] = field(default_factory=dict)  # the data needed to resume the run, by name
    # series to be recorded instead of the rows, by name; empty: the rows are recorded
    series: dict[str, Series] = field(default_factory=dict)
    times: Array | None = None  # times of those series [s], (N,)


class Engine(ABC):
    """A method to compute the motion of a plan."""

    @property
    def tolerance(self) -> float:
        """Relative tolerance of the integration [-]; 0: the engine has none."""
        return 0.0

    def finer(self, period: float = math.inf) -> Engine:
        """The engine with a smaller error: half the fixed step, or a tenth of the tolerance.

        ``period`` is the shortest sampling period of the scene [s]: half of it is used where the step is longer.
        """
        raise InputError(Fault("verify", "needs an engine with a step or a tolerance", type(self).__name__))

    @abstractmethod
    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Compute the motion of a plan over its duration."""
