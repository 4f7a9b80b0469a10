"""A pendulum with LuGre friction on a geared motor with a winding: ``AdaptiveStep`` beside scipy's LSODA.

    python benchmarks/lugre_pendulum.py [--repeats 5]

LSODA integrates the same equations, written out and compiled here, from Python, afresh from every corner of the
voltage, which drives it to and fro for 20 s. Error is that of the position at 401 instants, over its range; of each the
cheapest tolerance counts that reaches a level, in processor time.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

import drivetrain as dt
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.motor.given import GivenVoltage
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.winding import Winding
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import Scene
from drivetrain.solvers.solver import Rodas5P

RATIO, ROTOR = 50.0, 2e-5  # kg m^2
MOTOR = dt.Motor("m", 1.0, 0.1, inductance=3e-4, rotor_inertia=ROTOR)
FRICTION = LuGreFriction(1e5, 5.0, 8.0, 0.01, 300.0, 2.0)
TIME = np.append((np.array([0.0, 0.2, 0.6, 0.9, 1.3, 1.6]) + 2.0 * np.arange(10.0)[:, None]).ravel(), 20.0)
VOLTAGE = np.append(np.tile([0.0, 12.0, 12.0, -12.0, -12.0, 0.0], 10), 0.0)
INSTANTS = np.linspace(0.0, 20.0, 401)
LEVELS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
INERTIA, WEIGHT = 0.5, 9.81  # kg m^2 and N m of 2 kg at 0.5 m, hanging down at 0
SCENE = Scene(
    dt.Inertia(INERTIA, WEIGHT, -0.5 * math.pi),
    {"joint": (ReflectedRotor(ROTOR, RATIO), Winding(MOTOR, 0.0), GivenVoltage(TIME, VOLTAGE), FRICTION)},
    float(TIME[-1]),
)


@njit
def rates(y: np.ndarray, voltage: float, result: np.ndarray) -> None:
    """Of position, speed, bend of the bristles, current."""
    q, w, bend, current = y
    slip = 5.0 + 3.0 * math.exp(-((w / 0.01) ** 2))
    bend_rate = w - 1e5 * abs(w) / slip * bend
    torque = 50.0 * 0.1 * current - 9.81 * math.sin(q) - (1e5 * bend + 300.0 * bend_rate + 2.0 * w)
    result[:] = w, torque / (0.5 + 2e-5 * 50.0**2), bend_rate, (voltage - current - 50.0 * 0.1 * w) / 3e-4


def by_lsoda(tolerance: float) -> np.ndarray:
    """Positions at the instants."""

    def asked(t: float, y: np.ndarray) -> np.ndarray:
        result = np.empty(4)
        rates(y, float(np.interp(t, TIME, VOLTAGE)), result)
        return result

    absolute = tolerance * np.array([1.0, 1.0, 1e-4, 1.0])
    state, found = np.zeros(4), [0.0]
    for first, last in pairwise(TIME):
        wanted = INSTANTS[(INSTANTS > first + 1e-12) & (INSTANTS < last + 1e-12)]
        inside = np.unique(np.append(np.minimum(wanted, last), last))
        done = solve_ivp(asked, (first, last), state, "LSODA", inside, rtol=tolerance, atol=absolute)
        state = done.y[:, -1]
        found += list(done.y[0, : len(wanted)])
    return np.array(found)


READY = plan(SCENE)


def by_drivetrain(tolerance: float) -> np.ndarray:
    """The same."""
    engine = AdaptiveStep(Rodas5P(tolerance, tolerance))
    return dt.simulate(READY, solver=engine, interval=float(INSTANTS[1]))["joint.position"]


def measured(run: Callable[[float], np.ndarray], true: np.ndarray, repeats: int) -> list[tuple[float, float]]:
    """Error and median processor time [s] of every tolerance."""
    rows = []
    for tolerance in 10.0 ** -np.arange(2.0, 10.1, 0.5):
        taken = []
        for _ in range(repeats):
            begin = time.process_time()
            found = run(float(tolerance))
            taken.append(time.process_time() - begin)
        rows.append((float(np.abs(found - true).max() / np.ptp(true)), float(np.median(taken))))
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    true = by_lsoda(1e-12)
    print(f"at 1e-11 both differ by {np.abs(by_drivetrain(1e-11) - true).max() / np.ptp(true):.1e} of the range")
    ours, other = measured(by_drivetrain, true, repeats), measured(by_lsoda, true, repeats)
    print("| error | drivetrain | LSODA | times |\n|---|---|---|---|")
    for level in LEVELS:
        a, b = (min((taken for error, taken in rows if error <= level), default=math.nan) for rows in (ours, other))
        print(f"| {level:g} | {1e3 * a:.1f} ms | {1e3 * b:.1f} ms | {b / a:.0f} |")


if __name__ == "__main__":
    main()
