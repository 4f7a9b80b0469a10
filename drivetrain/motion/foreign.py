"""Motions in files of other programs as tables in SI: ROS 2 trajectories (YAML), ROS bags, arrays in .mat and .npz."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drivetrain.arrays import Array
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.motion.table import LARGEST, Column, Table
from drivetrain.whole_files import read_text

SERIES = {"q": "positions", "qd": "velocities", "qdd": "accelerations"}
WRAPPERS = ("trajectory", "joint_trajectory", "goal")
IN_ARRAYS = {
    "time": ("t", "time", "tout"),
    "q": ("q", "pos", "position", "positions"),
    "qd": ("qd", "dq", "vel", "velocity", "velocities"),
    "qdd": ("qdd", "ddq", "acc", "acceleration", "accelerations"),
}
BAGS = (".bag", ".db3", ".mcap")  # of ROS 1 and 2
SHOWN = 5  # largest number of faults of one kind reported


def foreign_table(path: str | Path, joint_names: Sequence[str], units: Sequence[str] | None = None) -> Table | None:
    """Read a ROS 2 trajectory (.yaml, .yml), a ROS bag, a .mat or a .npz file as a table in SI; None for another
    suffix.

    ``units`` are ``rad`` or ``m`` for each joint; None: all ``rad``.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        return None
    joints, time, series = reader(Path(path), joint_names)
    kinds = dict(zip(joint_names, units or ["rad"] * len(joint_names), strict=True))
    columns = [Column("time [s]", "time", "s", time)]
    for name, values in series.items():
        for joint, row in zip(joints, values.T, strict=True):
            unit = kinds.get(joint, "rad") + {"q": "", "qd": "/s", "qdd": "/s^2"}[name]
            columns.append(Column(f"{name}_{joint} [{unit}]", f"{name}_{joint}", unit, np.ascontiguousarray(row)))
    return Table(str(path), tuple(columns), tuple(range(1, len(time) + 1)), ())


Read = tuple[Sequence[str], Array, dict[str, Array]]  # joint names, time [s] (N,), series by name (N, n)


def _trajectory(path: Path, joint_names: Sequence[str]) -> Read:
    loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    text = read_text(path)
    try:
        message = next((one for one in map(_unwrapped, yaml.load_all(text, loader)) if one), None)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise InputError(Fault("file", f"cannot be read: {str(error).splitlines()[0]}", file=str(path))) from None
    if message is None:
        hint = "as `ros2 topic echo` writes it"
        raise InputError(Fault("file", "holds no JointTrajectory: joint_names and points", None, hint, str(path)))
    joints, points = message["joint_names"], message["points"]
    faults = Faults(str(path))
    named = isinstance(joints, list) and all(isinstance(one, str) for one in joints)
    if not (named and len({*joints}) == len(joints) > 0):
        faults.add("joint_names", "must be names, each once")
    if not isinstance(points, list) or len(points) < 2:
        faults.add("points", "must be a list of two or more")
    faults.raise_any()
    time = np.array([_time_from_start(point, k, faults) for k, point in enumerate(points)])
    given = {
        name: word for name, word in SERIES.items() if any(isinstance(p, dict) and p.get(word) for p in points)
    } | {"q": SERIES["q"]}  # fmt: skip
    series = {
        name: np.array([_row(point, word, k, len(joints), faults) for k, point in enumerate(points)])
        for name, word in given.items()
    }
    _raise_all(faults)
    return joints, time, series


def _unwrapped(document: Any) -> Any:
    for _ in range(len(WRAPPERS) + 1):
        if not isinstance(document, dict):
            return None
        if "joint_names" in document and "points" in document:
            return document
        document = next((document[name] for name in WRAPPERS if name in document), None)
    return None


def _time_from_start(point: Any, k: int, faults: Faults) -> float:
    """``time_from_start`` of point ``k`` [s], as ROS 2 (sec, nanosec) or ROS 1 (secs, nsecs) writes it."""
    since = point.get("time_from_start") if isinstance(point, dict) else None
    if isinstance(since, dict):
        parts: list[Any] = [since.get(two, since.get(one, 0)) for two, one in (("sec", "secs"), ("nanosec", "nsecs"))]
        if all(isinstance(one, int | float) and abs(one) < LARGEST for one in parts):
            return float(parts[0]) + 1e-9 * float(parts[1])
    faults.add(f"points[{k}].time_from_start", "must be {sec: ..., nanosec: ...}")
    return math.nan


def _row(point: Any, word: str, k: int, n: int, faults: Faults) -> Array:
    row = point.get(word) if isinstance(point, dict) else None
    if isinstance(row, list) and len(row) == n:
        try:
            found = np.array([float(one) for one in row])
            if (np.abs(found) < LARGEST).all():
                return found
        except (TypeError, ValueError, OverflowError):
            pass
    faults.add(f"points[{k}].{word}", f"must be {n} finite numbers, one a joint")
    return np.full(n, math.nan)


def _raise_all(faults: Faults) -> None:
    more = len(faults.found) - SHOWN
    if more > 0:
        del faults.found[SHOWN:]
        faults.add("points", f"{more} more like this")
    faults.raise_any()


def matlab_arrays(path: Path) -> dict[str, Any]:
    """The variables of a .mat file by name."""
    from scipy.io import loadmat

    try:
        return {name: values for name, values in loadmat(path).items() if not name.startswith("__")}
    except NotImplementedError:
        hint = "save(file, 't', 'q', '-v7')"
        raise InputError(Fault("file", "is of MATLAB 7.3, which is not read", None, hint, str(path))) from None
    except OSError as error:
        raise InputError(Fault("file", f"cannot be read: {error.strerror or error}", file=str(path))) from None
    except Exception as error:  # for damaged files scipy raises many types of exceptions
        raise InputError(Fault("file", f"cannot be read as .mat: {error}", file=str(path))) from None


def numpy_arrays(path: Path) -> dict[str, Any]:
    """The arrays of a .npz file by name."""
    try:
        with path.open("rb") as file:
            held = np.load(file)
            if not isinstance(held, np.lib.npyio.NpzFile):
                raise ValueError("it holds one array without a name")
            return {key: held[key] for key in held.files}
    except Exception as error:  # for damaged files numpy raises many types of exceptions
        raise InputError(Fault("file", f"cannot be read as .npz: {error}", file=str(path))) from None


def _arrays(path: Path, joint_names: Sequence[str]) -> Read:
    held = matlab_arrays(path) if path.suffix.lower() == ".mat" else numpy_arrays(path)
    found = {what: next((held[one] for one in names if one in held), None) for what, names in IN_ARRAYS.items()}
    faults, n, series = Faults(str(path)), len(joint_names), dict[str, Array]()
    for what in ("time", "q"):
        if found[what] is None:
            faults.add(f"variable {what}", "is missing", None, f"one of {', '.join(IN_ARRAYS[what])}")
    faults.raise_any()
    time = _real(found["time"], "time", faults).ravel()
    for name in (name for name in SERIES if found[name] is not None):
        rows = _real(found[name], name, faults)
        rows = rows.T if rows.shape == (n, len(time)) and rows.shape != (len(time), n) else rows
        if rows.shape != (len(time), n):
            problem = f"must be ({len(time)}, {n}): a row a time, a column a joint of the arm"
            faults.add(f"variable {name}", problem, f"shape {rows.shape}")
        series[name] = rows
    if len(time) < 2:
        faults.add("variable time", "must hold two or more", len(time))
    faults.raise_any()
    return joint_names, time, series


def _real(values: Any, name: str, faults: Faults) -> Array:
    array = np.asarray(values)
    if array.dtype.kind in "iufb" and np.isfinite(array).all() and (np.abs(array) < LARGEST).all():
        return array.astype(np.float64)
    faults.add(f"variable {name}", "must be finite real numbers")
    return np.zeros(array.shape)


def bag_messages(file: Path, kind: str) -> list[tuple[str, Any]]:
    """The messages of type ``kind`` in a ROS bag (its file or folder), in their order, with their topics."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(Fault("file", "needs rosbags", file.name, "pip install drivetrain[bags]")) from None
    folder = file.parent if file.suffix in (".db3", ".mcap") else file
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.LATEST)) as reader:
            topics = [one for one in reader.connections if one.msgtype.endswith(f"/{kind}")]
            return [
                (connection.topic, reader.deserialize(raw, connection.msgtype))
                for connection, _, raw in (reader.messages(connections=topics) if topics else ())
            ]
    except Exception as error:  # the type depends on the format of the bag
        raise InputError(Fault("file", f"cannot be read as a ROS bag: {error}", file.name)) from None


def joint_states(file: Path, joints: Sequence[str]) -> tuple[Array, dict[str, Array]]:
    """Measurements of joints in a ROS bag, from the JointState messages that name all of the joints.

    Of several topics with such messages, which may be commands, the one named ``joint_states`` is read.

    Returns the time from the first message [s], and position, velocity and effort by name, (N, n) each, in SI; a
    quantity that some of these messages lack is left out.
    """
    by_topic: dict[str, list[Any]] = {}
    for topic, one in bag_messages(file, "JointState"):
        if {*joints} <= {*one.name}:
            by_topic.setdefault(topic, []).append(one)
    named = [topic for topic in by_topic if len(by_topic) == 1 or topic.rpartition("/")[2] == "joint_states"]
    if len(by_topic) > 1 and len(named) != 1:
        problem = f"has JointState of these joints on several topics: {', '.join(by_topic)}"
        raise InputError(Fault("file", problem, file.name, "keep the measured one, or name it /joint_states"))
    states = [one for topic in named for one in by_topic[topic]]
    stamps = [one.header.stamp for one in states]
    # Seconds since 1970 as one float would be rounded to 0.24 microseconds.
    time = np.array([one.sec - stamps[0].sec + 1e-9 * (one.nanosec - stamps[0].nanosec) for one in stamps])
    places = [[list(one.name).index(joint) for joint in joints] for one in states]
    found = {}
    for part in ("position", "velocity", "effort"):
        rows = [np.asarray(getattr(one, part)) for one in states]
        if all(len(row) == len(one.name) for row, one in zip(rows, states, strict=True)):
            found[part] = np.array([row[at] for row, at in zip(rows, places, strict=True)])
    return time, found


def _bag(path: Path, joint_names: Sequence[str]) -> Read:
    """The first JointTrajectory of these joints that was sent; if there is none, the measured positions."""
    wanted = {*joint_names}
    sent = next((one for _, one in bag_messages(path, "JointTrajectory") if wanted <= {*one.joint_names}), None)
    if sent is not None and len(sent.points) > 1:
        since = [point.time_from_start for point in sent.points]
        time = np.array([one.sec + 1e-9 * one.nanosec for one in since])
        rows = {name: [np.asarray(getattr(point, word)) for point in sent.points] for name, word in SERIES.items()}
        n = len(sent.joint_names)
        whole = {name: np.array(one) for name, one in rows.items() if name == "q" or all(len(row) == n for row in one)}
        if all(len(row) == n for row in rows["q"]):
            return list(sent.joint_names), time, whole
    time, measured = joint_states(path, joint_names)
    if len(time) < 2 or "position" not in measured:
        problem = f"holds neither a JointTrajectory nor two JointState of {', '.join(joint_names)}"
        raise InputError(Fault("file", problem, file=str(path)))
    time, kept = np.unique(time, return_index=True)
    return joint_names, time, {"q": measured["position"][kept]}


READERS: dict[str, Callable[[Path, Sequence[str]], Read]] = {
    ".yaml": _trajectory, ".yml": _trajectory, ".mat": _arrays, ".npz": _arrays, **dict.fromkeys(BAGS, _bag),
}  # fmt: skip
