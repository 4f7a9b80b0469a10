"""Maximum and minimum of two floats that are not NaN, as one instruction each that can be vectorised.

With numba's ``max``, ``np.maximum`` or a comparison a loop over samples is not vectorised, whatever its options.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_intrinsic: Any = intrinsic  # the decorated function is called without its first argument


def _instruction(name: str) -> Any:
    """A call of an LLVM intrinsic of two floats."""

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
