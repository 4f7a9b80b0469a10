"""Heat of a mix against exact exponentials of long alternations, and in the limits where it is a plain cycle."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.linalg import expm

from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.heat import (
    Mix,
    PeriodicTemperature,
    mixed_temperature,
    periodic_temperature,
    rms_rule_validity,
)
from drivetrain.drive.thermal.thermal_network import thermal_network

MOTOR = Motor(
    "m", 0.299, 0.0302, resistance_winding_housing=1.9, resistance_housing_ambient=4.65, winding_time_constant=8.0,
    housing_time_constant=40000.0, max_winding_temperature=155.0,
)  # fmt: skip
AMBIENT = 30.0
HARD = (np.array([0.0, 1.0, 1.0, 3.0, 4.0]), np.array([4.0, 4.0, -6.0, -2.0, 0.0]))
MILD = (np.array([0.0, 2.0, 2.5]), np.array([0.5, 1.5, 1.0]))
LOSS = (np.array([1.0, 1.0, 2.0, 2.0, 0.5]), np.array([0.3, 0.3, 0.3]))


def network(motor: Motor = MOTOR):
    found = thermal_network(motor, AMBIENT)
    assert found is not None
    return found


def mixed(shares, *, motor: Motor = MOTOR, cycles=(HARD, MILD), losses=LOSS) -> PeriodicTemperature:
    time = np.concatenate([cycles[0][0], cycles[0][0][-1] + cycles[1][0]])
    torque = motor.torque_constant * np.concatenate([cycles[0][1], cycles[1][1]])
    first = len(cycles[0][0])
    use = Mix((slice(0, first), slice(first, len(time))), shares)
    return mixed_temperature(network(motor), motor, time, torque, use, housing_loss=np.concatenate(losses))


def plain(cycle, loss, *, motor: Motor = MOTOR) -> PeriodicTemperature:
    time, current = cycle
    return periodic_temperature(network(motor), motor, time, motor.torque_constant * current, housing_loss=loss)


def generators(cycle, loss, scale: float, slow: float = 40000.0):
    """(step, rate of (winding, housing, 1)) of every interval, from the heat balance; scale: of the current."""
    steps, winding, housing = np.diff(cycle[0]), 8.0 / 1.9, slow / 4.65
    found = []
    for k in np.flatnonzero(steps):
        a, b = scale * cycle[1][k : k + 2]
        copper, lost = 0.299 * (a * a + a * b + b * b) / 3.0, 0.5 * (loss[k] + loss[k + 1])
        found.append((steps[k], np.array([
            [(0.0039 * copper - 1 / 1.9) / winding, 1 / 1.9 / winding, copper * (1 - 0.0039 * 25.0) / winding],
            [1 / 1.9 / housing, -(1 / 1.9 + 1 / 4.65) / housing, (lost + AMBIENT / 4.65) / housing],
            [0.0, 0.0, 0.0],
        ])))  # fmt: skip
    return found


def simulated(counts, scale: float, housing: float, cycles=(HARD, MILD), losses=LOSS):
    """Peak winding temperature and mean housing over the steady alternation of runs of both cycles."""
    pieces = [generators(cycle, loss, scale) for cycle, loss in zip(cycles, losses, strict=True)]
    fine = [[(expm(matrix * step / 40.0), 40) for step, matrix in one] for one in pieces]
    whole = np.eye(3)
    for one, count in zip(pieces, counts, strict=True):
        round_trip = np.eye(3)
        for step, matrix in one:
            round_trip = expm(matrix * step) @ round_trip
        whole = np.linalg.matrix_power(round_trip, count) @ whole
    state = np.append(np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2]), 1.0)
    assert abs(state[1] - housing) < 5.0
    peak, total = -math.inf, []
    for one, count in zip(fine, counts, strict=True):
        for _ in range(count):
            for matrix, times in one:
                for _ in range(times):
                    state = matrix @ state
                    peak = max(peak, float(state[0]))
            total.append(float(state[1]))
    return peak, float(np.mean([min(total), max(total)]))


def test_a_long_alternation_is_the_mix():
    # 40 rounds of 4 s and 128 of 2.5 s: a third and two thirds of the time; twenty time constants of the winding, and
    # a hundredth of the housing's.
    found = mixed((1.0 / 3.0, 2.0 / 3.0))
    scale = 1.0 / (1.0 - 0.001 * (found.magnet_temperature - 25.0))
    peak, housing = simulated((40, 128), scale, found.mean_housing)
    # The housing swings by what the two parts bring in over 160 s of 40000 s.
    assert found.peak_winding == pytest.approx(peak, abs=0.25)
    assert found.mean_housing == pytest.approx(housing, abs=0.2)
    assert found.magnet_temperature == pytest.approx(found.mean_housing, abs=1e-5)
    assert found.converged and not found.runaway


# One ends with the effort with which the other begins.
LATE = (np.array([0.0, 6.0, 6.0, 9.0]), np.array([0.2, 0.2, 7.0, 7.0]))
EARLY = (np.array([0.0, 3.0, 3.0, 9.0]), np.array([-7.0, -7.0, 0.1, 0.1]))


def test_the_winding_is_hottest_where_an_effort_follows_an_effort():
    losses = (np.zeros(4), np.zeros(4))
    found = mixed((0.5, 0.5), cycles=(LATE, EARLY), losses=losses)
    scale = 1.0 / (1.0 - 0.001 * (found.magnet_temperature - 25.0))
    peak, _ = simulated((20, 20), scale, found.mean_housing, (LATE, EARLY), losses)
    assert found.peak_winding == pytest.approx(peak, abs=0.3)  # the housing swings, as above
    assert found.peak_winding > found.winding.max() + 5.0  # than in the periodic states of the parts
    assert found.peak_time == pytest.approx(12.0)  # at the end of the second effort


def test_a_single_node_begins_a_part_as_warm_as_another_leaves_it():
    lumped = Motor("l", 0.299, 0.0302, resistance_winding_ambient=6.55, winding_time_constant=20.0,
                   magnet_coefficient=0.0)  # fmt: skip
    losses, capacity, rise = (np.zeros(4), np.zeros(4)), 20.0 / 6.55, 0.0
    found, peak = mixed((0.5, 0.5), motor=lumped, cycles=(LATE, EARLY), losses=losses), 0.0
    for cycle, count in ((LATE, 60), (EARLY, 1)):  # x' = (R(x) i^2 - x/R_th)/C, in one interval an exponential
        for _ in range(count):
            for step, amperes in zip(np.diff(cycle[0]), cycle[1][:-1], strict=True):
                heat, rate = 0.299 * amperes**2, 1.0 / 6.55 - 0.299 * 0.0039 * amperes**2
                end = heat * (1.0 + 0.0039 * (AMBIENT - 25.0)) / rate
                rise = end + (rise - end) * math.exp(-rate / capacity * step)
                peak = max(peak, rise)
    assert found.peak_winding == pytest.approx(AMBIENT + peak, rel=1e-9)


def mean_housing(cycle, loss, scale: float, slow: float):
    """Of a cycle repeated for ever, and what a watt more in the housing adds: integrals of matrix exponentials."""
    whole, total = np.eye(4), np.zeros((4, 4))  # of winding, housing, 1, watts
    for step, matrix in generators(cycle, loss, scale, slow):
        rates = np.zeros((8, 8))
        rates[:3, :3], rates[1, 3], rates[4:, :4] = matrix, 4.65 / slow, np.eye(4)
        moved = expm(rates * step)
        total, whole = total + moved[4:, :4] @ whole, moved[:4, :4] @ whole
    start = np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2:])
    return total[1] @ np.vstack([start, np.eye(2)]) / cycle[0][-1]


def test_a_housing_as_quick_as_its_cycles():
    """Each part gives the housing, or takes, what brings its mean to that of all; over the use that is nothing."""
    shares = np.array([0.4, 0.6])
    every = [np.linspace(0.0, size - 1.0, 20 * size - 19) for size in (5, 3)]  # 20 pieces of each interval
    dense = [
        [np.interp(at, np.arange(len(loss)), one) for one in (*cycle, loss)]
        for at, cycle, loss in zip(every, (HARD, MILD), LOSS, strict=True)
    ]
    cycles, losses = [(time, current) for time, current, _ in dense], [loss for _, _, loss in dense]
    found = mixed(
        tuple(shares), motor=dataclasses.replace(MOTOR, housing_time_constant=6.0), cycles=cycles, losses=losses
    )
    scale = 1.0 / (1.0 - 0.001 * (found.magnet_temperature - 25.0))
    own = np.array([mean_housing(cycle, loss, scale, 6.0) for cycle, loss in zip(cycles, losses, strict=True)])
    weight = shares / own[:, 1]
    assert found.mean_housing == pytest.approx(weight @ own[:, 0] / weight.sum(), abs=1e-4)


@pytest.mark.parametrize("counts", [(1, 3), (2, 6), (10, 32)])
def test_faster_alternation_is_never_hotter(counts):
    hard, mild = 4.0 * counts[0], 2.5 * counts[1]
    found = mixed((hard / (hard + mild), mild / (hard + mild)))
    scale = 1.0 / (1.0 - 0.001 * (found.magnet_temperature - 25.0))
    peak, housing = simulated(counts, scale, found.mean_housing)
    assert peak < found.peak_winding
    # R(T) ties the mean loss to the ripple: a winding that comes less far from its mean loses a little otherwise.
    assert housing == pytest.approx(found.mean_housing, abs=0.5)


@pytest.mark.parametrize("motor", [
    MOTOR,
    dataclasses.replace(MOTOR, winding_time_constant=None),
    dataclasses.replace(MOTOR, housing_time_constant=None),
    Motor("l", 0.299, 0.0302, resistance_winding_ambient=6.55, winding_time_constant=300.0),
    Motor("n", 0.299, 0.0302, resistance_winding_ambient=6.55),
])  # fmt: skip
def test_limits_are_the_plain_cycle(motor):
    expected = plain(HARD, LOSS[0], motor=motor)
    for shares, cycles, losses in (
        ((0.3, 0.7), (HARD, HARD), (LOSS[0], LOSS[0])),  # equal parts
        ((1.0, 0.0), (HARD, MILD), LOSS),  # the milder part is never used
    ):
        found = mixed(shares, motor=motor, cycles=cycles, losses=losses)
        assert found.peak_winding == pytest.approx(expected.peak_winding, rel=1e-9)
        assert found.mean_housing == pytest.approx(expected.mean_housing, rel=1e-9)
        assert found.mean_winding == pytest.approx(expected.mean_winding, rel=1e-9)
        assert found.winding[:5] == pytest.approx(expected.winding, rel=1e-9)
        assert found.housing[:5] == pytest.approx(expected.housing, rel=1e-9)
        assert found.ripple_known == expected.ripple_known


def test_one_part_is_the_plain_cycle():
    time, current = HARD
    torque = MOTOR.torque_constant * current
    found = mixed_temperature(network(), MOTOR, time, torque, Mix((slice(0, 5),), (1.0,)), housing_loss=LOSS[0])
    expected = plain(HARD, LOSS[0])
    assert found.winding == pytest.approx(expected.winding, rel=1e-9)
    assert found.peak_time == pytest.approx(expected.peak_time)


def test_a_mix_lies_between_its_parts():
    hard, mild = plain(HARD, LOSS[0]), plain(MILD, LOSS[1])
    before = math.inf
    for share in (0.9, 0.5, 0.1):
        found = mixed((share, 1.0 - share))
        assert mild.mean_housing < found.mean_housing < hard.mean_housing
        assert found.peak_winding < before
        before = found.peak_winding


def test_a_part_that_would_run_away_alone_may_be_used_for_a_while():
    hot = (HARD[0], 2.2 * HARD[1])
    assert plain(hot, LOSS[0]).runaway
    assert mixed((1.0, 0.0), cycles=(hot, MILD)).runaway
    found = mixed((0.2, 0.8), cycles=(hot, MILD))
    assert not found.runaway and np.isfinite(found.winding).all()
    # A current whose winding never settles, whatever the housing does.
    assert mixed((0.01, 0.99), cycles=((HARD[0], np.full(5, 60.0)), MILD)).runaway


def test_one_node_has_no_housing_to_even_heat_out():
    lumped = Motor("l", 0.299, 0.0302, resistance_winding_ambient=6.55, winding_time_constant=300.0)
    alone = plain(HARD, LOSS[0], motor=dataclasses.replace(lumped, magnet_coefficient=0.0))
    found = mixed((0.1, 0.9), motor=dataclasses.replace(lumped, magnet_coefficient=0.0))
    assert found.peak_winding == pytest.approx(alone.peak_winding)


def test_the_rms_rule_looks_at_every_part_by_itself():
    # Above 5 A at the end of the first part and at the start of the second: two short overloads, not one.
    time = np.array([0.0, 4.8, 4.8, 5.0, 5.0, 5.2, 5.2, 10.0])
    current = np.array([1.0, 1.0, 9.0, 9.0, 9.0, 9.0, 1.0, 1.0])
    parts = (slice(0, 4), slice(4, 8))
    slow = dataclasses.replace(network(), winding_capacity=5.0 / 1.9)
    assert rms_rule_validity(slow, time, current, 5.0, parts=parts) is None
    assert "0.4 s" in (rms_rule_validity(slow, time, current, 5.0) or "")


def test_a_winding_that_outgrows_every_digit_within_the_cycle_runs_away():
    """Half the cycle heats a light winding far faster than it cools: the balance is singular to rounding."""
    light = dataclasses.replace(
        MOTOR, winding_time_constant=0.02, resistance_winding_housing=1.0, resistance_housing_ambient=4.0
    )
    time = np.linspace(0.0, 5.0, 41)
    for amplitude in np.linspace(37.0, 40.0, 13):
        wave = (time, amplitude * np.sin(0.4 * np.pi * time))
        found = mixed((0.3, 0.7), motor=light, cycles=(wave, (time, 0.2 * wave[1])), losses=(0.0 * time, 0.0 * time))
        assert found.runaway and np.isinf(found.winding).all()
