"""What the compiled solvers are given: a right-hand side by address, its data, its events, what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drivetrain.arrays import Array, frozen_array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers.compiled_function import address_of


@dataclass(frozen=True, eq=False)
class Events:
    """Instants that a solver must find and stop at."""

    # compiled function that fills the values of all events, which must not be negative; one that is negative at once,
    # after a jump or a change of mode, happens at once
    values: Any
    # compiled function called at an event, to change state, numbers and words: its ``result`` is not zero for those
    # that have happened. It must force the change that belongs to the event: one that asks anew "which mode?" at v = 0
    # can go to and fro for ever.
    handler: Any
    names: tuple[str, ...]  # what to call them, (m,)

    def __post_init__(self) -> None:
        address_of(self.values, "events.values", needed=True)
        address_of(self.handler, "events.handler", needed=True)
        if not self.names:
            raise InputError(Fault("events.names", "must be one or more", self.names))


@dataclass(frozen=True, eq=False)
class Hooks:
    """What an owner does beside the integration; compiled functions, or None."""

    # called at two Gauss points of each kept step, in the order of time; ``result[0]`` is the time each stands for [s].
    # It may add up in numbers.
    account: Any = None
    tell: Any = None  # fills a row at a wanted instant in place of the state
    width: int = 0  # of that row
    opens: Any = None  # called where a segment begins, before its rates are asked for; it may change x


@dataclass(frozen=True, eq=False)
class CompiledProblem:
    """A right-hand side by address, and what belongs to it."""

    rates: Any  # compiled function that fills dx/dt [per s]; see ``compiled_function``
    size: int  # number of states n
    numbers: Array = field(default_factory=lambda: np.zeros(1))  # its own float64 data; copied for each run
    words: Any = field(default_factory=lambda: np.zeros(1, dtype=np.int64))  # its own int64 data; copied for each run
    # compiled function that fills n + 1 columns of n: the derivatives by each state, then by time. None: differences.
    jacobian: Any = None
    events: Events | None = None  # or None
    hooks: Hooks | None = None  # or None
    names: tuple[str, ...] = ()  # what to call the states in messages, (n,)
    # the rates may jump where the state passes through and goes on, as at a damped wall: short steps pass such a jump.
    # One to which the state comes back at once is refused all the same. False: any is refused.
    may_jump: bool = False
    # how many right-hand sides ``jacobian`` asks for itself, and the solver for the derivatives by time which it then
    # leaves to it; 0: it asks for none
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
        return f"state {self.names[index]!r}" if self.names else f"state {index}"

    def addresses(self) -> dict[str, int]:
        """Where its functions lie, by their names in ``records.CALLS``; 0 for none."""
        events, hooks = self.events, self.hooks or Hooks()
        functions = {"rates": self.rates, "jacobian": self.jacobian}
        functions |= {"values": events.values if events else None, "handler": events.handler if events else None}
        functions |= {"account": hooks.account, "tell": hooks.tell, "opens": hooks.opens}
        return {name: address_of(function, name) for name, function in functions.items()}


def _own_numbers(given: Any) -> Array:
    """A read-only copy; infinity is allowed, as a limit that is none."""
    numbers = np.array(given, dtype=np.float64)
    frozen_array(np.where(np.isinf(numbers), 0.0, numbers), (None,), "problem.numbers")
    numbers.setflags(write=False)
    return numbers
