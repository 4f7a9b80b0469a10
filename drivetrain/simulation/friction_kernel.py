"""Set-valued friction of all coordinates at once: which stick, which slide and which way, exactly.

The equations ``A w = r - h f``, w the change of speeds over a step: a coordinate sticks (its speed after the step is
that of what it rubs on, f whatever that takes, within bounds) or slides (f at its bound, against the motion). What a
mesh takes grows with the torque it carries, so the bound of what slides is in the matrix: with kappa = side * loss,
``(A + h kappa N) w = r - ...``, N the rows that tell the carried torque.

Modes are guessed from the step before and mended where the answer contradicts them, all at once, and one by one (least
index first, which ends) if that goes round in circles. An answer that contradicts no mode is exact: stuck speeds are
equal to the bit.

Reference: Murty, Linear Complementarity, Linear and Nonlinear Programming (1988), section 4.1 (least index).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation.fields import (
    ACTIVE,
    CARRIED,
    CHANGE,
    DRIVEN,
    DRIVING,
    FRICTION,
    HOLD,
    LEVELS,
    MARGIN,
    MOTOR,
    RELATIVE,
    RIGHT,
    SLIDE,
)

ROUNDING = 1e-12  # of a bound: less is no reason to break loose


class Rubbing(NamedTuple):
    """Where ``solve_friction`` finds and leaves what: indices into the blocks of real and of whole numbers.

    Attributes:
        total: Number of coordinates n.
        matrix: Effective inertia [kg m^2], (n, n).
        carried: Torque carried by the mesh for a change of speeds [N m s], (n, n).
        reduced: Scratch, (n + 1, n).
        vectors: Impulse without friction [N m s], carried torque without changes [N m], speeds over what is rubbed on
            [rad/s]; takes changes of speed, friction of the stuck [N m] and margins, (VECTORS, n).
        levels: Bounds of friction, see ``fields.py`` [N m], (n, LEVELS).
        modes: 1 forward, -1 backward, 0 stuck; then signs of the carried torque; then 1 where the mode is given and not
            to be changed, (3, n).
    """

    total: int
    matrix: int
    carried: int
    reduced: int
    vectors: int
    levels: int
    modes: int


@part
def _limit(n: Any, row: int, carried: float, way: int) -> float:
    """The friction that must be passed to break loose in a way (0 forward, 1 backward)."""
    sign = 1.0 - 2.0 * way
    joint = max(n[row + HOLD + way], n[row + SLIDE + way])
    load = carried + sign * joint
    mesh = n[row + DRIVING] * load if sign * load > 0.0 else -n[row + DRIVEN] * load
    return joint + max(n[row + MOTOR + HOLD + way], n[row + MOTOR + SLIDE + way]) + sign * mesh


# long kernel: what a sliding coordinate's mode says, put into its equation
@part
def _fill(at: Rubbing, h: float, n: Any, w: Any) -> int:
    """The equations of the sliding coordinates; how many these are."""
    total, count = at.total, 0
    slides = at.reduced + total * total
    change, relative = at.vectors + CHANGE * total, at.vectors + RELATIVE * total
    for i in range(total):
        if w[at.modes + i] == 0:
            n[change + i] = -n[relative + i]
        else:
            n[slides + count] = i
            count += 1
    for a in range(count):
        i = int(n[slides + a])
        level = at.levels + i * LEVELS
        value, kappa = n[at.vectors + RIGHT * total + i], 0.0
        if n[level + ACTIVE] != 0.0:
            way = float(w[at.modes + i])
            back = 0 if way > 0.0 else 1
            kappa = n[level + DRIVING] if way * w[at.modes + total + i] > 0.0 else -n[level + DRIVEN]
            joint = way * n[level + SLIDE + back]
            load = n[at.vectors + CARRIED * total + i] + joint
            value -= h * (joint + way * n[level + MOTOR + SLIDE + back] + kappa * load)
        row, source, meshes, filled = at.reduced + a * total, at.matrix + i * total, at.carried + i * total, 0
        for k in range(total):
            entry = n[source + k]
            if kappa != 0.0:
                entry += h * kappa * n[meshes + k]
            if w[at.modes + k] == 0:
                value -= entry * n[change + k]
            else:
                n[row + filled] = entry
                filled += 1
        n[change + i] = value
    return count


@part
def _solve(at: Rubbing, h: float, n: Any, w: Any) -> int:
    """Changes of speed with the modes as they are; a coordinate whose pivot is not positive, or -1."""
    total = at.total
    count = _fill(at, h, n, w)
    slides, change = at.reduced + total * total, at.vectors + CHANGE * total
    for a in range(count):
        row = at.reduced + a * total
        i = int(n[slides + a])
        if not n[row + a] > 0.0:
            return i
        inverse, own = 1.0 / n[row + a], n[change + i]
        n[row + a] = inverse
        for b in range(a + 1, count):
            below = at.reduced + b * total
            factor = n[below + a] * inverse
            if factor != 0.0:
                for k in range(a + 1, count):
                    n[below + k] -= factor * n[row + k]
                n[change + int(n[slides + b])] -= factor * own
    for a in range(count - 1, -1, -1):
        row, i = at.reduced + a * total, int(n[slides + a])
        value = n[change + i]
        for b in range(a + 1, count):
            value -= n[row + b] * n[change + int(n[slides + b])]
        n[change + i] = value * n[row + a]
    return -1


@part
def _mend_stuck(at: Rubbing, h: float, n: Any, w: Any, i: int, load: float) -> bool:
    """Whether a stuck coordinate must break loose; its mode is changed."""
    total, level = at.total, at.levels + i * LEVELS
    force, source = n[at.vectors + RIGHT * total + i], at.matrix + i * total
    for k in range(total):
        force -= n[source + k] * n[at.vectors + CHANGE * total + k]
    force /= h
    forward, backward = _limit(n, level, load, 0), _limit(n, level, load, 1)
    slack = ROUNDING * (abs(forward) + abs(backward))
    n[at.vectors + FRICTION * total + i] = force
    n[at.vectors + MARGIN * total + i] = min(forward - force, backward + force)
    if w[at.modes + 2 * total + i] or (force <= forward + slack and force >= -backward - slack):
        return False
    way = 1 if force > forward + slack else -1
    w[at.modes + i] = way
    back = 0 if way > 0 else 1
    joint = way * max(n[level + HOLD + back], n[level + SLIDE + back])
    w[at.modes + total + i] = 1 if load + joint >= 0.0 else -1
    return True


@part
def _mend_sliding(at: Rubbing, n: Any, w: Any, i: int, load: float) -> bool:
    """Whether a sliding coordinate does not go on as its mode says; the mode is changed."""
    total, level, way = at.total, at.levels + i * LEVELS, w[at.modes + i]
    after = (n[at.vectors + RELATIVE * total + i] + n[at.vectors + CHANGE * total + i]) * way
    n[at.vectors + MARGIN * total + i] = after
    if after < 0.0 and not w[at.modes + 2 * total + i]:
        w[at.modes + i] = 0
        return True
    load += way * n[level + SLIDE + (0 if way > 0 else 1)]
    if load * w[at.modes + total + i] < 0.0:
        w[at.modes + total + i] = -w[at.modes + total + i]
        return n[level + DRIVING] != 0.0 or n[level + DRIVEN] != 0.0
    return False


@part
def _mend(at: Rubbing, h: float, n: Any, w: Any, single: bool) -> int:
    """Change the modes that the answer contradicts, and tell how many."""
    total, mended = at.total, 0
    for i in range(total):
        level = at.levels + i * LEVELS
        if n[level + ACTIVE] == 0.0:
            continue
        load = 0.0
        if n[level + DRIVING] != 0.0 or n[level + DRIVEN] != 0.0:
            load, meshes = n[at.vectors + CARRIED * total + i], at.carried + i * total
            for k in range(total):
                load += n[meshes + k] * n[at.vectors + CHANGE * total + k]
        if w[at.modes + i] == 0:
            changed = _mend_stuck(at, h, n, w, i, load)
        else:
            changed = _mend_sliding(at, n, w, i, load)
        if changed:
            mended += 1
            if single:
                break
    return mended


@part
def solve_friction(at: Rubbing, h: float, n: Any, w: Any) -> int:
    """Changes of speed over a step, or accelerations (h = 1, relative speeds 0).

    Args:
        h: Step [s].
        n: All real numbers [SI].
    """
    most = 50 + 20 * at.total
    for attempt in range(most):
        jammed = _solve(at, h, n, w)
        if jammed >= 0:
            return -1 - jammed
        if _mend(at, h, n, w, attempt > 8 + at.total) == 0:
            return attempt + 1
    return -1001
