"""Where the compiled solvers keep what: rows of the block of states, the clock, the counters, the reasons to stop."""

from __future__ import annotations

# Rows of the block: vectors of the length of the state, and nothing else survives between two calls of the kernel.
X, F0, FT, U1, U2, U3, U4, U5, U6, F1 = range(10)  # state, rates at it, df/dt, stages; rates at the end (explicit)
STAGE, RATES_AT, NEXT, ERROR, C1, C2, C3, C4, INNER, PROBE, TOLERANCE, U7, U8 = range(10, 23)
BLOCK_ROWS = 23

# Addresses.
RIGHT_SIDE, JACOBIAN, VALUES, HANDLER, ACCOUNT, TELL, OPENS, STEPPER = range(8)

# The clock, float64.
TIME, STEP, LAST_STEP, LAST_ERROR, ORIGIN, LAST_EVENT, BEFORE, AFTER, JUMP_AT, LAST_JUMP, LIMIT = range(11)
CLOCK_SIZE = 11

# Settings, float64.
RTOL, LARGEST, SMALLEST, FIRST, FIXED, MAY_JUMP = range(6)
SETTINGS_SIZE = 6

# Counters and flags, int64.
RATES, JACOBIANS, FACTORISATIONS, STEPS, REJECTED, RESTARTS, EVENT_VALUES, EVENTS = range(8)
SEGMENT, ROWS, STRIDES, LOGGED, OPEN, FRESH, FRESH_JACOBIAN, CULPRIT, BUSY, FAILURES, ARGUMENT, WAS_REJECTED = range(
    8, 20
)
BUDGET, MOST_STEPS, SEGMENT_WORD, FIRED, STARTED, LAST_FIRED, JUMPS, DIFFERENCES = range(20, 28)
COUNT_SIZE = 28

# Methods.
RODAS4, RODAS5P, DORMAND_PRINCE, RUNGE_KUTTA, EULER = range(5)

# Kinds of events: which way the value must cross zero, or that it must never be negative.
FALLING, EITHER, RISING, GUARD = -1, 0, 1, 2

# Why the kernel came back.
DONE, PAUSED, TERMINAL, TOO_MANY, NO_NUMBER, RUNS_AWAY, TOO_SHORT, JUMP, ZENO = range(9)
