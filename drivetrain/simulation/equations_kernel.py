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
from drivetrain.simulation.assembly_kernel import assemble
from drivetrain.simulation.calls import call_all
from drivetrain.simulation.coupled_kernel import spread_bodies, tell_joints
from drivetrain.simulation.friction_kernel import Rubbing, solve_friction
from drivetrain.simulation.settle_kernel import agrees, ask_again
from drivetrain.simulation.tip_kernel import tell_tip
from drivetrain.simulation.vector_rows import row_of

MOST = 60  # solutions of a step, at most


@part
def guess_still(n: Any, w: Any) -> None:
    """Take the speeds of the states as those of the middle."""
    guess, speeds = row_of(w, f.GUESS), w[f.AT_STATE] + w[f.COORDINATES]
    for i in range(w[f.COORDINATES]):
        n[guess + i] = n[speeds + i]


@part
def tell_motion(n: Any, w: Any, shift: float) -> None:
    """Fill the signals of motion from the states, moved on by ``shift`` at the guessed speeds.

    Args:
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
        tell_joints(n, w)


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
            spread_bodies(n, w)
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
def show_states(n: Any, w: Any, shift: float) -> None:
    """Copy own states to the signals of their names, moved on by ``shift`` at their last rates.

    Args:
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
        t: Instant or middle of the step [s].
        h: Step, 0 at an instant [s].
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
def _settled(n: Any, w: Any, t: float, h: float, theta: float, rates: Any, done: int) -> int:
    """Solve again until springs and surroundings of the tip answer what the solution expects of them.

    Newton's method; where nothing bends within the step the first look agrees. It ends after ``MOST`` solutions, which
    are told.
    """
    total = done
    for attempt in range(MOST):
        ask_again(n, w, t, h, theta, rates)
        if agrees(n, w, h, theta, attempt):
            return total
        assemble(n, w, h, theta, row_of(w, f.TRIAL))
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
        t: Beginning of the step [s].
        h: Step [s].
    """
    middle = t + theta * h
    if theta == 1.0:
        # What jumps at the end of the step is not seen yet, however the sum was rounded.
        middle = np.nextafter(np.nextafter(middle, t), t)
    tell_motion(n, w, theta * h)
    _mechanics(n, w, middle)
    show_states(n, w, theta * h)
    compute(n, w, middle, h, rates)
    rubbing = assemble(n, w, h, theta, row_of(w, f.GUESS))
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
        t: [s].
    """
    joints, c, x = w[f.JOINTS], w[f.COORDINATES], w[f.AT_STATE]
    guess_still(n, w)
    tell_motion(n, w, 0.0)
    _mechanics(n, w, t)
    show_states(n, w, 0.0)
    compute(n, w, t, 0.0, rates)
    assemble(n, w, 1.0, 0.0, row_of(w, f.GUESS))
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
