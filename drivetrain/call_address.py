"""Call of a C function by its address, so that the caller is compiled once for all functions."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_intrinsic: Any = intrinsic  # the decorated function is called without its first argument


@_intrinsic
def call_address(typing: Any, address: Any, given: Any) -> Any:
    """Inside compiled code: call a C function without result, with the items of a tuple as arguments.

    Integers are passed as pointers, other items unchanged. An array is passed as ``array.ctypes.data``; the caller must
    keep the array alive.
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
