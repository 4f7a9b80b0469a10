"""Stiff parts of a scene, far faster than any step one wants: springs, light rotors, windings, beside slow heat."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from hard_case import Figure, hard_case
from scipy.integrate import solve_ivp

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenCurrent, GivenVoltage
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding import Winding
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.solvers.solver import Rodas4, Solver

LINK, SHAFT, RATIO = 1.0, 0.002, 100.0  # kg m^2, kg m^2 at the joint, -


def gear(stiffness: float) -> Gear:
    """A gear with one spring."""
    return Gear("g", RATIO, stiffness_1=stiffness)


def frequency(stiffness: float) -> float:
    """Of link against rotor [rad/s]."""
    return math.sqrt(stiffness * (1.0 / LINK + 1.0 / SHAFT))


def released(stiffness: float, duration: float, solver: Engine | Solver, interval: float) -> Recording:
    """A spring wound up by 10 N m from both sides, and let go after a millisecond."""
    until = [0.0, 1e-3, 1e-3]
    pulls = [GivenTorque(until, [-10.0, -10.0, 0.0]), GivenTorque(until, [10.0 / RATIO, 10.0 / RATIO, 0.0], "motor")]
    effects = [ReflectedRotor(SHAFT / RATIO**2, RATIO), FlexibleJoint(gear(stiffness)), *pulls]
    return simulate(joint_scene(LINK, effects, duration), solver=solver, interval=interval)


def leapfrog(stiffness: float, step: float, count: int) -> tuple[float, float]:
    """Largest twist over the first, and energy over the first, by semi-implicit Euler, as simulators take it."""
    twist, speed, largest, rate = 1.0, 0.0, 1.0, stiffness * (1.0 / LINK + 1.0 / SHAFT)
    for _ in range(count):
        speed -= step * rate * twist
        twist += step * speed
        largest = max(largest, abs(twist))
        if largest > 1e30:
            return math.inf, math.inf
    return largest, twist**2 + speed**2 / rate


@hard_case(
    "T18",
    "Stiff springs on a light rotor",
    setup=(
        "Springs of 1e4, 1e5 and 1e6 N m/rad between inertias of 1 and 0.002 kg m², with natural frequencies up "
        "to 22 000 rad/s. E1 at 1 ms, E2 over 100 oscillations."
    ),
    naive="semi-implicit Euler at 1 ms",
)
def test_stiff_springs() -> list[Figure]:
    largest, naive, slow, energy = 0.0, 0.0, 0.0, 0.0
    for stiffness in (1e4, 1e5, 1e6):
        run = released(stiffness, 2.0, FixedStep(1e-3), 1e-3)
        largest = max(largest, float(np.abs(run["joint.deflection"]).max()) * stiffness / 10.0)
        naive = max(naive, leapfrog(stiffness, 1e-3, 2000)[0])
        w = frequency(stiffness)
        run = released(stiffness, 1e-3 + 200.0 * math.pi / w, Rodas4(1e-9), math.pi / 8.0 / w)
        late = run.time >= 1e-3
        swing = np.arctan2(-run["joint.deflection_speed"][late] / w, run["joint.deflection"][late])
        phase, time = np.unwrap(swing), run.time[late]
        slow = max(slow, abs((phase[-1] - phase[0]) / (time[-1] - time[0]) / w - 1.0))
        stored = run["stored_energy"][late]
        energy = max(energy, float(np.abs(stored / stored[0] - 1.0).max()))
    return [
        Figure("largest wind-up relative to the initial one (E1)", largest, naive, at_most=1.0 + 1e-9),
        Figure("relative error of the frequency (E2)", slow, at_most=1e-3),
        Figure("relative change of the energy (E2)", energy, at_most=1e-6),
    ]


def driven(stiffness: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Where a smooth push of a second takes link and motor [rad at the joint]; without stiffness: rigid."""
    time = np.linspace(0.0, 1.0, 201)
    push = GivenTorque(time, 2.5 * (1.0 - np.cos(2.0 * np.pi * time)) / RATIO, "motor")
    effects = [ReflectedRotor(3e-5, RATIO), push, ViscousFriction(Friction(viscous=1.0))]
    if stiffness is not None:
        effects.append(FlexibleJoint(gear(stiffness), 0.04 * math.sqrt(0.23 * stiffness)))
    run = simulate(joint_scene(LINK, effects, 1.0), solver=Rodas4(1e-9), interval=0.01)
    return run["joint.position"], run["joint.motor_position"] / RATIO


def explicit_error(stiffness: float) -> float:
    """Of the link with RK4 at 1 ms: a spring that grows stiffer takes it away instead of nearer."""
    damping, far = 0.04 * math.sqrt(0.23 * stiffness), 0.0

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        link, shaft, v, u = y
        torque = stiffness * (shaft - link) + damping * (u - v)
        push = 2.5 * (1.0 - math.cos(2.0 * math.pi * t))
        return np.array([v, u, torque - v, (push - torque) / 0.3])

    y, h = np.zeros(4), 1e-3
    for k in range(1000):
        t = k * h
        k1 = rates(t, y)
        k2 = rates(t + h / 2, y + h / 2 * k1)
        k3 = rates(t + h / 2, y + h / 2 * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(t + h, y + h * k3))
        far = max(far, float(np.abs(y).max()))
        if not far < 1e6:
            return math.inf
    return far


def order_of(error: Callable[[float], float], first: float, last: float) -> float:
    """The power with which an error follows a parameter."""
    return math.log(error(first) / error(last)) / math.log(first / last)


@hard_case(
    "T19a",
    "An increasingly stiff spring approaches the rigid joint",
    setup=(
        "Springs from 1e4 to 1e7 N m/rad, a push of 1 s. The difference from the rigid joint must fall with "
        "1/K. E2 with a tolerance of 1e-9."
    ),
    naive="RK4 at 1 ms with 1e7 N m/rad",
)
def test_stiffness_to_infinity() -> list[Figure]:
    rigid, _ = driven(None)

    def link(compliance: float) -> float:
        return float(np.abs(driven(1.0 / compliance)[0] - rigid).max())

    def motor(compliance: float) -> float:
        return float(np.abs(driven(1.0 / compliance)[1] - rigid).max())

    return [
        Figure(
            "difference of the order in 1/K from 1 (link)", abs(order_of(link, 1e-4, 1e-7) - 1.0), math.inf, at_most=0.1
        ),
        Figure(
            "difference of the order in 1/K from 1 (motor)",
            abs(order_of(motor, 1e-4, 1e-7) - 1.0),
            explicit_error(1e7),
            at_most=0.1,
        ),
    ]


def spun(inductance: float) -> np.ndarray:
    """Speed of a motor under a wave of voltage, E1 at 1 ms."""
    time = np.linspace(0.0, 0.3, 301)
    volts = GivenVoltage(time, 12.0 * np.sin(2.0 * np.pi * time / 0.3) ** 2)
    effects = [ReflectedRotor(3.3e-5), Winding(Motor("m", 0.299, 0.0302, inductance=inductance)), volts]
    return simulate(joint_scene(0.0, effects, 0.3), interval=0.01)["joint.speed"]


@hard_case(
    "T19b",
    "A vanishing inductance approaches the current without inductance",
    setup="Inductances from 1e-4 to 1e-7 H at 0.299 ohm and a sinusoidal voltage of 12 V. E1 at 1 ms.",
    naive="explicit Euler at 1 ms with 1e-4 H",
)
def test_inductance_to_zero() -> list[Figure]:
    limit = spun(1e-15)
    time = np.linspace(0.0, 0.3, 31)

    def rates(t: float, y: np.ndarray) -> list[float]:
        volts = np.interp(t, np.linspace(0, 0.3, 301), 12.0 * np.sin(np.linspace(0, 2 * np.pi, 301)) ** 2)
        return [0.0302 * (volts - 0.0302 * y[0]) / 0.299 / 3.3e-5]

    quasi = solve_ivp(rates, (0.0, 0.3), [0.0], t_eval=time, rtol=1e-9, atol=1e-9, max_step=1e-3).y[0]
    order = order_of(lambda inductance: float(np.abs(spun(inductance) - limit).max()), 1e-4, 1e-7)
    current = 0.0
    for k in range(300):
        current += 1e-3 / 1e-4 * (12.0 * math.sin(2.0 * math.pi * k / 300.0) ** 2 - 0.299 * current)
    naive = abs(current) if abs(current) < 1e30 else math.inf
    return [
        Figure("difference of the order in L from 1", abs(order - 1.0), naive, at_most=0.1),
        # The step's own error: second order, 1 ms against the motor's 11 ms.
        Figure(
            "relative difference of the limit from scipy's quasi-static solution",
            float(np.abs(limit - quasi).max() / quasi.max()),
            at_most=1e-3,
        ),
    ]


@hard_case(
    "T47",
    "L/R of 10 µs together with heating over 1000 s",
    setup=(
        "A duty cycle of 9 and 0.5 A for an hour with a temperature-dependent resistance, whose runaway gain is "
        "0.4. E1 at 2 ms."
    ),
    naive="explicit Euler of the winding at 2 ms",
)
def test_nine_decades() -> list[Figure]:
    motor = Motor("m", 0.3, 0.03, inductance=3e-6)
    network = ThermalNetwork(1.0, 3.0, 30.0, 333.0, 25.0)
    starts = np.arange(0.0, 3600.0, 20.0)
    time = np.ravel([[t, t + 6.0, t + 6.0, t + 20.0] for t in starts])
    given = GivenCurrent(time, np.ravel([[9.0, 9.0, 0.5, 0.5] for _ in starts]))
    held = DryFriction(Friction(coulomb=10.0), "motor")
    effects = {"joint": (held, CurrentLoop(motor, 6283.0), WindingHeat(network), given), "scene": (StiffSupply(24.0),)}
    run = simulate(Scene(Inertia(1.0), effects, 3600.0), solver=FixedStep(2e-3), interval=20.0)

    def heat(t: float, y: np.ndarray, amperes: float) -> list[float]:
        across = (y[0] - y[1]) / 1.0
        return [(0.3 * (1 + 0.0039 * (y[0] - 25.0)) * amperes**2 - across) / 30.0, (across - (y[1] - 25) / 3.0) / 333.0]

    state = np.array([25.0, 25.0])
    for t in starts:
        for first, last, amperes in ((t, t + 6.0, 9.0), (t + 6.0, t + 20.0, 0.5)):
            state = solve_ivp(heat, (first, last), state, args=(amperes,), rtol=1e-9, atol=1e-9).y[:, -1]
    current = 0.0
    for _ in range(200):
        current = min(abs(current + 2e-3 / 3e-6 * (2.7 - 0.3 * current)), 1e300)
    return [
        Figure("error of the current", abs(run["joint.current"][-1] - 0.5), math.inf if current > 1e30 else current,
               at_most=1e-9, unit="A"),
        # As of T13: 0.2 K where the losses are averaged on the clock of the heat.
        Figure("error of the winding temperature", abs(float(run["joint.winding_temperature"][-1]) - state[0]),
               at_most=0.2, unit="K"),
    ]  # fmt: skip


@hard_case(
    "T48",
    "A spring of 1e6 N m/rad on a rotor of 1e-6 kg m²",
    setup=(
        "A link of 1 kg m² is pulled with up to 4 N m for a second; the mode has 1e6 rad/s and 5 % damping. E1 "
        "at 1 ms, and E2."
    ),
    naive="RK4 at 10 µs",
)
def test_spring_on_nothing() -> list[Figure]:
    stiff, light, damping = 1e6, 1e-6, 0.1
    effects = [ReflectedRotor(light), FlexibleJoint(Gear("g", 1.0, stiffness_1=stiff), damping)]
    scene = joint_scene(1.0, [*effects, GivenTorque([0.0, 0.5, 1.0], [0.0, 4.0, 0.0])], 1.5)
    figures = []
    for name, solver, limit in (("E1", FixedStep(1e-3), 1e-5), ("E2", Rodas4(1e-8), 1e-6)):
        run = simulate(scene, solver=solver, interval=0.1)
        # E1 takes one step wholly implicit after the bend of the torque: h^2 a / 2 = 2e-6 rad.
        # Both as one body, but for a twist of light / (1 + light) * 4 / stiff.
        off = abs(run["joint.position"][-1] * (1.0 + light) - 2.0)
        figures.append(Figure(f"error of the link's final position ({name})", float(off), at_most=limit, unit="rad"))
        assert run.counters["steps"] < 10_000

    y, h = np.array([0.0, 0.0]), 1e-5
    flow = np.array([[0.0, 1.0], [-stiff * (1 + 1 / light), -damping * (1 + 1 / light)]])
    for _ in range(100):
        k1 = flow @ y + [0.0, 2.0]
        k2 = flow @ (y + h / 2 * k1) + [0.0, 2.0]
        k3 = flow @ (y + h / 2 * k2) + [0.0, 2.0]
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + flow @ (y + h * k3) + [0.0, 2.0])
        if np.abs(y).max() > 1e30:
            break
    naive = math.inf if np.abs(y).max() > 1e30 else float(np.abs(y[0]))
    twist = float(np.abs(run["joint.deflection"]).max())
    return [*figures, Figure("largest wind-up", twist, naive, at_most=1e-9, unit="rad")]
