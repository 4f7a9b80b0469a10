"""Calling a function of C by its address, so that what calls it is compiled once, whatever it is."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_intrinsic: Any = intrinsic  # what it decorates is called with one argument less than it takes


@_intrinsic
def call_address(typing: Any, address: Any, given: Any) -> Any:
    """Inside compiled code: call a C function without result; of a tuple, integers are pointers, all else is as it is.

    An array is handed over as ``array.ctypes.data``; the caller sees to it that the array lives.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer, values = ir.IntType(8).as_pointer(), []
        for k in range(len(given)):
            value = builder.extract_value(args[1], k)
            values.append(builder.inttoptr(value, pointer) if isinstance(value.type, ir.IntType) else value)
        kind = ir.FunctionType(ir.VoidType(), [value.type for value in values])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), values)
        return context.get_dummy_value()

    return types.void(address, given), generate
