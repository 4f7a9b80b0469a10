"""The equations of motion of a scene at an instant or in the middle of a step: mechanics, effects, one linear system.

Speeds v change by w over a step h. Smooth forces are taken at the middle, and in their change linear: with D and K the
dampings and stiffnesses that effects tell, ``(M + theta h (D + theta h K)) w = h (F + (D + theta h K)(v' - v))``, F at
the guessed middle (x + theta h v', v'). At an instant h = 1, theta = 0, and w is the acceleration.

All functions take the two blocks of a run, ``n`` (real numbers) and ``w`` (whole ones), as pointers: indices into them
cost nothing, where views of arrays would cost more than the arithmetic.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.dynamics.mass_and_bias import Places, mass_and_bias
from drivetrain.dynamics.passes import MASS, WIDTH
from drivetrain.simulation import fields as f
from drivetrain.simulation.calls import call_all
from drivetrain.simulation.friction_kernel import Rubbing, solve_friction
from drivetrain.simulation.tip_kernel import add_tip, calm_tip, tell_tip, tip_agrees, try_tip

AGREED = 1e-12  # of a spring's torque that a solution may be off
PATIENCE, MOST = 6, 60  # solutions before chords help, and at most
STIFF_FROM = 1.5  # inertia with springs and dampers in it, over that without: a step no longer follows what they do


@part
def row_of(w: Any, which: int) -> int:
    """Where a row of the vectors begins.

    Args:
        w: Whole numbers.
        which: As named in ``fields.py``.

    Returns:
        Index into the real numbers.
    """
    return w[f.AT_VECTORS] + which * w[f.COORDINATES]


@part
def guess_still(n: Any, w: Any) -> None:
    """Take the speeds of the states as those of the middle.

    Args:
        n, w: The run.
    """
    guess, speeds = row_of(w, f.GUESS), w[f.AT_STATE] + w[f.COORDINATES]
    for i in range(w[f.COORDINATES]):
        n[guess + i] = n[speeds + i]


@part
def tell_motion(n: Any, w: Any, shift: float) -> None:
    """Fill the signals of motion from the states, moved on by ``shift`` at the guessed speeds.

    Args:
        n, w: The run.
        shift: [s].
    """
    joints, s, x = w[f.JOINTS], w[f.AT_SIGNALS], w[f.AT_STATE]
    guess, places, motors = row_of(w, f.GUESS), row_of(w, f.PLACES), w[f.AT_MOTORS]
    for i in range(joints):
        speed = n[guess + i]
        place = n[x + i] + shift * speed
        n[places + i] = place
        m, ratio, twist, shaft = w[motors + i], n[w[f.AT_RATIOS] + i], 0.0, speed
        if m != i:
            shaft = n[guess + m]
            twist = n[x + m] + shift * (shaft - speed)
            n[places + m] = place + twist
            n[s + f.DEFLECTION * joints + i] = twist
            n[s + f.DEFLECTION_SPEED * joints + i] = shaft - speed
        n[s + f.POSITION * joints + i] = place
        n[s + f.SPEED * joints + i] = speed
        n[s + f.MOTOR_POSITION * joints + i] = ratio * (place + twist)
        n[s + f.MOTOR_SPEED * joints + i] = ratio * shaft
    if w[f.COUPLED]:
        _tell_joints(n, w)


@part
def _tell_joints(n: Any, w: Any) -> None:
    """Where motors are coupled: what the joints do when the shafts behind the gears do what has been told."""
    joints, s = w[f.JOINTS], w[f.AT_SIGNALS]
    guess, places, turns = row_of(w, f.GUESS), row_of(w, f.PLACES), w[f.AT_TURNS]
    for i in range(joints):
        if w[w[f.AT_BOUND] + i]:
            place, speed = 0.0, 0.0
            for k in range(joints):
                place += n[turns + i * joints + k] * n[places + k]
                speed += n[turns + i * joints + k] * n[guess + k]
            n[s + f.SHAFT_POSITION * joints + i] = n[places + i]
            n[s + f.SHAFT_SPEED * joints + i] = n[guess + i]
            n[s + f.POSITION * joints + i] = place
            n[s + f.SPEED * joints + i] = speed


@part
def _carry(n: Any, w: Any, t: float) -> None:
    """Put what the tip carries at an instant into the constants of the last link."""
    entry = w[f.AT_PAYLOADS]
    for k in range(1, w[f.PAYLOADS]):
        if n[w[f.AT_PAYLOADS] + 11 * k] <= t:
            entry = w[f.AT_PAYLOADS] + 11 * k
    link = w[f.AT_ROWS] + (w[f.JOINTS] - 1) * WIDTH + MASS
    for j in range(10):
        n[link + j] = n[entry + 1 + j]


# long kernel: products of matrices, written out
@part
def _bodies(n: Any, w: Any) -> None:
    """Mass matrix and bias where motors are coupled: those of the bodies, along the coordinates."""
    joints, c, e, at = w[f.JOINTS], w[f.COORDINATES], w[f.BODIES], w[f.AT_BODIES]
    speeds, bias, felt_bias, mass = at + e, at + 2 * e, at + 3 * e, at + 4 * e
    turned, between, spread = mass + e * e, mass + 2 * e * e, w[f.AT_SPREAD]
    places, guess, to = row_of(w, f.PLACES), row_of(w, f.GUESS), w[f.AT_SIGNALS] + w[f.AT_MASS]
    for r in range(e):
        place, speed = 0.0, 0.0
        for k in range(c):
            place += n[spread + r * c + k] * n[places + k]
            speed += n[spread + r * c + k] * n[guess + k]
        n[at + r] = place
        n[speeds + r] = speed
    mass_and_bias(
        Places(
            joints, e, w[f.SPINS], w[f.AT_ROWS], w[f.AT_SPINS], at, speeds, w[f.AT_WORK], mass, turned, bias, felt_bias
        ),
        n, w,
    )  # fmt: skip
    for r in range(e):
        for k in range(c):
            entry = 0.0
            for j in range(e):
                entry += n[mass + r * e + j] * n[spread + j * c + k]
            n[between + r * c + k] = entry
    for i in range(c):
        value, row, factor = 0.0, w[w[f.AT_FELT] + i], n[w[f.AT_FACTORS] + i]
        for r in range(e):
            value += n[spread + r * c + i] * n[bias + r]
        n[row_of(w, f.BIAS) + i] = value
        n[row_of(w, f.TURNED_BIAS) + i] = factor * n[felt_bias + row] if row >= 0 else 0.0
        for k in range(c):
            whole, felt = 0.0, 0.0
            for r in range(e):
                whole += n[spread + r * c + i] * n[between + r * c + k]
                if row >= 0:
                    felt += n[turned + row * e + r] * n[spread + r * c + k]
            n[to + i * c + k] = whole
            n[w[f.AT_TURNED] + i * c + k] = factor * felt
        n[to + i * c + i] += n[w[f.AT_OWN] + i]
        n[w[f.AT_TURNED] + i * c + i] += n[w[f.AT_OWN] + i]


@part
def _mechanics(n: Any, w: Any, t: float) -> None:
    """Mass matrix and bias at the places and guessed speeds."""
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    mass, bias, places = s + w[f.AT_MASS], row_of(w, f.BIAS), row_of(w, f.PLACES)
    if w[f.KIND] == f.ARM:
        at = Places(
            joints, c, w[f.SPINS], w[f.AT_ROWS], w[f.AT_SPINS], places, row_of(w, f.GUESS), w[f.AT_WORK],
            mass, w[f.AT_TURNED], bias, row_of(w, f.TURNED_BIAS),
        )  # fmt: skip
        if w[f.PAYLOADS]:
            _carry(n, w, t)
        if w[f.COUPLED]:
            _bodies(n, w)
        else:
            mass_and_bias(at, n, w)
        if w[f.TIP]:
            tell_tip(n, w)
    else:
        constant = w[f.AT_CONSTANT]
        for i in range(c):
            n[mass + i * c + i] = n[constant + f.INERTIA * c + i]
            weight = n[constant + f.WEIGHT * c + i]
            n[bias + i] = 0.0
            if weight != 0.0:
                n[bias + i] = weight * math.cos(n[places + i] + n[constant + f.PHASE * c + i])
            n[w[f.AT_TURNED] + i * c + i] = n[constant + f.EXTRA * c + i]
    for i in range(joints):
        n[s + f.BIAS_TORQUE * joints + i] = n[bias + i]


@part
def _bounds(n: Any, w: Any, i: int, m: int, ratio: float) -> bool:
    """The bounds of dry friction of a joint and its motor; whether there are any."""
    joints, taken = w[f.JOINTS], w[f.AT_SIGNALS] + w[f.ADDED_FROM] + i
    own, shaft = w[f.AT_LEVELS] + i * f.LEVELS, w[f.AT_LEVELS] + m * f.LEVELS
    backwards = 1 if ratio < 0.0 else 0
    joint, motor = 0.0, 0.0
    for j in range(4):
        level = n[taken + (f.JOINT_LEVELS + j) * joints]
        drag = abs(ratio) * n[taken + (f.MOTOR_LEVELS + j) * joints]
        n[own + j] = level
        n[shaft + f.MOTOR + (j ^ backwards)] = drag
        joint += level
        motor += drag
    driving, driven = n[taken + f.MESH_DRIVING * joints], n[taken + f.MESH_DRIVEN * joints]
    n[shaft + f.DRIVING] = driving
    n[shaft + f.DRIVEN] = driven
    motor += abs(driving) + abs(driven)
    n[own + f.ACTIVE] = 1.0 if joint > 0.0 else 0.0
    if motor > 0.0:
        n[shaft + f.ACTIVE] = 1.0
    elif m != i:
        n[shaft + f.ACTIVE] = 0.0
    return joint + motor > 0.0


@part
def _carried(n: Any, w: Any, h: float, i: int, soft: float, torque: float) -> None:
    """What the mesh of a rigid joint carries, and how that changes with the speeds."""
    c = w[f.COORDINATES]
    n[row_of(w, f.CARRIED) + i] = n[row_of(w, f.BIAS) + i] - n[row_of(w, f.TURNED_BIAS) + i] - torque
    rows, mass, turned = w[f.AT_CARRIED] + i * c, w[f.AT_SIGNALS] + w[f.AT_MASS] + i * c, w[f.AT_TURNED] + i * c
    for k in range(c):
        n[rows + k] = (n[mass + k] - n[turned + k]) / h
    n[rows + i] += soft


@part
def _spring(n: Any, w: Any, h: float, theta: float, i: int, m: int, late: float) -> None:
    """The spring of a flexible joint between its link i and its rotor m."""
    c, joints, taken = w[f.COORDINATES], w[f.JOINTS], w[f.AT_SIGNALS] + w[f.ADDED_FROM] + i
    matrix, right, rows = w[f.AT_MATRIX], row_of(w, f.RIGHT), w[f.AT_CARRIED] + m * c
    spring = n[taken + f.GEAR_DAMPING * joints] + theta * h * n[taken + f.GEAR_STIFFNESS * joints]
    gear, stiff = n[taken + f.GEAR_TORQUE * joints] - spring * late, theta * spring
    n[right + i] += h * gear
    n[right + m] -= h * gear
    n[matrix + i * c + i] += h * stiff
    n[matrix + m * c + m] += h * stiff
    n[matrix + i * c + m] -= h * stiff
    n[matrix + m * c + i] -= h * stiff
    n[row_of(w, f.CARRIED) + m] = gear
    for k in range(c):
        n[rows + k] = 0.0
    n[rows + m] = stiff
    n[rows + i] = -stiff


@part
def _add_joints(n: Any, w: Any, h: float, theta: float) -> None:
    """Smooth torques at joints whose motors are coupled join the linear system of their shafts."""
    joints, c, taken = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS] + w[f.ADDED_FROM]
    speeds, guess, right = w[f.AT_STATE] + c, row_of(w, f.GUESS), row_of(w, f.RIGHT)
    for i in range(joints):
        if not w[w[f.AT_BOUND] + i]:
            continue
        own, turns = taken + i, w[f.AT_TURNS] + i * joints
        soft = n[own + f.JOINT_DAMPING * joints] + theta * h * n[own + f.JOINT_STIFFNESS * joints]
        torque = n[own + f.JOINT_TORQUE * joints]
        for k in range(joints):
            torque += soft * n[turns + k] * (n[guess + k] - n[speeds + k])
        for k in range(joints):
            if not w[w[f.AT_BOUND] + k]:
                continue
            n[right + k] += h * n[turns + k] * torque
            n[row_of(w, f.CARRIED) + k] -= n[turns + k] * torque
            for j in range(joints):
                entry = theta * soft * n[turns + k] * n[turns + j]
                n[w[f.AT_MATRIX] + k * c + j] += h * entry
                n[w[f.AT_CARRIED] + k * c + j] += entry


# long kernel: every kind of force of a joint, once
@part
def _assemble(n: Any, w: Any, h: float, theta: float, asked: int) -> bool:
    """The linear system of the step, and the bounds of friction; whether there is any friction.

    ``asked`` is where the speeds stand at which springs and surroundings of the tip were asked; all else at the guess.
    """
    joints, c, taken = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS] + w[f.ADDED_FROM]
    speeds, guess, right, bias = w[f.AT_STATE] + c, row_of(w, f.GUESS), row_of(w, f.RIGHT), row_of(w, f.BIAS)
    relative, surface, matrix, mass = row_of(w, f.RELATIVE), row_of(w, f.SURFACE), w[f.AT_MATRIX], w[f.AT_MASS]
    rubbing = False
    for i in range(c):
        n[right + i] = -h * n[bias + i]
        n[relative + i] = n[speeds + i]
    for k in range(c * c):
        n[matrix + k] = n[w[f.AT_SIGNALS] + mass + k]
    for i in range(joints):
        m, ratio, own = w[w[f.AT_MOTORS] + i], n[w[f.AT_RATIOS] + i], taken + i
        late, late_motor = n[guess + i] - n[speeds + i], n[guess + m] - n[speeds + m]
        kind = f.JOINT_TORQUE
        if w[f.COUPLED] and w[w[f.AT_BOUND] + i]:
            kind = f.SHAFT_TORQUE
        soft = n[own + (kind + 1) * joints] + theta * h * n[own + (kind + 2) * joints]
        torque = n[own + kind * joints] + soft * late
        n[right + i] += h * torque
        n[surface + i] = n[own + f.SURFACE_SPEED * joints]
        n[relative + i] -= n[surface + i]
        n[matrix + i * c + i] += theta * h * soft
        motor = n[own + f.MOTOR_DAMPING * joints] + theta * h * n[own + f.MOTOR_STIFFNESS * joints]
        motor *= ratio * ratio
        n[right + m] += h * (ratio * n[own + f.MOTOR_TORQUE * joints] + motor * late_motor)
        n[matrix + m * c + m] += theta * h * motor
        rubs = _bounds(n, w, i, m, ratio)
        rubbing = rubbing or rubs
        if m != i:
            late = n[asked + m] - n[asked + i] - (n[speeds + m] - n[speeds + i])
            _spring(n, w, h, theta, i, m, late)
        else:
            _carried(n, w, h, i, theta * soft, torque)
    if w[f.COUPLED]:
        _add_joints(n, w, h, theta)
    if w[f.TIP]:
        add_tip(n, w, h, theta, asked)
    stiff = 0
    for i in range(c):
        if n[matrix + i * c + i] > STIFF_FROM * n[w[f.AT_SIGNALS] + mass + i * c + i]:
            stiff = 1
    w[f.STIFF] = stiff
    return rubbing


@part
def show_states(n: Any, w: Any, shift: float) -> None:
    """Copy own states to the signals of their names, moved on by ``shift`` at their last rates.

    Args:
        n, w: The run.
        shift: [s].
    """
    table, s, x, rates = w[f.AT_SHOWN], w[f.AT_SIGNALS], w[f.AT_STATE], w[f.AT_RATES]
    for k in range(w[f.SHOWN]):
        at = w[table + 2 * k]
        n[s + w[table + 2 * k + 1]] = n[x + at] + shift * n[rates + at]


@part
def compute(n: Any, w: Any, t: float, h: float, rates: Any) -> None:
    """The laws of all effects, added to from zero.

    Args:
        n, w: The run.
        t: Instant or middle of the step [s].
        h: Step, 0 at an instant [s].
        rates: Takes the rates of own states.
    """
    s = w[f.AT_SIGNALS]
    for k in range(s + w[f.ADDED_FROM], s + w[f.ADDED_TO]):
        n[k] = 0.0
    call_all(w[f.COMPUTES], w[f.AT_COMPUTES], t, h, rates, n, w)
    if w[f.REPEATS]:
        call_all(w[f.REPEATS], w[f.AT_REPEATS], t, h, rates, n, w)


@part
def _friction(n: Any, w: Any, h: float) -> int:
    """The system solved, with friction."""
    at = Rubbing(
        w[f.COORDINATES], w[f.AT_MATRIX], w[f.AT_CARRIED], w[f.AT_REDUCED], w[f.AT_VECTORS], w[f.AT_LEVELS],
        w[f.AT_MODES],
    )  # fmt: skip
    return solve_friction(at, h, n, w)


@part
def _try(n: Any, w: Any, t: float, h: float, theta: float, rates: Any) -> None:
    """Ask springs and surroundings of the tip again, at the motion that the solution makes."""
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    trial, speeds, change = row_of(w, f.TRIAL), w[f.AT_STATE] + c, row_of(w, f.CHANGE)
    taken = s + w[f.ADDED_FROM]
    for i in range(c):
        n[trial + i] = n[speeds + i] + theta * n[change + i]
    for i in range(joints):
        m = w[w[f.AT_MOTORS] + i]
        if m != i:
            rate = n[trial + m] - n[trial + i]
            n[s + f.DEFLECTION * joints + i] = n[w[f.AT_STATE] + m] + theta * h * rate
            n[s + f.DEFLECTION_SPEED * joints + i] = rate
            for j in range(f.GEAR_TORQUE, f.GEAR_STIFFNESS + 1):
                n[taken + j * joints + i] = 0.0
    if w[f.TIP]:
        try_tip(n, w, theta * h)
        for k in range(f.TIP_FORCES):
            n[s + w[f.AT_TIP_TAKEN] + k] = 0.0
    call_all(w[f.REPEATS], w[f.AT_REPEATS], t, h, rates, n, w)


@part
def _bracketed(n: Any, at: int, rate: float, torque: float, expected: float) -> float:
    """Note a rate that was tried; the slope of the chord between one too slow and one too fast, or -1.

    A spring's torque only grows with its rate, and its rate only falls with its torque: what answers more than expected
    turns too fast, what answers less too slowly. Where Newton's method goes round in circles the chord stays between.

    Reference: Dowell and Jarratt, A modified regula falsi method (Illinois), BIT 11 (1971) 168.
    """
    own, other = (at + 3, at) if torque > expected else (at, at + 3)
    again = abs(n[own]) < math.inf
    n[own] = rate
    n[own + 1] = expected
    n[own + 2] = torque - expected
    if not n[at] < n[at + 3]:  # other springs have moved on: what was tried before says nothing any more
        n[other] = -math.inf if other == at else math.inf
    if not abs(n[other]) < math.inf:
        return -1.0
    if again:
        n[other + 2] *= 0.5
    return max((n[at + 4] + n[at + 5] - n[at + 1] - n[at + 2]) / (n[at + 3] - n[at]), 0.0)


@part
def _agrees(n: Any, w: Any, h: float, theta: float, attempt: int) -> bool:
    """Whether springs answer what the solution expects of them, to rounding."""
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    trial, change, good = row_of(w, f.TRIAL), row_of(w, f.CHANGE), True
    for i in range(joints):
        m, taken = w[w[f.AT_MOTORS] + i], s + w[f.ADDED_FROM] + i
        if m == i:
            continue
        rows, at = w[f.AT_CARRIED] + m * c, w[f.AT_TRIED] + 6 * m
        expected = n[row_of(w, f.CARRIED) + m] + n[rows + m] * n[change + m] + n[rows + i] * n[change + i]
        torque, rate = n[taken + f.GEAR_TORQUE * joints], n[s + f.DEFLECTION_SPEED * joints + i]
        slope = n[taken + f.GEAR_DAMPING * joints] + theta * h * n[taken + f.GEAR_STIFFNESS * joints]
        slope = max(slope, n[rows + m] / theta)
        size = abs(n[trial + m]) + abs(n[trial + i]) + abs(n[s + f.DEFLECTION * joints + i]) / (theta * h)
        if attempt == 0:
            n[at] = -math.inf
            n[at + 3] = math.inf
        if abs(torque - expected) <= AGREED * (abs(torque) + abs(expected)) + 2e-15 * slope * size:
            continue
        good = False
        chord = _bracketed(n, at, rate, torque, expected)
        if attempt >= PATIENCE and chord >= 0.0:
            n[taken + f.GEAR_DAMPING * joints] = chord
            n[taken + f.GEAR_STIFFNESS * joints] = 0.0
    if w[f.TIP]:
        good = tip_agrees(n, w, theta * h) and good
        if attempt >= PATIENCE and attempt % 2:
            calm_tip(n, w)
    return good


@part
def _settled(n: Any, w: Any, t: float, h: float, theta: float, rates: Any, done: int) -> int:
    """Solve again until springs and surroundings of the tip answer what the solution expects of them.

    Newton's method; where nothing bends within the step the first look agrees. It ends after ``MOST`` solutions, which
    are told.
    """
    total = done
    for attempt in range(MOST):
        _try(n, w, t, h, theta, rates)
        if _agrees(n, w, h, theta, attempt):
            return total
        _assemble(n, w, h, theta, row_of(w, f.TRIAL))
        done = _friction(n, w, h)
        if done < 0:
            return done
        total += done
    w[f.UNSETTLED] += 1
    return total


@part
def solve_step(n: Any, w: Any, t: float, h: float, theta: float, rates: Any) -> int:
    """The change of speeds over a step, forces at its middle.

    Args:
        n, w: The run; guessed speeds in its vectors.
        t: Beginning of the step [s].
        h: Step [s].
        theta: Where in the step the middle is: 1/2, or 1 after a jump.
        rates: Takes the mean rates of own states.

    Returns:
        As ``solve_friction``.
    """
    middle = t + theta * h
    if theta == 1.0:
        # What jumps at the end of the step is not seen yet, however the sum was rounded.
        middle = np.nextafter(np.nextafter(middle, t), t)
    tell_motion(n, w, theta * h)
    _mechanics(n, w, middle)
    show_states(n, w, theta * h)
    compute(n, w, middle, h, rates)
    rubbing = _assemble(n, w, h, theta, row_of(w, f.GUESS))
    c, modes, relative = w[f.COORDINATES], w[f.AT_MODES], row_of(w, f.RELATIVE)
    for i in range(c):
        w[modes + 2 * c + i] = 0
        speed = n[relative + i]
        if speed != 0.0:
            w[modes + i] = 1 if speed > 0.0 else -1
        if not rubbing or n[w[f.AT_LEVELS] + i * f.LEVELS + f.ACTIVE] == 0.0:
            w[modes + i] = 1
    done = _friction(n, w, h)
    if w[f.REPEATS] and done > 0:
        return _settled(n, w, middle, h, theta, rates, done)
    return done


@part
def solve_instant(n: Any, w: Any, t: float, rates: Any) -> int:
    """Accelerations at an instant: a coordinate at rest stays so or starts, unless its mode is held.

    Args:
        n, w: The run.
        t: [s].
        rates: Takes the rates of all states.

    Returns:
        As ``solve_friction``.
    """
    joints, c, x = w[f.JOINTS], w[f.COORDINATES], w[f.AT_STATE]
    guess_still(n, w)
    tell_motion(n, w, 0.0)
    _mechanics(n, w, t)
    show_states(n, w, 0.0)
    compute(n, w, t, 0.0, rates)
    _assemble(n, w, 1.0, 0.0, row_of(w, f.GUESS))
    modes, relative, change = w[f.AT_MODES], row_of(w, f.RELATIVE), row_of(w, f.CHANGE)
    for i in range(c):
        speed = n[relative + i]
        held = w[f.HELD_MODES] != 0
        w[modes + 2 * c + i] = 1 if held or speed != 0.0 else 0
        if speed != 0.0 and not held:
            w[modes + i] = 1 if speed > 0.0 else -1
        if n[w[f.AT_LEVELS] + i * f.LEVELS + f.ACTIVE] == 0.0:
            w[modes + i] = 1
        n[relative + i] = 0.0
    done = _friction(n, w, 1.0)
    for i in range(c):
        rates[i] = n[x + c + i]
        rates[c + i] = n[change + i]
    for i in range(joints):
        m = w[w[f.AT_MOTORS] + i]
        if m != i:
            rates[m] = n[x + c + m] - n[x + c + i]
    return done
