"""Servo loops of every joint: gains that are stable from the lightest to the heaviest load, and step responses."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import drive_inertia
from drivetrain.drive.gear import sprung_stages
from drivetrain.drive.loops.loop_design import LoopDesign, closed_loop, design_loops, given_loops
from drivetrain.drive.loops.servo_axis import ServoAxis, ServoTiming
from drivetrain.drive.motor import torque_constant
from drivetrain.errors import whole_names
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.parts.simulation import Simulation

STEP_LASTS = 8.0  # duration of a step response in time constants of the position loop
STEP_POINTS = 600  # largest number of points of a step response
MOST_SAMPLES = 20_000


@dataclass(frozen=True, eq=False)
class JointLoops:
    """Loops of one joint's servo.

    Attributes:
        joint: Name of the joint.
        axis: With the heaviest load of the cycle.
        lightest: Smallest load inertia of the cycle, with stages behind the gear's spring [kg m^2].
        timing: Current loop and sampling of its servo.
        design: Gains and margins with the heaviest load.
        light: The same gains with the lightest load.
        current_gain, current_integral: Proportional [V/A] and integral gain [V/(A s)] of the current loop; None if the
            inductance is unknown.
        time: Time of the step responses [s], (M,).
        step: Step response of the motor's angle without speed feedforward [-], (M,).
        light_step: The same with the lightest load, (M,).
        notch_step: With the heaviest load and the proposed notch filter, (M,); None if there is none.
    """

    joint: str
    axis: ServoAxis
    lightest: float
    timing: ServoTiming
    design: LoopDesign
    light: LoopDesign
    current_gain: float | None
    current_integral: float | None
    time: Array
    step: Array
    light_step: Array
    notch_step: Array | None

    @property
    def stable(self) -> bool:
        """Whether the loops are stable with the heaviest and with the lightest load."""
        return self.design.stable and self.light.stable


@dataclass(frozen=True, eq=False)
class StudyLoops:
    """The loops of a study's joints.

    Attributes:
        joints: Joints whose loops could be designed.
        missing: Reason for each other joint, by its name.
    """

    joints: tuple[JointLoops, ...]
    missing: dict[str, str]


def study_loops(
    evaluation: Evaluation, *, joints: Collection[str] | None = None, current_bandwidth: float | None = None
) -> StudyLoops:
    """Position, speed and current loops of evaluated drives, with the timing of the study's simulation.

    Args:
        evaluation: The drives.
        joints: Names of the joints, or parts that no other name has; None: all.
        current_bandwidth: Bandwidth of the current loops [rad/s]; None: that of the study's simulation.

    Returns:
        Gains, margins and step responses by joint, and why a joint has none.

    Raises:
        InputError: No such joint, or a bandwidth that is not positive.

    Example: ``dt.study_loops(dt.evaluate(study)).joints[0].design.speed_gain``
    """
    if joints is not None:
        joints = whole_names("joints", "joint of the study", joints, evaluation.joints)
    settings = evaluation.study.simulation
    if current_bandwidth is not None:
        settings = replace(settings, current_bandwidth=current_bandwidth)
    found, missing = [], {}
    for name, joint in evaluation.joints.items():
        if joints is not None and name not in joints:
            continue
        span = servo_axes(joint, settings.damping)
        if span is None:
            missing[name] = "the inertia of load or rotor is unknown, so no loop can be laid out"
        else:
            found.append(_joint_loops(joint, *span, servo_timing(settings, name)))
    return StudyLoops(tuple(found), missing)


def servo_timing(settings: Simulation, joint: str) -> ServoTiming:
    """Timing between a joint's speed loop and its torque; continuous if the study states no control."""
    control = settings.control.get(joint)
    if control is None or not control.sampled:
        return ServoTiming(settings.current_bandwidth)
    return ServoTiming(settings.current_bandwidth, 1.0 / control.rate, control.delay)


def servo_axes(joint: JointResult, damping: float) -> tuple[ServoAxis, float] | None:
    """The axis of a joint at its largest load inertia and smallest gear stiffness, and its smallest inertia [kg m^2].

    Stages that the gear's spring carries belong to the load. None if an inertia is unknown; ``damping`` is the damping
    ratio of the spring.
    """
    load, drive = joint.series.load_inertia, joint.drive
    if load is None or not drive.motor.rotor_inertia or not float(load.min()) > 0.0:
        return None
    constant = float(torque_constant(drive.motor, drive.motor.reference_temperature))
    rotor, ratio, stiffness = drive_inertia(drive), drive.gear.ratio, drive.gear.stiffness_1
    # as in scenes, from the largest inertia; with the smallest inertia the damping ratio is no larger
    along = 2.0 * damping * math.sqrt((stiffness or 0.0) * (float(load.min()) + ratio**2 * rotor))
    staged = sprung_stages(drive.gear)
    rotor, heaviest, lightest = rotor - staged / ratio**2, float(load.max()) + staged, float(load.min()) + staged
    return ServoAxis(constant, ratio, rotor, heaviest, stiffness, along), lightest


def _joint_loops(joint: JointResult, axis: ServoAxis, lightest: float, timing: ServoTiming) -> JointLoops:
    import control

    design = design_loops(axis, timing, lightest=lightest)
    bare = replace(axis, load_inertia=lightest)
    light = design
    if lightest < axis.load_inertia:
        gains = (design.speed_gain, design.integral_time, design.position_gain)
        light = given_loops(bare, timing, *gains, limited_by=design.limited_by)
    lasts = STEP_LASTS / design.position_gain
    apart = timing.period or lasts / STEP_POINTS
    time = np.arange(min(max(2, math.ceil(lasts / apart)), MOST_SAMPLES), dtype=np.float64) * apart
    every = 1 + len(time) // STEP_POINTS

    def step(one: ServoAxis, gains: LoopDesign) -> Array:
        return np.asarray(control.step_response(closed_loop(one, timing, gains), time).outputs)[::every]

    faster = design.with_notch
    motor, bandwidth = joint.drive.motor, timing.current_bandwidth
    known = bool(motor.inductance)
    return JointLoops(
        joint.name, axis, lightest, timing, design, light, bandwidth * (motor.inductance or 0.0) if known else None,
        bandwidth * motor.resistance if known else None, time[::every], step(axis, design), step(bare, design),
        None if faster is None else step(axis, faster),
    )  # fmt: skip
