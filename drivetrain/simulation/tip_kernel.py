"""The tip of an arm in its surroundings: where it is and how it moves, and what they do to it."""

from __future__ import annotations

from typing import Any

from drivetrain.dynamics.compiled_vectors import cross, dot, get, part, put
from drivetrain.dynamics.mass_and_bias import COLUMNS, ORIGIN, SCREW, VELOCITY
from drivetrain.simulation import fields as f


@part
def tell_tip(n: Any, w: Any) -> None:
    """Fill place, speed and turning of the tip, along the axes of the base."""
    o, tip, to = w[f.AT_WORK] + (w[f.JOINTS] - 1) * COLUMNS, w[f.AT_TIP], w[f.AT_SIGNALS] + w[f.AT_TIP_SIGNALS]
    for r in range(3):
        at = o + 3 * r
        n[to + r] = n[o + ORIGIN + r] + n[at] * n[tip + 3] + n[at + 1] * n[tip + 7] + n[at + 2] * n[tip + 11]
    turning, place = get(n, o + VELOCITY), get(n, to)
    around = cross(turning, place)
    for r in range(3):
        n[to + 3 + r] = n[o + VELOCITY + 3 + r] + around[r]
    put(n, to + 6, turning)
    for r in range(9):
        n[tip + f.TIP_PLACE + r] = n[to + r]


@part
def try_tip(n: Any, w: Any, shift: float) -> None:
    """Move the tip's signals from those of the guess to those of the trial, and note what force a solution expects.

    Args:
        shift: Time from the beginning of the step to its middle [s].
    """
    joints, c, s, tip = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS], w[f.AT_TIP]
    to, taken = s + w[f.AT_TIP_SIGNALS], s + w[f.AT_TIP_TAKEN]
    guess, trial = w[f.AT_VECTORS] + f.GUESS * c, w[f.AT_VECTORS] + f.TRIAL * c
    before, place = get(n, to + 3), get(n, tip + f.TIP_PLACE)
    speed, turning = get(n, tip + f.TIP_SPEED), get(n, tip + f.TIP_TURNING)
    for k in range(joints):
        more = n[trial + k] - n[guess + k]
        column, around = _column(n, w, k, place), _turning(n, w, k)
        speed = (speed[0] + more * column[0], speed[1] + more * column[1], speed[2] + more * column[2])
        turning = (turning[0] + more * around[0], turning[1] + more * around[1], turning[2] + more * around[2])
    put(n, to + 3, speed)
    put(n, to + 6, turning)
    change = (speed[0] - before[0], speed[1] - before[1], speed[2] - before[2])
    less = _times(n, taken, shift, change)
    for r in range(3):
        n[to + r] = place[r] + shift * (speed[r] - n[tip + f.TIP_SPEED + r])
        n[tip + f.TIP_EXPECTED + r] = n[taken + r] - less[r]
    for k in range(12):
        n[tip + f.TIP_SOFT + k] = n[taken + 6 + k]


@part
def calm_tip(n: Any, w: Any) -> None:
    """Take the mean of how forces fall now and of how they did when last asked: it ends going round in circles."""
    taken, tip = w[f.AT_SIGNALS] + w[f.AT_TIP_TAKEN], w[f.AT_TIP]
    for k in range(12):
        n[taken + 6 + k] = 0.5 * (n[taken + 6 + k] + n[tip + f.TIP_SOFT + k])


@part
def tip_agrees(n: Any, w: Any, shift: float) -> bool:
    """Whether the surroundings answer what the solution expects of them.

    Args:
        shift: Time from the beginning of the step to its middle [s].
    """
    tip, taken = w[f.AT_TIP], w[f.AT_SIGNALS] + w[f.AT_TIP_TAKEN]
    to, off, size, stiff = w[f.AT_SIGNALS] + w[f.AT_TIP_SIGNALS], 0.0, 0.0, 0.0
    for r in range(3):
        off = max(off, abs(n[taken + r] - n[tip + f.TIP_EXPECTED + r]))
        size = max(size, abs(n[taken + r]), abs(n[tip + f.TIP_EXPECTED + r]))
        stiff = max(stiff, _softness(n, taken, shift, 3 * r - r * (r - 1) // 2 if r < 2 else 5))
    far = max(abs(n[to]), abs(n[to + 1]), abs(n[to + 2])) + 1.0
    fast = max(abs(n[to + 3]), abs(n[to + 4]), abs(n[to + 5]))
    return off <= 1e-12 * size + 2e-15 * stiff * (fast + far / shift)


@part
def _softness(n: Any, taken: int, step: float, k: int) -> float:
    """Entry k (xx, xy, xz, yy, yz, zz) of damping and stiffness together [N s/m]."""
    return n[taken + 6 + k] + step * n[taken + 12 + k]


@part
def _times(n: Any, taken: int, step: float, a: tuple[float, float, float]) -> tuple[float, float, float]:
    """Damping and stiffness together, times a speed [N]."""
    xx, xy, xz = _softness(n, taken, step, 0), _softness(n, taken, step, 1), _softness(n, taken, step, 2)
    yy, yz, zz = _softness(n, taken, step, 3), _softness(n, taken, step, 4), _softness(n, taken, step, 5)
    return (
        xx * a[0] + xy * a[1] + xz * a[2],
        xy * a[0] + yy * a[1] + yz * a[2],
        xz * a[0] + yz * a[1] + zz * a[2],
    )


@part
def _turning(n: Any, w: Any, k: int) -> tuple[float, float, float]:
    """Turning of the tip for a unit speed of a coordinate."""
    joints = w[f.JOINTS]
    if not w[f.COUPLED]:
        return get(n, w[f.AT_WORK] + k * COLUMNS + SCREW)
    x = y = z = 0.0
    for j in range(joints):
        turns, screw = n[w[f.AT_TURNS] + j * joints + k], w[f.AT_WORK] + j * COLUMNS + SCREW
        x += turns * n[screw]
        y += turns * n[screw + 1]
        z += turns * n[screw + 2]
    return x, y, z


@part
def _column(n: Any, w: Any, k: int, place: tuple[float, float, float]) -> tuple[float, float, float]:
    """Speed of the tip for a unit speed of a coordinate."""
    joints = w[f.JOINTS]
    if not w[f.COUPLED]:
        screw = w[f.AT_WORK] + k * COLUMNS + SCREW
        around, linear = cross(get(n, screw), place), get(n, screw + 3)
        return linear[0] + around[0], linear[1] + around[1], linear[2] + around[2]
    around = cross(_turning(n, w, k), place)
    x, y, z = around[0], around[1], around[2]
    for j in range(joints):
        turns, screw = n[w[f.AT_TURNS] + j * joints + k], w[f.AT_WORK] + j * COLUMNS + SCREW
        x += turns * n[screw + 3]
        y += turns * n[screw + 4]
        z += turns * n[screw + 5]
    return x, y, z


@part
def add_tip(n: Any, w: Any, h: float, theta: float, guess: int) -> None:
    """What the surroundings do to the tip joins the linear system, and what meshes carry.

    Args:
        h: Step [s].
    """
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    taken, place = s + w[f.AT_TIP_TAKEN], get(n, w[f.AT_TIP] + f.TIP_PLACE)
    speeds = w[f.AT_STATE] + c
    right, carried = w[f.AT_VECTORS] + f.RIGHT * c, w[f.AT_VECTORS] + f.CARRIED * c
    step, moment, force = theta * h, get(n, taken + 3), get(n, taken)
    for k in range(joints):
        soft = _times(n, taken, step, _column(n, w, k, place))
        late = n[guess + k] - n[speeds + k]
        force = (force[0] + soft[0] * late, force[1] + soft[1] * late, force[2] + soft[2] * late)
        for i in range(joints):
            entry = dot(_column(n, w, i, place), soft)
            n[w[f.AT_MATRIX] + i * c + k] += step * entry
            if w[w[f.AT_MOTORS] + i] == i:
                n[w[f.AT_CARRIED] + i * c + k] += theta * entry
    for i in range(joints):
        torque = dot(_column(n, w, i, place), force) + dot(_turning(n, w, i), moment)
        n[right + i] += h * torque
        if w[w[f.AT_MOTORS] + i] == i:
            n[carried + i] -= torque
