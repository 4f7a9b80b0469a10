"""Functions that solvers call by address, so that what calls them is compiled once, whatever they are.

A right-hand side, event values, an event's handler and a Jacobian all look the same from outside:

    void(double t, double* x, double* result, double* numbers, int64* words)

``t`` [s] and ``x`` are the instant and the state; ``result`` is filled; ``numbers`` and ``words`` are the function's
own data, which it may read, use as scratch and, in a handler, change. A compiled function has no way to raise: what
cannot be computed it returns as NaN, which the solver reports.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types

from drivetrain.arrays import Array
from drivetrain.call_address import call_address
from drivetrain.errors import Fault, InputError
from drivetrain.jit import callback, kernel, law

_DOUBLES = types.CPointer(types.float64)
SIGNATURE = types.void(types.float64, _DOUBLES, _DOUBLES, _DOUBLES, types.CPointer(types.int64))


def compiled(function: Callable[..., None]) -> Any:
    """A function (t, x, result, numbers, words) compiled with an address, and kept on disk for the next start."""
    return callback(SIGNATURE, function)


def address_of(function: Any, place: str, *, needed: bool = False) -> int:
    if function is None and not needed:
        return 0
    address = getattr(function, "address", function)
    if isinstance(address, bool) or not isinstance(address, int | np.integer) or address <= 0:
        hint = "compile it with drivetrain.solvers.compiled_function.compiled"
        raise InputError(Fault(place, "must be a compiled function or its address", function, hint))
    return int(address)


@kernel
def evaluate(address: int, t: float, x: Array, result: Array, numbers: Array, words: Any) -> None:
    """From Python: call the function at an address."""
    call_address(address, (t, x.ctypes.data, result.ctypes.data, numbers.ctypes.data, words.ctypes.data))


@law
def call(run: Any, function: int, t: float, point: Array, result: Array) -> None:
    """Call a function of the problem at an instant and a state."""
    call_address(function, (t, point.ctypes.data, result.ctypes.data, run.calls.numbers, run.calls.words))


@law
def call_rates(run: Any, t: float, point: Array, answer: Array) -> None:
    """The right-hand side at a state, counted; never beyond what the segment may see."""
    call(run, run.calls.rates, min(t, run.clock.limit), point, answer)
    run.count.rates += 1


@law
def call_here(run: Any, function: int, states: Any, point: Array, result: Array) -> None:
    """Call a function of the problem here and now; it may change the state."""
    load(states, point)
    call(run, function, run.clock.time, point, result)
    for i in range(len(states)):
        states[i].x = point[i]


@law
def load(states: Any, point: Array) -> None:
    """What is asked for is the state now."""
    for i in range(len(states)):
        point[i] = states[i].x


def in_c(function: Callable[[float, Array], Array], size: int) -> tuple[Any, list[BaseException]]:
    """A right-hand side in Python behind the same signature, and the list that takes what it raises.

    The caller keeps what comes back alive while it is called.
    """
    doubles, raised = ctypes.POINTER(ctypes.c_double), []  # type: tuple[Any, list[BaseException]]

    @ctypes.CFUNCTYPE(None, ctypes.c_double, doubles, doubles, doubles, ctypes.POINTER(ctypes.c_int64))
    def called(t: float, x: Any, result: Any, numbers: Any, words: Any) -> None:
        answer = np.ctypeslib.as_array(result, (size,))
        try:
            answer[:] = np.nan if raised else function(t, np.ctypeslib.as_array(x, (size,)).copy())
        except BaseException as error:
            raised.append(error)
            answer[:] = np.nan

    return called, raised
