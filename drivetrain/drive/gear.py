"""The gear: its sheet in SI, and the losses of its mesh by direction of power."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Gear:
    """A gear's data sheet; None where the sheet says nothing (unknown is never zero).

    Torques and stiffnesses are at the output, speeds and inertia at the input.

    Attributes:
        key: Unique name in the catalogue.
        ratio: Motor speed over output speed; negative when the output turns the other way.
        maker, series, part_number: As printed.
        kind: ``planetary``, ``strain_wave``, ``rv``, ``koaxdrive``, ``spur`` or ``ideal``.
        stages: Number of stages.
        efficiency: Power out over power in when the motor drives.
        backdriving_efficiency: Power out over power in when the load drives; None: that of the same mesh friction.
        no_load_torque: Running torque at the input without load [N m].
        inertia: At the input [kg m^2].
        mass: [kg].
        continuous_torque: Rated (strain wave: at rated speed; planetary: continuous) [N m].
        average_torque_limit: Limit of the average torque over the cycle [N m].
        repeated_peak_torque: Limit of the peaks of every cycle (acceleration torque, intermittent torque) [N m].
        momentary_torque: Limit of rare peaks [N m].
        max_input_speed: Short-time [rad/s].
        average_input_speed_limit: Limit of the mean input speed [rad/s].
        rated_speed: Input speed at which the rated torque and life hold [rad/s].
        rated_life: L10 life at rated torque and speed [s].
        life_exponent: Of torque in the average torque and in the life (3 strain wave, 10/3 RV).
        stiffness_1, stiffness_2, stiffness_3: Of the three pieces [N m/rad].
        torque_1, torque_2: Where the pieces meet [N m].
        backlash: At the output, total [rad].
        tilting_moment_limit: Of the output bearing [N m].
        axial_load_limit, radial_load_limit: Of the output bearing [N].
        size: The maker's size number, such as 25 for a strain-wave gear.
        pitch_diameter: Of the toothing, for the geometric rule with frameless motors [m].
        diameter, length: [m].
        max_motor_shaft: Largest motor shaft diameter that fits [m].
        price: In the user's currency; empty in the shipped catalogue.
        source: File and row, sheet, edition: what a report prints.
    """

    key: str
    ratio: float
    maker: str = ""
    series: str = ""
    part_number: str = ""
    kind: str = "ideal"
    stages: int | None = None
    efficiency: float | None = None
    backdriving_efficiency: float | None = None
    no_load_torque: float | None = None
    inertia: float | None = None
    mass: float | None = None
    continuous_torque: float | None = None
    average_torque_limit: float | None = None
    repeated_peak_torque: float | None = None
    momentary_torque: float | None = None
    max_input_speed: float | None = None
    average_input_speed_limit: float | None = None
    rated_speed: float | None = None
    rated_life: float | None = None
    life_exponent: float | None = None
    stiffness_1: float | None = None
    stiffness_2: float | None = None
    stiffness_3: float | None = None
    torque_1: float | None = None
    torque_2: float | None = None
    backlash: float | None = None
    tilting_moment_limit: float | None = None
    axial_load_limit: float | None = None
    radial_load_limit: float | None = None
    size: float | None = None
    pitch_diameter: float | None = None
    diameter: float | None = None
    length: float | None = None
    max_motor_shaft: float | None = None
    price: float | None = None
    source: str = ""
