"""Compiled right-hand sides that the tests of the compiled solvers share."""

from __future__ import annotations

import numpy as np

from drivetrain.solvers.compiled_function import address_of, compiled, evaluate
from drivetrain.solvers.compiled_problem import CompiledProblem


def python_rates(problem: CompiledProblem):
    """A compiled right-hand side for solvers in Python; numbers and words are a copy of the problem's."""
    address, numbers, words = address_of(problem.rates, "rates"), problem.numbers.copy(), problem.words.copy()

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        result = np.empty(problem.size)
        evaluate(address, t, np.ascontiguousarray(y), result, numbers, words)
        return result

    return rates


@compiled
def _swing(t, x, dx, p, w):
    dx[0] = x[1]
    dx[1] = -9.0 * np.sin(x[0]) + np.cos(3.0 * t)
    w[0] += 1


@compiled
def _swing_jacobian(t, x, columns, p, w):
    columns[0], columns[1] = 0.0, -9.0 * np.cos(x[0])
    columns[2], columns[3] = 1.0, 0.0
    columns[4], columns[5] = 0.0, -3.0 * np.sin(3.0 * t)


@compiled
def _van_der_pol(t, x, dx, p, w):
    dx[0] = x[1]
    dx[1] = ((1.0 - x[0] ** 2) * x[1] - x[0]) * p[0]


@compiled
def _robertson(t, x, dx, p, w):
    dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2]
    dx[2] = 3e7 * x[1] ** 2
    dx[1] = -dx[0] - dx[2]


@compiled
def _hires(t, x, dx, p, w):
    dx[0] = -1.71 * x[0] + 0.43 * x[1] + 8.32 * x[2] + 0.0007
    dx[1] = 1.71 * x[0] - 8.75 * x[1]
    dx[2] = -10.03 * x[2] + 0.43 * x[3] + 0.035 * x[4]
    dx[3] = 8.32 * x[1] + 1.71 * x[2] - 1.12 * x[3]
    dx[4] = -1.745 * x[4] + 0.43 * x[5] + 0.43 * x[6]
    dx[5] = -280.0 * x[5] * x[7] + 0.69 * x[3] + 1.71 * x[4] - 0.43 * x[5] + 0.69 * x[6]
    dx[6] = 280.0 * x[5] * x[7] - 1.81 * x[6]
    dx[7] = -dx[6]


@compiled
def _oregonator(t, x, dx, p, w):
    dx[0] = 77.27 * (x[1] + x[0] * (1.0 - 8.375e-6 * x[0] - x[1]))
    dx[1] = (x[2] - (1.0 + x[0]) * x[1]) / 77.27
    dx[2] = 0.161 * (x[0] - x[2])


@compiled
def _pushed(t, x, dx, p, w):
    """A mass pushed with p[k] in segment k, by the time it sees; the segments' ends stand first."""
    k = 0
    while k < w[0] and t >= p[k]:
        k += 1
    dx[0], dx[1] = x[1], p[w[0] + k]


def counted(jacobian: bool = False) -> CompiledProblem:
    """A driven pendulum; word 0 counts the calls of its rates."""
    return CompiledProblem(_swing, 2, jacobian=_swing_jacobian if jacobian else None)


def pushed(ends: list[float], levels: list[float]) -> CompiledProblem:
    """A unit mass under a force that jumps."""
    return CompiledProblem(_pushed, 2, np.array([*ends, *levels]), [len(ends)])


# Name: problem, start, end, wanted there, the share of it that counts [-], its source.
# Source of all four: Mazzia, Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008); Hairer, Wanner,
# Solving Ordinary Differential Equations II (1996), sections IV.1 and IV.10.
STIFF = {
    "van der Pol": (CompiledProblem(_van_der_pol, 2, np.array([1e6])), (2.0, -0.66), 2.0,
                    (1.706167732170483, -0.8928097010247975)),
    "Robertson": (CompiledProblem(_robertson, 3), (1.0, 0.0, 0.0), 1e11,
                  (2.083340149701255e-8, 8.333360770334713e-14, 0.9999999791665050)),
    "HIRES": (CompiledProblem(_hires, 8), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057), 321.8122,
              (7.371312573325668e-4, 1.442485726316185e-4, 5.888729740967575e-5, 1.175651343283149e-3,
               2.386356198831331e-3, 6.238968252742796e-3, 2.849998395185769e-3, 2.850001604814231e-3)),
    "Oregonator": (CompiledProblem(_oregonator, 3), (1.0, 2.0, 3.0), 360.0,
                   (1.000814870318523, 1228.178521549917, 132.0554942846706)),
}  # fmt: skip
