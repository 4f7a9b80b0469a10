"""The tip of an arm in its surroundings: where it is and how it moves, and what they do to it."""

from __future__ import annotations

from typing import Any

from drivetrain.dynamics.compiled_vectors import cross, dot, get, part, put
from drivetrain.dynamics.mass_and_bias import COLUMNS, ORIGIN, SCREW, VELOCITY
from drivetrain.simulation import fields as f


@part
def tell_tip(n: Any, w: Any) -> None:
    """Fill place, speed and turning of the tip, along the axes of the base.

    Args:
        n, w: The run, its mechanics just filled.
    """
    o, tip, to = w[f.AT_WORK] + (w[f.JOINTS] - 1) * COLUMNS, w[f.AT_TIP], w[f.AT_SIGNALS] + w[f.AT_TIP_SIGNALS]
    for r in range(3):
        at = o + 3 * r
        n[to + r] = n[o + ORIGIN + r] + n[at] * n[tip + 3] + n[at + 1] * n[tip + 7] + n[at + 2] * n[tip + 11]
    turning, place = get(n, o + VELOCITY), get(n, to)
    around = cross(turning, place)
    for r in range(3):
        n[to + 3 + r] = n[o + VELOCITY + 3 + r] + around[r]
    put(n, to + 6, turning)


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
def _column(n: Any, w: Any, k: int, place: tuple[float, float, float]) -> tuple[float, float, float]:
    """Speed of the tip for a unit speed of a joint."""
    screw = w[f.AT_WORK] + k * COLUMNS + SCREW
    around, linear = cross(get(n, screw), place), get(n, screw + 3)
    return linear[0] + around[0], linear[1] + around[1], linear[2] + around[2]


@part
def add_tip(n: Any, w: Any, h: float, theta: float) -> None:
    """What the surroundings do to the tip joins the linear system, and what meshes carry.

    Args:
        n, w: The run, all but this assembled.
        h: Step [s].
        theta: Where in the step forces are taken.
    """
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    taken, place = s + w[f.AT_TIP_TAKEN], get(n, s + w[f.AT_TIP_SIGNALS])
    speeds, guess = w[f.AT_STATE] + c, w[f.AT_VECTORS] + f.GUESS * c
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
        torque = dot(_column(n, w, i, place), force) + dot(get(n, w[f.AT_WORK] + i * COLUMNS + SCREW), moment)
        n[right + i] += h * torque
        if w[w[f.AT_MOTORS] + i] == i:
            n[carried + i] -= torque
