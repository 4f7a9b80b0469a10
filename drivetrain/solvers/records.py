"""What the compiled loop works on: arrays with names, and records of the clock, the counters and the settings."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array

# Kinds of events: which way the value must cross zero, or that it must never be negative.
FALLING, EITHER, RISING, GUARD = -1, 0, 1, 2

# Why the loop came back.
DONE, PAUSED, SUSPECT, TERMINAL, TOO_MANY, NO_NUMBER, RUNS_AWAY, TOO_SHORT, JUMP, ZENO = range(10)

SIZES = np.dtype([(name, np.int64) for name in (
    "states", "stages", "groups", "grouped", "entries", "events", "log", "wanted", "width", "carried", "segments",
    "words",
)])  # fmt: skip
"""Lengths of the arrays below."""

STATE = np.dtype([(name, np.float64) for name in (
    "x", "rates", "drift",  # now, its rate, that rate's derivative by time; all else is found anew in each step
    "atol", "tolerance",  # error allowed in a step near zero, and here
    "next", "next_rates", "error",  # at the end of the step tried
    "move",  # by which differences are taken
)])  # fmt: skip
"""One record a state."""

CALLS = np.dtype([(name, np.int64) for name in (
    "rates", "jacobian", "values", "handler", "account", "tell", "opens",  # functions, 0 for none
    "numbers", "words",  # their data
)])  # fmt: skip
"""Addresses."""

SETTINGS = np.dtype([
    ("rtol", np.float64), ("largest_step", np.float64), ("smallest_step", np.float64),
    ("first_step", np.float64),  # 0: chosen from the rates
    ("fixed_step", np.float64),
    ("may_jump", np.int64), ("segment_word", np.int64), ("differences", np.int64), ("most_steps", np.int64),
])  # fmt: skip
"""Of the solver, times in s, and of the problem, see ``CompiledProblem``."""

CLOCK = np.dtype([(name, np.float64) for name in (
    "time", "limit",  # now, and the last instant that the present segment may see
    "step", "refused", "last_step", "last_error",  # proposed, the last one refused, the last one kept and its error
    "origin",  # from which steps of fixed length are counted
    "last_event", "last_jump",
    "jump_at", "before", "after",  # where a rate jumps, from what to what
)])  # fmt: skip
"""All in s but the last two."""

COUNT = np.dtype([(name, np.int64) for name in (
    "rates", "jacobians", "factorisations", "steps", "rejected", "restarts", "event_values",  # what it cost
    "budget",  # steps that may still be tried before the loop comes back
    "segment", "rows", "logged", "strides",  # segments and rows done; events in the log; steps since the origin
    "opened", "started", "fresh", "fresh_jacobian", "was_rejected",  # flags
    "ends",  # flag: no shorter step is left after the one refused
    "failures", "jumps", "busy",  # refusals in a row, jumps in a row, events without progress of time
    "fired", "last_fired",  # the event just found, and the one before
    "culprit", "argument",  # the state, or event, to be named; the state whose move makes its rate jump
)])  # fmt: skip


class Run(NamedTuple):
    """The states, the step tried last, and the records of the run.

    Attributes:
        states: Records, (n,).
        stages: Of the step, weighted by the tableau, (n, stages).
        curve: Polynomial of the step: x(s) = x + s (c0 + s (c1 + s (c2 + s c3))), s from 0 to 1, (n, 4).
        asked, answer: What functions at an address are given and fill, (n,).
        calls, settings, clock, count: Records, see above.
    """

    states: Any
    stages: Array
    curve: Array
    asked: Array
    answer: Array
    calls: Any
    settings: Any
    clock: Any
    count: Any


class Linear(NamedTuple):
    """The Jacobian and what it takes to find and to factor it.

    Attributes:
        jacobian: Rows and columns in the order of elimination, (n, n).
        exact: Room for the one that a problem gives, (n + 1, n).
        factors: Of the stages' matrix, inverse pivots on the diagonal, (n, n).
        rows: States in the order in which pivots were chosen, (n,).
        places, lower, filled: Columns of each row of the factors that are not zero, but for the diagonal, (n, n); how
            many of them are below it, and how many at all, (n,).
        solved: Room for a solution in the order of elimination, (n,).
        order, ranks: States in the order of elimination, and the place of each there, (n,).
        starts, columns: Groups of columns that are differenced together, (groups + 1,) and (n,).
        row_starts, row_indices: Rows in which each column differs from zero, (n + 1,) and (entries,).
    """

    jacobian: Array
    exact: Array
    factors: Array
    rows: Any
    places: Any
    lower: Any
    filled: Any
    solved: Array
    order: Any
    ranks: Any
    starts: Any
    columns: Any
    row_starts: Any
    row_indices: Any


class EventRoom(NamedTuple):
    """The events of a problem, m of them.

    Attributes:
        kinds, terminal: See ``Events``, (m,).
        old, new, later, trial: Values at the beginning of the step, where they were last asked for, where the search
            for the event began, and on trial; (m,).
        log_times, log_indices: Instants [s] and events, as many as ``count.logged``.
    """

    kinds: Any
    terminal: Any
    old: Array
    new: Array
    later: Array
    trial: Array
    log_times: Array
    log_indices: Any


class Output(NamedTuple):
    """Wanted instants [s], (N,), the rows told there, (N, ...), and the states that the account carries."""

    wanted: Array
    rows: Array
    carried: Any


class Segments(NamedTuple):
    """Ends of the segments between breakpoints, the last instant that each may see [s], and the problem's words."""

    ends: Array
    limits: Array
    words: Any
