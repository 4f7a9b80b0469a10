"""The equations of motion of a scene at an instant or in the middle of a step: mechanics, effects, one linear system.

Speeds v change by w over a step h. Smooth forces are taken at the middle, and in their change linear: with D and K the
dampings and stiffnesses that effects tell, ``(M + theta h (D + theta h K)) w = h (F + (D + theta h K)(v' - v))``, F at
the guessed middle (x + theta h v', v'). At an instant h = 1, theta = 0, and w is the acceleration.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from drivetrain.arrays import Array
from drivetrain.dynamics.compiled_vectors import part
from drivetrain.dynamics.mass_and_bias import mass_and_bias
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all
from drivetrain.simulation.friction_kernel import solve_friction


class Parts(NamedTuple):
    """Views of the numbers and words of a run, as the engines use them.

    Attributes:
        numbers, words: All.
        state, rates, signals: Of all states and signals [SI].
        mass, turned, matrix, carried, reduced: Matrices over coordinates [SI].
        vectors, levels: Rows named in ``fields.py`` [SI].
        work, rows, ratios, constant: Of the mechanics [SI].
        spins, motors, modes, sides, fixed: Whole numbers of the mechanics and of friction.
    """

    numbers: Any
    words: Any
    state: Any
    rates: Any
    signals: Any
    mass: Any
    turned: Any
    matrix: Any
    carried: Any
    reduced: Any
    vectors: Any
    levels: Any
    work: Any
    rows: Any
    ratios: Any
    constant: Any
    spins: Any
    motors: Any
    modes: Any
    sides: Any
    fixed: Any


@part
def parts_of(numbers: Any, words: Any) -> Parts:
    """The views.

    Args:
        numbers, words: All of a run.

    Returns:
        Its parts; they share memory with both.
    """
    n, c = words[f.JOINTS], words[f.COORDINATES]
    square = c * c
    s = words[f.AT_SIGNALS]
    signals = numbers[s : s + words[f.SIGNALS]]
    x, r = words[f.AT_STATE], words[f.AT_RATES]
    at, w = words[f.AT_TURNED], words[f.AT_WORK]
    rows, count = words[f.AT_ROWS], words[f.AT_ROW_COUNT]
    v, levels, mass = words[f.AT_VECTORS], words[f.AT_LEVELS], words[f.AT_MASS]
    spins, motors, modes = words[f.AT_SPINS], words[f.AT_MOTORS], words[f.AT_MODES]
    a, b, d = words[f.AT_MATRIX], words[f.AT_CARRIED], words[f.AT_REDUCED]
    return Parts(
        numbers,
        words,
        numbers[x : x + words[f.STATES]],
        numbers[r : r + words[f.STATES]],
        signals,
        signals[mass : mass + square].reshape((c, c)),
        numbers[at : at + square].reshape((c, c)),
        numbers[a : a + square].reshape((c, c)),
        numbers[b : b + square].reshape((c, c)),
        numbers[d : d + square + c].reshape((c + 1, c)),
        numbers[v : v + f.VECTORS * c].reshape((f.VECTORS, c)),
        numbers[levels : levels + f.LEVELS * c].reshape((c, f.LEVELS)),
        numbers[w : w + words[f.AT_WORK_ROWS] * 46].reshape((words[f.AT_WORK_ROWS], 46)),
        numbers[rows : rows + count * 31].reshape((count, 31)),
        numbers[words[f.AT_RATIOS] : words[f.AT_RATIOS] + n],
        numbers[words[f.AT_CONSTANT] : words[f.AT_CONSTANT] + 4 * c],
        words[spins : spins + 3 * words[f.SPINS]].reshape((words[f.SPINS], 3)),
        words[motors : motors + n],
        words[modes : modes + c],
        words[modes + c : modes + 2 * c],
        words[modes + 2 * c : modes + 3 * c],
    )


@part
def tell_motion(p: Parts, shift: float) -> None:
    """Fill the signals of motion from the states, moved on by ``shift`` at the guessed speeds.

    Args:
        p: The run.
        shift: [s].
    """
    n, c = p.words[f.JOINTS], p.words[f.COORDINATES]
    s, x, guess, places = p.signals, p.state, p.vectors[f.GUESS], p.vectors[f.PLACES]
    for i in range(n):
        places[i] = x[i] + shift * guess[i]
        m = p.motors[i]
        twist = 0.0
        if m != i:
            twist = x[m] + shift * (guess[m] - guess[i])
            places[m] = places[i] + twist
            s[f.DEFLECTION * n + i] = twist
            s[f.DEFLECTION_SPEED * n + i] = guess[m] - guess[i]
        s[f.POSITION * n + i] = places[i]
        s[f.SPEED * n + i] = guess[i]
        s[f.MOTOR_POSITION * n + i] = p.ratios[i] * (places[i] + twist)
        s[f.MOTOR_SPEED * n + i] = p.ratios[i] * guess[m]


@part
def _mechanics(p: Parts) -> None:
    """Mass matrix and bias at the places and guessed speeds."""
    n, c = p.words[f.JOINTS], p.words[f.COORDINATES]
    v = p.vectors
    if p.words[f.KIND] == f.ARM:
        mass_and_bias(
            n, p.rows, p.spins, v[f.PLACES], v[f.GUESS], p.work, p.mass, p.turned, v[f.BIAS], v[f.TURNED_BIAS]
        )
    else:
        for i in range(c):
            p.mass[i, i] = p.constant[f.INERTIA * c + i]
            weight = p.constant[f.WEIGHT * c + i]
            v[f.BIAS, i] = weight * math.cos(v[f.PLACES, i] + p.constant[f.PHASE * c + i]) if weight != 0.0 else 0.0
            p.turned[i, i] = p.constant[f.EXTRA * c + i]
    for i in range(n):
        p.signals[f.BIAS_TORQUE * n + i] = v[f.BIAS, i]


@part
def _bounds(p: Parts, i: int, m: int) -> bool:
    """The bounds of dry friction of a joint and its motor; whether there are any."""
    n, taken, s, ratio = p.words[f.JOINTS], p.words[f.ADDED_FROM], p.signals, p.ratios[i]
    backwards = 1 if ratio < 0.0 else 0
    joint, motor = 0.0, 0.0
    for j in range(4):
        level = s[taken + (f.JOINT_LEVELS + j) * n + i]
        drag = abs(ratio) * s[taken + (f.MOTOR_LEVELS + j) * n + i]
        p.levels[i, j] = level
        p.levels[m, f.MOTOR + (j ^ backwards)] = drag
        joint += level
        motor += drag
    driving, driven = s[taken + f.MESH_DRIVING * n + i], s[taken + f.MESH_DRIVEN * n + i]
    p.levels[m, f.DRIVING], p.levels[m, f.DRIVEN] = driving, driven
    motor += abs(driving) + abs(driven)
    p.levels[i, f.ACTIVE] = 1.0 if joint > 0.0 else 0.0
    if motor > 0.0:
        p.levels[m, f.ACTIVE] = 1.0
    elif m != i:
        p.levels[m, f.ACTIVE] = 0.0
    return joint + motor > 0.0


@part
def _carried(p: Parts, h: float, i: int, soft: float, torque: float) -> None:
    """What the mesh of a rigid joint carries, and how that changes with the speeds."""
    v = p.vectors
    v[f.CARRIED, i] = v[f.BIAS, i] - v[f.TURNED_BIAS, i] - torque
    for k in range(p.words[f.COORDINATES]):
        p.carried[i, k] = (p.mass[i, k] - p.turned[i, k]) / h
    p.carried[i, i] += soft


# long kernel: every kind of force of a joint, once
@part
def _assemble(p: Parts, h: float, theta: float) -> bool:
    """The linear system of the step, and the bounds of friction; whether there is any friction."""
    n, c = p.words[f.JOINTS], p.words[f.COORDINATES]
    taken, s, v, guess = p.words[f.ADDED_FROM], p.signals, p.vectors, p.vectors[f.GUESS]
    rubbing = False
    for i in range(c):
        v[f.RIGHT, i] = -h * v[f.BIAS, i]
        v[f.RELATIVE, i] = p.state[c + i]
        for k in range(c):
            p.matrix[i, k] = p.mass[i, k]
    for i in range(n):
        m, ratio = p.motors[i], p.ratios[i]
        late, late_motor = guess[i] - p.state[c + i], guess[m] - p.state[c + m]
        soft = s[taken + f.JOINT_DAMPING * n + i] + theta * h * s[taken + f.JOINT_STIFFNESS * n + i]
        torque = s[taken + f.JOINT_TORQUE * n + i] + soft * late
        v[f.RIGHT, i] += h * torque
        v[f.SURFACE, i] = s[taken + f.SURFACE_SPEED * n + i]
        v[f.RELATIVE, i] -= v[f.SURFACE, i]
        p.matrix[i, i] += theta * h * soft
        motor = s[taken + f.MOTOR_DAMPING * n + i] + theta * h * s[taken + f.MOTOR_STIFFNESS * n + i]
        motor *= ratio * ratio
        v[f.RIGHT, m] += h * (ratio * s[taken + f.MOTOR_TORQUE * n + i] + motor * late_motor)
        p.matrix[m, m] += theta * h * motor
        rubs = _bounds(p, i, m)
        rubbing = rubbing or rubs
        if m == i:
            if p.levels[i, f.DRIVING] != 0.0 or p.levels[i, f.DRIVEN] != 0.0:
                _carried(p, h, i, theta * soft, torque)
            continue
        spring = s[taken + f.GEAR_DAMPING * n + i] + theta * h * s[taken + f.GEAR_STIFFNESS * n + i]
        gear = s[taken + f.GEAR_TORQUE * n + i] - spring * (late_motor - late)
        stiff = theta * spring
        v[f.RIGHT, i] += h * gear
        v[f.RIGHT, m] -= h * gear
        p.matrix[i, i] += h * stiff
        p.matrix[m, m] += h * stiff
        p.matrix[i, m] -= h * stiff
        p.matrix[m, i] -= h * stiff
        v[f.CARRIED, m] = gear
        for k in range(c):
            p.carried[m, k] = 0.0
        p.carried[m, m], p.carried[m, i] = stiff, -stiff
    return rubbing


@part
def show_states(p: Parts, shift: float) -> None:
    """Copy own states to the signals of their names, moved on by ``shift`` at their last rates.

    Args:
        p: The run.
        shift: [s].
    """
    table = p.words[f.AT_SHOWN]
    for k in range(p.words[f.SHOWN]):
        at = p.words[table + 2 * k]
        p.signals[p.words[table + 2 * k + 1]] = p.state[at] + shift * p.rates[at]


@part
def compute(p: Parts, t: float, h: float, rates: Array) -> None:
    """The laws of all effects, added to from zero.

    Args:
        p: The run.
        t: Instant or middle of the step [s].
        h: Step, 0 at an instant [s].
        rates: Takes the rates of own states.
    """
    for k in range(p.words[f.ADDED_FROM], p.words[f.ADDED_TO]):
        p.signals[k] = 0.0
    call_all(p.words[f.COMPUTES], p.words[f.AT_COMPUTES], t, h, p.state, rates, p.signals, p.numbers, p.words)


@part
def solve_step(p: Parts, t: float, h: float, theta: float) -> int:
    """The change of speeds over a step, forces at its middle.

    Args:
        p: The run; guessed speeds in its vectors.
        t: Beginning of the step [s].
        h: Step [s].
        theta: Where in the step the middle is: 1/2, or 1 after a jump.

    Returns:
        As ``solve_friction``.
    """
    tell_motion(p, theta * h)
    _mechanics(p)
    show_states(p, theta * h)
    compute(p, t + theta * h, h, p.rates)
    rubbing = _assemble(p, h, theta)
    c = p.words[f.COORDINATES]
    if rubbing:
        for i in range(c):
            p.fixed[i] = 0
            relative = p.vectors[f.RELATIVE, i]
            if relative != 0.0:
                p.modes[i] = 1 if relative > 0.0 else -1
            if p.levels[i, f.ACTIVE] == 0.0:
                p.modes[i] = 1
    else:
        for i in range(c):
            p.modes[i] = 1
    return solve_friction(h, p.matrix, p.carried, p.levels, p.vectors, p.modes, p.sides, p.fixed, p.reduced)


@part
def solve_instant(p: Parts, t: float, rates: Array) -> int:
    """Accelerations at an instant: a coordinate at rest stays so or starts, unless its mode is held.

    Args:
        p: The run.
        t: [s].
        rates: Takes the rates of all states.

    Returns:
        As ``solve_friction``.
    """
    n, c, x = p.words[f.JOINTS], p.words[f.COORDINATES], p.state
    for i in range(c):
        p.vectors[f.GUESS, i] = x[c + i]
    tell_motion(p, 0.0)
    _mechanics(p)
    show_states(p, 0.0)
    compute(p, t, 0.0, rates)
    _assemble(p, 1.0, 0.0)
    held = p.words[f.HELD_MODES]
    for i in range(c):
        relative = p.vectors[f.RELATIVE, i]
        if not held:
            p.fixed[i] = 1 if relative != 0.0 else 0
            if relative != 0.0:
                p.modes[i] = 1 if relative > 0.0 else -1
        else:
            p.fixed[i] = 1
        if p.levels[i, f.ACTIVE] == 0.0:
            p.modes[i] = 1
        p.vectors[f.RELATIVE, i] = 0.0
    done = solve_friction(1.0, p.matrix, p.carried, p.levels, p.vectors, p.modes, p.sides, p.fixed, p.reduced)
    for i in range(c):
        rates[i] = x[c + i]
        rates[c + i] = p.vectors[f.CHANGE, i]
    for i in range(n):
        m = p.motors[i]
        if m != i:
            rates[m] = x[c + m] - x[c + i]
    return done


# long kernel: every force that is known only now, once
@part
def tell_forces(p: Parts, h: float, theta: float, shift: float) -> None:
    """Fill the signals of motion at the true middle, and those that follow from the solution.

    Args:
        p: The run, just solved.
        h: Step [s]; 1 at an instant.
        theta: Where the middle is; 0 at an instant.
        shift: Time from the states to the middle [s].
    """
    n, c = p.words[f.JOINTS], p.words[f.COORDINATES]
    s, v, change = p.signals, p.vectors, p.vectors[f.CHANGE]
    for i in range(c):
        v[f.GUESS, i] = p.state[c + i] + theta * change[i]
        force = v[f.RIGHT, i]
        for k in range(c):
            force -= p.matrix[i, k] * change[k]
        v[f.FRICTION, i] = force / h if p.levels[i, f.ACTIVE] != 0.0 else 0.0
    tell_motion(p, shift)
    for i in range(n):
        m, ratio = p.motors[i], p.ratios[i]
        load = 0.0
        if p.levels[m, f.DRIVING] != 0.0 or p.levels[m, f.DRIVEN] != 0.0 or m != i:
            load = v[f.CARRIED, m]
            for k in range(c):
                load += p.carried[m, k] * change[k]
        joint, motor, mesh = _split(p, i, m, load)
        if m == i:
            load += joint
        s[f.ACCELERATION * n + i] = change[i] / h
        s[f.MOTOR_ACCELERATION * n + i] = ratio * change[m] / h
        s[f.JOINT_FRICTION * n + i] = joint
        s[f.MOTOR_FRICTION * n + i] = motor / ratio
        s[f.MESH_TORQUE * n + i] = load
        s[f.MESH_LOSS * n + i] = mesh
        s[f.JOINT_FRICTION_POWER * n + i] = joint * v[f.GUESS, i]
        s[f.MOTOR_FRICTION_POWER * n + i] = motor * v[f.GUESS, m]
        s[f.MESH_POWER * n + i] = mesh * v[f.GUESS, m]


@part
def _split(p: Parts, i: int, m: int, load: float) -> tuple[float, float, float]:
    """Friction of joint, of motor (both counted at the joint) and loss of the mesh, from what they are together.

    Sliding, each is at its bound. Stuck, only the sum is known, and each takes a share as large as its bound.
    """
    friction, levels = p.vectors[f.FRICTION], p.levels
    mode = p.modes[m]
    at = 0 if mode > 0 else 1
    if m != i:
        motor = mode * levels[m, f.MOTOR + f.SLIDE + at]
        if mode == 0:
            motor = _share(friction[m], levels[m], f.MOTOR, load)
        return friction[i], motor, friction[m] - motor
    if mode != 0:
        motor = mode * levels[m, f.MOTOR + f.SLIDE + at]
        joint = mode * levels[m, f.SLIDE + at]
        return joint, motor, friction[m] - motor - joint
    joint, motor = _share(friction[m], levels[m], 0, load), _share(friction[m], levels[m], f.MOTOR, load)
    return joint, motor, friction[m] - motor - joint


@part
def _share(total: float, level: Array, which: int, load: float) -> float:
    """The share of stuck friction that one of its bounds takes."""
    at = 0 if total > 0.0 else 1
    bound = level[f.HOLD + at] + level[f.MOTOR + at] + max(level[f.DRIVING], level[f.DRIVEN]) * abs(load)
    return total * level[which + at] / bound if bound > 0.0 else 0.0
