"""Polynomials in sines and cosines: short numbers, derivatives and normal form, against sympy."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from sympy import cos, diff, lambdify, sin, symbols

from drivetrain.dynamics.book.trigonometric import Trigonometry, all_exact, exact

X, Y = symbols("q1 q2", real=True)


def algebra(rational: bool = True) -> Trigonometry:
    """Angles q1, q2 and 7/2 q1."""
    return Trigonometry((X, Y), [(1.0, 0.0), (0.0, 1.0), (3.5, 0.0)], rational)


@pytest.mark.parametrize(
    ("value", "short"),
    [(0.1, "1/10"), (0.00125, "1/800"), (1 / 3, "1/3"), (-9.81, "-981/100"), (6.1e-17, "0"), (0.1 + 0.2, "3/10"),
     (2e-7, "1/5000000"), (-160.0, "-160"), (1.0 - 1e-16, "1")],
)  # fmt: skip
def test_short_numbers(value: float, short: str) -> None:
    assert exact(value) == Fraction(short)


@pytest.mark.parametrize("value", [np.pi, np.sqrt(0.5), 0.12345678901234, 1e-12 * np.pi])
def test_numbers_that_are_not_short(value: float) -> None:
    assert exact(value) is None
    assert not all_exact([np.array([1.0, value])]) and all_exact([np.eye(2), 0.5])


def pieces(a: Trigonometry) -> list[object]:
    (s1, c1), (s2, c2), (s3, c3) = (a.sine_cosine(i) for i in range(3))
    x, half = a.position(0), a.number(0.5)
    return [
        s1**2 + c1**2,
        s1**4 - c1**4 + 2 * c1**2 - 1,
        s1 * c2 + c1 * s2,
        x**2 * s1 * s3 * c2 - half * c3**3,
        (s1 * c2 - 3 * x * s2**3) ** 2,
    ]


def letters(a: Trigonometry, value: object) -> object:
    """The polynomial as an expression, term by term, without simplification."""
    shown = [X, Y, *(f(w) for w in (X, Y, 3.5 * X) for f in (sin, cos))]
    return value.as_expr(*shown)


@pytest.mark.parametrize("rational", [True, False])
@pytest.mark.parametrize("case", range(5))
def test_every_form_has_the_same_values(case: int, rational: bool) -> None:
    a = algebra(rational)
    value = pieces(a)[case]
    at = np.random.default_rng(case).uniform(-2, 2, (2, 9))
    wanted = np.broadcast_to(lambdify((X, Y), letters(a, value))(*at), 9)
    short = a.shortened(value)
    for sums in (True, False):
        found = lambdify((X, Y), a.expression(short, sums=sums))(*at)
        np.testing.assert_allclose(np.broadcast_to(found, 9), wanted, atol=1e-12)
    for k, letter in enumerate((X, Y)):
        slope = np.broadcast_to(lambdify((X, Y), diff(letters(a, value), letter))(*at), 9)
        found = lambdify((X, Y), a.expression(a.shortened(a.slope(value, k)), sums=True))(*at)
        np.testing.assert_allclose(np.broadcast_to(found, 9), slope, atol=1e-11)


def test_terms_that_cancel_are_removed() -> None:
    a = algebra()
    found = [a.expression(a.shortened(value), sums=True) for value in pieces(a)]
    assert found[0] == 1 and found[1] == 0
    assert found[2] == sin(X + Y)
    rounded = algebra(rational=False)
    s, c = rounded.sine_cosine(0)
    noise = rounded.number(np.sqrt(2.0)) * (s**2 + c**2) - rounded.number(np.sqrt(2.0) + 2e-16)
    assert rounded.shortened(noise) == 0
