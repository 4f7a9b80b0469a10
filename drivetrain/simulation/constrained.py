"""Simulation of an arm without drives under constraints: a door, a pen on paper, a closed loop of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.constrained import (
    Constraints,
    closed_position,
    closed_speed,
    constrained_forward_dynamics,
    least_change,
)
from drivetrain.dynamics.constraints import Constraint, Rows, checked_constraints, stacked_rows
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.samples import run
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.passive import (
    DEFAULT_INTERVAL,
    LARGEST_STATE,
    TorqueLaw,
    checked_law,
    checked_start,
    record,
    recorded_times,
    up_to_divergence,
)
from drivetrain.simulation.recording import Event, Recording, Series
from drivetrain.solvers.integrate import Correct, Rates, integrate
from drivetrain.solvers.solver import RungeKutta4, Solver, check_positive


class Stabilisation:
    """Base of the methods that keep the motion on the constraints; this one does nothing beyond the constraints."""

    def drift(self, rows: Rows, qd: Array, held: Array) -> Array:
        """Right-hand side of the acceleration constraint, dA/dt qd, with additional stabilising terms.

        ``held`` tells which rows are holonomic. Both are batches, (1, rows).
        """
        return rows.drift

    def put_back(
        self, arm: Arm, constraints: tuple[Constraint, ...], q: Array, qd: Array
    ) -> tuple[Array, Array] | None:
        """Positions and speeds after a step, (1, n) each, corrected; None if nothing is to be corrected."""
        return None


@dataclass(frozen=True)
class Projection(Stabilisation):
    """Projection onto the constraints after each step, by the smallest change in the metric of M: no drift.

    Attributes:
        tolerance: Errors of positions [m or -] and of speeds [m/s or 1/s] that are not corrected.
        most: Newton iterations per correction, at most [-].
    """

    tolerance: float = 1e-12
    most: int = 5

    def __post_init__(self) -> None:
        check_positive("Projection.tolerance", self.tolerance, "m")
        if isinstance(self.most, bool) or not isinstance(self.most, int) or self.most < 1:
            raise InputError(Fault("Projection.most", "must be a whole number from 1", self.most))

    def put_back(
        self, arm: Arm, constraints: tuple[Constraint, ...], q: Array, qd: Array
    ) -> tuple[Array, Array] | None:
        rows = stacked_rows(arm, constraints, q, qd)
        changed = False
        for _ in range(self.most):
            if np.abs(rows.error).max() <= self.tolerance:
                break
            # Rows that constrain only speeds have no position error, so they cause no correction.
            step, _, _ = least_change(arm, q, rows.jacobian, np.zeros(q.shape), rows.error)
            q, changed = q + step, True
            rows = stacked_rows(arm, constraints, q, qd)
        leaving = (rows.jacobian @ qd[:, :, None])[..., 0]
        if np.abs(leaving).max() > self.tolerance:
            step, _, _ = least_change(arm, q, rows.jacobian, np.zeros(q.shape), leaving)
            qd, changed = qd + step, True
        return (q, qd) if changed else None


@dataclass(frozen=True)
class Baumgarte(Stabilisation):
    """Baumgarte stabilisation: errors decay with critical damping. Cheap, for any solver, but errors never vanish.

    Attributes:
        rate: a of ``A qdd + dA/dt qd + 2 a A qd + a^2 error = 0`` [1/s]; far below the inverse of the solver's step.

    Reference: Baumgarte, Comp. Methods in Applied Mechanics and Engineering 1 (1972) 1-16.
    """

    rate: float = 10.0

    def __post_init__(self) -> None:
        check_positive("Baumgarte.rate", self.rate, "1/s")

    def drift(self, rows: Rows, qd: Array, held: Array) -> Array:
        leaving = (rows.jacobian @ qd[:, :, None])[..., 0]
        return rows.drift + self.rate * np.where(held, 2.0, 1.0) * leaving + self.rate**2 * rows.error


@dataclass(frozen=True)
class Drifting(Stabilisation):
    """No stabilisation, for comparison with the others."""


DEFAULT_SOLVER = RungeKutta4(1e-3)
PROJECTION = Projection()
MOVED = 1e-9  # correction of the initial position above which an event reports it [rad or m]


def simulate_constrained(
    arm: Arm,
    constraints: Constraints,
    q0: Any,
    qd0: Any,
    duration: float,
    *,
    solver: Solver = DEFAULT_SOLVER,
    torque: TorqueLaw | None = None,
    stabilisation: Stabilisation = PROJECTION,
    breakpoints: Sequence[float] = (),
    interval: float = DEFAULT_INTERVAL,
) -> Recording:
    """The motion of an arm under gravity, given joint torques, and constraints that do no work.

    Args:
        arm: Arm, with or without rotors, at any level.
        constraints: One or several. The initial state is first moved to the nearest one that satisfies them.
        q0, qd0: Initial positions and speeds [rad or m, and per s], (n,).
        duration: Duration of the run [s].
        solver: Integration method.
        torque: Called with (t [s], q [rad or m], qd [rad/s or m/s]), returns the generalised joint torques [N m; N at a
            prismatic joint], (n,). None: no torques.
        stabilisation: How the motion is kept on the constraints.
        breakpoints: Times at which the torque law jumps [s]; no step crosses one.
        interval: Time between two output rows [s]; the last row is at the end.

    Returns:
        The series of ``simulate_passive``, and ``constraint_error`` [m, - for angles] and ``constraint_speed`` [m/s],
        each the largest of all rows, ``constraint_<i>.multiplier_<j>`` [N or N m], and ``rank`` [-].

    Raises:
        InputError: As ``simulate_passive``; or the constraints cannot be satisfied near q0.

    Reference: Modern Robotics, section 8.7.
    """
    several = checked_constraints(arm, constraints)
    start = checked_start(arm, q0, qd0)
    times = recorded_times(duration, interval)
    n, law = arm.n, checked_law(arm, torque, start)
    q = closed_position(arm, several, start[:n])
    qd = closed_speed(arm, several, q, start[n:])
    state = np.concatenate([q, qd, [0.0]])
    rates = _rates(arm, several, law, stabilisation)
    correct = _correction(arm, several, stabilisation)
    solution = up_to_divergence(integrate(solver, rates, state, times, breakpoints=breakpoints, correct=correct))
    about = {
        "arm": arm.name,
        "rotors": str(arm.level),
        "constraints": ", ".join(type(one).__name__ for one in several),
        "solver": str(solver),
        "stabilisation": repr(stabilisation),
        "duration": f"{duration:g} s",
    }
    # The dense output between the ends of steps is not exactly on the constraints, so its states are corrected too.
    corrected = [(correct(t, y), y) for t, y in zip(solution.times, solution.states, strict=True)]
    solution = replace(solution, states=np.array([y if better is None else better for better, y in corrected]))
    recording = record(arm, solution, law, about)
    return _with_constraints(arm, several, recording, solution.states, float(np.abs(q - start[:n]).max()))


def _rates(arm: Arm, constraints: tuple[Constraint, ...], torque: TorqueLaw | None, how: Stabilisation) -> Rates:
    """The right-hand side for the state (positions, speeds, work of the torques), (2 n + 1,)."""
    n, model = arm.n, packed(arm)
    nothing = np.zeros((1, n))
    holonomic = np.concatenate([np.full(one.count, one.holonomic) for one in constraints])

    def rates(t: float, y: Array) -> Array:
        q, qd = y[:n].reshape(1, n).copy(), y[n : 2 * n].reshape(1, n).copy()
        result = np.full(2 * n + 1, np.nan)
        tau = nothing if torque is None else np.asarray(torque(t, q[0], qd[0]), dtype=np.float64).reshape(1, n)
        try:
            rows = stacked_rows(arm, constraints, q, qd)
            force = tau - run(model, (q, qd, nothing))
            acceleration, _, _ = least_change(arm, q, rows.jacobian, force, how.drift(rows, qd, holonomic))
        except InputError:
            if np.abs(y).max() <= LARGEST_STATE:
                raise
            return result  # a diverged state; NaN rates make the solver report it
        result[:n], result[n : 2 * n] = qd[0], acceleration[0]
        result[2 * n] = tau[0] @ qd[0]
        return result

    return rates


def _correction(arm: Arm, constraints: tuple[Constraint, ...], how: Stabilisation) -> Correct:
    """The stabilisation as a correction of the solver's state after each step."""
    n = arm.n

    def correct(t: float, y: Array) -> Array | None:
        if not np.abs(y).max() <= LARGEST_STATE:
            return None
        q, qd = y[:n].reshape(1, n).copy(), y[n : 2 * n].reshape(1, n).copy()
        put_back = how.put_back(arm, constraints, q, qd)
        return None if put_back is None else np.concatenate([put_back[0][0], put_back[1][0], y[2 * n :]])

    return correct


def _with_constraints(
    arm: Arm, constraints: tuple[Constraint, ...], recording: Recording, states: Array, moved: float
) -> Recording:
    """The recording with the series of the constraints, and with the constrained accelerations.

    ``moved`` is the correction of the initial position [rad or m].
    """
    n = arm.n
    q, qd = np.ascontiguousarray(states[:, :n]), np.ascontiguousarray(states[:, n : 2 * n])
    tau = np.array(list(recording.ending("torque").values())).T
    motion = constrained_forward_dynamics(arm, constraints, q, qd, tau)
    series = dict(recording.series)
    for i, name in enumerate(arm.joint_names):
        series[f"{name}.acceleration"] = Series(recording.unit(f"{name}.acceleration"), motion.acceleration[:, i])
    column = 0
    for i, one in enumerate(constraints):
        for j, unit in enumerate(one.units):
            series[f"constraint_{i + 1}.multiplier_{j + 1}"] = Series(unit, motion.multipliers[:, column])
            column += 1
    series["constraint_error"] = Series("m", np.abs(motion.error).max(axis=1))
    series["constraint_speed"] = Series("m/s", np.abs(motion.speed_error).max(axis=1))
    series["rank"] = Series("-", motion.rank.astype(np.float64))
    events = recording.events
    if moved > MOVED:
        note = f"the start did not meet the constraints; joints moved by up to {moved:.3g} rad or m"
        events = (Event(float(recording.time[0]), "start", note), *events)
    return replace(recording, series=series, events=events)
