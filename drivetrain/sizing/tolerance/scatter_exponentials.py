"""Exponentials of many arms at once, for stages of one and of two nodes of heat."""

from __future__ import annotations

from drivetrain.sizing.tolerance.lanes import (
    Lanes,
    exponential,
    highest,
    largest_of,
    magnitude,
    njit_lanes,
    spread,
    where_less,
)

SMALL = 0.1  # norm of an exponent that is summed up as a series
SHORT = 0.05  # rate times step below which a few terms of the exponential are exact to rounding


@njit_lanes
def matrix_exponential(
    l00: Lanes, l01: Lanes, l10: Lanes, l11: Lanes, v0: Lanes, v1: Lanes, g0: Lanes, g1: Lanes
) -> tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]:
    """e^L, and what two sources v and g within it end as."""
    norm = highest(magnitude(l00), magnitude(l11)) + highest(magnitude(l01), magnitude(l10))
    halves, top, scale = 0, largest_of(norm), spread(1.0)
    while top > SMALL and halves < 60:
        top *= 0.5
        halves += 1
        scale = where_less(SMALL, norm * scale, 0.5 * scale, scale)
    l00, l01, l10, l11 = l00 * scale, l01 * scale, l10 * scale, l11 * scale
    v0, v1, g0, g1 = v0 * scale, v1 * scale, g0 * scale, g1 * scale
    m, half = 0.5 * (l00 + l11), 0.5 * (l00 - l11)
    d = half * half + l01 * l10
    # (e^x - 1)/x and its derivatives at m; even and odd part at m +- sqrt(d).
    f0 = 1.0 + m * (1 / 2 + m * (1 / 6 + m * (1 / 24 + m * (1 / 120 + m * (1 / 720 + m * (1 / 5040))))))
    f1 = 1 / 2 + m * (1 / 3 + m * (1 / 8 + m * (1 / 30 + m * (1 / 144 + m * (1 / 840)))))
    f2 = 1 / 3 + m * (1 / 4 + m * (1 / 10 + m * (1 / 36 + m * (1 / 168))))
    f3 = 1 / 4 + m * (1 / 5 + m * (1 / 12 + m * (1 / 42)))
    f4 = 1 / 5 + m * (1 / 6 + m * (1 / 14))
    f5 = 1 / 6 + m * (1 / 7)
    p = f0 + d * (0.5 * f2 + (1 / 24) * (d * f4))
    q = f1 + d * ((1 / 6) * f3 + (1 / 120) * (d * f5))
    s00, s01, s10, s11 = p + q * half, q * l01, q * l10, p - q * half
    e00, e01 = 1.0 + s00 * l00 + s01 * l10, s00 * l01 + s01 * l11
    e10, e11 = s10 * l00 + s11 * l10, 1.0 + s10 * l01 + s11 * l11
    v0, v1 = s00 * v0 + s01 * v1, s10 * v0 + s11 * v1
    g0, g1 = s00 * g0 + s01 * g1, s10 * g0 + s11 * g1
    for _ in range(halves):
        more = scale
        v0, v1 = _if_halved(more, e00 * v0 + e01 * v1 + v0, v0), _if_halved(more, e10 * v0 + e11 * v1 + v1, v1)
        g0, g1 = _if_halved(more, e00 * g0 + e01 * g1 + g0, g0), _if_halved(more, e10 * g0 + e11 * g1 + g1, g1)
        trace, cross = e00 + e11, e01 * e10
        e00, e11 = _if_halved(more, e00 * e00 + cross, e00), _if_halved(more, e11 * e11 + cross, e11)
        e01, e10 = _if_halved(more, e01 * trace, e01), _if_halved(more, e10 * trace, e10)
        scale = _if_halved(more, 2.0 * scale, scale)
    return e00, e01, e10, e11, v0, v1, g0, g1


@njit_lanes
def _if_halved(scale: Lanes, doubled: Lanes, same: Lanes) -> Lanes:
    """What is doubled where halves are left."""
    return where_less(scale, 1.0, doubled, same)


@njit_lanes
def exponential_shares(x: Lanes) -> tuple[Lanes, Lanes]:
    """``first`` and ``second`` of ``drive/exponentials.py``.

    Args:
        x: Rate times step, one number an arm [-].

    Returns:
        Both [-].
    """
    f = 1.0 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040))))))
    s = 1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040 + x * (1 / 40320))))))
    if largest_of(magnitude(x)) >= SHORT:
        long = where_less(magnitude(x), SHORT, 1.0, x)
        far = (exponential(long) - 1.0) / long
        f = where_less(magnitude(x), SHORT, f, far)
        s = where_less(magnitude(x), SHORT, s, (far - 1.0) / long)
    return f, s
