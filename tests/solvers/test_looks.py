"""Events look by look: every instant at which a run asks for their values, by the search for them written out plainly.

Steps are of a fixed length and the states polynomials that they hold exactly. The search is regula falsi with the
weight of an end that stays halved (Illinois: Dowell and Jarratt, BIT 11 (1971) 168), every third time a halving, on the
step's polynomial; then Newton's method on the length of the step itself. What was answered is taken from the run, so
that rounding does not add up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from drivetrain.solvers.compiled_function import compiled
from drivetrain.solvers.compiled_problem import CompiledProblem, Events
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import RungeKutta4

STEP, END, KINDS = 0.05, 1.0, 6
WIDTH = KINDS + 2  # of a row: whether the handler was called, the instant, the values or flags


@compiled
def _clock(t, x, dx, p, w):
    dx[0], dx[1] = 1.0, x[0]


@compiled
def _values(t, x, values, p, w):
    values[0] = w[1] * (t - 0.31) * (t - 0.33) * (t - 0.35)
    values[1] = 0.7 - x[0] if w[2] else 1.0
    values[2] = w[3] * t * (0.51 - t)  # nothing at the beginning, and rises first
    values[3] = -t if w[4] else 1.0  # nothing at the beginning, and falls at once
    values[4] = math.exp(0.3) - math.exp(x[1]) if w[5] else 1.0  # of the other state; bent
    values[5] = (0.83 - t) * (1.0 + 1e4 * (t - 0.80) ** 4) ** 2 if w[6] else 1.0  # steep on one side alone
    row = 8 * w[0]
    p[row], p[row + 1] = 0.0, t
    for k in range(6):
        p[row + 2 + k] = values[k]
    w[0] += 1


@compiled
def _handler(t, x, crossed, p, w):
    row = 8 * w[0]
    p[row], p[row + 1] = 1.0, t
    for k in range(6):
        p[row + 2 + k] = crossed[k]
        if crossed[k] != 0.0:
            w[1 + k] = -w[1 + k] if k in (0, 2) else 0
    w[0] += 1


class Reader:
    """What the run asked for, row after row, beside what is expected next."""

    def __init__(self, rows: np.ndarray) -> None:
        self.rows: Iterator[np.ndarray] = iter(rows)

    def look(self, t: float, handled: float = 0.0) -> list[float]:
        row = next(self.rows)
        assert row[0] == handled and abs(row[1] - t) <= 1e-14, (row, t)
        return [float(x) for x in row[2:]]

    def leaves(self, t: float, h: float, k: int) -> tuple[float, float]:
        """Where a value that is nothing at the beginning has risen, and to what."""
        rest = 4.0 * abs(self.look(t)[k])
        for power in range(2, 15, 2):
            value = self.look(t + 10.0**-power * h)[k]
            if value > rest:
                return 10.0**-power, value
        return 0.0, 0.0

    def root(self, t: float, h: float, k: int, ends: tuple[float, float], values: tuple[float, float]) -> float:
        (a, b), (u, v), kept = ends, values, ""
        for turn in range(1, 160):
            if b - a <= 4e-16 * max(t / h, 1.0):
                return b
            at = (a * v - b * u) / (v - u) if turn % 3 else math.inf
            if not a < at < b:
                at = math.sqrt(a * b) if 0.0 < 4.0 * a < b else (a + b) / 2.0
            row = next(self.rows)
            assert row[0] == 0.0 and row[1] == pytest.approx(t + at * h, rel=0.0, abs=1e-13 + 1e-9 * (b - a) * h)
            value = float(row[2 + k])
            if value == 0.0:
                return at
            if value > 0.0:
                a, u, v, kept = at, value, v / 2.0 if kept == "right" else v, "right"
            else:
                b, v, u, kept = at, value, u / 2.0 if kept == "left" else u, "left"
        return b

    def dip(self, t: float, h: float, k: int, middle: float, three: tuple[float, float, float]) -> tuple[float, float]:
        """Where the parabola through three values that are positive is lowest, and what is found there."""
        curve = np.polynomial.Polynomial.fit([-1.0, 0.0, 1.0], three, 2, domain=[-1.0, 1.0])
        bend = float(curve.deriv(2)(0.0))
        at = float(-curve.deriv()(0.0) / bend) if bend > 0.0 else math.inf
        if not three[0] > 1e-9 * three[1] > 0.0 or three[2] < 0.0 or not abs(at) < 1.0 or curve(at) >= 0.0:
            return 2.0, 0.0
        return middle + 0.25 * at, self.look(t + (middle + 0.25 * at) * h)[k]

    def first(self, t: float, h: float, old: list[float]) -> tuple[float, int, list[float]]:
        """The share of a step at which the first event lies, which, and the values last seen."""
        found: list[tuple[float, int]] = []
        older = [-1.0] * KINDS
        for end in (0.25, 0.5, 0.75, 1.0):
            new = self.look(t + end * h)
            for k in range(KINDS):
                low, high, before, after = end - 0.25, end, old[k], new[k]
                if after >= 0.0 or (before <= 0.0 and after >= before):
                    high, after = self.dip(t, h, k, low, (older[k], before, after))
                    if after >= 0.0:
                        continue
                    low, before = (low, before) if high >= low else (low - 0.25, older[k])
                if before <= 0.0 and end == 0.25:
                    low, before = self.leaves(t, h, k)
                found.append((low if before <= 0.0 else self.root(t, h, k, (low, high), (before, after)), k))
            if found:
                break
            older, old = old, new
        return (*min(found, default=(2.0, -1), key=lambda pair: pair[0]), new)

    def closer(self, t: float, h: float, whole: float, k: int) -> float:
        """The length of a step that ends at an event, by Newton's method."""
        done = False
        for _ in range(3):
            if done:
                break
            reached, short = self.look(t + h)[k], self.look(t + (1.0 - 1e-4) * h)[k]
            shift = -reached * 1e-4 * h / (reached - short) if reached != short else 0.0
            longer = min(h + shift, whole)
            if abs(shift) >= 0.1 * h or abs(shift) <= 2.0**-52 * max(t, h) or longer == h:
                break
            done, h = abs(shift) < 1e-3 * h, longer
        return h


@pytest.mark.parametrize("end", [END, 0.93])
def test_every_look_of_a_run(end: float) -> None:
    words = np.array([0, -1, 1, 1, 1, 1, 1])
    problem = CompiledProblem(
        _clock, 2, np.zeros(WIDTH * 400), words, events=Events(_values, _handler, tuple("abcdef"))
    )
    run = integrate_compiled(problem, RungeKutta4(STEP), [0.0, 0.0], [0.0, end])
    rows = run.checkpoint.numbers.reshape(-1, WIDTH)[: run.checkpoint.words[0]]
    reader = Reader(rows)
    old, t, origin, strides, fired = reader.look(0.0), 0.0, 0.0, 0, []
    assert min(old) >= 0.0
    while t < end:
        h = origin + (strides + 1) * STEP - t
        h = end - t if t + h >= end - 1e-9 * STEP else h
        share, k, new = reader.first(t, h, old)
        if share > 1.0:
            t, strides, old = (end if t + h >= end - 1e-12 else t + h), strides + 1, new
            continue
        if share > 0.0:
            t = min(t + reader.closer(t, share * h, h, k), end)
        values = reader.look(t)
        flags = reader.look(t, 1.0)
        assert flags == [-1.0 if j == k or value < 0.0 else 0.0 for j, value in enumerate(values)]
        old, origin, strides = reader.look(t), t, 0
        fired.append((k, t))
    assert [k for k, _ in fired] == [3, 0, 0, 0, 2, 1, 4, 5]
    wanted = [0.0, 0.31, 0.33, 0.35, 0.51, 0.7, math.sqrt(0.6), 0.83]
    np.testing.assert_allclose([t for _, t in fired], wanted, atol=1e-14)
    assert next(reader.rows, None) is None and run.work.event_values == len(rows) - len(fired)
