"""Current commands at every sample of the cycle, split by cause (inertia, gravity, friction, losses)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from drivetrain.arrays import Array, axes_of
from drivetrain.drive.amplifier import CurrentBasis, available_voltage, from_dc, motor_basis
from drivetrain.drive.drive import drive_inertia, loss_speed, resting, shaft_friction
from drivetrain.drive.friction import friction_torque
from drivetrain.drive.gear import complete, drag_torque, mesh_of, mesh_slope, mesh_torque
from drivetrain.drive.motor import winding_resistance
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.records import as_record
from drivetrain.sizing.demand.demand import at_rest
from drivetrain.sizing.demand.load_basis import all_load_parameters, counterbalance_torques, load_basis
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, JointResult, Selection, every_drive
from drivetrain.study.model import Study

ROUNDING = 1e-12  # relative to the largest current
MOST_ROWS = 1e7  # commands of a joint
PARTS = (
    "inertia", "gravity", "velocity", "counterbalance", "given torque", "joint friction", "mesh loss", "gear drag",
    "motor friction", "rotor inertia",
)  # fmt: skip
"""Causes of the current: acceleration, gravity and velocity terms of the arm, counterbalances (and the preload of two
motors), forces at the tip or a table of torques, all through a lossless gear; then friction, losses, and acceleration
of the rotor. Their sum is the whole current."""

ON_ALL_DATA = ("current", "phase", "rotor", "friction", "mesh", "gear drag", "motor torque", "voltage", "lost")
"""Prefixes of the columns that are unknown if rotor inertia or losses are unknown."""


def current_commands(
    evaluation: Evaluation | Selection | Study, *, rate: float | None = None, hold: int = 1
) -> pd.DataFrame:
    """The currents that drive the motion, one row per sample and joint.

    The command is the DC-equivalent current [A], also given as the RMS and as the peak of a sinusoidal phase for
    amplifiers that use these. It is the sum of the currents of ``PARTS``. It is also the sum of gear torque (load and
    joint friction through a lossless gear), rotor inertia, and motor friction with gear losses (``friction``).

    Args:
        evaluation: Evaluation of the drives, the selection that chose them, or the study that names them.
        rate: Rate of the amplifier's commands [Hz]; None: the samples of the cycle.
        hold: Order of interpolation between two samples: 1 linear (after a jump of the cycle, the later sample), 0 the
            earlier sample. The amplifier is assumed to hold each command until the next.

    Returns:
        Columns with their units in brackets. ``saturated`` is true where current, torque or voltage exceed the limits
        of motor and amplifier, without safety factors; ``over current``, ``over torque`` and ``over voltage`` say
        which. ``lost acceleration`` is the resulting loss of acceleration at the gear's output while the other joints
        follow the motion; NaN if the load inertia is unknown. Currents are NaN if rotor inertia or losses are unknown.
        Rows are in the order of joints, then of time. ``attrs`` has ``rate`` and ``hold``.

    Raises:
        InputError: The rate is not positive, the order of interpolation is unknown, or a study names no drives.
    """
    faults = [] if axes_of(hold) == 0 and hold in (0, 1) else [Fault("hold", "must be 0 or 1", hold)]
    if rate is not None and not 0.0 < rate < np.inf:
        faults.append(Fault("rate", "must be positive [Hz]", rate))
    raise_faults(faults)
    evaluation = evaluate(evaluation) if isinstance(evaluation, Study) else evaluation
    evaluation = every_drive(evaluation) if isinstance(evaluation, Selection) else evaluation
    if rate is not None and rate * evaluation.study.cycle.duration > MOST_ROWS:
        raise InputError(Fault("rate", f"makes more than {MOST_ROWS:g} commands in a cycle [Hz]", rate))
    loads = _load_parts(evaluation)
    tables = [_joint_table(evaluation, joint, loads[name]) for name, joint in evaluation.joints.items()]
    if rate is not None:
        tables = [_resampled(table, rate, hold) for table in tables]
    nothing = pd.DataFrame(columns=["time [s]", "joint", "current [A]"])
    found = pd.concat(tables, ignore_index=True) if tables else nothing
    found.attrs = {"rate": rate, "hold": hold}
    return found


def _load_parts(evaluation: Evaluation) -> dict[str, dict[str, Array]]:
    """By joint name, the causes of the torque at the gear's output, without joint friction [N m], (N,) each."""
    study, nothing = evaluation.study, np.zeros(len(evaluation.study.cycle.time))
    named = [(i, task) for i, task in enumerate(study.joints) if task.name in evaluation.joints]
    drives = {i: evaluation.joints[task.name].drive for i, task in named}
    still = at_rest(study.cycle)
    states = (replace(still, tip_wrench=None), still, replace(still, velocity=study.cycle.velocity))
    bases = [load_basis(study, one, torques_only=True) for one in states] if study.arm is not None else []
    given = -counterbalance_torques(study, study.cycle.position).T
    found = {}
    for i, task in named:
        joint = evaluation.joints[task.name]
        whole = joint.series.gear_torque - friction_torque(joint.drive.joint_friction, joint.series.speed)
        if not bases:
            parts = (nothing, nothing, nothing, given[i], whole - given[i])
            found[task.name] = dict(zip(PARTS, parts, strict=False))
            continue
        travel = task.travel_per_turn or 1.0
        weight, held, moving = (
            basis[i].bare.torque + all_load_parameters(study, basis[i], drives) @ basis[i].torque for basis in bases
        )
        parts = (whole - moving, weight - travel * given[i], moving - held, travel * given[i], held - weight)
        found[task.name] = dict(zip(PARTS, parts, strict=False))
    return found


def _joint_table(evaluation: Evaluation, joint: JointResult, loads: dict[str, Array]) -> pd.DataFrame:
    series, motor = joint.series, joint.drive.motor
    constant = _constant(series.motor_torque, series.current, motor.torque_constant)
    over, torque = _possible(evaluation.study, joint, constant)
    columns: dict[str, Any] = {
        "time [s]": series.time,
        "joint": joint.name,
        "current [A]": series.current,
        **{
            f"phase current {words} [A]": from_dc(series.current, motor_basis(motor.kind, basis))
            for words, basis in (("RMS", CurrentBasis.RMS), ("peak", CurrentBasis.PEAK))
        },
        "gear torque current [A]": series.gear_torque / joint.drive.gear.ratio / constant,
        "rotor inertia current [A]": series.rotor_torque / constant,
        "friction current [A]": series.friction_torque / constant,
        "motor torque [N m]": series.motor_torque,
        "motor speed [rad/s]": series.motor_speed,
        "voltage [V]": series.voltage,
        "saturated": np.any([*over.values()], axis=0),
    }
    for name, values in _motor_parts(evaluation.study, joint, loads).items():
        columns[f"{name} current [A]"] = values / constant
    for name, values in columns.items():
        if name.endswith("[A]"):  # parts are differences: a remainder by rounding is set to 0
            columns[name] = np.where(np.abs(values) > ROUNDING * np.abs(series.current).max(), values, 0.0)
    columns |= over
    columns["lost acceleration [rad/s^2]"] = _lost_acceleration(joint, series.motor_torque - torque)
    if not joint.torque_known:
        columns |= {name: np.full(len(series.time), np.nan) for name in columns if name.startswith(ON_ALL_DATA)}
    # avoids negative zeros
    return pd.DataFrame({name: one + 0.0 if np.asarray(one).dtype == float else one for name, one in columns.items()})


def _constant(torque: Array, current: Array, cold: float) -> float:
    """The torque constant of the warm motor with which the series were computed [N m/A]."""
    at = int(np.argmax(np.abs(current)))
    return float(torque[at] / current[at]) if current[at] != 0.0 else cold


def _motor_parts(study: Study, joint: JointResult, loads: dict[str, Array]) -> dict[str, Array]:
    """The parts of the motor's torque [N m], (N,) each."""
    drive, series = joint.drive, joint.series
    mesh = mesh_of(as_record(complete(drive.gear)))
    speed = loss_speed(series.speed, series.acceleration, resting(series.speed), parts=study.cycle.parts)
    friction = friction_torque(drive.joint_friction, speed)
    load = np.sum([*loads.values()], axis=0) + friction
    temperature = float(study.drag_temperature(study.ambient))
    through = {name: values / mesh.ratio for name, values in loads.items()}
    return through | {
        "joint friction": friction / mesh.ratio,
        "mesh loss": np.asarray(mesh_torque(mesh, load, speed)) - load / mesh.ratio,
        "gear drag": np.asarray(drag_torque(mesh, mesh.ratio * speed, temperature)),
        "motor friction": friction_torque(shaft_friction(drive), mesh.ratio * speed),
        "rotor inertia": series.rotor_torque,
    }


def _possible(study: Study, joint: JointResult, constant: float) -> tuple[dict[str, Any], Array]:
    """Where the command exceeds each limit, and the available torque in its place [N m], (N,)."""
    series, motor = joint.series, joint.drive.motor
    amplifier = next(task.amplifier for task in study.joints if task.name == joint.name)
    volts = available_voltage(amplifier, study.supply.voltage)
    current = min(limit if limit is not None else np.inf for limit in (amplifier.peak_current, motor.peak_current))
    torque = motor.peak_torque if motor.peak_torque is not None else np.inf
    over = {
        "over current": np.abs(series.current) > current,
        "over torque": np.abs(series.motor_torque) > torque,
        "over voltage": np.abs(series.voltage) > volts,
    }
    hot: Array | float | None = series.winding_temperature
    if hot is None:  # the temperature at which the voltage was computed
        hot = study.ambient if motor.max_winding_temperature is None else motor.max_winding_temperature
    resistance = winding_resistance(motor, np.asarray(hot))
    back = series.voltage - resistance * series.current  # back-EMF and inductive voltage of the command
    low, high = (constant * (sign * volts - back) / resistance for sign in (-1.0, 1.0))
    limit = min(torque, abs(constant) * current)
    return over, np.clip(np.clip(series.motor_torque, np.minimum(low, high), np.maximum(low, high)), -limit, limit)


def _lost_acceleration(joint: JointResult, lacking: Array) -> Array:
    """Loss of acceleration at the gear's output where the motor lacks torque [rad/s^2], (N,)."""
    series, drive = joint.series, joint.drive
    load = np.full(len(lacking), np.nan) if series.load_inertia is None else series.load_inertia
    slope = mesh_slope(mesh_of(as_record(complete(drive.gear))), series.gear_torque * series.speed)
    seen = drive_inertia(drive) * drive.gear.ratio + load * slope
    return np.where(lacking == 0.0, 0.0, lacking / np.where(seen == 0.0, np.nan, seen))


def _resampled(table: pd.DataFrame, rate: float, hold: int) -> pd.DataFrame:
    """A joint's table resampled at a constant rate from the start of the cycle."""
    time = table["time [s]"].to_numpy()
    ticks = time[0] + np.arange(int(np.floor((time[-1] - time[0]) * rate * (1.0 + 1e-12))) + 1) / rate
    # Of two samples at one instant the later counts; rounding of the clock must not fall before it.
    before = np.clip(np.searchsorted(time, ticks + 1e-9 / rate, side="right") - 1, 0, len(time) - 1)
    after = np.minimum(before + 1, len(time) - 1)
    step = time[after] - time[before]
    share = np.clip((ticks - time[before]) / np.where(step > 0.0, step, 1.0), 0.0, 1.0) * (hold == 1)
    found: dict[Any, Any] = {}
    for name, column in table.items():
        values = column.to_numpy()
        if name == "joint":
            found[name] = values[before]
        elif values.dtype == bool:
            found[name] = values[before] | (values[after] & (share > 0.0))
        else:
            found[name] = np.where(share > 0.0, (1.0 - share) * values[before] + share * values[after], values[before])
    found["time [s]"] = ticks
    return pd.DataFrame(found)
