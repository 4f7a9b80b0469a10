"""The torques of a motion one cause at a time: what speeds ask, what speeds and gravity ask, what the tip asks.

Each is one run of the recursion with the other causes left out, so rotors are counted as they are there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.doors import finite_samples, run, tip_samples

WEIGHTLESS = np.zeros(3)


def bias_torque(arm: Arm, q: Any, qd: Any, *, tip_wrench: Any = None) -> Array:
    """The torques h that keep the joints at constant speed: all of the equation of motion but ``M qdd``.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        h = c + g (+ J^T F) [N m; N at a prismatic joint], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.11.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    model = packed(arm)
    tip = tip_samples(model, tip_wrench, len(positions))
    torque = run(model, (positions, speeds, np.zeros(positions.shape)), tip=tip)
    return torque if np.ndim(q) == 2 else torque[0]


def velocity_torque(arm: Arm, q: Any, qd: Any) -> Array:
    """The Coriolis and centripetal torques c.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        c [N m; N at a prismatic joint], (n,) or (N, n); quadratic in qd.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.79.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    torque = run(packed(arm), (positions, speeds, np.zeros(positions.shape)), gravity=WEIGHTLESS)
    return torque if np.ndim(q) == 2 else torque[0]


def tip_torque(arm: Arm, q: Any, tip_wrench: Any) -> Array:
    """The torques that press the end effector on the environment, and nothing else: ``J^T F``.

    Args:
        arm: With rotors or without; rotors at rest add nothing.
        q: Positions [rad or m], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6).

    Returns:
        Torque [N m; N at a prismatic joint], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.77, last term.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    model, rest = packed(arm), np.zeros(positions.shape)
    tip = tip_samples(model, tip_wrench, len(positions))
    torque = run(model, (positions, rest, rest), gravity=WEIGHTLESS, tip=tip)
    return torque if np.ndim(q) == 2 else torque[0]
