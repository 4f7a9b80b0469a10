"""Falling and swinging arms against closed forms, an independent road, and the book's exercise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.errors import InputError
from drivetrain.simulation.passive import simulate_passive
from drivetrain.simulation.recording import Recording
from drivetrain.solvers.solver import DormandPrince54, DormandPrince853, Euler, Rodas5P, RungeKutta4, SemiImplicitEuler

ZERO = np.zeros(6)


def pendulum(mass: float = 2.0, length: float = 0.8) -> Arm:
    """A point mass that hangs at zero, swinging about y."""
    home = np.eye(4)
    home[2, 3] = -length
    return Arm.from_screws([home], [[0, 1, 0, 0, 0, 0]], [mass], [np.zeros((3, 3))], joint_names=["pin"])


def slide() -> Arm:
    return Arm.from_screws([np.eye(4)], [[0, 0, 0, 0, 0, 1.0]], [3.0], [np.zeros((3, 3))], joint_names=["rail"])


def positions(recording: Recording) -> np.ndarray:
    return np.array(list(recording.ending("position").values())).T


@pytest.fixture(scope="module")
def falling() -> np.ndarray:
    """Where the UR5 is after 3 s, by the mass matrix and scipy."""
    arm = load_arm("ur5")

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[6:], forward_dynamics(arm, y[:6], y[6:], ZERO)])

    return solve_ivp(rates, (0.0, 3.0), np.zeros(12), method="DOP853", rtol=1e-12, atol=1e-12).y[:6, -1]


def test_exercise_8_15(falling: np.ndarray) -> None:
    """Euler at 100 Hz is off by 2.25 rad after 3 s and has gained 23.5 J; Runge-Kutta at the same step is not."""
    arm = load_arm("ur5")
    euler = simulate_passive(arm, ZERO, ZERO, 3.0, solver=Euler(0.01))
    assert np.abs(positions(euler)[-1] - falling).max() == pytest.approx(2.25, abs=0.005)
    assert euler["energy_error"][-1] == pytest.approx(23.5, abs=0.05)
    runge = simulate_passive(arm, ZERO, ZERO, 3.0, solver=RungeKutta4(0.01))
    assert np.abs(positions(runge)[-1] - falling).max() < 5e-5
    assert np.abs(runge["energy_error"]).max() < 1e-4
    assert (euler.counters["rates"], runge.counters["rates"]) == (300, 1200)


@pytest.mark.parametrize(
    ("solver", "bound"),
    [
        (DormandPrince853(), 1e-6),
        (DormandPrince54(1e-7, 1e-9), 1e-5),
        (Rodas5P(1e-7, 1e-9), 1e-5),
        (SemiImplicitEuler(0.001), 0.1),
    ],
    ids=repr,
)
def test_every_solver_comes_to_the_same_place(solver: object, bound: float, falling: np.ndarray) -> None:
    recording = simulate_passive(load_arm("ur5"), ZERO, ZERO, 3.0, solver=solver)
    assert np.abs(positions(recording)[-1] - falling).max() < bound


def test_pendulum_has_the_period_of_the_elliptic_integral() -> None:
    arm, swing = pendulum(), 2.5
    period = 4.0 * math.sqrt(0.8 / 9.81) * ellipk(math.sin(0.5 * swing) ** 2)
    recording = simulate_passive(arm, [swing], [0.0], 3.0 * period, interval=period / 4.0)
    np.testing.assert_allclose(recording["pin.position"][::4], swing, atol=1e-6)
    np.testing.assert_allclose(recording["pin.position"][2::4], -swing, atol=1e-6)
    np.testing.assert_allclose(recording["pin.position"][1::2], 0.0, atol=1e-6)
    assert recording.unit("pin.speed") == "rad/s"


def test_slide_falls_freely_and_is_thrown_by_a_force() -> None:
    recording = simulate_passive(slide(), [0.5], [1.0], 2.0)
    t = recording.time
    np.testing.assert_allclose(recording["rail.position"], 0.5 + t - 0.5 * 9.81 * t**2, atol=1e-9)
    np.testing.assert_allclose(recording["rail.acceleration"], -9.81, rtol=1e-12)
    assert (recording.unit("rail.position"), recording.unit("rail.torque")) == ("m", "N")
    jump = 0.7123

    def push(t: float, q: np.ndarray, qd: np.ndarray) -> list[float]:
        return [3.0 * (9.81 + (4.0 if t < jump else -2.0))]

    pushed = simulate_passive(slide(), [0.0], [0.0], 2.0, torque=push, breakpoints=[jump], solver=RungeKutta4(0.05))
    speed = 4.0 * jump - 2.0 * (2.0 - jump)
    assert pushed["rail.speed"][-1] == pytest.approx(speed, abs=1e-12)
    assert pushed["work"][-1] == pytest.approx(1.5 * speed**2 + 3.0 * 9.81 * pushed["rail.position"][-1], abs=1e-9)
    np.testing.assert_allclose(pushed["energy_error"], 0.0, atol=1e-9)


def test_energy_over_a_hundred_seconds() -> None:
    arm = at_level(load_arm("planar-2r"), RotorLevel.NONE)
    recording = simulate_passive(arm, [0.3, 0.2], [0.0, 0.0], 100.0, solver=RungeKutta4(0.002), interval=1.0)
    scale = recording["kinetic_energy"].max()
    assert np.abs(recording["energy_error"]).max() < 1e-6 * scale


def test_geared_arm_keeps_its_energy_at_every_level() -> None:
    bare = load_arm("ur5")
    geared = with_rotors(bare, [Rotor(100.0, 6e-5, 0.3)] * 3 + [Rotor(-80.0, 8e-6, 0.1)] * 3)
    ends = {}
    for level in RotorLevel:
        recording = simulate_passive(at_level(geared, level), ZERO, ZERO, 3.0)
        assert np.abs(recording["energy_error"]).max() < 1e-6
        ends[level] = positions(recording)[-1]
    assert np.abs(ends[RotorLevel.FULL] - ends[RotorLevel.REFLECTED]).max() > 0.01  # what the shortcut costs
    assert np.abs(ends[RotorLevel.REFLECTED] - ends[RotorLevel.NONE]).max() > 0.1


def test_instants_of_the_recording() -> None:
    times = simulate_passive(slide(), [0.0], [0.0], 0.25, interval=0.1).time
    np.testing.assert_allclose(times, [0.0, 0.1, 0.2, 0.25])
    assert len(simulate_passive(slide(), [0.0], [0.0], 0.3, interval=0.1).time) == 4


def test_passing_a_limit_is_an_event() -> None:
    arm = replace(pendulum(), upper=np.array([1.0]), lower=np.array([-9.0]))
    recording = simulate_passive(arm, [0.0], [5.0], 3.0, interval=0.001)
    inside = recording["pin.position"] <= 1.0
    leaving = recording.time[1:][inside[:-1] & ~inside[1:]]
    assert [event.time for event in recording.events] == list(leaving)
    assert len(leaving) >= 1
    assert recording.events[0].detail == "pin passes its upper limit, 1 rad"


def test_divergence_is_a_result_with_instant_and_signal() -> None:
    def shaken(t: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        return 400.0 * qd  # a damper with the wrong sign

    recording = simulate_passive(pendulum(), [0.1], [0.0], 60.0, torque=shaken, solver=RungeKutta4(0.001))
    assert recording.stopped_by is not None
    assert recording.stopped_by.name == "diverged"
    assert "pin" in recording.stopped_by.detail
    assert 0.0 < recording.time[-1] <= recording.stopped_by.time < 2.0


def test_wrong_input() -> None:
    arm = load_arm("ur5")
    with pytest.raises(InputError, match=r"q0(.|\n)*qd0"):
        simulate_passive(arm, np.zeros(5), np.full(6, np.nan), 1.0)
    with pytest.raises(InputError, match="duration"):
        simulate_passive(arm, ZERO, ZERO, -1.0)
    with pytest.raises(InputError, match="interval"):
        simulate_passive(arm, ZERO, ZERO, 1.0, interval=0.0)
    with pytest.raises(InputError, match="torque"):
        simulate_passive(arm, ZERO, ZERO, 1.0, torque=lambda t, q, qd: np.zeros(5))
    with pytest.raises(InputError, match="torque"):
        simulate_passive(arm, ZERO, ZERO, 1.0, torque=3.0)
    light = Arm.from_screws([np.eye(4)], [[0, 0, 1.0, 0, 0, 0]], [1.0], [np.zeros((3, 3))])
    with pytest.raises(InputError, match="moves no inertia"):
        simulate_passive(light, [0.0], [0.0], 1.0)
