"""What the adaptive engine does beside the equations of motion, compiled: modes of friction, samples, accounts, rows.

Friction has a mode a coordinate: stuck, or sliding one way. Within a step the mode is given, so the rates are smooth;
it changes at an event, located by the solver: a sliding coordinate comes to rest, or what a stuck one holds reaches its
bound. Then the change that belongs to the event is forced, and only what it does to the others is left to
complementarity: who asks "which mode?" anew at rest gets the old answer back, for ever.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.jit import callback
from drivetrain.simulation.rates import RIGHT_SIDE, account_at, put_row, put_states, solve_at, take_samples
from drivetrain.simulation.records import (
    MODE_CHANGE,
    Run,
    call_laws,
    numbers_of,
    opened,
    part,
    states_of,
)

AT_REST = 1e-5  # [rad/s or m/s]: what is slower when its speed crosses zero is at rest
PUSH = 1e-300  # [rad/s]: the speed that tells in which direction a coordinate was pushed off


@part
def _solve(run: Run, t: float, x: Any) -> None:
    """The equations at an instant."""
    put_states(run, x)
    solve_at(run, t)


def _values(t: Any, x: Any, result: Any, numbers: Any, memory: Any) -> None:
    """How far each coordinate is from changing its mode; negative when it has overdone it."""
    run = opened(memory)
    coordinates, asked = run.coordinates, False
    for i in range(len(coordinates)):
        asked = asked or coordinates[i].dry.mode == 0 or coordinates[i].surface != 0.0
    if asked:
        _solve(run, t, x)
    for i in range(len(coordinates)):
        one = coordinates[i]
        if not one.dry.active:
            result[i] = 1.0
        elif one.dry.mode == 0:
            result[i] = one.margin
            if one.margin < 0.0:
                # It breaks loose the way in which it gave, also where the force at the event itself is zero.
                one.gave = 1 if one.friction >= 0.0 else -1
        else:
            result[i] = one.dry.mode * (x[len(coordinates) + i] - one.surface)


@part
def _log(run: Run, t: float) -> None:
    """Write down the modes that have changed."""
    coordinates, engine = run.coordinates, run.head[0].engine
    log = numbers_of(run.numbers, engine.at.log).view(MODE_CHANGE)
    for i in range(len(coordinates)):
        one = coordinates[i]
        if one.dry.mode != one.before:
            if engine.logged < len(log):
                change = log[engine.logged]
                change.time, change.coordinate, change.before, change.after = t, i, one.before, one.dry.mode
            engine.logged += 1


def _handler(t: Any, x: Any, crossed: Any, numbers: Any, memory: Any) -> None:
    """Force the change of mode that an event stands for, and let the others at rest find theirs."""
    run = opened(memory)
    coordinates, c = run.coordinates, len(run.coordinates)
    _solve(run, t, x)
    for i in range(c):
        one = coordinates[i]
        one.before = one.dry.mode
        if crossed[i] == 0.0 or not one.dry.active:
            continue
        if one.dry.mode == 0:
            x[c + i] = one.surface + one.gave * max(PUSH, 4e-16 * abs(one.surface))
        elif abs(x[c + i] - one.surface) <= AT_REST:
            x[c + i] = one.surface
            one.dry.mode = 0  # what comes to rest sticks, unless that asks too much of friction
    run.head[0].engine.held = 0
    _solve(run, t, x)
    run.head[0].engine.held = 1
    _log(run, t)


def _account(t: Any, x: Any, result: Any, numbers: Any, memory: Any) -> None:
    """Powers and what effects remember, over the time that this instant stands for."""
    h, run = result[0], opened(memory)
    at = run.head[0].engine.at
    powers, energies = numbers_of(run.numbers, at.powers).view(np.int64), numbers_of(run.numbers, at.energies)
    _solve(run, t, x)
    # Powers are those of the instant; with h > 0 effects put out means over a fixed step that begins here.
    account_at(run, t)
    for k in range(len(powers)):
        energies[k] += h * run.numbers[powers[k]]
    if run.head[0].engine.remembers:
        call_laws(run, at.accounts, t, h)


def _tell(t: Any, x: Any, result: Any, numbers: Any, memory: Any) -> None:
    """A row of the recording."""
    run = opened(memory)
    _solve(run, t, x)
    account_at(run, t)
    put_row(run, t, result)


def _opens(t: Any, x: Any, result: Any, numbers: Any, memory: Any) -> None:
    """Samples that are due where a segment begins."""
    run = opened(memory)
    states = states_of(run)
    put_states(run, x)
    take_samples(run, t, 0.0, 1e-6)
    for k in range(2 * len(run.coordinates), run.head[0].engine.moving):
        x[k] = run.numbers[states[k].value]


@lru_cache(maxsize=1)
def values() -> Any:
    """How far each coordinate is from changing its mode, as event values; compiled at the first call."""
    return callback(RIGHT_SIDE, _values)


@lru_cache(maxsize=1)
def handler() -> Any:
    """The change of modes at an event, compiled likewise."""
    return callback(RIGHT_SIDE, _handler)


@lru_cache(maxsize=1)
def account() -> Any:
    """What is added up along a step, compiled likewise."""
    return callback(RIGHT_SIDE, _account)


@lru_cache(maxsize=1)
def tell() -> Any:
    """A row of the recording, compiled likewise."""
    return callback(RIGHT_SIDE, _tell)


@lru_cache(maxsize=1)
def opens() -> Any:
    """The samples that are due where a segment begins, compiled likewise."""
    return callback(RIGHT_SIDE, _opens)
