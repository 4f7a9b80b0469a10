from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from drivetrain.arrays import Array
from drivetrain.drive.motor import Motor, copper_coefficient, torque_constant, winding_resistance
from drivetrain.drive.thermal.heat import (
    PeriodicTemperature,
    periodic_temperature,
    rms_rule_validity,
    temperature_of_current,
)
from drivetrain.drive.thermal.thermal_network import ThermalNetwork, thermal_network
from drivetrain.drive.thermal.warm_up import warm_up
from drivetrain.errors import InputError

# A 150 W DC motor: two resistances and two time constants as sheets print them.
MOTOR = Motor(
    "m",
    0.299,
    0.0302,
    resistance_winding_housing=1.9,
    resistance_housing_ambient=4.65,
    winding_time_constant=41.0,
    housing_time_constant=1120.0,
    max_winding_temperature=155.0,
)
LUMPED = Motor("l", 0.299, 0.0302, resistance_winding_ambient=6.55, winding_time_constant=300.0)
AMBIENT = 30.0


def _network(motor: Motor = MOTOR) -> ThermalNetwork:
    network = thermal_network(motor, AMBIENT)
    assert network is not None
    return network


def _cycle() -> tuple[Array, Array]:
    """A cycle of 12 s with strong and weak parts, a step, a repeated instant and a dwell."""
    time = np.array([0.0, 0.5, 1.0, 2.0, 2.0, 3.0, 4.5, 6.0, 12.0])
    current = np.array([0.0, 14.0, 14.0, -9.0, 5.0, 5.0, -12.0, 1.5, 1.5])
    return time, current


def _generator(square: float, loss: float) -> Array:
    """Rate of (winding, housing, 1) of the two-node network with MOTOR's numbers, written from the heat balance."""
    capacity, housing = 41.0 / 1.9, 1120.0 / 4.65
    copper = square * 0.299
    return np.array(
        [
            [(0.0039 * copper - 1 / 1.9) / capacity, 1 / 1.9 / capacity, copper * (1 - 0.0039 * 25.0) / capacity],
            [1 / 1.9 / housing, -(1 / 1.9 + 1 / 4.65) / housing, (loss + AMBIENT / 4.65) / housing],
            [0.0, 0.0, 0.0],
        ]
    )


def _steps(time: Array, current: Array, loss: Array) -> list[Array]:
    """Exact transition of (winding, housing, 1) over each interval; Simpson is exact for the square of a line."""
    middle = 0.5 * (current[1:] + current[:-1])
    square = (current[:-1] ** 2 + 4.0 * middle**2 + current[1:] ** 2) / 6.0
    losses = 0.5 * (loss[1:] + loss[:-1])
    parts = zip(np.diff(time), square, losses, strict=True)
    return [expm(_generator(i, p) * h) for h, i, p in parts]


def test_two_nodes_from_the_sheet() -> None:
    network = _network()
    assert network.winding_capacity == pytest.approx(41.0 / 1.9)
    assert network.housing_capacity == pytest.approx(1120.0 / 4.65)
    assert network.winding_time_constant == pytest.approx(41.0)
    mounted = thermal_network(MOTOR, AMBIENT, housing_to_ambient=1.0)
    assert mounted is not None and mounted.housing_capacity == network.housing_capacity
    assert mounted.resistance_housing_ambient == 1.0
    assert thermal_network(Motor("bare", 1.0, 0.1), AMBIENT) is None
    one = _network(LUMPED)
    assert (one.resistance_winding_housing, one.resistance_housing_ambient) == (0.0, 6.55)
    assert one.winding_time_constant == pytest.approx(300.0)


def _dense(pieces: int, *columns: Array) -> list[Array]:
    """Columns that are linear between samples, with each interval cut into equal pieces."""
    every = np.linspace(0.0, len(columns[0]) - 1.0, pieces * (len(columns[0]) - 1) + 1)
    return [np.interp(every, np.arange(len(one)), one) for one in columns]


@pytest.mark.parametrize("with_loss", [False, True])
def test_against_thousands_of_simulated_cycles(with_loss: bool) -> None:
    time, current = _dense(10, *_cycle())  # short against the winding's time constant, so that they are taken as given
    loss = np.linspace(1.0, 3.0, time.size) if with_loss else np.zeros(time.size)
    result = temperature_of_current(_network(), MOTOR, time, current, housing_loss=loss if with_loss else None)
    steps = _steps(time, current, loss)
    state = np.array([AMBIENT, AMBIENT, 1.0])
    for _ in range(3000):  # 36 000 s: 32 time constants of the housing, the start is forgotten to 1e-13
        for step in steps:
            state = step @ state
    trace = [state := step @ state for step in steps]
    np.testing.assert_allclose(result.winding[1:], [point[0] for point in trace], rtol=1e-10)
    np.testing.assert_allclose(result.housing[1:], [point[1] for point in trace], rtol=1e-10)
    assert result.winding[0] == pytest.approx(result.winding[-1], rel=1e-12)
    whole = np.linalg.multi_dot(steps[::-1])[:2, :2]
    assert result.spectral_radius == pytest.approx(np.abs(np.linalg.eigvals(whole)).max(), rel=1e-12)


@pytest.mark.parametrize(
    "network", [ThermalNetwork(1.0, 3.0, 10.0, 260.0, 25.0), ThermalNetwork(0, 4.0, 2.5, None, 25)]
)
def test_a_ramp_of_two_rows_heats_as_one_of_many(network: ThermalNetwork) -> None:
    """Of a ramp the end heats most, when the winding has no time to cool: 20 s are long against it."""
    time, current = np.array([0.0, 20.0, 20.0, 60.0]), np.array([0.0, 12.0, 0.0, 0.0])
    loss = np.array([0.0, 3.0, 3.0, 0.0])
    many, amperes, losses = _dense(2000, time, current, loss)
    one = temperature_of_current(network, MOTOR, time, current, housing_loss=loss)
    fine = temperature_of_current(network, MOTOR, many, amperes, housing_loss=losses)
    rise = fine.peak_winding - 25.0
    assert one.peak_winding == pytest.approx(fine.peak_winding, abs=1e-3 * rise) and one.peak_time == 20.0
    assert one.winding.shape == one.housing.shape == one.current.shape == (4,)
    np.testing.assert_allclose(one.winding, fine.winding[::2000], atol=1e-3 * rise)
    np.testing.assert_allclose(one.housing, fine.housing[::2000], atol=1e-3 * rise)
    assert one.mean_winding == pytest.approx(fine.mean_winding, abs=1e-3 * rise)
    warm = [warm_up(network, MOTOR, *two, 30, housing_loss=lost) for *two, lost in (
        (time, current, loss), (many, amperes, losses)
    )]  # fmt: skip
    assert warm[0].peak_winding == pytest.approx(warm[1].peak_winding, abs=1e-3 * rise)
    np.testing.assert_allclose(warm[0].winding, warm[1].winding, atol=1e-3 * rise)


def test_against_an_integrator_that_sees_the_current_as_it_is() -> None:
    time = np.linspace(0.0, 8.0, 401)
    current = 9.0 * np.sin(2.0 * np.pi * time / 8.0) + 3.0
    result = temperature_of_current(_network(), MOTOR, time, current)

    def rate(t: float, state: Array) -> Array:
        square = (9.0 * np.sin(2.0 * np.pi * t / 8.0) + 3.0) ** 2
        return (_generator(square, 0.0) @ np.array([*state, 1.0]))[:2]

    start = [result.winding[0], result.housing[0]]
    solved = solve_ivp(rate, (0.0, 8.0), start, rtol=1e-10, atol=1e-10, t_eval=time)
    # 1e-3 K: chords of 0.02 s under the sine
    np.testing.assert_allclose(result.winding, solved.y[0], atol=1e-3)
    np.testing.assert_allclose(result.housing, solved.y[1], atol=1e-3)
    assert result.mean_winding == pytest.approx(np.trapezoid(solved.y[0], time) / 8.0, abs=1e-3)
    assert result.peak_winding == pytest.approx(solved.y[0].max(), abs=1e-3)
    assert result.peak_time == pytest.approx(time[solved.y[0].argmax()])


def test_means_balance_the_heat() -> None:
    time, current = _cycle()
    loss = np.linspace(1.0, 3.0, time.size)
    result = temperature_of_current(_network(), MOTOR, time, current, housing_loss=loss)
    through_winding = (result.mean_winding - result.mean_housing) / 1.9
    to_air = (result.mean_housing - AMBIENT) / 4.65
    assert to_air - through_winding == pytest.approx(np.trapezoid(loss, time) / 12.0, rel=1e-11)


def test_seven_decades_of_time() -> None:
    # 0.1 s of 16 A each second against 1120 s of the housing: the matrix of one cycle, squared 17 times.
    time, current = np.array([0.0, 0.1, 0.1, 1.0]), np.array([16.0, 16.0, 0.0, 0.0])
    cycle = expm(_generator(0.0, 0.0) * 0.9) @ expm(_generator(256.0, 0.0) * 0.1)
    for _ in range(17):
        cycle = cycle @ cycle
    after = cycle @ np.array([AMBIENT, AMBIENT, 1.0])
    result = temperature_of_current(_network(), MOTOR, time, current)
    np.testing.assert_allclose([result.winding[0], result.housing[0]], after[:2], rtol=1e-9)


def _constant(motor: Motor, current: float) -> PeriodicTemperature:
    time = np.array([0.0, 1.0, 700.0])
    return temperature_of_current(_network(motor), motor, time, np.full(3, current))


@pytest.mark.parametrize("motor", [MOTOR, LUMPED])
def test_constant_current_has_a_closed_form(motor: Motor) -> None:
    # P = I^2 R(T_amb) / (1 - alpha R25 Rth I^2), rise = P Rth
    current, resistance = 6.0, float(winding_resistance(motor, AMBIENT))
    gain = copper_coefficient(25.0) * 0.299 * 6.55 * current**2
    rise = 6.55 * current**2 * resistance / (1.0 - gain)
    result = _constant(motor, current)
    np.testing.assert_allclose(result.winding, AMBIENT + rise, rtol=1e-12)
    assert result.mean_winding == pytest.approx(AMBIENT + rise, rel=1e-12)
    one_sample = temperature_of_current(_network(motor), motor, np.array([3.0]), np.array([-current]))
    np.testing.assert_allclose(one_sample.winding, [AMBIENT + rise], rtol=1e-11)
    assert one_sample.peak_time == 3.0


@pytest.mark.parametrize("motor", [MOTOR, LUMPED, dataclasses.replace(MOTOR, winding_time_constant=None)])
@pytest.mark.parametrize("gain", [0.5, 0.999, 1.001, 3.0, 1e4])
def test_runaway_is_flagged_exactly_when_heating_outgrows_cooling(motor: Motor, gain: float) -> None:
    current = math.sqrt(gain / (copper_coefficient(25.0) * 0.299 * 6.55))
    result = _constant(motor, current)
    assert result.runaway is (gain >= 1.0)
    assert np.isinf(result.winding).all() == result.runaway
    assert math.isinf(result.peak_winding) == result.runaway
    if result.ripple_known:
        assert (result.spectral_radius >= 1.0) == result.runaway


def test_magnets_and_winding_settle_together() -> None:
    time, current = _cycle()
    torque = 0.6 * current * MOTOR.torque_constant
    result = periodic_temperature(_network(), MOTOR, time, torque)
    assert result.converged and not result.runaway
    assert result.magnet_temperature == pytest.approx(result.mean_housing, abs=2e-6)
    np.testing.assert_allclose(result.current, torque / torque_constant(MOTOR, result.magnet_temperature))
    # with the current it found, the temperatures are those of that current
    again = temperature_of_current(_network(), MOTOR, time, result.current)
    np.testing.assert_allclose(again.winding, result.winding, rtol=1e-9)
    # warm magnets cost current, so the motor is warmer than cold magnets would leave it
    assert result.mean_winding > temperature_of_current(_network(), MOTOR, time, 0.6 * current).mean_winding + 1.0


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 1.0])
def test_the_steady_point_is_found_up_to_the_edge_of_runaway(share: float) -> None:
    # A constant torque with warm magnets: the fixed point of two scalar equations, by bisection on magnet temperature.
    def balance(torque: float, magnets: float) -> float:
        square = (torque / float(torque_constant(MOTOR, magnets))) ** 2
        gain = copper_coefficient(25.0) * 0.299 * 6.55 * square
        if gain >= 1.0:
            return math.inf
        return AMBIENT + 4.65 * square * float(winding_resistance(MOTOR, AMBIENT)) / (1.0 - gain)

    def settles(torque: float) -> bool:
        return any(balance(torque, magnets) <= magnets for magnets in np.linspace(AMBIENT, 900.0, 20001))

    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if settles(middle) else (low, middle)
    torque = 0.999 * share * low
    result = periodic_temperature(_network(), MOTOR, np.array([0.0, 5.0]), np.full(2, torque))
    assert result.converged and not result.runaway
    assert balance(torque, result.magnet_temperature) == pytest.approx(result.magnet_temperature, abs=1e-4)
    beyond = periodic_temperature(_network(), MOTOR, np.array([0.0, 5.0]), np.full(2, 1.001 * high))
    assert beyond.runaway


def test_zero_length_intervals_and_splits_change_nothing() -> None:
    time, current = _cycle()
    one = temperature_of_current(_network(), MOTOR, time, current)
    repeated = temperature_of_current(_network(), MOTOR, np.repeat(time, 3), np.repeat(current, 3))
    np.testing.assert_allclose(repeated.winding[::3], one.winding, rtol=1e-12)
    # a constant stretch may be cut anywhere
    finer_time = np.concatenate([time[:7], np.linspace(6.0, 12.0, 301)])
    finer_current = np.concatenate([current[:7], np.full(301, 1.5)])
    cut = temperature_of_current(_network(), MOTOR, finer_time, finer_current)
    np.testing.assert_allclose(cut.winding[[0, -1]], one.winding[[0, -1]], rtol=1e-12)


def test_a_peak_inside_a_long_interval_is_seen() -> None:
    # Loss in the housing for 10 min, then 50 min of current: the winding first heats up on the warm housing, then
    # cools with it; the hottest instant lies between two samples.
    time, current = np.array([0.0, 600.0, 600.0, 3600.0]), np.array([0.0, 0.0, 5.0, 5.0])
    coarse = temperature_of_current(_network(), MOTOR, time, current, housing_loss=np.array([40.0, 40.0, 0.0, 0.0]))
    fine = temperature_of_current(
        _network(),
        MOTOR,
        np.concatenate([[0.0, 600.0], np.linspace(600.0, 3600.0, 20001)]),
        np.concatenate([[0.0, 0.0], np.full(20001, 5.0)]),
        housing_loss=np.concatenate([[40.0, 40.0], np.zeros(20001)]),
    )
    assert coarse.peak_winding > coarse.winding.max() + 15.0
    # looked for every fifth of the winding's time constant (8 s)
    assert coarse.peak_winding == pytest.approx(fine.winding.max(), abs=0.05)
    assert coarse.peak_time == pytest.approx(fine.peak_time, abs=8.0)


def test_without_a_winding_time_constant_only_means_are_told() -> None:
    time, current = _cycle()
    unknown = dataclasses.replace(MOTOR, winding_time_constant=None)
    loss = np.full(time.size, 4.0)
    result = temperature_of_current(_network(unknown), unknown, time, current, housing_loss=loss)
    known = temperature_of_current(_network(), MOTOR, time, current, housing_loss=loss)
    assert not result.ripple_known and known.ripple_known
    assert np.ptp(result.winding) == 0.0 and result.winding[0] == result.peak_winding
    # 0.3 K: the mean misses that hot copper meets high current
    assert result.mean_winding == pytest.approx(known.mean_winding, abs=0.3)
    with_magnets = periodic_temperature(_network(unknown), unknown, time, 0.6 * current * MOTOR.torque_constant)
    assert with_magnets.converged and with_magnets.magnet_temperature == pytest.approx(with_magnets.mean_housing)


def test_without_a_housing_time_constant_the_housing_rests_at_its_mean() -> None:
    time, current = _cycle()
    unknown = dataclasses.replace(MOTOR, housing_time_constant=None)
    result = temperature_of_current(_network(unknown), unknown, time, current)
    known = temperature_of_current(_network(), MOTOR, time, current)
    assert np.ptp(result.housing) < 0.01 * np.ptp(known.housing)
    # 0.2 K: the ripple of the real housing
    np.testing.assert_allclose(result.winding, known.winding, atol=0.2)


def test_one_node_heats_as_one() -> None:
    time, current = _cycle()
    loss = np.full(time.size, 2.0)
    result = temperature_of_current(_network(LUMPED), LUMPED, time, current, housing_loss=loss)
    np.testing.assert_array_equal(result.winding, result.housing)
    state = AMBIENT
    capacity = 300.0 / 6.55
    square = (current[:-1] ** 2 + current[:-1] * current[1:] + current[1:] ** 2) / 3.0
    for _ in range(1200):  # 48 time constants
        for h, i in zip(np.diff(time), square, strict=True):
            rate = (0.299 * 0.0039 * i - 1 / 6.55) / capacity
            source = (0.299 * i * (1 - 0.0039 * 25.0) + 2.0 + AMBIENT / 6.55) / capacity
            state = math.exp(rate * h) * state + source * math.expm1(rate * h) / rate
    assert result.winding[-1] == pytest.approx(state, rel=1e-11)


@pytest.mark.parametrize(
    ("time", "current"),
    [([0.0, 2.0, 1.0], [1.0, 1.0, 1.0]), ([1.0, 1.0], [1.0, 1.0]), ([0.0, 1.0], [1.0] * 3), ([], [])],
)
def test_impossible_cycles_are_refused(time: list[float], current: list[float]) -> None:
    with pytest.raises(InputError, match="time"):
        temperature_of_current(_network(), MOTOR, np.array(time), np.array(current))


def test_the_rms_rule_holds_for_short_overloads_only() -> None:
    network = _network()  # winding time constant 41 s: overloads up to 2.05 s
    time = np.array([0.0, 2.0, 2.0, 20.0])
    current = np.array([-9.0, -9.0, 1.0, 1.0])
    assert rms_rule_validity(network, time, current, 5.0) is None
    assert rms_rule_validity(network, time, current, 9.5) is None
    longer = rms_rule_validity(network, 1.1 * time, current, 5.0)
    assert longer is not None and "2.2 s" in longer and "5.37 %" in longer
    always = rms_rule_validity(network, time, current, 0.5)
    assert always is not None and "all the time" in always
    unknown = dataclasses.replace(network, winding_capacity=None)
    remark = rms_rule_validity(unknown, time, current, 5.0)
    assert remark is not None and "unknown" in remark
    assert rms_rule_validity(unknown, time, current, 9.5) is None


def test_an_overload_over_the_end_of_the_cycle_is_one_overload() -> None:
    network = _network()
    time = np.array([0.0, 1.2, 1.2, 18.8, 18.8, 20.0])
    current = np.array([9.0, 9.0, 1.0, 1.0, 9.0, 9.0])
    remark = rms_rule_validity(network, time, current, 5.0)
    assert remark is not None and "2.4 s" in remark
    # the part of a ramp above the limit counts: 4 s from 0 to 10 A is above 5 A for 2 s, down again for 1 s
    ramp = rms_rule_validity(network, np.array([0.0, 4.0, 6.0, 20.0]), np.array([0.0, 10.0, 0.0, 0.0]), 5.0)
    assert ramp is not None and "3 s" in ramp


def test_whole_numbers_are_temperatures_and_resistances_too() -> None:
    time, current = _cycle()
    whole = thermal_network(MOTOR, 30, housing_to_ambient=np.float32(5))
    exact = thermal_network(MOTOR, 30.0, housing_to_ambient=5.0)
    assert whole == exact == ThermalNetwork(1.9, 5, 41.0 / 1.9, 1120.0 / 4.65, 30)
    assert temperature_of_current(whole, MOTOR, time, current).peak_winding == (
        temperature_of_current(exact, MOTOR, time, current).peak_winding
    )


def test_impossible_networks_are_refused() -> None:
    with pytest.raises(InputError) as caught:
        ThermalNetwork(-1.0, 0.0, 0.0, None, -400.0)
    assert len(caught.value.faults) == 4
