"""What the compiled loop works on: records with names, and the arrays of them."""

from __future__ import annotations

import numpy as np

# Why the loop came back.
DONE, PAUSED, TOO_MANY, NO_NUMBER, RUNS_AWAY, TOO_SHORT, JUMP, ZENO = range(8)

MOST_STAGES = 8


def _record(kind: type, names: str) -> list[tuple[str, type]]:
    return [(name, kind) for name in names.split()]


METHOD = np.dtype([
    ("adaptive", np.int64), ("order", np.float64), ("reuses", np.int64), ("gamma", np.float64), ("stages", np.uint64),
    ("times", np.float64, MOST_STAGES), ("gammas", np.float64, MOST_STAGES), ("error", np.float64, (1, MOST_STAGES)),
    ("a", np.float64, (MOST_STAGES + 1, MOST_STAGES)), ("c", np.float64, (MOST_STAGES, MOST_STAGES)),
    ("curve", np.float64, (4, MOST_STAGES)),
])  # fmt: skip
"""A ``Tableau``, zeros behind its own stages."""

STATE = np.dtype([
    *_record(np.float64, "x rates drift"),  # now, its rate, that rate's derivative by time; all else is found anew
    *_record(np.float64, "atol tolerance"),  # error allowed in a step near zero, and here
    *_record(np.float64, "next next_rates error"),  # at the end of the step tried
    ("move", np.float64),  # by which differences are taken
    ("stages", np.float64, MOST_STAGES),
    ("curve", np.float64, 4),  # within the step: x(s) = x + s (c0 + s (c1 + s (c2 + s c3))), s from 0 to 1
])  # fmt: skip
"""One a state."""

EVENT = np.dtype(_record(np.float64, "old later new"))
"""Values of an event: at the beginning of the step, of the search in it, and where asked last."""

SEGMENT = np.dtype(_record(np.float64, "end limit"))
"""One from breakpoint to breakpoint: its end, and the last instant that it may see [s]."""

RUN = np.dtype([
    # addresses of functions, 0 for none, and of their data
    ("calls", _record(np.int64, "rates jacobian values handler account tell opens numbers words")),
    # of the solver, times in s, and of the problem, see ``CompiledProblem``
    ("settings", [
        *_record(np.float64, "rtol largest_step smallest_step fixed_step"),
        ("first_step", np.float64),  # 0: chosen from the rates
        *_record(np.int64, "may_jump differences most_steps"),
    ]),
    ("clock", [
        *_record(np.float64, "time limit"),  # now, and the last instant that the present segment may see [s]
        *_record(np.float64, "step refused last_step"),  # proposed, the last one refused, the last one kept [s]
        ("last_error", np.float64),  # of the last step kept
        ("origin", np.float64),  # from which steps of fixed length are counted [s]
        *_record(np.float64, "last_event last_jump"),  # [s]
        *_record(np.float64, "jump_at before after"),  # where a rate jumps [s], from what to what
    ]),
    ("count", [
        *_record(np.int64, "rates jacobians factorisations steps rejected restarts event_values"),  # what it cost
        ("budget", np.int64),  # steps that may still be tried before the loop comes back
        *_record(np.int64, "segment rows strides"),  # segments and rows done; steps since the origin
        *_record(np.int64, "opened fresh fresh_jacobian was_rejected"),  # flags
        *_record(np.int64, "failures jumps busy"),  # refusals in a row, jumps, events without progress of time
        *_record(np.int64, "fired last_fired"),  # the event just found, and the one before
        *_record(np.int64, "culprit argument"),  # the state, or event, to name; the state whose move makes a jump
    ]),
])  # fmt: skip
"""A run without its states."""
