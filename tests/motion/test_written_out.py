"""Laws of samples against other ways to the same numbers: reversed time, polynomials, interpolation, sorted windows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from drivetrain.motion import checks
from drivetrain.motion.base import (
    AXES,
    Swing,
    base_states,
    harmonic_instants,
    harmonic_motion,
    with_base_samples,
    with_instants,
)
from drivetrain.motion.duty_cycle import Step, build_cycle
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.motion.smoothing import Parabolas, SmoothingSpline, estimated_jitter, estimated_noise

RNG = np.random.default_rng(61)
TIME = np.sort(RNG.uniform(0.0, 2.0, 60))


def readings(time: np.ndarray, noise: float = 1e-4) -> np.ndarray:
    clean = np.sin(2.0 * time) + 0.2 * np.sin(7.0 * time)
    return clean + noise * np.random.default_rng(62).normal(size=len(time))


def test_parabolas_are_the_polynomials_through_three_samples() -> None:
    values = readings(TIME, 0.05)
    found = Parabolas().derivatives(TIME, values)
    for k in range(len(TIME)):
        middle = min(max(k, 1), len(TIME) - 2)
        around = slice(middle - 1, middle + 2)
        polynomial = np.polynomial.Polynomial.fit(TIME[around], values[around], 2)
        assert found.first[k] == pytest.approx(polynomial.deriv()(TIME[k]), rel=1e-6, abs=1e-6)
        assert found.second[k] == pytest.approx(polynomial.deriv(2)(TIME[k]), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("jitter", [0.0, 2e-3])
def test_a_spline_of_reversed_time_is_the_spline_reversed(jitter: float) -> None:
    """Speeds and their covariances with others change sign; the penalty is found to 0.02 in its power of ten."""
    values, signs = readings(TIME), np.array([1.0, -1.0, 1.0])
    one = SmoothingSpline(3e-4, jitter).fitted(TIME, values)
    other = SmoothingSpline(3e-4, jitter).fitted(TIME[-1] - TIME[::-1], values[::-1])
    np.testing.assert_allclose(other.rates[:, ::-1] * signs[:, None], one.rates, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(
        other.covariance[::-1] * np.outer(signs, signs), one.covariance, rtol=1e-3, atol=1e-6 * one.covariance.max()
    )


def test_covariances_of_a_spline_are_its_changes_with_each_sample() -> None:
    """A smoother is linear in the samples, and its covariance of what it gives with a position is the noise's variance
    times the derivative by that sample. The penalty, too, depends on the samples, which adds some 3 %.
    """
    time, resolution = np.linspace(0.0, 1.0, 25), 2e-3
    values = readings(time, 6e-4)
    fitted = SmoothingSpline(resolution).fitted(time, values)
    variance, step = resolution**2 / 12.0, 1e-7
    for k in (0, 1, 7, 12, 23, 24):
        moved = values.copy()
        moved[k] += step
        slopes = (SmoothingSpline(resolution).fitted(time, moved).rates[:, k] - fitted.rates[:, k]) / step
        scale = np.sqrt(np.diag(fitted.covariance[k]) * fitted.covariance[k, 0, 0])
        np.testing.assert_allclose(slopes * variance / scale, fitted.covariance[k, :, 0] / scale, atol=0.06)


def test_jitter_is_noise_in_proportion_to_the_speed() -> None:
    """A move at constant speed: the variance is that of noise of the sum of both variances."""
    time, speed, jitter, resolution = np.linspace(0.0, 1.0, 200), 3.0, 1e-3, 1e-3
    values = speed * time
    both = math.hypot(resolution, math.sqrt(12.0) * jitter * speed)
    found = SmoothingSpline(resolution, jitter).fitted(time, values)
    same = SmoothingSpline(both).fitted(time, values)
    np.testing.assert_allclose(found.covariance, same.covariance, rtol=1e-3, atol=1e-6 * same.covariance.max())


def test_noise_and_jitter_that_were_put_in_are_found() -> None:
    time, rng = np.linspace(0.0, 4.0, 4001), np.random.default_rng(63)
    jitter, noise = 2e-4, 1e-4
    true = time + jitter * rng.normal(size=len(time))
    values = np.sin(3.0 * true) + noise * rng.normal(size=len(time))
    # Medians of 4000 values are certain to some 2 %; the speed varies over the samples that count.
    assert estimated_jitter(time, values, noise) == pytest.approx(jitter, rel=0.1)
    slower = np.sin(3.0 * time) + noise * rng.normal(size=len(time))
    assert estimated_noise(time, slower) == pytest.approx(noise, rel=0.1)
    assert estimated_jitter(time, slower, 1.2 * noise) == 0.0


def test_isolated_values_by_sorting_their_neighbours() -> None:
    sizes = np.random.default_rng(64).uniform(0.0, 1.0, 300) ** 4
    found = checks.isolated(sizes, 2.0)
    mirrored = np.concatenate([sizes[4:0:-1], sizes, sizes[-2:-6:-1]])
    for k, size in enumerate(sizes):
        around = sorted([*mirrored[k : k + 4], *mirrored[k + 5 : k + 9]])
        assert found[k] == (size > 2.0 * around[-3])
    assert 5 < found.sum() < 150
    assert checks.isolated(np.array([0.0] * 9 + [1.0]), 2.0).any()  # the fewest values that are looked at
    assert not checks.isolated(np.array([0.0] * 8 + [1.0]), 2.0).any()


def test_two_samples_at_one_instant_are_no_motion() -> None:
    time = checks.Series("t", np.array([1.0, 1.0]), np.array([2, 3]), "", "s")
    assert [fault.problem for fault in checks.time_faults(time, pairs=True)] == ["time must go on"]


# --- the base and the cycle


SWINGS = {"x": Swing(0.1, 1.3, 0.4), "roll": Swing(0.2, 0.7)}


def test_a_harmonic_base_by_complex_numbers() -> None:
    time = np.linspace(0.0, 2.0, 41)
    motion = harmonic_motion(SWINGS, time)
    for axis in AXES:
        swing = SWINGS.get(axis, Swing(0.0, 1.0))
        rate = 2.0 * np.pi / swing.period
        turning = swing.amplitude * np.exp(1j * (rate * time + swing.phase))
        for found, factor in ((motion.position, 1.0), (motion.velocity, 1j * rate), (motion.acceleration, -(rate**2))):
            np.testing.assert_allclose(found[:, AXES.index(axis)], (turning * factor).imag, atol=1e-12)
    instants = harmonic_instants(SWINGS, 2.0)
    assert instants[0] == 0.0 and instants[-1] == 2.0 and np.ptp(np.diff(instants)) < 1e-12


def cycle(samples: int = 9):
    time = np.linspace(3.0, 4.0, samples)
    waves = np.stack([np.sin(time), np.cos(2.0 * time)], axis=1)
    motion = Motion("swing", ("a", "b"), time, waves, 2.0 * waves, 3.0 * waves)
    return build_cycle([Step(motion), Step(dwell=0.5)], may_stay_open=True)


def test_added_samples_lie_on_straight_lines() -> None:
    whole = cycle()
    new = np.array([0.03, 0.125, 0.4, 0.77, 1.2])  # the second is a sample already
    found = with_instants(whole, new)
    assert len(found.time) == len(whole.time) + 4
    distinct = whole.time + np.arange(len(whole.time)) * 1e-15
    for name in ("position", "velocity", "acceleration"):
        for joint in range(2):
            wanted = np.interp(new, distinct, getattr(whole, name)[:, joint])
            at = [int(np.flatnonzero(np.abs(found.time - instant) < 1e-12)[0]) for instant in new]
            np.testing.assert_allclose(getattr(found, name)[at, joint], wanted, atol=1e-12)


def test_the_base_repeats_and_keeps_its_steps() -> None:
    time = np.array([0.0, 0.05, 0.2, 0.2, 0.26, 0.5])
    rows = np.array([[0.0], [0.25], [1.0], [5.0], [5.2], [6.0]]) * np.arange(1.0, 7.0)
    base = Motion("base", AXES, time, rows, -rows, 2.0 * rows)
    whole, there = with_base_samples(cycle(), base)
    assert np.array_equal(whole.time, there.time) and len(whole.time) == len(there.position)
    before, after = there.position[np.abs(there.time - 0.2) < 1e-6][:, 0]
    assert (before, after) == (1.0, 5.0)
    position, velocity, acceleration = base_states(there, np.array([0.1, 0.1 + there.time[-1]]))
    np.testing.assert_allclose(position[0], 0.5 * np.arange(1.0, 7.0), rtol=1e-6)
    np.testing.assert_allclose(position[1], position[0], rtol=1e-6)
    np.testing.assert_allclose(velocity, -position, rtol=1e-12)
    np.testing.assert_allclose(acceleration, 2.0 * position, rtol=1e-12)


def test_positions_of_load_tables_are_the_integral_of_speed_through_all_steps() -> None:
    rng = np.random.default_rng(65)
    tables = []
    for _ in range(3):
        time, speed = np.cumsum(rng.uniform(0.01, 0.1, 12)), rng.normal(size=(12, 2))
        speed[0] = speed[-1] = 0.0
        tables.append(LoadTable("load", ("a", "b"), time, rng.normal(size=(12, 2)), speed, np.zeros((12, 2))))
    found = build_cycle([Step(table) for table in tables])
    wanted = cumulative_trapezoid(found.velocity, found.time, axis=0, initial=0.0)
    np.testing.assert_allclose(found.position, wanted, atol=1e-12)


def test_a_dwell_holds_the_torque_that_is_next_to_it() -> None:
    """At the start the first torque of the table behind it, later the last one of the table before it."""
    time, still = np.linspace(0.0, 1.0, 4), np.zeros((4, 1))
    one = LoadTable("one", ("a",), time, np.array([[1.0], [2.0], [3.0], [4.0]]), still, still)
    two = LoadTable("two", ("a",), time, np.array([[5.0], [6.0], [7.0], [8.0]]), still, still)
    found = build_cycle([Step(dwell=0.5), Step(one), Step(dwell=0.5), Step(two), Step(dwell=0.5)])
    held = [found.torque[found.segment == k, 0] for k in (0, 2, 4)]
    np.testing.assert_array_equal(held, [[1.0, 1.0], [4.0, 4.0], [8.0, 8.0]])


@pytest.mark.parametrize("size", [1e-2, 1.0, 1e2])
def test_rates_that_miss_their_values_are_told_at_any_size(size: float) -> None:
    time = np.linspace(0.0, 2.0, 81)
    rows = tuple(range(2, 83))
    values = checks.Series("q [rad]", size * np.sin(3.0 * time), rows, "", "rad")
    for factor, faults, warnings in ((1.0, 0, 0), (1.08, 0, 1), (1.5, 1, 0)):
        rates = checks.Series("qd [rad/s]", factor * size * 3.0 * np.cos(3.0 * time), rows, "", "rad/s")
        wrong, told = checks.rate_mismatch(time, values, rates, 1e-9)
        assert (len(wrong), len(told)) == (faults, warnings)


def test_notes_on_sampling_only_where_steps_differ() -> None:
    time = np.linspace(0.0, 1.0, 11)
    moving, resting = [np.sin(time)], [np.zeros(11)]
    assert checks.sampling_notes(time, moving) == []
    gap = np.concatenate([time[:4], time[4:] + 1.0])
    assert "moves in the gap after t = 0.3 s" in checks.sampling_notes(gap, moving)[0]
    assert checks.sampling_notes(gap, resting)[0].startswith("sampling is not uniform")
