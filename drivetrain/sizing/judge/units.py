"""Kernels that other kernels call by their address: each is compiled once, whoever uses it.

A kernel compiled into another is optimised again with it, and once more with all that use that one. What is called by
its address is found at run time: addresses are data, and the disk cache of who calls does not hold them.
"""

from __future__ import annotations

from typing import Any

import numba as nb
from numba import types
from numba.core import cgutils
from numba.core.types import unliteral
from numba.extending import intrinsic

_intrinsic: Any = intrinsic  # what it decorates is called with one argument less than it takes


def address_of_unit(step: str, unit: Any, *given: Any) -> int:
    """Where a compiled kernel lies, for arguments of some kinds."""
    kinds = tuple(nb.typeof(one) for one in given)
    unit.compile(kinds)
    made = unit.overloads[kinds]
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_func_name))


def _generator(result: Any, kinds: tuple[Any, ...]) -> Any:
    """What writes the call of a kernel at an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        convention = context.call_conv
        kind = convention.get_function_type(result, kinds)
        kernel = builder.inttoptr(args[0], kind.as_pointer())
        _, value = convention.call_function(builder, kernel, result, kinds, args[1:])  # no kernel raises
        return value

    return generate


def _called(result: Any, address: Any, *given: Any) -> Any:
    """Kinds and writer of a call."""
    kinds = tuple(unliteral(one) for one in given)
    return result(types.int64, *kinds), _generator(result, kinds)


_VERDICT = types.Tuple((types.int64, types.int64, types.float64))


@_intrinsic
def call_judge(typing: Any, address: Any, task: Any, joint: Any, pair: Any, load: Any, mode: Any) -> Any:
    """Inside compiled code: the verdict on a pair."""
    return _called(_VERDICT, address, task, joint, pair, load, mode)


@_intrinsic
def call_power(typing: Any, address: Any, task: Any, joint: Any, pair: Any, load: Any, power: Any) -> Any:
    """Inside compiled code: the electrical power of a pair."""
    return _called(types.float64, address, task, joint, pair, load, power)


@_intrinsic
def call_load(typing: Any, address: Any, task: Any, joint: Any, drives: Any, load: Any) -> Any:
    """Inside compiled code: what is asked of a joint."""
    return _called(types.none, address, task, joint, drives, load)


@_intrinsic
def call_sieve(typing: Any, address: Any, task: Any, joint: Any, wanted: Any, memory: Any) -> Any:
    """Inside compiled code: rule out the candidates of a joint."""
    kinds = (task, *wanted.types[:2], unliteral(joint), *wanted.types[2:], memory)
    write = _generator(types.boolean, kinds)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        setting, choices, limit, full = cgutils.unpack_tuple(builder, args[3])
        given = [args[1], setting, choices, args[2], limit, full, args[4]]
        return write(context, builder, signature, [args[0], *given])

    return types.boolean(types.int64, task, unliteral(joint), wanted, memory), generate
