"""The electrical stage of a winding, far faster than any step one wants to take."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hard_case import Figure, hard_case

from drivetrain.drive.motor import Motor, exact_current_step
from drivetrain.errors import InputError

MOTOR = Motor("typical", resistance=0.299, torque_constant=0.0302, inductance=8.2e-5)


def exact(start: float, volts: list[float], speed: float, step: float, inductance: float) -> tuple[list[float], float]:
    """Currents at the ends of the steps and the mean over the last, with 50 digits."""
    with mp.workdps(50):
        r, k, i, h = (mp.mpf(value) for value in (MOTOR.resistance, MOTOR.torque_constant, start, step))
        rate = r / mp.mpf(inductance)
        ends, mean = [], i
        for volt in volts:
            final = (mp.mpf(volt) - k * mp.mpf(speed)) / r
            mean = final + (i - final) * (1 - mp.exp(-rate * h)) / (rate * h)
            i = final + (i - final) * mp.exp(-rate * h)
            ends.append(float(i))
        return ends, float(mean)


@hard_case(
    "T12",
    "A winding with L/R = 0.27 ms at steps of 1 ms",
    setup="A winding of 0.299 ohm and 82 µH takes 200 steps of random voltage. The reference has 50 digits.",
    naive="explicit Euler",
)
def test_exact_current() -> list[Figure]:
    volts, speed, step = np.random.default_rng(0).uniform(-24, 24, 200).tolist(), 150.0, 1e-3
    wanted, mean_wanted = exact(2.0, volts, speed, step, 8.2e-5)
    current, euler, ends, mean = np.array(2.0), 2.0, [], np.array(0.0)
    largest = 0.0
    for volt, right in zip(volts, wanted, strict=True):
        current, mean = exact_current_step(MOTOR, current, volt, speed, step)
        euler += step * (volt - MOTOR.resistance * euler - MOTOR.torque_constant * speed) / 8.2e-5
        largest = max(largest, abs(euler - right))
        ends.append(float(current))
    scale = float(np.abs(wanted).max())
    return [
        Figure(
            "relative error of the current",
            float(np.abs(np.subtract(ends, wanted)).max()) / scale,
            largest / scale,
            at_most=1e-12,
        ),
        Figure("relative error of its mean over a step", abs(float(mean) - mean_wanted) / scale, at_most=1e-12),
    ]


@pytest.mark.parametrize("inductance", [1e-14, 1e-9, 1e-5, 1e-2, 10.0, 1e6])
def test_any_inductance(inductance: float) -> None:
    """From one that settles at once to one that hardly moves."""
    motor = Motor("any", 0.299, 0.0302, inductance=inductance)
    (wanted,), mean = exact(2.0, [10.0], 150.0, 1e-3, inductance)
    found = exact_current_step(motor, 2.0, 10.0, 150.0, 1e-3)
    assert float(found.end) == pytest.approx(wanted, rel=1e-14)
    assert float(found.mean) == pytest.approx(mean, rel=1e-14)


def test_no_inductance_is_the_limit_of_small_ones() -> None:
    sheet = Motor("silent", 0.299, 0.0302)
    small = Motor("small", 0.299, 0.0302, inductance=1e-18)
    for part in (0, 1):
        assert exact_current_step(sheet, 2.0, 10.0, 150.0, 1e-3)[part] == pytest.approx(
            exact_current_step(small, 2.0, 10.0, 150.0, 1e-3)[part], rel=1e-11
        )


def test_wrong_input_is_told_at_once() -> None:
    with pytest.raises(InputError) as error:
        exact_current_step(MOTOR, math.nan, 1.0, [[1.0], [math.inf]], -1.0, winding_temperature=-300.0)
    assert {fault.place for fault in error.value.faults} == {"step", "winding_temperature", "current", "speed[1, 0]"}
