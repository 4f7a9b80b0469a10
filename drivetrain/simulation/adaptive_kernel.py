"""What the adaptive engine does beside the equations of motion, compiled: modes of friction, samples, accounts, rows.

Friction has a mode a coordinate: stuck, or sliding one way. Within a step the mode is given, so the rates are smooth;
it changes at an event, located by the solver: a sliding coordinate comes to rest, or what a stuck one holds reaches its
bound. Then the change that belongs to the event is forced, and only what it does to the others is left to
complementarity: who asks "which mode?" anew at rest gets the old answer back, for ever.

At the end of the words of a plan lie: where the words and numbers of the Jacobian begin, how many events were logged,
how many there is room for, whether any effect has a memory, the modes before, and which way each stuck coordinate was
last seen to give; at the end of the numbers the log itself (instant, coordinate, mode before, mode after).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all, call_one, shifted
from drivetrain.simulation.equations_kernel import compute, guess_still, show_states, tell_motion
from drivetrain.simulation.vector_rows import row_of
from drivetrain.solvers.compiled_function import compiled

# Words behind those of the plan; the first two are those of ``jacobian_kernel.py``.
LOGGED, ROOM, REMEMBERS, BEFORE = range(2, 6)
ENTRY = 4  # numbers an entry of the log
AT_REST = 1e-5  # [rad/s or m/s]: what is slower when its speed crosses zero is at rest
PUSH = 1e-300  # [rad/s]: the speed that tells which way a coordinate was pushed off


@part
def _at(t: float, x: Any, n: Any, w: Any) -> None:
    """The equations at an instant, rates to the spare place."""
    for k in range(w[f.MOVING]):
        n[w[f.AT_STATE] + k] = x[k]
        n[w[f.AT_SPARE] + k] = 0.0
    call_one(w[f.MOTION], t, 0.0, shifted(n, w[f.AT_SPARE]), n, w, 0)


@part
def _active(i: int, n: Any, w: Any) -> bool:
    return n[w[f.AT_LEVELS] + i * f.LEVELS + f.ACTIVE] != 0.0


def _values(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    """How far each coordinate is from changing its mode; negative when it has overdone it."""
    c, modes, surface = words[f.COORDINATES], words[f.AT_MODES], row_of(words, f.SURFACE)
    margin, friction, asked = row_of(words, f.MARGIN), row_of(words, f.FRICTION), False
    for i in range(c):
        asked = asked or words[modes + i] == 0 or numbers[surface + i] != 0.0
    if asked:
        _at(t, x, numbers, words)
    for i in range(c):
        if not _active(i, numbers, words):
            result[i] = 1.0
        elif words[modes + i] == 0:
            result[i] = numbers[margin + i]
            if result[i] < 0.0:
                # It breaks loose the way in which it gave, also where the force at the event itself is zero.
                words[words[f.WORDS] + BEFORE + c + i] = 1 if numbers[friction + i] >= 0.0 else -1
        else:
            result[i] = words[modes + i] * (x[c + i] - numbers[surface + i])


def _handler(t: Any, x: Any, crossed: Any, numbers: Any, words: Any) -> None:
    """Force the change of mode that an event stands for, and let the others at rest find theirs."""
    c, modes, own = words[f.COORDINATES], words[f.AT_MODES], words[f.WORDS]
    surface = row_of(words, f.SURFACE)
    _at(t, x, numbers, words)
    for i in range(c):
        words[own + BEFORE + i] = words[modes + i]
        if crossed[i] == 0.0 or not _active(i, numbers, words):
            continue
        rest = numbers[surface + i]
        if words[modes + i] == 0:
            way = words[own + BEFORE + c + i]
            x[c + i] = rest + way * max(PUSH, 4e-16 * abs(rest))
        elif abs(x[c + i] - rest) <= AT_REST:
            x[c + i] = rest
            words[modes + i] = 0  # what comes to rest sticks, unless that asks too much of friction
    words[f.HELD_MODES] = 0
    _at(t, x, numbers, words)
    words[f.HELD_MODES] = 1
    for i in range(c):
        if words[modes + i] != words[own + BEFORE + i]:
            entry = words[f.NUMBERS] + ENTRY * words[own + LOGGED]
            if words[own + LOGGED] < words[own + ROOM]:
                numbers[entry], numbers[entry + 1] = t, i
                numbers[entry + 2], numbers[entry + 3] = words[own + BEFORE + i], words[modes + i]
            words[own + LOGGED] += 1


def _account(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    """Powers and what effects remember, over the time that this instant stands for."""
    h, spare = result[0], shifted(numbers, words[f.AT_SPARE])
    _at(t, x, numbers, words)
    call_one(words[f.FORCES], t, 0.0, spare, numbers, words, 0)
    # Powers are those of the instant; with h > 0 effects tell means over a fixed step that begins here.
    call_all(words[f.ACCOUNTS], words[f.AT_ACCOUNTS], t, 0.0, spare, numbers, words)
    for k in range(words[f.POWERS]):
        power = numbers[words[f.AT_SIGNALS] + words[words[f.AT_POWERS] + k]]
        numbers[words[f.AT_ENERGIES] + k] += h * power
    if words[words[f.WORDS] + REMEMBERS]:
        call_all(words[f.ACCOUNTS], words[f.AT_ACCOUNTS], t, h, spare, numbers, words)


def _tell(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    """A row of the recording: time, states, signals, energies."""
    states, signals, spare = words[f.STATES], words[f.SIGNALS], shifted(numbers, words[f.AT_SPARE])
    _at(t, x, numbers, words)
    call_one(words[f.FORCES], t, 0.0, spare, numbers, words, 0)
    call_all(words[f.ACCOUNTS], words[f.AT_ACCOUNTS], t, 0.0, spare, numbers, words)
    result[0] = t
    for k in range(states):
        result[1 + k] = numbers[words[f.AT_STATE] + k]
    for k in range(signals):
        result[1 + states + k] = numbers[words[f.AT_SIGNALS] + k]
    for k in range(words[f.POWERS]):
        result[1 + states + signals + k] = numbers[words[f.AT_ENERGIES] + k]


def _opens(t: Any, x: Any, result: Any, numbers: Any, words: Any) -> None:
    """Samples that are due; all laws are computed before the first."""
    told, spare = False, shifted(numbers, words[f.AT_SPARE])
    for k in range(words[f.MOVING]):
        numbers[words[f.AT_STATE] + k] = x[k]
    for k in range(words[f.SAMPLES]):
        at = words[f.AT_SAMPLES] + 4 * k
        period = numbers[words[at + 2]]
        if t < period * words[at + 3] - 1e-6 * period:
            continue
        if not told:
            guess_still(numbers, words)
            tell_motion(numbers, words, 0.0)
            show_states(numbers, words, 0.0)
            compute(numbers, words, t, 0.0, spare)
            told = True
        call_all(1, at, t, 0.0, spare, numbers, words)
        words[at + 3] += 1
    for k in range(2 * words[f.COORDINATES], words[f.MOVING]):
        x[k] = numbers[words[f.AT_STATE] + k]


@lru_cache(maxsize=1)
def values() -> Any:
    """How far each coordinate is from changing its mode, as event values; compiled at the first call."""
    return compiled(_values)


@lru_cache(maxsize=1)
def handler() -> Any:
    """The change of modes at an event, compiled likewise."""
    return compiled(_handler)


@lru_cache(maxsize=1)
def account() -> Any:
    """What is added up along a step, compiled likewise."""
    return compiled(_account)


@lru_cache(maxsize=1)
def tell() -> Any:
    """A row of the recording, compiled likewise."""
    return compiled(_tell)


@lru_cache(maxsize=1)
def opens() -> Any:
    """The samples that are due where a segment begins, compiled likewise."""
    return compiled(_opens)
