"""The equations of motion as a compiled right-hand side with an address, for solvers that choose their own steps."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from drivetrain.arrays import Array
from drivetrain.jit import callback
from drivetrain.simulation.equations import compute, guess_still, show_motion, show_states
from drivetrain.simulation.records import (
    AT,
    PARTS,
    Run,
    call_equations,
    call_law,
    call_laws,
    calls_of,
    engine_of,
    memory_of,
    part,
    parts_of,
    states_of,
    words_of,
)
from drivetrain.solvers.compiled_function import evaluate

_DOUBLES = types.CPointer(types.float64)
# As solvers call it: their words are the addresses of a run's sections, their numbers are none.
RIGHT_SIDE = types.void(types.float64, _DOUBLES, _DOUBLES, _DOUBLES, PARTS)
NO_NUMBERS = np.zeros(1)


@part
def put_states(run: Run, x: Any) -> None:
    """Put the states that follow rates among the numbers."""
    states, memory = states_of(run), memory_of(run)
    for k in range(engine_of(run).moving):
        memory[states[k].value] = x[k]


@part
def clear_rates(run: Run) -> None:
    """No rate is known yet."""
    states, memory = states_of(run), memory_of(run)
    for k in range(len(states)):
        if states[k].rate >= 0:
            memory[states[k].rate] = 0.0


@part
def solve_at(run: Run, t: float) -> None:
    """The equations at an instant, with the states as they are."""
    clear_rates(run)
    call_equations(run, engine_of(run).motion, t, 0.0)


@part
def account_at(run: Run, t: float) -> None:
    """Forces, and what effects put out, at an instant at which the equations are solved."""
    call_equations(run, engine_of(run).forces, t, 0.0)
    call_laws(run, AT.accounts, t, 0.0)


@part
def take_samples(run: Run, t: float, early: float, share: float) -> None:
    """Samples that are due; all laws are computed before the first.

    Args:
        early, share: How much too early a sample is taken all the same [s], and in periods.
    """
    samples, fresh = calls_of(run, AT.samples), False
    for k in range(len(samples)):
        sample = samples[k]
        if t < sample.period * sample.taken - early - share * sample.period:
            continue
        if not fresh:
            guess_still(run)
            show_motion(run, 0.0)
            show_states(run, 0.0)
            compute(run, t, 0.0)
            fresh = True
        call_law(run, sample, t, 0.0)
        sample.taken += 1


@part
def put_row(run: Run, t: float, row: Any) -> None:
    """What is recorded of an instant that is accounted for."""
    memory, columns = memory_of(run), words_of(run, AT.columns)
    row[0] = t
    for k in range(len(columns)):
        row[1 + k] = memory[columns[k]]


def _rates(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    put_states(run, x)
    solve_at(run, t)
    engine_of(run).rates_calls += 1
    states, memory = states_of(run), memory_of(run)
    for k in range(engine_of(run).moving):
        result[k] = memory[states[k].rate] if engine_of(run).solved >= 0 else math.nan


def _signals(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    solve_at(run, t)
    account_at(run, t)


@lru_cache(maxsize=1)
def rates() -> Any:
    """The right-hand side (t, x, result, numbers, run), compiled at the first call or taken from the disk cache.

    Rates that have no answer are NaN.
    """
    return callback(RIGHT_SIDE, _rates)


@lru_cache(maxsize=1)
def signals() -> Any:
    """Everything at an instant with the states as they are among the numbers, compiled likewise."""
    return callback(RIGHT_SIDE, _signals)


def evaluate_rates(numbers: Array, states: Array, t: float = 0.0) -> Array:
    """Rates of the states that follow them, in a run's numbers."""
    found = np.zeros(len(states))
    evaluate(rates().address, t, states, found, NO_NUMBERS, parts_of(numbers))
    return found


def evaluate_signals(numbers: Array, t: float = 0.0) -> None:
    """Everything at an instant, with the states that are among a run's numbers."""
    evaluate(signals().address, t, np.zeros(1), np.zeros(1), NO_NUMBERS, parts_of(numbers))
