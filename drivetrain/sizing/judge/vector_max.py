"""Larger and smaller of two numbers in a form that becomes vector instructions.

What numba makes of ``max`` and of a comparison keeps a loop scalar, as it must tell NaN apart; these do not.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _of_two(name: str) -> Any:
    """A function of two floats that is one instruction of the compiler."""

    @intrinsic  # type: ignore[untyped-decorator, unused-ignore]
    def chosen(typing_context: Any, a: Any, b: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            number = ir.DoubleType()
            function = builder.module.declare_intrinsic(name, [number], ir.FunctionType(number, [number, number]))
            return builder.call(function, arguments, fastmath=("nnan", "nsz", "reassoc"))

        return types.float64(types.float64, types.float64), generate

    return chosen


larger = _of_two("llvm.maxnum")
"""The larger of two floats, of which none is NaN."""

smaller = _of_two("llvm.minnum")
"""The smaller of two floats, of which none is NaN."""
