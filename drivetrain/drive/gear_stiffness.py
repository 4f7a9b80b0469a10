"""How stiff a gear is about the torque it carries: the slope of its wind-up."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear


def tangent_stiffness(gear: Gear, output_torque: Array) -> Array | None:
    """The slope of torque over wind-up at a torque: what a small vibration about it feels, backlash left out.

    Args:
        gear: The sheet; one stiffness holds at every torque, two or three from ``torque_1`` and ``torque_2`` on.
        output_torque: [N m], any shape; its sign does not matter.

    Returns:
        [N m/rad] at the output, that shape; at a bend the softer piece before it. None without a stiffness.

    Reference:
        K1 up to T1, K2 from T1 to T2, K3 above T2 (Harmonic Drive catalogues).
    """
    if gear.stiffness_1 is None:
        return None
    torque = np.abs(np.asarray(output_torque, dtype=np.float64))
    stiffness = np.full_like(torque, gear.stiffness_1)
    for start, piece in ((gear.torque_1, gear.stiffness_2), (gear.torque_2, gear.stiffness_3)):
        if start is None or piece is None:
            break  # as wind_up: a piece whose start is unknown is not used, nor those after it
        stiffness = np.where(torque > start, piece, stiffness)
    return stiffness
