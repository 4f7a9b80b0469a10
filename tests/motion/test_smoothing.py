"""Differentiation of samples: exact cases, and accelerations of known motions from coarse readings."""

import math

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.motion.profiles import Quintic, Trapezoid
from drivetrain.motion.smoothing import (
    Parabolas,
    SavitzkyGolay,
    SmoothingSpline,
    _takes,
    chosen_smoothing,
    detected_resolution,
    estimated_noise,
)

TIME = np.arange(0.0, 2.0, 1e-3)
WAVE = np.sin(math.pi * TIME) + 0.3 * np.sin(3.0 * math.pi * TIME)
WAVE_ACCELERATION = -(math.pi**2) * (np.sin(math.pi * TIME) + 2.7 * np.sin(3.0 * math.pi * TIME))


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def counts(values, bits):
    step = 2.0 * math.pi / 2**bits
    return np.round(values / step) * step


def test_parabolas_are_exact_for_parabolas_at_any_distances():
    time = np.sort(np.random.default_rng(0).uniform(0.0, 3.0, 40))
    first, second = Parabolas().derivatives(time, 2.0 - 3.0 * time + 1.5 * time**2)
    assert first == pytest.approx(-3.0 + 3.0 * time, abs=1e-9)
    # Neighbours may be only 1e-4 apart: rounding of 1e-16 over 1e-8.
    assert second == pytest.approx(np.full(40, 3.0), abs=1e-6)


@pytest.mark.parametrize("way", [Parabolas(), SmoothingSpline(1e-9), SavitzkyGolay(0.02)], ids=str)
def test_clean_samples_give_the_derivatives(way):
    first, second = way.derivatives(TIME, np.sin(math.pi * TIME))
    # The error of the least accurate method, parabolas: (omega dt)^2/12 = 1e-6 of the acceleration, more at the ends.
    assert first == pytest.approx(math.pi * np.cos(math.pi * TIME), abs=1e-4)
    assert second == pytest.approx(-(math.pi**2) * np.sin(math.pi * TIME), abs=0.05)


@pytest.mark.parametrize("bits", [12, 14, 16, 20])
def test_an_encoder_twice_differentiated(bits):
    # Differences of a 12-bit encoder at 1 kHz have errors of thousands of per cent; those of the spline are below 3 and
    # 6.
    readings = counts(WAVE, bits)
    second = SmoothingSpline(2.0 * math.pi / 2**bits).derivatives(TIME, readings).second
    assert rms(second) == pytest.approx(rms(WAVE_ACCELERATION), rel=0.03)
    assert np.abs(second).max() == pytest.approx(np.abs(WAVE_ACCELERATION).max(), rel=0.06)
    assert rms(second - WAVE_ACCELERATION) < 0.05 * rms(WAVE_ACCELERATION)
    if bits <= 16:
        assert rms(np.gradient(np.gradient(readings, TIME), TIME)) > 1.05 * rms(WAVE_ACCELERATION)


@pytest.mark.parametrize("bits", [12, 16, 20])
def test_a_quintic_move_between_rests(bits):
    law = Quintic().over(1.0)
    moving = law.sampled(1e-3)
    rest = 500
    place = np.concatenate([np.zeros(rest), moving[:, 1], np.ones(rest)])
    truth = np.concatenate([np.zeros(rest), moving[:, 3], np.zeros(rest)])
    time = np.arange(len(place)) * 1e-3
    second = SmoothingSpline(2.0 * math.pi / 2**bits).derivatives(time, counts(place, bits)).second
    assert rms(second) == pytest.approx(rms(truth), rel=0.03)
    assert np.abs(second).max() == pytest.approx(np.abs(truth).max(), rel=0.05)


def test_the_resolution_of_readings_is_detected():
    assert detected_resolution(np.round(WAVE, 3)) == pytest.approx(1e-3)
    assert detected_resolution(np.round(np.degrees(WAVE), 1)) == pytest.approx(0.1)
    assert detected_resolution(counts(WAVE, 12)) == pytest.approx(2.0 * math.pi / 4096.0, rel=1e-6)
    assert detected_resolution(np.round(counts(WAVE, 12), 6)) == pytest.approx(2.0 * math.pi / 4096.0, rel=1e-3)
    assert detected_resolution(WAVE) == 0.0


def test_a_clean_ramp_is_not_taken_for_encoder_counts():
    ramp = 0.0123456789123 * np.arange(50.0)
    assert detected_resolution(ramp) == 0.0


def test_noise_is_estimated_and_a_coarse_wave_is_not_taken_for_noise():
    noise = np.random.default_rng(1).normal(scale=1e-4, size=len(TIME))
    # The estimate is deliberately some ten per cent too large: with too small a value the spline follows the noise.
    assert 1e-4 < estimated_noise(TIME, WAVE + noise) < 1.25e-4
    assert estimated_noise(TIME, WAVE) < 1e-9
    coarse = np.sin(0.9 * np.arange(40.0))
    assert estimated_noise(np.arange(40.0), coarse) == 0.0
    assert estimated_noise(TIME[:5], np.zeros(5)) == 0.0


def test_the_choice_of_the_method():
    assert isinstance(chosen_smoothing(TIME, WAVE, 0.0), Parabolas)
    assert isinstance(chosen_smoothing(TIME[::10], WAVE[::10], 1e-7), Parabolas)
    assert chosen_smoothing(TIME, np.round(WAVE, 4), 1e-4) == SmoothingSpline(pytest.approx(1e-4, rel=0.3))
    noisy = WAVE + np.random.default_rng(2).normal(scale=1e-4, size=len(TIME))
    way = chosen_smoothing(TIME, noisy, 0.0)
    assert rms(way.derivatives(TIME, noisy).second) == pytest.approx(rms(WAVE_ACCELERATION), rel=0.03)
    assert isinstance(chosen_smoothing(TIME, np.zeros_like(TIME), 1.0), Parabolas)


def test_a_clean_trapezoid_does_not_ring():
    samples = Trapezoid().over(0.99).sampled(0.0099)
    samples = samples[np.r_[True, np.diff(samples[:, 0]) > 0.0]]
    way = chosen_smoothing(samples[:, 0], samples[:, 1], 0.0)
    second = way.derivatives(samples[:, 0], samples[:, 1]).second
    assert np.abs(second).max() == pytest.approx(4.5 / 0.99**2, rel=1e-9)


@pytest.mark.parametrize("pause", [20.0, 600.0])
def test_a_pause_in_a_recording_separates_its_parts(pause):
    """Knots at equal distances over the whole were 0.3 s apart, and the acceleration was lost with a tiny deviation."""
    time, coarse = np.where(TIME < 0.9, TIME, TIME + pause), counts(WAVE, 14)
    fitted = SmoothingSpline().fitted(time, coarse)
    first = SmoothingSpline(detected_resolution(coarse)).fitted(TIME[:900], coarse[:900])
    np.testing.assert_array_equal(fitted.rates[:, :900], first.rates)
    off = np.abs(fitted.rates[2] - WAVE_ACCELERATION)
    assert rms(off) < 0.1 * rms(WAVE_ACCELERATION)
    assert np.mean(off < 1.96 * np.sqrt(fitted.covariance[:, 2, 2])) > 0.93
    with pytest.raises(InputError, match="between two long pauses"):
        SmoothingSpline(1e-3).fitted(np.r_[time, time[-1] + 1e4], np.r_[coarse, 0.0])
    bursts = 0.05 * (np.arange(400) // 8) + 1e-6 * (np.arange(400) % 8)
    assert len(_takes(bursts)) == 1


def test_what_cannot_be_differentiated():
    with pytest.raises(InputError, match="at least 3 samples"):
        Parabolas().derivatives(TIME[:2], WAVE[:2])
    with pytest.raises(InputError, match="at least 6 samples"):
        SmoothingSpline(1e-3).derivatives(TIME[:5], WAVE[:5])
    with pytest.raises(InputError, match="resolution above zero"):
        SmoothingSpline().derivatives(TIME, WAVE)
    with pytest.raises(InputError, match="uniform"):
        SavitzkyGolay(0.02).derivatives(TIME**2, WAVE)
    with pytest.raises(InputError, match=r"0\.006 to 1\.999 s"):
        SavitzkyGolay(0.004).derivatives(TIME, WAVE)
