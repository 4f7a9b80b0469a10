"""Sums of products of sines and cosines as polynomials in a unique normal form, with sympy's sparse polynomial rings.

Sympy multiplies and differentiates such polynomials a hundred times faster than expressions. ``sin^2`` is always
replaced by ``1 - cos^2``, so that equal polynomials are identical and terms cancel without any simplification.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from sympy import QQ, RR, Add, Expr, Float, Rational, cos, sin
from sympy.polys.rings import PolyElement, ring

from drivetrain.arrays import Array

# Relative difference up to which a number is taken as a short decimal or fraction: rounding of sums and rotations.
ROUNDING = 5e-15
NOTHING = 1e-15  # numbers below this are zero, such as the rounded cosine of a right angle
SIGNIFICANT = 10  # largest number of digits of a short decimal, as data sheets and files print them
DENOMINATOR = 1000  # largest denominator of fractions such as 1/3
VANISHED = 1e-13  # coefficients below this share of the largest one are rounding of zero


def exact(value: float) -> Fraction | None:
    """The short decimal or fraction that a float approximates, such as 1/10, 0 or 1/3; None if there is none."""
    if abs(value) <= NOTHING:
        return Fraction(0)
    for found in (Fraction(f"{value:.{SIGNIFICANT}g}"), Fraction(value).limit_denominator(DENOMINATOR)):
        if abs(float(found) - value) <= ROUNDING * abs(value):
            return found
    return None


class Trigonometry:
    """Polynomials in positions, and in sines and cosines of angles that are linear combinations of positions.

    ``factors`` are the coefficients of each angle, one per variable; if all numbers are short decimals or fractions
    (``rational``), the arithmetic is exact.
    """

    def __init__(self, variables: Sequence[Any], factors: Sequence[Sequence[float]], rational: bool):
        self.variables, self.factors, self.rational = tuple(variables), tuple(factors), rational
        names = [f"x{i}" for i in range(len(variables))]
        names += [f"{kind}{i}" for i in range(len(factors)) for kind in "sc"]
        self.ring, *self.generators = ring(names, QQ if rational else RR)

    def number(self, value: float) -> PolyElement:
        """A constant as a polynomial."""
        short = exact(value)
        if self.rational and short is not None:
            return self.ring(QQ(short.numerator, short.denominator))
        return self.ring(float(value) if short is None else float(short))

    def position(self, variable: int) -> PolyElement:
        """A variable as a polynomial [rad or m]."""
        return self.generators[variable]

    def sine_cosine(self, angle: int) -> tuple[PolyElement, PolyElement]:
        """Sine and cosine of an angle as polynomials [-]."""
        first = len(self.variables) + 2 * angle
        return self.generators[first], self.generators[first + 1]

    def slope(self, value: PolyElement, variable: int) -> PolyElement:
        result = value.diff(self.position(variable))
        for angle, factors in enumerate(self.factors):
            if factors[variable]:
                s, c = self.sine_cosine(angle)
                result += (value.diff(s) * c - value.diff(c) * s) * self.number(factors[variable])
        return result

    def shortened(self, value: PolyElement) -> PolyElement:
        """The normal form without squares of sines; terms that are rounding of zero are dropped."""
        result, largest = self.ring(0), 0.0
        for powers, coefficient in value.terms():
            kept, rest = list(powers), self.ring(coefficient)
            largest = max(largest, abs(float(coefficient)))
            for angle in range(len(self.factors)):
                place = len(self.variables) + 2 * angle
                _, c = self.sine_cosine(angle)
                if kept[place] > 1:
                    rest *= (1 - c**2) ** (kept[place] // 2)
                    kept[place] %= 2
            result += rest.mul_monom(tuple(kept))
        if self.rational:
            return result
        return self.ring.from_dict({p: x for p, x in result.items() if abs(float(x)) > VANISHED * largest})

    def expression(self, value: PolyElement, *, sums: bool) -> Expr:
        """A polynomial as an expression in sympy's symbols; with ``sums`` in sines and cosines of sums if shorter."""
        angles = [
            Add(*(_letter(factor) * x for factor, x in zip(factors, self.variables, strict=True) if factor))
            for factors in self.factors
        ]
        shown = [*self.variables, *(f(a) for a in angles for f in (sin, cos))]
        products = value.as_expr(*shown)
        if not sums:
            return products
        summed = self._summed(value, angles)
        return summed if summed.count_ops() < products.count_ops() else products

    def _summed(self, value: PolyElement, angles: list[Expr]) -> Expr:
        """The polynomial as a sum of sines and cosines of sums of the angles."""
        domain = self.ring.domain
        total: dict[tuple[Any, ...], Any] = {}
        for powers, coefficient in value.terms():
            waves = {(True, (0,) * len(angles)): coefficient}
            for place, power in enumerate(powers[len(self.variables) :]):
                for _ in range(power):
                    waves = _times(waves, place // 2, place % 2 == 1, domain)
            outside = powers[: len(self.variables)]
            for wave, share in waves.items():
                total[(outside, *wave)] = total.get((outside, *wave), domain.zero) + share
        largest = max((abs(float(share)) for share in total.values()), default=0.0)
        terms = []
        for (outside, even, multiples), share in total.items():
            if share and (self.rational or abs(float(share)) > VANISHED * largest):
                angle = Add(*(k * a for k, a in zip(multiples, angles, strict=True)))
                term = domain.to_sympy(share) * (cos(angle) if even else sin(angle))
                for x, power in zip(self.variables, outside, strict=True):
                    term *= x**power
                terms.append(term)
        return Add(*terms)


def _times(waves: dict[Any, Any], angle: int, cosine: bool, domain: Any) -> dict[Any, Any]:
    """Cosines (True) and sines (False) of integer combinations of the angles, times a further cosine or sine."""
    half = domain.one / 2
    result: dict[Any, Any] = {}
    for (even, multiples), share in waves.items():
        for step in (1, -1):
            moved = (*multiples[:angle], multiples[angle] + step, *multiples[angle + 1 :])
            # cos a sin b = (sin(a+b) - sin(a-b)) / 2 and sin a sin b = (cos(a-b) - cos(a+b)) / 2.
            sign = 1 if cosine else (step if even else -step)
            kind = even if cosine else not even
            lead = next((k for k in moved if k), 0)
            if lead < 0:
                moved, sign = tuple(-k for k in moved), sign if kind else -sign
            if kind or lead:
                result[(kind, moved)] = result.get((kind, moved), domain.zero) + share * half * sign
    return result


def _letter(factor: float) -> Expr:
    short = exact(factor)
    return Rational(short.numerator, short.denominator) if short is not None else Float(factor)


def all_exact(arrays: Sequence[Array | float]) -> bool:
    """Whether every number is a short decimal or fraction."""
    return all(exact(float(x)) is not None for array in arrays for x in _flat(array))


def _flat(array: Array | float) -> Sequence[float]:
    return [float(array)] if isinstance(array, float) else [float(x) for x in array.ravel()]
