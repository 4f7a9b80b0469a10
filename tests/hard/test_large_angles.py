"""Joints that have turned a hundred thousand times: what is left of a deflection of a tenth of a milliradian."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from hard_case import Figure, hard_case

from drivetrain.arm.files.load import load_arm
from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear
from drivetrain.drive.spring import answer, gear_spring, wind_up
from drivetrain.dynamics.forward import articulated_body
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.solver import RungeKutta4

RATIO, STIFFNESS, ROTOR, LINK, PUSH = 100.0, 1e6, 2.0, 1.0, 300.0
SPRING = Gear("stiff", RATIO, stiffness_1=STIFFNESS)
TIMES = np.linspace(0.0, 0.1, 101)


def law(deflection: float) -> float:
    return answer(gear_spring(SPRING), deflection)[0]


def by_deflection(start: float) -> Array:
    """Spring torque over time; the states are deflection, joint angle, and their rates."""

    def rates(t: float, y: Array) -> Array:
        torque = law(y[0])
        link = torque / LINK
        return np.array([y[2], y[3], (PUSH - torque) / ROTOR - link, link])

    found = integrate(RungeKutta4(1e-5), rates, [0.0, start, 0.0, 1.0], TIMES)
    return np.array([law(row[0]) for row in found.states])


def by_angles(start: float) -> Array:
    """The same by rotor and joint angle."""

    def rates(t: float, y: Array) -> Array:
        torque = law(y[0] / RATIO - y[1])
        return np.array([y[2], y[3], RATIO * (PUSH - torque) / ROTOR, torque / LINK])

    found = integrate(RungeKutta4(1e-5), rates, [RATIO * start, start, RATIO, 1.0], TIMES)
    return np.array([law(row[0] / RATIO - row[1]) for row in found.states])


@hard_case(
    "T30",
    "A spring of 1e6 N m/rad at a joint angle of 1e6 rad",
    setup="300 N m act on a geared rotor and a link for 0.1 s. The result must equal that from the angle 0.",
    naive="spring torque from rotor angle / ratio - joint angle",
)
def test_spring_far_out() -> list[Figure]:
    scale = float(np.abs(by_deflection(0.0)).max())
    ours, naive = (float(np.abs(way(1e6) - way(0.0)).max()) / scale for way in (by_deflection, by_angles))
    arm, rng = load_arm("ur5"), np.random.default_rng(0)
    q, qd, tau = rng.uniform(5e5, 1e6, (50, 6)), rng.normal(size=(50, 6)), 20.0 * rng.normal(size=(50, 6))
    with mp.workdps(40):
        near = np.array([[float(mp.fmod(mp.mpf(float(x)), 2 * mp.pi)) for x in row] for row in q])
    worst = 0.0
    for way in (inverse_dynamics, articulated_body):
        wanted = way(arm, near, qd, tau)
        worst = max(worst, float(np.abs(way(arm, q, qd, tau) - wanted).max() / np.abs(wanted).max()))
    return [
        Figure("relative error of the spring torque", ours, naive, at_most=1e-9),
        Figure("relative change of the dynamics of a six-axis arm", worst, at_most=1e-12),
    ]


def test_the_spring_is_the_wind_up_turned_round() -> None:
    gear = Gear("harmonic", 100.0, stiffness_1=1e4, stiffness_2=1.6e4, stiffness_3=2e4, torque_1=14.0, torque_2=48.0)
    torque = np.concatenate([-np.geomspace(1e-6, 1e3, 200), [0.0, 14.0, -48.0], np.geomspace(1e-6, 1e3, 200)])
    twist = wind_up(gear, torque)
    assert twist is not None
    assert answer(gear_spring(gear), twist)[0] == pytest.approx(torque, rel=1e-13)
