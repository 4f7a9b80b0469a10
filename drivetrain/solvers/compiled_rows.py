"""Sums of rows of the block, four entries at a time: states are few, and a loop that must first ask whether rows
overlap, as a compiler's own does, costs more than the sum.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

_intrinsic: Any = intrinsic  # what it decorates is called with one argument less than it takes
_WIDTH = 4


@_intrinsic
def mix(typing: Any, block: Any, goal: Any, rows: Any, factors: Any) -> Any:
    """Inside compiled code: a row becomes the sum of rows, each times a factor; it may be one of them."""
    count = len(rows)
    told = types.UniTuple(types.int64, count), types.UniTuple(types.float64, count)
    signature = types.void(block, types.int64, *told)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = make_array(block)(context, builder, args[0])
        width = cgutils.unpack_tuple(builder, array.shape)[1]
        starts = [builder.gep(array.data, [builder.mul(row, width)]) for row in cgutils.unpack_tuple(builder, args[2])]
        target = builder.gep(array.data, [builder.mul(args[1], width)])
        weights = cgutils.unpack_tuple(builder, args[3])
        one, zero = ir.Constant(width.type, 1), ir.Constant(width.type, 0)
        whole = builder.and_(width, ir.Constant(width.type, -_WIDTH))
        together = ir.VectorType(ir.DoubleType(), _WIDTH)
        wide = [_spread(builder, together, weight) for weight in weights]
        with cgutils.for_range_slice(builder, zero, whole, ir.Constant(width.type, _WIDTH), inc=True) as (at, _):
            _sum(builder, together, starts, target, wide, at)
        with cgutils.for_range_slice(builder, whole, width, one, inc=True) as (at, _):
            _sum(builder, ir.DoubleType(), starts, target, weights, at)
        return context.get_dummy_value()

    return signature, generate


def _spread(builder: Any, together: Any, weight: Any) -> Any:
    """A number in every place of a vector."""
    empty, word = ir.Constant(together, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, weight, ir.Constant(word, 0))
    return builder.shuffle_vector(first, empty, ir.Constant(ir.VectorType(word, _WIDTH), [0] * _WIDTH))


def _sum(builder: Any, kind: Any, starts: list[Any], target: Any, weights: list[Any], at: Any) -> None:
    """The sum at one place, or at several together; all is read before anything is written."""
    total = None
    for start, weight in zip(starts, weights, strict=True):
        place = builder.bitcast(builder.gep(start, [at]), kind.as_pointer())
        part = builder.fmul(weight, builder.load(place, align=8))
        total = part if total is None else builder.fadd(total, part)
    builder.store(total, builder.bitcast(builder.gep(target, [at]), kind.as_pointer()), align=8)
