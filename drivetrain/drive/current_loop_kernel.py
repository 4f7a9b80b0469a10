"""A winding under its current controller, moved exactly over a step while command and speed are held.

Current I and integrator z [V] follow, between the limits of the voltage,

    L I' = V - R I - e,   V = kp (c - I) + z + f,   z' = ki (c - I)

with c the command, e the back-emf and f what is fed forward. At a limit V stays, and z is drawn back by what the
controller asks in vain, over kp/ki (back-calculation), so that it does not wind up. Both are linear, so each stretch
between two changes of the limit has its exponential; a change is enclosed by halving the stretch.

Reference: Astrom and Wittenmark, Computer-Controlled Systems, section 3.5 (anti-windup by back-calculation).
"""

from __future__ import annotations

import math

from drivetrain.jit import kernel

Loop = tuple[float, float, float, float, float, float, float]
SMALLEST = 1.0 / 512.0  # of the step: a change of the limit is enclosed this closely


@kernel
def exponential(m11: float, m12: float, m21: float, m22: float, h: float) -> tuple[float, float, float, float]:
    """The exponential of a two by two matrix times a step.

    Args:
        m11, m12, m21, m22: The matrix [1/s].
        h: [s].

    Returns:
        Its entries, in the same order [-].
    """
    middle = 0.5 * (m11 + m22)
    apart = middle * middle - (m11 * m22 - m12 * m21)
    root = math.sqrt(abs(apart))
    if apart > 0.0 and root * h > 1e-6:
        up, down = math.exp((middle + root) * h), math.exp((middle - root) * h)
        even, odd = 0.5 * (up + down), 0.5 * (up - down) / root
    elif apart < 0.0 and root * h > 1e-6:
        scale = math.exp(middle * h)
        even, odd = scale * math.cos(root * h), scale * math.sin(root * h) / root
    else:
        even = math.exp(middle * h)
        odd = h * even
    return even + odd * (m11 - middle), odd * m12, odd * m21, even + odd * (m22 - middle)


@kernel
def stretch(current: float, integral: float, h: float, limit: float, loop: Loop) -> tuple[float, float, float]:
    """The state after a stretch in which the voltage is free (limit 0) or at one limit.

    Args:
        current, integral: At its beginning [A], [V].
        h: [s].
        limit: The voltage held [V]; 0: the controller's own.
        loop: Resistance [ohm], inductance [H], kp [V/A], ki [V/(A s)], command [A], back-emf [V], fed forward [V].

    Returns:
        Both at its end, and the mean current [A].
    """
    resistance, inductance, kp, ki, command, emf, forward = loop
    if limit == 0.0:
        m11, m12, m21, m22 = -(kp + resistance) / inductance, 1.0 / inductance, -ki, 0.0
        b1, b2 = (kp * command + forward - emf) / inductance, ki * command
    else:
        # With z drawn back over kp/ki the current drops out of its rate.
        m11, m12, m21, m22 = -resistance / inductance, 0.0, 0.0, -ki / kp
        b1, b2 = (limit - emf) / inductance, (limit - forward) * ki / kp
    det = m11 * m22 - m12 * m21
    rest_i, rest_z = -(m22 * b1 - m12 * b2) / det, -(m11 * b2 - m21 * b1) / det
    off_i, off_z = current - rest_i, integral - rest_z
    e11, e12, e21, e22 = exponential(m11, m12, m21, m22, h)
    end_i, end_z = e11 * off_i + e12 * off_z, e21 * off_i + e22 * off_z
    mean = (m22 * (end_i - off_i) - m12 * (end_z - off_z)) / (det * h)
    return rest_i + end_i, rest_z + end_z, rest_i + mean


@kernel
def held_at(current: float, integral: float, volts: float, kp: float, command: float, forward: float) -> float:
    """At which limit the voltage is.

    Args:
        current, integral: The state [A], [V].
        volts: The limit [V].
        kp: [V/A].
        command: [A].
        forward: Fed forward [V].

    Returns:
        The voltage of the limit [V]; 0 between them.
    """
    asked = kp * (command - current) + integral + forward
    return volts if asked > volts else -volts if asked < -volts else 0.0


@kernel
def loop_step(current: float, integral: float, h: float, volts: float, loop: Loop) -> tuple[float, float, float]:
    """The state after a step, through any number of changes at the limit.

    Args:
        current, integral: At its beginning [A], [V].
        h: [s].
        volts: Limit of the voltage [V]; infinite: none.

    Returns:
        Both at its end, and the mean current [A].
    """
    kp, command, forward = loop[2], loop[4], loop[6]
    left, carried, trial = h, 0.0, h
    while left > 0.0:
        trial = min(trial, left)
        limit = held_at(current, integral, volts, kp, command, forward)
        i, z, mean = stretch(current, integral, trial, limit, loop)
        if trial > SMALLEST * h and volts < math.inf:
            i_half, z_half, _ = stretch(current, integral, 0.5 * trial, limit, loop)
            same = held_at(i, z, volts, kp, command, forward) == limit
            if not (same and held_at(i_half, z_half, volts, kp, command, forward) == limit):
                trial *= 0.5
                continue
        current, integral = i, z
        carried += trial * mean
        left -= trial
        trial *= 2.0
        if left <= 1e-12 * h:
            break
    return current, integral, carried / h
