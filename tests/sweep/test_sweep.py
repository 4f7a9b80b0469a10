"""Sweeps: every combination once, the same from one process, many or a cluster that loses a worker; resumable."""

from __future__ import annotations

import itertools
import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from distributed import LocalCluster
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.document import place_of, read_document, varied
from drivetrain.study.read import study_from
from drivetrain.sweep import points, run
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


def test_points_of_shards_are_the_combinations_in_order(file: Path) -> None:
    """Twelve points in shards of five: the last is shorter, and each point knows its values."""
    sweep = read_sweep(file)
    assert (len(sweep), sweep.shards, replace(sweep, points_per_shard=12).shards) == (12, 6, 1)
    sweep = replace(sweep, points_per_shard=5)
    shards = [list(sweep.points(shard)) for shard in range(sweep.shards)]
    assert [len(one) for one in shards] == [5, 5, 2]
    wanted = itertools.product(["12 V", "24 V"], ["20 °C", "60 °C", "cold"], [1, 1.5])
    for index, (point, (volts, ambient, time)) in enumerate(zip(itertools.chain(*shards), wanted, strict=True)):
        assert (point.index, point.change) == (index, TaskChange(time=time))
        assert [value for _, value in point.entries] == [volts, ambient] and point.texts == (volts, ambient, str(time))


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        ("payload: [0, 0.5]", ""), ("time: [1.0e-9]", ""), ("payload: [-0.1]", "positive factors"),
        ("time: [0]", "positive factors"), ("time: [.inf]", "positive factors"), ("voltage: [yes]", "positive factors"),
        ("voltage: [1 V]", "positive factors"), ("time: [1, 1]", "twice"),
    ],
)  # fmt: skip
def test_factors_of_a_sweep(tmp_path: Path, scale: str, said: str) -> None:
    place = tmp_path / "sweep.yaml"
    place.write_text(f"study: {STUDY}\nscale: {{{scale}}}\n", encoding="utf-8")
    if said:
        with pytest.raises(InputError, match=said):
            read_sweep(place)
    else:
        assert read_sweep(place).names == (f"scale.{scale.partition(':')[0]}",)


def test_a_sweep_has_a_largest_number_of_points_and_at_least_two_values(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for most, refused in ((12, False), (11, True)):
        monkeypatch.setattr(points, "MOST_POINTS", most)
        if refused:
            with pytest.raises(InputError, match="12 points; 11 are allowed"):
                read_sweep(file)
        else:
            assert len(read_sweep(file)) == 12
    file.write_text(f"study: {STUDY}\n", encoding="utf-8")
    with pytest.raises(InputError, match="must vary something"):
        read_sweep(file)


def test_every_setting_of_a_sweep_is_in_its_digest(file: Path) -> None:
    sweep = read_sweep(file)
    others = [
        replace(sweep, run="size"), replace(sweep, points_per_shard=3), replace(sweep, names=(*sweep.names[:2], "x")),
        replace(sweep, values=(*sweep.values[:2], (1, 1.4))),
        replace(sweep, document=replace(sweep.document, content=sweep.document.content + b" ")),
    ]  # fmt: skip
    assert len({one.digest() for one in (sweep, *others)}) == 6
    assert read_sweep(file).digest() == sweep.digest()


def test_studies_are_read_once_and_the_oldest_is_dropped(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Six studies for twelve points, of which at most ``KEPT`` are held."""
    read: list[object] = []
    monkeypatch.setattr(run, "study_from", lambda document: read.append(document) or len(read))
    monkeypatch.setattr(run, "varied", lambda document, entries: entries)
    for kept, reads in ((6, 6), (5, 12)):  # the first is gone when it is asked for again
        read.clear()
        monkeypatch.setattr(run, "KEPT", kept)
        shards = run._Shards(read_sweep(file))
        for _ in range(2):
            studies = [study for shard in range(6) for _, study in shards.work(shard)]
        assert len(read) == reads and len(set(studies)) == 6 and studies[0] == studies[1] != studies[2]
        assert len(shards._kept) == kept


def test_drives_of_the_study_are_evaluated_at_each_point(tmp_path: Path) -> None:
    """``run: size`` is ``evaluate`` of the study's own drives; progress counts finished shards."""
    text = STUDY.read_text(encoding="utf-8").replace(
        "  hinge:\n", "  hinge:\n    drive: {motor: maxon_625858, gear: maxon_223094}\n"
    )
    (tmp_path / "door.csv").write_bytes((STUDY.parent / "door.csv").read_bytes())
    (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
    place, told = tmp_path / "sweep.yaml", []
    place.write_text(
        "study: study.yaml\nrun: size\nscale: {voltage: [1, 0.4]}\npoints_per_shard: 1\n", encoding="utf-8"
    )
    out = tmp_path / "out"
    run_sweep(read_sweep(place), out, workers=0, progress=lambda *one: told.append(one))
    assert told == [(0, 2, "shards"), (1, 2, "shards"), (2, 2, "shards")]
    study = study_from(read_document(tmp_path / "study.yaml"))
    for (_, row), factor in zip(read_results(out).iterrows(), (1.0, 0.4), strict=True):
        found = evaluate(changed(study, TaskChange(voltage=factor)))
        joint, check = found.binding
        assert (row["feasible"], row["verdict"], row["proof"]) == (found.feasible, str(found.verdict), "")
        assert row["drives"] == "hinge: maxon_625858 with maxon_223094"
        assert (row["binding_joint"], row["binding_check"]) == (joint, check.name)
        assert row["objective"] == found.objective
        for name in ("mass", "price", "energy", "utilisation"):
            np.testing.assert_equal(row[name], found.criteria.get(name, np.nan))
    with pytest.raises(InputError, match="must be 0 or more"):
        run_sweep(read_sweep(place), out, workers=-1)
