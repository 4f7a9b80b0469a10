"""Heat over hours beside pulses of milliseconds, and motors that never stop getting hotter."""

from __future__ import annotations

import math

import numpy as np
from hard_case import Figure, hard_case
from scipy.integrate import solve_ivp

from drivetrain.drive.motor import Motor, copper_coefficient, winding_resistance
from drivetrain.drive.thermal.heat import periodic_temperature, temperature_of_current
from drivetrain.drive.thermal.thermal_network import ThermalNetwork, thermal_network
from drivetrain.drive.thermal.warm_up import warm_up

MOTOR = Motor(
    "typical", resistance=0.299, torque_constant=0.0302, inductance=8.2e-5, resistance_winding_housing=1.9,
    resistance_housing_ambient=4.65, winding_time_constant=41.0, housing_time_constant=1120.0,
)  # fmt: skip
NETWORK = thermal_network(MOTOR, 25.0)
assert NETWORK is not None
SLOPE = MOTOR.resistance * copper_coefficient(25.0)  # ohm/K
TOP, LAG = 5.6, 8.2e-5 / 0.299  # A, s: pulses of this current, its edges as L/R lets them be
HOURS = 3.0


def pulse(t: float) -> float:
    """On for 0.3 s of every second."""
    phase = t % 1.0
    if phase < 0.3:
        return TOP * -math.expm1(-phase / LAG)
    return TOP * math.exp(-(phase - 0.3) / LAG)


def heating(t: float, rises: np.ndarray) -> np.ndarray:
    """Rates of both rises, or of several pairs of them one after another [K/s]."""
    winding, housing = rises[::2], rises[1::2]
    inner, outer = NETWORK.resistance_winding_housing, NETWORK.resistance_housing_ambient
    across = (winding - housing) / inner
    result = np.empty(rises.shape)
    result[::2] = ((MOTOR.resistance + SLOPE * winding) * pulse(t) ** 2 - across) / NETWORK.winding_capacity
    result[1::2] = (across - housing / outer) / NETWORK.housing_capacity
    return result


def exact_end(cycles: int) -> float:
    """The winding at the end: one cycle's map by tight integration piece by piece, then its power."""
    state = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
    for begin, end in ((0.0, 0.01), (0.01, 0.3), (0.3, 0.31), (0.31, 1.0)):
        # Just before its end a piece must not see the next one.
        run = solve_ivp(heating, (begin, np.nextafter(end, 0.0)), state, "DOP853", rtol=1e-11, atol=1e-12)
        state = run.y[:, -1]
    shift, first, second = state[:2], state[2:4] - state[:2], state[4:] - state[:2]
    whole = np.eye(3)
    whole[:2] = np.column_stack([first, second, shift])
    return 25.0 + float(np.linalg.matrix_power(whole, cycles)[0, 2])


@hard_case(
    "T13",
    "Winding temperature after 3 h of a 1 Hz duty cycle",
    setup=(
        "The current is on for 30 % of each second, with edges of L/R = 0.27 ms; the housing has a time "
        "constant of 1120 s."
    ),
    naive="scipy's BDF, which reports success",
)
def test_three_hours() -> list[Figure]:
    cycles = int(HOURS * 3600)
    edge = LAG * np.concatenate([np.linspace(0.0, 8.0, 200), [10.0, 14.0, 20.0, 30.0]])
    time = np.concatenate([edge, 0.3 + edge, [1.0]])
    current = np.array([pulse(np.nextafter(t, 0.0)) if t == 1.0 else pulse(t) for t in time])
    exact = warm_up(NETWORK, MOTOR, time, current, cycles)
    root_mean_square = math.sqrt(np.trapezoid(current**2, time))
    averaged = warm_up(NETWORK, MOTOR, [0.0, 1.0], [root_mean_square] * 2, cycles)
    wanted = exact_end(cycles)
    naive = solve_ivp(heating, (0.0, HOURS * 3600.0), [0.0, 0.0], "BDF")
    assert naive.success
    missed = abs(25.0 + naive.y[0, -1] - wanted)
    return [
        Figure(
            "temperature error with each cycle as an affine map",
            abs(exact.winding[-1] - wanted),
            missed,
            at_most=0.01,
            unit="K",
        ),
        Figure(
            "temperature error with the mean loss", abs(averaged.winding[-1] - wanted), missed, at_most=0.2, unit="K"
        ),
    ]


@hard_case(
    "T14",
    "Thermal runaway",
    setup=(
        "2000 motors and currents with a loop gain a R Rth I² from 0.01 to 3; at 1 the loss grows faster than "
        "the cooling, and the closest gain is 1e-6 away from 1."
    ),
    naive="constant winding resistance",
)
def test_runaway() -> list[Figure]:
    rng = np.random.default_rng(0)
    gains = np.concatenate(
        [rng.uniform(0.01, 3.0, 1900), 1.0 + 10.0 ** rng.uniform(-6, -1, 100) * rng.choice([-1, 1], 100)]
    )
    wrong, naive_wrong, worst, naive_worst = 0, 0, 0.0, 0.0
    for gain in gains:
        inner, outer, resistance = 10.0 ** rng.uniform(-1, 1, 3)
        motor = Motor("any", resistance, 0.05, magnet_coefficient=0.0)
        network = ThermalNetwork(inner, outer, 50.0, 500.0, 25.0)
        total = inner + outer
        amperes = math.sqrt(gain / (resistance * copper_coefficient(25.0) * total))
        found = temperature_of_current(network, motor, np.zeros(1), np.full(1, amperes))
        wrong += found.runaway != (gain >= 1.0)
        naive_wrong += gain >= 1.0  # a constant resistance always has an answer
        if gain < 0.999 and not found.runaway:
            wanted = resistance * amperes**2 * total / (1.0 - gain)
            worst = max(worst, abs((found.mean_winding - 25.0) / wanted - 1.0))
            naive_worst = max(naive_worst, abs(resistance * amperes**2 * total / wanted - 1.0))
    return [
        Figure("incorrect answers to whether there is a runaway", float(wrong), float(naive_wrong), at_most=0.0),
        Figure("relative error of the temperature rise elsewhere", worst, naive_worst, at_most=1e-6),
    ]


LIFT = np.array([[0.0, 9.0], [2.0, 9.0], [2.0, 4.0], [8.0, 4.0], [8.0, 0.5], [20.0, 0.5]])  # time [s], current [A]


def brute_force(duration: float) -> tuple[float, float]:
    """Mean and largest winding temperature of the last cycle, by Heun's steps of at most 0.1 s from cold."""
    inner, outer = NETWORK.resistance_winding_housing, NETWORK.resistance_housing_ambient
    winding = housing = 0.0
    hottest = total = 0.0

    def rates(w: float, h: float, amperes: float) -> tuple[float, float]:
        across = (w - h) / inner
        loss = float(winding_resistance(MOTOR, 25.0 + w)) * amperes**2
        return (loss - across) / NETWORK.winding_capacity, (across - h / outer) / NETWORK.housing_capacity

    for _ in range(round(duration / 20.0)):
        hottest = total = 0.0
        for (start, amperes), (end, _) in zip(LIFT[::2], LIFT[1::2], strict=True):
            count = round((end - start) / 0.1)
            step = (end - start) / count
            for _ in range(count):
                a, b = rates(winding, housing, amperes)
                c, d = rates(winding + step * a, housing + step * b, amperes)
                total += 0.5 * step * winding
                winding, housing = winding + 0.5 * step * (a + c), housing + 0.5 * step * (b + d)
                total += 0.5 * step * winding
                hottest = max(hottest, winding)
    return 25.0 + total / 20.0, 25.0 + hottest


@hard_case(
    "T15",
    "Temperatures of a cycle that repeats without end",
    setup="A lift of 20 s with 9, 4 and 0.5 A. The reference simulates 12 000 s.",
    naive="mean loss with the cold resistance",
)
def test_periodic() -> list[Figure]:
    found = temperature_of_current(NETWORK, MOTOR, LIFT[:, 0], LIFT[:, 1])
    mean, peak = brute_force(12_000.0)
    square = float(np.trapezoid(LIFT[:, 1] ** 2, LIFT[:, 0])) / 20.0
    cold = 25.0 + MOTOR.resistance * square * (1.9 + 4.65)
    return [
        Figure(
            "error of the mean temperature", abs(found.mean_winding - mean), abs(cold - mean), at_most=0.2, unit="K"
        ),
        Figure(
            "error of the peak temperature", abs(found.peak_winding - peak), abs(cold - peak), at_most=0.2, unit="K"
        ),
    ]


def test_a_torque_that_weakens_its_own_magnets_runs_away_sooner() -> None:
    """With kt(T) the same torque takes more current the hotter it gets: a root of a cubic, or none."""
    strong = Motor("strong", 0.3, 0.03, magnet_coefficient=0.0)
    weak = Motor("weak", 0.3, 0.03, magnet_coefficient=-0.002)
    network = ThermalNetwork(2.0, 4.0, 20.0, 300.0, 25.0)
    slope = 0.3 * copper_coefficient(25.0)
    for torque in np.linspace(0.01, 0.45, 45):
        square = (torque / 0.03) ** 2
        gain = slope * square * 6.0
        ideal = periodic_temperature(network, strong, np.zeros(1), np.full(1, torque))
        assert ideal.runaway == (gain >= 1.0)
        # The rise h of the housing obeys h = 4 P, P = (R + s (h + 2 P)) square / (1 - 0.002 h)^2.
        heat = np.polynomial.Polynomial([0.0, 0.25])
        loss = (0.3 + slope * np.polynomial.Polynomial([0.0, 1.5])) * square
        roots = (heat * np.polynomial.Polynomial([1.0, -0.002]) ** 2 - loss).roots()
        steady = [float(root.real) for root in roots if abs(root.imag) < 1e-9 and 0.0 < root.real < 500.0]
        found = periodic_temperature(network, weak, np.zeros(1), np.full(1, torque))
        assert found.runaway == (not steady)
        if steady:
            assert abs(found.mean_housing - 25.0 - min(steady)) < 1e-4 * min(steady)
