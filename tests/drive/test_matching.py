"""Ratios by closed form against brute force: least RMS, least peak, and the ranges within a rated torque."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from drivetrain.drive.drive import Drive, drive_inertia, motor_torque
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear, mesh
from drivetrain.drive.matching import (
    TorqueTerms,
    inertia_matching_ratio,
    load_match,
    rated_ranges,
    ratio_of_least_peak,
    ratio_of_least_rms,
    rms_torque,
    scaled_gear,
    torque_at,
    torque_terms,
)
from drivetrain.drive.motor import Motor
from drivetrain.errors import InputError

MOTOR = Motor("m", resistance=0.5, torque_constant=0.05, rotor_inertia=2e-5)
GEAR = Gear("g", 60.0, kind="planetary", efficiency=0.8, inertia=1e-6, continuous_torque=20.0, no_load_torque=0.004)
TIME = np.linspace(0.0, 2.0, 401)
WEIGHTS = np.r_[0.5, np.ones(399), 0.5] * (TIME[1] - TIME[0])


def motion(seed=0):
    """Torque, speed, acceleration and carrier's acceleration in all four quadrants."""
    rng = np.random.default_rng(seed)
    speed = sum(rng.normal() * np.sin(np.pi * k * TIME + rng.uniform(0, 6)) for k in range(1, 5))
    acceleration = np.gradient(speed, TIME)
    torque = 0.3 * acceleration + 4.0 * np.cos(1.3 * TIME + rng.uniform(0, 6)) + rng.normal()
    return torque, speed, acceleration, 3.0 * np.sin(2.0 * np.pi * TIME + rng.uniform(0, 6))


def drive(ratio=60.0, **changes):
    parts = {
        "joint_friction": Friction(0.2, viscous=0.1),
        "motor_friction": Friction(0.003, 0.005, 2e-5, 3e-5),
        **changes,
    }
    return Drive(MOTOR, replace(GEAR, ratio=ratio), **parts)


def at(base, ratio):
    return replace(base, gear=scaled_gear(base.gear, ratio))


def test_inertia_matching_is_where_a_load_accelerates_most() -> None:
    load, rotor, torque = 0.7, 3e-5, 0.2
    best = minimize_scalar(
        lambda g: -g * torque / (load + g * g * rotor), bounds=(1, 1000), method="bounded", options={"xatol": 1e-9}
    )
    # The maximum is flat: its place is known to half the digits.
    assert inertia_matching_ratio(load, rotor) == pytest.approx(best.x, rel=1e-6)
    assert inertia_matching_ratio(load, rotor) == math.sqrt(load / rotor)
    with pytest.raises(InputError) as caught:
        inertia_matching_ratio(0.0, -1.0)
    assert len(caught.value.faults) == 2


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("ratio", [7.0, 60.0, 300.0])
def test_terms_are_the_drives_motor_torque(sign, ratio) -> None:
    base = drive(60.0 * sign)
    torque, speed, acceleration, carrier = motion()
    speed[50:90] = 0.0  # at rest for a while
    terms = torque_terms(base, torque, speed, acceleration, carrier, WEIGHTS)
    exact = motor_torque(at(base, ratio), torque, speed, acceleration, carrier)
    np.testing.assert_allclose(torque_at(terms, ratio), sign * exact.total, rtol=1e-11, atol=1e-15)
    assert {(a, b) for a, b in zip(np.sign(torque), np.sign(speed), strict=True) if a and b} == {
        (1, 1), (1, -1), (-1, 1), (-1, -1)
    }  # fmt: skip


def test_scaled_gear_keeps_its_losses_and_its_sign() -> None:
    gear = replace(GEAR, ratio=-60.0)
    scaled = scaled_gear(gear, 30.0)
    assert scaled.ratio == -30.0
    assert scaled.no_load_torque == pytest.approx(0.008)
    np.testing.assert_allclose(mesh(scaled)[1:3], mesh(gear)[1:3], rtol=1e-14)
    assert scaled_gear(replace(GEAR, no_load_torque=None), 5.0).no_load_torque is None


def test_load_and_rotor_alone_have_the_fourth_root() -> None:
    torque, _, acceleration, _ = motion(1)
    inertia = 3e-5
    terms = TorqueTerms(torque, np.zeros_like(torque), inertia * acceleration, WEIGHTS)
    mean = {k: float(v**2 @ WEIGHTS / WEIGHTS.sum()) for k, v in {"T": torque, "a": acceleration}.items()}
    assert ratio_of_least_rms(terms) == pytest.approx((mean["T"] / (inertia**2 * mean["a"])) ** 0.25, rel=1e-12)
    # A pure inertia: exercise 8.9 again.
    pure = replace(terms, inverse=0.4 * acceleration)
    assert ratio_of_least_rms(pure) == pytest.approx(inertia_matching_ratio(0.4, inertia), rel=1e-12)
    assert ratio_of_least_peak(pure) == pytest.approx(inertia_matching_ratio(0.4, inertia), rel=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_least_rms_and_least_peak_against_minimisation(seed) -> None:
    base = drive(60.0 if seed % 2 else -60.0)
    torque, speed, acceleration, carrier = motion(seed)
    terms = torque_terms(base, torque, speed, acceleration, carrier, WEIGHTS)

    def square(logarithm):
        moved = motor_torque(at(base, math.exp(logarithm)), torque, speed, acceleration, carrier).total
        return float(moved**2 @ WEIGHTS)

    found = minimize_scalar(square, bounds=(0, math.log(3000)), method="bounded", options={"xatol": 1e-10})
    assert ratio_of_least_rms(terms) == pytest.approx(math.exp(found.x), rel=1e-5)
    ratios = np.geomspace(1, 3000, 20_000)
    peaks = [np.abs(torque_at(terms, g)).max() for g in ratios]
    best = ratio_of_least_peak(terms)
    assert np.abs(torque_at(terms, best)).max() <= min(peaks) * (1 + 1e-9)
    assert best == pytest.approx(ratios[np.argmin(peaks)], rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_ends_of_the_rated_range_have_the_rated_torque(seed) -> None:
    base = drive()
    torque, speed, acceleration, carrier = motion(seed)
    terms = torque_terms(base, torque, speed, acceleration, carrier, WEIGHTS)
    least = rms_torque(terms, ratio_of_least_rms(terms))
    for factor in (1.02, 1.5, 4.0):
        ranges = rated_ranges(terms, factor * least)
        assert any(r.low < ratio_of_least_rms(terms) < r.high for r in ranges)
        for end in (e for r in ranges for e in r):
            exact = motor_torque(at(base, end), torque, speed, acceleration, carrier).total
            assert math.sqrt(exact**2 @ WEIGHTS / WEIGHTS.sum()) == pytest.approx(factor * least, rel=1e-7)
        inside = [g for g in np.geomspace(0.3, 3e4, 2000) if rms_torque(terms, g) <= factor * least]
        assert all(any(r.low <= g <= r.high for r in ranges) for g in inside)
    assert rated_ranges(terms, 0.99 * least) == ()


def test_a_range_can_part() -> None:
    # Without the constant part there is one valley; with it two torques can cancel at two ratios each.
    x, z, y = np.array([1.0, 1.0]), np.array([-2.5, -2.5]), np.array([1.0, 1.0])
    terms = TorqueTerms(x, z, y, np.ones(2))
    ranges = rated_ranges(terms, 0.1)
    assert len(ranges) == 2
    for low, high in ranges:
        assert rms_torque(terms, math.sqrt(low * high)) < 0.1
    assert rms_torque(terms, 1.0) == pytest.approx(0.5)


def test_limits_of_a_range() -> None:
    held = TorqueTerms(np.array([3.0]), np.array([0.0]), np.array([0.0]), np.ones(1))
    assert rated_ranges(held, 0.1) == ((pytest.approx(30.0), math.inf),)
    assert ratio_of_least_rms(held) == ratio_of_least_peak(held) == math.inf
    free = TorqueTerms(np.array([0.0]), np.array([0.0]), np.array([0.01]), np.ones(1))
    assert rated_ranges(free, 0.1) == ((0.0, pytest.approx(10.0)),)
    assert ratio_of_least_rms(free) == ratio_of_least_peak(free) == 0.0


@pytest.mark.parametrize("efficiency", [1.0, 0.7])
@pytest.mark.parametrize("seed", range(4))
def test_alpha_beta_range_against_brute_force(seed, efficiency) -> None:
    torque, _, acceleration, _ = motion(seed)
    inertia = 3e-5
    terms = TorqueTerms(torque / efficiency, np.zeros_like(torque), inertia * acceleration, WEIGHTS)
    least = rms_torque(terms, ratio_of_least_rms(terms))
    rated = 1.3 * least
    match = load_match(rated, inertia, torque, acceleration, WEIGHTS, efficiency=efficiency)
    assert match.best == pytest.approx(ratio_of_least_rms(terms), rel=1e-12)
    assert match.range is not None
    for end in match.range:
        assert rms_torque(terms, end) == pytest.approx(rated, rel=1e-12)
    assert match.range == pytest.approx(rated_ranges(terms, rated)[0], rel=1e-7)
    # alpha = beta is where a motor just will do.
    assert least**2 / inertia == pytest.approx(match.load_factor, rel=1e-12)
    assert load_match(0.99 * least, inertia, torque, acceleration, WEIGHTS, efficiency=efficiency).range is None
    # The printed form of the condition, at any ratio.
    tau = 1.0 / 47.0
    t, a = (math.sqrt(float(v**2 @ WEIGHTS / WEIGHTS.sum())) for v in (torque, acceleration))
    bracket = t * tau / (efficiency * math.sqrt(inertia)) - math.sqrt(inertia) * a / tau
    assert rms_torque(terms, 47.0) ** 2 / inertia == pytest.approx(match.load_factor + bracket**2, rel=1e-10)
    # The printed ends.
    root = math.sqrt(match.accelerating_factor - match.load_factor)
    wide = math.sqrt(root**2 + 4.0 * a * t / efficiency)
    printed = [math.sqrt(inertia) * efficiency / (2.0 * t) * (wide + way * root) for way in (1.0, -1.0)]
    np.testing.assert_allclose(match.range, [1.0 / tau for tau in printed], rtol=1e-9)


def test_alpha_beta_at_its_limits() -> None:
    weights, zero, one = np.ones(2), np.zeros(2), np.ones(2)
    held = load_match(0.1, 1e-5, 3.0 * one, zero, weights)
    assert held.best == math.inf
    assert held.range == (pytest.approx(30.0), math.inf)
    free = load_match(0.1, 1e-5, zero, 100.0 * one, weights)
    assert free.best == 0.0
    assert free.range == (0.0, pytest.approx(100.0))
    with pytest.raises(InputError, match="efficiency"):
        load_match(0.1, 1e-5, one, one, weights, efficiency=1.2)
    with pytest.raises(InputError, match="rated_torque"):
        load_match(0.0, 1e-5, one, one, weights)
    with pytest.raises(InputError, match=r"load_torque\[0\]: must be finite"):
        load_match(0.1, 1e-5, np.nan * one, one, weights)
    with pytest.raises(InputError, match="acceleration: must have shape"):
        load_match(0.1, 1e-5, one, one[1:], weights)
    with pytest.raises(InputError, match="weights: must not be negative"):
        load_match(0.1, 1e-5, one, one, -weights)


def test_braking_makes_the_one_efficiency_pessimistic() -> None:
    # A flywheel: half of its motion brakes, and the printed efficiency there divides what it should multiply.
    base = Drive(MOTOR, replace(GEAR, no_load_torque=None), motor_friction=Friction())
    speed = np.sin(np.pi * TIME)
    acceleration = np.pi * np.cos(np.pi * TIME)
    torque = 0.5 * acceleration
    terms = torque_terms(base, torque, speed, acceleration, np.zeros_like(speed), WEIGHTS)
    rated = 1.2 * rms_torque(terms, ratio_of_least_rms(terms))
    wide = rated_ranges(terms, rated)[0]
    narrow = load_match(rated, drive_inertia(base), torque, acceleration, WEIGHTS, efficiency=0.8).range
    assert wide.low < narrow.low < narrow.high < wide.high


def test_a_gear_of_another_ratio_has_the_friction_of_its_input() -> None:
    """Running torque is with one over the ratio, breakaway with its power of 0.7, and what stands behind with 1/G^2."""
    gear = Gear("s", -50.0, kind="strain_wave", inertia=3e-5, stage_inertia=1e-5, no_load_torque=0.06,
                starting_torque=0.04)  # fmt: skip
    found = scaled_gear(gear, 80.0)
    assert found.ratio == -80.0
    assert found.no_load_torque * 80.0 == pytest.approx(0.06 * 50.0)
    assert found.starting_torque * 80.0**0.7 == pytest.approx(0.04 * 50.0**0.7)
    assert found.stage_inertia * 80.0**2 == pytest.approx(1e-5 * 50.0**2)
    assert found.inertia - found.stage_inertia == pytest.approx(2e-5)
    bare = scaled_gear(Gear("b", 50.0, kind="strain_wave"), 20.0)
    assert (bare.inertia, bare.no_load_torque, bare.starting_torque) == (None, None, None)
