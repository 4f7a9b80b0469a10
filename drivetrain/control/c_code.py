"""A ``Commander`` in C99: its laws run once on symbols, and the operations that they leave are printed.

A law computes with whatever it is given. Given symbols for what changes and plain numbers for what is constant, it
leaves a list of operations in which everything constant is already worked out, and equal ones stand once.

The arm's and the drives' numbers are worked into the code, so it is for one arm, one set of drives, one payload.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from drivetrain.control.commander import BASE_AT, FAR, LINKS_AT, TURNS_AT, Commander
from drivetrain.control.laws import TARGETS, Chains, command
from drivetrain.version import __version__
from drivetrain.whole_files import write_files

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


STATES = ("current", "overload", "winding_temperature", "housing_temperature")


def write_c(commander: Commander, path: str | Path, *, name: str = "commander") -> dict[str, Path]:
    """Write a commander as C99 that needs no library but libm: the same laws, the same numbers to rounding.

    Args:
        commander: With the payload that it carries, its rate and its bandwidth; its temperatures are the ones to start
            from.
        path: Of the source, ending in .c; the header is written beside it.
        name: With which the names in C begin.

    Returns:
        Where each file is, by its name.

    Raises:
        InputError: A file cannot be written.
    """
    source = Path(path).with_suffix(".c")
    header, code = c_texts(commander, name=name, header=source.with_suffix(".h").name)
    return write_files(source.parent, {source.with_suffix(".h").name: header, source.name: code})


def c_texts(commander: Commander, *, name: str = "commander", header: str = "commander.h") -> tuple[str, str]:
    """Header and source; names in C begin with ``name``."""
    tape, n = Tape(), len(commander.joints)
    results = _traced(tape, commander)
    finals = [row[i] for row in results.values() for i in range(n)]
    study = commander.study
    head = [
        f"Currents of {study.name}, by drivetrain {__version__}; study SHA-256 {study.digest or 'none'}",
        f"call {name}_step at {commander.rate:.9g} Hz; payload: {commander.payload or 'none'}",
        "q, qd, qdd: wanted [rad or m, and per s, s^2]; measured_q, measured_qd: as measured by the encoders",
        "current: DC-equivalent amperes; 0 is returned, or 1 where an input is not finite: nothing has changed then",
        f"joints: {', '.join(commander.joints)}",
    ]
    if commander.memory[BASE_AT].size:
        head.append("base: its position, then velocity, then acceleration, of x, y, z, yaw, pitch, roll [m, rad, s]")
    size, state = f"{name.upper()}_JOINTS", f"{name}_state"
    carried = commander.memory[BASE_AT].size
    base = f" const double base[{carried}]," if carried else ""
    step = (
        f"int {name}_step({state} *s, const double q[{size}], const double qd[{size}], const double qdd[{size}],\n"
        f"    const double measured_q[{size}], const double measured_qd[{size}],{base} double current[{size}])"
    )
    guard = re.sub(r"\W", "_", header).upper()
    comment = [f"/* {line.replace('*/', '* /')} */" for line in head]
    fields = [f"    double {field}[{size}];" for field in STATES]
    top = [
        *comment, f"#ifndef {guard}", f"#define {guard}", f"#define {size} {n}", "typedef struct {", *fields,
        f"}} {state};", f"void {name}_start({state} *s);", f"{step};", "#endif",
    ]  # fmt: skip
    heat = commander.axes["heat"]
    start = {"winding_temperature": heat["winding_temperature"], "housing_temperature": heat["housing_temperature"]}
    begun = [
        f"    s->{field}[{i}] = {c_number(float(start[field][i]) if field in start else 0.0)};"
        for field in STATES for i in range(n)
    ]  # fmt: skip
    rows = [("q", "qd", "qdd", "measured_q", "measured_qd")[k] for k in range(len(TARGETS))]
    squares = " + ".join(f"{row}[i] * {row}[i]" for row in rows)
    ends = [
        f"    s->{field}[{i}] = {c_number(results[field][i])};" for field in STATES for i in range(n)
    ]  # fmt: skip
    code = [
        comment[0], f'#include "{header}"', "#include <math.h>", "",
        f"void {name}_start({state} *s)", "{", *begun, "}", "", step, "{",
        "    double size = 0.0;", "    int i;", f"    for (i = 0; i < {size}; i++)", f"        size += {squares};",
        *([f"    for (i = 0; i < {carried}; i++)", "        size += base[i] * base[i];"] if carried else []),
        f"    if (!(size < {FAR * FAR!r}))", "        return 1;", "    {",
        *(f"    {line}" for line in c_lines(tape, finals)), *ends, "    }",
        f"    for (i = 0; i < {size}; i++)", "        current[i] = s->current[i];", "    return 0;", "}",
    ]  # fmt: skip
    return "\n".join(top) + "\n", "\n".join(code) + "\n"


def _traced(tape: Tape, commander: Commander) -> dict[str, list[Any]]:
    """What one tick leaves of the states, from symbols for states and targets."""
    arm, axes = Chains(*(_plain(one) for one in commander.memory[LINKS_AT : TURNS_AT + 3])), _plain(commander.axes)
    for k, row in enumerate(arm.base):
        row[:] = [tape.input(f"base[{len(row) * k + j}]") for j in range(len(row))]
    targets = [
        [tape.input(f"{row}[{i}]") for i in range(len(axes))] for row in ("q", "qd", "qdd", "measured_q", "measured_qd")
    ]
    for i, axis in enumerate(axes):
        axis.current, axis.overload = tape.input(f"s->current[{i}]"), tape.input(f"s->overload[{i}]")
        axis.heat.winding_temperature = tape.input(f"s->winding_temperature[{i}]")
        axis.heat.housing_temperature = tape.input(f"s->housing_temperature[{i}]")
    command(arm, axes, targets, np.inf)
    return {
        "current": [axis.current for axis in axes],
        "overload": [axis.overload for axis in axes],
        "winding_temperature": [axis.heat.winding_temperature for axis in axes],
        "housing_temperature": [axis.heat.housing_temperature for axis in axes],
    }


def _plain(values: Any) -> Any:
    """Records and arrays as objects and lists of plain numbers, which may be replaced by symbols."""
    if values.dtype.names is None:
        return values.tolist()
    if values.shape:
        return [_plain(one) for one in values]
    found = SimpleNamespace()
    for name in values.dtype.names:
        inner = values[name]
        setattr(found, name, _plain(inner) if isinstance(inner, np.ndarray | np.void) else inner.item())
    return found
