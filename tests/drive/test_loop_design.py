"""Loops from the drive: closed forms of rigid joints and springs, margins against a crossover by hand, sampling."""

from __future__ import annotations

import math
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from drivetrain.drive.loops.loop_design import MODULUS_MARGIN, Margins, design_loops, given_loops
from drivetrain.drive.loops.servo_axis import (
    Notch,
    ServoAxis,
    ServoTiming,
    notch_filter,
    resonances,
    sampled_limit,
    servo_plant,
)
from drivetrain.errors import InputError

RIGID = ServoAxis(0.03, 100.0, 3.3e-5, 0.05)
SOFT = ServoAxis(0.03, 100.0, 3.3e-5, 0.05, stiffness=2e4, spring_damping=1.0)
HUNTING = ServoAxis(0.03, 100.0, 9.3e-6, 0.70, stiffness=6e4, spring_damping=3.3)


def test_a_rigid_joint_is_an_integrator() -> None:
    at = 1j * np.array([1.0, 30.0, 900.0])
    assert servo_plant(RIGID, ServoTiming())(at) == pytest.approx(0.03 / (RIGID.whole_inertia * at), rel=1e-12)


def test_the_springs_two_frequencies_are_zeros_and_poles() -> None:
    undamped = ServoAxis(0.03, -100.0, 3.3e-5, 0.05, stiffness=2e4)
    anti, res = resonances(undamped)
    plant = servo_plant(undamped, ServoTiming())
    assert max(abs(plant.zeros().imag)) == pytest.approx(anti, rel=1e-9)
    assert max(abs(plant.poles().imag)) == pytest.approx(res, rel=1e-9)
    # Two masses on a spring, from their own matrices.
    mass, spring = np.diag([100.0**2 * 3.3e-5, 0.05]), 2e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert res == pytest.approx(math.sqrt(max(np.linalg.eigvals(np.linalg.solve(mass, spring)).real)), rel=1e-9)


def test_a_stiff_spring_is_a_rigid_joint() -> None:
    stiff = ServoAxis(0.03, 100.0, 3.3e-5, 0.05, stiffness=1e12)
    at = 1j * np.array([1.0, 100.0])
    assert servo_plant(stiff, ServoTiming())(at) == pytest.approx(servo_plant(RIGID, ServoTiming())(at), rel=1e-6)


def test_the_phase_margin_is_what_the_crossover_has() -> None:
    timing = ServoTiming(6000.0, 2.5e-4, 1)
    design = design_loops(RIGID, timing)

    def inner(w: float) -> complex:
        """By hand: the lag held and sampled, as the z transform of its partial fractions."""
        z, period, b = np.exp(1j * w * timing.period), timing.period, timing.current_bandwidth
        fade = math.exp(-b * period)
        # Angle after a unit of acceleration that lags: t^2/2 - t/b + (1 - exp(-b t))/b^2, less one period's shift.
        square, ramp = 0.5 * period**2 * (z + 1.0) / (z - 1.0) ** 2, period / (z - 1.0)
        angle = square - ramp / b + (1.0 - fade) / (z - fade) / b**2
        turned = RIGID.torque_constant / RIGID.whole_inertia * angle * (1.0 - 1.0 / z) / period
        control = design.speed_gain * (1.0 + period / design.integral_time * z / (z - 1.0))
        return complex(control * turned * z**-timing.delay)

    crossing = brentq(lambda w: abs(inner(w)) - 1.0, 1.0, 3e3)
    assert design.speed_phase_margin == pytest.approx(math.pi + np.angle(inner(crossing)), abs=1e-3)
    assert crossing == pytest.approx(design.speed_bandwidth, rel=0.1)
    assert design.stable and design.limited_by == "current loop"
    # A factor of that gain margin brings the loop to the edge: minus one where the phases add up to half a turn.
    scan = np.geomspace(crossing, 1e4, 400)
    past = next(k for k, w in enumerate(scan) if inner(w).imag > 0.0)
    at = brentq(lambda w: inner(w).imag, scan[past - 1], scan[past])
    assert design.speed_gain_margin == pytest.approx(1.0 / abs(inner(at)), rel=1e-2)
    for factor, settles in ((0.99, True), (1.01, False)):
        gain = factor * design.speed_gain_margin * design.speed_gain
        assert given_loops(RIGID, timing, gain, design.integral_time, 0.01).stable is settles


def test_what_limits_the_loop_is_told() -> None:
    assert design_loops(RIGID, ServoTiming(1000.0)).limited_by == "current loop"
    assert design_loops(RIGID, ServoTiming(6000.0, 1e-3, 1)).limited_by == "samples and delay"
    assert "anti-resonance" in design_loops(SOFT, ServoTiming(1e5)).limited_by
    assert design_loops(SOFT, ServoTiming(1e5)).stable
    assert not design_loops(RIGID, ServoTiming(6000.0, 1e-3, 1), speed_bandwidth=2000.0).stable


def test_a_loop_that_hunts_is_not_called_stable() -> None:
    """Its nearest margin is large: the resonance lies far beyond -1, on the wrong side of it."""
    timing = ServoTiming(3000.0, 1e-3, 1)
    hunts = design_loops(HUNTING, timing, speed_bandwidth=97.0)
    assert not hunts.stable and hunts.damping < -0.1
    (_, factor), = hunts.speed_margins.gain  # fmt: skip
    assert factor == pytest.approx(0.118, abs=0.01)
    assert min(abs(lag) for _, lag in hunts.speed_margins.phase) > math.radians(60.0)
    mended = design_loops(HUNTING, timing)
    assert mended.stable and mended.limited_by == "resonance of the joint's spring"
    assert mended.modulus_margin >= MODULUS_MARGIN and mended.damping > 0.0
    assert mended.critical_frequency == pytest.approx(resonances(HUNTING)[1], rel=0.05)
    faster = mended.with_notch
    assert mended.speed_bandwidth < 5.0 < 8.0 * mended.speed_bandwidth < faster.speed_bandwidth
    assert faster.stable and faster.modulus_margin >= MODULUS_MARGIN and mended.notch is None
    gains = (faster.speed_gain, faster.integral_time, faster.position_gain)
    assert (
        not given_loops(HUNTING, timing, *gains).stable
        and given_loops(HUNTING, timing, *gains, notch=faster.notch).stable
    )


def test_a_continuous_cascade_by_hand() -> None:
    """A rigid joint with friction and a notch: responses as products of their factors, poles as the roots of theirs."""
    axis, notch = replace(RIGID, viscous=0.02), Notch(300.0, 0.1, 0.7)
    timing = ServoTiming(4000.0)
    gain, integral, outer = 0.5, 0.03, 40.0
    found = given_loops(axis, timing, gain, integral, outer, notch=notch)
    s = 1j * found.frequencies
    filtered = (s**2 + 2 * 0.1 * 300.0 * s + 300.0**2) / (s**2 + 2 * 0.7 * 300.0 * s + 300.0**2)
    plant = 0.03 / (axis.whole_inertia * s + 0.02) / (1.0 + s / 4000.0) * filtered
    speed = gain * (1.0 + 1.0 / (integral * s)) * plant
    np.testing.assert_allclose(found.speed_loop, speed, rtol=1e-8)
    np.testing.assert_allclose(found.position_loop, outer / s * speed / (1.0 + speed), rtol=1e-8)
    for pole in found.poles:  # of the closed cascade: 1 plus the open position loop is 0
        s = np.array([pole])
        filtered = (s**2 + 60.0 * s + 9e4) / (s**2 + 420.0 * s + 9e4)
        speed = (
            gain * (1.0 + 1.0 / (integral * s)) * 0.03 / (axis.whole_inertia * s + 0.02) / (1.0 + s / 4e3) * filtered
        )
        assert abs(1.0 + speed + outer / s * speed)[0] < 1e-6 * (1.0 + abs(speed[0]) + abs(outer / s * speed)[0])


def test_poles_of_fast_samples_are_those_of_a_continuous_loop() -> None:
    gains = (0.5, 0.03, 40.0)
    slow = sorted(given_loops(SOFT, ServoTiming(4000.0), *gains).poles, key=abs)
    fast = sorted(given_loops(SOFT, ServoTiming(4000.0, 1e-6), *gains).poles, key=abs)[: len(slow)]
    # A hold and a difference of 1 us each turn the phase by w/1e6.
    np.testing.assert_allclose(np.abs(fast), np.abs(slow), rtol=0.02)
    np.testing.assert_allclose(np.real(fast), np.real(slow), rtol=0.02, atol=1.0)


def test_a_pole_on_either_side_of_the_axis_settles_or_not() -> None:
    """Integral action around an integrator with a lag: Routh, stable if the integral time is above the lag."""
    for integral, stable in ((1.2e-3, True), (0.8e-3, False)):
        assert given_loops(RIGID, ServoTiming(1000.0), 0.01, integral, 1e-6).stable == stable


def test_the_reach_is_the_first_frequency_at_minus_3_db() -> None:
    """A bandwidth of a rigid joint's speed loop: gain / (J s) with a slow integral, closed, is a lag of first order."""
    found = given_loops(RIGID, ServoTiming(), 0.2, 1e3, 1e-3)
    bandwidth = 0.2 * 0.03 / RIGID.whole_inertia
    at = found.frequencies
    assert at[at < found.speed_reach].max() <= bandwidth * (1.0 + 1e-6) and found.speed_reach >= bandwidth * (1 - 1e-3)


def test_the_margin_nearest_to_one_of_several() -> None:
    margins = Margins(((1.0, 8.0), (2.0, 1.5), (3.0, 0.2)), ((1.0, 1.2), (2.0, -0.3), (3.0, 0.8)))
    assert margins.least_gain == 1.5 and margins.least_phase == -0.3
    below = Margins(((1.0, 4.0), (3.0, 0.5)), ())
    assert below.least_gain == 0.5 and below.least_phase == math.inf


def test_without_the_margin_the_stable_design_with_the_largest_one_is_given() -> None:
    axis, timing = replace(SOFT, spring_damping=0.02), ServoTiming(3000.0, 1e-3, 1)
    found = design_loops(axis, timing, modulus_margin=0.99)
    assert found.stable and found.modulus_margin < 0.99
    others = (design_loops(axis, timing, speed_bandwidth=found.speed_bandwidth * f) for f in (1.1, 1.5, 2.0, 3.0))
    assert all(other.modulus_margin <= found.modulus_margin + 1e-9 for other in others if other.stable)


def test_a_notch_is_deep_in_its_middle_and_nothing_far_from_it() -> None:
    """And the same as a library's bilinear transform."""
    notch, period = Notch(700.0, 0.1, 0.7), 1e-3
    zeros, poles = notch_filter(notch, period)
    continuous = control.tf(*([1.0, 2.0 * one * 700.0, 700.0**2] for one in (notch.zeros, notch.poles)))
    sampled = control.sample_system(continuous, period, "bilinear", prewarp_frequency=700.0)
    assert zeros == pytest.approx(sampled.num[0][0] / sampled.den[0][0][0], rel=1e-9)
    assert poles == pytest.approx(sampled.den[0][0] / sampled.den[0][0][0], rel=1e-9)
    for at, gain in ((0.0, 1.0), (notch.frequency, notch.zeros / notch.poles), (math.pi / period, 1.0)):
        late = np.exp(-1j * at * period * np.arange(3))
        assert abs(zeros @ late / (poles @ late)) == pytest.approx(gain, rel=1e-9)


def test_gains_hold_from_the_lightest_load_to_the_heaviest() -> None:
    """Where the load, not the rotor, is what the motor moves, gains for the heaviest are too much for the lightest."""
    timing, heavy = ServoTiming(6000.0, 1e-3, 1), ServoAxis(0.03, 10.0, 1e-5, 0.05)
    alone, both = design_loops(heavy, timing), design_loops(heavy, timing, lightest=0.005)
    assert both.speed_bandwidth < 0.3 * alone.speed_bandwidth and both.limited_by == "samples and delay"
    light = ServoAxis(0.03, 10.0, 1e-5, 0.005)
    for design, good in ((alone, False), (both, True)):
        answer = given_loops(light, timing, design.speed_gain, design.integral_time, design.position_gain)
        assert (answer.stable and answer.modulus_margin >= MODULUS_MARGIN) is good


def test_gains_that_the_lightest_load_swings_with_are_not_called_stable() -> None:
    """A spring without damping: with a ninth of the load no bandwidth settles, with all of it many do."""
    axis, timing = ServoAxis(0.0343, 198.0, 4.9e-4, 1.27, stiffness=2.26e6), ServoTiming(6630.0, 1.51e-4, 2)
    light = replace(axis, load_inertia=0.138)
    alone, both = design_loops(axis, timing), design_loops(axis, timing, lightest=light.load_inertia)
    gains = (both.speed_gain, both.integral_time, both.position_gain)
    assert alone.stable and given_loops(axis, timing, *gains).stable
    assert not given_loops(light, timing, *gains).stable and not both.stable
    wanted = design_loops(axis, timing, speed_bandwidth=both.speed_bandwidth, lightest=light.load_inertia)
    assert not wanted.stable


def test_a_spring_without_damping_may_leave_nothing() -> None:
    """A peak without end on the wrong side of -1: no gain settles, and the answer says so."""
    bare = ServoAxis(0.03, 100.0, 9.3e-6, 0.7, stiffness=6e4)
    design = design_loops(bare, ServoTiming(3000.0, 1e-3, 1))
    assert not design.stable and design.limited_by == "resonance of the joint's spring"
    assert design_loops(bare, ServoTiming(3000.0)).modulus_margin < 1.0  # and nothing is divided by zero


@pytest.mark.parametrize("delay", range(4))
def test_the_limit_of_samples_is_where_the_plants_poles_leave_the_circle(delay: int) -> None:
    timing = ServoTiming(period=1e-3, delay=delay)
    plant, limit = servo_plant(RIGID, timing), sampled_limit(RIGID, timing)
    for share, stable in ((0.99, True), (1.01, False)):
        poles = control.feedback(plant * (share * limit)).poles()
        assert (np.abs(poles).max() < 1.0) == stable


@pytest.mark.parametrize(("delay", "share"), [(0, 2.0), (1, 2.0 * (math.sqrt(2.0) - 1.0))])
def test_the_limit_of_samples(delay: int, share: float) -> None:
    limit = sampled_limit(RIGID, ServoTiming(period=1e-3, delay=delay))
    assert limit * 0.03 * 1e-3 / RIGID.whole_inertia == pytest.approx(share, rel=1e-9)
    assert sampled_limit(RIGID, ServoTiming()) == math.inf


def test_the_frequencies_show_every_peak() -> None:
    sharp = ServoAxis(0.03, 100.0, 3.3e-5, 0.05, stiffness=2e4, spring_damping=1e-3)
    design = design_loops(sharp, ServoTiming(6000.0))
    plant = servo_plant(sharp, ServoTiming())
    for about, worst in zip(resonances(sharp), (np.min, np.max), strict=True):
        fine = np.linspace(0.999 * about, 1.001 * about, 4001)
        own = design.frequencies[(design.frequencies > fine[0]) & (design.frequencies < fine[-1])]
        assert worst(abs(plant(1j * own))) == pytest.approx(worst(abs(plant(1j * fine))), rel=0.01)
    assert np.isfinite(design.speed_loop).all() and np.isfinite(design.position_loop).all()


def test_wild_numbers_find_an_answer_too() -> None:
    """Inertias over nine decades, springs over twelve: no warning (an error here), no figure that is none."""
    rng = np.random.default_rng(5)

    def any_of(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(low, high))

    for k in range(24):
        stiffness = any_of(-2.0, 10.0) if k % 4 else None
        damping = any_of(-6.0, 4.0) if k % 3 else 0.0
        axis = ServoAxis(any_of(-4, 2), -any_of(-2, 4), any_of(-9, 0), any_of(-6, 4), stiffness, damping)
        timing = ServoTiming(any_of(-1.0, 8.0), any_of(-7.0, 1.0) if k % 5 else 0.0, k % 3)
        design = design_loops(axis, timing, lightest=axis.load_inertia * any_of(-3.0, 0.0) if k % 2 else None)
        told = (design.modulus_margin, design.damping, design.speed_phase_margin, design.speed_reach)
        assert not np.isnan(told).any() and np.isfinite(design.poles).all()


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        ServoAxis(0.0, 0.0, -1.0, math.nan, stiffness=0.0, viscous=-1.0)
    assert len(error.value.faults) == 6
    with pytest.raises(InputError, match="something must limit it"):
        design_loops(RIGID, ServoTiming())
    with pytest.raises(InputError) as error:
        design_loops(RIGID, ServoTiming(), speed_bandwidth=-1.0, lightest=1.0, modulus_margin=1.0)
    assert len(error.value.faults) == 3
