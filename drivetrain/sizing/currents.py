"""The current to command at every sample of the cycle, split into what it is for."""

from __future__ import annotations

import numpy as np
import pandas as pd

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import CurrentBasis, available_voltage, from_dc
from drivetrain.sizing.results import Evaluation, JointResult

COLUMNS = (
    "time [s]", "joint", "current [A]", "phase current RMS [A]", "phase current peak [A]", "gear torque current [A]",
    "rotor inertia current [A]", "friction current [A]", "motor torque [N m]", "motor speed [rad/s]", "voltage [V]",
    "saturated",
)  # fmt: skip


def current_commands(evaluation: Evaluation) -> pd.DataFrame:
    """The currents that drive the motion, one row per sample and joint.

    The command is the DC-equivalent current [A]; the same current stands beside it as the RMS and as the peak of a
    sinusoidal phase, for amplifiers that are told one of these. Its three parts add up to it: what the gear passes on
    (load and joint friction, lossless), what accelerates the rotor, and what motor friction and mesh losses take.

    Args:
        evaluation: Of the drives that are to be commanded.

    Returns:
        Columns with their units in brackets; ``saturated`` is true where the sample asks more current, torque or
        voltage than motor and amplifier have, safety factors left out. Rows in order of joints, then of time.
    """
    tables = [_joint_table(evaluation, joint) for joint in evaluation.joints.values()]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=list(COLUMNS))


def _joint_table(evaluation: Evaluation, joint: JointResult) -> pd.DataFrame:
    series = joint.series
    constant = _constant(series.motor_torque, series.current, joint.drive.motor.torque_constant)
    load = series.gear_torque / joint.drive.gear.ratio
    values: tuple[object, ...] = (
        series.time,
        joint.name,
        series.current,
        from_dc(series.current, CurrentBasis.RMS),
        from_dc(series.current, CurrentBasis.PEAK),
        load / constant,
        series.rotor_torque / constant,
        series.friction_torque / constant,
        series.motor_torque,
        series.motor_speed,
        series.voltage,
        _saturated(evaluation, joint),
    )
    return pd.DataFrame(dict(zip(COLUMNS, values, strict=True)))


def _constant(torque: Array, current: Array, cold: float) -> float:
    """The torque constant behind the series [N m/A]: that of the warm motor."""
    at = int(np.argmax(np.abs(current)))
    return float(torque[at] / current[at]) if current[at] != 0.0 else cold


def _saturated(evaluation: Evaluation, joint: JointResult) -> Array:
    """Where the command asks more than there is."""
    series, motor = joint.series, joint.drive.motor
    amplifier = next(task.amplifier for task in evaluation.study.joints if task.name == joint.name)
    over = np.abs(series.voltage) > available_voltage(amplifier, evaluation.study.supply.voltage)
    for limit, values in (
        (amplifier.peak_current, series.current),
        (motor.peak_current, series.current),
        (motor.peak_torque, series.motor_torque),
    ):
        if limit is not None:
            over = over | (np.abs(values) > limit)
    return np.asarray(over)
