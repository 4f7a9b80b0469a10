"""The gear's spring for compiled code: torque, slope and energy of a twist, the inverse of ``gear.wind_up``.

Compiled into effects; a change here must be told there, see their ``SOURCES``.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from drivetrain.drive.gear import Gear, wind_up
from drivetrain.drive.gear_stiffness import tangent_stiffness
from drivetrain.errors import Fault, InputError


def spring_numbers(gear: Gear) -> tuple[float, float, float, float, float]:
    """The constants of a gear's spring.

    Args:
        gear: The sheet, with a stiffness.

    Returns:
        The three slopes [N m/rad] and the two twists between them [rad]; infinite where there is no further piece.

    Raises:
        InputError: The gear has no stiffness.
    """
    if gear.stiffness_1 is None:
        hint = "state one, or leave the spring out"
        raise InputError(Fault(f"gear {gear.key}.stiffness_1", "is unknown, so it has no spring", None, hint))
    slopes, bends = [gear.stiffness_1], []
    for torque in (gear.torque_1, gear.torque_2):
        above = None if torque is None else tangent_stiffness(gear, np.array(torque * (1.0 + 1e-9)))
        twist = None if torque is None else wind_up(gear, np.array(torque))
        if above is None or twist is None or float(above) == slopes[-1]:
            break
        slopes.append(float(above))
        bends.append(float(twist))
    return (
        *(slopes + [slopes[-1]] * 2)[:3],
        *(bends + [math.inf] * 2)[:2],
    )  # type: ignore[return-value]


@nb.njit(error_model="numpy", nogil=True)
def spring(k1: float, k2: float, k3: float, bend1: float, bend2: float, twist: float) -> tuple[float, float, float]:
    """What a spring of three pieces answers.

    Args:
        k1, k2, k3: Slopes [N m/rad].
        bend1, bend2: Twists between them [rad].
        twist: [rad].

    Returns:
        Torque [N m], slope [N m/rad] and stored energy [J].

    Reference:
        K1, K2, K3 of the Harmonic Drive catalogues, continuous.
    """
    size = abs(twist)
    torque, slope, energy = k1 * size, k1, 0.5 * k1 * size * size
    if size > bend1:
        over = size - bend1
        torque += (k2 - k1) * over
        energy += 0.5 * (k2 - k1) * over * over
        slope = k2
    if size > bend2:
        over = size - bend2
        torque += (k3 - k2) * over
        energy += 0.5 * (k3 - k2) * over * over
        slope = k3
    return (torque if twist >= 0.0 else -torque), slope, energy
