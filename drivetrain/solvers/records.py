"""Data of the compiled integration loop: numpy record types with named fields, and its return codes."""

from __future__ import annotations

import numpy as np

# Return codes of the loop: finished, budget of steps used up, too many steps, rate not finite, state diverges, step too
# short, discontinuity of the rates, events without progress of time.
DONE, PAUSED, TOO_MANY_STEPS, NOT_FINITE, DIVERGES, STEP_TOO_SHORT, JUMP, ZENO = range(8)

MOST_STAGES = 8


def _record(kind: type, names: str) -> list[tuple[str, type]]:
    """Fields of one type, from their names separated by spaces."""
    return [(name, kind) for name in names.split()]


METHOD = np.dtype([
    ("adaptive", np.int64), ("order", np.float64), ("reuses", np.int64), ("gamma", np.float64), ("stages", np.uint64),
    ("times", np.float64, MOST_STAGES), ("gammas", np.float64, MOST_STAGES), ("error", np.float64, (1, MOST_STAGES)),
    ("a", np.float64, (MOST_STAGES + 1, MOST_STAGES)), ("c", np.float64, (MOST_STAGES, MOST_STAGES)),
    ("curve", np.float64, (4, MOST_STAGES)),
])  # fmt: skip
"""A ``Tableau``, padded with zeros to ``MOST_STAGES``."""

STATE = np.dtype([
    # current value, its rate, partial derivative of the rate by time; all other fields are recomputed in each step
    *_record(np.float64, "x rates time_derivative"),
    *_record(np.float64, "atol tolerance"),  # absolute tolerance, and the tolerance at the current value
    *_record(np.float64, "next next_rates error"),  # value, rate and error estimate at the end of the attempted step
    ("increment", np.float64),  # increment of the finite difference
    ("stages", np.float64, MOST_STAGES),
    ("curve", np.float64, 4),  # dense output: x(s) = x + s (c0 + s (c1 + s (c2 + s c3))), s from 0 to 1
])  # fmt: skip
"""One state."""

EVENT = np.dtype(_record(np.float64, "start before left latest"))
"""Value of an event function: at the beginning of the step, a part of the step before that of the searched subinterval,
at its beginning, and the latest."""

SEGMENT = np.dtype(_record(np.float64, "end limit"))
"""An interval between breakpoints: its end, and the latest time at which functions may be evaluated in it [s]."""

RUN = np.dtype([
    # addresses of the functions, 0 where there is none, and of their data
    ("calls", _record(np.int64, "rates jacobian values handler account output segment_start numbers words")),
    # settings of the solver (times in s) and of the problem (see ``CompiledProblem``)
    ("settings", [
        *_record(np.float64, "rtol largest_step smallest_step fixed_step"),
        ("first_step", np.float64),  # 0: estimated from the rates
        *_record(np.int64, "may_jump differences most_steps"),
    ]),
    ("clock", [
        *_record(np.float64, "time limit"),  # current time, latest time for evaluations in the present segment [s]
        *_record(np.float64, "step rejected_step last_step"),  # step proposed, last one rejected, last one accepted [s]
        ("last_error", np.float64),  # scaled error of the last accepted step
        ("origin", np.float64),  # time from which steps of fixed length are counted [s]
        *_record(np.float64, "last_event last_jump"),  # times [s]
        *_record(np.float64, "jump_at before after"),  # time of a discontinuity [s], rate on its two sides
    ]),
    ("count", [
        *_record(np.int64, "rates jacobians factorisations steps rejected restarts event_values"),  # as in ``Work``
        ("budget", np.int64),  # steps that may still be attempted before the loop returns
        *_record(np.int64, "segment rows fixed_steps"),  # segments and rows finished; fixed steps since the origin
        # flags: the segment has begun, rates and Jacobian belong to the current state, the last attempt was rejected
        *_record(np.int64, "opened fresh_rates fresh_jacobian was_rejected"),
        # rejections in a row, discontinuities passed in a row, events without progress of time
        *_record(np.int64, "failures jumps without_progress"),
        *_record(np.int64, "fired last_fired"),  # index of the event just located, and of the one before
        # index of the state or event that a message names; index of the state on which a discontinuity depends
        *_record(np.int64, "fault_index jump_state"),
    ]),
])  # fmt: skip
"""A run, without its states: addresses, settings, times and counters."""
