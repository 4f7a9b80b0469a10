"""The problem that a compiled solver integrates: right-hand side, Jacobian, events and hooks by address, and data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drivetrain.arrays import Array, frozen_array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers.compiled_function import address_of


@dataclass(frozen=True, eq=False)
class Events:
    """State events: the solver locates where an event function becomes negative, and ends the step there."""

    # Compiled function that fills the values of all m event functions. An event fires when its value becomes negative;
    # if it is negative already after a jump or a change of mode, the event fires at once.
    values: Any
    # Compiled function that is called at an event and may change state, numbers and words. On entry its ``result`` is
    # -1 for the events that have fired and 0 for the others. The handler must force the transition that belongs to the
    # event: a handler that decides the mode anew from the state (v = 0) may switch back and forth without end.
    handler: Any
    names: tuple[str, ...]  # names of the events in messages, (m,)

    def __post_init__(self) -> None:
        address_of(self.values, "events.values", needed=True)
        address_of(self.handler, "events.handler", needed=True)
        if not self.names:
            raise InputError(Fault("events.names", "must be one or more", self.names))


@dataclass(frozen=True, eq=False)
class Hooks:
    """Optional compiled functions that are called beside the integration; None: not called."""

    # Called in order of time at the two Gauss points of each accepted step; ``result[0]`` is the weight of the point
    # [s]. It integrates quantities that are not states, such as energies, in the problem's ``numbers``.
    account: Any = None
    output: Any = None  # fills an output row; without it the row is the state
    width: int = 0  # number of columns of that output row
    segment_start: Any = None  # called at the beginning of each segment, before its first rates; it may change x


@dataclass(frozen=True, eq=False)
class CompiledProblem:
    """An initial value problem whose functions are given by address."""

    rates: Any  # compiled function that fills dx/dt [per s]; see ``compiled_function``
    size: int  # number of states n
    numbers: Array = field(default_factory=lambda: np.zeros(1))  # float64 data of the functions; copied for each run
    words: Any = field(default_factory=lambda: np.zeros(1, dtype=np.int64))  # int64 data, likewise
    # Compiled function that fills n + 1 columns of length n: derivatives of the rates by each state, then by time.
    # None: the solver computes finite differences.
    jacobian: Any = None
    events: Events | None = None  # None: no events
    hooks: Hooks | None = None  # None: no hooks
    names: tuple[str, ...] = ()  # names of the states in messages, (n,)
    # Whether the rates may be discontinuous on a surface that the state crosses once, such as a damped wall: the solver
    # then passes it with short steps. A discontinuity to which the state returns at once still stops the run. False:
    # every discontinuity stops the run.
    may_jump: bool = False
    # Number of evaluations of the right-hand side per Jacobian, for the counters, where ``jacobian`` itself uses finite
    # differences; it then leaves the derivative by time to the solver. 0: the Jacobian evaluates no rates.
    differences: int = 0

    def __post_init__(self) -> None:
        address_of(self.rates, "problem.rates", needed=True)
        address_of(self.jacobian, "problem.jacobian")
        if isinstance(self.size, bool) or not isinstance(self.size, int) or self.size < 1:
            raise InputError(Fault("problem.size", "must be a whole number, 1 or more", self.size))
        object.__setattr__(self, "numbers", _own_numbers(self.numbers))
        words = np.array(self.words)
        if words.ndim != 1 or words.dtype.kind not in "iu":
            raise InputError(Fault("problem.words", "must be whole numbers, one axis", self.words))
        object.__setattr__(self, "words", words.astype(np.int64))
        self.words.setflags(write=False)
        if isinstance(self.differences, bool) or self.differences < 0 or (self.differences and not self.jacobian):
            problem = "must count what a jacobian asks for"
            raise InputError(Fault("problem.differences", problem, self.differences))
        if self.names and len(self.names) != self.size:
            raise InputError(Fault("problem.names", f"must have {self.size} entries", self.names))

    def name(self, index: int) -> str:
        """How messages name a state."""
        return f"state {self.names[index]!r}" if self.names else f"state {index}"

    def addresses(self) -> dict[str, int]:
        """Addresses of the functions, by their field in the ``calls`` of ``records.RUN``; 0 where there is none."""
        events, hooks = self.events, self.hooks or Hooks()
        functions = {"rates": self.rates, "jacobian": self.jacobian}
        functions |= {"values": events.values if events else None, "handler": events.handler if events else None}
        functions |= {"account": hooks.account, "output": hooks.output, "segment_start": hooks.segment_start}
        return {name: address_of(function, name) for name, function in functions.items()}


def _own_numbers(given: Any) -> Array:
    """A read-only copy of the data, checked; infinity is allowed, since it stands for a limit that does not exist."""
    numbers = np.array(given, dtype=np.float64)
    frozen_array(np.where(np.isinf(numbers), 0.0, numbers), (None,), "problem.numbers")
    numbers.setflags(write=False)
    return numbers
