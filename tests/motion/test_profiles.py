"""Profiles: peaks against closed forms and samples, and each quantity against the integral of its derivative."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetrain.errors import InputError
from drivetrain.motion.profiles import PathLimits, Quintic, SCurve, Trapezoid

PROFILES = [Trapezoid(), Trapezoid(ramp_share=0.5), Quintic(), SCurve(), SCurve(ramp_share=0.5, jerk_share=0.5)]
FREE = math.inf
rates = st.floats(1e-2, 1e3)


def fastest(profile, speed, acceleration, jerk):
    """The fastest law; a trapezoid accepts no jerk limit."""
    return profile.fastest(PathLimits(speed, acceleration, FREE if isinstance(profile, Trapezoid) else jerk))


@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_speed_is_the_integral_of_acceleration_and_position_that_of_speed(profile):
    time, place, speed, acceleration = profile.over(1.3).sampled(1e-4).T
    half = 0.5 * np.diff(time)
    # The error of the trapezoidal rule is dt^2/12 times the change of slope: below 1e-7 with 1000 samples per piece.
    assert np.cumsum(half * (acceleration[1:] + acceleration[:-1])) == pytest.approx(speed[1:], abs=1e-7)
    assert np.cumsum(half * (speed[1:] + speed[:-1])) == pytest.approx(place[1:], abs=1e-7)


def test_integrals_of_a_trapezoid_are_exact_with_few_samples():
    # Acceleration is piecewise constant, speed is piecewise linear, and both values at each step are samples.
    time, place, speed, acceleration = Trapezoid().over(1.0).sampled(1.0).T
    half = 0.5 * np.diff(time)
    assert np.cumsum(half * (acceleration[1:] + acceleration[:-1])) == pytest.approx(speed[1:], abs=1e-14)
    assert np.cumsum(half * (speed[1:] + speed[:-1])) == pytest.approx(place[1:], abs=1e-14)
    assert np.count_nonzero(np.diff(time) == 0.0) == 2


@pytest.mark.parametrize("profile", PROFILES, ids=str)
@given(duration=st.floats(1e-3, 1e3))
def test_ends_peaks_and_symmetry(profile, duration):
    law = profile.over(duration)
    time, place, speed, acceleration = law.sampled(duration / 400.0).T
    assert law.duration == pytest.approx(duration, rel=1e-14)
    assert (time[0], place[0], speed[0]) == (0.0, 0.0, 0.0)
    assert (time[-1], place[-1], speed[-1]) == (law.duration, 1.0, 0.0)
    # Only rounding: a few units in the last place of numbers of the size of the peak.
    assert speed.max() == pytest.approx(law.peak.speed, rel=1e-4)
    assert speed.max() <= law.peak.speed * (1.0 + 1e-12)
    assert np.abs(acceleration).max() <= law.peak.acceleration * (1.0 + 1e-12)
    assert np.abs(acceleration).max() == pytest.approx(law.peak.acceleration, rel=1e-4)
    for rows, sign in ((speed, 1.0), (acceleration, -1.0)):
        assert sign * rows[::-1] == pytest.approx(rows, abs=1e-11 * np.abs(rows).max())
    assert 1.0 - place[::-1] == pytest.approx(place, abs=1e-13)


@pytest.mark.parametrize("profile", PROFILES, ids=str)
@given(speed=rates, acceleration=rates, jerk=rates)
def test_the_fastest_law_satisfies_every_limit_and_reaches_one(profile, speed, acceleration, jerk):
    law = fastest(profile, speed, acceleration, jerk)
    used = [law.peak.speed / speed, law.peak.acceleration / acceleration]
    if not isinstance(profile, Trapezoid):
        used.append(law.peak.jerk / jerk)
    assert max(used) == pytest.approx(1.0, rel=1e-9)
    samples = law.sampled(law.duration / 200.0)
    assert np.abs(samples[:, 2]).max() <= speed * (1.0 + 1e-9)
    assert np.abs(samples[:, 3]).max() <= acceleration * (1.0 + 1e-9)
    assert samples[-1, 1] == 1.0
    assert np.trapezoid(samples[:, 2], samples[:, 0]) == pytest.approx(1.0, rel=1e-3)


@given(speed=rates, acceleration=rates, jerk=rates)
def test_no_law_is_faster_than_the_trapezoid_and_the_s_curve_nears_it(speed, acceleration, jerk):
    trapezoid = fastest(Trapezoid(), speed, acceleration, FREE).duration
    assert fastest(SCurve(), speed, acceleration, jerk).duration >= trapezoid * (1.0 - 1e-9)
    assert fastest(Quintic(), speed, acceleration, jerk).duration >= trapezoid * (1.0 - 1e-9)
    near = fastest(SCurve(), speed, acceleration, 1e9 * acceleration**1.5).duration
    assert near == pytest.approx(trapezoid, rel=1e-6)


@given(speed=rates, acceleration=rates, jerk=rates)
def test_the_s_curve_is_the_fastest_under_its_limits(speed, acceleration, jerk):
    quickest = fastest(SCurve(), speed, acceleration, jerk)
    assert quickest.duration <= fastest(Quintic(), speed, acceleration, jerk).duration * (1.0 + 1e-9)
    # Any other law of the family, stretched until it satisfies all limits, takes at least as long.
    for ramp_share, jerk_share in ((0.5, 0.5), (1 / 3, 1 / 3), (0.2, 0.1), (0.05, 0.5), (0.5, 0.05)):
        peak = SCurve(ramp_share, jerk_share).over(1.0).peak
        slowed = max(peak.speed / speed, math.sqrt(peak.acceleration / acceleration), math.cbrt(peak.jerk / jerk))
        assert quickest.duration <= slowed * (1.0 + 1e-9)


def test_peaks_in_closed_form():
    duration = 0.8
    third = Trapezoid().over(duration).peak
    assert third[:2] == pytest.approx((1.5 / duration, 4.5 / duration**2), rel=1e-14)
    assert third.jerk == math.inf
    quintic = Quintic().over(duration).peak
    assert quintic == pytest.approx((1.875 / duration, 5.773502691896258 / duration**2, 60.0 / duration**3), rel=1e-14)
    # Four equal pieces of jerk: s(T) = j T^3/32 = 1, peak acceleration j T/4, peak speed j T^2/16.
    jerk = 32.0 / duration**3
    s_curve = SCurve(0.5, 0.5).over(duration).peak
    assert s_curve == pytest.approx((jerk * duration**2 / 16, jerk * duration / 4, jerk), rel=1e-14)


def test_a_trapezoid_that_reaches_its_speed_and_one_that_does_not():
    assert fastest(Trapezoid(), 2.0, 5.0, FREE).duration == pytest.approx(1 / 2.0 + 2.0 / 5.0)
    assert fastest(Trapezoid(), 9.0, 5.0, FREE).duration == pytest.approx(2.0 / math.sqrt(5.0))
    assert len(fastest(Trapezoid(), 9.0, 5.0, FREE).knots) == 3


def test_a_stretched_law_is_the_same_form():
    law = SCurve().over(1.0)
    slow = law.stretched(2.5)
    scale = np.array([2.5, 1.0, 1 / 2.5, 1 / 2.5**2])
    assert slow.sampled(0.025) == pytest.approx(law.sampled(0.01) * scale, rel=1e-12, abs=1e-12)
    assert slow.peak == pytest.approx((law.peak.speed / 2.5, law.peak.acceleration / 2.5**2, law.peak.jerk / 2.5**3))


@pytest.mark.parametrize(
    ("profile", "limits"),
    [
        (Trapezoid(), PathLimits(1.0, FREE, FREE)),
        (Trapezoid(), PathLimits(1.0, 1.0, 1.0)),
        (SCurve(), PathLimits(1.0, 1.0, FREE)),
        (Quintic(), PathLimits(FREE, FREE, FREE)),
    ],
)
def test_limits_that_a_profile_cannot_use(profile, limits):
    with pytest.raises(InputError, match="profile"):
        profile.fastest(limits)


@pytest.mark.parametrize("profile", [Trapezoid(0.0), Trapezoid(0.6), SCurve(0.6, 0.3), SCurve(0.3, 0.0)], ids=str)
def test_shares_out_of_range(profile):
    with pytest.raises(InputError, match=r"at most 0\.5"):
        profile.over(1.0)


def test_an_s_curve_needs_only_its_jerk_limit():
    law = SCurve().fastest(PathLimits(FREE, FREE, 4.0))
    # Four pieces of a quarter each: T = cbrt(32/j).
    assert law.duration == pytest.approx(math.cbrt(32.0 / 4.0), rel=1e-12)
