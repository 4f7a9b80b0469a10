"""Set-valued friction of all coordinates at once: which stick, which slide in which direction, exactly.

The equations ``A w = r - h f``, w the change of speeds over a step: a coordinate sticks (its speed after the step is
that of what it slides on, f whatever that takes, within bounds) or slides (f at its bound, against the motion). What a
mesh takes grows with the torque it transmits, so the bound of what slides is in the matrix: with kappa = side * loss,
``(A + h kappa N) w = r - ...``, N the rows of the transmitted torque.

Modes are guessed from the step before and corrected where the answer contradicts them, all at once, and one by one
(least index first, which ends) if that goes round in circles. An answer that contradicts no mode is exact: stuck speeds
are equal to the bit.

Where static friction is above Coulomb friction several sets of modes may fit: of coordinates that reach their bounds at
one instant, one that slides may relieve another. The rule: all that are beyond their bounds let go together, and what
then does not slide its way sticks again. ``several_outcomes`` finds out whether another set fits too.

Reference: Murty, Linear Complementarity, Linear and Nonlinear Programming (1988), section 4.1 (least index).
"""

from __future__ import annotations

from typing import Any

from drivetrain.simulation.core.records import part

ROUNDING = 1e-12  # of a bound: less is no reason to break loose
CALM = 1e-8  # [rad/s^2 or m/s^2]: less beyond its bound a mesh that comes to rest sticks; without load it has no bound
MOST_LOOSE = 8  # coordinates that let go at once, of which all sets are tried
NO_SET = -1001  # no set of modes fits


@part
def hold(bounds: Any, direction: int) -> float:
    """What holds at rest against a push in a direction, at least what slides [N m]."""
    if direction > 0:
        return max(bounds.hold_forward, bounds.slide_forward)
    return max(bounds.hold_backward, bounds.slide_backward)


@part
def slide(bounds: Any, direction: int) -> float:
    """What sliding in a direction takes [N m]."""
    return bounds.slide_forward if direction > 0 else bounds.slide_backward


@part
def _limit(dry: Any, transmitted: float, direction: int) -> float:
    """The friction that must be passed to break loose in a direction."""
    joint = hold(dry.joint, direction)
    load = transmitted + direction * joint
    mesh = dry.driving * load if direction * load > 0.0 else -dry.driven * load
    return joint + hold(dry.motor, direction) + direction * mesh


@part
def _fill(coordinates: Any, pairs: Any, h: float) -> int:
    """The equations of the sliding coordinates; how many these are."""
    c, count = len(coordinates), 0
    for i in range(c):
        one = coordinates[i]
        if one.dry.mode == 0:
            one.change = -one.relative
        else:
            coordinates[count].sliding = i
            count += 1
    for a in range(count):
        i = coordinates[a].sliding
        one = coordinates[i]
        dry, value, kappa = one.dry, one.right, 0.0
        if dry.active:
            mode = dry.mode
            kappa = dry.driving if mode * dry.load_sign > 0 else -dry.driven
            joint = mode * slide(dry.joint, mode)
            value -= h * (joint + mode * slide(dry.motor, mode) + kappa * (one.transmitted + joint))
        filled = 0
        for k in range(c):
            entry = pairs[i, k].matrix
            if kappa != 0.0:
                entry += h * kappa * pairs[i, k].transmitted
            other = coordinates[k]
            if other.dry.mode == 0:
                value -= entry * other.change
            else:
                pairs[a, filled].reduced = entry
                filled += 1
        one.change = value
    return count


@part
def _solve(coordinates: Any, pairs: Any, h: float) -> int:
    """Changes of speed with the modes as they are; a coordinate whose pivot is not positive, or -1."""
    count = _fill(coordinates, pairs, h)
    for a in range(count):
        i = coordinates[a].sliding
        if not pairs[a, a].reduced > 0.0:
            return i
        inverse, own = 1.0 / pairs[a, a].reduced, coordinates[i].change
        pairs[a, a].reduced = inverse
        for b in range(a + 1, count):
            factor = pairs[b, a].reduced * inverse
            if factor != 0.0:
                for k in range(a + 1, count):
                    pairs[b, k].reduced -= factor * pairs[a, k].reduced
                coordinates[coordinates[b].sliding].change -= factor * own
    for a in range(count - 1, -1, -1):
        one = coordinates[coordinates[a].sliding]
        value = one.change
        for b in range(a + 1, count):
            value -= pairs[a, b].reduced * coordinates[coordinates[b].sliding].change
        one.change = value * pairs[a, a].reduced
    return -1


@part
def taken_by_friction(coordinates: Any, pairs: Any, i: int, h: float) -> float:
    """What dry friction takes of a coordinate whose equation it closes [N m]."""
    force = coordinates[i].right
    for k in range(len(coordinates)):
        force -= pairs[i, k].matrix * coordinates[k].change
    return force / h


@part
def _correct_stuck(coordinates: Any, pairs: Any, h: float, i: int, load: float) -> bool:
    """Whether a stuck coordinate must break loose; its mode is changed."""
    one, force = coordinates[i], taken_by_friction(coordinates, pairs, i, h)
    dry, forward, backward = one.dry, _limit(one.dry, load, 1), _limit(one.dry, load, -1)
    slack = ROUNDING * (abs(forward) + abs(backward)) + (CALM * pairs[i, i].mass if dry.driven != 0.0 else 0.0)
    one.friction = force
    one.margin = min(forward - force, backward + force)
    if dry.given or (force <= forward + slack and force >= -backward - slack):
        return False
    dry.mode = 1 if force > forward + slack else -1
    dry.load_sign = 1 if load + dry.mode * hold(dry.joint, dry.mode) >= 0.0 else -1
    return True


@part
def _correct_sliding(one: Any, load: float) -> bool:
    """Whether a sliding coordinate leaves its mode; the mode is changed."""
    dry = one.dry
    one.margin = (one.relative + one.change) * dry.mode
    if one.margin < 0.0 and not dry.given:
        dry.mode = 0
        return True
    load += dry.mode * slide(dry.joint, dry.mode)
    if load * dry.load_sign < 0.0:
        dry.load_sign = -dry.load_sign
        return dry.driving != 0.0 or dry.driven != 0.0
    return False


@part
def _correct(coordinates: Any, pairs: Any, h: float, single: bool) -> int:
    """Change the modes that the answer contradicts; returns how many."""
    c, corrected = len(coordinates), 0
    for i in range(c):
        one = coordinates[i]
        if not one.dry.active:
            continue
        load = 0.0
        if one.dry.driving != 0.0 or one.dry.driven != 0.0:
            load = one.transmitted
            for k in range(c):
                load += pairs[i, k].transmitted * coordinates[k].change
        if one.dry.mode == 0:
            changed = _correct_stuck(coordinates, pairs, h, i, load)
        else:
            changed = _correct_sliding(one, load)
        if changed:
            corrected += 1
            if single:
                break
    return corrected


@part
def solve_friction(coordinates: Any, pairs: Any, h: float) -> int:
    """Changes of speed over a step, or accelerations (h = 1, relative speeds 0)."""
    c = len(coordinates)
    for attempt in range(50 + 20 * c):
        jammed = _solve(coordinates, pairs, h)
        if jammed >= 0:
            return -1 - jammed
        if _correct(coordinates, pairs, h, attempt > 8 + c) == 0:
            return attempt + 1
    return NO_SET


@part
def keep_modes(coordinates: Any) -> None:
    """Keep what friction does while something else is tried."""
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.found_mode, one.found_sign, one.found_given = one.dry.mode, one.dry.load_sign, one.dry.given


@part
def put_back_modes(coordinates: Any) -> None:
    """What friction did before."""
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.dry.mode, one.dry.load_sign, one.dry.given = one.found_mode, one.found_sign, one.found_given


@part
def several_outcomes(coordinates: Any, pairs: Any, h: float) -> int:
    """Of coordinates that have let go together one that may as well hold, all else consistent; -1: there is none.

    The solution stays what it is.
    """
    c, count, held = len(coordinates), 0, -1
    for i in range(c):
        one = coordinates[i]
        if one.before == 0 and one.dry.mode != 0:
            coordinates[count].loose = i
            count += 1
    if count < 2 or count > MOST_LOOSE:
        return -1
    keep_modes(coordinates)
    for stuck in range(1, 2**count - 1):
        for k in range(count):
            dry = coordinates[coordinates[k].loose].dry
            dry.given = 0
            if stuck >> k & 1:
                dry.mode = 0
        fits = _solve(coordinates, pairs, h) < 0 and _correct(coordinates, pairs, h, True) == 0
        put_back_modes(coordinates)
        if fits:
            for k in range(count):
                if stuck >> k & 1:
                    held = coordinates[k].loose
            break
    _solve(coordinates, pairs, h)
    _correct(coordinates, pairs, h, True)
    return held
