"""Control loops at their limits: saturation, samples, hunting about a stuck joint, divergence, the first instants."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from hard_case import Figure, hard_case
from scipy.integrate import solve_ivp

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import CascadeLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene
from drivetrain.solvers.solver import Rodas4, Solver

MOTOR = Motor(key="typical", resistance=0.299, torque_constant=0.0302, inductance=82e-6)
ROTOR, PERIOD = 3.3e-5, 1e-3  # kg m^2, s


def command(start: float, speed: float = 0.0) -> CommandedMotion:
    """A straight line of one second."""
    time = np.array([0.0, 1.0])
    place, fast = (start + speed * time)[:, None], np.full((2, 1), speed)
    return CommandedMotion(Motion("line", ("joint",), time, place, fast, np.zeros((2, 1))))


def settled(time: np.ndarray, values: np.ndarray, wanted: float, band: float) -> float:
    """When it comes within a band for good."""
    off = np.flatnonzero(np.abs(values - wanted) > band)
    return float(time[min(off[-1] + 1, len(time) - 1)]) if len(off) else 0.0


def euler(rates: Callable[[float, np.ndarray], list[float]], state: list[float], step: float, count: int) -> np.ndarray:
    """States after each of many short explicit steps."""
    states, x = np.empty((count + 1, len(state))), np.array(state)
    for k in range(count + 1):
        states[k] = x
        x = x + step * np.array(rates(k * step, x))
    return states


@hard_case(
    "T16a",
    "A current that the voltage cannot reach for 20 ms",
    setup="125 A are commanded at 24 V and 0.299 ohm, then 5 A. The current loop has 1 kHz. E1.",
    naive="PI controller with a clipped voltage",
)
def test_anti_windup_of_the_current() -> list[Figure]:
    width = 2.0 * math.pi * 1000.0
    given = GivenCurrent(np.array([0.0, 0.02, 0.02]), np.array([125.0, 125.0, 5.0]))
    held = (ReflectedRotor(0.0, 1.0), CurrentLoop(MOTOR, width), given)
    scene = Scene(Inertia(1e30), {"joint": held, "scene": (StiffSupply(24.0),)}, 0.05)
    run = simulate(scene, solver=FixedStep(1e-4), interval=1e-4)
    assert run["joint.current"].max() <= 24.0 / 0.299 * (1.0 + 1e-12)

    def clipped(t: float, y: np.ndarray) -> list[float]:
        error = (125.0 if t < 0.02 else 5.0) - y[0]
        volts = 82e-6 * width * error + y[1]
        return [(max(-24.0, min(volts, 24.0)) - 0.299 * y[0]) / 82e-6, 0.299 * width * error]

    naive, band = euler(clipped, [0.0, 0.0], 2e-6, 25_000), 0.02 * 75.0
    return [
        Figure("settling time", 1e3 * (settled(run.time, run["joint.current"], 5.0, band) - 0.02),
               1e3 * (settled(2e-6 * np.arange(25_001), naive[:, 0], 5.0, band) - 0.02), at_most=1.5, unit="ms"),
    ]  # fmt: skip


@hard_case(
    "T16b",
    "A speed step that exceeds the peak current",
    setup=(
        "A step of 300 rad/s needs the peak current of 10 A for 33 ms; the speed controller is a PI with an "
        "integral time of 20 ms. E1 and E2."
    ),
    naive="PI controller with a clipped current",
)
def test_anti_windup_of_the_speed() -> list[Figure]:
    loop = CascadeLoop(0.0, 0.3, 0.02, peak_current=10.0)
    drive = (ReflectedRotor(ROTOR, 1.0), MotorCurrent(MOTOR), loop)
    effects = {"joint": drive, "scene": (command(0.0, 300.0),)}
    scene = Scene(Inertia(0.0), effects, 0.4, position=[0.0], speed=[0.0])
    fixed, adaptive = (simulate(scene, solver=s, interval=1e-3)["joint.speed"] for s in (FixedStep(), Rodas4()))

    def clipped(t: float, y: np.ndarray) -> list[float]:
        error = 300.0 - y[0]
        return [0.0302 * max(-10.0, min(0.3 * error + y[1], 10.0)) / ROTOR, 0.3 / 0.02 * error]

    naive = euler(clipped, [0.0, 0.0], 2e-5, 20_000)[:, 0]
    # 5 %, the overshoot of a well-tuned loop; settling as far as the current allows: J w / (kt I) = 32.8 ms.
    return [
        Figure("overshoot (E1)", fixed.max() / 300.0 - 1.0, naive.max() / 300.0 - 1.0, at_most=0.05),
        Figure("overshoot (E2)", adaptive.max() / 300.0 - 1.0, at_most=0.05),
        Figure("settling time", settled(np.linspace(0.0, 0.4, 401), fixed, 300.0, 6.0),
               settled(2e-5 * np.arange(20_001), naive, 300.0, 6.0), at_most=0.04, unit="s"),
    ]  # fmt: skip


def sampled(gain: float, delay: int, duration: float, solver: Engine | Solver) -> Recording:
    """A rotor that a sampled speed loop is to hold still; the gain as a share of J / (kt T)."""
    servo = SampledCascade(0.0, gain * ROTOR / (MOTOR.torque_constant * PERIOD), every=PERIOD, delay=delay)
    effects = (ReflectedRotor(ROTOR, 1.0), MotorCurrent(MOTOR), Encoder(None), servo)
    scene = Scene(Inertia(0.0), {"joint": effects, "scene": (command(0.0),)}, duration, position=[0.0], speed=[1e-3])
    return simulate(scene, solver=solver, interval=PERIOD)


def limit_found(delay: int) -> float:
    """The gain from which on the simulated loop grows, by halving."""
    low, high = 0.1, 4.0
    for _ in range(10):
        middle = 0.5 * (low + high)
        speed = np.abs(sampled(middle, delay, 0.4, FixedStep(PERIOD))["joint.speed"])
        low, high = (low, middle) if len(speed) < 400 or speed[-40:].max() > speed[40:80].max() else (middle, high)
    return 0.5 * (low + high)


def continuous_holds(gain: float) -> bool:
    """Whether the same loop without samples comes to rest."""
    loop = CascadeLoop(0.0, gain * ROTOR / (MOTOR.torque_constant * PERIOD))
    effects = (ReflectedRotor(ROTOR, 1.0), MotorCurrent(MOTOR), loop)
    scene = Scene(Inertia(0.0), {"joint": effects, "scene": (command(0.0),)}, 0.4, position=[0.0], speed=[1e-3])
    return bool(abs(simulate(scene)["joint.speed"][-1]) < 1e-3)


@hard_case(
    "T17",
    "Gain limit of a sampled speed loop",
    setup=(
        "The loop runs at 1 kHz without a delay and with a delay of one sample; the limit of K T / J is found "
        "by bisection. E1."
    ),
    naive="the continuous loop, tested up to 100 times the limit",
)
def test_limit_of_sampled_loops() -> list[Figure]:
    naive = math.inf if all(continuous_holds(gain) for gain in (1.0, 2.5, 10.0, 200.0)) else 0.0
    # Roots of z^2 - z + a/2 (z + 1) = 0 and of z^3 - z^2 + a/2 (z + 1) = 0 on the unit circle.
    exact = (2.0, 2.0 * (math.sqrt(2.0) - 1.0))
    return [
        Figure(
            f"relative error of the limit with{'out a delay' if d == 0 else ' a delay of one sample'}",
            abs(limit_found(d) / exact[d] - 1.0),
            naive,
            naive_says="no limit",
            at_most=0.01,
        )
        for d in (0, 1)
    ]


def hunting(solver: Engine) -> float:
    """Amplitude of a servo with an integral that hunts about its target for ever."""
    law, loop = Friction(coulomb=1.0, static=2.0, stribeck_speed=0.05), CascadeLoop(2.0, 6.0, 0.2)
    effects = (MotorCurrent(Motor("m", 0.5, 1.0)), loop, DryFriction(law))
    scene = Scene(Inertia(1.0), {"joint": effects, "scene": (command(1.0),)}, 60.0, position=[0.0], speed=[0.0])
    run = simulate(scene, solver=solver)
    return float(np.ptp(run["joint.position"][run.time > 30.0]))


def smooth_hunting(width: float) -> float:
    """The same with friction rounded off at rest."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        error = 2.0 * (1.0 - y[0]) - y[1]
        level = 1.0 + math.exp(-((y[1] / 0.05) ** 2))
        return [y[1], 6.0 * error + y[2] - level * math.tanh(y[1] / width), 30.0 * error]

    run = solve_ivp(
        rates, (0.0, 60.0), [0.0] * 3, method="LSODA", rtol=1e-8, atol=1e-10, t_eval=np.arange(30, 60, 0.01)
    )
    return float(np.ptp(run.y[0]))


@hard_case(
    "T11",
    "A servo with integral action hunts under Stribeck friction",
    setup=(
        "The friction falls from 2 to 1 N m with speed. The amplitude after 60 s must not depend on the step of "
        "E1: 1 ms and 0.5 ms."
    ),
    naive="friction multiplied by tanh(speed / width), with a width of 20 and of 10 mrad/s",
)
def test_hunting() -> list[Figure]:
    whole, half = hunting(FixedStep(1e-3)), hunting(FixedStep(5e-4))
    smooth, smoother = smooth_hunting(0.02), smooth_hunting(0.01)
    assert half > 0.03  # it does hunt
    return [
        Figure("relative change of the amplitude", abs(whole / half - 1.0), abs(smooth / smoother - 1.0), at_most=0.02)
    ]


@hard_case(
    "T50",
    "A diverging controller is reported with instant and signal",
    setup="A sampled speed loop at 1.25 and 2.4 times its gain limit. E1 and E2.",
    naive="the recursion itself for 2 s",
)
def test_divergence_is_told() -> list[Figure]:
    silent, wrong, naive = 0, 0, 0
    for gain, delay in ((2.5, 0), (2.0, 1)):
        for solver in (FixedStep(PERIOD), Rodas4()):
            run = sampled(gain, delay, 2.0, solver)
            told = run.stopped_by
            fine = told is not None and told.name == "diverged" and "joint.sampled_current" in told.detail
            silent += int(not fine or told is None or not 0.05 < told.time < 1.0)
            wrong += sum(int(not (np.abs(one.values) < 1e31).all()) for one in run.series.values())
        speed, place, before, waiting = 1e-3, 0.0, -1e-6, [0.0] * (delay + 1)
        for _ in range(2000):
            waiting = [*waiting[1:], -gain * (place - before) / PERIOD]
            before, place, speed = place, place + PERIOD * (speed + 0.5 * waiting[0]), speed + waiting[0]
        naive += int(not abs(speed) < 1e31)
    return [
        Figure("diverging runs without a report", float(silent), float(2 * naive), at_most=0.0),
        Figure("series with values beyond any use", float(wrong), at_most=0.0),
    ]


def loaded(solver: Engine | Solver) -> Recording:
    """A motor that holds a weight through a spring, its current commanded to do just that."""
    gear = Gear("hd", 100.0, kind="strain_wave", stiffness_1=2e4)
    amperes = 19.6 / (100.0 * MOTOR.torque_constant)
    drive: tuple[Effect, ...] = (
        ReflectedRotor(ROTOR, 100.0), FlexibleJoint(gear, 2.0), CurrentLoop(MOTOR, 6283.0),
        GivenCurrent([0.0], [amperes]),
    )  # fmt: skip
    scene = Scene(Inertia(1.0, weight=19.6), {"joint": drive, "scene": (StiffSupply(24.0),)}, 0.05)
    return simulate(scene, solver=solver, interval=1e-4)


@hard_case(
    "T52",
    "No transient at the start",
    setup=(
        "6.5 A hold 19.6 N m through a spring of 2e4 N m/rad, with a current loop of 1 kHz. E1 and E2 must "
        "start in equilibrium."
    ),
    naive="all states start from zero (Radau)",
)
def test_no_initial_layer() -> list[Figure]:
    wanted = 19.6 / (100.0 * MOTOR.torque_constant)

    def rates(t: float, y: np.ndarray) -> list[float]:
        current, integral, twist, link, shaft = y
        torque = 2e4 * twist + 2.0 * (shaft - link)
        emf = 0.0302 * 100.0 * shaft
        volts = 82e-6 * 6283.0 * (wanted - current) + integral + emf
        return [
            (volts - 0.299 * current - emf) / 82e-6, 0.299 * 6283.0 * (wanted - current), shaft - link,
            torque - 19.6, (3.02 * current - torque) / (ROTOR * 1e4),
        ]  # fmt: skip

    naive = solve_ivp(rates, (0.0, 0.05), [0.0] * 5, method="Radau", rtol=1e-8, atol=1e-10).y
    figures = []
    for name, solver in (("E1", FixedStep(1e-3)), ("E2", Rodas4())):
        run = loaded(solver)
        first = name == "E1"
        figures += [
            Figure(f"relative change of the current ({name})", float(np.ptp(run["joint.current"])) / wanted,
                   float(np.ptp(naive[0])) / wanted if first else None, at_most=1e-6),
            Figure(f"speed ({name})", float(np.abs(run["joint.speed"]).max()),
                   float(np.abs(naive[3]).max()) if first else None, at_most=1e-6, unit="rad/s"),
        ]  # fmt: skip
    return figures
