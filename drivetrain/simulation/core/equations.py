"""The equations of motion of a scene: mechanics and effects, solved over a step or at an instant as one linear system.

Over a step of length h the speeds v change by w. Smooth forces F are evaluated at a guessed intermediate state
(x + theta h v', v'), in the middle of the step for theta = 1/2, and linearised there. With the damping D and stiffness
K that effects contribute, ``(M + theta h (D + theta h K)) w = h (F + (D + theta h K)(v' - v))``. At an instant, h = 1
and theta = 0 in these equations, and w is the acceleration.

``motion`` (the changes of speed) and ``forces`` (all that follows from them) are compiled once and called by address,
so that all engines share them. With h = 0, they are evaluated at an instant; ``theta`` is in the engine's record.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numba import carray, types

from drivetrain.arrays import Array
from drivetrain.call_address import call_address
from drivetrain.jit import callback, kernel
from drivetrain.simulation.core.assembly import (
    assemble,
    evaluate_piecewise,
    fill_coupled_motion,
    fill_energies,
    find_forces,
    newton_converged,
)
from drivetrain.simulation.core.bodies import clear_tip, move_bodies
from drivetrain.simulation.core.friction import ambiguous_modes, solve_friction
from drivetrain.simulation.core.records import (
    AT,
    EQUATIONS,
    PARTS,
    Run,
    call_equations,
    call_law,
    call_laws,
    calls_of,
    coordinates_of,
    count_of,
    engine_of,
    joints_of,
    memory_of,
    pairs_of,
    part,
    parts_of,
    states_of,
    words_of,
    world_of,
)
from drivetrain.simulation.planning.mechanics import PAYLOAD
from drivetrain.solvers.compiled_function import evaluate

MOST_ITERATIONS = 60  # Newton iterations of a step, at most
HALFWAY_AFTER = 6  # Newton iterations after which every other one goes only half of the way
LOOPS_CANNOT_CLOSE = -1002  # returned instead of a count: the closed loops cannot be closed in this position


@part
def use_current_speeds(run: Run) -> None:
    """Set the guessed speeds to the current ones, for an evaluation at an instant."""
    coordinates = coordinates_of(run)
    for i in range(len(coordinates)):
        coordinates[i].mid_speed = coordinates[i].speed


@part
def fill_motion(run: Run, shift: float) -> None:
    """Fill the motion of the connectors, with positions extrapolated by ``shift`` [s] at the guessed speeds."""
    coordinates, joints = coordinates_of(run), joints_of(run)
    for i in range(len(coordinates)):
        coordinates[i].trial_speed = coordinates[i].mid_speed
    for i in range(len(joints)):
        link, m, ratio, joint = coordinates[i].link, coordinates[i].motor, coordinates[i].ratio, joints[i]
        speed = shaft = coordinates[link].mid_speed
        place, wind_up = coordinates[link].position + shift * speed, 0.0
        coordinates[link].mid_position = place
        if m != link:
            shaft = coordinates[m].mid_speed
            wind_up = coordinates[m].position + shift * (shaft - speed)
            coordinates[m].mid_position = place + wind_up
            joint.spring.wind_up, joint.spring.speed = wind_up, shaft - speed
        joint.load.position, joint.load.speed = place, speed
        joint.motor.position, joint.motor.speed = ratio * (place + wind_up - coordinates[i].zero), ratio * shaft
    if engine_of(run).coupled:
        fill_coupled_motion(run)


@part
def fill_shown_states(run: Run, shift: float) -> None:
    """Copy states of effects to the connectors that show them, extrapolated by ``shift`` [s] with their last rates."""
    numbers = memory_of(run)
    states = states_of(run)
    for k in range(len(states)):
        state = states[k]
        if state.shown >= 0:
            numbers[state.shown] = numbers[state.value] + shift * state.last


@part
def _clear(flange: Any) -> None:
    """Reset torques and friction bounds of a flange, before effects contribute to them."""
    flange.torque = flange.damping = flange.stiffness = 0.0
    flange.hold_forward = flange.hold_backward = flange.slide_forward = flange.slide_backward = 0.0


@part
def evaluate_effects(run: Run, t: float, h: float) -> None:
    """Reset all contributions, and call the ``compute`` laws of all effects, at time t [s] in a step h [s]."""
    joints = joints_of(run)
    for i in range(len(joints)):
        joint = joints[i]
        spring, mesh, pin = joint.spring, joint.mesh, joint.pin
        _clear(joint.load)
        _clear(joint.motor)
        _clear(joint.shaft)
        joint.load.surface_speed = 0.0
        spring.torque = spring.damping = spring.stiffness = 0.0
        mesh.driving = mesh.driven = 0.0
        pin.command = pin.damping = pin.stiffness = 0.0
    clear_tip(world_of(run).tip)
    call_laws(run, AT.computes, t, h)
    call_laws(run, AT.iterated, t, h)


@part
def _start_modes(run: Run, h: float, any_dry: bool) -> None:
    """Set the contact modes with which the complementarity problem is started.

    Over a step, a moving coordinate slips, and one at rest keeps its mode. At an instant (h = 0) the mode of a moving
    coordinate is fixed; one at rest may stick or start to slip. While the engine holds the modes, all are fixed.
    """
    coordinates, held = coordinates_of(run), engine_of(run).modes_fixed != 0
    for i in range(len(coordinates)):
        one = coordinates[i]
        moves = one.relative != 0.0
        if moves and not held:
            one.dry.mode = 1 if one.relative > 0.0 else -1
        if not any_dry or not one.dry.active:
            one.dry.mode = -1 if one.relative < 0.0 else 1
        one.dry.mode_fixed = 1 if h == 0.0 and (held or moves) else 0
        if h == 0.0:
            one.relative = 0.0


@part
def solve(run: Run, t: float, h: float, theta: float) -> int:
    """Solve for the changes of speed over a step from time t [s]; at an instant (h = 0, theta = 0) for accelerations.

    Piecewise laws of springs and tip contacts are iterated with Newton's method until they agree with the solution,
    with at most ``MOST_ITERATIONS`` iterations. Where no piece changes within the step, the first solution agrees.

    Returns the number of solutions, or a negative code: -1 - i if coordinate i jams, ``NO_MODES_FOUND``, or
    ``LOOPS_CANNOT_CLOSE``.
    """
    span, middle, total = h if h > 0.0 else 1.0, t + theta * h, 0
    if theta == 1.0:
        # A law that jumps at the end of the step is evaluated just before its jump, however the sum was rounded.
        middle = np.nextafter(np.nextafter(middle, t), t)
    fill_motion(run, theta * h)
    call_equations(run, engine_of(run).bodies_law, middle, h)
    if engine_of(run).loops_open:
        return LOOPS_CANNOT_CLOSE
    fill_shown_states(run, theta * h)
    evaluate_effects(run, middle, h)
    for attempt in range(MOST_ITERATIONS):
        any_dry = assemble(run, span, theta)
        if attempt == 0:
            _start_modes(run, h, any_dry)
        call_equations(run, engine_of(run).friction_law, middle, span)
        done = engine_of(run).solved
        if done < 0:
            return done
        total += done
        if h == 0.0 or count_of(run, AT.iterated) == 0:
            return total
        halfway = attempt >= HALFWAY_AFTER and attempt % 2 == 1
        evaluate_piecewise(run, middle, h, theta, halfway)
        if not halfway and newton_converged(run, h, theta):
            return total
    engine_of(run).unsettled += 1
    return total


@part
def _fill_rates(run: Run) -> None:
    """Fill the rates of the coordinates' states from the solution at an instant."""
    coordinates = coordinates_of(run)
    for i in range(len(coordinates)):
        coordinates[i].position_rate, coordinates[i].speed_rate = coordinates[i].speed, coordinates[i].change
    for i in range(world_of(run).joints):
        link, m = coordinates[i].link, coordinates[i].motor
        if m != link:
            coordinates[m].position_rate = coordinates[m].speed - coordinates[link].speed


@cache
def equation(function: Any) -> Any:
    """A part of the equations as a function with an address, compiled at the first call or read from the disk cache."""
    return callback(EQUATIONS, function)


def bodies(t: Any, h: Any, run: Any) -> None:
    """Compute mass matrix and bias torques; a function of its own, so that it is compiled and optimised only once."""
    move_bodies(run, t)


def friction(t: Any, h: Any, run: Any) -> None:
    """Solve the linear system with dry friction."""
    engine_of(run).solved = solve_friction(coordinates_of(run), pairs_of(run), h)


def uniqueness(t: Any, h: Any, run: Any) -> None:
    """Find out whether another set of contact modes satisfies the equations as well."""
    engine_of(run).ambiguous = ambiguous_modes(coordinates_of(run), pairs_of(run), h)


def motion(t: Any, h: Any, run: Any) -> None:
    """Solve for the changes of speed over a step, or (h = 0) for accelerations and rates at an instant."""
    if h == 0.0:
        use_current_speeds(run)
    engine_of(run).solved = solve(run, t, h, engine_of(run).theta if h > 0.0 else 0.0)
    if h == 0.0:
        _fill_rates(run)


def forces(t: Any, h: Any, run: Any) -> None:
    """Compute the forces of the solution, and the motion in the middle of the step, or (h = 0) the energies."""
    theta = engine_of(run).theta if h > 0.0 else 0.0
    find_forces(run, h if h > 0.0 else 1.0, theta)
    fill_motion(run, theta * h)
    if h == 0.0:
        fill_energies(run)


_DOUBLES = types.CPointer(types.float64)
# Signature of the solvers' functions: the int64 data are the addresses of a run's sections, float64 data are unused.
RIGHT_SIDE = types.void(types.float64, _DOUBLES, _DOUBLES, _DOUBLES, PARTS)
NO_NUMBERS = np.zeros(1)


@cache
def right_side(function: Any) -> Any:
    """A function (t, x, result, numbers, run) with an address for the solvers, compiled or read from the disk cache."""
    return callback(RIGHT_SIDE, function)


@part
def put_states(run: Run, x: Any) -> None:
    """Copy the solver's state vector into the run's memory."""
    states, memory = states_of(run), memory_of(run)
    for k in range(engine_of(run).moving):
        memory[states[k].value] = x[k]


@part
def clear_rates(run: Run) -> None:
    states, memory = states_of(run), memory_of(run)
    for k in range(len(states)):
        if states[k].rate >= 0:
            memory[states[k].rate] = 0.0


@part
def solve_at(run: Run, t: float) -> None:
    """Solve the equations of motion at time t [s], at the states in the run's memory."""
    clear_rates(run)
    call_equations(run, engine_of(run).motion, t, 0.0)


@part
def outputs_at(run: Run, t: float) -> None:
    """Compute forces and the outputs of effects at time t [s], after ``solve_at``."""
    call_equations(run, engine_of(run).forces, t, 0.0)
    call_laws(run, AT.accounts, t, 0.0)


@part
def _energy_at(run: Run, t: float) -> float:
    """Kinetic plus potential energy at time t [s], at the states in the run's memory [J]."""
    use_current_speeds(run)
    fill_motion(run, 0.0)
    call_equations(run, engine_of(run).bodies_law, t, 0.0)
    fill_energies(run)
    return world_of(run).kinetic_energy + world_of(run).potential_energy


@part
def pass_payloads(run: Run, t: float) -> None:
    """Add the energies of payloads picked up or set down until time t [s] to the energy balance, each once."""
    payloads, world = carray(run[AT.payloads], count_of(run, AT.payloads), PAYLOAD), world_of(run)
    for k in range(world.payloads_passed + 1, len(payloads)):
        instant = payloads[k].time
        if instant > t + 1e-9 * max(1.0, t):
            break
        if instant > 0.0:
            world.payload_energy -= _energy_at(run, np.nextafter(instant, -math.inf))
            world.payload_energy += _energy_at(run, max(t, instant))
        world.payloads_passed = k


@part
def rates_at(run: Run, t: float) -> None:
    """Compute the rates of all states at time t [s], at the states in the run's memory."""
    solve_at(run, t)
    if engine_of(run).late:
        outputs_at(run, t)


@part
def rates_of(run: Run, t: float, x: Any, result: Any) -> None:
    """Put the rates of all states at time t [s] and state x into ``result``; NaN if the equations have no solution."""
    put_states(run, x)
    rates_at(run, t)
    states, memory = states_of(run), memory_of(run)
    for k in range(engine_of(run).moving):
        result[k] = memory[states[k].rate] if engine_of(run).solved >= 0 else math.nan


@part
def take_samples(run: Run, t: float, early: float, share: float) -> None:
    """Take the samples that are due at time t [s]; before the first, all laws are evaluated.

    A sample counts as due up to ``early`` [s] and a ``share`` of its period before its time, to allow for rounding.
    """
    samples, fresh = calls_of(run, AT.samples), False
    for k in range(len(samples)):
        sample = samples[k]
        if t < sample.period * sample.taken - early - share * sample.period:
            continue
        if not fresh:
            use_current_speeds(run)
            fill_motion(run, 0.0)
            fill_shown_states(run, 0.0)
            evaluate_effects(run, t, 0.0)
            fresh = True
        call_law(run, sample, t, 0.0)
        sample.taken += 1


@part
def fill_row(run: Run, t: float, row: Any) -> None:
    """Fill one output row, after ``outputs_at``: the time, then the recorded numbers of the memory."""
    memory, columns = memory_of(run), words_of(run, AT.columns)
    row[0] = t
    for k in range(len(columns)):
        row[1 + k] = memory[columns[k]]


def rates(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """The right-hand side for solvers: the rates of all states."""
    rates_of(run, t, x, result)


def signals(t: Any, x: Any, result: Any, numbers: Any, run: Any) -> None:
    """Compute all signals at time t [s], at the states in the run's memory."""
    solve_at(run, t)
    outputs_at(run, t)


def evaluate_rates(numbers: Array, states: Array, t: float = 0.0) -> Array:
    """The rates of the states at time t [s], (m,), with a run's memory ``numbers`` as workspace."""
    found = np.zeros(len(states))
    evaluate(right_side(rates).address, t, states, found, NO_NUMBERS, parts_of(numbers))
    return found


@kernel
def _along(
    address: int, times: Array, numbers: Array, nothing: Array, parts: Any, moved: Any, commanded: Any, wanted: Any,
    rows: Array,
) -> None:  # fmt: skip
    """Fill one row per time: a first pass computes the command, a second all signals at the commanded motion."""
    at = nothing.ctypes.data
    for k in range(len(times)):
        for _ in range(2):
            call_address(address, (times[k], at, at, at, parts.ctypes.data))
            for i in range(len(moved)):
                numbers[moved[i]] = numbers[commanded[i]]
        for j in range(len(wanted)):
            rows[k, j] = numbers[wanted[j]]


def evaluate_commanded(numbers: Array, times: Array, moved: Any, commanded: Any, wanted: Any) -> Array:
    """Signals along a command at times [s], (N,): one row per time, (N, K).

    The run's memory ``numbers`` is the workspace; ``moved`` and ``commanded`` are the indices of positions and speeds
    of the coordinates and of their commands, ``wanted`` those of the signals.
    """
    rows = np.empty((len(times), len(wanted)))
    _along(right_side(signals).address, times, numbers, NO_NUMBERS, parts_of(numbers), moved, commanded, wanted, rows)
    return rows


def evaluate_signals(numbers: Array) -> None:
    """Compute all signals at time zero, at the states in a run's memory ``numbers``, which is changed."""
    evaluate(right_side(signals).address, 0.0, np.zeros(1), np.zeros(1), NO_NUMBERS, parts_of(numbers))
