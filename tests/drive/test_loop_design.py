"""Loops from the drive: closed forms of rigid joints and springs, margins against a crossover by hand, sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from drivetrain.drive.loop_design import (
    ServoAxis,
    ServoTiming,
    design_loops,
    frequencies,
    open_loops,
    resonances,
    sampled_limit,
    speed_response,
)
from drivetrain.errors import InputError

RIGID = ServoAxis(0.03, 100.0, 3.3e-5, 0.05)
SOFT = ServoAxis(0.03, 100.0, 3.3e-5, 0.05, stiffness=2e4, spring_damping=1.0)


def test_a_rigid_joint_is_an_integrator() -> None:
    at = 1j * np.array([1.0, 30.0, 900.0])
    assert speed_response(RIGID)(at) == pytest.approx(0.03 / (RIGID.whole_inertia * at), rel=1e-12)


def test_the_springs_two_frequencies_are_zeros_and_poles() -> None:
    undamped = ServoAxis(0.03, -100.0, 3.3e-5, 0.05, stiffness=2e4)
    anti, res = resonances(undamped)
    plant = speed_response(undamped)
    assert max(abs(plant.zeros().imag)) == pytest.approx(anti, rel=1e-9)
    assert max(abs(plant.poles().imag)) == pytest.approx(res, rel=1e-9)
    # Two masses on a spring, from their own matrices.
    mass, spring = np.diag([100.0**2 * 3.3e-5, 0.05]), 2e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert res == pytest.approx(math.sqrt(max(np.linalg.eigvals(np.linalg.solve(mass, spring)))), rel=1e-9)


def test_a_stiff_spring_is_a_rigid_joint() -> None:
    stiff = ServoAxis(0.03, 100.0, 3.3e-5, 0.05, stiffness=1e12)
    at = 1j * np.array([1.0, 100.0])
    assert speed_response(stiff)(at) == pytest.approx(speed_response(RIGID)(at), rel=1e-6)


def test_the_phase_margin_is_what_the_crossover_has() -> None:
    timing = ServoTiming(6000.0, 2.5e-4, 1)
    design = design_loops(RIGID, timing)

    def inner(w: float) -> complex:
        plant = RIGID.torque_constant / (RIGID.whole_inertia * 1j * w)
        control = design.speed_gain * (1.0 + 1.0 / (1j * w * design.integral_time))
        return complex(control * plant * np.exp(-1j * w * timing.lag) / (1.0 + 1j * w / 6000.0))

    crossing = brentq(lambda w: abs(inner(w)) - 1.0, 1.0, 1e5)
    assert design.speed_phase_margin == pytest.approx(math.pi + np.angle(inner(crossing)), abs=1e-3)
    assert crossing == pytest.approx(design.speed_bandwidth, rel=0.1)
    assert design.stable
    # A factor of that gain margin brings the loop to the edge: minus one where the phases add up to half a turn.
    at = brentq(
        lambda w: 0.5 * math.pi - math.atan(1.0 / (w * design.integral_time)) - w * timing.lag - math.atan(w / 6000.0),
        crossing,
        8.0 * crossing,
    )
    assert design.speed_gain_margin == pytest.approx(1.0 / abs(inner(at)), rel=1e-2)


def test_what_limits_the_loop_is_told() -> None:
    assert design_loops(RIGID, ServoTiming(1000.0)).limited_by == "current loop"
    assert design_loops(RIGID, ServoTiming(6000.0, 1e-3, 1)).limited_by == "samples and delay"
    assert "anti-resonance" in design_loops(SOFT, ServoTiming(1e5)).limited_by
    assert design_loops(SOFT, ServoTiming(1e5)).stable
    assert not design_loops(RIGID, ServoTiming(6000.0, 1e-3, 1), speed_bandwidth=2000.0).stable


@pytest.mark.parametrize(("delay", "share"), [(0, 2.0), (1, 2.0 * (math.sqrt(2.0) - 1.0))])
def test_the_limit_of_samples(delay: int, share: float) -> None:
    limit = sampled_limit(RIGID, ServoTiming(period=1e-3, delay=delay))
    assert limit * 0.03 * 1e-3 / RIGID.whole_inertia == pytest.approx(share, rel=1e-9)
    assert sampled_limit(RIGID, ServoTiming()) == math.inf


def test_a_bode_plot_meets_the_resonances() -> None:
    timing = ServoTiming(6000.0)
    design = design_loops(SOFT, timing)
    at = frequencies(SOFT, design)
    assert set(resonances(SOFT)) <= set(at)
    inner, outer = open_loops(SOFT, timing, design, at)
    assert np.isfinite(inner).all()
    assert np.isfinite(outer).all()
    dip = at[np.argmin(np.abs(inner[(at > 0.5 * resonances(SOFT)[0]) & (at < 1.2 * resonances(SOFT)[0])]))]
    assert dip > 0.0


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        ServoAxis(0.0, 0.0, -1.0, math.nan, stiffness=0.0, viscous=-1.0)
    assert len(error.value.faults) == 6
    with pytest.raises(InputError, match="something must limit it"):
        design_loops(RIGID, ServoTiming())
