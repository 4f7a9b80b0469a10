"""What the compiled solvers are given: a right-hand side by address, its data, its events, what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from drivetrain.arrays import Array, frozen_array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers.compiled_function import address_of
from drivetrain.solvers.linear import column_groups
from drivetrain.solvers.records import EITHER, FALLING, GUARD, RISING


@dataclass(frozen=True, eq=False)
class Events:
    """Instants that a solver must find and stop at.

    Attributes:
        values: Compiled function that fills the values of all events; each happens where its value crosses zero.
        kinds: FALLING, EITHER, RISING: which way it must cross; GUARD: it must not be negative, and one that is
            negative at once, after a jump or a change of mode, happens at once. (m,), see ``records``.
        terminal: Whether the integration ends there, (m,); None: none does.
        handler: Compiled function called at an event, to change state, numbers and words: its ``result`` tells by +1
            (rising) and -1 (falling) which values have crossed. It must force the change that belongs to the event:
            one that asks anew "which mode?" at v = 0 can go to and fro for ever. None: nothing is changed.
        names: What to call them, (m,).
    """

    values: Any
    kinds: tuple[int, ...]
    terminal: tuple[bool, ...] | None = None
    handler: Any = None
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        address_of(self.values, "events.values", needed=True)
        address_of(self.handler, "events.handler")
        if not self.kinds or any(kind not in (FALLING, EITHER, RISING, GUARD) for kind in self.kinds):
            raise InputError(Fault("events.kinds", "must be one or more of -1, 0, 1 and 2", self.kinds))
        for name, given in (("terminal", self.terminal), ("names", self.names)):
            if given and len(given) != len(self.kinds):
                raise InputError(Fault(f"events.{name}", f"must have {len(self.kinds)} entries, as kinds has", given))

    def name(self, index: int) -> str:
        """What to call an event."""
        return self.names[index] if self.names else f"event {index}"


@dataclass(frozen=True, eq=False)
class Hooks:
    """What an owner does beside the integration; compiled functions, or None.

    Attributes:
        account: Called at two Gauss points of each kept step, in the order of time; ``result[0]`` is the time each
            stands for [s]. It may add up in numbers.
        tell: Fills a row at a wanted instant in place of the state.
        width: Of that row.
        opens: Called where a segment begins, before its rates are asked for; it may change x.
    """

    account: Any = None
    tell: Any = None
    width: int = 0
    opens: Any = None


@dataclass(frozen=True, eq=False)
class CompiledProblem:
    """A right-hand side by address, and what belongs to it.

    Attributes:
        rates: Compiled function that fills dx/dt [per s]; see ``compiled_function``.
        size: Number of states n.
        numbers: Its own float64 data; copied for each run.
        words: Its own int64 data; copied for each run.
        jacobian: Compiled function that fills n + 1 columns of n: the derivatives by each state, then by time.
            None: differences.
        differences: How many right-hand sides ``jacobian`` asks for itself, and the solver for the derivatives by time
            which it then leaves to it; 0: it asks for none.
        sparsity: Where the Jacobian can differ from zero, (n, n) of bool, for differences in few groups; None:
            anywhere. One that leaves out an entry costs accuracy that no tolerance sees.
        events: Or None.
        hooks: Or None.
        names: What to call the states in messages, (n,).
        segment_word: Index of the word that is told the number of the segment between breakpoints, so that a
            right-hand side can keep to its side by number; -1: none is. All can rely on the time they see anyway.
        declares_smooth: The author's word that between breakpoints and events the rates do not jump, as sign() does.
            Adaptive methods refuse a problem that cannot give it.
        may_jump: The rates may jump where the state passes through and goes on, as at a damped wall: short steps pass
            such a jump. One to which the state comes back at once is refused all the same. False: any is refused.
    """

    rates: Any
    size: int
    numbers: Array = field(default_factory=lambda: np.zeros(1))
    words: Any = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    jacobian: Any = None
    sparsity: Any = None
    events: Events | None = None
    hooks: Hooks | None = None
    names: tuple[str, ...] = ()
    segment_word: int = -1
    declares_smooth: bool = True
    may_jump: bool = False
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
        if not -1 <= self.segment_word < len(words):
            raise InputError(Fault("problem.segment_word", f"must be below {len(words)}, or -1", self.segment_word))
        if self.sparsity is not None and np.shape(self.sparsity) != (self.size, self.size):
            shape = np.shape(self.sparsity)
            raise InputError(Fault("problem.sparsity", f"must have shape ({self.size}, {self.size})", f"shape {shape}"))
        if isinstance(self.differences, bool) or self.differences < 0 or (self.differences and not self.jacobian):
            problem = "must count what a jacobian asks for"
            raise InputError(Fault("problem.differences", problem, self.differences))
        if self.names and len(self.names) != self.size:
            raise InputError(Fault("problem.names", f"must have {self.size} entries", self.names))

    def name(self, index: int) -> str:
        """What to call a state."""
        return f"state {self.names[index]!r}" if self.names else f"state {index}"

    @cached_property
    def groups(self) -> tuple[Any, ...]:
        """``column_groups`` for differences; nothing where there is a Jacobian."""
        none: Any = np.zeros(0, dtype=np.int64)
        return (none,) * 4 if self.jacobian else column_groups(self.sparsity, self.size)

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
