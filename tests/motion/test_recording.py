"""Recordings from all file formats: names, units, time; faults name the column."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from drivetrain.errors import InputError
from drivetrain.motion.recording import MeasuredMotion, read_recording

JOINTS = ("shoulder", "elbow")
TIME = 0.01 * np.arange(20)
DEGREES = np.column_stack([30.0 * np.sin(TIME), 5.0 * TIME])
TORQUE = np.column_stack([TIME, 2.0 * TIME])


def check(found: MeasuredMotion) -> None:
    assert found.joint_names == JOINTS
    np.testing.assert_allclose(found.time, TIME, atol=1e-12)
    np.testing.assert_allclose(found.position, np.deg2rad(DEGREES))
    np.testing.assert_allclose(found.torque, TORQUE)
    assert found.velocity is None and found.current is None


def test_csv(tmp_path: Path) -> None:
    rows = "\n".join(
        f"{1e3 * t!r},{q[0]!r},{q[1]!r},{m[0]!r},{m[1]!r}" for t, q, m in zip(TIME, DEGREES, TORQUE, strict=True)
    ).replace("np.float64(", "").replace(")", "")  # fmt: skip
    file = tmp_path / "run.csv"
    file.write_text(f"time [ms],q_shoulder [deg],q_elbow [deg],tau_shoulder [N m],tau_elbow [N m]\n{rows}\n")
    check(read_recording(file, JOINTS))


def test_npz_mat_and_parquet(tmp_path: Path) -> None:
    import pandas as pd

    arrays = {"time [s]": TIME, "q [deg]": DEGREES, "torque [N m]": TORQUE, "label": np.array("x")}
    np.savez(tmp_path / "run.npz", **arrays)
    check(read_recording(tmp_path / "run.npz", JOINTS))
    savemat(tmp_path / "run.mat", {"t": TIME, "phi": DEGREES, "moment": TORQUE, "label": "x"})
    columns = {"t": "time [s]", "phi": "q [deg]", "moment": "torque [N m]"}
    check(read_recording(tmp_path / "run.mat", JOINTS, columns=columns))
    savemat(tmp_path / "si.mat", {"t": TIME, "q": np.deg2rad(DEGREES), "torque": TORQUE})
    check(read_recording(tmp_path / "si.mat", JOINTS))
    frame = pd.DataFrame({"time [s]": TIME, "q1 [deg]": DEGREES[:, 0], "q2 [deg]": DEGREES[:, 1]})
    frame[["torque_shoulder [N m]", "torque_elbow [N m]"]] = TORQUE
    frame.to_parquet(tmp_path / "run.parquet")
    check(read_recording(tmp_path / "run.parquet", JOINTS))


def test_a_quantity_of_only_one_joint_is_noted(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", **{"time [s]": TIME, "q [rad]": DEGREES, "current_elbow [A]": TIME})
    found = read_recording(tmp_path / "run.npz", JOINTS)
    assert found.current is None and any("current is not used" in note for note in found.notes)


@pytest.mark.parametrize(
    ("unit", "basis", "factor"),
    [("A", None, 1.0), ("A_rms", "rms", 1.0), ("A eff", "rms", 1.0), ("mA_peak", "peak", 1e-3), ("Adc", "dc", 1.0)],
)
def test_currents_state_their_amperes(tmp_path: Path, unit: str, basis: str | None, factor: float) -> None:
    arrays = {"time [s]": TIME, "q [rad]": DEGREES, f"current [{unit}]": TORQUE}
    np.savez(tmp_path / "run.npz", **arrays)
    found = read_recording(tmp_path / "run.npz", JOINTS)
    assert found.current_basis == basis and np.array_equal(found.current, factor * TORQUE)
    other = {**arrays, "current_elbow [A_rms]": TIME, "current_shoulder [A_peak]": TIME}
    del other[f"current [{unit}]"]
    np.savez(tmp_path / "run.npz", **other)
    with pytest.raises(InputError, match=r"must all be in the same amperes.*peak.*rms"):
        read_recording(tmp_path / "run.npz", JOINTS)


def test_names_of_columns_that_the_file_does_not_have_are_errors(tmp_path: Path) -> None:
    arrays = {"time [s]": TIME, "q [deg]": DEGREES, "moment": TORQUE}
    np.savez(tmp_path / "run.npz", **arrays)
    with pytest.raises(InputError, match=r"no column of this name.*momnt.*did you mean 'moment'"):
        read_recording(tmp_path / "run.npz", JOINTS, columns={"momnt": "torque [N m]"})
    (tmp_path / "run.csv").write_text("time [s],q1 [rad],q2 [rad]\n0,0,0\n1,0,0\n2,0,0\n")
    with pytest.raises(InputError, match="no column of this name"):
        read_recording(tmp_path / "run.csv", JOINTS, columns={"q3": "torque [N m]"})


def test_parquet_with_times_as_index_or_dates(tmp_path: Path) -> None:
    import pandas as pd

    frame = pd.DataFrame({"time [s]": TIME, "q1 [deg]": DEGREES[:, 0], "q2 [deg]": DEGREES[:, 1]})
    frame[["torque1 [N m]", "torque2 [N m]"]] = TORQUE
    frame.set_index("time [s]").to_parquet(tmp_path / "run.parquet")
    check(read_recording(tmp_path / "run.parquet", JOINTS))
    frame["time [s]"] = pd.to_datetime(TIME, unit="s")
    frame.to_parquet(tmp_path / "run.parquet")
    with pytest.raises(InputError, match=r"array time \[s\]: must hold numbers.*datetime64"):
        read_recording(tmp_path / "run.parquet", JOINTS)


def test_lines_may_end_with_a_separator(tmp_path: Path) -> None:
    rows = "\n".join(f"{t},{q[0]},{q[1]},{m[0]},{m[1]}," for t, q, m in zip(TIME, DEGREES, TORQUE, strict=True))
    header = "time [s],q_shoulder [deg],q_elbow [deg],tau_shoulder [N m],tau_elbow [N m],"
    (tmp_path / "run.csv").write_text(f"{header}\n{rows}\n")
    check(read_recording(tmp_path / "run.csv", JOINTS))


def test_samples_at_one_instant(tmp_path: Path) -> None:
    twice = np.r_[TIME[:5], TIME[4:]]
    np.savez(tmp_path / "run.npz", **{"time [s]": twice, "q [rad]": np.column_stack([twice, twice])})
    found = read_recording(tmp_path / "run.npz", JOINTS)
    assert len(found.time) == 20 and any("1 samples at an instant" in note for note in found.notes)


def test_wrong_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_recording(tmp_path / "none.csv", JOINTS)
    (tmp_path / "run.txt").write_text("x")
    with pytest.raises(InputError, match="must be one of"):
        read_recording(tmp_path / "run.txt", JOINTS)
    for name in ("bad.npz", "bad.mat", "bad.parquet"):
        (tmp_path / name).write_bytes(b"nonsense" * 50)
        with pytest.raises(InputError, match="cannot be read"):
            read_recording(tmp_path / name, JOINTS)
    np.savez(tmp_path / "short.npz", **{"time [s]": TIME, "q_shoulder [deg]": TIME})
    with pytest.raises(InputError, match="elbow"):
        read_recording(tmp_path / "short.npz", JOINTS)
    np.savez(tmp_path / "bare.npz", **{"time": TIME, "q": DEGREES})
    with pytest.raises(InputError, match="needs a unit"):
        read_recording(tmp_path / "bare.npz", JOINTS)
    np.savez(tmp_path / "stamp.npz", **{"timestamp [s]": TIME, "q [deg]": DEGREES})
    with pytest.raises(InputError, match=r"did you mean 'time'\?; name each column"):
        read_recording(tmp_path / "stamp.npz", JOINTS)
    np.savez(tmp_path / "back.npz", **{"time [s]": TIME[::-1], "q [rad]": DEGREES})
    with pytest.raises(InputError, match="goes back"):
        read_recording(tmp_path / "back.npz", JOINTS)


def moved(**changed: np.ndarray) -> dict[str, np.ndarray]:
    time = np.linspace(0.0, 4.0, 401)
    angle = np.outer(time, [1.0, 2.0])
    rates = {
        "q [rad]": np.sin(angle),
        "qd [rad/s]": np.cos(angle) * [1.0, 2.0],
        "qdd [rad/s^2]": -np.sin(angle) * [1, 4],
    }
    return {"t [s]": time, **rates, "torque [N m]": np.cos(angle), **changed}


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("qd [rad/s]", np.rad2deg, "velocity_shoulder: is not the derivative.*look like degrees, not radians"),
        ("qdd [rad/s^2]", np.negative, "acceleration_elbow: is not the derivative.*the sign is turned"),
        ("q [rad]", lambda q: np.angle(np.exp(1j * (q + 2.5))), "the angle is wrapped: unwrap it"),
        ("q [rad]", lambda q: q + (np.arange(401) == 200)[:, None], "has a spike by 0.99"),
        ("torque [N m]", np.transpose, r"array torque \[N m\]: must have 401 rows, one an instant"),
    ],
)
def test_what_cannot_be_a_motion_is_an_error(tmp_path: Path, name: str, change: Any, words: str) -> None:
    np.savez(tmp_path / "run.npz", **moved(**{name: change(moved()[name])}))
    with pytest.raises(InputError, match=words):
        read_recording(tmp_path / "run.npz", JOINTS)


def test_speeds_in_another_unit_are_an_error_however_short_the_travel(tmp_path: Path) -> None:
    """A slide of 40 mm whose speeds are in mm/s; a joint at rest whose readings waver is none."""
    time = np.linspace(0.0, 4.0, 401)
    slide, rest = 0.02 * np.sin(time), 1e-4 * np.random.default_rng(0).standard_normal(401)
    arrays = {"t [s]": time, "q [m]": np.column_stack([slide, rest])}
    np.savez(tmp_path / "run.npz", **arrays, **{"qd [m/s]": np.column_stack([20.0 * np.cos(time), 0.0 * time])})
    with pytest.raises(InputError, match=r"velocity_shoulder: is not the .*thousand times too large") as error:
        read_recording(tmp_path / "run.npz", JOINTS)
    assert len(error.value.faults) == 1
    np.savez(tmp_path / "run.npz", **arrays, **{"qd [m/s]": np.column_stack([0.02 * np.cos(time), 0.01 * rest])})
    read_recording(tmp_path / "run.npz", JOINTS)


def test_times_that_may_be_milliseconds_are_told(tmp_path: Path) -> None:
    for times, told in ((1e3 * moved()["t [s]"], True), (moved()["t [s]"], False)):
        np.savez(tmp_path / "run.npz", **{"t [s]": times, "q [rad]": moved()["q [rad]"]})
        notes = read_recording(tmp_path / "run.npz", JOINTS).notes
        assert any("are the times milliseconds?" in note for note in notes) is told


def test_rows_of_another_length_are_not_all_listed(tmp_path: Path) -> None:
    rows = "\n".join(f"{t},0,0" for t in TIME)
    (tmp_path / "run.csv").write_text(f"time [s];q_shoulder [rad];q_elbow [rad]\n{rows}\n")
    with pytest.raises(InputError, match="15 more like this") as error:
        read_recording(tmp_path / "run.csv", JOINTS)
    assert len(error.value.faults) < 12


def test_a_recording_of_no_joint(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", **moved())
    with pytest.raises(InputError, match="at least one joint"):
        read_recording(tmp_path / "run.npz", ())


def test_noise_and_gaps_are_no_errors(tmp_path: Path) -> None:
    """Readings of a joint at rest that waver, a pause in the recording, noise of speeds and accelerations."""
    rng, kept = np.random.default_rng(0), np.r_[0:150, 300:401]
    arrays = {name: values[kept] for name, values in moved().items()}
    arrays["q [rad]"][:, 1] = 0.0015 * rng.integers(0, 2, 251)
    arrays["qd [rad/s]"][:, 1] = arrays["qdd [rad/s^2]"][:, 1] = 0.0
    for name, size in (("qd [rad/s]", 0.02), ("qdd [rad/s^2]", 0.3)):
        arrays[name] += size * rng.normal(size=(251, 2))
    np.savez(tmp_path / "run.npz", **arrays)
    assert not any("warning" in note for note in read_recording(tmp_path / "run.npz", JOINTS).notes)
    arrays["q [rad]"] *= 30.0
    np.savez(tmp_path / "run.npz", **{name: arrays[name] for name in ("t [s]", "q [rad]")})
    assert any("are these degrees?" in note for note in read_recording(tmp_path / "run.npz", JOINTS).notes)
