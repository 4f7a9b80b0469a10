"""Current commands as files for amplifiers and controllers: CSV, a C header, a ROS 2 JointTrajectory.

Commands are scaled to the numbers that the amplifier expects: amperes in its convention, per mille of the rated
torque, volts, or counts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import CurrentBasis, from_dc, motor_basis, to_dc
from drivetrain.errors import Fault, Faults, InputError, by_joint, nearest, raise_faults
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.judge.missing import unknown_torques
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.version import __version__
from drivetrain.whole_files import write_text

SCALES = ("amperes", "cia402", "analogue", "counts")
TORQUE = "torque"  # a basis for CiA 402, in addition to the conventions of current
WORD = 2**15 - 1  # largest signed number of 16 bits
ANALOGUE_VOLTS = 10.0


@dataclass(frozen=True)
class CurrentScale:
    """Scale in which the current of one joint is written."""

    unit: str  # of the numbers
    amperes: float  # DC-equivalent current of one unit [A]
    most: float  # largest magnitude that can be written; infinite if there is no limit
    whole: bool  # whether the numbers are integers
    base: str  # text that defines the scale, with its numbers


def current_scales(
    evaluation: Evaluation,
    scale: str,
    *,
    basis: str | None = None,
    full_scale: float | Mapping[str, float] | None = None,
) -> dict[str, CurrentScale]:
    """The scale of each joint's amplifier.

    Args:
        evaluation: Evaluation of the drives to command.
        scale: ``amperes``; ``cia402``: per mille of the motor's rated torque, as in objects 0x6071 (target torque) and
            0x60B2 (torque offset); ``analogue``: +-10 V; ``counts``: signed 16 bits.
        basis: Convention of the amplifier's current, ``dc``, ``rms`` or ``peak``; None: that of the joint's amplifier
            in the study. For ``cia402`` it is the convention of object 0x6075 (motor rated current), ``rms`` or
            ``peak`` depending on the manufacturer, or ``torque`` if the drive uses only the rated torque of object
            0x6076; this is also the meaning of None if the study's amplifiers are in ``dc``.
        full_scale: Current [A] in that basis at 10 V or 32767 counts; None: the peak current of the amplifier, or else
            of the motor. For ``cia402`` the rated current [A] or, with ``torque``, the rated torque [N m]; None: that
            of the motor's data sheet, or else the amplifier's continuous current. A number, or numbers by joint name.

    Returns:
        Scales by joint name.

    Raises:
        InputError: An unknown scale or basis, or a joint whose full scale is unknown.

    Reference:
        CiA 402 (IEC 61800-7-201): target torque over 1000 is its share of the motor rated torque [mN m]. Drives
        command target/1000 of the rated current, if the motor's torque constant relates 0x6076 and 0x6075.
    """
    faults: list[Fault] = []
    if scale not in SCALES:
        faults.append(Fault("scale", f"must be {', '.join(SCALES)}", scale, nearest(scale, SCALES)))
    bases = ("rms", "peak", TORQUE) if scale == "cia402" else ("dc", "rms", "peak")
    if basis is not None and basis not in bases:
        faults.append(Fault("basis", f"must be {', '.join(bases)}", basis, nearest(basis, bases)))
    given = dict(full_scale) if isinstance(full_scale, Mapping) else dict.fromkeys(evaluation.joints, full_scale)
    given = by_joint("full_scale", given, evaluation.joints, faults)
    for name, value in given.items():
        if value is not None and not 0.0 < value < math.inf:
            faults.append(Fault(f"full_scale.{name}", "must be positive", value))
    raise_faults(faults)
    found, unknown = {}, Faults()
    for name, joint in evaluation.joints.items():
        used = basis or str(joint.amplifier.current_basis)
        used = TORQUE if scale == "cia402" and used == CurrentBasis.DC else used
        used = used if used == TORQUE else str(motor_basis(joint.drive.motor.kind, used))
        found[name] = unknown.attempt(_scale, joint, scale, used, given.get(name))
    unknown.raise_any()
    return {name: one for name, one in found.items() if one is not None}


def _scale(joint: JointResult, scale: str, basis: str, full: float | None) -> CurrentScale:
    if scale == "amperes":
        return CurrentScale(f"A {basis}", to_dc(1.0, basis), math.inf, False, f"amperes, {basis}")
    if scale == "cia402":
        return _per_mille(joint, basis, full)
    if full is None:
        peak = joint.amplifier.peak_current or joint.drive.motor.peak_current
        full = None if peak is None else from_dc(peak, CurrentBasis(basis))
    if full is None:
        place, problem = f"joints.{joint.name}.amplifier.peak_current", "is not known, and no full scale is given"
        raise InputError(Fault(place, problem, None, "state the current of the full scale [A]"))
    unit, most, whole = ("V", ANALOGUE_VOLTS, False) if scale == "analogue" else ("counts", float(WORD), True)
    return CurrentScale(unit, to_dc(full, basis) / most, most, whole, f"{most:g} {unit} are {full:.9g} A {basis}")


def _per_mille(joint: JointResult, basis: str, full: float | None) -> CurrentScale:
    """Scale of CiA 402: 1000 corresponds to the rated torque of object 0x6076."""
    motor, constant = joint.drive.motor, abs(joint.drive.motor.torque_constant)
    rated = motor.nominal_current or joint.amplifier.continuous_current
    if full is None and rated is not None:
        full = constant * rated if basis == TORQUE else from_dc(rated, CurrentBasis(basis))
    if full is None:
        place, hint = f"joints.{joint.name}: motor {motor.key}", "state the rated current [A] or torque [N m]"
        raise InputError(Fault(place, "has no nominal current in its row, and no full scale is given", hint=hint))
    current = full / constant if basis == TORQUE else to_dc(full, basis)
    words = f"1000 per mille are the rated torque, object 0x6076 = {1e3 * constant * current:.9g} mN m"
    if basis == TORQUE:
        words += f", which the drive turns into current by the torque constant {constant:.9g} N m/A dc"
    else:
        words += f", for which it gives the rated current, object 0x6075 = {1e3 * full:.9g} mA {basis}"
    return CurrentScale("per mille of rated torque", current / 1e3, float(WORD), True, words)


def in_scale(current: Array, scale: CurrentScale, joint: str, time: Array) -> Array:
    """DC-equivalent currents [A], (N,), converted to a scale; raises ``InputError`` if they exceed its range."""
    numbers = current / scale.amperes
    numbers = np.rint(numbers) if scale.whole else numbers
    at = int(np.argmax(np.abs(numbers)))
    if not abs(numbers[at]) <= scale.most * (1.0 + 1e-12):
        problem = f"at {time[at]:.6g} s is beyond the +-{scale.most:g} {scale.unit} that can be written"
        hint = f"{scale.base}: a larger full scale makes room"
        raise InputError(Fault(f"current of {joint}", problem, f"{numbers[at]:.6g} {scale.unit}", hint))
    return numbers.astype(np.int64) if scale.whole else numbers


HOLDS = {0: "each the sample before", 1: "straight lines between the samples"}  # text in the file by ``hold``


@dataclass(frozen=True, eq=False)
class _Commands:
    """Contents of a file: header lines, and scale, numbers and motion of each joint, by name."""

    head: tuple[str, ...]
    time: Array
    scales: Mapping[str, CurrentScale]
    numbers: dict[str, Array]
    position: dict[str, Array]  # of the joints, not of the motors, also if motors are coupled
    velocity: dict[str, Array]


def write_currents(
    evaluation: Evaluation,
    path: str | Path,
    scales: Mapping[str, CurrentScale],
    *,
    rate: float | None = None,
    hold: int = 1,
) -> Path:
    """Write the current commands of all joints in the scales of their amplifiers.

    The header of each file states study, rate, hold and the definition of the scales.

    Args:
        evaluation: Evaluation of the drives to command.
        path: The file; its suffix selects CSV (.csv: time and one column per joint), a C header (.h), or a ROS 2
            ``trajectory_msgs/JointTrajectory`` (.yaml: the numbers are in ``effort``).
        scales: By joint name, from ``current_scales``.
        rate: Rate of the commands [Hz]; None: at the samples of the cycle.
        hold: As in ``current_commands``.

    Returns:
        Path of the file.

    Raises:
        InputError: Another suffix, joints without a scale, currents outside their scale (all joints listed), or a file
            that cannot be written.
    """
    writer = WRITERS.get(Path(path).suffix.lower())
    if writer is None:
        place = f"must end in {', '.join(WRITERS)}"
        raise InputError(Fault("path", place, str(path), nearest(Path(path).suffix, WRITERS)))
    return write_text(path, writer(_commands(evaluation, scales, rate, hold)))


def _commands(evaluation: Evaluation, scales: Mapping[str, CurrentScale], rate: float | None, hold: int) -> _Commands:
    if unknown := unknown_torques(evaluation.joints):
        raise InputError(unknown)
    lacking = [name for name in evaluation.joints if name not in scales]
    raise_faults(
        Fault(f"scales.{name}", "is missing", hint="current_scales makes those of all joints") for name in lacking
    )
    table = current_commands(evaluation, rate=rate, hold=hold)
    faults = Faults()
    rows = dict(iter(table.groupby("joint", sort=False)))
    time = rows[next(iter(rows))]["time [s]"].to_numpy()
    lasting = np.append(np.diff(time) > 0.0, True)  # of several samples at one instant, the last one
    time, rows = time[lasting], {name: one[lasting] for name, one in rows.items()}
    numbers, position, velocity = {}, {}, {}
    cycle, names = evaluation.study.cycle, evaluation.study.joint_names
    for name in evaluation.joints:
        numbers[name] = faults.attempt(in_scale, rows[name]["current [A]"].to_numpy(), scales[name], name, time)
        moves = (one[:, names.index(name)] for one in (cycle.position, cycle.velocity))
        position[name], velocity[name] = (np.interp(time, cycle.time, one) for one in moves)
    faults.raise_any()
    written = {name: values for name, values in numbers.items() if values is not None}
    study = evaluation.study
    samples = "samples: those of the cycle, of several at one instant the last"
    head = [
        f"currents of {study.name}, by drivetrain {__version__}",
        f"study: {study.path or study.name}, SHA-256 {study.digest or 'none: made in a program'}",
        samples if rate is None else f"rate: {rate:.9g} Hz; {HOLDS[hold]}",
        "each command holds until the next (zero order)",
    ]
    for name, one in scales.items():
        unit = "count" if one.unit == "counts" else one.unit
        head.append(f"{name}: {one.base}; 1 {unit} is {float(one.amperes)!r} A dc")
    return _Commands(tuple(head), time, scales, written, position, velocity)


def _csv(commands: _Commands) -> str:
    columns = {f"{name} [{commands.scales[name].unit}]": values for name, values in commands.numbers.items()}
    table = pd.DataFrame({"time [s]": commands.time, **columns})
    return "".join(f"# {line}\n" for line in commands.head) + table.to_csv(index=False, lineterminator="\n")


def _c_header(commands: _Commands) -> str:
    whole = all(one.whole for one in commands.scales.values())
    kind, words = ("int16_t", str) if whole else ("double", repr)
    names = ", ".join(f'"{name}"' for name in commands.numbers)
    rows = np.stack([*commands.numbers.values()], axis=1).tolist()
    lines = [
        *(f"/* {line.replace('*/', '* /')} */" for line in commands.head),
        "#ifndef DRIVETRAIN_CURRENTS_H",
        "#define DRIVETRAIN_CURRENTS_H",
        "#include <stdint.h>",
        f"#define CURRENTS_JOINTS {len(commands.numbers)}",
        f"#define CURRENTS_SAMPLES {len(commands.time)}",
        f"static const char *const currents_joint[CURRENTS_JOINTS] = {{{names}}};",
        _numbers("double", "currents_amperes_per_unit[CURRENTS_JOINTS]",
                 [repr(one.amperes) for one in commands.scales.values()]),
        _numbers("double", "currents_time[CURRENTS_SAMPLES]", [repr(one) for one in commands.time.tolist()]),
        _numbers(kind, "currents_command[CURRENTS_SAMPLES][CURRENTS_JOINTS]",
                 [f"{{{', '.join(words(value) for value in row)}}}" for row in rows]),
        "#endif",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _numbers(kind: str, name: str, texts: list[str]) -> str:
    return f"static const {kind} {name} = {{\n  " + ",\n  ".join(texts) + "\n};"


def _trajectory(commands: _Commands) -> str:
    lines = [f"# {line}" for line in commands.head]
    lines.append("# effort holds these numbers, not joint torques")
    lines += ["joint_names: [" + ", ".join(_quoted(name) for name in commands.numbers) + "]", "points:"]
    series = (("positions", commands.position), ("velocities", commands.velocity), ("effort", commands.numbers))
    start = commands.time[0]
    for k, time in enumerate(commands.time):
        since = round((time - start) * 1e9)
        lines += [f"  - time_from_start: {{sec: {since // 10**9}, nanosec: {since % 10**9}}}"]
        lines += [f"    {name}: [{', '.join(repr(float(row[k])) for row in rows.values())}]" for name, rows in series]
    return "\n".join(lines) + "\n"


def _quoted(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z_][\w.-]*", name) else "'" + name.replace("'", "''") + "'"


WRITERS: dict[str, Callable[[_Commands], str]] = {".csv": _csv, ".h": _c_header, ".yaml": _trajectory}
"""By the ending of the file."""
