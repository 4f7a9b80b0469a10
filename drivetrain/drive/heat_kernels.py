"""The compiled loops of the periodic winding temperature: exact steps of two coupled nodes.

On each interval the two temperature rises x obey x' = M x + s with constant M = [[growth - a, b], [c, -d]]. Both
exponentials come from the two real eigenvalues of M, through functions that stay exact where they nearly meet or
nearly vanish, so that neither zero-length intervals nor a momentary balance of heating and cooling need a case.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.exponentials import first, second
from drivetrain.jit import kernel, law


@law
def _integrals(step: float, m00: float, b: float, c: float, m11: float) -> tuple[float, float, float, float]:
    """Coefficients (p, q, u, v): S = p I + q (M - m I) and Q = u I + v (M - m I), m the mean of M's diagonal.

    S is the integral of e^(M t) over the step, Q the integral of S.
    """
    mean = 0.5 * (m00 + m11)
    spread = math.sqrt(0.25 * (m00 - m11) ** 2 + b * c)
    x1 = (mean + spread) * step
    x2 = (mean - spread) * step
    f1, f2 = first(x1), first(x2)
    g1, g2 = second(x1, f1), second(x2, f2)
    inverse = 0.5 / spread if spread > 0.0 else 0.0
    square = step * step
    return 0.5 * step * (f1 + f2), step * (f1 - f2) * inverse, 0.5 * square * (g1 + g2), square * (g1 - g2) * inverse


SMALL = 0.05  # rate times step below which seven terms of the exponential's series are exact to rounding


@law(error_model="numpy")
def _small(steps: Array, growth: Array, rates: Array) -> bool:
    """Whether every interval is short against every rate."""
    longest, fastest = 0.0, rates[2] + rates[3]
    for k in range(steps.size):
        longest = max(longest, steps[k])
        fastest = max(fastest, abs(growth[k] - rates[0]) + rates[1])
    return longest * fastest < SMALL


# long kernel: straight-line series, so that the loop becomes vector instructions
@law(error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _short_integrals(steps: Array, growth: Array, rates: Array, out: Array) -> None:
    """``_integrals`` of intervals that are short against every rate: rows p, q, u, v, (4, M)."""
    a, cross, d = rates[0], rates[1] * rates[2], rates[3]
    p, q, u, v = out[0], out[1], out[2], out[3]
    for k in range(len(steps)):
        h, m00 = steps[k], growth[k] - a
        y, half = 0.5 * h * (m00 - d), 0.5 * (m00 + d)
        z = h * h * (half * half + cross)
        # Even and odd parts of the powers of (y + w) and (y - w), w^2 = z, over the factorials.
        e2, o2 = y * y + z, y + y
        e3, o3 = y * e2 + z * o2, e2 + y * o2
        e4, o4 = y * e3 + z * o3, e3 + y * o3
        e5, o5 = y * e4 + z * o4, e4 + y * o4
        e6, o6 = y * e5 + z * o5, e5 + y * o5
        e7, o7 = y * e6 + z * o6, e6 + y * o6
        square = h * h
        p[k] = h * (1.0 + y / 2.0 + e2 / 6.0 + e3 / 24.0 + e4 / 120.0 + e5 / 720.0 + e6 / 5040.0 + e7 / 40320.0)
        q[k] = square * (0.5 + o2 / 6.0 + o3 / 24.0 + o4 / 120.0 + o5 / 720.0 + o6 / 5040.0 + o7 / 40320.0)
        u[k] = square * (0.5 + y / 6.0 + e2 / 24.0 + e3 / 120.0 + e4 / 720.0 + e5 / 5040.0 + e6 / 40320.0)
        v[k] = square * h * (1.0 / 6.0 + o2 / 24.0 + o3 / 120.0 + o4 / 720.0 + o5 / 5040.0 + o6 / 40320.0)


@law(error_model="numpy")
def _all_integrals(steps: Array, growth: Array, rates: Array) -> Array:
    """``_integrals`` of every interval, (4, M)."""
    out = np.empty((4, len(steps)))
    if _small(steps, growth, rates):
        _short_integrals(steps, growth, rates, out)
        return out
    for k in range(len(steps)):
        p, q, u, v = _integrals(steps[k], growth[k] - rates[0], rates[1], rates[2], -rates[3])
        out[0, k], out[1, k], out[2, k], out[3, k] = p, q, u, v
    return out


# long kernel: one pass over the cycle, split it would carry fourteen numbers from call to call
@kernel
def cycle_map(steps: Array, growth: Array, winding_source: Array, housing_source: Array, rates: Array) -> Array:
    """What one cycle does to the two temperature rises, as an affine map, and their integrals over it.

    Args:
        steps: Length of each interval [s], (M,).
        growth: Rise of the copper loss with winding temperature over winding capacity [1/s], (M,).
        winding_source: Loss at ambient temperature over winding capacity [K/s], (M,).
        housing_source: Loss in the housing over its capacity [K/s], (M,).
        rates: (a, b, c, d) of the matrix [[growth - a, b], [c, -d]] [1/s], (4,).

    Returns:
        Rows of x_end = A x_start + r and of the integral of x = B x_start + w: [A | r | B | w], (2, 6).
    """
    a, b, c, d = rates[0], rates[1], rates[2], rates[3]
    a00, a01, a10, a11, r0, r1 = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    b00, b01, b10, b11, w0, w1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    integrals = _all_integrals(steps, growth, rates)
    for k in range(steps.size):
        m00 = growth[k] - a
        half = 0.5 * (m00 + d)
        p, q, u, v = integrals[0, k], integrals[1, k], integrals[2, k], integrals[3, k]
        s00, s01, s10, s11 = p + q * half, q * b, q * c, p - q * half
        q00, q01, q10, q11 = u + v * half, v * b, v * c, u - v * half
        h0, h1 = winding_source[k], housing_source[k]
        b00, b01 = b00 + s00 * a00 + s01 * a10, b01 + s00 * a01 + s01 * a11
        b10, b11 = b10 + s10 * a00 + s11 * a10, b11 + s10 * a01 + s11 * a11
        w0 += s00 * r0 + s01 * r1 + q00 * h0 + q01 * h1
        w1 += s10 * r0 + s11 * r1 + q10 * h0 + q11 * h1
        # e^(M t) = I + S M
        e00, e01 = 1.0 + s00 * m00 + s01 * c, s00 * b - s01 * d
        e10, e11 = s10 * m00 + s11 * c, 1.0 + s10 * b - s11 * d
        a00, a10 = e00 * a00 + e01 * a10, e10 * a00 + e11 * a10
        a01, a11 = e00 * a01 + e01 * a11, e10 * a01 + e11 * a11
        r0, r1 = e00 * r0 + e01 * r1 + s00 * h0 + s01 * h1, e10 * r0 + e11 * r1 + s10 * h0 + s11 * h1
    return np.array([[a00, a01, r0, b00, b01, w0], [a10, a11, r1, b10, b11, w1]])


# long kernel: one pass over the cycle with finer steps inside long intervals
@kernel
def cycle_trace(
    steps: Array, growth: Array, winding_source: Array, housing_source: Array, rates: Array, start: Array
) -> tuple[Array, float, float]:
    """The two temperature rises at the ends of all intervals, and the largest winding rise also inside them.

    Args:
        steps: Length of each interval [s], (M,).
        growth: As in ``cycle_map`` [1/s], (M,).
        winding_source: As in ``cycle_map`` [K/s], (M,).
        housing_source: As in ``cycle_map`` [K/s], (M,).
        rates: As in ``cycle_map`` [1/s], (4,).
        start: Rises at the start [K], (2,).

    Returns:
        Rises (M + 1, 2) [K]; the largest winding rise [K]; the time from the start at which it occurs [s].
    """
    a, b, c, d = rates[0], rates[1], rates[2], rates[3]
    rises = np.empty((steps.size + 1, 2))
    x0, x1 = start[0], start[1]
    rises[0, 0], rises[0, 1] = x0, x1
    peak, peak_time, time = x0, 0.0, 0.0
    integrals = _all_integrals(steps, growth, rates)
    for k in range(steps.size):
        m00 = growth[k] - a
        half = 0.5 * (m00 + d)
        pieces = 1 + int(min(511.0, 5.0 * steps[k] * (a + d)))  # a fifth of the shorter time constant
        step, p, q = steps[k], integrals[0, k], integrals[1, k]
        if pieces > 1:
            step = steps[k] / pieces
            p, q, _, _ = _integrals(step, m00, b, c, -d)
        s00, s01, s10, s11 = p + q * half, q * b, q * c, p - q * half
        for _ in range(pieces):
            f0 = m00 * x0 + b * x1 + winding_source[k]
            f1 = c * x0 - d * x1 + housing_source[k]
            x0, x1 = x0 + s00 * f0 + s01 * f1, x1 + s10 * f0 + s11 * f1
            time += step
            if x0 > peak:
                peak, peak_time = x0, time
        rises[k + 1, 0], rises[k + 1, 1] = x0, x1
    return rises, peak, peak_time
