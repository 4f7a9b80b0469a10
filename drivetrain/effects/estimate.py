"""What dropping an effect is thought to change, and what is known of the task when it is asked."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivetrain.arrays import Array


@dataclass(frozen=True)
class Estimate:
    """What dropping an effect is thought to change.

    Attributes:
        current: Of the peak current, as a share of it [-].
        torque: Of the RMS torque, as a share of it [-].
        temperature: Of the winding's rise, as a share of it [-].
        deviation: Of the joint's position [rad or m].
        valid: Whether the derivation holds here; False: keep the effect.
        why: The derivation, in words.
    """

    current: float = 0.0
    torque: float = 0.0
    temperature: float = 0.0
    deviation: float = 0.0
    valid: bool = True
    why: str = ""


@dataclass(frozen=True, eq=False)
class TaskSeries:
    """What the inverse engine finds for one joint along its command, (N,) each.

    Attributes:
        time: Never decreasing [s].
        speed, acceleration: Of the joint [rad/s, rad/s^2], or of its slide.
        torque: Through the mesh, at the output [N m or N].
        current: At the motor's terminals [A].
        resting: Where the joint is commanded to stand still.
    """

    time: Array
    speed: Array
    acceleration: Array
    torque: Array
    current: Array
    resting: Array


@dataclass(frozen=True)
class Conditions:
    """What is known of a joint's task before the forward run, for estimates.

    Attributes:
        peak_current, rms_current: [A].
        peak_torque, rms_torque: At the gear's output [N m].
        peak_speed: Of the joint [rad/s or m/s].
        move_time: Shortest motion from rest to rest [s].
        inertia: That the gear's output moves, rotor left out [kg m^2].
        rotor_inertia: Reflected to the joint [kg m^2].
        free: Whether nothing touches the arm and the command can be followed.
        series: The task itself; None: an estimate has only the numbers above.
        torque_constant: Of the motor [N m/A].
        mesh_share: Torque at the motor over that at the output behind a lossless gear, driving; 1 without loss [-].
        heat_gain: Share of the winding's heat that its warmth adds, alpha R Rth I^2; 1 or more runs away [-].
        cold_share: Of the winding's rise that a resistance of the reference temperature leaves out [-].
        magnet_share: Of the current that warm magnets ask more [-].
        rise: Of the winding in the periodic state [K].
        housing_resistance: From housing to air [K/W].
        loop_stiffness, loop_damping: Of the position loop, at the joint [N m/rad, N m s/rad].
        sample_period: Of that loop [s]; 0 for a continuous one.
    """

    peak_current: float
    rms_current: float
    peak_torque: float
    rms_torque: float
    peak_speed: float
    move_time: float
    inertia: float
    rotor_inertia: float
    free: bool = True
    series: TaskSeries | None = None
    torque_constant: float = math.nan
    mesh_share: float = 1.0
    heat_gain: float = 0.0
    cold_share: float = math.nan
    magnet_share: float = math.nan
    rise: float = math.inf
    housing_resistance: float = 0.0
    loop_stiffness: float = math.inf
    loop_damping: float = math.inf
    sample_period: float = 0.0
