"""Exact step of a winding and its current controller while command and speed are constant.

Current I and integrator z [V] obey, within the limits of the voltage,

    L I' = V - R I - e,   V = kp (c - I) + z + f,   z' = ki (c - I)

with c the command, e the back-emf and f the feed-forward voltage. At a limit V is constant, and z is reduced by the
voltage demanded beyond the limit, over kp/ki (back-calculation), so that it does not wind up. Both cases are linear, so
each interval between two changes of the limit has an exponential solution; a change is bracketed by halving the
interval.

Reference: Astrom and Wittenmark, Computer-Controlled Systems, section 3.5 (anti-windup by back-calculation).
"""

from __future__ import annotations

import math
from typing import Any

from drivetrain.jit import kernel

# Linear stage of two states over a step with constant inputs; its matrices are computed once for many steps.
#
# For ``x' = A x + b`` over a step h the end is ``E x + h F b`` and the mean ``F x + h G b`` with
#
#     E = exp(A h),   F = (exp(A h) - 1) (A h)^-1,   G = (F - 1) (A h)^-1,
#
# They follow from the series for a small part of the step, doubled until it covers the whole step. There is no
# division, so accuracy is kept for short steps and for slow motion beside fast motion.
#
# Reference: Higham, Functions of Matrices (2008), section 10.7.4 (the phi functions), with 10.3 (scaling and squaring).

TERMS = 14  # number of terms; up to a norm of 1/2 the next one is below rounding
Matrix = tuple[float, float, float, float]  # entries row by row


@kernel
def times(a: Matrix, b: Matrix) -> Matrix:
    """The product of two matrices."""
    return (
        a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]
    )  # fmt: skip


@kernel
def held_step(a: Matrix, h: float) -> tuple[Matrix, Matrix, Matrix]:
    """E, F and G of a step."""
    doublings = 0
    while max(abs(a[0]) + abs(a[1]), abs(a[2]) + abs(a[3])) * h > 0.5 and doublings < 1000:
        h *= 0.5
        doublings += 1
    x = (a[0] * h, a[1] * h, a[2] * h, a[3] * h)
    # G is 1/2 + x/6 + x^2/24 + ..., from the smallest term on.
    second = (1.0 / TERMS, 0.0, 0.0, 1.0 / TERMS)
    for k in range(TERMS - 1, 1, -1):
        more = times(second, x)
        second = ((1.0 + more[0]) / k, more[1] / k, more[2] / k, (1.0 + more[3]) / k)
    more = times(second, x)
    first = (1.0 + more[0], more[1], more[2], 1.0 + more[3])
    more = times(first, x)
    whole = (1.0 + more[0], more[1], more[2], 1.0 + more[3])
    for _ in range(doublings):
        more = times(whole, second)
        second = (
            0.25 * (more[0] + second[0] + first[0]), 0.25 * (more[1] + second[1] + first[1]),
            0.25 * (more[2] + second[2] + first[2]), 0.25 * (more[3] + second[3] + first[3]),
        )  # fmt: skip
        more = times(whole, first)
        first = (
            0.5 * (more[0] + first[0]), 0.5 * (more[1] + first[1]), 0.5 * (more[2] + first[2]),
            0.5 * (more[3] + first[3]),
        )  # fmt: skip
        whole = times(whole, whole)
    return whole, first, second


@kernel
def put_matrix(row: Any, matrix: Matrix) -> None:
    """Write the entries of a matrix into a row of four numbers."""
    for j in range(4):
        row[j] = matrix[j]


# The current loop.


Loop = tuple[float, float, float, float, float, float, float]
SMALLEST = 1.0 / 512.0  # smallest share of the step to which a change of the limit is bracketed


@kernel
def stretch(current: float, integral: float, h: float, limit: float, loop: Loop) -> tuple[float, float, float]:
    """Current, integrator and mean current after an interval without limit (``limit`` 0) or at one limit [V]."""
    resistance, inductance, kp, ki, command, emf, forward = loop
    if limit == 0.0:
        m11, m12, m21, m22 = -(kp + resistance) / inductance, 1.0 / inductance, -ki, 0.0
        b1, b2 = (kp * command + forward - emf) / inductance, ki * command
    else:
        # With the back-calculation of z, the equation of z does not contain the current.
        m11, m12, m21, m22 = -resistance / inductance, 0.0, 0.0, -ki / kp
        b1, b2 = (limit - emf) / inductance, (limit - forward) * ki / kp
    whole, held, middle = held_step((m11, m12, m21, m22), h)
    push, drive = h * b1, h * b2
    return (
        whole[0] * current + whole[1] * integral + held[0] * push + held[1] * drive,
        whole[2] * current + whole[3] * integral + held[2] * push + held[3] * drive,
        held[0] * current + held[1] * integral + middle[0] * push + middle[1] * drive,
    )


@kernel
def flows(
    current: float, integral: float, end: float, drawn: float, mean: float, h: float, limit: float, loop: Loop
) -> tuple[float, float]:
    """Mean square current [A^2] and mean electrical power [W] of an interval, from the states at its ends.

    For y' = A y, with y the deviation from the settled state, and A' Q + Q A = -e e' (Lyapunov equation), the integral
    of the square is the decrease of y' Q y. The power is the product of the controller's voltage and the current.
    """
    resistance, inductance, kp, ki, command, emf, forward = loop
    if limit != 0.0:
        settled = (limit - emf) / resistance
        first, last = current - settled, end - settled
        lost = 0.5 * (first * first - last * last) * inductance / resistance
        return settled * (2.0 * mean - settled) + lost / h, limit * mean
    # settled value of the integrator; the current settles at the command
    settled = resistance * command + emf - forward
    first, last = current - command, end - command
    first_z, last_z = integral - settled, drawn - settled
    whole, off = kp + resistance, mean - command
    lost = 0.5 * ((first * first - last * last) * inductance + (first_z * first_z - last_z * last_z) / ki) / whole
    square = command * (2.0 * mean - command) + lost / h
    # V is R c + e when settled; kp y and z' = -ki y are the deviation.
    voltage_deviation = inductance * (last - first) / h + resistance * off
    power = (resistance * command + emf) * mean + command * voltage_deviation
    return square, power - kp * lost / h - 0.5 * (last_z * last_z - first_z * first_z) / (ki * h)


@kernel
def held_at(current: float, integral: float, volts: float, kp: float, command: float, forward: float) -> float:
    """The voltage limit that is active [V], with its sign; 0 if none is."""
    demanded = kp * (command - current) + integral + forward
    return volts if demanded > volts else -volts if demanded < -volts else 0.0


@kernel
def loop_step(
    current: float, integral: float, h: float, volts: float, loop: Loop
) -> tuple[float, float, float, float, float]:
    """Current and integrator after a step with any number of changes of the limit; mean current, mean square current
    and mean power.
    """
    kp, command, forward = loop[2], loop[4], loop[6]
    left, carried, heated, flowed, trial = h, 0.0, 0.0, 0.0, h
    while left > 0.0:
        trial = min(trial, left)
        limit = held_at(current, integral, volts, kp, command, forward)
        i, z, mean = stretch(current, integral, trial, limit, loop)
        if trial > SMALLEST * h and volts < math.inf:
            i_half, z_half, _ = stretch(current, integral, 0.5 * trial, limit, loop)
            same = held_at(i, z, volts, kp, command, forward) == limit
            if not (same and held_at(i_half, z_half, volts, kp, command, forward) == limit):
                trial *= 0.5
                continue
        square, power = flows(current, integral, i, z, mean, trial, limit, loop)
        current, integral = i, z
        carried += trial * mean
        heated += trial * square
        flowed += trial * power
        left -= trial
        trial *= 2.0
        if left <= 1e-12 * h:
            break
    return current, integral, carried / h, heated / h, flowed / h
