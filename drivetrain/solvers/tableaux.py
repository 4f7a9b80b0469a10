"""The integration methods as tableaux: one form for Rosenbrock methods and for explicit Runge-Kutta methods.

A Rosenbrock method, in the form without matrix-vector products, solves for each stage s with W = 1/(h gamma) - J

    W u_s = f(t + times_s h, x + sum_j a_sj u_j) + sum_j c_sj u_j / h + gammas_s h df/dt.

An explicit method has gamma = 0 and u_s = h f(t + times_s h, x + sum_j a_sj u_j). For both, the result is
x + sum_j a_Sj u_j with the last row of a, and the error estimate is sum_j error_j u_j. The dense output is a polynomial
of order 4 with the coefficients curve @ u, where the difference between both ends of the step is added to the first.
A test checks the tables against the order conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.solvers.records import METHOD


@dataclass(frozen=True, eq=False)
class Tableau:
    """The coefficients of a method with S stages."""

    adaptive: bool  # whether it has an error estimate, for step size control
    order: float  # the error of a step grows with this power of its length; the exponent of step size control
    reuses: bool  # whether the last stage is the rates at the end of the step, so that the next step needs no first one
    gamma: float  # 0 for an explicit method
    # (S,)
    times: Array
    gammas: Array
    error: Array  # (1, S)
    a: Array  # (S + 1, S)
    c: Array  # (S, S)
    curve: Array  # (4, S)

    @cached_property
    def record(self) -> Any:
        """The coefficients for compiled code, a record ``records.METHOD``, (1,)."""
        made = np.zeros(1, dtype=METHOD)
        made["stages"] = len(self.times)
        for name, value in vars(self).items():
            entry = made[name][0]
            if isinstance(value, np.ndarray):
                entry[tuple(slice(n) for n in value.shape)] = value
            else:
                made[name] = value
        return made


Rows = tuple[tuple[float, ...], ...]


def _lower_triangle(rows: Rows, count: int, width: int) -> Array:
    """A lower triangular table, (count, width), from its last rows; zeros elsewhere."""
    table = np.zeros((count, width))
    for i, row in enumerate(rows, start=count - len(rows)):
        table[i, : len(row)] = row
    return table


def _rosenbrock(
    order: float, gamma: float, times: tuple[float, ...], gammas: tuple[float, ...], a: Rows, c: Rows, d: Rows
) -> Tableau:
    """The tableau of a stiffly accurate Rosenbrock method whose last stage is the error estimate.

    Each of its last stages is evaluated at the state of the stage before it plus that stage's u. The dense output is
    y(s) = (1-s) y_0 + s (y_1 + (1-s) (B_1 + s (B_2 + ...))) with B_k = sum_j d_kj u_j.
    """
    stages = len(c) + 1
    while len(a) < stages:
        a = (*a, (*a[-1], 1.0))
    weights, curve = _lower_triangle(a, stages + 1, stages), np.zeros((5, stages))
    for k, row in enumerate(d):
        curve[k, : len(row)] += row
        curve[k + 1, : len(row)] -= row
    error = np.zeros((1, stages))
    error[0, -1] = 1.0
    all_times = np.array([*times, *[1.0] * (stages - len(times))])
    all_gammas = np.array([*gammas, *[0.0] * (stages - len(gammas))])
    c_table = _lower_triangle(c, stages, stages)
    return Tableau(True, order, False, gamma, all_times, all_gammas, error, weights, c_table, curve[:4].copy())


def _explicit(order: float, times: Array, a: Array, error: Array, curve: Array, *, reuses: bool) -> Tableau:
    """The tableau of an explicit Runge-Kutta method.

    ``curve`` gives the whole dense output, (4, S); the rise over the step, which ``take_step`` adds, is taken off it.
    """
    curve = curve.copy()
    curve[0] -= a[-1]
    stages = len(times)
    no_c = np.zeros((stages, stages))
    adaptive = bool(error.any())
    return Tableau(adaptive, order, reuses, 0.0, times, np.zeros(stages), error.reshape(1, -1), a, no_c, curve)


RODAS4 = _rosenbrock(
    4.0, 0.25, (0.0, 0.386, 0.21, 0.63), (0.25, -0.1043, 0.1035, -0.03620000000000023),
    (
        (1.544,),
        (0.9466785280815826, 0.2557011698983284),
        (3.314825187068521, 2.896124015972201, 0.9986419139977817),
        (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    ),
    (
        (-5.6688,),
        (-2.430093356833875, -0.2063599157091915),
        (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
        (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
        (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
    ),
    (
        (10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662),
        (-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872),
    ),
)  # fmt: skip
"""Order 4 with an embedded error estimate of order 3, L-stable.

Reference: Hairer, Wanner, Solving Ordinary Differential Equations II (1996), section IV.7 and the program RODAS.
"""

RODAS5P = _rosenbrock(
    5.0, 0.21193756319429014,
    (0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664),
    (0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069),
    (
        (3.0,),
        (2.849394379747939, 0.45842242204463923),
        (-6.954028509809101, 2.489845061869568, -10.358996098473584),
        (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
        (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946),
    ),
    (
        (-14.155112264123755,),
        (-17.97296035885952, -2.859693295451294),
        (147.12150275711716, -1.41221402718213, 71.68940251302358),
        (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
        (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
        (30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
         -28.087943162872662),
        (37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
         -54.66780262877968, -9.48861652309627),
    ),
    (
        (25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
         1.1241088310450404, 0.4272876194431874, -0.17202221070155493),
        (-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
         15.98066361424651, -6.789040303419874, -6.710236069923372),
        (11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
         -59.78993625266729, -0.15582684282751913, 4.883087185713722),
    ),
)  # fmt: skip
"""Order 5 with an embedded error estimate of order 4, L-stable; its dense output is of order 4.

Reference: Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia
Differential Equations package, BIT Numerical Mathematics 63 (2023) 27; the digits as its author's code ships them.
"""


@cache
def dormand_prince() -> Tableau:
    """The explicit method of order 5 with an embedded error estimate of order 4, with scipy's coefficients.

    Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), table II.5.2.
    """
    from scipy.integrate import RK45  # imported here: the import is slow, and few runs need it

    a = np.pad(np.vstack([np.pad(RK45.A, ((0, 0), (0, 1))), RK45.B, RK45.B]), ((0, 0), (0, 1)))
    return _explicit(5.0, np.append(RK45.C, 1.0), a, RK45.E.copy(), np.ascontiguousarray(RK45.P.T), reuses=True)


_WEIGHTS = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
RUNGE_KUTTA = _explicit(
    4.0, np.array([0.0, 0.5, 0.5, 1.0, 1.0]),
    _lower_triangle(((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0), _WEIGHTS, _WEIGHTS), 6, 5), np.zeros(5),
    np.array([
        (1.0, 0.0, 0.0, 0.0, 0.0),
        (-1.5, 1.0, 1.0, 0.5, -1.0),
        (2.0 / 3.0, -2.0 / 3.0, -2.0 / 3.0, -1.0 / 3.0, 1.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ]), reuses=True,
)  # fmt: skip
"""The classical method of order 4, with cubic Hermite dense output.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), table II.1.2.
"""

EULER = _explicit(
    1.0, np.zeros(1), np.array([(0.0,), (1.0,)]), np.zeros(1), np.array([(1.0,), (0.0,), (0.0,), (0.0,)]), reuses=False
)
"""Reference: Modern Robotics, section 8.5, Euler integration algorithm."""
