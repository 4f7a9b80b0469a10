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

from drivetrain.control.commander import (
    CHAINS_AT,
    FAR,
    FOLLOW_AT,
    LINKS_AT,
    MOST_STRIDES,
    SHARES_AT,
    SIZES,
    WHOLE_AT,
    Commander,
)
from drivetrain.control.laws import TARGETS, Chains, command
from drivetrain.dynamics.core.loops import DEAD, FINER, MOST, STRIDE, Pins, newton
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
        "current: DC-equivalent amperes; 0 is returned, or where nothing has changed 1: an input is not finite"
        + (", 2: the linkage does not come there from where it was" if commander.memory[FOLLOW_AT].size else ""),
        f"joints: {', '.join(commander.joints)}",
    ]
    carried, loops = int(commander.memory[SIZES][3]), _closing(commander, name)
    if carried:
        head.append("base: its position, then velocity, then acceleration, of x, y, z, yaw, pitch, roll [m, rad, s]")
    size, state = f"{name.upper()}_JOINTS", f"{name}_state"
    base = f" const double base[{3 * carried}]," if carried else ""
    step = (
        f"int {name}_step({state} *s, const double q[{size}], const double qd[{size}], const double qdd[{size}],\n"
        f"    const double measured_q[{size}], const double measured_qd[{size}],{base} double current[{size}])"
    )
    guard = re.sub(r"\W", "_", header).upper()
    comment = [f"/* {line.replace('*/', '* /')} */" for line in head]
    places = commander.memory[WHOLE_AT]["place"] if loops else np.zeros(0)
    fields = [f"    double {field}[{size}];" for field in STATES]
    fields += [f"    double place[{len(places)}]; /* of all joints of the linkage */"] if loops else []
    top = [
        *comment, f"#ifndef {guard}", f"#define {guard}", f"#define {size} {n}", "typedef struct {", *fields,
        f"}} {state};", f"void {name}_start({state} *s);", f"{step};", "#endif",
    ]  # fmt: skip
    heat = commander.axes["heat"]
    start = {"winding_temperature": heat["winding_temperature"], "housing_temperature": heat["housing_temperature"]}
    begun = [
        f"    s->{field}[{i}] = {c_number(float(start[field][i]) if field in start else 0.0)};"
        for field in STATES for i in range(n)
    ] + [f"    s->place[{w}] = {c_number(place)};" for w, place in enumerate(places)]  # fmt: skip
    rows = [("q", "qd", "qdd", "measured_q", "measured_qd")[k] for k in range(len(TARGETS))]
    squares = " + ".join(f"{row}[i] * {row}[i]" for row in rows)
    ends = [
        f"    s->{field}[{i}] = {c_number(results[field][i])};" for field in STATES for i in range(n)
    ]  # fmt: skip
    code = [
        comment[0], f'#include "{header}"', "#include <math.h>", "", *loops,
        f"void {name}_start({state} *s)", "{", *begun, "}", "", step, "{",
        "    double size = 0.0;", "    int i;", f"    for (i = 0; i < {size}; i++)", f"        size += {squares};",
        *([f"    for (i = 0; i < {carried}; i++)", "        size += base[i] * base[i];"] if carried else []),
        f"    if (!(size < {FAR * FAR!r}))", "        return 1;",
        *([f"    if (!{name}_close(s->place, q))", "        return 2;"] if loops else []), "    {",
        *(f"    {line}" for line in c_lines(tape, finals)), *ends, "    }",
        f"    for (i = 0; i < {size}; i++)", "        current[i] = s->current[i];", "    return 0;", "}",
    ]  # fmt: skip
    return "\n".join(top) + "\n", "\n".join(code) + "\n"


def _closing(commander: Commander, name: str) -> list[str]:
    """Functions that close the loops of a linkage; none where no loop is closed."""
    tape, memory = Tape(), commander.memory
    whole = memory[WHOLE_AT]
    if not memory[FOLLOW_AT].size:
        return []
    pins = _pins(commander)
    for w, one in enumerate(pins.whole):
        one.place = tape.input(f"p[{w}]")
    error, room = newton(pins, tape.input("dead"))
    steps = [f"    p[{w}] = {c_number(pins.whole[w].place)};" for w in memory[FOLLOW_AT]]
    m, n, order = len(whole), len(commander.joints), np.argsort(whole["coordinate"])[-len(commander.joints) :]
    driven = f"    static const int driven[{n}] = {{{', '.join(map(str, order))}}};"
    return [
        "/* One of Newton's steps of the joints that follow; how far pins were open before, and whether they can. */",
        f"static void {name}_newton(double p[{m}], double dead, double *error, double *room)", "{",
        *(f"    {line}" for line in c_lines(tape, [error, room, *(pins.whole[w].place for w in memory[FOLLOW_AT])])),
        *steps, f"    *error = {c_number(error)};", f"    *room = {c_number(room)};", "}", "",
        f"static int {name}_walk(double p[{m}], const double place[{m}], const double q[{n}], int strides,",
        "    double dead)", "{", driven, "    double error, room;", "    int i, k, stride;",
        "    for (stride = 1; stride <= strides; stride++) {", f"        for (i = 0; i < {n}; i++) {{",
        "            const double from = place[driven[i]];",
        "            p[driven[i]] = stride == strides ? q[i] : from + (q[i] - from) * stride / strides;", "        }",
        f"        for (k = 0; k < {MOST}; k++) {{", f"            {name}_newton(p, dead, &error, &room);",
        "            if (!(error < HUGE_VAL) || !(room > 0.0))", "                return 0;",
        "            if (error <= 1.0)", "                break;", "        }", f"        if (k == {MOST})",
        "            return 0;", "    }", "    return 1;", "}", "",
        "/* All joints where the driven ones are wanted, on a straight way; where they do not come they stay. */",
        f"static int {name}_close(double place[{m}], const double q[{n}])", "{", driven,
        f"    static const double span[{n}] = {{{', '.join(map(repr, whole['stride'][order].tolist()))}}};",
        f"    static const int finer[{len(FINER)}] = {{{', '.join(map(str, FINER))}}};",
        f"    double p[{m}], far = 0.0;", "    int i, k, strides;",
        f"    for (i = 0; i < {n}; i++)", "        far += fabs(q[i] - place[driven[i]]) / span[i];",
        f"    if (!(far <= {MOST_STRIDES!r}))", "        return 0;", f"    for (k = 0; k < {len(FINER)}; k++) {{",
        f"        for (i = 0; i < {m}; i++)", "            p[i] = place[i];",
        "        strides = (int)ceil(fmax(finer[k] * far, 1.0));",
        f"        if ({name}_walk(p, place, q, strides, pow(fmax({DEAD!r}, {STRIDE!r} * far / strides), 2.0))) {{",
        f"            for (i = 0; i < {m}; i++)", "                place[i] = p[i];", "            return 1;",
        "        }", "    }", "    return 0;", "}", "",
    ]  # fmt: skip


def _pins(commander: Commander) -> Pins:
    """What closes the loops, as plain numbers."""
    own = [_plain(one) for one in commander.memory[WHOLE_AT:]]
    return Pins(own[0], own[1], own[2], _plain(commander.memory[CHAINS_AT]), *own[3:])


def _traced(tape: Tape, commander: Commander) -> dict[str, list[Any]]:
    """What one tick leaves of the states, from symbols for states and targets."""
    axes = _plain(commander.axes)
    own = [_plain(one) for one in commander.memory[LINKS_AT : SHARES_AT + 1]]
    arm = Chains(*own, *[_pins(commander)])
    carried = int(commander.memory[SIZES][3])
    for k, row in enumerate(arm.own):
        row[:carried] = [tape.input(f"base[{carried * k + j}]") for j in range(carried)]
    for w, one in enumerate(arm.pins.whole):
        one.place = tape.input(f"s->place[{w}]" if one.coordinate < 0 else f"q[{one.coordinate}]")
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
        return values.astype(object)
    if values.shape:
        return [_plain(one) for one in values]
    found = SimpleNamespace()
    for name in values.dtype.names:
        inner = values[name]
        setattr(found, name, _plain(inner) if isinstance(inner, np.ndarray | np.void) else inner.item())
    return found
