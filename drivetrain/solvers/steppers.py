"""The steps of the compiled methods as functions with an address: each is compiled alone, and only when it is used."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import carray, types

from drivetrain.jit import callback
from drivetrain.solvers.compiled_rodas5p import rodas5p_step
from drivetrain.solvers.compiled_steps import dormand_prince_step, fixed_step, rodas_step
from drivetrain.solvers.layout import (
    BLOCK_ROWS,
    CLOCK_SIZE,
    COUNT_SIZE,
    DORMAND_PRINCE,
    EULER,
    RODAS4,
    RODAS5P,
    RUNGE_KUTTA,
)

_DOUBLES, _WORDS = types.CPointer(types.float64), types.CPointer(types.int64)
_SIGNATURE = types.void(
    types.int64, types.float64, types.int64, _DOUBLES, _DOUBLES, _DOUBLES, _DOUBLES, _WORDS, _DOUBLES,
    _WORDS, _DOUBLES, _WORDS,
)  # fmt: skip


def _rodas(address: Any, h: Any, n: Any, block: Any, jacobian: Any, matrix: Any, packed: Any, order: Any,
           numbers: Any, words: Any, clock: Any, count: Any) -> None:  # fmt: skip
    # Of numbers and words only the place matters here: the right-hand side knows how many it has.
    rodas_step(
        address, h, carray(block, (BLOCK_ROWS, n)), carray(jacobian, (n, n)), carray(matrix, (n, n)),
        carray(packed, n * n), carray(order, n * n + 3 * n + 1), (carray(numbers, 1), carray(words, 1)),
        carray(clock, CLOCK_SIZE), carray(count, COUNT_SIZE),
    )  # fmt: skip


def _rodas5p(address: Any, h: Any, n: Any, block: Any, jacobian: Any, matrix: Any, packed: Any, order: Any,
             numbers: Any, words: Any, clock: Any, count: Any) -> None:  # fmt: skip
    # Of numbers and words only the place matters here: the right-hand side knows how many it has.
    rodas5p_step(
        address, h, carray(block, (BLOCK_ROWS, n)), carray(jacobian, (n, n)), carray(matrix, (n, n)),
        carray(packed, n * n), carray(order, n * n + 3 * n + 1), (carray(numbers, 1), carray(words, 1)),
        carray(clock, CLOCK_SIZE), carray(count, COUNT_SIZE),
    )  # fmt: skip


def _dormand_prince(address: Any, h: Any, n: Any, block: Any, jacobian: Any, matrix: Any, packed: Any, order: Any,
                    numbers: Any, words: Any, clock: Any, count: Any) -> None:  # fmt: skip
    data = (carray(numbers, 1), carray(words, 1))
    dormand_prince_step(
        address, h, carray(block, (BLOCK_ROWS, n)), data, carray(clock, CLOCK_SIZE), carray(count, COUNT_SIZE)
    )


def _runge_kutta(address: Any, h: Any, n: Any, block: Any, jacobian: Any, matrix: Any, packed: Any, order: Any,
                 numbers: Any, words: Any, clock: Any, count: Any) -> None:  # fmt: skip
    data, rows = (carray(numbers, 1), carray(words, 1)), carray(block, (BLOCK_ROWS, n))
    fixed_step(RUNGE_KUTTA, address, h, rows, data, carray(clock, CLOCK_SIZE), carray(count, COUNT_SIZE))


def _euler(address: Any, h: Any, n: Any, block: Any, jacobian: Any, matrix: Any, packed: Any, order: Any,
           numbers: Any, words: Any, clock: Any, count: Any) -> None:  # fmt: skip
    data, rows = (carray(numbers, 1), carray(words, 1)), carray(block, (BLOCK_ROWS, n))
    fixed_step(EULER, address, h, rows, data, carray(clock, CLOCK_SIZE), carray(count, COUNT_SIZE))


@lru_cache(maxsize=5)
def stepper(method: int) -> Any:
    """The step of a method, compiled at the first call (some seconds) or taken from numba's disk cache."""
    steps = {
        RODAS4: _rodas, RODAS5P: _rodas5p, DORMAND_PRINCE: _dormand_prince, RUNGE_KUTTA: _runge_kutta, EULER: _euler,
    }  # fmt: skip
    return callback(_SIGNATURE, steps[method])
