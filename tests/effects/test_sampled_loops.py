"""Digital loops: the same numbers as their recursions, stable up to the limit that the recursion has."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import bilinear, lfilter

from drivetrain.drive.motor import Motor, exact_current_step
from drivetrain.effects.control.cascade import CascadeLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.motor.current_loop import SampledCurrentLoop
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding import Winding
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene

MOTOR = Motor(key="m", resistance=0.299, torque_constant=0.0302, inductance=82e-6)
PERIOD, INERTIA = 1e-3, 3.3e-5
STILL = CommandedMotion(Motion("still", ("joint",), np.array([0.0, 1.0]), *(np.zeros((2, 1)) for _ in range(3))))


@pytest.mark.parametrize(("delay", "peak"), [(0, math.inf), (1, 6.0), (2, 4.0)])
def test_a_whole_cascade_is_its_recursion(delay: int, peak: float) -> None:
    """Both gains, integral, notch, delay and limit on a moving command: between samples the torque is held."""
    ratio, whole, period, count = -20.0, 0.02 + 3e-5 * 400.0, 2e-3, 60
    time = np.linspace(0.0, 0.2, 101)
    place, speed = 0.3 * np.sin(40.0 * time), 12.0 * np.cos(40.0 * time)
    still = Motion("m", ("joint",), time, *(x[:, np.newaxis] for x in (place, speed, -1600.0 * place)))
    gain, integral = 0.15 * whole / (400.0 * MOTOR.torque_constant * period), 0.03
    servo = SampledCascade(25.0, gain, integral, peak, period, delay, notch=500.0, notch_zeros=0.2, notch_poles=0.8)
    effects = (ReflectedRotor(3e-5, ratio), MotorCurrent(MOTOR), Encoder(), servo)
    scene = Scene(Inertia(0.02), {"joint": effects, "scene": (CommandedMotion(still),)}, count * period)
    step = period if delay else period / 4.0  # a torque held over a step is exact at any step
    run = simulate(scene, solver=FixedStep(step), interval=period)

    warped = 2.0 / period * math.tan(0.5 * 500.0 * period)
    shapes = ([1.0, 2.0 * share * warped, warped**2] for share in (0.2, 0.8))
    top, bottom = bilinear(*shapes, fs=1.0 / period)
    carried, gathered, waiting = np.zeros(2), 0.0, [0.0] * delay
    q, v = run["joint.position"][0], run["joint.speed"][0]
    before, limited = ratio * (q - period * v), 0
    for k in range(count):
        assert run["joint.position"][k] == pytest.approx(q, abs=1e-10), k
        t = k * period
        wanted = ratio * np.array([0.3 * math.sin(40.0 * t), 12.0 * math.cos(40.0 * t)])
        error = wanted[1] + 25.0 * (wanted[0] - ratio * q) - (ratio * q - before) / period
        before = ratio * q
        (error,), carried = lfilter(top, bottom, [error], zi=carried)
        grown = gain / integral * error
        asked = gain * error + gathered + period * grown
        current = float(np.clip(asked, -peak, peak))
        gathered += period * grown * (current == asked or current * error < 0.0)
        limited += current != asked
        waiting = [*waiting, current]
        push = ratio * MOTOR.torque_constant * waiting.pop(0) / whole
        q, v = q + period * v + 0.5 * period**2 * push, v + period * push
    assert math.isinf(peak) or 5 < limited < count - 5


def test_fast_samples_tend_to_the_continuous_loop() -> None:
    loop, apart = CascadeLoop(20.0, 0.05, 0.02), []
    time = np.linspace(0.0, 0.5, 51)
    shape = 0.5 * (1.0 - np.cos(2.0 * np.pi * time))[:, np.newaxis]
    slope, bend = np.pi * np.sin(2.0 * np.pi * time), 2.0 * np.pi**2 * np.cos(2.0 * np.pi * time)
    moved = CommandedMotion(Motion("wave", ("joint",), time, shape, slope[:, np.newaxis], bend[:, np.newaxis]))
    still = (ReflectedRotor(INERTIA, 10.0), MotorCurrent(MOTOR))

    def end(*more: object) -> float:
        scene = Scene(Inertia(0.01), {"joint": (*still, *more), "scene": (moved,)}, 0.4)
        return float(simulate(scene, solver=FixedStep(2e-4)).series["joint.position"].values[-1])

    smooth = end(loop)
    for period in (4e-3, 1e-3):
        sampled = SampledCascade(20.0, 0.05, 0.02, every=period, delay=0)
        apart.append(abs(end(Encoder(), sampled) - smooth))
    assert apart[1] < 0.4 * apart[0]  # first order in the period


def test_a_coarse_encoder_makes_current_in_whole_counts() -> None:
    gain = 0.2 * INERTIA / (MOTOR.torque_constant * PERIOD)
    effects = (ReflectedRotor(0.0, 1.0), MotorCurrent(MOTOR), Encoder(500), SampledCascade(0.0, gain, delay=0))
    scene = Scene(Inertia(INERTIA), {"joint": effects, "scene": (STILL,)}, 0.1, speed=[3.0])
    current = simulate(scene, interval=PERIOD).series["joint.current_command"].values
    counts = current / (gain * 2.0 * math.pi / 500 / PERIOD)
    # The first sample counts from where it would have been, between two counts.
    assert counts[2:] == pytest.approx(np.round(counts[2:]), abs=1e-9)
    assert len(np.unique(np.round(counts[2:]))) > 1


def test_a_sampled_current_loop_is_its_recursion() -> None:
    """At 10 kHz, through the limit of voltage and the slew, with the winding stepped exactly between samples."""
    loop = SampledCurrentLoop(MOTOR, 3000.0, slew=2e5)
    given = GivenCurrent(np.array([0.0, 1e-3, 1e-3, 4e-3, 4e-3]), np.array([0.0, 0.0, 60.0, 60.0, 5.0]))
    effects = (ReflectedRotor(0.0, 1.0), Winding(MOTOR), loop, given)
    scene = Scene(Inertia(1e30), {"joint": effects, "scene": (StiffSupply(12.0),)}, 0.01)
    run = simulate(scene, solver=FixedStep(1e-3), interval=1e-4)
    kp, ki = 82e-6 * 3000.0, 0.299 * 3000.0 * 1e-4
    current, integral, reference, expected = 0.0, 0.0, 0.0, []
    for sample in range(101):
        expected.append(current)
        command = 0.0 if sample < 10 else 60.0 if sample < 40 else 5.0
        reference += np.clip(command - reference, -20.0, 20.0)
        wanted = kp * (reference - current) + integral + ki * (reference - current)
        volts = np.clip(wanted, -12.0, 12.0)
        integral += ki * (reference - current) + (volts - wanted) * ki / kp
        current = float(exact_current_step(MOTOR, current, volts, 0.0, 1e-4).end)
    assert run.series["joint.current"].values == pytest.approx(np.array(expected), abs=1e-9)
    assert max(expected) > 12.0 / 0.299 * 0.9  # the limit was reached
    assert expected[-1] == pytest.approx(5.0, rel=1e-3)


def test_a_sampled_current_loop_reads_the_current_of_the_instant() -> None:
    """A rotor that speeds up, with a winding faster than the samples: exact between samples by a matrix exponential."""
    motor = replace(MOTOR, inductance=8.2e-6)
    resistance, inductance, constant = 0.299, 8.2e-6, 0.0302
    given = GivenCurrent(np.array([0.0, 1.0]), np.array([2.0, 2.0]))
    effects = (ReflectedRotor(0.0, 1.0), Winding(motor), SampledCurrentLoop(motor, 3000.0), given)
    scene = Scene(Inertia(INERTIA), {"joint": effects, "scene": (StiffSupply(24.0),)}, 0.01)
    run = simulate(scene, interval=1e-4)
    kp, ki = inductance * 3000.0, resistance * 3000.0 * 1e-4
    rates = [
        [-resistance / inductance, -constant / inductance, 1.0 / inductance],
        [constant / INERTIA, 0, 0],
        [0, 0, 0],
    ]
    after, state, integral = expm(1e-4 * np.array(rates))[:2], np.array([2.0, 0.0]), 2.0 * resistance
    for sample in range(101):
        # half a step of back-emf would be 4.5 mA
        assert run["joint.current"][sample] == pytest.approx(state[0], abs=3e-4), sample
        error = 2.0 - state[0]
        integral += ki * error
        state = after @ [*state, kp * error + integral + constant * state[1]]


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        SampledCascade(-1.0, math.nan, 0.0, 0.0, every=0.0, delay=7)
    assert len(error.value.faults) == 6
    with pytest.raises(InputError, match="diverges from sample to sample"):
        SampledCurrentLoop(MOTOR, 3e4)
    with pytest.raises(InputError, match="whole number"):
        Encoder(0)
