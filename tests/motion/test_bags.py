"""ROS bags read as motions and as recordings: written by ``rosbags`` in every storage format that it has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import drivetrain as dt
from drivetrain.errors import InputError
from drivetrain.motion.read import read_motion

JOINTS = ["shoulder", "elbow"]
TIME = np.linspace(0.0, 2.0, 201)
POSITION = np.stack([np.sin(0.5 * np.pi * TIME) ** 2, -0.4 * np.sin(np.pi * TIME) ** 2], axis=1)
SPEED = np.stack([0.5 * np.pi * np.sin(np.pi * TIME), -0.4 * np.pi * np.sin(2 * np.pi * TIME)], axis=1)
EFFORT = np.stack([3.0 + TIME, 1.0 - TIME], axis=1)
KINDS = ["db3", "mcap", "bag"]


class Bag:
    """A ROS 1 or 2 bag to which messages about joints are written, and the path from which it is read."""

    def __init__(self, folder: Path, kind: str) -> None:
        self.ros2 = kind != "bag"
        self.store = get_typestore(Stores.ROS2_HUMBLE if self.ros2 else Stores.ROS1_NOETIC)
        storage = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        home = folder / "run"
        self.writer: Any = Writer2(home, version=9, storage_plugin=storage) if self.ros2 else Writer1(f"{home}.bag")
        self.path = home / f"run.{kind}" if self.ros2 else folder / "run.bag"

    def made(self, kind: str, /, **values: Any) -> Any:
        return self.store.types[kind](**values)

    def stamp(self, t: float) -> Any:
        return self.made("builtin_interfaces/msg/Time", sec=int(t), nanosec=round(1e9 * (t % 1.0)))

    def header(self, t: float) -> Any:
        more = {} if self.ros2 else {"seq": 0}
        return self.made("std_msgs/msg/Header", stamp=self.stamp(t), frame_id="", **more)

    def put(self, topic: str, kind: str, messages: list[Any]) -> None:
        connection = self.writer.add_connection(topic, kind, typestore=self.store)
        for k, message in enumerate(messages):
            write = self.store.serialize_cdr if self.ros2 else self.store.serialize_ros1
            self.writer.write(connection, k * 10_000_000, write(message, kind))

    def states(self, names: list[str], start: float = 100.0, topic: str = "/joint_states", factor: float = 1.0) -> None:
        """Measured joint states, with the joints in an order different from the arm's."""
        order = [JOINTS.index(name) for name in names]
        kind = "sensor_msgs/msg/JointState"
        messages = []
        for t, q, v, e in zip(TIME, POSITION, SPEED, EFFORT, strict=True):
            values = {"position": factor * q[order], "velocity": v[order], "effort": e[order]}
            messages.append(self.made(kind, header=self.header(start + t), name=names, **values))
        self.put(topic, kind, messages)

    def trajectory(self, names: list[str]) -> None:
        """A commanded trajectory."""
        order = [JOINTS.index(name) for name in names]
        point, none = "trajectory_msgs/msg/JointTrajectoryPoint", np.zeros(0)
        points = []
        for t, q, v in zip(TIME, POSITION, SPEED, strict=True):
            since = self.made("builtin_interfaces/msg/Duration", sec=int(t), nanosec=round(1e9 * (t % 1.0)))
            points.append(self.made(
                point, positions=q[order], velocities=v[order], accelerations=none, effort=none, time_from_start=since
            ))  # fmt: skip
        kind = "trajectory_msgs/msg/JointTrajectory"
        command = self.made(kind, header=self.header(0.0), joint_names=names, points=points)
        self.put("/command", kind, [command])


@pytest.mark.parametrize("kind", KINDS)
def test_a_recording(tmp_path: Path, kind: str) -> None:
    bag = Bag(tmp_path, kind)
    with bag.writer:
        bag.states(["elbow", "shoulder"])
    found = dt.read_recording(bag.path, JOINTS)
    assert found.time == pytest.approx(TIME, abs=1e-9)
    for values, own in ((found.position, POSITION), (found.velocity, SPEED), (found.torque, EFFORT)):
        assert values == pytest.approx(own, abs=1e-15)
    with pytest.raises(InputError, match="holds no JointState of wrist"):
        dt.read_recording(bag.path, ["wrist"])


def test_times_since_1970_keep_their_nanoseconds(tmp_path: Path) -> None:
    bag = Bag(tmp_path, "mcap")
    with bag.writer:
        bag.states(JOINTS, start=1_714_567_890.0)
    written = np.array([round(1e9 * ((1_714_567_890.0 + t) % 1.0)) for t in TIME]) * 1e-9
    found = dt.read_recording(bag.path, JOINTS).time
    assert (found - written + 0.5) % 1.0 - 0.5 == pytest.approx(0.0 * TIME, abs=1e-12)


def test_commands_that_are_joint_states_are_not_mixed_with_measurements(tmp_path: Path) -> None:
    bag = Bag(tmp_path, "mcap")
    with bag.writer:
        bag.states(JOINTS, start=100.002, topic="/joint_command", factor=0.5)
        bag.states(JOINTS)
    found = dt.read_recording(bag.path, JOINTS)
    assert len(found.time) == len(TIME) and found.position == pytest.approx(POSITION, abs=1e-15)
    other = Bag(tmp_path / "other", "mcap")
    with other.writer:
        other.states(JOINTS, topic="/a")
        other.states(JOINTS, topic="/b")
    with pytest.raises(InputError, match="on several topics: /a, /b"):
        dt.read_recording(other.path, JOINTS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_commanded_trajectory_takes_precedence_over_measured_positions(tmp_path: Path, kind: str) -> None:
    bag = Bag(tmp_path, kind)
    with bag.writer:
        bag.trajectory(["elbow", "shoulder"])
        bag.states(["shoulder", "elbow"], start=7.0)
    found = read_motion(bag.path, JOINTS)
    assert found.time == pytest.approx(TIME, abs=1e-9)
    assert found.position == pytest.approx(POSITION, abs=1e-15) and found.velocity == pytest.approx(SPEED, abs=1e-15)


def test_a_motion_from_measured_positions(tmp_path: Path) -> None:
    bag = Bag(tmp_path, "mcap")
    with bag.writer:
        bag.states(["elbow", "shoulder"])
    found = read_motion(bag.path, JOINTS)
    assert found.position == pytest.approx(POSITION, abs=1e-15)
    # Differentiated from positions, since measured speeds are noisy.
    assert found.velocity[5:-5] == pytest.approx(SPEED[5:-5], abs=2e-3)


def test_files_that_are_not_bags_are_errors(tmp_path: Path) -> None:
    for kind in KINDS:
        path = tmp_path / kind / f"run.{kind}"
        path.parent.mkdir()
        path.write_bytes(b"no bag")
        for read in (dt.read_recording, read_motion):
            with pytest.raises(InputError, match="cannot be read as a ROS bag"):
                read(path, JOINTS)
    bag = Bag(tmp_path, "mcap")
    with bag.writer:
        bag.states(JOINTS)
    with pytest.raises(InputError, match="holds neither a JointTrajectory nor two JointState of wrist"):
        read_motion(bag.path, ["wrist"])
