"""Sixteen arms at once: a number of each side by side in the vector registers of the machine.

What a loop over time asks of an arm depends on the sample before it, so it cannot be done for several samples at once;
it can be done for several arms at once. Numba has no type for such a vector; this is one, with the arithmetic that the
kernels ask for. Every lane is computed as if it were alone, so no result depends on the arms beside it.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

from drivetrain.jit import kernel, law

WIDTH = 16


njit_arms: Any = kernel
"""Called from Python, kept on disk."""

njit_arm: Any = law
"""Within it."""

njit_lanes: Any = law(fastmath={"contract", "reassoc", "nsz"})
"""The same where sums may be taken in another order; NaN and infinity are respected."""

_intrinsic: Any = intrinsic  # whose annotations keep the context among the arguments
_NUMBER = ir.DoubleType()
_VECTOR = ir.VectorType(_NUMBER, WIDTH)
_INDEX = ir.IntType(32)


class LanesType(types.Type):  # type: ignore[misc, unused-ignore]
    """What numba knows of a vector of floats."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")


Lanes = Any  # of which a kernel's signature can only say that it is there
lanes = LanesType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc, unused-ignore]
    """Two registers of the widest machines, whose steps fill each other's waits."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _spread(builder: Any, number: Any) -> Any:
    nothing = ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(_INDEX, WIDTH), [0] * WIDTH))


@lower_cast(types.Float, LanesType)  # type: ignore[untyped-decorator, unused-ignore]
def _from_float(context: Any, builder: Any, kind: Any, to: Any, value: Any) -> Any:
    return _spread(builder, value)


def _arithmetic(symbols: tuple[Any, ...], name: str, count: int = 2) -> None:
    """Makes an operator take lanes, or lanes and a float."""

    class Typing(AbstractTemplate):  # type: ignore[misc, unused-ignore]
        def generic(self, args: Any, kws: Any) -> Any:
            known = all(isinstance(one, LanesType | types.Float) for one in args)
            if len(args) == count and known and any(isinstance(one, LanesType) for one in args):
                return signature(lanes, *[lanes] * count)
            return None

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, name)(*args)

    for symbol in symbols:
        infer_global(symbol)(Typing)
        lower_builtin(symbol, *[LanesType] * count)(lowered)


_arithmetic((operator.add, operator.iadd), "fadd")
_arithmetic((operator.sub, operator.isub), "fsub")
_arithmetic((operator.mul, operator.imul), "fmul")
_arithmetic((operator.truediv, operator.itruediv), "fdiv")
_arithmetic((operator.neg,), "fneg", 1)


def _declared(builder: Any, name: str, gives: Any, count: int) -> Any:
    kind = ir.FunctionType(gives, [_VECTOR] * count)
    return cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{WIDTH}f64")


def _function(name: str, count: int) -> Any:
    """A function of the compiler's own, lane by lane."""

    @_intrinsic
    def one(typing_context: Any, a: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.call(_declared(builder, name, _VECTOR, 1), args)

        return lanes(lanes), generate

    @_intrinsic
    def two(typing_context: Any, a: Any, b: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.call(_declared(builder, name, _VECTOR, 2), args, fastmath=("nnan", "nsz"))

        return lanes(lanes, lanes), generate

    return one if count == 1 else two


magnitude = _function("llvm.fabs", 1)
"""Without the sign."""

floor = _function("llvm.floor", 1)
"""The whole number below."""

root = _function("llvm.sqrt", 1)
"""The square root."""

highest = _function("llvm.maxnum", 2)
"""The larger of two, of which none is NaN."""

lowest = _function("llvm.minnum", 2)
"""The smaller of two, of which none is NaN."""

power = _function("llvm.pow", 2)
"""The first to the power of the second; dear."""

exponential = _function("llvm.exp", 1)
"""e to its power; dear."""

_THIRD = 3071306043645493248.0  # two thirds of the exponent's zero, less what makes the worst guess best
_WHOLE = ir.VectorType(ir.IntType(64), WIDTH)


@_intrinsic
def third_guess(typing_context: Any, a: Any) -> Any:
    """The cube root of what is not negative to a few percent: a third of the exponent's bits."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.sitofp(builder.bitcast(args[0], _WHOLE), _VECTOR)
        scaled = builder.fmul(bits, _spread(builder, ir.Constant(_NUMBER, 1.0 / 3.0)))
        moved = builder.fadd(scaled, _spread(builder, ir.Constant(_NUMBER, _THIRD)))
        return builder.bitcast(builder.fptosi(moved, _WHOLE), _VECTOR)

    return lanes(lanes), generate


@_intrinsic
def spread(typing_context: Any, number: Any) -> Any:
    """The same number in all lanes."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _spread(builder, args[0])

    return lanes(types.float64), generate


@_intrinsic
def where_less(typing_context: Any, a: Any, b: Any, then: Any, other: Any) -> Any:
    """One of two numbers in each lane.

    Args:
        other: Elsewhere, where one of them is NaN too.
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", args[0], args[1]), args[2], args[3])

    return lanes(lanes, lanes, lanes, lanes), generate


@_intrinsic
def largest_of(typing_context: Any, a: Any) -> Any:
    """The largest of all lanes."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.call(_declared(builder, "llvm.vector.reduce.fmax", _NUMBER, 1), args)

    return types.float64(lanes), generate


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(
        builder.gep(data, [builder.mul(index, ir.Constant(index.type, WIDTH))]), _VECTOR.as_pointer()
    )  # fmt: skip


@_intrinsic
def row(typing_context: Any, table: Any, index: Any) -> Any:
    """A row of a table as lanes.

    Args:
        table: Contiguous floats, (rows, WIDTH).
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        found = builder.load(_place(context, builder, sig.args[0], args[0], args[1]))
        found.align = 8
        return found

    return lanes(table, types.intp), generate


@_intrinsic
def put(typing_context: Any, table: Any, index: Any, value: Any) -> Any:
    """Makes lanes a row of a table.

    Args:
        table: Contiguous floats, (rows, WIDTH).
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        stored = builder.store(args[2], _place(context, builder, sig.args[0], args[0], args[1]))
        stored.align = 8
        return context.get_dummy_value()

    return types.void(table, types.intp, lanes), generate
