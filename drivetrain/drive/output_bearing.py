"""The output bearing of a gear: one load that stands for a tilting moment, a radial and an axial force, and its life.

Crossed rollers carry all three, the moment as a couple of radial forces on the pitch circle of the rollers. Source:
Harmonic Drive CSF/CSG catalogue; the cases of the equivalent load as for any crossed roller bearing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.jit import law
from drivetrain.records import known, known_or

ROLLER_EXPONENT = 10.0 / 3.0


@law
def bearing_arm(gear: Any) -> Any:
    """From the output flange to the bearing's centre [m]; NaN where the sheet tells the bearing's diameter without it.

    0 where the sheet tells neither: its tilting moment is then held against that about the flange.
    """
    return gear.bearing_offset if known(gear.bearing_pitch_diameter) else known_or(gear.bearing_offset, 0.0)


@law
def moment_square(arm: Any, mx: Any, my: Any, fx: Any, fy: Any) -> Any:
    """Square of the moment across the axis about a point so far along it on either side, the larger one [N^2 m^2].

    M + F x d z, (mx + d fy, my - d fx): nobody states on which side of the joint its flange lies. The radial force is
    counted in it by this lever, and once more by itself in the loads below: these are two effects of it.
    """
    return mx * mx + my * my + arm * (arm * (fx * fx + fy * fy) + 2.0 * abs(mx * fy - my * fx))


@law
def static_load(diameter: Any, moment: Any, radial: Any, axial: Any) -> Any:
    """P0 = Fr + 2 M/dp + 0.44 Fa [N] of the largest of each.

    C0/P0 should be 1.5, with shocks 2, for precision 3 (Harmonic Drive FHA-C catalogue, p. 23).
    """
    return radial + 2.0 * moment / diameter + 0.44 * axial


@law
def equivalent_load(diameter: Any, moment: Any, radial: Any, axial: Any) -> Any:
    """P = x A + y Fa, A = Fr + 2 M/dp [N]; x = 1, y = 0.45 where Fa <= 1.5 A, else both 0.67.

    Both lines meet at 1.5 A, so it is the larger of them; all loads are magnitudes.
    """
    across = radial + 2.0 * moment / diameter
    return np.maximum(across + 0.45 * axial, 0.67 * (across + axial))


@law
def bearing_life(rating: Any, load_factor: Any, mean_load: Any, mean_speed: Any) -> Any:
    """L10 = 10^6 turns (C/(fw P))^(10/3) [s]; infinite where nothing turns or loads it.

    Swings count by the angle they travel; very small ones fret the rollers, and the law does not hold. Harmonic Drive
    CSF/CSG catalogue, pp. 34-35.
    """
    return 2e6 * math.pi / mean_speed * (rating / (load_factor * mean_load)) ** ROLLER_EXPONENT
