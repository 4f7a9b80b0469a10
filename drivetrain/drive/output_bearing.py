"""The output bearing of a gear: one load that stands for a tilting moment, a radial and an axial force, and its life.

Crossed rollers carry all three, the moment as a couple of radial forces on the pitch circle of the rollers. It is the
moment about the bearing's centre, ``gear.bearing_offset`` behind the flange. Source: Harmonic Drive CSF/CSG catalogue.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear, average_torque

ROLLER_EXPONENT = 10.0 / 3.0


def equivalent_load(gear: Gear, moment: Array, radial: Array, axial: Array) -> Array | None:
    """P = x A + y |Fa|, A = Fr + 2 M/dp; x = 1, y = 0.45 where |Fa| <= 1.5 A, else both 0.67.

    Both lines meet at 1.5 A, so it is the larger of them.

    Args:
        gear: The sheet.
        moment: Across the output axis, about the bearing's centre [N m], any shape.
        radial, axial: Forces [N], that shape.

    Returns:
        [N], that shape; None without a pitch diameter.
    """
    if gear.bearing_pitch_diameter is None:
        return None
    across = np.abs(radial) + 2.0 * np.abs(moment) / gear.bearing_pitch_diameter
    return np.maximum(across + 0.45 * np.abs(axial), 0.67 * (across + np.abs(axial)))


def static_safety(gear: Gear, moment: Array, radial: Array, axial: Array) -> float | None:
    """C0/P0, P0 = Fr + 2 M/dp + 0.44 |Fa| of the largest of each: 1.5 is usual, 2 with shocks, 3 for precision.

    Args:
        gear: The sheet.
        moment, radial, axial: As for ``equivalent_load``, (N,).

    Returns:
        Infinite without a load; None without the rating or the pitch diameter.
    """
    if gear.bearing_pitch_diameter is None or gear.bearing_static_rating is None:
        return None
    across = np.max(np.abs(radial)) + 2.0 * np.max(np.abs(moment)) / gear.bearing_pitch_diameter
    load = float(across + 0.44 * np.max(np.abs(axial)))
    return gear.bearing_static_rating / load if load > 0.0 else math.inf


def bearing_life(gear: Gear, load: Array, speed: Array, weights: Array, *, load_factor: float) -> float | None:
    """L10 = 10^6 turns (C/(fw P))^(10/3), P the mean load over the travel of the output.

    Swings count by the angle they travel; very small ones fret the rollers, and the law does not hold.

    Args:
        gear: The sheet.
        load: From ``equivalent_load`` [N], (N,).
        speed: Of the output [rad/s], (N,).
        weights: Time each sample lasts [s], (N,).
        load_factor: fw: 1 to 1.2 smooth, 1.2 to 1.5 usual, 1.5 to 3 with shocks.

    Returns:
        [s]; infinite where nothing turns or loads it; None without the rating.
    """
    if gear.bearing_dynamic_rating is None:
        return None
    turns = float(np.abs(speed) @ weights) / float(np.sum(weights)) / (2.0 * math.pi)  # a second
    mean = load_factor * average_torque(ROLLER_EXPONENT, load, speed, weights)
    if turns == 0.0 or mean == 0.0:
        return math.inf
    return 1e6 / turns * (gear.bearing_dynamic_rating / mean) ** ROLLER_EXPONENT
