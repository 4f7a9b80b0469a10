"""A winding under its controller moves as the equations say, also through the limit of the voltage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.drive.loops.current_loop_kernel import loop_step

R, L, BANDWIDTH = 0.299, 82e-6, 6283.0  # of a motor of the 150 W class, and a loop of 1 kHz


def reference(state: tuple[float, float], h: float, volts: float, loop: tuple[float, ...]) -> np.ndarray:
    """The equations as the docstring writes them, in steps that no change of the limit can slip through."""
    resistance, inductance, kp, ki, command, emf, forward = loop

    def rates(_: float, y: np.ndarray) -> list[float]:
        asked = kp * (command - y[0]) + y[1] + forward
        voltage = min(max(asked, -volts), volts)
        drawn = (voltage - asked) * ki / kp
        return [
            (voltage - resistance * y[0] - emf) / inductance,
            ki * (command - y[0]) + drawn,
            y[0],
            y[0] ** 2,
            voltage * y[0],
        ]

    found = solve_ivp(rates, (0.0, h), [*state, 0.0, 0.0, 0.0], rtol=1e-9, atol=1e-9, max_step=h / 500.0)
    return found.y[:, -1] / [1.0, 1.0, h, h, h]


@pytest.mark.parametrize("volts", [math.inf, 24.0, 3.0])
@pytest.mark.parametrize("seed", range(6))
def test_a_step_is_the_solution(volts: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    command, emf, forward, current, integral = rng.normal(size=5) * [20.0, 5.0, 3.0, 10.0, 5.0]
    loop = (R, L, L * BANDWIDTH, R * BANDWIDTH, command, emf, forward)
    found = loop_step(current, integral, 1e-3, volts, loop)
    # Changes of the limit are enclosed to 1/512 of the step: a few 1e-6 A of the end, some 1e-5 A of the mean; squares
    # and powers are of currents of 20 A and voltages of 24 V.
    expected = reference((current, integral), 1e-3, volts, loop)
    assert found[:3] == pytest.approx(expected[:3], abs=1e-8 if math.isinf(volts) else 2e-4)
    assert found[3:] == pytest.approx(expected[3:], abs=1e-6 if math.isinf(volts) else 5e-3)


@pytest.mark.parametrize("seed", [5, 17, 30])
def test_a_limit_that_is_met_within_a_step_alone_is_found(seed: int) -> None:
    """A loop that swings, its integrator twenty times too quick: at both ends of the step it is at no limit."""
    rng = np.random.default_rng(seed)
    command, emf, forward, current, integral = rng.normal(size=5) * [20.0, 5.0, 3.0, 10.0, 5.0]
    loop = (R, L, L * BANDWIDTH, 20.0 * R * BANDWIDTH, command, emf, forward)
    expected = reference((current, integral), 2e-4, 14.0, loop)
    found = loop_step(current, integral, 2e-4, 14.0, loop)
    assert found[:3] == pytest.approx(expected[:3], abs=2e-3)  # of 20 A; without a look inside 10 A off


def test_a_long_step_ends_where_the_command_is() -> None:
    loop = (R, L, L * BANDWIDTH, R * BANDWIDTH, 7.0, 2.0, 0.0)
    current, integral, mean, _, _ = loop_step(0.0, 0.0, 10.0, math.inf, loop)
    assert current == pytest.approx(7.0, rel=1e-12)
    assert integral == pytest.approx(R * 7.0 + 2.0, rel=1e-12)
    assert 6.9 < mean < 7.0
