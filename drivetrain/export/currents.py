"""Current commands as files for amplifiers and controllers: CSV, a C header, a ROS 2 JointTrajectory."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from drivetrain.arrays import Array
from drivetrain.errors import Fault, Faults, InputError, nearest
from drivetrain.export.scales import CurrentScale, in_scale
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.results import Evaluation
from drivetrain.version import __version__
from drivetrain.whole_files import write_text

HOLDS = {0: "each the sample before", 1: "straight lines between the samples"}


@dataclass(frozen=True, eq=False)
class _Commands:
    """What a file holds: its head, and of every joint scale, numbers and motion."""

    head: tuple[str, ...]
    time: Array
    scales: Mapping[str, CurrentScale]
    numbers: dict[str, Array]
    position: dict[str, Array]  # of the joints, also where motors are coupled
    velocity: dict[str, Array]


def write_currents(
    evaluation: Evaluation,
    path: str | Path,
    scales: Mapping[str, CurrentScale],
    *,
    rate: float | None = None,
    hold: int = 1,
) -> Path:
    """Write the current commands of all joints in the numbers that their amplifiers take.

    Every file says at its head what study, rate, hold and base it rests on.

    Args:
        evaluation: Of the drives that are to be commanded.
        path: Of the file; by its ending CSV (.csv: time and one column a joint), a C header (.h), or a ROS 2
            ``trajectory_msgs/JointTrajectory`` (.yaml: the numbers stand in ``effort``).
        scales: By joint name, from ``current_scales``.
        rate: Of the commands [Hz]; None: at the samples of the cycle.
        hold: As of ``current_commands``.

    Returns:
        Where the file is.

    Raises:
        InputError: Another ending, currents beyond their scale (every joint at once), or no right to write.
    """
    writer = WRITERS.get(Path(path).suffix.lower())
    if writer is None:
        place = f"must end in {', '.join(WRITERS)}"
        raise InputError(Fault("path", place, str(path), nearest(Path(path).suffix, WRITERS)))
    return write_text(path, writer(_commands(evaluation, scales, rate, hold)))


def _commands(evaluation: Evaluation, scales: Mapping[str, CurrentScale], rate: float | None, hold: int) -> _Commands:
    table = current_commands(evaluation, rate=rate, hold=hold)
    faults = Faults()
    rows = dict(iter(table.groupby("joint", sort=False)))
    time = rows[next(iter(rows))]["time [s]"].to_numpy()
    lasting = np.append(np.diff(time) > 0.0, True)  # a command with another at its instant lasts no time
    time, rows = time[lasting], {name: one[lasting] for name, one in rows.items()}
    numbers, position, velocity = {}, {}, {}
    cycle, names = evaluation.study.cycle, [task.name for task in evaluation.study.joints]
    for name in evaluation.joints:
        numbers[name] = faults.attempt(in_scale, rows[name]["current [A]"].to_numpy(), scales[name], name, time)
        moves = (one[:, names.index(name)] for one in (cycle.position, cycle.velocity))
        position[name], velocity[name] = (np.interp(time, cycle.time, one) for one in moves)
    faults.raise_any()
    written = {name: values for name, values in numbers.items() if values is not None}
    study = evaluation.study
    head = [
        f"currents of {study.name}, by drivetrain {__version__}",
        f"study: {study.path or study.name}, SHA-256 {study.digest or 'none: made in a program'}",
        "samples: those of the cycle, of several at one instant the last"
        if rate is None
        else f"rate: {rate:.9g} Hz; {HOLDS[hold]}",
        "each command holds until the next (zero order)",
        *(f"{name}: {one.base}; 1 {one.unit} is {one.amperes:.17g} A dc" for name, one in scales.items()),
    ]
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
