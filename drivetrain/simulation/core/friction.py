"""Set-valued dry friction of all coordinates: the contact modes (stick or slip) as a linear complementarity problem.

In the equations ``A w = r - h f``, w are the changes of speed over a step and f the friction. A coordinate either
sticks (its speed after the step equals that of its contact surface, and f is whatever this requires, within its bounds)
or slips (f is at its bound, against the motion). The loss of a mesh is proportional to the torque that it transmits, so
the bound of a slipping coordinate enters the matrix: with kappa = sign * loss, ``(A + h kappa N) w = r - ...``, where N
are the rows of the transmitted torque.

The modes are guessed from the step before, and those that the solution contradicts are corrected: all at once, and one
by one, the least index first, if that does not converge; this rule terminates. A solution that contradicts no mode is
exact: stuck coordinates have exactly the speed of their surface.

Where static friction exceeds Coulomb friction, several sets of modes may satisfy the equations: of coordinates that
reach their bounds at the same time, one that slips may relieve another. The rule here: all that exceed their bounds
start to slip together, and those that then do not move in that direction stick again. ``ambiguous_modes`` tests
whether another set is a solution as well.

Reference: Murty, Linear Complementarity, Linear and Nonlinear Programming (1988), section 4.1 (least index).
"""

from __future__ import annotations

from typing import Any

from drivetrain.simulation.core.records import part

ROUNDING = 1e-12  # share of its bound by which friction may exceed it without breaking loose
# Acceleration beyond its bound up to which a mesh sticks [rad/s^2 or m/s^2], since without load its bound is zero.
MESH_REST_MARGIN = 1e-8
MOST_RELEASED = 8  # coordinates that start to slip together, at most, for which all combinations are tested
NO_MODES_FOUND = -1001  # return code: no consistent set of contact modes was found


@part
def static_bound(bounds: Any, direction: int) -> float:
    """Bound of static friction against motion in a direction, at least that of sliding friction [N m]."""
    if direction > 0:
        return max(bounds.hold_forward, bounds.slide_forward)
    return max(bounds.hold_backward, bounds.slide_backward)


@part
def sliding_bound(bounds: Any, direction: int) -> float:
    """Friction while slipping in a direction [N m]."""
    return bounds.slide_forward if direction > 0 else bounds.slide_backward


@part
def slipping_loss(dry: Any) -> float:
    """Torque lost in a slipping mesh over the torque that it transmits, negative if the load drives forward [-]."""
    return dry.driving if dry.mode * dry.load_sign > 0 else -dry.driven


@part
def _breakaway_torque(dry: Any, transmitted: float, direction: int) -> float:
    """Friction of joint, motor and mesh that must be exceeded to break loose in a direction [N m].

    A self-locking mesh holds more with less friction at its joint, which then loads it more, so the sliding friction of
    the joint is tried too: otherwise a coordinate could break loose, but not slide.
    """
    most, motor = 0.0, static_bound(dry.motor, direction)
    for joint in (static_bound(dry.joint, direction), sliding_bound(dry.joint, direction)):
        load = direction * transmitted + joint
        most = max(most, joint + motor + (dry.driving if load > 0.0 else -dry.driven) * load)
    return most


@part
def _reduce_system(coordinates: Any, pairs: Any, h: float) -> int:
    """Fill the reduced system of the slipping coordinates; returns how many there are."""
    c, count = len(coordinates), 0
    for i in range(c):
        one = coordinates[i]
        if one.dry.mode == 0:
            one.change = -one.relative
        else:
            coordinates[count].slipping = i
            count += 1
    for a in range(count):
        i = coordinates[a].slipping
        one = coordinates[i]
        dry, value, kappa = one.dry, one.impulse, 0.0
        if dry.active:
            mode = dry.mode
            kappa = slipping_loss(dry)
            joint = mode * sliding_bound(dry.joint, mode)
            value -= h * (joint + mode * sliding_bound(dry.motor, mode) + kappa * (one.transmitted + joint))
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
    """Solve for the changes of speed with the present modes, by LU factorisation of the reduced system.

    Returns -1, or the coordinate whose pivot is not positive: its mesh jams.
    """
    count = _reduce_system(coordinates, pairs, h)
    for a in range(count):
        i = coordinates[a].slipping
        if not pairs[a, a].reduced > 0.0:
            return i
        inverse, own = 1.0 / pairs[a, a].reduced, coordinates[i].change
        pairs[a, a].reduced = inverse
        for b in range(a + 1, count):
            factor = pairs[b, a].reduced * inverse
            if factor != 0.0:
                for k in range(a + 1, count):
                    pairs[b, k].reduced -= factor * pairs[a, k].reduced
                coordinates[coordinates[b].slipping].change -= factor * own
    for a in range(count - 1, -1, -1):
        one = coordinates[coordinates[a].slipping]
        value = one.change
        for b in range(a + 1, count):
            value -= pairs[a, b].reduced * coordinates[coordinates[b].slipping].change
        one.change = value * pairs[a, a].reduced
    return -1


@part
def friction_torque(coordinates: Any, pairs: Any, i: int, h: float) -> float:
    """Friction of coordinate i, as the residual of its equation of motion [N m]."""
    force = coordinates[i].impulse
    for k in range(len(coordinates)):
        force -= pairs[i, k].matrix * coordinates[k].change
    return force / h


@part
def _correct_stuck(coordinates: Any, pairs: Any, h: float, i: int, load: float) -> bool:
    """Change the mode of a stuck coordinate whose friction exceeds its bounds to slip; whether it was changed."""
    one, force = coordinates[i], friction_torque(coordinates, pairs, i, h)
    dry, forward, backward = one.dry, _breakaway_torque(one.dry, load, 1), _breakaway_torque(one.dry, load, -1)
    mesh_margin = MESH_REST_MARGIN * pairs[i, i].mass if dry.driven != 0.0 else 0.0
    slack = ROUNDING * (abs(forward) + abs(backward)) + mesh_margin
    one.friction = force
    one.margin = min(forward - force, backward + force)
    if dry.mode_fixed or (force <= forward + slack and force >= -backward - slack):
        return False
    dry.mode = 1 if force > forward + slack else -1
    dry.load_sign = 1 if load + dry.mode * static_bound(dry.joint, dry.mode) >= 0.0 else -1
    return True


@part
def _correct_sliding(one: Any) -> bool:
    """Change the mode of a slipping coordinate that has reversed to stick; whether its mode was changed."""
    dry = one.dry
    one.margin = (one.relative + one.change) * dry.mode
    if one.margin < 0.0 and not dry.mode_fixed:
        dry.mode = 0
        return True
    return False


@part
def _correct_sign(dry: Any, load: float) -> bool:
    """Correct the sign of the torque that a slipping mesh transmits, on which its loss depends; whether it mattered."""
    if (load + dry.mode * sliding_bound(dry.joint, dry.mode)) * dry.load_sign < 0.0:
        dry.load_sign = -dry.load_sign
        return dry.driving != 0.0 or dry.driven != 0.0
    return False


@part
def _transmitted(coordinates: Any, pairs: Any, i: int) -> float:
    """Torque that the mesh of coordinate i transmits, without friction at its joint; 0 if it has no loss [N m]."""
    dry, load = coordinates[i].dry, 0.0
    if dry.driving != 0.0 or dry.driven != 0.0:
        load = coordinates[i].transmitted
        for k in range(len(coordinates)):
            load += pairs[i, k].transmitted * coordinates[k].change
    return load


@part
def _correct(coordinates: Any, pairs: Any, h: float, single: bool) -> int:
    """Correct the modes that the solution contradicts, or (``single``) only the first; returns how many.

    Signs of transmitted torques come first, since with a wrong one a coordinate may seem not to slip.
    """
    c, corrected = len(coordinates), 0
    if not single:
        for i in range(c):
            dry = coordinates[i].dry
            if dry.active and dry.mode != 0 and _correct_sign(dry, _transmitted(coordinates, pairs, i)):
                corrected += 1
        if corrected > 0:
            return corrected
    for i in range(c):
        one = coordinates[i]
        if not one.dry.active:
            continue
        load = _transmitted(coordinates, pairs, i)
        if one.dry.mode == 0:
            changed = _correct_stuck(coordinates, pairs, h, i, load)
        else:
            changed = _correct_sliding(one) or _correct_sign(one.dry, load)
        if changed:
            corrected += 1
            if single:
                break
    return corrected


@part
def solve_friction(coordinates: Any, pairs: Any, h: float) -> int:
    """Solve for the changes of speed over a step, or for accelerations (h = 1, relative speeds 0).

    Returns the number of solutions of the linear system, or a negative code: -1 - i if the mesh of coordinate i jams,
    or ``NO_MODES_FOUND``.
    """
    c = len(coordinates)
    for attempt in range(50 + 20 * c):
        jammed = _solve(coordinates, pairs, h)
        if jammed >= 0:
            return -1 - jammed
        if _correct(coordinates, pairs, h, attempt > 8 + c) == 0:
            return attempt + 1
    return NO_MODES_FOUND


@part
def save_modes(coordinates: Any) -> None:
    """Save the contact modes, before others are tried."""
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.saved_mode, one.saved_sign, one.saved_fixed = one.dry.mode, one.dry.load_sign, one.dry.mode_fixed


@part
def restore_modes(coordinates: Any) -> None:
    """Restore the contact modes saved by ``save_modes``."""
    for i in range(len(coordinates)):
        one = coordinates[i]
        one.dry.mode, one.dry.load_sign, one.dry.mode_fixed = one.saved_mode, one.saved_sign, one.saved_fixed


@part
def ambiguous_modes(coordinates: Any, pairs: Any, h: float) -> int:
    """Find out whether the contact modes of the solution are unique.

    Tests all combinations in which some of the coordinates that have started to slip together stick instead. Returns a
    coordinate that sticks in another consistent set of modes, or -1 if there is none. The solution is left unchanged.
    """
    c, count, held = len(coordinates), 0, -1
    for i in range(c):
        one = coordinates[i]
        if one.before == 0 and one.dry.mode != 0:
            coordinates[count].released = i
            count += 1
    if count < 2 or count > MOST_RELEASED:
        return -1
    save_modes(coordinates)
    for stuck in range(1, 2**count - 1):
        for k in range(count):
            dry = coordinates[coordinates[k].released].dry
            dry.mode_fixed = 0
            if stuck >> k & 1:
                dry.mode = 0
        fits = _solve(coordinates, pairs, h) < 0 and _correct(coordinates, pairs, h, True) == 0
        restore_modes(coordinates)
        if fits:
            for k in range(count):
                if stuck >> k & 1:
                    held = coordinates[k].released
            break
    _solve(coordinates, pairs, h)
    _correct(coordinates, pairs, h, True)
    return held
