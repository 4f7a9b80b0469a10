"""Calling compiled functions by their address, so that what calls them is compiled once, whatever they are.

A right-hand side, event values, an event's handler and a Jacobian all look the same from outside:

    void(double t, double* x, double* result, double* numbers, int64* words)

``t`` [s] and ``x`` are the instant and the state; ``result`` is filled; ``numbers`` and ``words`` are the function's
own data, which it may read, use as scratch and, in a handler, change. A compiled function has no way to raise: what
cannot be computed it gives as NaN, and the solver tells.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.jit import callback, kernel

_intrinsic: Any = intrinsic  # what it decorates is called with one argument less than it takes
_DOUBLES = types.CPointer(types.float64)
SIGNATURE = types.void(types.float64, _DOUBLES, _DOUBLES, _DOUBLES, types.CPointer(types.int64))


def compiled(function: Callable[..., None]) -> Any:
    """A function (t, x, result, numbers, words) compiled with an address, and kept on disk for the next start."""
    return callback(SIGNATURE, function)


def address_of(function: Any, place: str, *, needed: bool = False) -> int:
    """Where a compiled function lies.

    Args:
        function: What ``compiled`` gave, or an address; None: none.

    Raises:
        InputError: Neither a compiled function nor an address.
    """
    if function is None and not needed:
        return 0
    address = getattr(function, "address", function)
    if isinstance(address, bool) or not isinstance(address, int | np.integer) or address <= 0:
        hint = "compile it with drivetrain.solvers.compiled_function.compiled"
        raise InputError(Fault(place, "must be a compiled function or its address", function, hint))
    return int(address)


def _invoke(context: Any, builder: Any, address: Any, t: Any, pointers: list[Any]) -> Any:
    double, word = ir.DoubleType(), ir.IntType(64)
    data = double.as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [double, data, data, data, word.as_pointer()])
    builder.call(builder.inttoptr(address, kind.as_pointer()), [t, *pointers])
    return context.get_dummy_value()


@_intrinsic
def call(typing: Any, address: Any, t: Any, x: Any, result: Any, numbers: Any, words: Any) -> Any:
    """Inside compiled code: call the function at an address.

    Args:
        t: Instant [s].
    """
    arrays = (x, result, numbers, words)
    if any(kind.layout != "C" for kind in arrays):
        raise TypingError("a compiled function is called with contiguous arrays")
    signature = types.void(types.int64, types.float64, *arrays)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pairs = zip(arrays, args[2:], strict=True)
        pointers = [make_array(kind)(context, builder, value).data for kind, value in pairs]
        return _invoke(context, builder, args[0], args[1], pointers)

    return signature, generate


@_intrinsic
def call_rows(typing: Any, address: Any, t: Any, block: Any, row: Any, target: Any, goal: Any, data: Any) -> Any:
    """Inside compiled code: call the function at an address, state and answer being rows of contiguous blocks.

    Args:
        t: Instant [s].
    """
    signature = types.void(types.int64, types.float64, block, types.int64, target, types.int64, data)

    def row_of(context: Any, builder: Any, kind: Any, value: Any, index: Any) -> Any:
        array = make_array(kind)(context, builder, value)
        width = cgutils.unpack_tuple(builder, array.shape)[1]
        return builder.gep(array.data, [builder.mul(index, width)])

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        state = row_of(context, builder, block, args[2], args[3])
        answer = row_of(context, builder, target, args[4], args[5])
        parts = zip(data.types, cgutils.unpack_tuple(builder, args[6]), strict=True)
        own = [make_array(kind)(context, builder, value).data for kind, value in parts]
        return _invoke(context, builder, args[0], args[1], [state, answer, *own])

    return signature, generate


@_intrinsic
def call_step(typing: Any, stepper: Any, address: Any, h: Any, room: Any, data: Any, clock: Any, count: Any) -> Any:
    """Inside compiled code: call a step at an address (``steppers.py``), so that no loop compiles it in again.

    Args:
        h: Step [s].
    """
    signature = types.void(types.int64, types.int64, types.float64, room, data, clock, count)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        stepper, address, h, rooms, both, time, told = args
        kinds = [*room.types, *data.types, clock, count]
        unpacked = [*cgutils.unpack_tuple(builder, rooms), *cgutils.unpack_tuple(builder, both), time, told]
        arrays = [make_array(kind)(context, builder, value) for kind, value in zip(kinds, unpacked, strict=True)]
        width = cgutils.unpack_tuple(builder, arrays[0].shape)[1]
        double, word = ir.DoubleType().as_pointer(), ir.IntType(64).as_pointer()
        pointers = [word if kind.dtype == types.int64 else double for kind in kinds]
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64), ir.DoubleType(), ir.IntType(64), *pointers])
        builder.call(
            builder.inttoptr(stepper, kind.as_pointer()), [address, h, width, *(array.data for array in arrays)]
        )
        return context.get_dummy_value()

    return signature, generate


@kernel
def evaluate(address: int, t: float, x: Array, result: Array, numbers: Array, words: Any) -> None:
    """From Python: call the function at an address.

    Args:
        t: Instant [s].
        x: State [its own units].
    """
    call(address, t, x, result, numbers, words)
