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


def spring_torque(gear: Gear, deflection: Array) -> Array | None:
    """The torque that a wind-up makes: ``wind_up`` the other way round, backlash left out.

    Give it the deflection itself. Taken as the difference of two angles it is mere rounding once they are large: after
    1e6 rad, 1e-10 rad of it, which is 1e-4 N m on a spring of 1e6 N m/rad. Keep the deflection as a state of its own.

    Args:
        gear: The sheet; one stiffness gives a straight line, two or three give bends at ``torque_1`` and ``torque_2``.
        deflection: Twist between input and output, at the output [rad], any shape.

    Returns:
        Torque at the output [N m], that shape, of the sign of the deflection; None without a stiffness.

    Reference:
        T1/K1 + (T2 - T1)/K2 + (T - T2)/K3 above T2 (Harmonic Drive catalogues, made continuous), solved for T.
    """
    if gear.stiffness_1 is None:
        return None
    twist = np.abs(np.asarray(deflection, dtype=np.float64))
    torque, stiffness = gear.stiffness_1 * twist, gear.stiffness_1
    bend, reached = 0.0, 0.0  # where the piece begins: twist and torque
    for start, piece in ((gear.torque_1, gear.stiffness_2), (gear.torque_2, gear.stiffness_3)):
        if start is None or piece is None:
            break  # as wind_up: a piece whose start is unknown is not used, nor those after it
        bend, reached, stiffness = bend + (start - reached) / stiffness, start, piece
        torque = np.where(twist > bend, reached + piece * (twist - bend), torque)
    return np.asarray(np.sign(deflection) * torque)
