"""Sweeps: every combination once, the same from one process, many or a cluster that loses a worker; resumable."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from distributed import LocalCluster
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.errors import InputError
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.document import place_of, read_document, varied
from drivetrain.study.read import study_from
from drivetrain.sweep import run
from drivetrain.sweep.points import read_sweep
from drivetrain.sweep.run import run_sweep
from drivetrain.sweep.shards import read_results, shard_path

STUDY = Path(__file__).parents[2] / "examples" / "one_axis" / "study.yaml"
TEXT = f"""
study: {STUDY}
vary:
  supply.voltage: [12 V, 24 V]
  ambient: [20 °C, 60 °C, cold]
scale:
  time: [1, 1.5]
points_per_shard: 2
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    place = tmp_path / "sweep.yaml"
    place.write_text(TEXT, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("serial")
    place = folder / "sweep.yaml"
    place.write_text(TEXT, encoding="utf-8")
    assert run_sweep(read_sweep(place), folder / "out", workers=0) == 6
    return folder / "out"


def same_bytes(one: Path, other: Path) -> bool:
    names = sorted(path.name for path in (one / "shards").iterdir())
    assert names == sorted(path.name for path in (other / "shards").iterdir())
    return all((one / "shards" / name).read_bytes() == (other / "shards" / name).read_bytes() for name in names)


def test_every_combination_once(serial: Path) -> None:
    results = read_results(serial)
    assert list(results["point"]) == list(range(12))
    varied_ = results[["supply.voltage", "ambient", "scale.time"]]
    assert len(varied_.drop_duplicates()) == 12
    assert list(results["scale.time"][:2]) == ["1", "1.5"]  # the last one varies fastest


def test_a_row_is_what_select_finds_there(serial: Path) -> None:
    document = read_document(STUDY)
    entries = {place_of(document, "supply.voltage"): "24 V", place_of(document, "ambient"): "60 °C"}
    found = select(changed(study_from(varied(document, entries)), TaskChange(time=1.5)))
    row = read_results(serial).set_index(["supply.voltage", "ambient", "scale.time"]).loc[("24 V", "60 °C", "1.5")]
    assert row["feasible"] == found.feasible
    assert row["objective"] == found.objective
    assert row["energy"] == found.evaluation.criteria["energy"]
    assert all(key in row["drives"] for keys in found.drives.values() for key in keys)


def test_a_point_that_is_no_study_is_told_and_stops_nothing(serial: Path) -> None:
    results = read_results(serial)
    wrong = results[results["ambient"] == "cold"]
    assert len(wrong) == 4
    assert (wrong["verdict"] == "FAULT").all()
    assert wrong["fault"].str.contains("cold").all()
    assert not wrong["feasible"].any()


def test_a_row_without_a_set_names_what_binds_and_weighs_nothing(tmp_path: Path) -> None:
    place = tmp_path / "sweep.yaml"
    place.write_text(f"study: {STUDY}\nvary: {{supply.peak_power: [2 W]}}\n", encoding="utf-8")
    run_sweep(read_sweep(place), tmp_path / "out", workers=0)
    row = read_results(tmp_path / "out").iloc[0]
    assert (row["verdict"], row["drives"]) == ("FAIL", "")
    assert row[["objective", "mass", "price", "energy"]].isna().all()  # the nearest set is not chosen
    assert (row["binding_joint"], row["binding_check"]) == ("supply", "supply peak power")
    assert row["utilisation"] > 1.0


def test_what_is_done_is_kept(file: Path, serial: Path, tmp_path: Path) -> None:
    sweep, out = read_sweep(file), tmp_path / "out"
    for shard in (0, 3):
        place = shard_path(out, shard)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(shard_path(serial, shard).read_bytes())
    kept = shard_path(out, 0).stat().st_mtime_ns
    assert run_sweep(sweep, out, workers=0) == 4
    assert shard_path(out, 0).stat().st_mtime_ns == kept
    assert run_sweep(sweep, out, workers=0) == 0
    assert same_bytes(out, serial)


def test_stopped_in_the_middle_it_goes_on(file: Path, serial: Path, tmp_path: Path) -> None:
    class Stop(Exception):
        pass

    def stop(done: int, of: int, text: str) -> None:
        if done == 3:
            raise Stop

    with pytest.raises(Stop):
        run_sweep(read_sweep(file), tmp_path / "out", workers=0, progress=stop)
    assert len(read_results(tmp_path / "out")) == 6
    assert run_sweep(read_sweep(file), tmp_path / "out", workers=0) == 3
    assert same_bytes(tmp_path / "out", serial)


def test_results_of_another_sweep_are_not_mixed_in(file: Path, serial: Path) -> None:
    file.write_text(TEXT.replace("1.5", "1.6"), encoding="utf-8")
    with pytest.raises(InputError, match="another sweep"):
        run_sweep(read_sweep(file), serial, workers=0)


def test_a_worker_that_dies_takes_nothing_with_it(file: Path, serial: Path, tmp_path: Path) -> None:
    """Real processes; the one that dies is killed while it works."""
    killed: list[int] = []
    quiet: dict[str, Any] = {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
    with LocalCluster(n_workers=2, threads_per_worker=1, silence_logs=50, **quiet) as cluster:

        def kill(done: int, of: int, text: str) -> None:
            if done == 1:
                pid = next(iter(cluster.workers.values())).pid
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

        run_sweep(read_sweep(file), tmp_path / "out", scheduler=cluster.scheduler_address, progress=kill)
    assert killed
    assert same_bytes(tmp_path / "out", serial)


def test_from_the_command_line(file: Path, serial: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["sweep", str(file), "--out", str(out), "--workers", "2"])
    assert done.exit_code == 0, done.output
    assert same_bytes(out, serial)
    page = (out / "sweep.html").read_text(encoding="utf-8")
    assert "data-chart" in page or "cold" in page
    assert "FAULT" in page


def test_all_faults_of_the_file_at_once(tmp_path: Path) -> None:
    place = tmp_path / "sweep.yaml"
    place.write_text(
        f"study: {STUDY}\nvari: 1\nrun: guess\npoints_per_shard: 0\n"
        "vary: {supply.volts.high: [1 V], ambient: [], joints: [a, a]}\nscale: {pace: [1], time: [0, -1]}\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError) as error:
        read_sweep(place)
    told = str(error.value)
    for part in ("vari", "guess", "points_per_shard", "supply.volts.high", "ambient", "twice", "pace", "scale.time"):
        assert part in told
    assert "'vary'" in told  # the nearest known name
    assert {fault.file.rpartition(":")[2] for fault in error.value.faults} == {"2", "3", "4", "5", "6"}
    place.write_text("study: nowhere.yaml\nrun: guess\n", encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_sweep(place)
    assert [fault.file for fault in error.value.faults] == [f"{place}:1", f"{place}:2"]
    place.write_text(f"study: {STUDY}\nvary: {{joints: [1], joints.hinge: [2]}}\n", encoding="utf-8")
    with pytest.raises(InputError, match="lies within"):
        read_sweep(place)


def test_no_scheduler_is_told(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "SCHEDULER_ANSWERS", "1s")
    with pytest.raises(InputError, match="no dask scheduler"):
        run_sweep(read_sweep(file), tmp_path / "out", scheduler="tcp://127.0.0.1:9")


def test_tables_read_by_pandas(serial: Path) -> None:
    frame = pd.read_parquet(serial / "shards")
    assert len(frame) == 12
    assert frame["objective"].dtype == float
