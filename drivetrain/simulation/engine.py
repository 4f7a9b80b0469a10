"""The engines of forward simulation, as descriptions; and what each gives back to be recorded."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from drivetrain.arrays import Array
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

    @abstractmethod
    def run(self, plan: Plan, wish: Wish) -> Outcome:
        """Run a plan."""
