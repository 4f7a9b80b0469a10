"""Recordings of a real arm: positions over time, with torques or currents, from several file formats."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.motion import checks
from drivetrain.motion.foreign import BAGS, joint_states, matlab_arrays, numpy_arrays
from drivetrain.motion.read import ACCELERATION, POSITION, VELOCITY, unit_notes
from drivetrain.motion.smoothing import detected_resolution
from drivetrain.motion.table import TIME as NAMES_OF_TIME
from drivetrain.motion.table import Column, Kind, Table, assigned_columns, read_table
from drivetrain.units import factor, split_header
from drivetrain.whole_files import is_there

TORQUE = Kind("torque", ("torque", "tau", "effort"), ("N m", "N"), needed=False)
MOTOR_TORQUE = Kind("motor_torque", ("motor_torque", "tau_motor"), ("N m",), needed=False)
CURRENT = Kind("current", ("current", "i"), ("A",), needed=False)
RATES = (VELOCITY, ACCELERATION, TORQUE, MOTOR_TORQUE, CURRENT)
_IN_MATLAB = dict.fromkeys(NAMES_OF_TIME, "s") | {
    prefix: kind.units[0] for kind in (POSITION, *RATES) for prefix in kind.prefixes if prefix
}  # units of variables of .mat files, whose names cannot contain a unit
KNOWN = (*NAMES_OF_TIME, *(prefix for kind in (POSITION, *RATES) for prefix in kind.prefixes if prefix))
SMALL_MOVES = 0.01  # share of the largest travel up to which integrated speeds may drift away from positions
SMALL_JUMP = 5e-4  # share of the largest travel, and [rad or m], of which jumps up to 20 times are wavering readings
DRIFT = 0.1  # the same in absolute terms, for joints at rest [rad or m; per s for speeds]
_AMPERES = re.compile(r"([mk]?A)[ _]?(dc|rms|eff|peak|pk)", re.I)  # units of currents with their basis
_BASES = {"eff": "rms", "pk": "peak"}  # other words for it
SUFFIXES = (".csv", ".npz", ".parquet", ".mat", *BAGS)


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """Measurements of an arm; a quantity is None if the file does not have it for every joint.

    Attributes:
        name: Name used in messages and reports.
        joint_names: (n,).
        time: Increasing [s], (N,).
        position: [rad or m], (N, n).
        velocity: [rad/s or m/s], (N, n).
        acceleration: [rad/s^2 or m/s^2], (N, n).
        torque: Torque at the joint, ``ratio`` times the motor torque if there is a gear [N m or N], (N, n).
        motor_torque: Torque at the motor shaft [N m], (N, n).
        current: Motor current [A], (N, n), in amperes of ``current_basis``.
        notes: Origin, and what was not used.
        current_basis: ``dc`` (of the equivalent DC machine), ``rms`` or ``peak`` (of a phase); None: not stated.
    """

    name: str
    joint_names: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    torque: Array | None = None
    motor_torque: Array | None = None
    current: Array | None = None
    notes: tuple[str, ...] = ()
    current_basis: str | None = None

    def __post_init__(self) -> None:
        time, n = checked_array(self.time, (None,), "time"), len(self.joint_names)
        if len(time) < 3 or (np.diff(time) <= 0.0).any():
            raise InputError(Fault("time", "must be at least 3 instants that increase [s]", time.tolist()[:8]))
        object.__setattr__(self, "time", time)
        for kind in (POSITION, *RATES):
            values = getattr(self, kind.name)
            if values is not None:
                object.__setattr__(self, kind.name, checked_array(values, (len(time), n), kind.name))
        faults, warnings = _rate_faults(self)
        raise_faults(faults)
        object.__setattr__(self, "notes", tuple(dict.fromkeys((*self.notes, *warnings))))

    def __repr__(self) -> str:
        measured = ", ".join(kind.name for kind in (POSITION, *RATES) if getattr(self, kind.name) is not None)
        length = f"{len(self.time)} samples, {self.time[-1] - self.time[0]:.4g} s"
        return f"MeasuredMotion({self.name}: {len(self.joint_names)} joints, {length}; {measured})"


def read_recording(
    path: str | Path, joint_names: Sequence[str], *, columns: Mapping[str, str] | None = None, name: str = ""
) -> MeasuredMotion:
    """Read a measured motion from a file.

    Columns, or arrays: ``time [s]``; of each joint ``q_<joint> [deg]`` and, where measured, ``qd_<joint> [rad/s]``,
    ``qdd_<joint> [rad/s^2]``, ``torque_<joint> [N m]`` (at the joint), ``motor_torque_<joint> [N m]``,
    ``current_<joint> [A_rms]`` (or ``A_peak``, ``A_dc``); by the joints' names, or by number in their order. An array
    of n columns (``q [rad]``) stands for all joints in their order. A ROS bag gives time, position, velocity and effort
    of its ``sensor_msgs/JointState``, by the joints' names, in SI; so are ``t``, ``q``, ``qd``, ``qdd``, ``torque``,
    ``motor_torque`` and ``current`` of a .mat, whose names cannot hold units.

    Args:
        path: A .csv, .npz, .parquet, .mat (by scipy, not version 7.3), or a ROS 1 or 2 bag (.bag, .db3, .mcap or its
            folder; needs ``pip install drivetrain[bags]``).
        joint_names: (n,), in the order of the result.
        columns: Headers for columns whose own names do not say it: ``{"t": "time [ms]", "phi": "q [deg]"}``.
        name: Name of the recording; empty: the file's name.

    Returns:
        The recording, in SI, with the instants as recorded; ``torque_from_positions`` and ``identify`` estimate their
        jitter.

    Raises:
        InputError: A file that cannot be read, missing columns, units or positions, cells that are not numbers, time
            that decreases, jumps of position, rates that are not the derivatives of the positions; all of them listed.
    """
    file, joints = Path(path), tuple(joint_names)
    if not joints:
        raise InputError(Fault("joint_names", "a recording needs at least one joint"))
    if not is_there(file, Path.exists):
        raise InputError(Fault("file", "no such file", str(path)))
    suffix = file.suffix.lower()
    if suffix == ".csv":
        table = read_table(file)
        _refuse_unknown(columns, [name for one in table.columns for name in (one.header, one.name)], file)
        table = Table(table.file, tuple(_renamed(c, columns or {}) for c in table.columns), table.rows, table.faults)
    elif suffix in BAGS or file.is_dir():
        _refuse_unknown(columns, [], file)
        table = _table(file, _bag(file, joints), {})
    elif suffix in SUFFIXES:
        arrays = {".npz": numpy_arrays, ".parquet": _parquet, ".mat": matlab_arrays}[suffix](file)
        _refuse_unknown(columns, list(arrays), file)
        bare = {key: f"{key} [{_IN_MATLAB[key]}]" for key in arrays if suffix == ".mat" and key in _IN_MATLAB}
        table = _table(file, arrays, bare | dict(columns or {}))
    else:
        raise InputError(Fault("file", f"must be one of {', '.join(SUFFIXES)}", file.name, nearest(suffix, SUFFIXES)))
    bases, table = _current_bases(table)
    found = assigned_columns(table, joints, (POSITION, *RATES))
    faults = [*table.faults, *found.faults]
    stated = {bases.get(one.column.header) for (kind, _), one in found.found.items() if kind == CURRENT.name}
    if len(stated) > 1:
        words = sorted(basis or "not stated" for basis in stated)
        faults.append(Fault("columns", "currents must all be in the same amperes", words, "", table.file))
    if found.time is None or faults:
        hint = "name each column: columns={'phi': 'q [rad]'} in Python, --column 'phi=q [rad]' in a command"
        raise InputError([
            replace(one, hint="; ".join(filter(None, (one.hint, hint)))) if one.place.startswith("column ") else one
            for one in faults
        ])  # fmt: skip
    places = [found.found["position", joint] for joint in joints]
    least = SMALL_JUMP * max([1.0, *(float(np.ptp(place.values)) for place in places)])
    for place in places:
        series = checks.Series(place.column.header, place.values, table.rows, table.file, place.column.unit)
        resolution = max(least, detected_resolution(place.column.values) * factor(place.column.unit))
        faults += checks.jump_faults(found.time.values, series, resolution, turns=place.unit == "rad")
    raise_faults(faults)
    notes = [f"{len(table.rows)} samples from {file.name}", *found.notes, *unit_notes(found.found, joints)]
    notes += checks.slow_warnings(found.time.values)
    values: dict[str, Array] = {}
    for kind in (POSITION, *RATES):
        present = [found.found[kind.name, joint].values for joint in joints if (kind.name, joint) in found.found]
        if len(present) == len(joints):
            values[kind.name] = np.stack(present, axis=1)
        elif present:
            notes.append(f"{kind.name} is not used: only {len(present)} of {len(joints)} joints have it")
    time, kept = np.unique(found.time.values, return_index=True)
    if (np.diff(found.time.values) < 0.0).any():
        back = int(np.argmax(np.diff(found.time.values) < 0.0)) + 1
        at = float(found.time.values[back])
        raise InputError(Fault(f"row {table.rows[back]}", "time goes back [s]", at, "", file.name))
    if len(kept) < len(found.time.values):
        notes.append(f"{len(found.time.values) - len(kept)} samples at an instant that another has are left out")
    return MeasuredMotion(
        name or file.stem, joints, time, **{kind: rows[kept] for kind, rows in values.items()}, notes=tuple(notes),
        current_basis=next(iter(stated), None),
    )  # fmt: skip


def _current_bases(table: Table) -> tuple[dict[str, str], Table]:
    """What kind of ampere columns state, ``dc``, ``rms`` or ``peak``, by header; and the table with plain amperes."""
    bases, columns = {}, []
    for column in table.columns:
        said = _AMPERES.fullmatch(column.unit)
        if said:
            word = said[2].lower()
            bases[column.header], column = _BASES.get(word, word), replace(column, unit=said[1])
        columns.append(column)
    return bases, replace(table, columns=tuple(columns))


def _rate_faults(measured: MeasuredMotion) -> tuple[list[Fault], list[str]]:
    """Faults and warnings where speeds or accelerations are not the rates of what is measured beside them.

    Looked for in the longest part without a gap in time.
    """
    time, pairs = measured.time, (("velocity", "position"), ("acceleration", "velocity"))
    gaps = np.flatnonzero(np.diff(time) > checks.GAP_IN_TIME * np.median(np.diff(time))) + 1
    first, last = max(pairwise([0, *gaps.tolist(), len(time)]), key=lambda ends: ends[1] - ends[0])
    faults: list[Fault] = []
    warnings: list[str] = []
    for rate, of in pairs:
        rates, values = getattr(measured, rate), getattr(measured, of)
        if rates is None or values is None or last - first < 3:
            continue
        smallest = max(SMALL_MOVES * float(np.ptp(values, axis=0).max()), DRIFT)
        for i, joint in enumerate(measured.joint_names):
            value, slope = (
                checks.Series(f"{name}_{joint}", x[first:last, i], (), measured.name)
                for name, x in ((of, values), (rate, rates))
            )
            wrong, some = checks.rate_mismatch(time[first:last], value, slope, smallest)
            # Noise of accelerations adds up: only a factor that is a known mistake is sure.
            sure = [one for one in wrong if one.hint or rate == "velocity"]
            faults += sure
            warnings += [*some, *(f"warning: {one.place} {one.problem}" for one in wrong if one not in sure)]
    return faults, warnings


def _refuse_unknown(columns: Mapping[str, str] | None, known: Sequence[str], file: Path) -> None:
    """Refuse meanings of columns that the file does not have."""
    unknown = [name for name in columns or {} if name not in known]
    raise_faults(
        [
            Fault("columns", "the file has no column of this name", name, nearest(name, known), file.name)
            for name in unknown
        ]
    )


def _renamed(column: Column, columns: Mapping[str, str]) -> Column:
    header = columns.get(column.header, columns.get(column.name, column.header))
    return Column(header, *split_header(header), column.values)


def _table(file: Path, arrays: Mapping[str, Any], columns: Mapping[str, str]) -> Table:
    """Table of the arrays in a file; an array of n columns becomes n columns with numbers after the name."""
    found: list[Column] = []
    held = {key: _numbers(value) for key, value in arrays.items()}
    names = {key: split_header(columns.get(key, key)) for key in held}
    lengths = {key: len(values) for key, values in held.items() if values is not None}
    usual = max(lengths.values(), key=[*lengths.values()].count, default=0)
    rows = next((count for key, count in lengths.items() if names[key][0].casefold() in NAMES_OF_TIME), usual)
    faults = []
    for key, values in held.items():
        name, unit = names[key]
        if values is None or len(values) != rows:
            if name.casefold() in KNOWN:
                problem = "must hold numbers" if values is None else f"must have {rows} rows, one an instant"
                what = str(np.asarray(arrays[key]).dtype) if values is None else values.shape[0]
                faults.append(Fault(f"array {key}", problem, what, "", file.name))
            continue
        for number, column in enumerate(values.T, 1):
            title = name if values.shape[1] == 1 else f"{name}{number}"
            found.append(Column(f"{title} [{unit}]" if unit else title, title, unit, column))
    faults += [
        Fault(f"column {c.header}", "must hold finite numbers", None, "", file.name)
        for c in found
        if not np.isfinite(c.values).all()
    ]
    return Table(file.name, tuple(found), tuple(range(1, rows + 1)), tuple(faults))


def _numbers(value: Any) -> Array | None:
    """The value as an array (N, columns); None if it is not a table of numbers."""
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.ndim not in (1, 2) or array.size < 3:
        return None
    if array.ndim == 2 and array.shape[0] == 1:
        array = array.T
    return np.asarray(array if array.ndim == 2 else array[:, None], dtype=np.float64)


def _parquet(file: Path) -> Mapping[str, Any]:
    import pandas as pd

    try:
        frame = pd.read_parquet(file)
    except ImportError:
        raise InputError(Fault("file", "needs pyarrow", file.name, "pip install drivetrain[sweep]")) from None
    except (OSError, ValueError) as error:
        raise InputError(Fault("file", f"cannot be read as Parquet: {error}", file.name)) from None
    if frame.index.name is not None:
        frame = frame.reset_index()
    return {str(key): frame[key].to_numpy() for key in frame.columns}


def _bag(file: Path, joints: tuple[str, ...]) -> Mapping[str, Any]:
    time, measured = joint_states(file, joints)
    if not len(time):
        raise InputError(Fault("file", f"holds no JointState of {', '.join(joints)}", file.name))
    kinds = {"position": ("q", "rad"), "velocity": ("qd", "rad/s"), "effort": ("effort", "N m")}
    columns = {
        f"{kinds[part][0]}_{joint} [{kinds[part][1]}]": column
        for part, values in measured.items() for joint, column in zip(joints, values.T, strict=True)
    }  # fmt: skip
    return {"time [s]": time} | columns
