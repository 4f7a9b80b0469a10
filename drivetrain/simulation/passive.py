"""Simulation of an arm without drives: under gravity and given joint torques, rotors included."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, checked_array
from drivetrain.dynamics.energy import kinetic_energy, potential_energy
from drivetrain.dynamics.forward import forward_dynamics, unchecked_accelerations
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.simulation.recording import Event, Recording, Series, energy_event
from drivetrain.solvers.integrate import Rates, integrate
from drivetrain.solvers.solver import DormandPrince853, Solution, Solver, check_positive

TorqueLaw = Callable[[float, Array, Array], Any]
DEFAULT_SOLVER = DormandPrince853()
DEFAULT_INTERVAL = 0.01  # s
LARGEST_SPEED = 1e6  # largest initial speed [rad/s or m/s]
LONGEST_DURATION = 1e9  # longest duration, thirty years [s]
MOST_ROWS = 1e8  # output rows of a recording
LARGEST_STATE = 1e60  # a larger state counts as diverged; its squares and products are still finite


def simulate_passive(
    arm: Arm,
    q0: Any,
    qd0: Any,
    duration: float,
    *,
    solver: Solver = DEFAULT_SOLVER,
    torque: TorqueLaw | None = None,
    breakpoints: Sequence[float] = (),
    interval: float = DEFAULT_INTERVAL,
) -> Recording:
    """The motion of an arm from a given state, under gravity and given joint torques; no friction, no losses.

    Accelerations come from the articulated-body algorithm, so the computing time is linear in the number of joints.

    Args:
        arm: Arm, with or without rotors, at any level.
        q0, qd0: Initial positions and speeds [rad or m, and per s], (n,).
        duration: Duration of the run [s].
        solver: Integration method.
        torque: Called with (t [s], q [rad or m], qd [rad/s or m/s]), returns the generalised joint torques [N m; N at a
            prismatic joint], (n,). None: no torques.
        breakpoints: Times at which the torque law jumps [s]; no step crosses one.
        interval: Time between two output rows [s]; the last row is at the end.

    Returns:
        ``<joint>.position``, ``.speed``, ``.acceleration`` and ``.torque``; ``kinetic_energy``, ``potential_energy``,
        ``work`` (of the torques) and ``energy_error`` (total energy minus work minus initial energy, the error of the
        solver) [J]. Events: a joint passes a limit of its position.

    Raises:
        InputError: Wrong shapes, NaN, a duration that is not positive, a joint that moves no inertia.

    Reference: Modern Robotics, section 8.5 and exercise 8.15.
    """
    start = checked_start(arm, q0, qd0)
    times = recorded_times(duration, interval)
    rates = _rates(arm, torque)
    state = np.concatenate([start, [0.0]])
    law = checked_law(arm, torque, start)
    solution = up_to_divergence(integrate(solver, rates, state, times, breakpoints=breakpoints))
    about = {"arm": arm.name, "rotors": str(arm.level), "solver": str(solver), "duration": f"{duration:g} s"}
    return record(arm, solution, law, about)


def checked_start(arm: Arm, q0: Any, qd0: Any) -> Array:
    """Initial positions and speeds in one vector, (2 n,), checked."""
    faults = Faults()
    position = faults.attempt(checked_array, q0, (arm.n,), "q0")
    speed = faults.attempt(checked_array, qd0, (arm.n,), "qd0")
    faults.raise_any()
    assert position is not None and speed is not None
    worst = int(np.argmax(np.abs(speed)))
    if abs(speed[worst]) > LARGEST_SPEED:
        raise InputError(Fault(f"qd0[{worst}]", f"is no speed of an arm, above {LARGEST_SPEED:g}", float(speed[worst])))
    return np.concatenate([position, speed])


def recorded_times(duration: float, interval: float) -> Array:
    """The output times of a recording [s], evenly spaced, with the end as the last, (N,)."""
    check_positive("duration", duration, "s")
    check_positive("interval", interval, "s")
    if duration > LONGEST_DURATION:
        raise InputError(Fault("duration", f"is more than {LONGEST_DURATION:g} s", duration))
    if not duration / interval <= MOST_ROWS:
        problem = f"makes {duration / interval:.3g} instants of {interval:g} s, more than {MOST_ROWS:g}"
        raise InputError(Fault("duration", problem, duration, "record at longer intervals"))
    whole = int(np.floor(duration / interval * (1.0 + 1e-12)))
    times: Array = interval * np.arange(whole + 1.0)
    return times if duration - times[-1] <= 1e-9 * duration else np.append(times, duration)


def up_to_divergence(solution: Solution) -> Solution:
    """The solution up to the last row before a state exceeds ``LARGEST_STATE``, with that as the reason to stop."""
    diverged = np.flatnonzero((np.abs(solution.states) > LARGEST_STATE).any(axis=1))
    if not len(diverged):
        return solution
    keep = max(1, int(diverged[0]))
    fault_index = int(np.argmax(np.abs(solution.states[diverged[0]])))
    stopped = solution.stopped or "the state grows beyond all bounds: it diverges; try a shorter step"
    at = float(solution.times[diverged[0]])
    return Solution(solution.times[:keep], solution.states[:keep], solution.work, stopped, at, fault_index)


def record(arm: Arm, solution: Solution, torque: TorqueLaw | None, about: dict[str, str]) -> Recording:
    """The recording of an arm's motion, with its energies and events."""
    n, times = arm.n, solution.times
    q, qd, work = solution.states[:, :n], solution.states[:, n : 2 * n], solution.states[:, 2 * n]
    given = np.zeros(q.shape)
    if torque is not None:
        given = np.array([torque(t, x, v) for t, x, v in zip(times, q, qd, strict=True)], dtype=np.float64)
    series = joint_series(arm, q, qd, forward_dynamics(arm, q, qd, given), given)
    kinetic, potential = kinetic_energy(arm, q, qd), potential_energy(arm, q)
    energy = kinetic + potential - work
    for name, values in {
        "kinetic_energy": kinetic,
        "potential_energy": potential,
        "work": work,
        "energy_error": energy - energy[0],
    }.items():
        series[name] = Series("J", values)
    counters = {"rates": solution.work.rates, "steps": solution.work.steps, "restarts": solution.work.restarts}
    passed = float(max(np.ptp(kinetic), np.ptp(potential), np.ptp(work)))
    stored = float(max(np.abs(kinetic).max(), np.abs(potential).max()))
    missing = energy_event(times, energy - energy[0], passed, stored)
    events = (*limit_events(arm, times, q), *missing)
    return Recording(times, series, counters, events, stopped_by(arm, solution), about)


def joint_series(arm: Arm, q: Array, qd: Array, qdd: Array, tau: Array) -> dict[str, Series]:
    """Position, speed, acceleration and torque of every joint, by name."""
    result = {}
    for i, name in enumerate(arm.joint_names):
        length, force = ("m", "N") if arm.slides[i] else ("rad", "N m")
        result[f"{name}.position"] = Series(length, q[:, i])
        result[f"{name}.speed"] = Series(f"{length}/s", qd[:, i])
        result[f"{name}.acceleration"] = Series(f"{length}/s^2", qdd[:, i])
        result[f"{name}.torque"] = Series(force, tau[:, i])
    return result


def limit_events(arm: Arm, times: Array, q: Array) -> tuple[Event, ...]:
    """Events where joints pass their position limits, with the time resolution of the recording."""
    events = []
    for i, name in enumerate(arm.joint_names):
        unit = "m" if arm.slides[i] else "rad"
        for side, beyond, limit in (
            ("lower", q[:, i] < arm.lower[i], arm.lower[i]),
            ("upper", q[:, i] > arm.upper[i], arm.upper[i]),
        ):
            leaving = np.flatnonzero(beyond & ~np.concatenate([[False], beyond[:-1]]))
            events += [
                Event(float(times[k]), "limit", f"{name} passes its {side} limit, {limit:.6g} {unit}") for k in leaving
            ]
    return tuple(sorted(events, key=lambda event: event.time))


def stopped_by(arm: Arm, solution: Solution) -> Event | None:
    """The event that ended a run early; None if it reached its end."""
    if not solution.stopped:
        return None
    if solution.fault_index is None:
        return Event(solution.stopped_at, "solver", solution.stopped)
    fault_index = solution.fault_index
    if fault_index >= 2 * arm.n:  # the work of the torques; name the joint with the largest state instead
        fault_index = int(np.argmax(np.abs(solution.states[-1, : 2 * arm.n])))
    signal = f"{arm.joint_names[fault_index % arm.n]}.{('position', 'speed')[fault_index // arm.n]}"
    return Event(solution.stopped_at, "diverged", f"{signal}: {solution.stopped}")


def _rates(arm: Arm, torque: TorqueLaw | None) -> Rates:
    """The right-hand side for the state (positions, speeds, work of the torques), (2 n + 1,)."""
    n, accelerations = arm.n, unchecked_accelerations(arm)
    nothing = np.zeros(n)

    def rates(t: float, y: Array) -> Array:
        state = np.ascontiguousarray(y)
        q, qd = state[:n], state[n : 2 * n]
        tau = nothing if torque is None else np.ascontiguousarray(torque(t, q, qd), dtype=np.float64)
        result = np.empty(2 * n + 1)
        result[:n] = qd
        result[n : 2 * n] = accelerations(q, qd, tau)
        result[2 * n] = tau @ qd
        return result

    return rates


def checked_law(arm: Arm, torque: TorqueLaw | None, start: Array) -> TorqueLaw | None:
    """The torque law, checked by a call at the initial state."""
    if torque is None:
        return None
    if not callable(torque):
        raise InputError(Fault("torque", "must be a function of (t, q, qd) or None", torque))
    checked_array(torque(0.0, start[: arm.n], start[arm.n :]), (arm.n,), "torque(0, q0, qd0)")
    return torque
