"""Loops as designed against the effects that run them: their recursion as a matrix, and whole simulations."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import bilinear

import drivetrain as dt
from drivetrain.arrays import Array
from drivetrain.drive.loops.loop_design import MODULUS_MARGIN, SPRING, LoopDesign, closed_loop
from drivetrain.drive.loops.servo_axis import resonances

CHOICES = {SPRING, f"notch and {SPRING}", "current loop", "samples and delay", "anti-resonance of the joint's spring"}
ISSUE = dt.ServoAxis(0.03, 100.0, 9.3e-6, 0.70, stiffness=6e4, spring_damping=3.3)


def a_period(axis: dt.ServoAxis, timing: dt.ServoTiming, design: LoopDesign) -> Array:
    """What one period of ``SampledCascade`` makes of angles, speeds, current, and of all that it remembers."""
    rotor, load = axis.rotor_inertia, axis.load_inertia / axis.ratio**2
    spring, damping = (axis.stiffness or 0.0) / axis.ratio**2, axis.spring_damping / axis.ratio**2
    if axis.stiffness is None:  # the load's own two states stay behind, and are left out below
        rotor, load, damping = rotor + load, 1.0, 0.0
    rates = np.zeros((6, 6))  # of the motor's angle and speed, the load's, the current; and the command, which is held
    rates[0, 1] = rates[2, 3] = 1.0
    rates[1, :5] = np.array([-spring, -damping - axis.viscous, spring, damping, axis.torque_constant]) / rotor
    rates[3, :4] = np.array([spring, damping, -spring, -damping]) / load
    rates[4, 4:] = -timing.current_bandwidth, timing.current_bandwidth
    held = expm(rates * timing.period)
    kept = [0, 1, 4] if axis.stiffness is None else [0, 1, 2, 3, 4]
    zeros, poles = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
    if design.notch is not None:
        middle = 2.0 / timing.period * np.tan(0.5 * design.notch.frequency * timing.period)
        above, below = ([1.0, 2.0 * one * middle, middle**2] for one in (design.notch.zeros, design.notch.poles))
        zeros, poles = bilinear(above, below, 1.0 / timing.period)

    def after(state: Array) -> Array:
        body = np.zeros(6)
        body[kept] = state[: len(kept)]
        last, integrated, came, went, came_before, went_before, *waiting = state[len(kept) :]
        whole = -design.position_gain * body[0] - (body[0] - last) / timing.period
        error = zeros @ [whole, came, came_before] - poles[1:] @ [went, went_before]
        grown = timing.period * design.speed_gain / design.integral_time * error
        waiting.append(design.speed_gain * error + integrated + grown)
        measured, body[5] = body[0], waiting.pop(0)
        return np.array([*(held @ body)[kept], measured, integrated + grown, whole, error, came, went, *waiting])

    return np.array([after(state) for state in np.eye(len(kept) + 6 + timing.delay)]).T


def an_axis(rng: np.random.Generator) -> tuple[dt.ServoAxis, dt.ServoTiming]:
    rotor, load, stiffness = 10 ** rng.uniform(-5.5, -4.0), 10 ** rng.uniform(-1.0, 1.0), 10 ** rng.uniform(3.7, 5.0)
    bare = dt.ServoAxis(0.03, 100.0, rotor, load, stiffness, viscous=rng.choice([0.0, 1e-4]))
    share = rng.choice([0.0, rng.uniform(0.005, 0.05), rng.uniform(0.05, 0.3)])
    axis = replace(bare, spring_damping=2.0 * share * stiffness / resonances(bare)[1])
    timing = dt.ServoTiming(10 ** rng.uniform(2.7, 4.0), 10 ** rng.uniform(-4.0, -2.7), int(rng.integers(0, 3)))
    return (axis if rng.random() < 0.9 else replace(axis, stiffness=None, spring_damping=0.0)), timing


def test_stable_is_what_the_poles_of_the_sampled_loop_say() -> None:
    rng, told = np.random.default_rng(20), []
    for k in range(205):
        axis, timing = an_axis(rng)
        wanted = 10 ** rng.uniform(1.0, 3.0) if k % 3 == 0 else None
        first = dt.design_loops(axis, timing, speed_bandwidth=wanted)
        for design in (first, first.with_notch):
            if design is None:
                continue
            whole = np.linalg.eigvals(a_period(axis, timing, design))
            inner = np.linalg.eigvals(a_period(axis, timing, replace(design, position_gain=0.0)))
            inner = np.delete(inner, np.argmin(abs(inner - 1.0)))  # where the motor stands is nothing to a speed loop
            assert design.stable == (max(abs(whole).max(), abs(inner).max()) < 1.0), (axis, timing, wanted)
            slowest = np.exp(timing.period * max(pole.real for pole in design.poles))
            assert slowest == pytest.approx(abs(whole).max(), abs=1e-7)
            if wanted is None:
                met = design.modulus_margin >= MODULUS_MARGIN
                assert design.limited_by in CHOICES and (met or design.limited_by == SPRING)
            told.append("wanted" if wanted else "notch" if design.notch else "free")
            told[-1] += " settles" if design.stable else ""
    # What is laid out freely settles but for a few undamped springs; of what is asked for much does not.
    assert told.count("free settles") > 120 and told.count("wanted") > 15 and told.count("notch settles") > 20
    assert told.count("notch") == 0


def test_every_crossing_keeps_what_the_modulus_margin_promises() -> None:
    """6 dB and 29 degrees, up and down."""
    rng, seen = np.random.default_rng(21), 0
    for _ in range(12):
        design = dt.design_loops(*an_axis(rng))
        if not design.stable or design.modulus_margin < MODULUS_MARGIN:
            continue
        for margins in (design.speed_margins, design.position_margins):
            assert all(not 0.67 < factor < 1.99 for _, factor in margins.gain)
            assert all(abs(lag) > np.radians(28.9) for _, lag in margins.phase)
            seen += len(margins.gain) + len(margins.phase)
    assert seen > 40


def simulated(
    axis: dt.ServoAxis, timing: dt.ServoTiming, design: LoopDesign, *, lasts: float, away: float = 1e-3,
    amplifier: float | None = None, solver: dt.FixedStep | dt.AdaptiveStep | None = None,
) -> dt.Recording:  # fmt: skip
    """The motor somewhere, its command at rest elsewhere: a step, for a linear loop."""
    motor = dt.Motor("m", 0.3, axis.torque_constant, inductance=1e-4, rotor_inertia=axis.rotor_inertia)
    rest, still = np.zeros((2, 1)), dt.Motion
    effects: list[dt.Effect] = [
        dt.CommandedMotion(still("still", ("joint",), np.array([0.0, lasts]), rest, rest, rest)),
        dt.FullRotor(axis.rotor_inertia, axis.ratio), dt.StiffSupply(1e6),
    ]  # fmt: skip
    gains = (design.position_gain, design.speed_gain, design.integral_time, np.inf)
    if timing.period > 0.0:
        notch = {} if design.notch is None else {
            "notch": design.notch.frequency, "notch_zeros": design.notch.zeros, "notch_poles": design.notch.poles,
        }  # fmt: skip
        effects += [dt.Encoder(), dt.SampledCascade(*gains, timing.period, timing.delay, **notch)]
    else:
        effects.append(dt.CascadeLoop(*gains))
    if amplifier is not None:
        effects += [dt.SampledCurrentLoop(motor, timing.current_bandwidth, amplifier), dt.Winding(motor)]
    elif np.isfinite(timing.current_bandwidth):
        effects.append(dt.CurrentLoop(motor, timing.current_bandwidth))
    else:
        effects.append(dt.MotorCurrent(motor))
    if axis.stiffness is not None:
        gear = dt.Gear("g", axis.ratio, kind="ideal", stiffness_1=axis.stiffness)
        effects.append(dt.FlexibleJoint(gear, axis.spring_damping))
    if axis.viscous:
        effects.append(dt.ViscousFriction(dt.Friction(viscous=axis.viscous), "motor"))
    scene = dt.joint_scene(axis.load_inertia, effects, lasts, position=away)
    return dt.simulate(scene, interval=timing.period or 1e-3, solver=solver)


def step_of(recording: dt.Recording) -> Array:
    angle = recording["joint.motor_position"]
    return 1.0 - angle / angle[0]


@pytest.mark.parametrize("seed", range(5))
def test_a_simulated_step_is_the_one_designed(seed: int) -> None:
    """By the adaptive engine at 1e-8; the fixed one at a tenth of the period is off by its own step, squared."""
    rng = np.random.default_rng(30 + seed)
    axis, timing = an_axis(rng) if seed else (ISSUE, dt.ServoTiming(3000.0, 1e-3, 1))
    plain = dt.design_loops(axis, timing)
    design = plain.with_notch or plain
    assert seed or design.notch is not None
    lasts = 300 * timing.period
    solvers = ((dt.AdaptiveStep(dt.Rodas5P(1e-8)), 1e-7), (dt.FixedStep(timing.period / 10), 1e-2))
    for solver, off in solvers[: 2 if seed < 2 else 1]:
        got = step_of(simulated(axis, timing, design, lasts=lasts, solver=solver))
        expected = control.step_response(closed_loop(axis, timing, design), timing.period * np.arange(len(got)))
        assert np.abs(got - expected.outputs).max() < off, (axis, timing)


def test_an_amplifier_with_samples_is_a_lag_to_the_loops_around_it() -> None:
    """The design knows its bandwidth alone: 2e-3 of the step is what samples of 0.1 ms change here."""
    timing = dt.ServoTiming(3000.0, 5e-4, 0)
    design = dt.design_loops(ISSUE, timing)
    got = step_of(simulated(ISSUE, timing, design, lasts=0.3, amplifier=1e-4, solver=dt.FixedStep(2e-5)))
    expected = control.step_response(closed_loop(ISSUE, timing, design), timing.period * np.arange(len(got)))
    assert np.abs(got - expected.outputs).max() < 2e-3


def test_a_continuous_cascade_steps_as_designed() -> None:
    design = dt.design_loops(ISSUE, dt.ServoTiming(), speed_bandwidth=90.0)
    got = step_of(simulated(ISSUE, dt.ServoTiming(), design, lasts=0.2, solver=dt.AdaptiveStep(dt.Rodas5P(1e-8))))
    expected = control.step_response(closed_loop(ISSUE, dt.ServoTiming(), design), 1e-3 * np.arange(len(got)))
    assert np.abs(got - expected.outputs).max() < 1e-6


def test_at_rest_nothing_hunts_where_the_design_settles_and_all_does_where_it_does_not() -> None:
    """From a micro-radian beside its command, with an amplifier of 10 kHz: 0.2 mA, or what grows without end."""
    timing = dt.ServoTiming(3000.0, 1e-3, 1)
    slow, fast = dt.design_loops(ISSUE, timing), dt.design_loops(ISSUE, timing, speed_bandwidth=97.0)
    assert slow.with_notch is not None
    for design in (slow, slow.with_notch, fast):
        run = simulated(ISSUE, timing, design, lasts=2.0, away=1e-6, amplifier=1e-4, solver=dt.FixedStep(1e-4))
        current = np.abs(run["joint.current"])
        assert bool(current[-200:].max() < 0.1 * current[:200].max()) is design.stable
        assert bool(current[-200:].max() < 1e-6) is design.stable
