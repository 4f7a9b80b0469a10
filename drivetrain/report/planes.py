"""The motor's plane of speed and torque: what the motor may do, for the page and for pictures."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.motor_limits import continuous_current, continuous_region, operating_region
from drivetrain.sizing.results import JointResult
from drivetrain.study.model import JointTask, Study

FAR = 4.0  # the view ends at this many times the motion's largest value; the region may go on beyond


def temperatures(joint: JointResult, study: Study) -> dict[str, tuple[float, float]]:
    """Temperatures of winding and magnets at which regions are drawn [C], by what they are."""
    motor, series = joint.drive.motor, joint.series
    winding, housing, limit = series.winding_temperature, series.housing_temperature, motor.max_winding_temperature
    cold = study.ambient
    hot = float(winding.max()) if winding is not None else cold if limit is None else limit
    magnets = float(housing.mean()) if housing is not None else hot
    found = {"hot": (hot, magnets), "cold": (cold, cold)}
    return found if limit is None else found | {"limit": (limit, max(magnets, cold))}


def regions(
    joint: JointResult, task: JointTask, study: Study, at: tuple[float, float], supply: float
) -> tuple[Array, Array | None]:
    """What is open for a short time and for ever.

    Args:
        at: Winding and magnets [C].
        supply: Voltage [V].

    Returns:
        Corners (speed [rad/s], torque [N m]), (M, 2) each; None for the second where the sheet does not say enough.
    """
    motor = joint.drive.motor
    short = operating_region(motor, task.amplifier, supply, *at)
    lasting = continuous_current(motor, study.ambient, housing_to_ambient=task.housing_to_ambient).value
    if lasting is None:
        return short, None
    return short, continuous_region(motor, task.amplifier, supply, lasting, *at)


def view(joint: JointResult, corners: Array) -> tuple[float, float]:
    """Half width and half height of the picture: the motion, and the region unless far larger.

    Args:
        corners: Of what is open for a short time.

    Returns:
        [rad/s] and [N m].
    """
    speed = float(np.abs(joint.series.motor_speed).max())
    torque = float(np.abs(joint.series.motor_torque).max())
    (x0, y0), (x1, y1) = corners[:-1].T, corners[1:].T
    crossing = (y0 * y1 <= 0) & (y0 != y1)  # the braking corners lie far beyond and tell little
    at = x0[crossing] - y0[crossing] * (x1[crossing] - x0[crossing]) / (y1[crossing] - y0[crossing])
    reach = float(np.abs(at).max(initial=0.0)) or float(np.abs(corners[:, 0]).max())
    right = max(1.15 * speed, min(1.12 * reach, FAR * speed if speed else np.inf))
    height = float(np.abs(corners[:, 1]).max())
    top = max(1.2 * torque, min(1.12 * height, FAR * torque if torque else np.inf))
    return right, top
