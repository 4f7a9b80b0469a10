"""Laws on pointers, called beside laws on records until the last of them is written anew."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import carray, types

from drivetrain.call_address import call_address
from drivetrain.jit import callback

_DOUBLES, _WORDS = types.CPointer(types.float64), types.CPointer(types.int64)


def _bridge(t: Any, h: Any, words: Any, count: Any, joints: Any, numbers: Any) -> None:
    base, rows = carray(numbers, 1).ctypes.data, carray(words, 1).ctypes.data
    call_address(words[0], (t, h, base, base + 8 * words[1], base, base, rows + 16))


@lru_cache(maxsize=1)
def bridge() -> Any:
    """A law on records that calls one on pointers."""
    return callback(types.void(types.float64, types.float64, _WORDS, types.int64, _DOUBLES, _DOUBLES), _bridge)
