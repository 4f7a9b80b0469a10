"""Calling the compiled laws of effects by address: whatever the effects of a scene, no engine is compiled again."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from drivetrain.arrays import Array
from drivetrain.dynamics.compiled_vectors import part


@intrinsic
def call_one(
    typing: Any, address: Any, t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any, row: Any
) -> Any:
    """Inside compiled code: call the law at an address.

    Args:
        typing: Filled in by the compiler.
        address: Where it lies.
        t: Instant, or middle of the step [s].
        h: Step, 0 at an instant [s].
        x, rates, signals, numbers, words: Contiguous arrays; the last of whole numbers.
        row: From which of the words on.

    Returns:
        What the compiler needs to know.
    """
    arrays = (x, rates, signals, numbers, words)
    signature = types.void(types.int64, types.float64, types.float64, *arrays, types.int64)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pairs = zip(arrays, args[3:8], strict=True)
        pointers = [make_array(kind)(context, builder, value).data for kind, value in pairs]
        pointers[-1] = builder.gep(pointers[-1], [args[8]])
        double, data = ir.DoubleType(), ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [double, double, data, data, data, data, ir.IntType(64).as_pointer()])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), [args[1], args[2], *pointers])
        return context.get_dummy_value()

    return signature, generate


@part
def call_all(
    count: int, table: int, t: float, h: float, x: Array, rates: Array, signals: Array, numbers: Array, words: Array
) -> None:
    """Call the laws of a table, in its order.

    Args:
        count: How many.
        table: Place of the first pair (address, place of its rows) in ``words``.
        t: Instant, or middle of the step [s].
        h: Step, 0 at an instant [s].
        x: States.
        rates: Takes their rates.
        signals: All signals [SI].
        numbers, words: All constants.
    """
    for k in range(count):
        address, rows = words[table + 2 * k], words[table + 2 * k + 1]
        call_one(address, t, h, x, rates, signals, numbers, words, rows)
