"""Functions that the compiled solvers call by address.

Since the address is data, the integration loop is compiled once for all problems. A right-hand side, the event
functions, an event handler and a Jacobian all have the same signature:

    void(double t, double* x, double* result, double* numbers, int64* words)

``t`` is the time [s], ``x`` the state, and the function writes its values into ``result``. ``numbers`` (float64) and
``words`` (int64) are the problem's own data: every function may read them and use them as scratch memory, an event
handler may also change them. A compiled function cannot raise an exception; it returns NaN for what it cannot compute,
and the solver reports that.
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
    """Compile a Python function (t, x, result, numbers, words) to a function with an address, cached on disk."""
    return callback(SIGNATURE, function)


def address_of(function: Any, place: str, *, needed: bool = False) -> int:
    """The address of a compiled function, or of an address given as an integer; 0 for None unless it is needed;
    InputError for anything else, at ``place``.
    """
    if function is None and not needed:
        return 0
    address = getattr(function, "address", function)
    if isinstance(address, bool) or not isinstance(address, int | np.integer) or address <= 0:
        hint = "compile it with drivetrain.solvers.compiled_function.compiled"
        raise InputError(Fault(place, "must be a compiled function or its address", function, hint))
    return int(address)


@kernel
def evaluate(address: int, t: float, x: Array, result: Array, numbers: Array, words: Any) -> None:
    """Call the compiled function at an address from Python; ``result`` is filled in place."""
    call_address(address, (t, x.ctypes.data, result.ctypes.data, numbers.ctypes.data, words.ctypes.data))


@law
def call(run: Any, function: int, t: float, point: Array, result: Array) -> None:
    """Call a function of the problem at time t [s] and state ``point``; it fills ``result``."""
    call_address(function, (t, point.ctypes.data, result.ctypes.data, run.calls.numbers, run.calls.words))


@law
def call_rates(run: Any, t: float, point: Array, result: Array) -> None:
    """Evaluate the right-hand side and count the evaluation.

    The time is limited to the present segment, so that a stage at a breakpoint still sees the rates before the jump.
    """
    call(run, run.calls.rates, min(t, run.clock.limit), point, result)
    run.count.rates += 1


@law
def call_at_state(run: Any, function: int, states: Any, point: Array, result: Array) -> None:
    """Call a function of the problem at the current time and state; it may change the state."""
    load_state(states, point)
    call(run, function, run.clock.time, point, result)
    for i in range(len(states)):
        states[i].x = point[i]


@law
def load_state(states: Any, point: Array) -> None:
    """Copy the current state into ``point``, the state at which functions of the problem are evaluated."""
    for i in range(len(states)):
        point[i] = states[i].x


def as_c_function(function: Callable[[float, Array], Array], size: int) -> tuple[Any, list[BaseException]]:
    """Wrap a right-hand side written in Python as a C function with the signature above.

    Returns the ctypes function, which the caller must keep alive while the solver uses it, and a list that receives an
    exception raised by the right-hand side; after one, all further rates are NaN, so that the solver stops.
    """
    doubles, raised = ctypes.POINTER(ctypes.c_double), []  # type: tuple[Any, list[BaseException]]

    @ctypes.CFUNCTYPE(None, ctypes.c_double, doubles, doubles, doubles, ctypes.POINTER(ctypes.c_int64))
    def called(t: float, x: Any, result: Any, numbers: Any, words: Any) -> None:
        filled = np.ctypeslib.as_array(result, (size,))
        try:
            filled[:] = np.nan if raised else function(t, np.ctypeslib.as_array(x, (size,)).copy())
        except BaseException as error:
            raised.append(error)
            filled[:] = np.nan

    return called, raised
