"""ROS 2 trajectories and .mat files give the same motion as a CSV file."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import savemat

from drivetrain.errors import InputError
from drivetrain.motion.read import read_motion
from drivetrain.motion.recording import read_recording

JOINTS = ("pan", "lift")
TIME = np.linspace(0.0, 2.0, 81)
Q = np.stack([np.sin(1.5 * TIME), 0.5 * np.cos(2.0 * TIME)], axis=1)
QD = np.stack([1.5 * np.cos(1.5 * TIME), -np.sin(2.0 * TIME)], axis=1)


def as_csv(velocities: bool) -> StringIO:
    rows = np.column_stack([TIME, Q, QD] if velocities else [TIME, Q])
    head = "time [s],q_pan [rad],q_lift [rad]" + (",qd_pan [rad/s],qd_lift [rad/s]" if velocities else "")
    return StringIO("\n".join([head, *(",".join(repr(float(x)) for x in row) for row in rows)]))


def message(velocities: bool = True, order: tuple[int, ...] = (0, 1)) -> dict:
    points = [
        {"positions": Q[k, order].tolist(), "time_from_start": {"sec": int(t), "nanosec": round((t - int(t)) * 1e9)}}
        for k, t in enumerate(TIME)
    ]
    for k, point in enumerate(points):
        point["velocities"] = QD[k, order].tolist() if velocities else []
        point["accelerations"], point["effort"] = [], []
    return {"header": {"frame_id": ""}, "joint_names": [JOINTS[i] for i in order], "points": points}


@pytest.mark.parametrize("velocities", [True, False])
@pytest.mark.parametrize("wrapped", ["topic", "goal", "second"])
def test_trajectories_of_ros(tmp_path: Path, velocities: bool, wrapped: str) -> None:
    """The trajectory has its joints in another order, is wrapped in a goal, or follows another YAML document."""
    path, document = tmp_path / "move.yaml", message(velocities, (1, 0))
    texts = {
        "topic": yaml.safe_dump(document) + "---\n",
        "goal": yaml.safe_dump({"goal": {"trajectory": document}}),
        "second": "note: none\n---\n" + yaml.safe_dump(document),
    }
    path.write_text(texts[wrapped])
    found, same = read_motion(path, JOINTS), read_motion(as_csv(velocities), JOINTS)
    for name in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(found, name), getattr(same, name), atol=1e-6)
    np.testing.assert_allclose(found.time, TIME, atol=1e-9)


@pytest.mark.parametrize("turned", [True, False])
@pytest.mark.parametrize("names", [("t", "q", "qd"), ("time", "position", "velocity")])
def test_arrays(tmp_path: Path, turned: bool, names: tuple[str, str, str]) -> None:
    values = (TIME, Q.T if turned else Q, QD.T if turned else QD)
    held, same = dict(zip(names, values, strict=True)), read_motion(as_csv(True), JOINTS)
    savemat(tmp_path / "move.mat", held)
    np.savez(tmp_path / "move.npz", **held, joints=np.array(JOINTS))
    for path in (tmp_path / "move.mat", tmp_path / "move.npz"):
        found = read_motion(path, JOINTS)
        for name in ("time", "position", "velocity", "acceleration"):
            np.testing.assert_allclose(getattr(found, name), getattr(same, name), atol=1e-12)


def test_a_slide_is_in_metres(tmp_path: Path) -> None:
    path = tmp_path / "move.yaml"
    path.write_text(yaml.safe_dump(message()))
    assert read_motion(path, JOINTS, position_units=["rad", "m"]).position[5, 1] == pytest.approx(Q[5, 1])


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda m: m.pop("points"), "JointTrajectory"),
        (lambda m: m.update(points=m["points"][:1]), "two or more"),
        (lambda m: m.update(joint_names=["pan", "pan"]), "each once"),
        (lambda m: m["points"][3].update(positions=[1.0]), r"points\[3\].positions"),
        (lambda m: m["points"][3].update(positions=[1.0, "x"]), r"points\[3\].positions"),
        (lambda m: m["points"][3].update(positions=[1.0, float("inf")]), r"points\[3\].positions"),
        (lambda m: m["points"][4].pop("time_from_start"), r"points\[4\].time_from_start"),
        (lambda m: m.update(joint_names=["pan", "lfit"]), "lift"),
        (lambda m: m["points"][7].update(velocities=[]), r"points\[7\].velocities"),
    ],
)
def test_invalid_trajectories_are_errors(tmp_path: Path, change, problem: str) -> None:
    path, spoiled = tmp_path / "move.yaml", message()
    change(spoiled)
    path.write_text(yaml.safe_dump(spoiled))
    with pytest.raises(InputError, match=problem):
        read_motion(path, JOINTS)


@pytest.mark.parametrize(
    "text", ["", "a: [", "- 1\n- 2", "joint_names: &a [*a]\npoints: []", "!!python/name:os.system x"]
)
def test_yaml_without_a_trajectory_is_an_error(tmp_path: Path, text: str) -> None:
    path = tmp_path / "move.yaml"
    path.write_text(text)
    with pytest.raises(InputError):
        read_motion(path, JOINTS)


@pytest.mark.parametrize(
    ("held", "problem"),
    [
        ({"q": Q}, "time"),
        ({"t": TIME}, "variable q"),
        ({"t": TIME, "q": Q[:5]}, "shape"),
        ({"t": TIME, "q": Q * np.nan}, "finite"),
        ({"t": TIME, "q": np.array(["a", "b"])}, "finite"),
        ({"t": [0.0], "q": Q[:1]}, "two"),
    ],
)
def test_invalid_mat_files_are_errors(tmp_path: Path, held: dict, problem: str) -> None:
    savemat(tmp_path / "move.mat", held)
    with pytest.raises(InputError, match=problem):
        read_motion(tmp_path / "move.mat", JOINTS)


def test_files_that_are_not_mat_files_are_errors(tmp_path: Path) -> None:
    for content in (b"", b"MATLAB 5.0", b"\x89HDF\r\n\x1a\n" + b"\0" * 600, bytes(range(256)) * 4):
        (tmp_path / "move.mat").write_bytes(content)
        for read in (read_motion, read_recording):
            with pytest.raises(InputError):
                read(tmp_path / "move.mat", JOINTS)
    with pytest.raises(InputError, match="cannot be read"):
        read_motion(tmp_path / "missing.mat", JOINTS)


def test_files_that_are_not_npz_files_are_errors(tmp_path: Path) -> None:
    np.save(tmp_path / "one.npy", np.zeros(3))
    np.savez_compressed(tmp_path / "whole.npz", t=np.arange(5000.0), q=np.zeros((5000, len(JOINTS))))
    whole = (tmp_path / "whole.npz").read_bytes()
    spoiled = whole[:200] + bytes(100) + whole[300:]
    for content in (b"", b"PK\x03\x04", (tmp_path / "one.npy").read_bytes(), whole[:500], spoiled):
        (tmp_path / "move.npz").write_bytes(content)
        for read in (read_motion, read_recording):
            with pytest.raises(InputError, match="cannot be read"):
                read(tmp_path / "move.npz", JOINTS)
