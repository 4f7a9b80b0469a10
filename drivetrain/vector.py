"""The larger and the smaller of two floats, of which none is NaN, as one instruction each that vectorises.

Numba's ``max``, ``np.maximum`` and a comparison keep a loop over samples scalar, whatever its options.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_intrinsic: Any = intrinsic  # what it decorates is called with one argument less than it takes


def _instruction(name: str) -> Any:
    """A call of one of LLVM's functions of two floats."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = ir.DoubleType()
        function = builder.module.declare_intrinsic(name, [number], ir.FunctionType(number, [number, number]))
        return builder.call(function, arguments, fastmath=("nnan", "nsz", "reassoc"))

    return types.float64(types.float64, types.float64), generate


@_intrinsic
def larger(typing: Any, a: Any, b: Any) -> Any:
    """Of two floats."""
    return _instruction("llvm.maxnum")


@_intrinsic
def smaller(typing: Any, a: Any, b: Any) -> Any:
    """Of two floats."""
    return _instruction("llvm.minnum")
