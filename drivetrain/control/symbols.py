"""Numbers that remember how they were computed: laws that run on them leave their formula behind.

A law computes with whatever it is given. Given symbols for what changes and plain numbers for what is constant, it
leaves a list of operations in which everything constant is already worked out, and equal ones stand once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

_FUNCTIONS = {
    np.sin: "sin", np.cos: "cos", np.exp: "exp", np.sqrt: "sqrt", np.absolute: "fabs", np.negative: "neg",
    np.add: "+", np.subtract: "-", np.multiply: "*", np.true_divide: "/", np.power: "pow", np.greater: ">",
    np.less: "<", np.equal: "==", np.not_equal: "!=", np.minimum: "fmin", np.maximum: "fmax",
}  # fmt: skip


class Tape:
    """Operations in the order in which they were met."""

    def __init__(self) -> None:
        self.operations: list[tuple[Any, ...]] = []  # each with its arguments, symbols or numbers; of an input its name
        self._known: dict[tuple[Any, ...], Symbol] = {}

    def input(self, name: str) -> Symbol:
        """A symbol for a number that is only known when the code runs."""
        return self._noted(("input", name))

    def _noted(self, operation: tuple[Any, ...]) -> Symbol:
        key = tuple(one.place if isinstance(one, Symbol) else (one,) for one in operation)
        if key not in self._known:
            self._known[key] = Symbol(self, len(self.operations))
            self.operations.append(operation)
        return self._known[key]

    def apply(self, name: str, a: Any, b: Any = None) -> Any:
        """What an operation makes of two numbers or one, of which at least one is a symbol."""
        if name in ("+", "-") and not isinstance(b, Symbol) and b == 0.0:
            return a
        if name in ("+", "-") and not isinstance(a, Symbol) and a == 0.0:
            return b if name == "+" else self.apply("neg", b)
        if name == "*":
            for one, other in ((a, b), (b, a)):
                if not isinstance(one, Symbol) and one in (0.0, 1.0, -1.0):
                    return 0.0 if one == 0.0 else other if one == 1.0 else self.apply("neg", other)
        if name == "/" and not isinstance(a, Symbol) and a == 0.0:
            return 0.0
        if name == "/" and not isinstance(b, Symbol) and b == 1.0:
            return a
        if name == "pow" and not isinstance(b, Symbol) and b == 2.0:
            return self.apply("*", a, a)
        plain = tuple(one if isinstance(one, Symbol) else float(one) for one in (a, b) if one is not None)
        return self._noted((name, *plain))


class Symbol(NDArrayOperatorsMixin):
    """A number of which only the way it is computed is known; to branch on it is an error."""

    __slots__ = ("place", "tape")

    def __init__(self, tape: Tape, place: int):
        self.tape, self.place = tape, place

    def __array_ufunc__(self, function: Any, method: str, *given: Any, **_: Any) -> Any:
        if method != "__call__" or function not in _FUNCTIONS:
            return NotImplemented
        return self.tape.apply(_FUNCTIONS[function], *given)

    def __bool__(self) -> bool:
        raise TypeError("a law branches on a number that is only known when its code runs")


def c_lines(tape: Tape, results: list[Any]) -> list[str]:
    """The operations that some results need, symbols or plain numbers, as lines of C with one constant each."""
    needed: set[int] = set()
    waiting = [one.place for one in results if isinstance(one, Symbol)]
    while waiting:
        place = waiting.pop()
        if place not in needed:
            needed.add(place)
            waiting += [one.place for one in tape.operations[place][1:] if isinstance(one, Symbol)]
    return [f"const double v{place} = {_c_operation(tape.operations[place])};" for place in sorted(needed)]


def c_number(value: Any) -> str:
    """A symbol's name in C, or a number with all its digits."""
    return (
        f"v{value.place}" if isinstance(value, Symbol) else f"({float(value)!r})" if value < 0 else repr(float(value))
    )


def _c_operation(operation: tuple[Any, ...]) -> str:
    name, *given = operation
    if name == "input":
        return str(given[0])
    texts = [c_number(one) for one in given]
    if name == "neg":
        return f"-{texts[0]}"
    if name in (">", "<", "==", "!="):
        return f"({texts[0]} {name} {texts[1]}) ? 1.0 : 0.0"
    if name in ("+", "-", "*", "/"):
        return f"{texts[0]} {name} {texts[1]}"
    return f"{name}({', '.join(texts)})"
