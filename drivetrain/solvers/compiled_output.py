"""What a compiled run leaves behind: rows at wanted instants, and what its owner adds up along each step."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call_rows
from drivetrain.solvers.compiled_steps import within
from drivetrain.solvers.layout import ACCOUNT, INNER, LIMIT, NEXT, PROBE, ROWS, TELL, TIME, X

_SLACK = 1e-12
_GAUSS = 0.5 / math.sqrt(3.0)


@law
def account(
    addresses: Any, start: float, end: float, h: float, carried: Any, block: Array, data: Any, clock: Array
) -> None:
    """Let the owner add up over a part of the step: called at two Gauss points, each standing for half of it.

    Args:
        h: Step [s].
    """
    if addresses[ACCOUNT] == 0 or end <= start:
        return
    for half in range(2):
        share = 0.5 * (start + end) + (2.0 * half - 1.0) * _GAUSS * (end - start)
        within(share, block, INNER)
        block[PROBE, 0] = 0.5 * (end - start) * h
        t = min(clock[TIME] + share * h, clock[LIMIT])
        call_rows(addresses[ACCOUNT], t, block, INNER, block, PROBE, data)
        for i in carried:
            block[X, i] = block[NEXT, i] = block[INNER, i]


@law
def _row(addresses: Any, t: float, row: int, rows: Array, block: Array, data: Any, count: Any) -> None:
    """A wanted row: the state, or what the owner tells of it."""
    if addresses[TELL]:
        call_rows(addresses[TELL], t, block, row, rows, count[ROWS], data)
    else:
        for i in range(block.shape[1]):
            rows[count[ROWS], i] = block[row, i]
    count[ROWS] += 1


@law
def emit(
    addresses: Any,
    until: float,
    h: float,
    wanted: Array,
    rows: Array,
    carried: Any,
    block: Array,
    data: Any,
    clock: Array,
    count: Any,
) -> None:
    """Rows at the wanted instants before the end of the step, and the account of the whole step; X is its beginning.

    Args:
        until: End of the step [s].
        h: Step [s].
    """
    until -= _SLACK * max(1.0, abs(until))
    reached = 0.0
    while count[ROWS] < len(wanted) and wanted[count[ROWS]] < until:
        t = wanted[count[ROWS]]
        share = (t - clock[TIME]) / h
        account(addresses, reached, share, h, carried, block, data, clock)
        reached = share
        within(share, block, INNER)
        _row(addresses, t, INNER, rows, block, data, count)
    account(addresses, reached, 1.0, h, carried, block, data, clock)


@law
def emit_here(addresses: Any, wanted: Array, rows: Array, block: Array, data: Any, clock: Array, count: Any) -> None:
    """Rows at the wanted instants that are now."""
    until = clock[TIME] + _SLACK * max(1.0, abs(clock[TIME]))
    while count[ROWS] < len(wanted) and wanted[count[ROWS]] <= until:
        _row(addresses, min(wanted[count[ROWS]], clock[TIME]), X, rows, block, data, count)
