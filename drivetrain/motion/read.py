"""Motions and load tables from files; all faults are reported together, warnings are among the notes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.motion import checks
from drivetrain.motion.foreign import foreign_table
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.motion.smoothing import (
    Parabolas,
    Smoothing,
    SmoothingSpline,
    chosen_smoothing,
    detected_resolution,
)
from drivetrain.motion.table import Assigned, Found, Kind, Table, assigned_columns, read_table
from drivetrain.units import factor

POSITION = Kind("position", ("q", "position", "pos", "angle", ""), ("rad", "m"), needed=True)
VELOCITY = Kind("velocity", ("qd", "velocity", "vel", "speed", "dq"), ("rad/s", "m/s"), needed=False)
ACCELERATION = Kind("acceleration", ("qdd", "acceleration", "accel", "acc", "ddq"), ("rad/s^2", "m/s^2"), needed=False)
TORQUE = Kind("torque", ("torque", "tau"), ("N m",), needed=True)
SPEED = Kind("speed", ("speed", "velocity", "qd"), ("rad/s",), needed=True)
ROTATION = Kind("acceleration", ("acceleration", "accel", "acc", "qdd"), ("rad/s^2",), needed=False)
FORCE = Kind("force", ("force", "f"), ("N",), needed=False)
MOMENT = Kind("moment", ("moment", "torque", "m"), ("N m",), needed=False)

STILL = 1e-3  # share of the largest span of position below which a joint counts as at rest
COARSE = 0.03  # relative error of the acceleration due to coarse sampling above which there is a warning


def read_motion(
    path: str | Path | StringIO,
    joint_names: Sequence[str],
    *,
    smoothing: Smoothing | None = None,
    position_units: Sequence[str] | None = None,
    name: str = "",
) -> Motion:
    """Read a motion from a CSV file, a ROS 2 trajectory (.yaml), a ROS bag, a .mat or a .npz file.

    Columns: ``time [s]``; per joint ``q_<joint> [deg]`` (or ``position_<joint>``, the joint's bare name, or ``q1``,
    ``q2`` in order); optionally ``qd_<joint> [rad/s]`` and ``qdd_<joint> [rad/s^2]``. Rates that are not given are
    computed by differentiation, and the notes say by which method. Two rows may share an instant (a step of
    acceleration) if all three are given. Warnings are notes that begin with "warning:". The other formats are in SI.

    Args:
        path: The file, or its text as a stream.
        joint_names: (n,), in the order of the result.
        smoothing: Method of differentiation; None: parabolas, or a smoothing spline if resolution or noise of the
            positions would be visible in the acceleration.
        position_units: ``rad`` or ``m`` for each joint, (n,); other units in the file are faults. None: any.
        name: Name of the motion; empty: the file's name.

    Returns:
        The motion, in SI.

    Raises:
        InputError: Cells that are not numbers, missing or misspelt columns or units, time that decreases, jumps and
            spikes of position, rates that are not the derivatives of the positions; all of them listed.
    """
    joints = tuple(joint_names)
    if not joints:
        raise InputError(Fault("joints", "a motion needs at least one joint"))
    foreign = None if isinstance(path, StringIO) else foreign_table(path, joints, position_units)
    table = read_table(path) if foreign is None else foreign
    found = assigned_columns(table, joints, (POSITION, VELOCITY, ACCELERATION))
    faults = [*table.faults, *found.faults, *_kind_faults(found, joints, position_units, table.file)]
    time = _checked_time(table, found, faults, pairs=len(found.found) == 3 * len(joints))
    notes = [*found.notes, *checks.sampling_notes(time, [found.found["position", joint].values for joint in joints])]
    notes += checks.slow_warnings(time)
    still = STILL * max(float(np.ptp(found.found["position", joint].values)) for joint in joints)
    blocks, ways = [], []
    for joint in joints:
        rows, how, some = _joint(time, table, found.found, joint, smoothing, faults)
        notes += some
        notes += _consistency(time, table, found.found, joint, still, faults)
        notes += checks.spike_warnings(time, rows[2], joint, found.found["position", joint].column.unit)
        blocks.append(rows)
        ways.append(how)
    raise_faults(faults)
    notes += unit_notes(found.found, joints)
    title = name or Path(table.file).stem
    head = f"{title}: {len(time)} samples{_origin(table)}, {time[-1] - time[0]:.4g} s"
    position, velocity, acceleration = np.stack(blocks, axis=2)
    lines = [head, *_grouped(joints, ways), *notes]
    return Motion(title, joints, time, position, velocity, acceleration, tuple(dict.fromkeys(lines)))


def read_load_table(
    path: str | Path | StringIO, joint_names: Sequence[str] | None = None, *, name: str = ""
) -> LoadTable:
    """Read a table of torque and speed over time from a CSV file, for sizing without an arm.

    Columns: ``time [s]``; per joint ``torque_<joint> [N m]`` and ``speed_<joint> [rpm]``, optionally
    ``acceleration_<joint> [rad/s^2]``; with one joint also ``torque``, ``speed`` and ``acceleration`` without its name.
    Between rows the speed is linear; if no acceleration is given, each inner row becomes two samples, with the slopes
    before and after it. Two rows may share an instant (a step of torque).

    Args:
        path: The file, or its text as a stream.
        joint_names: (n,), in the order of the result; None: the joints that the columns name.
        name: Name of the table; empty: the file's name.

    Returns:
        The table, in SI.

    Raises:
        InputError: Cells that are not numbers, missing or misspelt columns or units, time that decreases, steps of
            speed, accelerations that are not the derivative of the speed; all of them listed.
    """
    table = read_table(path)
    joints = tuple(joint_names) if joint_names is not None else _named_joints(table)
    found = assigned_columns(table, joints, (TORQUE, SPEED, ROTATION))
    faults = [*table.faults, *found.faults]
    if any(column.name.casefold().startswith("force") for column in table.columns):
        hint = "a slide is an arm of one prismatic joint, such as a DH table of one row"
        faults.append(Fault("columns", "a load table has torques and speeds of rotation", None, hint, table.file))
    time = _checked_time(table, found, faults, pairs=True)
    torque, speed = (np.stack([found.found[kind, j].values for j in joints], axis=1) for kind in ("torque", "speed"))
    faults += _speed_step_faults(time, table, found.found, joints)
    given = [joint for joint in joints if ("acceleration", joint) in found.found]
    title = name or Path(table.file).stem
    notes = [f"{title}: {len(time)} rows{_origin(table)}, {time[-1] - time[0]:.4g} s", *found.notes]
    if given and len(given) < len(joints):
        problem = "give the acceleration of all joints or of none; missing: "
        problem += ", ".join(joint for joint in joints if joint not in given)
        faults.append(Fault("columns", problem, file=table.file))
    for joint in given:
        speeds, rates = (_series(found.found[kind, joint], table) for kind in ("speed", "acceleration"))
        wrong, warnings = checks.rate_mismatch(time, speeds, rates, STILL * float(np.ptp(speed)))
        faults += wrong
        notes += warnings
    raise_faults(faults)
    if given:
        acceleration = np.stack([found.found["acceleration", joint].values for joint in joints], axis=1)
        return LoadTable(title, joints, time, torque, speed, acceleration, (*notes, "acceleration as given"))
    notes.append("acceleration from speed, a straight line between rows")
    return LoadTable(title, joints, *_with_slopes(time, torque, speed), tuple(notes))


def read_forces(path: str | Path | StringIO) -> Array:
    """Read a force and a moment over time from a CSV file: time [s], moment [N m] and force [N], (K, 7).

    Columns: ``time [s]``, which increases, and any of ``force_x [N]`` to ``force_z`` and ``moment_x [N m]`` to
    ``moment_z``; those that are missing are zero.
    """
    table = read_table(path)
    found = assigned_columns(table, ("x", "y", "z"), (FORCE, MOMENT))
    faults = [*table.faults, *found.faults]
    if not found.found:
        faults.append(Fault("columns", "must have a force or a moment, such as force_z [N]", file=table.file))
    time = _checked_time(table, found, faults, pairs=False)
    still = np.zeros_like(time)
    wanted = [(kind.name, axis) for kind in (MOMENT, FORCE) for axis in "xyz"]
    return np.column_stack([time, *(found.found[key].values if key in found.found else still for key in wanted)])


def _origin(table: Table) -> str:
    return f" from {Path(table.file).name}" if table.file else ""


def _checked_time(table: Table, found: Assigned, faults: list[Fault], *, pairs: bool) -> Array:
    """The time column [s], (N,); raises ``InputError`` for faults that make further checks impossible."""
    if faults or found.time is None:
        raise InputError(faults)
    raise_faults(checks.time_faults(_series(found.time, table), pairs=pairs))
    return found.time.values


def _kind_faults(found: Assigned, joints: tuple[str, ...], units: Sequence[str] | None, file: str) -> list[Fault]:
    """Faults of joints whose position, speed and acceleration do not have units of one kind, rad or m."""
    faults = []
    for index, joint in enumerate(joints):
        position = found.found.get(("position", joint))
        if position is None:
            continue
        unit = units[index] if units is not None else position.unit
        kind = "turns" if unit == "rad" else "slides"
        for what, wanted in (("position", unit), ("velocity", f"{unit}/s"), ("acceleration", f"{unit}/s^2")):
            column = found.found.get((what, joint))
            if column is not None and column.unit != wanted:
                problem = f"joint {joint} {kind}: its {what} must have a unit such as {wanted}"
                faults.append(Fault(f"column {column.column.header}", problem, column.column.unit, "", file))
    return faults


def _series(found: Found, table: Table) -> checks.Series:
    return checks.Series(found.column.header, found.values, table.rows, table.file, found.column.unit)


def _resolution(found: Found) -> float:
    """The resolution of a column's numbers, in SI."""
    return detected_resolution(found.column.values) * factor(found.column.unit)


def _joint(
    time: Array,
    table: Table,
    found: dict[tuple[str, str], Found],
    joint: str,
    smoothing: Smoothing | None,
    faults: list[Fault],
) -> tuple[Array, str, list[str]]:
    """Position, velocity and acceleration of one joint, (3, N), how they were obtained, and warnings.

    Jumps of position are added to ``faults``.
    """
    position = found["position", joint]
    velocity, acceleration = found.get(("velocity", joint)), found.get(("acceleration", joint))
    wrong = checks.jump_faults(time, _series(position, table), _resolution(position), turns=position.unit == "rad")
    faults += wrong
    if velocity is not None and acceleration is not None:
        given = np.stack([position.values, velocity.values, acceleration.values])
        return given, "velocity and acceleration as given", []
    if wrong:  # a position with jumps is not differentiated
        return np.zeros((3, len(time))), "", []
    source = position if velocity is None else velocity
    way = smoothing or chosen_smoothing(time, source.values, _resolution(source))
    if isinstance(way, SmoothingSpline) and way.resolution is None:
        way = SmoothingSpline(_resolution(source))
    still = not np.ptp(source.values)  # rates are then exactly zero
    first, second = np.zeros((2, len(time))) if still else way.derivatives(time, source.values)
    warnings = _coarse(time, source.values, joint) if isinstance(way, Parabolas) else []
    if velocity is not None:
        return np.stack([position.values, velocity.values, first]), f"acceleration by {way.description}", []
    if acceleration is not None:
        return np.stack([position.values, first, acceleration.values]), f"velocity by {way.description}", []
    return np.stack([position.values, first, second]), f"velocity and acceleration by {way.description}", warnings


def _coarse(time: Array, values: Array, joint: str) -> list[str]:
    """Warning if leaving out every second sample changes the acceleration too much.

    The error of the parabolas is proportional to the square of the step, so it is a third of that change.
    """
    if len(time) < 9:
        return []
    second = Parabolas().derivatives(time, values).second[2:-2:2]
    halved = Parabolas().derivatives(time[::2], values[::2]).second[1 : 1 + len(second)]
    size = float(np.sqrt(np.mean(second[: len(halved)] ** 2)))
    change = float(np.sqrt(np.mean((second[: len(halved)] - halved) ** 2))) / 3.0
    if size == 0.0 or change <= COARSE * size:
        return []
    return [f"warning: {joint} is sampled coarsely: about {100 * change / size:.2g} % of its acceleration is uncertain"]


def _consistency(
    time: Array,
    table: Table,
    found: dict[tuple[str, str], Found],
    joint: str,
    still: float,
    faults: list[Fault],
) -> list[str]:
    """Warnings where given rates are not the derivatives of the values; large differences are added to ``faults``."""
    warnings: list[str] = []
    for kind, of in (("velocity", "position"), ("acceleration", "velocity")):
        rates, values = found.get((kind, joint)), found.get((of, joint))
        if rates is None or values is None:
            continue
        smallest = max(still, 2.0 * _resolution(values)) if of == "position" else 2.0 * _resolution(values)
        wrong, some = checks.rate_mismatch(time, _series(values, table), _series(rates, table), smallest)
        faults += wrong
        warnings += some
    return warnings


def unit_notes(found: dict[tuple[str, str], Found], joints: tuple[str, ...]) -> Iterator[str]:
    """Warnings about units that the size of the values makes implausible."""
    in_degrees = []
    for joint in joints:
        position, velocity = found["position", joint], found.get(("velocity", joint))
        if position.unit == "rad":
            yield from checks.unit_warnings(position.column.header, position.column.unit, position.values, joint)
            if factor(position.column.unit) == factor("deg"):
                in_degrees.append(position)
        if velocity is not None and velocity.unit == "rad/s":
            yield from checks.speed_warnings(velocity.column.header, velocity.values, joint)
    headers = [position.column.header for position in in_degrees]
    yield from checks.small_angle_warnings(headers, [position.values for position in in_degrees])


def _grouped(joints: tuple[str, ...], ways: list[str]) -> list[str]:
    """One note for all joints whose rates were obtained by the same method."""
    return [
        f"{', '.join(j for j, other in zip(joints, ways, strict=True) if other == way)}: {way}"
        for way in dict.fromkeys(ways)
    ]


def _named_joints(table: Table) -> tuple[str, ...]:
    """The joints that the torque columns name; ``axis`` if the only torque column names none."""
    names = [column.name for column in table.columns if column.name.casefold().startswith("torque")]
    joints = tuple(name[len("torque") :].strip("_ .") for name in names)
    if joints in ((), ("",)):
        return ("axis",)
    return joints


def _speed_step_faults(
    time: Array, table: Table, found: dict[tuple[str, str], Found], joints: tuple[str, ...]
) -> list[Fault]:
    """Faults where a speed has two values at one instant, which would need an impulse."""
    same = np.diff(time) == 0.0
    faults = []
    for joint in joints:
        speed = found["speed", joint]
        for index in np.flatnonzero(same & (np.diff(speed.values) != 0.0)):
            place = f"row {table.rows[index + 1]}, column {speed.column.header}"
            value = float(speed.column.values[index + 1])
            faults.append(Fault(place, "speed steps at one instant: an impulse", value, "", table.file))
    return faults


def _with_slopes(time: Array, torque: Array, speed: Array) -> tuple[Array, Array, Array, Array]:
    """Time, torque, speed and acceleration with both ends of every interval as samples, without repeated samples."""
    length = np.diff(time)
    intervals = np.flatnonzero(length > 0.0)
    slope = np.diff(speed, axis=0)[intervals] / length[intervals, np.newaxis]
    ends = np.stack([intervals, intervals + 1], axis=1).ravel()
    columns = np.hstack([time[ends, np.newaxis], torque[ends], speed[ends], np.repeat(slope, 2, axis=0)])
    columns = columns[np.r_[True, np.any(columns[1:] != columns[:-1], axis=1)]]
    n = torque.shape[1]
    pieces = np.split(columns, [1, 1 + n, 1 + 2 * n], axis=1)
    return pieces[0][:, 0], pieces[1], pieces[2], pieces[3]
