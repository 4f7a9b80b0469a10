"""Calling the compiled laws of effects by address: whatever the effects of a scene, no engine is compiled again."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.effects.effect import DOUBLES, WORDS
from drivetrain.simulation.fields import AT_SIGNALS, AT_STATE


def _invoke(typing: Any, address: Any, t: Any, h: Any, data: Any, n: Any, w: Any, places: Any) -> Any:
    """Call a law: rates go to ``data``, places of states, signals and rows in ``n``, ``n`` and ``w``."""
    whole = types.int64
    signature = types.void(whole, types.float64, types.float64, DOUBLES, DOUBLES, WORDS, types.UniTuple(whole, 3))

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address, t, h, rates, n, w, places = args
        double, data, integer = ir.DoubleType(), ir.DoubleType().as_pointer(), ir.IntType(64).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [double, double, data, data, data, data, integer])
        x, s, row = (builder.extract_value(places, k) for k in range(3))
        state, signals, rows = builder.gep(n, [x]), builder.gep(n, [s]), builder.gep(w, [row])
        builder.call(builder.inttoptr(address, kind.as_pointer()), [t, h, state, rates, signals, n, rows])
        return context.get_dummy_value()

    return signature, generate


_call: Any = intrinsic(_invoke)


@part
def call_one(address: int, t: float, h: float, rates: Any, n: Any, w: Any, row: int) -> None:
    """Call the law at an address.

    Args:
        t: Instant, or middle of the step [s].
        h: Step, 0 at an instant [s].
    """
    _call(address, t, h, rates, n, w, (w[AT_STATE], w[AT_SIGNALS], row))


@part
def call_all(count: int, table: int, t: float, h: float, rates: Any, n: Any, w: Any) -> None:
    """Call the laws of a table, in its order.

    Args:
        table: Place of the first pair (address, place of its rows) in the whole numbers.
        t: Instant, or middle of the step [s].
        h: Step, 0 at an instant [s].
    """
    for k in range(count):
        call_one(w[table + 2 * k], t, h, rates, n, w, w[table + 2 * k + 1])


def _shifted(typing: Any, pointer: Any, by: Any) -> Any:
    """Inside compiled code: a pointer to a later number of a block."""
    signature = DOUBLES(DOUBLES, types.int64)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.gep(args[0], [args[1]])

    return signature, generate


shifted: Any = intrinsic(_shifted)


def _pointer_to(typing: Any, array: Any) -> Any:
    """Inside compiled code: the first number of a contiguous array, as a pointer."""
    signature = (DOUBLES if array.dtype == types.float64 else WORDS)(array)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return make_array(array)(context, builder, args[0]).data

    return signature, generate


pointer_to: Any = intrinsic(_pointer_to)
