"""Recordings: what is in them comes back to the bit, with units, and a file is whole or not there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from drivetrain.errors import InputError
from drivetrain.simulation.recording import Event, Recording, Series, load_recording


def recording() -> Recording:
    time = np.linspace(0.0, 1.0, 5)
    return Recording(
        time,
        {
            "elbow.position": Series("rad", np.sin(time)),
            "wrist.position": Series("m", time**3),
            "heat": Series("W", time),
        },
        {"steps": 7, "rates": 28},
        (Event(0.25, "limit", "elbow passes its upper limit"),),
        Event(1.0, "diverged", "elbow.speed: no number"),
        {"arm": "planar", "solver": "Euler(0.1 s)"},
    )


def test_comes_back_to_the_bit(tmp_path: Path) -> None:
    kept = recording()
    back = load_recording(kept.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(back.time, kept.time)
    assert list(back.series) == list(kept.series)
    for name in kept.series:
        np.testing.assert_array_equal(back[name], kept[name])
        assert back.unit(name) == kept.unit(name)
    assert (back.counters, back.events, back.stopped_by, back.about) == (
        kept.counters, kept.events, kept.stopped_by, kept.about,
    )  # fmt: skip


def test_same_recording_same_bytes(tmp_path: Path) -> None:
    first, second = (recording().save(tmp_path / name).read_bytes() for name in ("a.npz", "b.npz"))
    assert first == second


def test_frame_has_units_in_its_columns() -> None:
    frame = recording().to_frame()
    assert list(frame.columns) == ["elbow.position [rad]", "wrist.position [m]", "heat [W]"]
    assert frame.index.name == "time [s]"
    assert frame.loc[0.5, "wrist.position [m]"] == 0.125


def test_series_by_their_ending() -> None:
    found = recording().ending("position")
    assert list(found) == ["elbow", "wrist"]
    np.testing.assert_array_equal(found["wrist"], recording()["wrist.position"])


def test_cannot_be_changed() -> None:
    kept, values = recording(), np.ones(5)
    with pytest.raises(ValueError, match="read-only"):
        kept["heat"][0] = 3.0
    copy = Recording(np.arange(5.0), {"x": Series("-", values)})
    values[0] = 9.0
    assert copy["x"][0] == 1.0


def test_half_a_file_is_never_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = recording().save(tmp_path / "run.npz")
    before = target.read_bytes()

    def fail(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(KeyboardInterrupt):
        recording().save(target)
    assert target.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["run.npz"]


def test_wrong_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"elbow\.position"):
        recording()["elbw.position"]
    with pytest.raises(InputError, match="shape"):
        Recording(np.arange(3.0), {"x": Series("-", np.ones(4))})
    with pytest.raises(InputError, match="finite"):
        Recording(np.arange(3.0), {"x": Series("-", np.array([0.0, np.nan, 1.0]))})
    with pytest.raises(InputError, match="no such file"):
        load_recording(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("hello", encoding="utf-8")
    with pytest.raises(InputError, match="no recording"):
        load_recording(tmp_path / "text.npz")
    whole = recording().save(tmp_path / "cut.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="no recording"):
        load_recording(tmp_path / "cut.npz")
    with pytest.raises(InputError, match="folder"):
        recording().save(tmp_path / "nowhere" / "run.npz")


def test_a_table_for_pandas_where_the_name_asks_for_one(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    recording = Recording([0.0, 1.0], {"a.speed": Series("rad/s", [1.0, 2.0])})
    table = pd.read_parquet(recording.save(tmp_path / "run.parquet"))
    assert list(table.columns) == ["a.speed [rad/s]"]
    assert table.index.name == "time [s]"
    np.testing.assert_array_equal(table["a.speed [rad/s]"], [1.0, 2.0])
    assert [path.name for path in tmp_path.iterdir()] == ["run.parquet"]
