"""Laws that jump, handed to an engine that controls its error; and friction with bristles, far stiffer than a step."""

from __future__ import annotations

import math

import numpy as np
from hard_case import Figure, hard_case
from jumping_laws import Sign, Step, oscillator_rates
from scipy.integrate import solve_ivp

from drivetrain.drive.friction import Friction
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene, joint_scene
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import Rodas4


def oscillator(effect: Effect) -> Scene:
    """That of T01."""
    return joint_scene(1.0, [effect, WallSpring(100.0)], 3.0, position=0.103)


@hard_case(
    "T09",
    "A discontinuous law in the adaptive engine",
    setup=(
        "The friction torque sign(speed) of an oscillator, as an effect and as a bare function, must be "
        "refused; a torque with an undeclared step in time must be resolved by short steps."
    ),
    naive="scipy's BDF with tolerances of 1e-6 and 1e-8 on sign(speed), which reports success",
)
def test_jumps_are_refused() -> list[Figure]:
    run = simulate(oscillator(Sign()), solver=Rodas4(1e-6))
    told = run.stopped_by
    named = told is not None and all(words in told.detail for words in ("joint.speed", "set-valued law of friction"))
    passed_on = int(not named or told.name != "jump")
    # A jump in time that the state only passes through is found, and passed with short steps.
    run = simulate(oscillator(Step()), solver=Rodas4(1e-6))
    swing = complex(0.113 * math.cos(3.0), -1.13 * math.sin(3.0)) - complex(0.06, 0.0)  # about -1/100, then 5/100
    exact = 0.05 + swing.real * math.cos(27.0) + swing.imag / 10.0 * math.sin(27.0)
    passed_on += int(run.stopped_by is not None or abs(run["joint.position"][-1] - exact) > 1e-5)
    function = oscillator_rates
    given = integrate_compiled(CompiledProblem(function, 2), Rodas4(1e-6), [0.103, 0.0], [0.0, 3.0])
    passed_on += int("jumps" not in given.stopped)
    # The same as a bound is no jump at all.
    right = simulate(oscillator(DryFriction(Friction(coulomb=1.0))), solver=Rodas4(1e-6))

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -100.0 * y[0] - float(np.sign(y[1]))]

    off = []
    for rtol in (1e-6, 1e-8):
        run = solve_ivp(rates, (0.0, 3.0), [0.103, 0.0], method="BDF", rtol=rtol, atol=1e-3 * rtol)
        off.append(abs(run.y[0, -1] + 0.003) if run.success else 0.0)
    return [
        Figure("discontinuities handled incorrectly, of 3", float(passed_on), float(np.count_nonzero(off)),
               at_most=0.0),
        Figure("error of the stop position with Coulomb friction as an effect",
               abs(right["joint.position"][-1] + 0.003), max(off), at_most=1e-5, unit="rad"),
    ]  # fmt: skip


@hard_case(
    "T10",
    "LuGre friction with bristles of 1e6 N m/rad",
    setup="LuGre friction stops the oscillator of T01. E1 at 0.1 ms, E2 with a tolerance of 1e-6.",
    naive="RK4 at 0.1 ms",
)
def test_stiff_bristles() -> list[Figure]:
    stiff, figures = 1e6, []
    scene = oscillator(LuGreFriction(stiff, 1.0, damping=100.0))
    naive: float | None = explicit_bristles(stiff)
    for name, solver in (("E1", FixedStep(1e-4)), ("E2", Rodas4(1e-6))):
        run = simulate(scene, solver=solver)
        assert run.stopped_by is None
        assert run.counters["steps"] <= 30_000  # RK45 takes more than a million evaluations
        assert np.abs(run["joint.joint_bristle_bend"]).max() <= 1.001 / stiff
        off = abs(run["joint.position"][-1] + 0.003)
        figures.append(Figure(f"error of the stop position ({name})", off, naive, at_most=1.1 / stiff, unit="rad"))
        naive = None
    return figures


def explicit_bristles(stiff: float) -> float:
    """Where RK4 at 0.1 ms leads [rad]."""

    def rates(y: np.ndarray) -> np.ndarray:
        bend = y[1] - stiff * abs(y[1]) * y[2]
        return np.array([y[1], -100.0 * y[0] - stiff * y[2] - 100.0 * bend, bend])

    y, h = np.array([0.103, 0.0, 0.0]), 1e-4
    for _ in range(30_000):
        k1 = rates(y)
        k2 = rates(y + h / 2 * k1)
        k3 = rates(y + h / 2 * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(y + h * k3))
        if not np.abs(y).max() < 1e6:
            return math.inf
    return float(abs(y[0] + 0.003))
