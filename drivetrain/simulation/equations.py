"""The equations of motion of a scene at an instant or in the middle of a step: mechanics, effects, one linear system.

Speeds v change by w over a step h. Smooth forces are taken at the middle, and in their change linear: with D and K the
dampings and stiffnesses that effects contribute, ``(M + theta h (D + theta h K)) w = h (F + (D + theta h K)(v' - v))``,
F at the guessed middle (x + theta h v', v'). At an instant h = 1, theta = 0, and w is the acceleration.

``motion`` (the change of speeds) and ``forces`` (what follows from it) are compiled once and called by address, so that
every engine shares them. With h = 0 they are at an instant; ``theta`` of a step stands in the engine's record.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.dynamics.mass_and_bias import Places, mass_and_bias
from drivetrain.dynamics.passes import MASS, WIDTH
from drivetrain.jit import callback
from drivetrain.simulation.assembly import assemble, show_coupled, spread_bodies
from drivetrain.simulation.forces import find_forces, show_energies
from drivetrain.simulation.friction import solve_friction
from drivetrain.simulation.records import EQUATIONS, Run, call_laws, inlined, numbers_of, opened, part
from drivetrain.simulation.settle import agrees, ask_again
from drivetrain.simulation.tip import clear_tip, show_tip

MOST = 60  # solutions of a step, at most
PAYLOAD = 11  # numbers of an entry: instant, ten of the last link


@inlined
def guess_still(run: Run) -> None:
    """Take the speeds of the states as those of the middle."""
    coordinates = run.coordinates
    for i in range(len(coordinates)):
        run.guess[i] = coordinates[i].speed


@part
def show_motion(run: Run, shift: float) -> None:
    """Fill the connectors' motion from the states, moved on by ``shift`` at the guessed speeds.

    Args:
        shift: [s].
    """
    coordinates, joints, drives, guess, places = run.coordinates, run.joints, run.drives, run.guess, run.places
    for i in range(len(joints)):
        m, ratio, joint = drives[i].motor, drives[i].ratio, joints[i]
        speed = shaft = guess[i]
        place, wind_up = coordinates[i].position + shift * speed, 0.0
        places[i] = place
        if m != i:
            shaft = guess[m]
            wind_up = coordinates[m].position + shift * (shaft - speed)
            places[m] = place + wind_up
            joint.spring.wind_up, joint.spring.speed = wind_up, shaft - speed
        joint.load.position, joint.load.speed = place, speed
        joint.motor.position, joint.motor.speed = ratio * (place + wind_up), ratio * shaft
    if run.engine[0].coupled:
        show_coupled(run)


@inlined
def _carry(run: Run, t: float) -> None:
    """Put what the tip carries at an instant into the constants of the last link."""
    numbers = run.numbers
    payloads, entry = numbers_of(numbers, run.engine[0].at.payloads), 0
    for k in range(PAYLOAD, len(payloads), PAYLOAD):
        if payloads[k] <= t:
            entry = k
    link = run.engine[0].at.rows.first + (run.engine[0].links - 1) * WIDTH + MASS
    for j in range(PAYLOAD - 1):
        numbers[link + j] = payloads[entry + 1 + j]


@inlined
def _mechanics(run: Run, t: float, numbers: Any, words: Any) -> None:
    """Mass matrix and bias at the places and guessed speeds."""
    coordinates, joints, bias = run.coordinates, run.joints, run.bias
    engine = run.engine[0]
    at = engine.at
    if engine.arm:
        if at.payloads.size:
            _carry(run, t)
        if engine.coupled:
            spread_bodies(run, numbers, words)
        else:
            mass_and_bias(
                Places(
                    engine.links, len(coordinates), engine.spins, at.rows.first, at.spins.first, at.places.first,
                    at.guess.first, at.work.first, at.mass.first, at.felt.first, at.bias.first, at.felt_bias.first,
                ),
                numbers, words,
            )  # fmt: skip
        if engine.uses_tip:
            show_tip(run)
    else:
        for i in range(len(coordinates)):
            one = coordinates[i]
            run.mass[i, i], run.felt[i, i], bias[i] = one.inertia, one.rotor, 0.0
            if one.weight != 0.0:
                bias[i] = one.weight * math.cos(run.places[i] + one.phase)
    for i in range(len(joints)):
        joints[i].bias_torque = bias[i]


@inlined
def show_states(run: Run, shift: float) -> None:
    """Copy states of effects to the connectors of their names, moved on by ``shift`` at their last rates.

    Args:
        shift: [s].
    """
    states, numbers = run.states, run.numbers
    for k in range(len(states)):
        state = states[k]
        if state.shown >= 0:
            numbers[state.shown] = numbers[state.value] + shift * state.last


@inlined
def _clear(flange: Any) -> None:
    """Nothing acts on a flange yet."""
    flange.torque = flange.damping = flange.stiffness = 0.0
    flange.hold_forward = flange.hold_backward = flange.slide_forward = flange.slide_backward = 0.0


@part
def compute(run: Run, t: float, h: float) -> None:
    """The laws of all effects, contributions from zero.

    Args:
        t: Instant or middle of the step [s].
        h: Step, 0 at an instant [s].
    """
    joints = run.joints
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
    clear_tip(run.world[0].tip)
    old = numbers_of(run.numbers, run.engine[0].at.contributed)
    for k in range(len(old)):
        old[k] = 0.0
    call_laws(run, run.computes, t, h)
    call_laws(run, run.repeats, t, h)


@inlined
def _settled(run: Run, t: float, h: float, theta: float, done: int) -> int:
    """Solve again until springs and surroundings of the tip answer what the solution expects of them.

    Newton's method; where nothing bends within the step the first look agrees. It ends after ``MOST`` solutions, which
    are counted.
    """
    total = done
    for attempt in range(MOST):
        ask_again(run, t, h, theta)
        if agrees(run, h, theta, attempt):
            return total
        assemble(run, h, theta, True)
        done = solve_friction(run.coordinates, run.system, h)
        if done < 0:
            return done
        total += done
    run.engine[0].unsettled += 1
    return total


@part
def solve_step(run: Run, t: float, h: float, theta: float, numbers: Any, words: Any) -> int:
    """The change of speeds over a step, forces at its middle.

    Args:
        t: Beginning of the step [s].
        h: Step [s].
    """
    coordinates = run.coordinates
    middle = t + theta * h
    if theta == 1.0:
        # What jumps at the end of the step is not seen yet, however the sum was rounded.
        middle = np.nextafter(np.nextafter(middle, t), t)
    show_motion(run, theta * h)
    _mechanics(run, middle, numbers, words)
    show_states(run, theta * h)
    compute(run, middle, h)
    any_dry = assemble(run, h, theta, False)
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.dry.given = 0
        if one.relative != 0.0:
            one.dry.mode = 1 if one.relative > 0.0 else -1
        if not any_dry or not one.dry.active:
            one.dry.mode = 1
    done = solve_friction(coordinates, run.system, h)
    if len(run.repeats) and done > 0:
        return _settled(run, middle, h, theta, done)
    return done


@part
def solve_instant(run: Run, t: float, numbers: Any, words: Any) -> int:
    """Accelerations at an instant: a coordinate at rest stays so or starts, unless its mode is held.

    Args:
        t: [s].
    """
    coordinates = run.coordinates
    guess_still(run)
    show_motion(run, 0.0)
    _mechanics(run, t, numbers, words)
    show_states(run, 0.0)
    compute(run, t, 0.0)
    assemble(run, 1.0, 0.0, False)
    held = run.engine[0].held != 0
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.dry.given = 1 if held or one.relative != 0.0 else 0
        if one.relative != 0.0 and not held:
            one.dry.mode = 1 if one.relative > 0.0 else -1
        if not one.dry.active:
            one.dry.mode = 1
        one.relative = 0.0
    done = solve_friction(coordinates, run.system, 1.0)
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.position_rate, one.speed_rate = one.speed, one.change
    for i in range(len(run.joints)):
        m = run.drives[i].motor
        if m != i:
            coordinates[m].position_rate = coordinates[m].speed - coordinates[i].speed
    return done


def _motion(t: Any, h: Any, numbers: Any, words: Any, memory: Any) -> None:
    run = opened(memory)
    if h > 0.0:
        run.engine[0].solved = solve_step(run, t, h, run.engine[0].theta, numbers, words)
    else:
        run.engine[0].solved = solve_instant(run, t, numbers, words)


def _forces(t: Any, h: Any, numbers: Any, words: Any, memory: Any) -> None:
    run = opened(memory)
    if h > 0.0:
        find_forces(run, h, run.engine[0].theta)
        show_motion(run, run.engine[0].theta * h)
    else:
        find_forces(run, 1.0, 0.0)
        show_motion(run, 0.0)
        show_energies(run)


@lru_cache(maxsize=1)
def motion() -> Any:
    """The change of speeds, compiled at the first call (some seconds) or taken from the disk cache."""
    return callback(EQUATIONS, _motion)


@lru_cache(maxsize=1)
def forces() -> Any:
    """Forces and motion at the true middle, compiled likewise."""
    return callback(EQUATIONS, _forces)
