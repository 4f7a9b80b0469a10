"""Series of a run: made when asked for, the same as those that were not."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from drivetrain.drive.friction import Friction
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.errors import InputError
from drivetrain.simulation.recording import Recording, Series, TableSeries, load_recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene


def table() -> TableSeries:
    more = {"twice": Series("m", np.array([4.0, 10.0, 16.0, 22.0]))}
    return TableSeries(np.arange(12.0).reshape(4, 3), {"b": (2, "m"), "a": (0, "s")}, more)


def test_a_table_is_a_mapping_in_the_order_of_its_columns() -> None:
    found = table()
    assert list(found) == ["b", "a", "twice"] and len(found) == 3
    assert "twice" in found and "c" not in found and found.rows == 4
    np.testing.assert_array_equal(found["b"].values, [2.0, 5.0, 8.0, 11.0])
    np.testing.assert_array_equal(found["twice"].values, [4.0, 10.0, 16.0, 22.0])
    assert found["twice"].unit == "m" and found["a"] is found["a"]
    for series in found.values():
        assert not series.values.flags.writeable and series.values.flags.c_contiguous
    with pytest.raises(KeyError):
        found["c"]


def test_a_recording_holds_a_table_as_it_stands() -> None:
    lazy = Recording(np.arange(2.0), TableSeries(np.zeros((2, 1)), {"a": (0, "s")}, {"e": Series("J", np.ones(2))}))
    assert "e" in lazy.series and list(lazy.series) == ["a", "e"]
    np.testing.assert_array_equal(lazy["a"], 0.0)
    with pytest.raises(InputError, match="no series"):
        lazy["b"]
    with pytest.raises(InputError, match="shape"):  # a table of other length than the clock is checked like any other
        Recording(np.arange(3.0), TableSeries(np.zeros((2, 1)), {"a": (0, "s")}, {}))


def test_a_run_saved_sent_or_shown_is_the_same(tmp_path: Path) -> None:
    effects = [DryFriction(Friction(coulomb=1.0), "joint"), GivenTorque([0.0, 0.5, 0.5, 1.0], [5.0, 5.0, -5.0, -5.0])]
    run = simulate(joint_scene(Inertia(0.3, weight=2.0), effects, 1.0), interval=0.05)
    back, sent = load_recording(run.save(tmp_path / "run.npz")), pickle.loads(pickle.dumps(run))
    frame, wide = run.to_frame(), pd.read_parquet(run.save(tmp_path / "run.parquet"))
    pd.testing.assert_frame_equal(frame, wide)
    assert list(back.series) == list(run.series) == list(sent.series)
    for name, series in run.series.items():
        assert isinstance(series, Series) and series.unit == back.unit(name)
        for other in (back[name], sent[name], frame[f"{name} [{series.unit}]"].to_numpy()):
            np.testing.assert_array_equal(other, series.values)
    # The audit: what is stored, less what a source has put in and losses have taken.
    flows = {name: 1.0 if "given" in name else -1.0 for name in run.series if name.endswith("_energy")}
    flows = {name: sign for name, sign in flows.items() if name.partition(".")[0] == "joint"}
    error = run["stored_energy"] - run["stored_energy"][0] - sum(sign * run[name] for name, sign in flows.items())
    np.testing.assert_allclose(run["energy_error"], error, rtol=0.0, atol=1e-12)
    assert np.abs(error).max() < 1e-6 * run["stored_energy"].max()
