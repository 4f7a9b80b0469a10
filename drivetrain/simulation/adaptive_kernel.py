"""What the adaptive engine does beside the equations of motion, compiled: modes of friction, samples, accounts, rows.

Friction has a mode a coordinate: stuck, or sliding one way. Within a step the mode is given, so the rates are smooth;
it changes at an event, located by the solver: a sliding coordinate comes to rest, or what a stuck one holds reaches its
bound. Then the change that belongs to the event is forced, and only what it does to the others is left to
complementarity: who asks "which mode?" anew at rest gets the old answer back, for ever.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import carray

from drivetrain.jit import callback
from drivetrain.simulation.rates import RIGHT_SIDE, account_at, put_row, put_states, solve_at, take_samples
from drivetrain.simulation.records import (
    AT,
    MODE_CHANGE,
    Run,
    call_laws,
    coordinates_of,
    count_of,
    engine_of,
    memory_of,
    numbers_of,
    part,
    states_of,
    words_of,
)

AT_REST = 1e-5  # [rad/s or m/s]: what is slower when its speed crosses zero is at rest
PUSH = 1e-300  # [rad/s]: the speed that tells in which direction a coordinate was pushed off


@part
def _solve(run: Run, t: float, x: Any) -> None:
    """The equations at an instant."""
    put_states(run, x)
    solve_at(run, t)


def _values(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """How far each coordinate is from changing its mode; negative when it has overdone it."""
    coordinates, asked = coordinates_of(run), False
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
    coordinates, engine = coordinates_of(run), engine_of(run)
    log = carray(run[AT.log], count_of(run, AT.log), MODE_CHANGE)
    for i in range(len(coordinates)):
        one = coordinates[i]
        if one.dry.mode != one.before:
            if engine.logged < len(log):
                change = log[engine.logged]
                change.time, change.coordinate, change.before, change.after = t, i, one.before, one.dry.mode
            engine.logged += 1


def _handler(t: Any, x: Any, crossed: Any, numbers: Any, run: Any) -> None:
    """Force the change of mode that an event stands for, and let the others at rest find theirs."""
    coordinates = coordinates_of(run)
    c = len(coordinates)
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
    engine_of(run).held = 0
    _solve(run, t, x)
    engine_of(run).held = 1
    _log(run, t)


def _account(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Powers and what effects remember, over the time that this instant stands for."""
    h = result[0]
    memory, powers, energies = memory_of(run), words_of(run, AT.powers), numbers_of(run, AT.energies)
    _solve(run, t, x)
    # Powers are those of the instant; with h > 0 effects put out means over a fixed step that begins here.
    account_at(run, t)
    for k in range(len(powers)):
        energies[k] += h * memory[powers[k]]
    if engine_of(run).remembers:
        call_laws(run, AT.accounts, t, h)


def _tell(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """A row of the recording."""
    _solve(run, t, x)
    account_at(run, t)
    put_row(run, t, result)


def _opens(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Samples that are due where a segment begins."""
    states, memory = states_of(run), memory_of(run)
    put_states(run, x)
    take_samples(run, t, 0.0, 1e-6)
    for k in range(2 * len(coordinates_of(run)), engine_of(run).moving):
        x[k] = memory[states[k].value]


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
