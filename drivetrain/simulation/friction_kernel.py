"""Set-valued friction of all coordinates at once: which stick, which slide and which way, exactly.

The equations ``A w = r - f``, w the change of speeds over a step, f the friction's impulse: a coordinate sticks (its
speed after the step is that of what it rubs on, f whatever that takes, within the bounds) or slides (f at its bound,
against the motion). What a mesh takes grows with the torque it carries, so a sliding coordinate has its bound in the
matrix: with kappa = side * loss, ``(A + kappa N) w = r - ...``, N the rows that tell the carried torque.

Modes are guessed from the step before and mended where the answer contradicts them, all at once, and one by one (least
index first, which ends) if that goes round in circles. An answer that contradicts no mode is exact: stuck speeds are
equal to the bit.

Reference: Murty, Linear Complementarity, Linear and Nonlinear Programming (1988), section 4.1 (least index).
"""

from __future__ import annotations

from drivetrain.arrays import Array
from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation.fields import (
    ACTIVE,
    CARRIED,
    CHANGE,
    DRIVEN,
    DRIVING,
    FRICTION,
    HOLD,
    MARGIN,
    MOTOR,
    RELATIVE,
    RIGHT,
    SLIDE,
)

ROUNDING = 1e-12  # of a bound: less is no reason to break loose


@part
def _loss(row: Array, way: float, side: float) -> float:
    """Loss over carried torque, signed as it acts when sliding in a way with the carried torque on a side."""
    return row[DRIVING] if way * side > 0.0 else -row[DRIVEN]


@part
def _limit(row: Array, carried: float, way: int) -> float:
    """The friction that must be passed to break loose in a way (0 forward, 1 backward)."""
    sign = 1.0 - 2.0 * way
    joint = max(row[HOLD + way], row[SLIDE + way])
    load = carried + sign * joint
    mesh = row[DRIVING] * load if sign * load > 0.0 else -row[DRIVEN] * load
    return joint + max(row[MOTOR + way], row[MOTOR + 2 + way]) + sign * mesh


# long kernel: fill, eliminate and solve without leaving the nearest cache
@part
def _solve(
    h: float, matrix: Array, rows: Array, levels: Array, vectors: Array, modes: Array, sides: Array, reduced: Array
) -> int:
    """Changes of speed with the modes as they are; a coordinate whose pivot is not positive, or -1."""
    total, count = len(matrix), 0
    right, change, relative, carried = vectors[RIGHT], vectors[CHANGE], vectors[RELATIVE], vectors[CARRIED]
    slides = reduced[total]
    for i in range(total):
        if modes[i] == 0:
            change[i] = -relative[i]
        else:
            slides[count] = i
            count += 1
    for a in range(count):
        i = int(slides[a])
        level, way = levels[i], float(modes[i])
        value = right[i]
        kappa = 0.0
        if level[ACTIVE] != 0.0:
            at = 0 if way > 0.0 else 1
            kappa = _loss(level, way, float(sides[i]))
            joint = way * level[SLIDE + at]
            value -= h * (joint + way * level[MOTOR + 2 + at] + kappa * (carried[i] + joint))
        for k in range(total):
            entry = matrix[i, k]
            if kappa != 0.0:
                entry += h * kappa * rows[i, k]
            reduced[a, k] = entry
            if modes[k] == 0:
                value -= entry * change[k]
        for b in range(count):
            reduced[a, b] = reduced[a, int(slides[b])]
        change[i] = value
    for a in range(count):
        pivot = reduced[a, a]
        if not pivot > 0.0:
            return int(slides[a])
        inverse = 1.0 / pivot
        i = int(slides[a])
        for b in range(a + 1, count):
            factor = reduced[b, a] * inverse
            if factor != 0.0:
                for k in range(a + 1, count):
                    reduced[b, k] -= factor * reduced[a, k]
                change[int(slides[b])] -= factor * change[i]
    for a in range(count - 1, -1, -1):
        value = change[int(slides[a])]
        for b in range(a + 1, count):
            value -= reduced[a, b] * change[int(slides[b])]
        change[int(slides[a])] = value / reduced[a, a]
    return -1


# long kernel: one check for each thing a mode claims
@part
def _mend(
    h: float, matrix: Array, rows: Array, levels: Array, vectors: Array, modes: Array, sides: Array, fixed: Array,
    single: bool,
) -> int:  # fmt: skip
    """Change the modes that the answer contradicts, and tell how many."""
    total, mended = len(matrix), 0
    right, change, relative, carried = vectors[RIGHT], vectors[CHANGE], vectors[RELATIVE], vectors[CARRIED]
    for i in range(total):
        level = levels[i]
        if level[ACTIVE] == 0.0:
            continue
        load = carried[i]
        if level[DRIVING] != 0.0 or level[DRIVEN] != 0.0:
            for k in range(total):
                load += rows[i, k] * change[k]
        if modes[i] == 0:
            force = right[i]
            for k in range(total):
                force -= matrix[i, k] * change[k]
            force /= h
            forward, backward = _limit(level, load, 0), _limit(level, load, 1)
            slack = ROUNDING * (abs(forward) + abs(backward))
            vectors[FRICTION, i] = force
            vectors[MARGIN, i] = min(forward - force, backward + force)
            if fixed[i] or (force <= forward + slack and force >= -backward - slack):
                continue
            modes[i] = 1 if force > forward + slack else -1
            joint = max(level[HOLD], level[SLIDE]) if modes[i] > 0 else -max(level[HOLD + 1], level[SLIDE + 1])
            sides[i] = 1 if load + joint >= 0.0 else -1
        else:
            after = (relative[i] + change[i]) * modes[i]
            at = 0 if modes[i] > 0 else 1
            load += modes[i] * level[SLIDE + at]
            vectors[MARGIN, i] = after
            if after < 0.0 and not fixed[i]:
                modes[i] = 0
            elif load * sides[i] < 0.0 and (level[DRIVING] != 0.0 or level[DRIVEN] != 0.0):
                sides[i] = -sides[i]
            else:
                continue
        mended += 1
        if single:
            return mended
    return mended


@part
def solve_friction(
    h: float, matrix: Array, rows: Array, levels: Array, vectors: Array, modes: Array, sides: Array, fixed: Array,
    reduced: Array,
) -> int:  # fmt: skip
    """Changes of speed over a step, or accelerations (h = 1, relative speeds 0), into ``vectors``.

    Args:
        h: Step [s].
        matrix: Effective inertia [kg m^2], (n, n).
        rows: Torque carried by the mesh for a change of speeds [N m s], (n, n).
        levels: Bounds of friction, see ``fields.py`` [N m], (n, LEVELS).
        vectors: Impulse without friction [N m s], carried torque without changes [N m], speeds over what is rubbed on
            [rad/s]; takes changes of speed, friction of the stuck [N m] and margins, (VECTORS, n).
        modes: 1 forward, -1 backward, 0 stuck, (n,).
        sides: Sign of the carried torque, (n,).
        fixed: 1 where the mode is given and not to be changed, (n,).
        reduced: Scratch, (n + 1, n).

    Returns:
        Number of systems solved; negative when none fits: -1 - i, jammed at coordinate i; below -1000, no end.
    """
    total = len(matrix)
    most = 50 + 20 * total
    for attempt in range(most):
        jammed = _solve(h, matrix, rows, levels, vectors, modes, sides, reduced)
        if jammed >= 0:
            return -1 - jammed
        if _mend(h, matrix, rows, levels, vectors, modes, sides, fixed, attempt > 8 + total) == 0:
            return attempt + 1
    return -1001
